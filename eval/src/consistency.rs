//! Whether a system's covariances hold its errors: the normalized estimation error squared.
//!
//! A covariance is a promise. Who says "within two centimeters" and is off by ten misleads whatever plans with it, and who
//! says "within a meter" and is off by ten centimeters is of no more use than silence. The error squared over the
//! covariance (NEES; Bar-Shalom, Li and Kirubarajan 2001, section 5.4) tells both, free of units.

use crate::associate::associate;
use crate::score::{ScoreError, ScoreSettings};
use arborloop_base::{Estimate, Health, Pose, Trajectory, wrap_angle, yaw_of};
use nalgebra::{DMatrix, DVector, Matrix6};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Quantiles of chi-square with two and with three degrees of freedom: of 95 %, and what chance exceeds once in 100 000.
const USUAL: [f64; 2] = [5.991, 7.815];
const RARE: [f64; 2] = [23.026, 25.902];

/// How errors compare with the covariances that came with them.
///
/// Horizontal: x, y and, where the reference has one, heading; height and tilt are left out, as in the other numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Consistency {
    /// Number of compared poses that came with a covariance.
    pub samples: usize,
    /// Mean of the error squared over its covariance and over its dimensions (ANEES): 1 for an honest system, less for a
    /// modest one, more for one that believes in itself too much.
    pub anees: f64,
    /// How many of the errors lie outside of the ellipsoid that should hold 95 % of them, percent.
    pub outside_95_percent: f64,
    /// Number of poses called tracking whose error an honest covariance would let happen once in 100 000.
    pub confidently_wrong: usize,
}

/// Holds the covariances of estimates against their errors; `None` when no pair of poses has a covariance that can be
/// inverted. `reference_from_estimate` is the motion by which a score laid the estimate over the reference.
///
/// # Errors
/// Those of [`associate`].
pub fn consistency(
    reference: &Trajectory,
    estimate: &Trajectory,
    said: &[Estimate],
    settings: &ScoreSettings,
    reference_from_estimate: &Pose,
) -> Result<Option<Consistency>, ScoreError> {
    let by_stamp: BTreeMap<_, _> = said.iter().map(|said| (said.stamp, said)).collect();
    let estimate_from_reference = reference_from_estimate.inverse();
    let (mut squares, mut outside, mut confidently_wrong) = (Vec::new(), 0, 0);
    let dimensions = if settings.has_heading { 3 } else { 2 };
    for pair in associate(reference, estimate, settings.association_max)? {
        let Some((said, covariance)) =
            by_stamp.get(&pair.stamp).and_then(|said| Some((said, said.covariance.as_ref()?)))
        else {
            continue;
        };
        // In the map's own frame, in which the covariance is told.
        let truth = estimate_from_reference * pair.reference;
        let off = pair.estimate.translation.vector - truth.translation.vector;
        let turn_rad = wrap_angle(yaw_of(&pair.estimate) - yaw_of(&truth));
        let error = DVector::from_column_slice(&[off.x, off.y, turn_rad][..dimensions]);
        let Some(square) = square_of(&error, covariance) else { continue };
        squares.push(square);
        outside += usize::from(square > USUAL[dimensions - 2]);
        let is_sure = said.health == Health::Tracking;
        confidently_wrong += usize::from(is_sure && square > RARE[dimensions - 2]);
    }
    let samples = squares.len();
    Ok((samples > 0).then(|| Consistency {
        samples,
        anees: squares.iter().sum::<f64>() / (samples * dimensions) as f64,
        outside_95_percent: 100.0 * outside as f64 / samples as f64,
        confidently_wrong,
    }))
}

/// The error squared over the part of the covariance that belongs to it: x, y and yaw of x, y, z, roll, pitch, yaw.
fn square_of(error: &DVector<f64>, covariance: &Matrix6<f64>) -> Option<f64> {
    let place = [0, 1, 5];
    let part = DMatrix::from_fn(error.len(), error.len(), |i, j| covariance[(place[i], place[j])]);
    let square = error.dot(&part.cholesky()?.solve(error));
    square.is_finite().then_some(square)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::Alignment;
    use crate::associate::PoseTime;
    use arborloop_base::{Seed, Span, Time, pose2, spatial};

    /// A path, and estimates whose errors are drawn from a covariance `honesty` times as large as they say. The
    /// estimates' map is turned and shifted.
    fn walk(honesty: f64) -> (Trajectory, Vec<Estimate>, Pose) {
        let mut draws = Seed(5).stream("consistency").at(0);
        let reference_from_map = spatial(&pose2(3.0, -1.0, 2.0));
        let sd = [0.05, 0.01, 0.02];
        let (mut path, mut said) = (Vec::new(), Vec::new());
        for n in 0..2000 {
            let stamp = Time::from_nanos(0) + Span::from_millis(100 * n);
            let at = pose2(0.01 * n as f64, (0.003 * n as f64).sin(), 0.002 * n as f64);
            path.push((stamp, reference_from_map * spatial(&at)));
            let mut off = |axis: usize| draws.normal() * sd[axis] * honesty.sqrt();
            let seen = pose2(at.translation.x + off(0), at.translation.y + off(1), 0.002 * n as f64 + off(2));
            let mut covariance = Matrix6::identity();
            for (axis, sd) in [0, 1, 5].into_iter().zip(sd) {
                covariance[(axis, axis)] = sd * sd;
            }
            let map_from_base = spatial(&seen);
            said.push(Estimate {
                stamp,
                map_from_base,
                covariance: Some(covariance),
                health: Health::Tracking,
            });
        }
        (Trajectory::new(path).unwrap(), said, reference_from_map)
    }

    fn trajectory(said: &[Estimate]) -> Trajectory {
        Trajectory::new(said.iter().map(|said| (said.stamp, said.map_from_base)).collect()).unwrap()
    }

    fn judged(
        reference: &Trajectory,
        said: &[Estimate],
        reference_from_map: &Pose,
        has_heading: bool,
    ) -> Option<Consistency> {
        let settings =
            ScoreSettings { has_heading, ..ScoreSettings::new(Alignment::OriginYaw, PoseTime::SweepEnd) };
        consistency(reference, &trajectory(said), said, &settings, reference_from_map).unwrap()
    }

    #[test]
    fn an_honest_system_scores_one_whatever_frame_it_draws_in() {
        let (reference, said, reference_from_map) = walk(1.0);
        for has_heading in [true, false] {
            let found = judged(&reference, &said, &reference_from_map, has_heading).unwrap();
            // The mean of 2000 times two or three unit squares: one, give or take four times sqrt(2 / 4000).
            assert!((found.anees - 1.0).abs() < 0.09, "{found:?}");
            assert!((found.outside_95_percent - 5.0).abs() < 2.0, "{found:?}");
            assert_eq!((found.samples, found.confidently_wrong), (2000, 0));
        }
    }

    #[test]
    fn who_promises_too_much_is_found_out_and_who_admits_to_be_lost_is_not_called_sure() {
        let (reference, mut said, reference_from_map) = walk(16.0);
        let found = judged(&reference, &said, &reference_from_map, true).unwrap();
        assert!((found.anees - 16.0).abs() < 1.5 && found.outside_95_percent > 50.0, "{found:?}");
        assert!(found.confidently_wrong > 500, "{found:?}");
        said.iter_mut().for_each(|said| said.health = Health::Lost);
        assert_eq!(judged(&reference, &said, &reference_from_map, true).unwrap().confidently_wrong, 0);
    }

    #[test]
    fn covariances_that_are_none_leave_nothing_to_judge() {
        let (reference, mut said, reference_from_map) = walk(1.0);
        said[0].covariance = Some(Matrix6::zeros());
        said[1].covariance = Some(Matrix6::from_diagonal_element(f64::NAN));
        said[2..].iter_mut().for_each(|said| said.covariance = None);
        assert_eq!(judged(&reference, &said, &reference_from_map, true), None);
        said[3].covariance = Some(Matrix6::identity());
        assert_eq!(judged(&reference, &said, &reference_from_map, true).unwrap().samples, 1);
    }
}
