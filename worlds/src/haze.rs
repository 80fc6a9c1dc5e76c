//! Foliage as a turbid medium (Beer-Lambert): the cheap alternative to a plant's own leaves.

use crate::leaf_angle::LeafAngle;
use nalgebra::{Point3, Vector3};
use std::f64::consts::PI;

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

impl Haze {
    /// Volume, m3.
    pub fn volume_m3(&self) -> f64 {
        let product = self.half_size.product();
        match self.outline {
            Outline::Ellipsoid => 4.0 / 3.0 * PI * product,
            Outline::Box => 8.0 * product,
        }
    }

    /// One-sided leaf area in it, m2, in the plant's own frame.
    pub fn leaf_area_m2(&self) -> f64 {
        self.leaf_area_per_m * self.volume_m3()
    }

    /// The corners of the box around it, plant frame.
    pub fn corners(&self) -> [Point3<f64>; 8] {
        std::array::from_fn(|corner| {
            let sign = |bit: usize| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            self.center + self.half_size.component_mul(&Vector3::new(sign(0), sign(1), sign(2)))
        })
    }
}
