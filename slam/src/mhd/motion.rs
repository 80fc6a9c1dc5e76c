//! The state: pose at the middle of the sweep and the velocity within it.
//!
//! The middle is the instant that the points of a turning lidar determine best; the end is half a sweep of that
//! velocity away.

use arborloop_base::{Pose2, Time, pose2};
use nalgebra::{Vector2, Vector3};

/// How long a velocity is believed, seconds: after a pause the robot may have stopped or turned.
const MEMORY_S: f64 = 5.0;

/// No robot between trees is faster, m/s and rad/s: two stamps that nearly coincide must not throw it off the map.
const SPEED_MPS_MAX: f64 = 10.0;
const TURN_RADPS_MAX: f64 = 6.0;

/// Motion through one sweep, map frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Motion {
    /// The instant of the pose.
    pub(crate) stamp: Time,
    /// x, y (metres) and heading (radians) of the flat base frame at `stamp`; the heading is not wrapped.
    pub(crate) pose: Vector3<f64>,
    /// Their rates, per second, map frame.
    pub(crate) velocity: Vector3<f64>,
}

impl Motion {
    /// The pose `after_s` later, at constant velocity.
    pub(crate) fn after(&self, after_s: f64) -> Pose2 {
        let pose = self.pose + self.velocity * after_s;
        pose2(pose.x, pose.y, pose.z)
    }

    /// A point met `after_s` after the stamp, from the flat base frame of that instant into the map.
    pub(crate) fn place(&self, at: &Vector2<f64>, after_s: f64) -> Vector2<f64> {
        let pose = self.pose + self.velocity * after_s;
        let (sin, cos) = pose.z.sin_cos();
        Vector2::new(pose.x + cos * at.x - sin * at.y, pose.y + sin * at.x + cos * at.y)
    }

    /// The same with a velocity that a robot can have.
    pub(crate) fn sane(mut self) -> Motion {
        let speed_mps = self.velocity.xy().norm();
        let share = if speed_mps > SPEED_MPS_MAX { SPEED_MPS_MAX / speed_mps } else { 1.0 };
        self.velocity.x *= share;
        self.velocity.y *= share;
        self.velocity.z = self.velocity.z.clamp(-TURN_RADPS_MAX, TURN_RADPS_MAX);
        self
    }

    /// What is expected at a later instant: the velocity fades with the time since it was measured.
    pub(crate) fn predict(&self, stamp: Time) -> Motion {
        let elapsed_s = (stamp - self.stamp).seconds().max(0.0);
        let believed_s = MEMORY_S * (1.0 - (-elapsed_s / MEMORY_S).exp());
        Motion {
            stamp,
            pose: self.pose + self.velocity * believed_s,
            velocity: self.velocity * (-elapsed_s / MEMORY_S).exp(),
        }
    }
}
