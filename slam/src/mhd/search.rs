//! The exhaustive search: all poses of a lattice around the prediction, by the k-best mean of the coarse distances.
//!
//! Near the prediction every pose is looked at. A wide lattice is searched by branch and bound: a distance changes by no
//! more than the place does, so one look at the middle of a block of positions bounds them all from below.

use super::features::Feature;
use super::field::{COARSE_LEVELS, Field};
use super::motion::Motion;
use crate::kbest::kept_of;
use crate::raster::CellIndex;
use nalgebra::Vector3;
use std::f64::consts::PI;

/// So many points are enough to rank the poses of a lattice.
const POINTS_MAX: usize = 120;
/// Hypotheses nearer to each other than this are one, meters and radians.
const DISTINCT_M: f64 = 0.25;
const DISTINCT_RAD: f64 = 0.12;

/// Positions along the side of the blocks that a wide search begins with: their corners must lie nearer to their middle
/// than the distances are capped, else nothing is bounded.
const BLOCK: i32 = 4;
/// A wide search finds every pose of its lattice that is worse than the best by less than this, meters.
const MARGIN_M: f64 = 0.03;

/// How far and how finely to search around the prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lattice {
    /// Half the side of the square of positions, meters.
    pub(crate) reach_m: f64,
    /// Half the interval of headings, radians; from pi on, the full circle.
    pub(crate) reach_rad: f64,
    /// Distance between neighboring positions, meters; rounded to whole cells.
    pub(crate) step_m: f64,
    /// Difference between neighboring headings, radians.
    pub(crate) step_rad: f64,
    /// What the far corner of the lattice must be better by than its center, meters. Zero for a wide lattice, of which
    /// only the poses about as good as the best are found.
    pub(crate) prior_m: f64,
}

/// A pose worth refining.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hypothesis {
    /// x, y, heading; map frame.
    pub(crate) pose: Vector3<f64>,
    /// k-best mean of the coarse distances, with the prior, meters.
    pub(crate) cost_m: f64,
}

impl Hypothesis {
    /// Whether a pose is the same hypothesis.
    pub(crate) fn is_near(&self, pose: &Vector3<f64>) -> bool {
        let apart = self.pose - pose;
        apart.xy().norm() <= DISTINCT_M && arborloop_base::wrap_angle(apart.z).abs() <= DISTINCT_RAD
    }
}

/// How many points have each level of the coarse distances.
type Counts = [u16; COARSE_LEVELS];

/// Searches lattices; keeps its memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Search {
    cells: Vec<(usize, CellIndex)>,
    counts: Vec<Counts>,
    scored: Vec<Hypothesis>,
    blocks: Vec<Block>,
    chosen: Vec<Hypothesis>,
}

/// A square of positions of a wide lattice.
#[derive(Debug, Clone, Copy)]
struct Block {
    /// Lowest position along x and y, in steps.
    low: (i32, i32),
    /// Positions along its side.
    side: i32,
    /// No position in it is better, meters.
    bound_m: f64,
}

impl Search {
    /// The best distinct poses of the lattice, best first, `wanted` at most. The prediction itself is always on the lattice.
    pub(crate) fn run(
        &mut self,
        field: &Field,
        features: &[Feature],
        predicted: &Motion,
        lattice: &Lattice,
        keep_ratio: f64,
        wanted: usize,
    ) -> &[Hypothesis] {
        let stride = features.len().div_ceil(POINTS_MAX).max(1);
        let step = ((lattice.step_m / field.cell_m()).round() as i32).max(1);
        let steps = (lattice.reach_m / (f64::from(step) * field.cell_m())).ceil() as i32;
        let full = lattice.reach_rad >= PI;
        let turns = (lattice.reach_rad.min(PI) / lattice.step_rad).ceil() as i32;
        // On the full circle the first and the last heading are the same.
        let (first, last) = if full { (-turns + 1, turns) } else { (-turns, turns) };
        let step_rad = if full { PI / f64::from(turns) } else { lattice.step_rad };
        self.scored.clear();
        let mut best_m = f64::INFINITY;
        for turn in first..=last {
            let turn_rad = f64::from(turn) * step_rad;
            let mut turned = *predicted;
            turned.pose.z += turn_rad;
            self.cells.clear();
            let placing = turned.placing();
            self.cells.extend(features.iter().step_by(stride).map(|feature| {
                let at = placing.place(&feature.at, feature.after_s);
                (feature.layer, field.cell_of(at.x, at.y))
            }));
            let Some(kept) = kept_of(self.cells.len(), keep_ratio) else { return &[] };
            if lattice.prior_m <= 0.0 {
                best_m = self.descend(field, &turned.pose, step, steps, kept, best_m);
                continue;
            }
            self.count_all(field, step, steps);
            let mut counts = self.counts.iter();
            for j in -steps..=steps {
                for i in -steps..=steps {
                    let Some(counts) = counts.next() else { break };
                    let mean_m = mean_of(counts, field, kept, 0);
                    let shift = |n: i32| f64::from(n * step) * field.cell_m();
                    let off = (shift(i).powi(2) + shift(j).powi(2)) / lattice.reach_m.powi(2)
                        + (turn_rad / lattice.reach_rad).powi(2);
                    let pose = turned.pose + Vector3::new(shift(i), shift(j), 0.0);
                    let cost_m = mean_m + lattice.prior_m * off;
                    self.scored.push(Hypothesis { pose, cost_m });
                }
            }
        }
        self.distinct(wanted)
    }

    /// Scores the positions at one heading that are worse than the best by less than the margin; the best so far,
    /// meters.
    fn descend(
        &mut self,
        field: &Field,
        turned: &Vector3<f64>,
        step: i32,
        steps: i32,
        kept: usize,
        mut best_m: f64,
    ) -> f64 {
        let mut blocks = std::mem::take(&mut self.blocks);
        blocks.clear();
        for j in (-steps..=steps).step_by(BLOCK as usize) {
            for i in (-steps..=steps).step_by(BLOCK as usize) {
                blocks.push(self.block(field, (i, j), BLOCK, step, kept));
            }
        }
        // The most promising comes last and is looked at first.
        blocks.sort_by(|a, b| b.bound_m.total_cmp(&a.bound_m));
        while let Some(block) = blocks.pop() {
            if block.bound_m > best_m + MARGIN_M {
                continue;
            }
            let (i, j) = block.low;
            if block.side == 1 {
                best_m = best_m.min(block.bound_m);
                let shift = |n: i32| f64::from(n * step) * field.cell_m();
                let pose = turned + Vector3::new(shift(i), shift(j), 0.0);
                self.scored.push(Hypothesis { pose, cost_m: block.bound_m });
                continue;
            }
            let half = block.side / 2;
            let inside = |n: i32| n <= steps;
            let begin = blocks.len();
            for low in [(i, j), (i + half, j), (i, j + half), (i + half, j + half)] {
                if inside(low.0) && inside(low.1) {
                    blocks.push(self.block(field, low, half, step, kept));
                }
            }
            blocks[begin..].sort_by(|a, b| b.bound_m.total_cmp(&a.bound_m));
        }
        self.blocks = blocks;
        best_m
    }

    /// A block and its bound; for a single position the bound is its cost.
    fn block(&self, field: &Field, low: (i32, i32), side: i32, step: i32, kept: usize) -> Block {
        let span = (side - 1) * step;
        let middle = (low.0 * step + span / 2, low.1 * step + span / 2);
        // From the middle, rounded down, to the farthest corner, in levels of the coarse distances.
        let reach = f64::from(span - span / 2) * std::f64::consts::SQRT_2 * field.cell_m();
        let slack = (reach * COARSE_LEVELS as f64 / field.cap_m()).ceil() as usize;
        Block { low, side, bound_m: self.coarse_mean_m(field, middle, kept, slack) }
    }

    /// Mean of the `kept` smallest distances with all points shifted by whole cells, each less by `slack` levels; meters.
    fn coarse_mean_m(&self, field: &Field, shift: CellIndex, kept: usize, slack: usize) -> f64 {
        let mut counts = [0; COARSE_LEVELS];
        for (layer, (column, row)) in &self.cells {
            counts[usize::from(field.coarse(*layer, (column + shift.0, row + shift.1)))] += 1;
        }
        mean_of(&counts, field, kept, slack)
    }

    /// Counts the levels for every position of the lattice at once: what one point meets at neighboring positions lies in
    /// neighboring cells.
    fn count_all(&mut self, field: &Field, step: i32, steps: i32) {
        let side = (2 * steps + 1) as usize;
        self.counts.clear();
        self.counts.resize(side * side, [0; COARSE_LEVELS]);
        for (layer, (column, row)) in &self.cells {
            for (j, counts) in (-steps..=steps).zip(self.counts.chunks_exact_mut(side)) {
                let first = (column - steps * step, row + j * step);
                field.coarse_row(*layer, first, step, side, |n, level| counts[n][usize::from(level)] += 1);
            }
        }
    }

    fn distinct(&mut self, wanted: usize) -> &[Hypothesis] {
        let (scored, chosen) = (&self.scored, &mut self.chosen);
        chosen.clear();
        while chosen.len() < wanted {
            let far = |one: &&Hypothesis| chosen.iter().all(|other| !other.is_near(&one.pose));
            let best = scored.iter().filter(far).min_by(|a, b| a.cost_m.total_cmp(&b.cost_m));
            let Some(best) = best.copied() else { break };
            chosen.push(best);
        }
        chosen
    }
}

/// Mean of the `kept` smallest distances of which each level's number is known, each less by `slack` levels; meters.
fn mean_of(counts: &Counts, field: &Field, kept: usize, slack: usize) -> f64 {
    let (mut left, mut sum) = (kept, 0);
    for (level, count) in counts.iter().enumerate() {
        let taken = left.min(usize::from(*count));
        sum += taken * (2 * level.saturating_sub(slack) + 1);
        left -= taken;
        if left == 0 {
            break;
        }
    }
    sum as f64 / (2 * kept) as f64 * field.cap_m() / COARSE_LEVELS as f64
}

#[cfg(test)]
mod tests {
    use super::super::chart::{Chart, Rules};
    use super::*;
    use crate::kbest::mean_of_smallest;
    use arborloop_base::{Seed, Time};
    use nalgebra::Vector2;

    fn motion(x_m: f64, y_m: f64, heading_rad: f64) -> Motion {
        Motion {
            stamp: Time::from_nanos(0),
            pose: Vector3::new(x_m, y_m, heading_rad),
            velocity: Vector3::zeros(),
        }
    }

    fn features(trial: u64) -> Vec<Feature> {
        let mut draws = Seed(4).stream("search").at(trial);
        let mut at = || Vector2::new(draws.within(-6.0, 6.0), draws.within(-6.0, 6.0));
        (0..60).map(|n| Feature { at: at(), after_s: 0.0, layer: n % 2 }).collect()
    }

    #[test]
    fn the_search_finds_what_a_plain_loop_over_all_poses_finds() {
        let lattice = Lattice { reach_m: 0.4, reach_rad: 0.2, step_m: 0.1, step_rad: 0.05, prior_m: 0.0 };
        for trial in 0..4 {
            let features = features(trial);
            let (mut chart, mut field) = (Chart::new(0.1, 2, Rules::OF_RINGS), Field::new(0.1, 1.0, 2));
            chart.draw(&motion(0.2, -0.1, 0.1), &features, &[], 0);
            field.follow(&mut chart);
            let start = motion(0.0, 0.0, 0.0);
            let mut search = Search::default();
            let found = search.run(&field, &features, &start, &lattice, 0.8, 3);
            let mut slow = f64::INFINITY;
            for turn in -4..=4 {
                for j in -4..=4 {
                    for i in -4..=4 {
                        let at = motion(f64::from(i) * 0.1, f64::from(j) * 0.1, f64::from(turn) * 0.05);
                        let mut levels: Vec<f32> = features
                            .iter()
                            .map(|feature| {
                                let place = at.placing().place(&feature.at, 0.0);
                                let cell = field.cell_of(place.x, place.y);
                                (f32::from(field.coarse(feature.layer, cell)) + 0.5) / COARSE_LEVELS as f32
                            })
                            .collect();
                        slow = slow.min(mean_of_smallest(&mut levels, 0.8).unwrap());
                    }
                }
            }
            assert!((found[0].cost_m - slow).abs() < 1e-6, "{} {slow}", found[0].cost_m);
            assert!((found[0].pose - Vector3::new(0.2, -0.1, 0.1)).norm() < 1e-9);
            assert!(found.windows(2).all(|pair| pair[0].cost_m <= pair[1].cost_m));
        }
    }

    #[test]
    fn branch_and_bound_finds_the_poses_that_a_look_at_all_of_them_finds() {
        for trial in 0..4 {
            let features = features(trial);
            let (mut chart, mut field) = (Chart::new(0.1, 2, Rules::OF_RINGS), Field::new(0.1, 1.0, 2));
            chart.draw(&motion(0.7, -1.1, 2.1), &features, &[], 0);
            field.follow(&mut chart);
            let start = motion(0.0, 0.0, 0.0);
            let wide = Lattice { reach_m: 1.4, reach_rad: PI, step_m: 0.2, step_rad: 0.1, prior_m: 0.0 };
            let mut search = Search::default();
            let found = search.run(&field, &features, &start, &wide, 0.8, 3)[0];
            let bounded = search.scored.clone();
            // A prior too small to matter makes the search look at every pose.
            search.run(&field, &features, &start, &Lattice { prior_m: 1e-12, ..wide }, 0.8, 3);
            let best_m = search.scored.iter().map(|one| one.cost_m).fold(f64::INFINITY, f64::min);
            assert!((found.cost_m - best_m).abs() < 1e-9);
            for one in search.scored.iter().filter(|one| one.cost_m < best_m + MARGIN_M - 1e-9) {
                assert!(bounded.iter().any(|other| (other.pose - one.pose).norm() < 1e-9), "{one:?}");
            }
            assert!(bounded.len() < search.scored.len() / 4, "{}", bounded.len());
        }
    }
}
