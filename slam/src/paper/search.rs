//! The k-best MHD search: exhaustive in steps of 8, 4, 2 and 1 cm, each repeated until nothing improves.
//!
//! The authors' code multiplies the absolute heading by 0.95 at every trial, which pulls it toward zero; here the
//! trials are centered on the heading so far.

use super::settings::MhdPaperSettings;
use super::transform::Transform;
use crate::kbest::kept_of;
use nalgebra::{Vector2, Vector3};

/// Trials to each side of the best so far, in x and y and in heading.
const SIDE: i32 = 2;
const TURNS: i32 = 7;
/// More repetitions of one step than this walk away from the prediction.
const REPEATS_MAX: usize = 20;

/// A pose and how badly it fits: the mean of the k smallest distances and the k-th, both in cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Found {
    /// x, y (metres), heading (radians).
    pub(crate) pose: Vector3<f64>,
    /// Mean of the k smallest distances, cells; ties go to the smaller k-th distance, the second number.
    pub(crate) cost: (f32, f32),
}

/// Searches; keeps its memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Search {
    turned: Vec<Vector2<f64>>,
    distances: Vec<f32>,
}

impl Search {
    /// The best pose around `start` for points in the frame of the pose; `None` without points.
    pub(crate) fn run(
        &mut self,
        transform: &Transform,
        points: &[Vector2<f64>],
        start: Vector3<f64>,
        settings: &MhdPaperSettings,
    ) -> Option<Found> {
        kept_of(points.len(), settings.keep_ratio)?;
        self.turn(points, start.z);
        let mut best = Found { pose: start, cost: self.cost(transform, &start, settings) };
        for step_m in &settings.search_steps_m {
            for _ in 0..REPEATS_MAX {
                let center = best.pose;
                for turn in -TURNS..=TURNS {
                    let heading = center.z + f64::from(turn) * settings.search_rad_per_m * step_m;
                    self.turn(points, heading);
                    for j in -SIDE..=SIDE {
                        for i in -SIDE..=SIDE {
                            let x_m = center.x + f64::from(i) * step_m;
                            let pose = Vector3::new(x_m, center.y + f64::from(j) * step_m, heading);
                            let cost = self.cost(transform, &pose, settings);
                            if cost < best.cost {
                                best = Found { pose, cost };
                            }
                        }
                    }
                }
                if best.pose == center {
                    break;
                }
            }
        }
        Some(best)
    }

    /// Distance of every point at a pose, cells.
    pub(crate) fn distances(
        &mut self,
        transform: &Transform,
        points: &[Vector2<f64>],
        pose: &Vector3<f64>,
        cell_m: f64,
    ) -> &[f32] {
        self.turn(points, pose.z);
        self.measure(transform, pose, cell_m);
        &self.distances
    }

    fn turn(&mut self, points: &[Vector2<f64>], heading_rad: f64) {
        let (sin, cos) = heading_rad.sin_cos();
        self.turned.clear();
        self.turned.extend(points.iter().map(|p| Vector2::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y)));
    }

    fn measure(&mut self, transform: &Transform, pose: &Vector3<f64>, cell_m: f64) {
        self.distances.clear();
        let (x, y, per_m) = (pose.x / cell_m, pose.y / cell_m, 1.0 / cell_m);
        self.distances.extend(self.turned.iter().map(|point| {
            let cell = ((x + point.x * per_m).floor() as i32, (y + point.y * per_m).floor() as i32);
            transform.distance(cell)
        }));
    }

    fn cost(
        &mut self,
        transform: &Transform,
        pose: &Vector3<f64>,
        settings: &MhdPaperSettings,
    ) -> (f32, f32) {
        self.measure(transform, pose, settings.cell_m);
        let Some(kept) = kept_of(self.distances.len(), settings.keep_ratio) else {
            return (f32::MAX, f32::MAX);
        };
        let (_, kth, _) = self.distances.select_nth_unstable_by(kept - 1, f32::total_cmp);
        let kth = *kth;
        // Whole numbers of cells: the sum is exact in f32 below 2^24.
        (self.distances[..kept].iter().sum::<f32>() / kept as f32, kth)
    }
}
