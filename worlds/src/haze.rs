//! Foliage as a turbid medium (Beer-Lambert): the cheap alternative to a plant's own leaves.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

/// The distribution of the leaves' inclinations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LeafAngle {
    /// Normals uniform on the sphere.
    #[default]
    Spherical,
}

impl LeafAngle {
    /// Mean projection of a leaf of area 1 on the plane across a beam, `G`, for the cosine of the angle between beam
    /// and zenith (Ross 1981).
    pub fn projection(&self, _cos_zenith: f64) -> f64 {
        match self {
            LeafAngle::Spherical => 0.5,
        }
    }
}

/// Outline of a volume of haze.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outline {
    /// `half_size` are the semi-axes.
    Ellipsoid,
    /// `half_size` are half the sides.
    Box,
}

/// A volume of a plant filled evenly with leaves too many to tell apart, plant frame.
///
/// A beam survives `d` meters of it with probability `exp(-G leaf_area_per_m d)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Haze {
    /// Its shape.
    pub outline: Outline,
    /// Its middle.
    pub center: Point3<f64>,
    /// Half its size along the plant's axes, meters.
    pub half_size: Vector3<f64>,
    /// One-sided leaf area per volume, m2/m3 (leaf area density), in the plant's own frame.
    pub leaf_area_per_m: f64,
    /// How the leaves are inclined.
    pub leaf_angle: LeafAngle,
}
