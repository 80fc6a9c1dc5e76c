//! Absolute pose error: how far each estimate is from its truth, as evo 1.38.1 computes it (`evo_ape`).

use crate::associate::Pair;
use arborloop_base::Pose;
use nalgebra::Matrix4;
use serde::{Deserialize, Serialize};

/// Which part of an error pose counts, with evo's name for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoseRelation {
    /// Distance, meters (`trans_part`).
    Translation,
    /// Angle of the rotation, degrees (`angle_deg`).
    RotationAngle,
    /// Frobenius norm of the 4 x 4 error matrix minus identity, no unit (`full`).
    Full,
}

impl PoseRelation {
    /// The size of an error pose.
    pub(crate) fn size_of(self, error: &Pose) -> f64 {
        match self {
            PoseRelation::Translation => error.translation.vector.norm(),
            PoseRelation::RotationAngle => error.rotation.angle().to_degrees(),
            PoseRelation::Full => (error.to_homogeneous() - Matrix4::identity()).norm(),
        }
    }
}

/// The error of each pair, in the order of the pairs and the unit of the relation. The pairs are already aligned.
///
/// The error pose is `estimate_from_reference`, the inverse of the estimate times the truth (Kuemmerle et al. 2009).
pub fn ape(pairs: &[Pair], relation: PoseRelation) -> Vec<f64> {
    pairs.iter().map(|pair| relation.size_of(&(pair.estimate.inverse() * pair.reference))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Time;
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    #[test]
    fn each_relation_sees_its_own_part_of_a_known_error() {
        let quarter = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        let pair = Pair {
            stamp: Time::default(),
            reference: Pose::translation(1.0, 1.0, 1.0),
            estimate: Pose::from_parts(Translation3::new(4.0, 5.0, 1.0), quarter),
        };
        assert!((ape(&[pair], PoseRelation::Translation)[0] - 5.0).abs() < 1e-12);
        assert!((ape(&[pair], PoseRelation::RotationAngle)[0] - 90.0).abs() < 1e-12);
        // A quarter turn differs from identity by four entries of 1; the translation adds 5 squared.
        assert!((ape(&[pair], PoseRelation::Full)[0] - 29.0_f64.sqrt()).abs() < 1e-12);
    }
}
