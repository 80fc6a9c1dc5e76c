//! What a SLAM system answers.

use crate::pose::Pose;
use crate::time::Time;
use nalgebra::Matrix6;
use serde::{Deserialize, Serialize};

/// How much a system trusts its own estimate. Being lost is a value, not an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Health {
    /// The match is good.
    Tracking,
    /// Something is wrong with the last sweeps; the pose leans on prediction.
    Degraded,
    /// The pose must not be used.
    Lost,
}

/// A system's pose at the end of a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The instant the pose belongs to: the `end` of the sweep that it answers.
    pub stamp: Time,
    /// The base in the system's own map, whose origin is the base at the first sweep's end.
    pub map_from_base: Pose,
    /// Covariance of x, y, z (m^2) and of roll, pitch, yaw (rad^2), in this order; map frame.
    pub covariance: Option<Matrix6<f64>>,
    /// How much to trust it.
    pub health: Health,
}
