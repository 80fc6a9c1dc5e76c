//! The ground as a plane, from the lidar alone: it levels the sweep and gives heights.

use super::hits::Hit;
use super::plumb::upright;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Only ground nearer than this is plane enough, meters.
const LEVEL_M_MAX: f64 = 10.0;
/// Fewer returns on the plane make no ground.
const INLIERS_MIN: usize = 60;
/// Steeper than this is no ground that a robot stands on: the tangent of 25 degrees.
const SLOPE_MAX: f64 = 0.47;
/// Every n-th return is enough for a plane.
const STRIDE: usize = 4;
/// Widths of the weights above and below the plane, meters, from the first look to the last. Grass, weeds and stems
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
    /// `points` is memory to work in.
    pub(crate) fn fit(
        hits: &[Hit],
        before: Option<Ground>,
        points: &mut Vec<Vector3<f64>>,
    ) -> Option<Ground> {
        let low = |hit: &&Hit| hit.level_m < LEVEL_M_MAX && hit.at.z < 0.0;
        points.clear();
        points.extend(hits.iter().step_by(STRIDE).filter(low).map(|hit| hit.at));
        let mut plane = match before {
            Some(before) => before,
            None => Ground { slope_x: 0.0, slope_y: 0.0, height_m: -median_z(points)? },
        };
        for (above_m, below_m) in WIDTHS_M {
            plane = plane.refit(points, above_m, below_m)?;
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
        upright(&Vector3::new(-self.slope_x, -self.slope_y, 1.0))
    }

    /// Height of the lidar above the plane, meters.
    pub(crate) fn lidar_height_m(&self) -> f64 {
        self.height_m / (1.0 + self.slope_x * self.slope_x + self.slope_y * self.slope_y).sqrt()
    }
}

fn median_z(points: &[Vector3<f64>]) -> Option<f64> {
    let mut heights: Vec<f64> = points.iter().filter(|p| p.xy().norm() < 5.0).map(|p| p.z).collect();
    let middle = heights.len() / 2;
    (!heights.is_empty()).then(|| *heights.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;

    fn fit(hits: &[Hit]) -> Option<Ground> {
        Ground::fit(hits, None, &mut Vec::new())
    }

    /// Hits on a plane with blades of grass up to 5 cm above it, and a wall of stems.
    fn meadow(slope_x: f64, slope_y: f64, height_m: f64) -> Vec<Hit> {
        let mut draws = Seed(2).stream("meadow").at(0);
        (0..8000)
            .map(|n| {
                let bearing_rad = draws.within(-3.1, 3.1);
                let level_m = draws.within(1.5, 9.0);
                let (x, y) = (level_m * bearing_rad.cos(), level_m * bearing_rad.sin());
                let above_m = if n % 7 == 0 { draws.within(0.1, 0.4) } else { draws.within(0.0, 0.05) };
                let at = Vector3::new(x, y, slope_x * x + slope_y * y - height_m + above_m);
                Hit { at, level_m, bearing_rad, after_s: 0.0, ring: 0 }
            })
            .collect()
    }

    #[test]
    fn the_plane_is_found_under_grass_and_stems() {
        for (slope_x, slope_y) in [(0.0, 0.0), (0.08, -0.05), (-0.2, 0.1)] {
            let ground = fit(&meadow(slope_x, slope_y, 0.5)).unwrap();
            let up = Vector3::new(-slope_x, -slope_y, 1.0).normalize();
            let leveled = ground.level_from_base() * up;
            // Half of the grass's 5 cm, and as much again over 5 m for the stems' pull on the slopes.
            assert!(leveled.xy().norm() < 0.01, "{leveled:?}");
            assert!((ground.lidar_height_m() - 0.475 * up.z).abs() < 0.025, "{}", ground.lidar_height_m());
        }
    }

    #[test]
    fn leveling_keeps_the_heading() {
        let ground = Ground { slope_x: 0.3, slope_y: -0.2, height_m: 0.5 };
        let forward = ground.level_from_base() * Vector3::x();
        assert!(forward.y.abs() < 1e-12 && forward.x > 0.0);
    }

    #[test]
    fn a_wall_or_nothing_is_no_ground() {
        assert_eq!(fit(&[]), None);
        let wall = |n: i32| Vector3::new(2.0, f64::from(n % 20) * 0.1 - 1.0, -0.01 * f64::from(n));
        let hits: Vec<Hit> = (0..400)
            .map(|n| Hit { at: wall(n), level_m: 2.2, bearing_rad: 0.0, after_s: 0.0, ring: 0 })
            .collect();
        assert_eq!(fit(&hits), None);
    }
}
