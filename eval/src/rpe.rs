//! Relative pose error: how far each estimated motion is from its true motion, as evo 1.38.1 computes it (`evo_rpe`).

use crate::ape::PoseRelation;
use crate::associate::Pair;
use serde::{Deserialize, Serialize};

/// Between which pairs a motion is measured; motions follow one another and do not overlap.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PairSpacing {
    /// Every so many pairs (evo's `--delta N --delta_unit f`).
    Frames(usize),
    /// As soon as the estimated path since the last has this length, meters (evo's `--delta N --delta_unit m`).
    PathM(f64),
}

/// The error of each motion, in the order of time and the unit of the relation; independent of any alignment.
///
/// The error pose is the inverse of the true motion times the estimated motion (Sturm et al. 2012). Empty when the
/// path holds no motion of that spacing, or the spacing is zero.
pub fn rpe(pairs: &[Pair], relation: PoseRelation, spacing: PairSpacing) -> Vec<f64> {
    stations(pairs, spacing)
        .windows(2)
        .map(|step| {
            let (a, b) = (&pairs[step[0]], &pairs[step[1]]);
            let true_motion = a.reference.inverse() * b.reference;
            let estimated_motion = a.estimate.inverse() * b.estimate;
            relation.size_of(&(true_motion.inverse() * estimated_motion))
        })
        .collect()
}

fn stations(pairs: &[Pair], spacing: PairSpacing) -> Vec<usize> {
    match spacing {
        PairSpacing::Frames(0) => Vec::new(),
        PairSpacing::Frames(frames) => (0..pairs.len()).step_by(frames).collect(),
        PairSpacing::PathM(length_m) if length_m > 0.0 && !pairs.is_empty() => {
            let mut stations = vec![0];
            let mut walked_m = 0.0;
            for (index, step) in pairs.windows(2).enumerate() {
                walked_m +=
                    (step[1].estimate.translation.vector - step[0].estimate.translation.vector).norm();
                if walked_m >= length_m {
                    stations.push(index + 1);
                    walked_m = 0.0;
                }
            }
            stations
        }
        PairSpacing::PathM(_) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Pose, Time};
    use nalgebra::{Translation3, UnitQuaternion};

    fn walk(turn_radps: f64, stretch: f64) -> Vec<Pair> {
        (0..21)
            .map(|n| {
                let t = f64::from(n);
                let reference = Pose::translation(t, 0.0, 0.0);
                let turned = UnitQuaternion::from_euler_angles(0.0, 0.0, turn_radps * t);
                let estimate = Pose::from_parts(Translation3::new(stretch * t, 0.0, 0.0), turned);
                Pair { stamp: Time::from_nanos(n.into()), reference, estimate }
            })
            .collect()
    }

    #[test]
    fn a_stretched_path_errs_by_the_same_length_in_every_step() {
        let errors = rpe(&walk(0.0, 1.25), PoseRelation::Translation, PairSpacing::Frames(1));
        assert_eq!(errors.len(), 20);
        assert!(errors.iter().all(|error| (error - 0.25).abs() < 1e-12));
        let errors = rpe(&walk(0.0, 1.25), PoseRelation::Translation, PairSpacing::Frames(4));
        assert_eq!(errors.len(), 5);
        assert!(errors.iter().all(|error| (error - 1.0).abs() < 1e-12));
        let errors = rpe(&walk(0.0, 1.25), PoseRelation::Translation, PairSpacing::PathM(5.0));
        assert_eq!(errors.len(), 5);
    }

    #[test]
    fn a_steady_turn_errs_by_the_same_angle_in_every_step() {
        let errors = rpe(&walk(0.01, 1.0), PoseRelation::RotationAngle, PairSpacing::Frames(2));
        assert!(errors.iter().all(|error| (error - 0.02_f64.to_degrees()).abs() < 1e-12));
    }

    #[test]
    fn a_motion_of_the_whole_frame_changes_no_relative_error() {
        let moved_frame = Pose::from_parts(
            Translation3::new(3.0, 4.0, 5.0),
            UnitQuaternion::from_euler_angles(0.3, -0.2, 2.0),
        );
        let pairs = walk(0.01, 1.1);
        let moved: Vec<Pair> =
            pairs.iter().map(|pair| Pair { estimate: moved_frame * pair.estimate, ..*pair }).collect();
        for relation in [PoseRelation::Translation, PoseRelation::RotationAngle, PoseRelation::Full] {
            let (a, b) = (
                rpe(&pairs, relation, PairSpacing::Frames(1)),
                rpe(&moved, relation, PairSpacing::Frames(1)),
            );
            assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12));
        }
    }

    #[test]
    fn a_spacing_without_motion_has_no_error() {
        assert!(rpe(&walk(0.0, 1.0), PoseRelation::Full, PairSpacing::Frames(0)).is_empty());
        assert!(rpe(&walk(0.0, 1.0), PoseRelation::Full, PairSpacing::Frames(21)).is_empty());
        assert!(rpe(&walk(0.0, 1.0), PoseRelation::Full, PairSpacing::PathM(100.0)).is_empty());
        assert!(rpe(&walk(0.0, 1.0), PoseRelation::Full, PairSpacing::PathM(f64::NAN)).is_empty());
        assert!(rpe(&[], PoseRelation::Full, PairSpacing::PathM(1.0)).is_empty());
    }
}
