//! What a system may know of the robot that carries it.

use arborloop_base::Pose;

/// The mounting of the lidar: all that a system is told of its robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rig {
    /// The lidar in the base frame, meters; the identity for planar recordings.
    pub base_from_lidar: Pose,
}

impl Default for Rig {
    fn default() -> Self {
        Rig { base_from_lidar: Pose::identity() }
    }
}
