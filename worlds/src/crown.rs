//! The space that a plant's leaves fill.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Outline of a crown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CrownShape {
    /// Round, as trees grow.
    Ellipsoid,
    /// Straight sides, as hedges and curtains are cut.
    Box,
    /// Wide below and pointed above, as conifers are.
    Cone,
}

/// The space that a plant's leaves fill, plant frame: origin where the trunk leaves the ground, z up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crown {
    /// Its outline.
    pub shape: CrownShape,
    /// Its middle.
    pub center: Point3<f64>,
    /// Half its size along the plant's axes, meters.
    pub half_size: Vector3<f64>,
}

impl Crown {
    /// An upright crown over the trunk.
    pub(crate) fn standing(
        shape: CrownShape,
        base_m: f64,
        height_m: f64,
        length_m: f64,
        width_m: f64,
    ) -> Self {
        Crown {
            shape,
            center: Point3::new(0.0, 0.0, base_m + height_m / 2.0),
            half_size: Vector3::new(length_m, width_m, height_m) / 2.0,
        }
    }

    /// Height of its lower end above the ground, meters.
    pub fn base_m(&self) -> f64 {
        self.center.z - self.half_size.z
    }

    /// Height of its upper end above the ground, meters.
    pub fn top_m(&self) -> f64 {
        self.center.z + self.half_size.z
    }

    /// Volume, m3.
    pub fn volume_m3(&self) -> f64 {
        let product = self.half_size.product();
        match self.shape {
            CrownShape::Ellipsoid => 4.0 / 3.0 * PI * product,
            CrownShape::Box => 8.0 * product,
            CrownShape::Cone => 2.0 / 3.0 * PI * product,
        }
    }

    /// Area seen from above, m2.
    pub fn cover_m2(&self) -> f64 {
        let product = self.half_size.x * self.half_size.y;
        if self.shape == CrownShape::Box { 4.0 * product } else { PI * product }
    }

    /// How far out a point lies: 0 in the middle (for a cone on its axis), 1 on the outline, more outside.
    pub fn depth_ratio(&self, point: &Point3<f64>) -> f64 {
        let unit = (point - self.center).component_div(&self.half_size);
        match self.shape {
            CrownShape::Ellipsoid => unit.norm(),
            CrownShape::Box => unit.amax(),
            CrownShape::Cone => {
                // The radius falls from 1 at the lower end to 0 at the tip.
                let radius = (1.0 - unit.z) / 2.0;
                if (-1.0..1.0).contains(&unit.z) { unit.xy().norm() / radius } else { unit.z.abs().max(1.0) }
            }
        }
    }

    /// Whether a point is inside or on the outline.
    pub fn contains(&self, point: &Point3<f64>) -> bool {
        self.depth_ratio(point) <= 1.0
    }
}
