//! Front end for a sweep of many rings: upright returns by height above ground, seen from above.

use super::bins::{Bin, EMPTY, bin_of, bins_of};
use super::compact::{CLEARING_M_MAX, SHORT_M};
use super::features::{Clearing, Feature, View};
use super::ground::Ground;
use super::hits::{Hit, Hits};
use super::plumb::{Pair, Plumb};
use super::round::Round;
use super::settings::MhdSettings;
use super::upright::RingImage;
use nalgebra::{Rotation3, Vector2, Vector3};
use std::f64::consts::{PI, TAU};

/// Returns of a bin that lie this much behind its nearest are still the same thing, meters.
const SAME_THING_M: f64 = 0.2;
/// Farther things are met by too few beams to tell how they stand, meters.
const PLUMB_M_MAX: f64 = 15.0;
/// What stands plumb is straight within this, meters.
const BENT_M: f64 = 0.04;
/// Bearing bins of the clearings.
const CLEARING_BINS: usize = 360;
/// Every n-th beam is enough for clearings; no divisor of usual ring counts, so that every ring takes its turn.
const BEAM_STRIDE: usize = 5;

/// A return from something upright.
#[derive(Debug, Clone, Copy)]
struct Upright {
    /// Index of its bin, layer after layer.
    bin: usize,
    /// Level distance from the lidar, meters, and bearing in the flat frame, radians.
    level_m: f64,
    bearing_rad: f64,
    feature: Feature,
}

/// Where beams of one bearing crossed a layer: from and to, meters, and when, seconds after the sweep's middle.
type Stretch = (f64, f64, f64);

/// Slices sweeps into layers; remembers the ground.
#[derive(Debug, Clone, Default)]
pub(crate) struct Slicer {
    image: RingImage,
    bins: Vec<Bin>,
    upright: Vec<Upright>,
    round: Round,
    ground: Option<Ground>,
    low: Vec<Vector3<f64>>,
    stretches: Vec<Stretch>,
    plumb: Plumb,
    pairs: Vec<Pair>,
    stance: Stance,
}

/// How a sweep stands on its ground.
#[derive(Debug, Clone, Default)]
struct Stance {
    /// Parallel to the ground: heights are counted in it.
    level_from_base: Rotation3<f64>,
    /// Plumb: what is seen from above is seen along its z axis.
    flat_from_base: Rotation3<f64>,
    lidar_height_m: f64,
    lidar_m: Vector3<f64>,
}

impl Slicer {
    /// Fills `view` from the beams of many rings; `lidar_m` is the lidar in the base frame.
    pub(crate) fn view_of(
        &mut self,
        hits: &Hits,
        rings: u16,
        lidar_m: Vector3<f64>,
        heading_rad: f64,
        settings: &MhdSettings,
        view: &mut View,
    ) {
        self.image.fill(&hits.met, rings);
        // A sweep without ground (held over a ditch, all grass) keeps the ground of the one before.
        let points = &mut self.low;
        self.ground = Ground::fit(&hits.met, self.ground, points)
            .or_else(|| Ground::fit(&hits.met, None, points))
            .or(self.ground);
        let level_from_base = self.ground.map_or_else(Rotation3::identity, |g| g.level_from_base());
        self.hang(&hits.met, &level_from_base, heading_rad);
        let stance = Stance {
            level_from_base,
            flat_from_base: self.plumb.plumb_from_base(&level_from_base, heading_rad),
            // Without any ground ever, heights count from a hand's breadth below the beams' horizon.
            lidar_height_m: self.ground.map_or(0.5, |g| g.lidar_height_m()),
            lidar_m,
        };
        self.stance = stance;
        self.gather(&hits.met, settings);
        let beams = hits.met.len() + hits.missed.len();
        let step_rad = TAU * f64::from(rings) / beams.max(1) as f64;
        let origin = (self.stance.flat_from_base * lidar_m).xy();
        self.round.center(&mut self.bins, bins_of(settings.bin_rad), &origin, step_rad);
        self.thin(settings, view);
    }

    /// Adds what the beams of the sweep that was viewed last crossed without meeting anything.
    pub(crate) fn clear(&mut self, hits: &Hits, settings: &MhdSettings, view: &mut View) {
        clearings(hits, &self.stance, &self.bins, settings, &mut self.stretches, view);
    }

    /// Learns from what stands upright which way is up.
    fn hang(&mut self, met: &[Hit], level_from_base: &Rotation3<f64>, heading_rad: f64) {
        self.pairs.clear();
        for (index, _) in met.iter().enumerate().filter(|(_, hit)| hit.level_m < PLUMB_M_MAX) {
            let Some(chain) = self.image.chain(met, index) else { continue };
            let (low, high) = (level_from_base * chain[0].at, level_from_base * chain[3].at);
            let (low_m, high_m) = (low.xy().norm(), high.xy().norm());
            let is_straight = chain[1..3].iter().all(|between| {
                let between = level_from_base * between.at;
                let share = (between.z - low.z) / (high.z - low.z);
                (between.xy().norm() - low_m - share * (high_m - low_m)).abs() < BENT_M
            });
            if low_m > 0.0 && high.z > low.z && is_straight {
                let towards = low.xy() / low_m;
                self.pairs.push(Pair { towards, rise_m: high.z - low.z, away_m: high_m - low_m });
            }
        }
        self.plumb.learn(&self.pairs, heading_rad);
    }

    /// Finds the upright returns, their layer and bin, and of every bin the nearest.
    fn gather(&mut self, met: &[Hit], settings: &MhdSettings) {
        let stance = &self.stance;
        let edges = &settings.layer_edges_m;
        let bins = bins_of(settings.bin_rad);
        self.bins.clear();
        self.bins.resize(bins * settings.layers(), EMPTY);
        self.upright.clear();
        for (index, hit) in met.iter().enumerate().filter(|(_, hit)| hit.level_m <= settings.range_m_max) {
            let height_m = match &self.ground {
                Some(ground) => ground.above_m(&hit.at),
                None => (stance.level_from_base * hit.at).z + stance.lidar_height_m,
            };
            let above = edges.partition_point(|edge| *edge <= height_m);
            if above == 0 || above == edges.len() || !self.image.is_upright(met, index) {
                continue;
            }
            let level = stance.flat_from_base * hit.at;
            let layer = above - 1;
            let bearing_rad = level.y.atan2(level.x);
            let bin = layer * bins + bin_of(bearing_rad, bins);
            let level_m = level.xy().norm();
            self.bins[bin].nearest_m = self.bins[bin].nearest_m.min(level_m);
            let at = (level + stance.flat_from_base * stance.lidar_m).xy();
            let feature = Feature { at, after_s: hit.after_s, layer };
            self.upright.push(Upright { bin, level_m, bearing_rad, feature });
        }
        for Upright { bin, level_m, bearing_rad, feature } in &self.upright {
            let bin = &mut self.bins[*bin];
            if *level_m < bin.nearest_m + SAME_THING_M {
                bin.add(feature, *bearing_rad);
            }
        }
    }

    /// One feature per bin (the mean of its nearest returns), or per cell of the map's size where bins are narrower.
    fn thin(&mut self, settings: &MhdSettings, view: &mut View) {
        let per_layer = bins_of(settings.bin_rad);
        for (layer, bins) in self.bins.chunks_exact(per_layer).enumerate() {
            // Neighboring bins that fall into one voxel merge: near things would outvote far ones.
            let mut open: Option<((i64, i64), Bin)> = None;
            for bin in bins.iter().filter(|bin| bin.count > 0.0) {
                let mean = bin.sum / bin.count;
                let voxel =
                    ((mean.x / settings.cell_m).floor() as i64, (mean.y / settings.cell_m).floor() as i64);
                match &mut open {
                    Some((place, merged)) if *place == voxel => {
                        merged.sum += bin.sum;
                        merged.after_s += bin.after_s;
                        merged.count += bin.count;
                    }
                    _ => {
                        if let Some((_, merged)) = open.replace((voxel, *bin)) {
                            view.features.push(merged.feature(layer));
                        }
                    }
                }
            }
            if let Some((_, merged)) = open {
                view.features.push(merged.feature(layer));
            }
        }
    }
}

/// Per bearing and layer the stretch that beams crossed at the layer's heights, up to the nearest upright thing.
fn clearings(
    hits: &Hits,
    stance: &Stance,
    bins: &[Bin],
    settings: &MhdSettings,
    stretches: &mut Vec<Stretch>,
    view: &mut View,
) {
    let edges = &settings.layer_edges_m;
    let nothing = (f64::INFINITY, 0.0_f64, 0.0_f64);
    stretches.clear();
    stretches.resize(CLEARING_BINS * settings.layers(), nothing);
    let met = hits.met.iter().step_by(BEAM_STRIDE).map(|hit| (*hit, hit.level_m));
    let missed = hits.missed.iter().step_by(BEAM_STRIDE).filter_map(|miss| hits.beam(miss));
    for (hit, reach_m) in met.chain(missed.map(|hit| (hit, f64::MAX))) {
        let level = stance.flat_from_base * hit.at;
        let level_m = level.xy().norm();
        if level_m <= 0.0 {
            continue;
        }
        let rise = (stance.level_from_base * hit.at).z / level_m;
        let bearing = bin_of(level.y.atan2(level.x), CLEARING_BINS);
        let reach_m = (reach_m - SHORT_M).min(CLEARING_M_MAX);
        for layer in 0..settings.layers() {
            // Where the beam enters and leaves the layer: height = lidar height + rise * distance.
            let (low, high) =
                (edges[layer] - stance.lidar_height_m, edges[layer + 1] - stance.lidar_height_m);
            let (a, b) = if rise.abs() < 1e-6 {
                if low <= 0.0 && high >= 0.0 { (0.0, f64::MAX) } else { continue }
            } else {
                ((low / rise).min(high / rise), (low / rise).max(high / rise))
            };
            let (from, to) = (a.max(0.0), b.min(reach_m));
            if from < to {
                let stretch = &mut stretches[layer * CLEARING_BINS + bearing];
                *stretch = (stretch.0.min(from), stretch.1.max(to), hit.after_s);
            }
        }
    }
    let per_layer = bins_of(settings.bin_rad);
    let origin = (stance.flat_from_base * stance.lidar_m).xy();
    for (index, (from_m, to_m, after_s)) in stretches.iter().copied().enumerate() {
        let (layer, bearing) = (index / CLEARING_BINS, index % CLEARING_BINS);
        let center_rad = (bearing as f64 + 0.5) / CLEARING_BINS as f64 * TAU - PI;
        // A hair less than half, for bearings on the border of two bins belong to the one to the left.
        let half = 0.499 * TAU / CLEARING_BINS as f64;
        let (first, last) = (bin_of(center_rad - half, per_layer), bin_of(center_rad + half, per_layer));
        let nearest_m = (first..=last.max(first))
            .map(|bin| bins[layer * per_layer + bin].nearest_m)
            .fold(f64::INFINITY, f64::min);
        let to_m = to_m.min(nearest_m - SHORT_M);
        if from_m < to_m {
            let along = Vector2::new(center_rad.cos(), center_rad.sin());
            view.clearings.push(Clearing {
                from: origin + along * from_m,
                to: origin + along * to_m,
                after_s,
                layer,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::hits::Miss;
    use super::*;

    /// Sixteen rings over level ground half a meter below, with a post of 5 cm radius every 30 degrees, 4 m away.
    fn grove() -> Hits {
        let mut hits = Hits::default();
        for column in 0..1800_u32 {
            let bearing_rad = (f64::from(column) + 0.5) / 1800.0 * TAU - PI;
            let from_post = (bearing_rad / PI * 6.0).fract().abs();
            let sees_post = (from_post.min(1.0 - from_post) * PI / 6.0 * 4.0) < 0.05;
            for ring in 0..16_u16 {
                let elevation_rad = (2.0 * f64::from(ring) - 15.0).to_radians();
                let rise = elevation_rad.tan();
                let ground_m = if rise < 0.0 { -0.5 / rise } else { f64::INFINITY };
                let level_m = if sees_post { ground_m.min(4.0) } else { ground_m };
                let hit = |level_m: f64| Hit {
                    at: Vector3::new(bearing_rad.cos(), bearing_rad.sin(), rise) * level_m,
                    level_m,
                    bearing_rad,
                    after_s: 0.0,
                    ring,
                };
                let miss = Miss { azimuth_rad: bearing_rad, elevation_rad, after_s: 0.0, ring };
                if level_m.is_finite() { hits.met.push(hit(level_m)) } else { hits.missed.push(miss) }
            }
        }
        hits
    }

    fn view_on(settings: &MhdSettings) -> View {
        let (mut slicer, mut view) = (Slicer::default(), View::default());
        let hits = grove();
        slicer.view_of(&hits, 16, Vector3::new(0.0, 0.0, 0.2), 0.0, settings, &mut view);
        slicer.clear(&hits, settings, &mut view);
        view
    }

    #[test]
    fn features_are_the_posts_and_nothing_of_the_ground() {
        let view = view_on(&MhdSettings::default());
        assert!(view.features.len() >= 12, "{}", view.features.len());
        for feature in &view.features {
            // A post of 10 cm is seen around its axis, 4 cm behind its near face, but for the one across the seam.
            assert!((feature.at.norm() - 4.02).abs() < 0.03, "{feature:?}");
            let to_post = (feature.at.y.atan2(feature.at.x) / PI * 6.0).fract().abs();
            assert!(to_post.min(1.0 - to_post) * PI / 6.0 * 4.0 < 0.06, "{feature:?}");
        }
        // Every ring that meets a post well inside of a layer is seen there.
        let settings = MhdSettings::default();
        for ring in 0..16 {
            let height_m = 0.5 + 4.0 * (2.0 * f64::from(ring) - 15.0).to_radians().tan();
            let edges = &settings.layer_edges_m;
            let inside =
                |layer: &usize| height_m > edges[*layer] + 0.02 && height_m < edges[layer + 1] - 0.02;
            if let Some(layer) = (0..settings.layers()).find(inside) {
                assert!(view.features.iter().any(|feature| feature.layer == layer), "layer {layer}");
            }
        }
    }

    #[test]
    fn clearings_stay_within_their_layers_beams_and_end_before_the_posts() {
        let settings = MhdSettings::default();
        let view = view_on(&settings);
        assert!(!view.clearings.is_empty());
        for clearing in &view.clearings {
            assert!(clearing.from.norm() < clearing.to.norm());
            assert!(clearing.to.norm() <= CLEARING_M_MAX + 1e-9);
            let bearing_rad = clearing.to.y.atan2(clearing.to.x);
            let to_post = (bearing_rad / PI * 6.0).fract().abs();
            if to_post.min(1.0 - to_post) * PI / 6.0 * 4.0 < 0.03 {
                assert!(clearing.to.norm() <= 4.0 - SHORT_M + 0.01, "{clearing:?}");
            }
        }
    }

    #[test]
    fn nothing_seen_is_nothing_said() {
        let (mut slicer, mut view) = (Slicer::default(), View::default());
        let (hits, settings) = (Hits::default(), MhdSettings::default());
        slicer.view_of(&hits, 16, Vector3::zeros(), 0.0, &settings, &mut view);
        slicer.clear(&hits, &settings, &mut view);
        assert!(view.features.is_empty() && view.clearings.is_empty());
    }
}
