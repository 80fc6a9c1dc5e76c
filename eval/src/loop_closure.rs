//! Where the path ends: the error of the last pose, the paper's `loop_e` = |g_N - p_N|.
//!
//! It says how well a loop closed only when the path ends where it began, as the paper's do.

use crate::associate::Pair;
use arborloop_base::{wrap_angle, yaw_of};

/// Error of the last pair of an aligned path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopError {
    /// Horizontal distance from the true end to the estimated end, meters.
    pub position_m: f64,
    /// Heading error at the end, degrees, never negative.
    pub heading_deg: f64,
}

/// The error at the end of the path; `None` without pairs. The pairs are already aligned.
pub fn loop_error(pairs: &[Pair]) -> Option<LoopError> {
    let last = pairs.last()?;
    let off = last.reference.translation.vector - last.estimate.translation.vector;
    let turn = wrap_angle(yaw_of(&last.estimate) - yaw_of(&last.reference));
    Some(LoopError { position_m: off.xy().norm(), heading_deg: turn.abs().to_degrees() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Pose, Time, pose2, spatial};

    #[test]
    fn only_the_last_pose_counts_and_height_does_not() {
        let pair = |reference, estimate| Pair { stamp: Time::default(), reference, estimate };
        let pairs = [
            pair(Pose::identity(), Pose::translation(50.0, 0.0, 0.0)),
            pair(Pose::translation(0.0, 0.0, 9.0), spatial(&pose2(3.0, 4.0, -0.5))),
        ];
        let error = loop_error(&pairs).unwrap();
        assert!((error.position_m - 5.0).abs() < 1e-12);
        assert!((error.heading_deg - 0.5_f64.to_degrees()).abs() < 1e-12);
        assert_eq!(loop_error(&[]), None);
    }
}
