//! One estimate against one reference: the paper's rows beside evo's.

mod error;
mod motion;

pub use error::ScoreError;

use crate::align::{Alignment, align};
use crate::ape::{PoseRelation, ape};
use crate::associate::{Pair, PoseTime, associate};
use crate::consistency::{Consistency, consistency};
use crate::loop_closure::loop_error;
use crate::rpe::{PairSpacing, rpe};
use crate::stats::{Stats, mean, rms};
use arborloop_base::{Estimate, Pose, Span, Time, Trajectory, wrap_angle, yaw_of};
use serde::{Deserialize, Serialize};

/// How to compare. The instants have no default: the evaluator refuses to guess them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScoreSettings {
    /// How the estimate is laid over the reference.
    pub alignment: Alignment,
    /// Largest difference of two stamps that count as one instant; 10 ms is evo's.
    pub association_max: Span,
    /// Whether the reference's attitudes mean anything; satellite fixes have none.
    pub has_heading: bool,
    /// The instant to which the reference's poses belong; must equal the estimate's.
    pub pose_time_reference: PoseTime,
    /// The instant to which the estimate's poses belong; must equal the reference's.
    pub pose_time_estimate: PoseTime,
    /// Directions of motion are taken between positions at least this far apart on the true path, meters.
    pub direction_step_m: f64,
}

impl ScoreSettings {
    /// Settings for poses that all hold at `pose_time`: evo's window, headings compared, directions over 0.1 m.
    pub fn new(alignment: Alignment, pose_time: PoseTime) -> Self {
        ScoreSettings {
            alignment,
            association_max: Span::from_millis(10),
            has_heading: true,
            pose_time_reference: pose_time,
            pose_time_estimate: pose_time,
            direction_step_m: 0.1,
        }
    }
}

/// The error at one sample of an aligned path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ErrorSample {
    /// Stamp of the estimate.
    pub stamp: Time,
    /// Distance walked on the true path since the first sample, horizontal, meters.
    pub distance_m: f64,
    /// Horizontal distance from truth to estimate, meters.
    pub position_m: f64,
    /// Heading error, degrees in (-180, 180], positive when the estimate is turned counter-clockwise of the truth;
    /// `None` when the reference has no heading.
    pub heading_deg: Option<f64>,
}

/// One estimate held against one reference.
///
/// Positions, increments and the loop are horizontal (x, y), as in the paper and as `evo_ape --project_to_plane xy`;
/// `ape` and `rpe_*` are spatial, as evo without that flag. Angles are absolute values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Number of compared poses.
    pub samples: usize,
    /// Time from the first to the last compared pose, as a share of the reference's whole time.
    pub coverage_ratio: f64,
    /// Length of the true path through the compared poses, horizontal, meters.
    pub path_length_m: f64,
    /// How the estimate was laid over the reference.
    pub alignment: Alignment,
    /// Largest difference of two stamps that counted as one instant, seconds.
    pub association_max_s: f64,
    /// The instant to which all poses belong.
    pub pose_time: PoseTime,
    /// The motion that the alignment found: carries the estimate's frame into the reference's.
    pub reference_from_estimate: Pose,
    /// Mean horizontal error, meters.
    pub position_mean_m: f64,
    /// Root mean square of the horizontal error, meters.
    pub position_rms_m: f64,
    /// Largest horizontal error, meters.
    pub position_max_m: f64,
    /// Mean heading error, degrees; `None` when the reference has no heading.
    pub heading_mean_deg: Option<f64>,
    /// Root mean square of the heading error, degrees.
    pub heading_rms_deg: Option<f64>,
    /// Mean of `| |g_i+1 - g_i| - |p_i+1 - p_i| |`, meters.
    pub position_increment_mean_m: f64,
    /// Root mean square of the same.
    pub position_increment_rms_m: f64,
    /// Mean difference of the true and the estimated change of heading from sample to sample, degrees.
    pub heading_increment_mean_deg: Option<f64>,
    /// Root mean square of the same.
    pub heading_increment_rms_deg: Option<f64>,
    /// Mean difference of the directions of motion of the two tracks, radians: what the paper's tables print as
    /// "angular error". `None` when the robot never moved by the direction step.
    pub motion_direction_mean_rad: Option<f64>,
    /// Root mean square of the same.
    pub motion_direction_rms_rad: Option<f64>,
    /// Mean difference of the true and the estimated change of direction of motion from station to station, radians.
    pub motion_direction_increment_mean_rad: Option<f64>,
    /// Root mean square of the same.
    pub motion_direction_increment_rms_rad: Option<f64>,
    /// `position_mean_m` as a share of `path_length_m`, percent: the paper notebook's second definition of `e_%`,
    /// which leaves angles out; the first averages meters with radians. `None` for a path of no length.
    pub error_ratio_percent: Option<f64>,
    /// Horizontal error of the last compared pose, meters: the paper's `loop_e`.
    pub loop_m: f64,
    /// Heading error of the last compared pose, degrees.
    pub loop_heading_deg: Option<f64>,
    /// Spatial distance of each pose from its truth, meters (`evo_ape -r trans_part`).
    pub ape: Stats,
    /// Angle between each attitude and its truth, degrees (`evo_ape -r angle_deg`).
    pub ape_rotation_deg: Option<Stats>,
    /// Horizontal distances after an SE(2) least-squares alignment, whatever `alignment` says, meters: often called
    /// ATE. `None` when the path never leaves one place.
    pub ape_se2: Option<Stats>,
    /// Spatial error of the motion from sample to sample, meters (`evo_rpe -r trans_part -d 1 -u f`); `None` when the
    /// reference has no heading, because a motion is seen from its start.
    pub rpe_translation: Option<Stats>,
    /// Rotation error of the same motions, degrees (`evo_rpe -r angle_deg -d 1 -u f`).
    pub rpe_rotation_deg: Option<Stats>,
    /// Spatial error of the motion over each meter of the estimated path, meters (`evo_rpe -r trans_part -d 1 -u m`);
    /// `None` also when the path is shorter.
    pub rpe_translation_per_meter: Option<Stats>,
    /// How the errors compare with the covariances that came with the estimates; `None` where none came, and until
    /// [`Score::with_covariances`] is told them.
    pub consistency: Option<Consistency>,
    /// The path as the system believed it in the end; `None` where it never revises its past, and until
    /// [`Score::with_revised`] is told it.
    pub revised: Option<Revised>,
    /// The error at every sample, for plots. Not part of the written metrics.
    #[serde(skip)]
    pub errors: Vec<ErrorSample>,
}

/// What a path that was revised afterwards is off by; the numbers are those of [`Score`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Revised {
    /// Mean distance, meters.
    pub position_mean_m: f64,
    /// Largest distance, meters.
    pub position_max_m: f64,
    /// Mean difference of heading, degrees; `None` where the reference has none.
    pub heading_mean_deg: Option<f64>,
    /// Distance at the end, meters.
    pub loop_m: f64,
    /// Distance left after a rigid motion of the plane, root mean square, meters.
    pub ate_rmse_m: Option<f64>,
}

/// Compares an estimate with a reference.
///
/// # Errors
/// Every [`ScoreError`] but those of maps: instants that differ, fewer than two poses or pairs, no common time, an
/// alignment that these positions cannot determine.
pub fn score(
    reference: &Trajectory,
    estimate: &Trajectory,
    settings: &ScoreSettings,
) -> Result<Score, ScoreError> {
    check(reference, estimate, settings)?;
    let raw = associate(reference, estimate, settings.association_max)?;
    if raw.len() < 2 {
        let association_max = settings.association_max;
        return Err(ScoreError::TooFewPairs { found: raw.len(), wanted: 2, association_max });
    }
    let reference_from_estimate = align(&raw, settings.alignment)?;
    let pairs = moved(&raw, &reference_from_estimate);

    let errors = errors_of(&pairs, settings.has_heading);
    let positions: Vec<f64> = errors.iter().map(|error| error.position_m).collect();
    let headings: Vec<f64> = errors.iter().filter_map(|error| error.heading_deg).map(f64::abs).collect();
    let heading_steps =
        if settings.has_heading { motion::heading_increments_deg(&pairs) } else { Vec::new() };
    let position_steps = motion::position_increments_m(&pairs);
    let offsets = motion::direction_offsets_rad(&pairs, settings.direction_step_m);
    let directions: Vec<f64> = offsets.iter().copied().map(f64::abs).collect();
    let direction_steps = motion::direction_increments_rad(&offsets);
    let summary = |samples: Vec<f64>| if settings.has_heading { Stats::of(&samples) } else { None };
    let step = PairSpacing::Frames(1);
    let per_meter = PairSpacing::PathM(1.0);

    let (Some(ape_stats), Some(end), Some(last)) =
        (Stats::of(&ape(&pairs, PoseRelation::Translation)), loop_error(&pairs), errors.last())
    else {
        return Err(ScoreError::TooFewPoses { which: "estimate", found: 0, wanted: 2 });
    };
    let (path_length_m, position_mean_m) = (last.distance_m, mean(&positions));
    Ok(Score {
        samples: pairs.len(),
        coverage_ratio: coverage(reference, &pairs),
        path_length_m,
        alignment: settings.alignment,
        association_max_s: settings.association_max.seconds(),
        pose_time: settings.pose_time_reference,
        reference_from_estimate,
        position_mean_m,
        position_rms_m: rms(&positions),
        position_max_m: positions.iter().copied().fold(0.0, f64::max),
        heading_mean_deg: Stats::of(&headings).map(|stats| stats.mean),
        heading_rms_deg: Stats::of(&headings).map(|stats| stats.rmse),
        position_increment_mean_m: mean(&position_steps),
        position_increment_rms_m: rms(&position_steps),
        heading_increment_mean_deg: Stats::of(&heading_steps).map(|stats| stats.mean),
        heading_increment_rms_deg: Stats::of(&heading_steps).map(|stats| stats.rmse),
        motion_direction_mean_rad: Stats::of(&directions).map(|stats| stats.mean),
        motion_direction_rms_rad: Stats::of(&directions).map(|stats| stats.rmse),
        motion_direction_increment_mean_rad: Stats::of(&direction_steps).map(|stats| stats.mean),
        motion_direction_increment_rms_rad: Stats::of(&direction_steps).map(|stats| stats.rmse),
        error_ratio_percent: (path_length_m > 0.0).then(|| 100.0 * position_mean_m / path_length_m),
        loop_m: end.position_m,
        loop_heading_deg: settings.has_heading.then_some(end.heading_deg),
        ape: ape_stats,
        ape_rotation_deg: summary(ape(&pairs, PoseRelation::RotationAngle)),
        ape_se2: planar_errors_se2(&raw),
        rpe_translation: summary(rpe(&pairs, PoseRelation::Translation, step)),
        rpe_rotation_deg: summary(rpe(&pairs, PoseRelation::RotationAngle, step)),
        rpe_translation_per_meter: summary(rpe(&pairs, PoseRelation::Translation, per_meter)),
        consistency: None,
        revised: None,
        errors,
    })
}

impl Score {
    /// Adds how the errors of `estimate` compare with the covariances that its poses were `said` with; reference, estimate
    /// and settings are those of the score.
    ///
    /// # Errors
    /// Those of [`consistency`].
    pub fn with_covariances(
        mut self,
        reference: &Trajectory,
        estimate: &Trajectory,
        said: &[Estimate],
        settings: &ScoreSettings,
    ) -> Result<Score, ScoreError> {
        self.consistency = consistency(reference, estimate, said, settings, &self.reference_from_estimate)?;
        Ok(self)
    }

    /// Adds what the path as finally believed is off by; reference and settings are those of the score.
    ///
    /// # Errors
    /// Those of [`score`].
    pub fn with_revised(
        mut self,
        reference: &Trajectory,
        revised: Option<&Trajectory>,
        settings: &ScoreSettings,
    ) -> Result<Score, ScoreError> {
        let revised = revised.map(|path| score(reference, path, settings)).transpose()?;
        self.revised = revised.map(|score| Revised {
            position_mean_m: score.position_mean_m,
            position_max_m: score.position_max_m,
            heading_mean_deg: score.heading_mean_deg,
            loop_m: score.loop_m,
            ate_rmse_m: score.ape_se2.map(|ape| ape.rmse),
        });
        Ok(self)
    }
}

fn check(reference: &Trajectory, estimate: &Trajectory, settings: &ScoreSettings) -> Result<(), ScoreError> {
    if settings.pose_time_reference != settings.pose_time_estimate {
        return Err(ScoreError::PoseTimeMismatch {
            reference: settings.pose_time_reference,
            estimate: settings.pose_time_estimate,
        });
    }
    if settings.alignment == Alignment::Origin && !settings.has_heading {
        return Err(ScoreError::HeadingNeeded { alignment: settings.alignment });
    }
    if settings.direction_step_m.is_nan() || settings.direction_step_m < 0.0 {
        return Err(ScoreError::Setting {
            name: "direction_step_m",
            found: settings.direction_step_m,
            wanted: "zero or more meters",
        });
    }
    for (which, trajectory) in [("reference", reference), ("estimate", estimate)] {
        if trajectory.len() < 2 {
            return Err(ScoreError::TooFewPoses { which, found: trajectory.len(), wanted: 2 });
        }
    }
    Ok(())
}

fn moved(pairs: &[Pair], reference_from_estimate: &Pose) -> Vec<Pair> {
    pairs.iter().map(|pair| Pair { estimate: reference_from_estimate * pair.estimate, ..*pair }).collect()
}

fn errors_of(pairs: &[Pair], has_heading: bool) -> Vec<ErrorSample> {
    let mut distance_m = 0.0;
    let mut before = pairs.first().map(|pair| pair.reference.translation.vector.xy());
    pairs
        .iter()
        .map(|pair| {
            let at = pair.reference.translation.vector.xy();
            distance_m += before.replace(at).map_or(0.0, |before| (at - before).norm());
            let turn = wrap_angle(yaw_of(&pair.estimate) - yaw_of(&pair.reference));
            ErrorSample {
                stamp: pair.stamp,
                distance_m,
                position_m: (pair.estimate.translation.vector.xy() - at).norm(),
                heading_deg: has_heading.then(|| turn.to_degrees()),
            }
        })
        .collect()
}

fn planar_errors_se2(raw: &[Pair]) -> Option<Stats> {
    let reference_from_estimate = align(raw, Alignment::Se2).ok()?;
    let errors = errors_of(&moved(raw, &reference_from_estimate), false);
    Stats::of(&errors.iter().map(|error| error.position_m).collect::<Vec<_>>())
}

fn coverage(reference: &Trajectory, pairs: &[Pair]) -> f64 {
    let whole = match reference.poses() {
        [(first, _), .., (last, _)] => (*last - *first).seconds(),
        _ => return 0.0,
    };
    let compared = match pairs {
        [first, .., last] => (last.stamp - first.stamp).seconds(),
        _ => return 0.0,
    };
    (compared / whole).min(1.0)
}

#[cfg(test)]
mod tests;
