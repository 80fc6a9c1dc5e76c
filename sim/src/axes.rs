//! The one place where the engine's types meet ours.

use arborloop_base::Pose;
use nalgebra::{Point3, Vector3};
use rapier3d_f64::math::{Pose as EnginePose, Vector as EngineVector};

/// A pose as the engine wants it.
pub(crate) fn to_engine(pose: &Pose) -> EnginePose {
    EnginePose::from(*pose)
}

/// A pose as the engine says it.
pub(crate) fn from_engine(pose: &EnginePose) -> Pose {
    Pose::from(*pose)
}

/// A point as the engine wants it.
pub(crate) fn point_to_engine(point: &Point3<f64>) -> EngineVector {
    EngineVector::new(point.x, point.y, point.z)
}

/// A vector as the engine wants it.
pub(crate) fn vector_to_engine(vector: &Vector3<f64>) -> EngineVector {
    EngineVector::new(vector.x, vector.y, vector.z)
}

/// A vector as the engine says it.
pub(crate) fn vector_from_engine(vector: &EngineVector) -> Vector3<f64> {
    Vector3::new(vector.x, vector.y, vector.z)
}
