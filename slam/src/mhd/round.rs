//! Round things are seen around their axis, not around the face that they turn to the lidar.
//!
//! Whoever walks past a trunk sees its near face move around it. The new face is matched with the old one beside it, a
//! little behind, trunk after trunk: ways come out short by half a percent. Pushed back by the depth of what half a
//! circle shows, the faces of all sides lie around one center.

use super::bins::Bin;
use nalgebra::Vector2;
use std::f64::consts::PI;

/// Wider things are no trunks, posts or cones, meters.
const WIDTH_M_MAX: f64 = 0.3;
/// Depths of neighboring bins on one thing differ by less, meters.
const SAME_THING_M: f64 = 0.15;
/// What stands beside a lone thing is farther away by at least this, meters: else it may go on behind its neighbor.
const LONE_M: f64 = 1.0;
/// How much deeper than half its width a round thing may seem, meters: three times the noise of ranges, and its lean.
const BULGE_M: f64 = 0.1;
/// How far the points of a round thing move together towards its axis: the bow that each side shows lies across the bows of
/// the other sides, and thick trunks are matched bow on bow. All the way, the wide would be no surer than the thin.
const TOGETHER: f64 = 0.5;
/// A trunk is about as wide and as far in another layer; a tip of a twig is seen in one alone. Meters.
const ALIKE_M: f64 = 0.07;

/// A row of neighboring bins of one layer that shows a lone, narrow thing.
#[derive(Debug, Clone, Copy)]
struct Row {
    layer: usize,
    begin: usize,
    end: usize,
    nearest_m: f64,
    width_m: f64,
}

impl Row {
    /// Whether another row shows the same thing at another height.
    fn is_same_thing(&self, other: &Row) -> bool {
        self.layer != other.layer
            && self.begin < other.end
            && other.begin < self.end
            && (self.nearest_m - other.nearest_m).abs() < ALIKE_M
            && (self.width_m - other.width_m).abs() < ALIKE_M
    }
}

/// Finds round things; keeps its memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Round {
    rows: Vec<Row>,
}

impl Round {
    /// Moves what is seen of trunks, posts and cones to lie around their axes, but for what the seam between the last bin
    /// and the first cuts in two. `bins` are layers of `per_layer` bins each,
    /// `origin` is the lidar in their frame, `step_rad` the bearing between neighboring beams of one ring.
    pub(crate) fn center(
        &mut self,
        bins: &mut [Bin],
        per_layer: usize,
        origin: &Vector2<f64>,
        step_rad: f64,
    ) {
        self.rows.clear();
        for (layer, bins) in bins.chunks_exact(per_layer).enumerate() {
            let mut begin = 0;
            while begin < per_layer {
                if bins[begin].count == 0.0 {
                    begin += 1;
                    continue;
                }
                let goes_on = |pair: &[Bin]| {
                    pair[1].count > 0.0 && (pair[1].nearest_m - pair[0].nearest_m).abs() < SAME_THING_M
                };
                let end = begin + 1 + bins[begin..].windows(2).take_while(|pair| goes_on(pair)).count();
                self.rows.extend(row_of(layer, bins, begin, end, step_rad));
                begin = end;
            }
        }
        for row in &self.rows {
            if !self.rows.iter().any(|other| row.is_same_thing(other)) {
                continue;
            }
            // The mean depth of half a circle as beams see it: a quarter of pi of its radius before the center.
            let depth_m = PI / 8.0 * row.width_m;
            let bins = &mut bins[row.layer * per_layer..][row.begin..row.end];
            let (mut sum, mut count) = (Vector2::zeros(), 0.0);
            for bin in bins.iter_mut() {
                let away = bin.sum / bin.count - origin;
                bin.sum += away * (depth_m * bin.count / away.norm());
                (sum, count) = (sum + bin.sum, count + bin.count);
            }
            for bin in bins {
                bin.sum += (sum / count * bin.count - bin.sum) * TOGETHER;
            }
        }
    }
}

/// The bins from `begin` to `end` of a layer, if they show a lone, narrow thing.
fn row_of(layer: usize, bins: &[Bin], begin: usize, end: usize, step_rad: f64) -> Option<Row> {
    let own = &bins[begin..end];
    let nearest_m = own.iter().map(|bin| bin.nearest_m).fold(f64::INFINITY, f64::min);
    let farthest_m = own.iter().map(|bin| bin.nearest_m).fold(0.0, f64::max);
    let sides_rad = [own.first()?.sides_rad[0], own.last()?.sides_rad[1]];
    let width_m = nearest_m * (sides_rad[1] - sides_rad[0] + step_rad);
    let is_beyond = |bin: &Bin| bin.count == 0.0 || bin.nearest_m > nearest_m + LONE_M;
    let is_lone =
        is_beyond(&bins[(begin + bins.len() - 1) % bins.len()]) && is_beyond(&bins[end % bins.len()]);
    let is_narrow = width_m < WIDTH_M_MAX && farthest_m - nearest_m < 0.5 * width_m + BULGE_M;
    (is_lone && is_narrow).then_some(Row { layer, begin, end, nearest_m, width_m })
}

#[cfg(test)]
mod tests {
    use super::super::bins::{EMPTY, bin_of};
    use super::super::features::Feature;
    use super::*;

    const PER_LAYER: usize = 720;
    const STEP_RAD: f64 = 0.0035;

    /// What beams from `origin` see of a disk in `layers` of two layers.
    fn seen(origin: Vector2<f64>, center: Vector2<f64>, radius_m: f64, layers: &[usize]) -> Vec<Bin> {
        let mut bins = vec![EMPTY; 2 * PER_LAYER];
        let to = center - origin;
        let middle_rad = to.y.atan2(to.x);
        for step in -200..200 {
            let off_rad = f64::from(step) * STEP_RAD;
            let aside_m = to.norm() * off_rad.sin();
            if aside_m.abs() >= radius_m || off_rad.abs() > 1.0 {
                continue;
            }
            let level_m = to.norm() * off_rad.cos() - (radius_m * radius_m - aside_m * aside_m).sqrt();
            let bearing_rad = middle_rad + off_rad;
            let at = origin + Vector2::new(bearing_rad.cos(), bearing_rad.sin()) * level_m;
            for layer in layers {
                let bin = &mut bins[layer * PER_LAYER + bin_of(bearing_rad, PER_LAYER)];
                bin.nearest_m = bin.nearest_m.min(level_m);
                bin.add(&Feature { at, after_s: 0.0, layer: *layer }, bearing_rad);
            }
        }
        bins
    }

    fn mean(bins: &[Bin]) -> Vector2<f64> {
        let sum: Vector2<f64> = bins.iter().map(|bin| bin.sum).sum();
        sum / bins.iter().map(|bin| bin.count).sum::<f64>()
    }

    #[test]
    fn a_trunk_is_seen_around_its_axis_from_every_side() {
        let center = Vector2::new(0.4, -0.2);
        for (bearing_rad, away_m) in [(0.1, 1.5), (1.7, 3.0), (-2.4, 5.0)] {
            let origin = center + Vector2::new(f64::cos(bearing_rad), f64::sin(bearing_rad)) * away_m;
            let mut bins = seen(origin, center, 0.06, &[0, 1]);
            let before_m = (mean(&bins) - center).norm();
            Round::default().center(&mut bins, PER_LAYER, &origin, STEP_RAD);
            let after_m = (mean(&bins) - center).norm();
            // Off by less than half a step of the beams on either side.
            assert!(before_m > 0.04 && after_m < 0.5 * STEP_RAD * away_m + 0.002, "{before_m} {after_m}");
        }
    }

    #[test]
    fn what_is_wide_or_low_or_goes_on_beside_itself_stays_where_it_was_met() {
        let (origin, center) = (Vector2::zeros(), Vector2::new(3.0, 0.0));
        let stays = |bins: Vec<Bin>| {
            let mut after = bins.clone();
            Round::default().center(&mut after, PER_LAYER, &origin, STEP_RAD);
            bins.iter().zip(&after).all(|(a, b)| a.sum == b.sum)
        };
        assert!(!stays(seen(origin, center, 0.06, &[0, 1])));
        assert!(stays(seen(origin, center, 0.3, &[0, 1])), "a bush");
        assert!(stays(seen(origin, center, 0.06, &[0])), "a twig's tip");
        let mut hedge = seen(origin, center, 0.06, &[0, 1]);
        let last = (0..PER_LAYER).rfind(|n| hedge[*n].count > 0.0).unwrap();
        for layer in [0, 1] {
            let beside = &mut hedge[layer * PER_LAYER + last + 1];
            beside.nearest_m = 3.4;
            beside.add(&Feature { at: center, after_s: 0.0, layer }, 0.0);
        }
        assert!(stays(hedge), "a hedge's tip");
    }
}
