//! The ground, from the lidar alone: a plane that levels the sweep, and a surface that gives heights.
//!
//! Ground that bends by a few degrees lies a hand's breadth off its plane at 7 m: cones and crowns would be seen there at
//! another height than from near by, and with it at another width.

use super::hits::Hit;
use super::plumb::upright;
use nalgebra::{Matrix3, Matrix6, Rotation3, Vector3, Vector6};

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

/// Every n-th point of the plane is enough for the surface.
const SURFACE_STRIDE: usize = 3;
/// The same for the surface, which begins at the plane.
const SURFACE_WIDTHS_M: [(f64, f64); 4] = [(0.4, 0.8), (0.25, 0.5), (0.15, 0.4), (0.12, 0.3)];
/// What is expected of the surface's departure from the plane (one standard deviation): at the robot, meters; its slope
/// there; and its bends, per meter.
const DEPARTURES: [f64; 6] = [0.1, 0.03, 0.03, 0.02, 0.02, 0.02];
/// Scatter of a point about the surface, meters: grass and stones. Neighbors share it: about so many points make one
/// independent measurement.
const SCATTER_M: f64 = 0.05;
const POINTS_PER_MEASUREMENT: f64 = 33.0;

/// The plane `z = slope_x x + slope_y y - height_m` in the axes of the base, seen from the lidar, and the surface's
/// departure from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ground {
    slope_x: f64,
    slope_y: f64,
    height_m: f64,
    /// Factors of 1, x, y, x^2, x y and y^2.
    departure: Vector6<f64>,
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
            None => Ground::plane(0.0, 0.0, -median_z(points)?),
        };
        for (above_m, below_m) in WIDTHS_M {
            plane = plane.refit(points, above_m, below_m)?;
        }
        let is_ground = plane.slope_x.hypot(plane.slope_y) < SLOPE_MAX && plane.height_m > 0.0;
        is_ground.then(|| plane.bent(points))
    }

    fn plane(slope_x: f64, slope_y: f64, height_m: f64) -> Ground {
        Ground { slope_x, slope_y, height_m, departure: Vector6::zeros() }
    }

    /// The plane with the surface that fits the points.
    fn bent(mut self, points: &[Vector3<f64>]) -> Ground {
        for (above_m, below_m) in SURFACE_WIDTHS_M {
            let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
            for point in points.iter().step_by(SURFACE_STRIDE) {
                let row = terms(point);
                let from_plane_m = point.z - self.plane_m(point);
                let weight = weight(from_plane_m - row.dot(&self.departure), above_m, below_m);
                normal.ger(weight, &row, &row, 1.0);
                right += row * (weight * from_plane_m);
            }
            for (axis, expected) in DEPARTURES.into_iter().enumerate() {
                normal[(axis, axis)] += POINTS_PER_MEASUREMENT * (SCATTER_M / expected).powi(2);
            }
            let solved = normal.cholesky().map(|normal| normal.solve(&right));
            let Some(departure) = solved.filter(|solved| solved.iter().all(|n| n.is_finite())) else { break };
            self.departure = departure;
        }
        self
    }

    /// One step of iteratively reweighted least squares with Tukey's weights.
    fn refit(&self, points: &[Vector3<f64>], above_m: f64, below_m: f64) -> Option<Ground> {
        let (mut normal, mut right, mut inliers) = (Matrix3::zeros(), Vector3::zeros(), 0);
        for point in points {
            let weight = weight(point.z - self.plane_m(point), above_m, below_m);
            if weight > 0.0 {
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
        let is_finite = solved.iter().all(|n| n.is_finite());
        is_finite.then(|| Ground::plane(solved.x, solved.y, -solved.z))
    }

    fn plane_m(&self, at: &Vector3<f64>) -> f64 {
        self.slope_x * at.x + self.slope_y * at.y - self.height_m
    }

    /// Height of a point above the surface, meters.
    pub(crate) fn above_m(&self, at: &Vector3<f64>) -> f64 {
        (at.z - self.plane_m(at) - terms(at).dot(&self.departure)) * self.normal_z()
    }

    /// The z component of the plane's normal.
    fn normal_z(&self) -> f64 {
        1.0 / (1.0 + self.slope_x * self.slope_x + self.slope_y * self.slope_y).sqrt()
    }

    /// Turns the axes of the base level, keeping its heading.
    pub(crate) fn level_from_base(&self) -> Rotation3<f64> {
        upright(&Vector3::new(-self.slope_x, -self.slope_y, 1.0))
    }

    /// Height of the lidar above the plane, meters.
    pub(crate) fn lidar_height_m(&self) -> f64 {
        self.height_m * self.normal_z()
    }
}

/// Tukey's weight of a point that lies `residual_m` above what was expected.
fn weight(residual_m: f64, above_m: f64, below_m: f64) -> f64 {
    let share = residual_m / if residual_m > 0.0 { above_m } else { below_m };
    if share.abs() < 1.0 { (1.0 - share * share).powi(2) } else { 0.0 }
}

/// What the surface's departure is made of at a place. Beyond what was seen it goes on straight.
fn terms(at: &Vector3<f64>) -> Vector6<f64> {
    let level_m = at.xy().norm();
    let seen = (LEVEL_M_MAX / level_m).min(1.0);
    let straight_on = (2.0 - seen) * seen;
    Vector6::new(
        1.0,
        at.x,
        at.y,
        at.x * at.x * straight_on,
        at.x * at.y * straight_on,
        at.y * at.y * straight_on,
    )
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
        let ground = Ground::plane(0.3, -0.2, 0.5);
        let forward = ground.level_from_base() * Vector3::x();
        assert!(forward.y.abs() < 1e-12 && forward.x > 0.0);
    }

    #[test]
    fn heights_count_from_ground_that_bends_and_beyond_it_from_where_it_points() {
        let flat = meadow(0.05, -0.03, 0.5);
        let bend = |x: f64, y: f64| 0.006 * x * x - 0.004 * x * y - 0.003 * y * y;
        let bent: Vec<Hit> = flat
            .iter()
            .map(|hit| Hit { at: hit.at + Vector3::z() * bend(hit.at.x, hit.at.y), ..*hit })
            .collect();
        let ground = fit(&bent).unwrap();
        for (x, y) in [(6.0, 2.0), (-7.0, 3.0), (1.0, -8.0)] {
            let at = Vector3::new(x, y, 0.05 * x - 0.03 * y - 0.5 + bend(x, y) + 0.6);
            // The grass's 2.5 cm, and as much again of stems and of what is expected of meadows.
            assert!((ground.above_m(&at) - 0.6).abs() < 0.05, "{} at {x} {y}", ground.above_m(&at));
        }
        let height = |level_m: f64| ground.above_m(&(Vector3::new(0.8, 0.6, 0.0) * level_m));
        let slope = |level_m: f64| height(level_m + 0.01) - height(level_m - 0.01);
        assert!((slope(9.95) - slope(10.05)).abs() < 1e-4 && (slope(12.0) - slope(25.0)).abs() < 1e-6);
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
