//! The one place where the engine's types meet ours.

use arborloop_base::Pose;
use nalgebra::Point3;
use rapier3d_f64::math::{Pose as EnginePose, Vector as EngineVector};

/// A pose as the engine wants it.
pub(crate) fn to_engine(pose: &Pose) -> EnginePose {
    EnginePose::from(*pose)
}

/// A point as the engine wants it.
pub(crate) fn point_to_engine(point: &Point3<f64>) -> EngineVector {
    EngineVector::new(point.x, point.y, point.z)
}
