//! The paper's rows that look at motions instead of poses: increments, and directions of motion.

use crate::associate::Pair;
use arborloop_base::{wrap_angle, yaw_of};
use nalgebra::Vector2;

/// `| |g_i+1 - g_i| - |p_i+1 - p_i| |` for each step, horizontal, meters.
pub(super) fn position_increments_m(pairs: &[Pair]) -> Vec<f64> {
    pairs
        .windows(2)
        .map(|step| {
            (reference_step(&step[0], &step[1]).norm() - estimate_step(&step[0], &step[1]).norm()).abs()
        })
        .collect()
}

/// Difference of the true and the estimated change of heading for each step, degrees, never negative.
pub(super) fn heading_increments_deg(pairs: &[Pair]) -> Vec<f64> {
    let off = |pair: &Pair| yaw_of(&pair.estimate) - yaw_of(&pair.reference);
    pairs.windows(2).map(|step| wrap_angle(off(&step[1]) - off(&step[0])).abs().to_degrees()).collect()
}

/// `phi_p - phi_g`, phi the direction of motion in the plane, for each pair of stations, radians in (-pi, pi].
///
/// A station follows the last one when the true position has moved by `step_m`: a standing robot has no direction of
/// motion. Stations between which the estimate has not moved at all are left out. The paper unwraps both directions
/// before it subtracts, which counts whole turns once one of the two is unwrapped the other way round; here the
/// difference is wrapped.
pub(super) fn direction_offsets_rad(pairs: &[Pair], step_m: f64) -> Vec<f64> {
    let mut offsets = Vec::new();
    let Some(mut station) = pairs.first() else { return offsets };
    for pair in pairs {
        let truth = reference_step(station, pair);
        if truth.norm() < step_m || truth.norm() == 0.0 {
            continue;
        }
        let estimate = estimate_step(station, pair);
        if estimate.norm() > 0.0 {
            offsets.push(wrap_angle(bearing(&estimate) - bearing(&truth)));
        }
        station = pair;
    }
    offsets
}

/// `|dphi_g - dphi_p|` from each direction of motion to the next, radians in [0, pi].
pub(super) fn direction_increments_rad(offsets_rad: &[f64]) -> Vec<f64> {
    offsets_rad.windows(2).map(|step| wrap_angle(step[1] - step[0]).abs()).collect()
}

fn bearing(step: &Vector2<f64>) -> f64 {
    step.y.atan2(step.x)
}

fn reference_step(from: &Pair, to: &Pair) -> Vector2<f64> {
    (to.reference.translation.vector - from.reference.translation.vector).xy()
}

fn estimate_step(from: &Pair, to: &Pair) -> Vector2<f64> {
    (to.estimate.translation.vector - from.estimate.translation.vector).xy()
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Pose, Time, pose2, spatial};

    fn pair(reference: (f64, f64, f64), estimate: (f64, f64, f64)) -> Pair {
        let pose = |(x, y, yaw)| spatial(&pose2(x, y, yaw));
        Pair { stamp: Time::default(), reference: pose(reference), estimate: pose(estimate) }
    }

    #[test]
    fn increments_compare_lengths_and_turns_whatever_the_direction() {
        let pairs = [
            pair((0.0, 0.0, 3.1), (5.0, 5.0, 0.0)),
            pair((3.0, 4.0, -3.1), (5.0, 9.0, 0.0)),
            pair((3.0, 4.0, -3.0), (5.0, 9.0, -0.2)),
        ];
        let lengths = position_increments_m(&pairs);
        assert!((lengths[0] - 1.0).abs() < 1e-12 && lengths[1].abs() < 1e-12, "{lengths:?}");
        let turns = heading_increments_deg(&pairs);
        let expected = [(std::f64::consts::TAU - 6.2).to_degrees(), 0.3_f64.to_degrees()];
        assert!(turns.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{turns:?}");
    }

    #[test]
    fn directions_are_compared_from_station_to_station_and_the_short_way_round() {
        // True motion to the west, just above the cut of atan2; estimated just below it.
        let walked = |n: f64| pair((-n, 0.01 * n, 0.0), (-n, -0.01 * n, 0.0));
        let pairs: Vec<Pair> = (0..50).map(|n| walked(f64::from(n) * 0.05)).collect();
        let offsets = direction_offsets_rad(&pairs, 0.1);
        let expected = 2.0 * 0.01_f64.atan();
        assert!(offsets.len() >= 16 && offsets.iter().all(|e| (e - expected).abs() < 1e-9), "{offsets:?}");
        assert!(direction_increments_rad(&offsets).iter().all(|e| *e < 1e-9));
    }

    #[test]
    fn a_zigzag_about_a_straight_path_shows_in_the_increments() {
        let zigzag = |n: i32| pair((f64::from(n), 0.0, 0.0), (f64::from(n), f64::from(n % 2), 0.0));
        let pairs: Vec<Pair> = (0..10).map(zigzag).collect();
        let increments = direction_increments_rad(&direction_offsets_rad(&pairs, 0.1));
        assert_eq!(increments.len(), 8);
        assert!(increments.iter().all(|e| (e - std::f64::consts::FRAC_PI_2).abs() < 1e-12), "{increments:?}");
    }

    #[test]
    fn a_standing_robot_has_no_direction() {
        let standing =
            [Pair { stamp: Time::default(), reference: Pose::identity(), estimate: Pose::identity() }; 5];
        assert!(direction_offsets_rad(&standing, 0.0).is_empty());
        assert!(direction_offsets_rad(&[], 0.1).is_empty());
    }
}
