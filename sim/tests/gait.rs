//! The physics gait against its acceptance bars, in short walks; `benches/gait.rs` has the long ones.

mod walked;

use arborloop_robots::{Body, Command, FallCause, TrotSettings};
use nalgebra::Vector3;
use walked::{Guide, ground, walk};

const STILL: Guide = Guide::Always(Command { forward_mps: 0.0, turn_radps: 0.0 });
const AHEAD: Guide = Guide::Always(Command { forward_mps: 0.5, turn_radps: 0.0 });

#[test]
fn a_standing_robot_presses_on_the_ground_with_its_weight_and_stays() {
    for slope_deg in [0.0, 5.0] {
        let standing = walk(&ground(0.0, slope_deg, 1), &TrotSettings::default(), &STILL, 3.0, 1);
        let weight_n = 9.806_65 * Body::go1().mass_kg;
        let last = &standing.states[2999];
        let force: Vector3<f64> = last.loads.unwrap().foot_forces_n.iter().sum();
        assert!((force - Vector3::z() * weight_n).norm() < 0.01 * weight_n, "{force:?} against {weight_n} N");
        let from = &standing.states[999].world_from_base;
        let moved = last.world_from_base.translation.vector - from.translation.vector;
        let turned_deg = from.rotation.angle_to(&last.world_from_base.rotation).to_degrees();
        assert!(moved.norm() / 2.0 < 2e-4, "{} m/s on {slope_deg} degrees", moved.norm() / 2.0);
        assert!(turned_deg / 2.0 < 0.05, "{} deg/s on {slope_deg} degrees", turned_deg / 2.0);
    }
}

#[test]
fn a_robot_told_to_walk_trots_as_fast_as_told_inside_its_motors_limits() {
    let trot = walk(&ground(0.0, 0.0, 1), &TrotSettings::default(), &AHEAD, 5.0, 1);
    assert_eq!(trot.fall, None);
    let found = trot.measured();
    assert!((found.speed_mps - 0.5).abs() < 0.03, "{found:?}");
    for (n, motor) in Body::go1().motors.iter().enumerate() {
        assert!(found.torque_max_nm[n] <= motor.torque_nm_max, "{found:?}");
        assert!(found.rate_max_radps[n] <= motor.speed_radps_max, "{found:?}");
    }
    assert!(found.duty.iter().all(|duty| (0.5..0.6).contains(duty)), "{found:?}");
}

#[test]
fn a_robot_on_its_side_has_fallen_and_says_so() {
    // Ground that no blind trot climbs: 40 degrees and slippery.
    let mut settings = TrotSettings::default();
    settings.physics.friction = 0.1;
    let slip = walk(&ground(0.0, 40.0, 1), &settings, &AHEAD, 5.0, 1);
    let fall = slip.fall.unwrap();
    assert!(matches!(fall.cause, FallCause::Tipped | FallCause::Collapsed), "{fall:?}");
    assert_eq!(fall.after.nanos() / 1_000_000, slip.states.len() as i64 + 1);
}
