//! Front end for a planar sweep: the points of compact things.
//!
//! A lone ring has no neighbor to tell ground from trunk. Long unbroken segments (arcs of ground, hedges, walls) slide
//! along themselves and lead a matcher astray; trunks and bushes are short and stay.

use super::features::{Clearing, Feature, View};
use super::hits::{Hit, Hits};
use super::settings::MhdSettings;
use nalgebra::Vector2;

/// Neighbors farther apart than this, or than the share below of their range, belong to different segments.
const BREAK_M: f64 = 0.25;
/// A surface at 13 degrees to the beam moves by this share of its range from one bin of 0.007 rad to the next.
const BREAK_RATIO: f64 = 0.03;

/// Clearings end so far before what was met, metres: a trunk's near face must not be worn away by its own beams.
pub(crate) const SHORT_M: f64 = 0.5;

/// Clearings end here at the latest, metres: farther out the tilt of the body decides what a beam passes over.
pub(crate) const CLEARING_M_MAX: f64 = 15.0;

/// Fills `view` from the beams of one ring; `lidar_m` is the lidar in the base frame. Sorts the hits by bearing.
pub(crate) fn view_of(hits: &mut Hits, lidar_m: Vector2<f64>, settings: &MhdSettings, view: &mut View) {
    hits.met.sort_by(|a, b| a.bearing_rad.total_cmp(&b.bearing_rad));
    let met = &hits.met;
    let mut start = 0;
    for end in 1..=met.len() {
        if end < met.len() && !apart(&met[end - 1], &met[end]) {
            continue;
        }
        let segment = &met[start..end];
        start = end;
        if segment
            .first()
            .zip(segment.last())
            .is_none_or(|(a, b)| (b.at - a.at).norm() > settings.segment_m_max)
        {
            continue;
        }
        let kept = segment.iter().filter(|hit| takes_part(hit, settings));
        view.features.extend(kept.map(|hit| Feature {
            at: lidar_m + hit.at.xy(),
            after_s: hit.after_s,
            layer: 0,
        }));
    }
}

/// Adds what the beams of one ring crossed without meeting anything.
pub(crate) fn clear(hits: &Hits, lidar_m: Vector2<f64>, settings: &MhdSettings, view: &mut View) {
    let clearing = |hit: &Hit, reach_m: f64| Clearing {
        from: lidar_m,
        to: lidar_m + hit.at.xy() * (reach_m / hit.level_m),
        after_s: hit.after_s,
        layer: 0,
    };
    let reach_m_max = settings.planar_range_m_max.min(CLEARING_M_MAX);
    let short_of = |hit: &Hit| (hit.level_m - SHORT_M).min(reach_m_max);
    view.clearings
        .extend(hits.met.iter().filter(|hit| short_of(hit) > 0.0).map(|hit| clearing(hit, short_of(hit))));
    let level = |hit: &&Hit| hit.level_m > 0.1;
    view.clearings.extend(hits.missed.iter().filter(level).map(|hit| clearing(hit, reach_m_max)));
}

fn apart(a: &Hit, b: &Hit) -> bool {
    (a.at - b.at).norm() > BREAK_M.max(BREAK_RATIO * a.level_m.min(b.level_m))
}

fn takes_part(hit: &Hit, settings: &MhdSettings) -> bool {
    hit.level_m <= settings.planar_range_m_max && hit.bearing_rad.abs() <= settings.planar_bearing_rad_max
}
