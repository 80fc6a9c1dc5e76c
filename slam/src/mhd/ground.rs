//! The ground as a plane, from the lidar alone: it levels the sweep and gives heights.

use super::hits::Hit;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Only ground nearer than this is plane enough, metres.
const LEVEL_M_MAX: f64 = 10.0;
/// Fewer returns on the plane make no ground.
const INLIERS_MIN: usize = 60;
/// Steeper than this is no ground that a robot stands on: the tangent of 25 degrees.
const SLOPE_MAX: f64 = 0.47;
/// Every n-th return is enough for a plane.
const STRIDE: usize = 4;
/// Widths of the weights above and below the plane, metres, from the first look to the last. Grass, weeds and stems
/// stand above the ground and nothing lies below it, so the plane is pulled down.
const WIDTHS_M: [(f64, f64); 6] =
    [(0.4, 0.8), (0.25, 0.5), (0.15, 0.4), (0.12, 0.3), (0.12, 0.3), (0.12, 0.3)];

/// The plane `z = slope_x x + slope_y y - height_m` in the axes of the base, seen from the lidar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ground {
    slope_x: f64,
    slope_y: f64,
    height_m: f64,
}

impl Ground {
    /// Fits the plane to a sweep, beginning at the plane of the sweep before. `None` when too little ground is seen.
    pub(crate) fn fit(hits: &[Hit], before: Option<Ground>) -> Option<Ground> {
        let low = |hit: &&Hit| hit.level_m < LEVEL_M_MAX && hit.at.z < 0.0;
        let points: Vec<Vector3<f64>> = hits.iter().step_by(STRIDE).filter(low).map(|hit| hit.at).collect();
        let mut plane = match before {
            Some(before) => before,
            None => Ground { slope_x: 0.0, slope_y: 0.0, height_m: -median_z(&points)? },
        };
        for (above_m, below_m) in WIDTHS_M {
            plane = plane.refit(&points, above_m, below_m)?;
        }
        (plane.slope_x.hypot(plane.slope_y) < SLOPE_MAX && plane.height_m > 0.0).then_some(plane)
    }

    /// One step of iteratively reweighted least squares with Tukey's weights.
    fn refit(&self, points: &[Vector3<f64>], above_m: f64, below_m: f64) -> Option<Ground> {
        let (mut normal, mut right, mut inliers) = (Matrix3::zeros(), Vector3::zeros(), 0);
        for point in points {
            let residual_m = point.z - (self.slope_x * point.x + self.slope_y * point.y - self.height_m);
            let share = residual_m / if residual_m > 0.0 { above_m } else { below_m };
            if share.abs() < 1.0 {
                let weight = (1.0 - share * share).powi(2);
                let row = Vector3::new(point.x, point.y, 1.0);
                normal += row * row.transpose() * weight;
                right += row * (weight * point.z);
                inliers += 1;
            }
        }
        if inliers < INLIERS_MIN {
            return None;
        }
        let solved = normal.cholesky()?.solve(&right);
        solved.iter().all(|n| n.is_finite()).then_some(Ground {
            slope_x: solved.x,
            slope_y: solved.y,
            height_m: -solved.z,
        })
    }

    /// Turns the axes of the base level, keeping its heading.
    pub(crate) fn level_from_base(&self) -> Rotation3<f64> {
        let up = Vector3::new(-self.slope_x, -self.slope_y, 1.0).normalize();
        let tilt = Rotation3::rotation_between(&up, &Vector3::z()).unwrap_or_else(Rotation3::identity);
        let forward = tilt * Vector3::x();
        Rotation3::from_axis_angle(&Vector3::z_axis(), -forward.y.atan2(forward.x)) * tilt
    }

    /// Height of the lidar above the plane, metres.
    pub(crate) fn lidar_height_m(&self) -> f64 {
        self.height_m / (1.0 + self.slope_x * self.slope_x + self.slope_y * self.slope_y).sqrt()
    }
}

fn median_z(points: &[Vector3<f64>]) -> Option<f64> {
    let mut heights: Vec<f64> = points.iter().filter(|p| p.xy().norm() < 5.0).map(|p| p.z).collect();
    let middle = heights.len() / 2;
    (!heights.is_empty()).then(|| *heights.select_nth_unstable_by(middle, f64::total_cmp).1)
}
