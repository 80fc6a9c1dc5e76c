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

/// Clearings end so far before what was met, meters: a trunk's near face must not be worn away by its own beams.
pub(crate) const SHORT_M: f64 = 0.5;

/// Clearings end here at the latest, meters: farther out the tilt of the body decides what a beam passes over.
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
    let beams = hits.missed.iter().filter_map(|miss| hits.beam(miss)).filter(|hit| hit.level_m > 0.1);
    view.clearings.extend(beams.map(|hit| clearing(&hit, reach_m_max)));
}

fn apart(a: &Hit, b: &Hit) -> bool {
    (a.at - b.at).norm() > BREAK_M.max(BREAK_RATIO * a.level_m.min(b.level_m))
}

fn takes_part(hit: &Hit, settings: &MhdSettings) -> bool {
    hit.level_m <= settings.planar_range_m_max && hit.bearing_rad.abs() <= settings.planar_bearing_rad_max
}

#[cfg(test)]
mod tests {
    use super::super::hits::Miss;
    use super::*;
    use nalgebra::Vector3;
    use std::f64::consts::FRAC_PI_2;

    fn hit(x: f64, y: f64) -> Hit {
        let at = Vector3::new(x, y, 0.0);
        Hit { at, level_m: x.hypot(y), bearing_rad: y.atan2(x), after_s: 0.0, ring: 0 }
    }

    #[test]
    fn a_trunk_takes_part_and_a_hedge_does_not() {
        let trunk = (0..5).map(|n| hit(3.0, 0.05 * f64::from(n)));
        let hedge = (0..60).map(|n| hit(4.0, -6.0 + 0.08 * f64::from(n)));
        let mut hits = Hits { met: hedge.chain(trunk).collect(), ..Hits::default() };
        let mut view = View::default();
        let settings = MhdSettings::default();
        view_of(&mut hits, Vector2::new(0.2, 0.1), &settings, &mut view);
        assert_eq!(view.features.len(), 5);
        assert!(view.features.iter().all(|feature| (feature.at.x - 3.2).abs() < 1e-12));
    }

    #[test]
    fn a_beam_clears_up_to_half_a_meter_before_what_it_met_and_a_miss_clears_to_the_limit() {
        let left = Miss { azimuth_rad: FRAC_PI_2, elevation_rad: 0.0, after_s: 0.0, ring: 0 };
        let hits = Hits { met: vec![hit(3.0, 0.0), hit(0.4, 0.0)], missed: vec![left], ..Hits::default() };
        let mut view = View::default();
        let lidar_m = Vector2::new(0.2, 0.0);
        clear(&hits, lidar_m, &MhdSettings::default(), &mut view);
        let ends: Vec<Vector2<f64>> = view.clearings.iter().map(|clearing| clearing.to).collect();
        assert_eq!(ends.len(), 2);
        assert!((ends[0] - Vector2::new(2.7, 0.0)).norm() < 1e-12);
        let far_m = CLEARING_M_MAX.min(MhdSettings::default().planar_range_m_max);
        assert!((ends[1] - Vector2::new(0.2, far_m)).norm() < 1e-9);
    }
}
