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
    /// x, y (meters), heading (radians).
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

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;
    use std::collections::BTreeSet;

    /// Points of an irregular grove, and the transform of the cells that they occupy.
    fn grove(cell_m: f64) -> (Vec<Vector2<f64>>, Transform) {
        let mut draws = Seed(4).stream("grove").at(0);
        let points: Vec<Vector2<f64>> =
            (0..60).map(|_| Vector2::new(draws.within(-4.0, 4.0), draws.within(-4.0, 4.0))).collect();
        let cell = |p: &Vector2<f64>| ((p.x / cell_m).floor() as i32, (p.y / cell_m).floor() as i32);
        let occupied: BTreeSet<_> = points.iter().map(cell).collect();
        let mut transform = Transform::default();
        transform.rebuild((-400, -400), (400, 400), |at| occupied.contains(&at));
        (points, transform)
    }

    fn seen_from(pose: &Vector3<f64>, points: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
        let (sin, cos) = pose.z.sin_cos();
        let turned = |p: Vector2<f64>| Vector2::new(cos * p.x + sin * p.y, cos * p.y - sin * p.x);
        points.iter().map(|p| turned(p - pose.xy())).collect()
    }

    #[test]
    fn a_slice_is_found_again_to_a_cell_from_a_third_of_a_meter_away() {
        let settings = MhdPaperSettings::default();
        let (points, transform) = grove(settings.cell_m);
        let pose = Vector3::new(0.35, -0.21, 0.12);
        let found = Search::default()
            .run(&transform, &seen_from(&pose, &points), Vector3::new(0.1, 0.05, 0.0), &settings)
            .unwrap();
        assert!((found.pose.xy() - pose.xy()).norm() < 1.5 * settings.cell_m, "{found:?}");
        assert!((found.pose.z - pose.z).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn a_third_of_outliers_moves_the_answer_by_less_than_a_cell() {
        let settings = MhdPaperSettings::default();
        let (points, transform) = grove(settings.cell_m);
        let mut seen = points.clone();
        for (n, point) in seen.iter_mut().enumerate().filter(|(n, _)| n % 4 == 0) {
            *point += Vector2::new(0.9 + 0.01 * n as f64, -0.7);
        }
        let found =
            Search::default().run(&transform, &seen, Vector3::new(0.06, -0.04, 0.02), &settings).unwrap();
        assert!(found.pose.xy().norm() < 1.5 * settings.cell_m && found.pose.z.abs() < 0.01, "{found:?}");
    }

    #[test]
    fn nothing_to_match_is_no_answer() {
        let settings = MhdPaperSettings::default();
        let (_, transform) = grove(settings.cell_m);
        assert_eq!(Search::default().run(&transform, &[], Vector3::zeros(), &settings), None);
    }

    #[test]
    fn the_cost_is_the_mean_of_the_smallest_distances() {
        let settings = MhdPaperSettings { keep_ratio: 0.5, ..MhdPaperSettings::default() };
        let mut transform = Transform::default();
        transform.rebuild((-100, -100), (100, 100), |at| at == (0, 0));
        let off = |cells: f64| Vector2::new((cells + 0.5) * settings.cell_m, 0.5 * settings.cell_m);
        let points: Vec<Vector2<f64>> = [0.0, 3.0, 5.0, 70.0].map(off).to_vec();
        let mut search = Search::default();
        search.turn(&points, 0.0);
        // Two of four are kept: 0 and 3 cells.
        assert_eq!(search.cost(&transform, &Vector3::zeros(), &settings), (1.5, 3.0));
        let distances = search.distances(&transform, &points, &Vector3::zeros(), settings.cell_m).to_vec();
        assert_eq!(distances, [0.0, 3.0, 5.0, 70.0]);
    }
}
