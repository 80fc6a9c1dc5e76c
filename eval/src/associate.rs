//! Which estimate belongs to which truth: at which instant of the sweep a pose holds, and pairs by nearest stamp.
//!
//! The rule is evo's (`evo.core.sync.matching_time_indices`, 1.38.1), so that both tools score the same pairs.

use crate::score::ScoreError;
use arborloop_base::{Pose, Span, Time, Trajectory};
use serde::{Deserialize, Serialize};
use std::fmt;

/// The instant of a sweep to which a stream's poses belong. Half a sweep is centimeters of walking.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoseTime {
    /// The first firing of the sweep.
    SweepStart,
    /// The last firing of the sweep: what arborloop's estimates state.
    SweepEnd,
    /// The stamp itself: satellite fixes, instant scans, poses at a fixed rate.
    Instant,
}

impl fmt::Display for PoseTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            PoseTime::SweepStart => "sweep start",
            PoseTime::SweepEnd => "sweep end",
            PoseTime::Instant => "instant",
        })
    }
}

/// A truth and the estimate that is compared with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Stamp of the estimate.
    pub stamp: Time,
    /// The true pose, in the reference's frame.
    pub reference: Pose,
    /// The estimated pose: in the estimate's own frame, or in the reference's once aligned.
    pub estimate: Pose,
}

/// Pairs every pose of the sparser trajectory with the nearest in time of the denser, within `association_max`.
///
/// Of two poses equally near the earlier is taken, and of two trajectories equally dense the estimate counts as the
/// sparser. Pairs come in the order of time. A stamp of the denser serves twice only where the sparser is locally
/// sampled finer than the window; evo does the same.
///
/// # Errors
/// [`ScoreError::TooFewPoses`] for an empty trajectory, [`ScoreError::NoOverlap`] when the two share no time, and
/// [`ScoreError::StampsApart`] when they do but no stamp has a neighbor within the window.
pub fn associate(
    reference: &Trajectory,
    estimate: &Trajectory,
    association_max: Span,
) -> Result<Vec<Pair>, ScoreError> {
    let (reference_from, reference_to) = ends(reference, "reference")?;
    let (estimate_from, estimate_to) = ends(estimate, "estimate")?;
    if association_max < Span::ZERO {
        return Err(ScoreError::Setting {
            name: "association_max",
            found: association_max.seconds(),
            wanted: "zero or more seconds",
        });
    }
    let estimate_is_denser = estimate.len() > reference.len();
    let (sparse, dense) = if estimate_is_denser { (reference, estimate) } else { (estimate, reference) };
    let mut pairs = Vec::with_capacity(sparse.len());
    let mut nearest = None;
    for (stamp, pose) in sparse.poses() {
        let (other_stamp, other_pose) = nearest_in(dense.poses(), *stamp);
        let apart = (other_stamp - *stamp).abs();
        nearest = Some(nearest.map_or(apart, |best: Span| best.min(apart)));
        if apart <= association_max {
            pairs.push(if estimate_is_denser {
                Pair { stamp: other_stamp, reference: *pose, estimate: other_pose }
            } else {
                Pair { stamp: *stamp, reference: other_pose, estimate: *pose }
            });
        }
    }
    if !pairs.is_empty() {
        return Ok(pairs);
    }
    if estimate_to < reference_from || reference_to < estimate_from {
        return Err(ScoreError::NoOverlap { reference_from, reference_to, estimate_from, estimate_to });
    }
    Err(ScoreError::StampsApart { nearest: nearest.unwrap_or_default(), association_max })
}

/// The reference interpolated at the given stamps; stamps outside its span are left out.
///
/// For a reference denser than the estimate (a 200 Hz truth, say), when the nearest sample is not near enough.
///
/// # Errors
/// [`ScoreError::Trajectory`] when the stamps do not strictly increase.
pub fn resample(reference: &Trajectory, stamps: &[Time]) -> Result<Trajectory, ScoreError> {
    let poses = stamps.iter().filter_map(|stamp| reference.at(*stamp).map(|pose| (*stamp, pose))).collect();
    Ok(Trajectory::new(poses)?)
}

fn ends(trajectory: &Trajectory, which: &'static str) -> Result<(Time, Time), ScoreError> {
    match trajectory.poses() {
        [(first, _), .., (last, _)] => Ok((*first, *last)),
        [(only, _)] => Ok((*only, *only)),
        [] => Err(ScoreError::TooFewPoses { which, found: 0, wanted: 2 }),
    }
}

/// The pose nearest in time, the earlier one when two are equally near. `poses` is not empty.
fn nearest_in(poses: &[(Time, Pose)], stamp: Time) -> (Time, Pose) {
    let after = poses.partition_point(|(t, _)| *t <= stamp);
    match (after.checked_sub(1).map(|before| poses[before]), poses.get(after)) {
        (Some(before), Some(next)) if next.0 - stamp < stamp - before.0 => *next,
        (Some(before), _) => before,
        (None, _) => poses[0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_millis(stamps: &[i64]) -> Trajectory {
        let pose = |&ms: &i64| (Time::from_nanos(ms * 1_000_000), Pose::translation(ms as f64, 0.0, 0.0));
        Trajectory::new(stamps.iter().map(pose).collect()).unwrap()
    }

    fn matched(reference: &[i64], estimate: &[i64]) -> Vec<(f64, f64)> {
        associate(&at_millis(reference), &at_millis(estimate), Span::from_millis(10))
            .unwrap()
            .iter()
            .map(|pair| (pair.reference.translation.x, pair.estimate.translation.x))
            .collect()
    }

    #[test]
    fn every_sparse_stamp_finds_its_nearest_within_the_window_edges_included() {
        assert_eq!(matched(&[0, 5, 10, 15, 20, 25], &[1, 9, 36]), [(0.0, 1.0), (10.0, 9.0)]);
        assert_eq!(matched(&[0, 100], &[10, 90, 200, 300]), [(0.0, 10.0), (100.0, 90.0)]);
    }

    #[test]
    fn of_two_equally_near_the_earlier_is_taken() {
        assert_eq!(matched(&[0, 10, 20], &[5]), [(0.0, 5.0)]);
    }

    #[test]
    fn the_nearest_found_by_halving_is_the_nearest_found_by_looking_at_all() {
        let dense: Vec<i64> = (0..200).map(|n| 7 * n + (n * n) % 5).collect();
        let dense = at_millis(&dense);
        for millis in -20..1500 {
            let stamp = Time::from_nanos(millis * 1_000_000);
            let slow = dense.poses().iter().min_by_key(|(t, _)| ((*t - stamp).abs(), *t)).unwrap();
            assert_eq!(nearest_in(dense.poses(), stamp).0, slow.0, "{millis} ms");
        }
    }

    #[test]
    fn trajectories_that_do_not_meet_are_told_why() {
        let max = Span::from_millis(10);
        let error = associate(&at_millis(&[0, 100]), &at_millis(&[50, 60]), max).unwrap_err();
        assert!(error.to_string().contains("nearest two are 0.04 s apart"), "{error}");
        let error = associate(&at_millis(&[0, 100]), &at_millis(&[500, 600]), max).unwrap_err();
        assert!(matches!(error, ScoreError::NoOverlap { .. }), "{error}");
        let error = associate(&at_millis(&[]), &at_millis(&[500, 600]), max).unwrap_err();
        assert!(matches!(error, ScoreError::TooFewPoses { which: "reference", .. }), "{error}");
        let error = associate(&at_millis(&[0]), &at_millis(&[0]), Span::from_millis(-1)).unwrap_err();
        assert!(matches!(error, ScoreError::Setting { name: "association_max", .. }), "{error}");
    }

    #[test]
    fn a_resampled_reference_has_exactly_the_asked_stamps_that_it_covers() {
        let stamps = [-5, 3, 60, 101].map(|ms: i64| Time::from_nanos(ms * 1_000_000));
        let resampled = resample(&at_millis(&[0, 100]), &stamps).unwrap();
        let found: Vec<_> = resampled.poses().iter().map(|(t, p)| (t.nanos(), p.translation.x)).collect();
        assert_eq!(found, [(3_000_000, 3.0), (60_000_000, 60.0)]);
    }
}
