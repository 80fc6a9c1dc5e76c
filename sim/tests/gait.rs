//! The physics gait against its acceptance bars, in short walks; `benches/gait.rs` has the long ones.

mod walked;

use arborloop_base::{Observation, Record, Seed, Sink, SinkError, Time};
use arborloop_robots::{Body, Command, FallCause, GaitMode, TrotSettings, TrunkState};
use arborloop_sim::{Driver, End, Scenario, Simulator, run};
use nalgebra::Vector3;
use walked::bars::{between_ticks, distortion, stepped};
use walked::{Guide, Measured, ground, walk};

const STILL: Guide = Guide::Always(Command { forward_mps: 0.0, turn_radps: 0.0 });
const AHEAD: Guide = Guide::Always(Command { forward_mps: 0.5, turn_radps: 0.0 });

fn pushed() -> TrotSettings {
    let mut settings = TrotSettings::default();
    (settings.physics.push_mps, settings.physics.push_every_s) = (0.15, 2.5);
    settings
}

fn inside_its_motors(found: &Measured) {
    for (n, motor) in Body::go1().motors.iter().enumerate() {
        assert!(found.torque_max_nm[n] <= motor.torque_nm_max, "{found:?}");
        assert!(found.rate_max_radps[n] <= motor.speed_radps_max, "{found:?}");
    }
    assert!(found.saturated < 1e-3 && found.knee_rms_nm < 9.0, "{found:?}");
}

#[test]
fn a_standing_robot_presses_on_the_ground_with_its_weight_and_stays() {
    // On a slope it still settles against the joints' dry friction: its feet stay, its trunk sinks into place.
    for (slope_deg, moving_mps_max) in [(0.0, 2e-4), (5.0, 4e-4)] {
        let standing = walk(&ground(0.0, slope_deg, 1), &TrotSettings::default(), &STILL, 3.5, 1);
        let weight_n = 9.806_65 * Body::go1().mass_kg;
        let (from, last) = (&standing.states[1999], &standing.states[3499]);
        let force: Vector3<f64> = last.loads.unwrap().foot_forces_n.iter().sum();
        assert!((force - Vector3::z() * weight_n).norm() < 0.01 * weight_n, "{force:?} against {weight_n} N");
        let moved = last.world_from_base.translation.vector - from.world_from_base.translation.vector;
        let turned_deg = from.world_from_base.rotation.angle_to(&last.world_from_base.rotation).to_degrees();
        assert!(moved.norm() / 1.5 < moving_mps_max, "{} m/s on {slope_deg} degrees", moved.norm() / 1.5);
        assert!(turned_deg / 1.5 < 0.05, "{} deg/s on {slope_deg} degrees", turned_deg / 1.5);
    }
}

#[test]
fn a_trot_on_flat_ground_holds_the_bars() {
    let trot = walk(&ground(0.0, 0.0, 1), &TrotSettings::default(), &AHEAD, 7.0, 1);
    assert_eq!(trot.fall, None);
    let found = trot.measured();
    println!("{found:?}");
    inside_its_motors(&found);
    assert!((found.speed_mps - 0.5).abs() < 0.03);
    assert!(found.duty.iter().all(|duty| (0.5..=0.6).contains(duty)));
    assert!((0.5..0.75).contains(&found.cost_abs) && (0.3..0.55).contains(&found.cost_positive));
    let [gait, impacts, _] = found.az_mps2;
    assert!((0.7..1.8).contains(&gait) && (0.5..2.0).contains(&impacts));
    assert!((4.0..15.0).contains(&found.az_percentile_mps2), "{} m/s2", found.az_percentile_mps2);
    assert!((0.1..1.0).contains(&found.roll_deg) && (0.1..1.0).contains(&found.pitch_deg));
    assert!((0.001..0.008).contains(&found.bob_m));
    // Two footfalls a stride: the even harmonics carry the vertical shaking.
    let [once, twice, fourth, ..] = found.harmonics_mps2;
    assert!(twice > 2.0 * once && fourth > 2.0 * once);
    for times in [2.0, 4.0] {
        assert!((found.peak_near(times) - times / 0.45).abs() < 0.12, "{times}: {}", found.peak_near(times));
    }
}

#[test]
fn pushes_bumps_and_slopes_do_not_bring_it_down() {
    for seed in [1, 2] {
        let trot = walk(&ground(0.03, 5.0, seed), &pushed(), &Guide::Rectangle(0.5), 9.0, seed);
        assert_eq!(trot.fall, None);
        let found = trot.measured();
        println!("{found:?}");
        inside_its_motors(&found);
        assert!(found.cross_rms_m < 0.06 && found.cross_max_m < 0.2);
        assert!((0.55..0.85).contains(&found.cost_abs));
        let [gait, impacts, _] = found.az_mps2;
        assert!((0.7..1.8).contains(&gait) && (0.5..2.0).contains(&impacts));
        assert!((0.4..2.0).contains(&found.roll_deg) && (0.3..1.5).contains(&found.pitch_deg));
        assert!((0.003..0.015).contains(&found.bob_m));
    }
}

#[test]
fn harder_touchdowns_and_faster_walks_shake_more() {
    let impacts = |touchdown_mps: f64, forward_mps: f64| {
        let mut settings = TrotSettings::default();
        settings.physics.touchdown_mps = touchdown_mps;
        let guide = Guide::Always(Command { forward_mps, turn_radps: 0.0 });
        walk(&ground(0.0, 0.0, 1), &settings, &guide, 6.5, 1).measured().az_mps2[1]
    };
    let (hard, soft, nominal) =
        (impacts(0.3, 0.5), impacts(0.0, 0.5), TrotSettings::default().physics.touchdown_mps);
    assert!(hard > 2.0 * soft, "{hard} m/s2 at 0.3 m/s against {soft} at 0");
    assert!(impacts(nominal, 1.0) > 1.4 * impacts(nominal, 0.25));
}

#[test]
fn four_substeps_shake_as_one_does() {
    let shaking = |substeps: u32| {
        let mut settings = TrotSettings::default();
        settings.physics.substeps = substeps;
        let [gait, impacts, _] = walk(&ground(0.0, 0.0, 1), &settings, &AHEAD, 6.5, 1).measured().az_mps2;
        gait.hypot(impacts)
    };
    let (one, four) = (shaking(1), shaking(4));
    assert!((one / four - 1.0).abs() < 0.1, "{one} against {four} m/s2");
}

#[test]
fn ticks_of_two_milliseconds_shake_as_those_of_one_do() {
    let shaking = |tick_s: f64| {
        let az = walked::imu_az_at(
            &stepped(&ground(0.0, 0.0, 1), 0.5, tick_s, 6.5).split_off((2.0 / tick_s) as usize),
            tick_s,
        );
        // Each value as long as it holds, so that both have a kilohertz.
        let held = (tick_s / walked::TICK_S).round() as usize;
        let az: Vec<f64> = az.iter().flat_map(|one| std::iter::repeat_n(*one, held)).collect();
        walked::band(&az, 1.0, 100.0)
    };
    let (one, two) = (shaking(0.001), shaking(0.002));
    assert!((two / one - 1.0).abs() < 0.15, "{two} m/s2 at 2 ms against {one}");
}

#[test]
fn poses_between_ticks_are_as_good_as_four_times_as_many_ticks() {
    let fine = stepped(&ground(0.03, 5.0, 1), 0.5, 0.00025, 3.0);
    let (off_m, off_deg) = between_ticks(&fine[4000..], 4);
    assert!(off_m < 5e-5 && off_deg < 0.01, "{off_m} m, {off_deg} degrees");
}

#[test]
fn a_late_controller_with_noisy_joints_still_walks() {
    let mut settings = pushed();
    let physics = &mut settings.physics;
    physics.delay_s = 0.002;
    (physics.joint_noise_rad, physics.joint_rate_noise_radps) = (0.001, 0.05);
    (physics.velocity_noise_mps, physics.tilt_error_deg) = (0.02, 0.5);
    let trot = walk(&ground(0.03, 5.0, 3), &settings, &Guide::Rectangle(0.5), 6.0, 3);
    assert_eq!(trot.fall, None);
    assert!(trot.measured().cross_max_m < 0.2);
}

#[test]
fn the_same_seed_walks_the_same_bits_and_another_does_not() {
    let bits = |seed: u64| -> Vec<u64> {
        let trot = walk(&ground(0.03, 5.0, 1), &pushed(), &Guide::Rectangle(0.5), 2.0, seed);
        trot.states.iter().flat_map(walked::numbers).map(f64::to_bits).collect()
    };
    let first = bits(1);
    assert!(first == bits(1));
    assert!(first != bits(2));
}

#[test]
fn replayed_strides_shake_as_the_physics_that_they_come_from() {
    for (bump_m, seed) in [(0.0, 1), (0.03, 1), (0.045, 1)] {
        let world = ground(bump_m, 0.0, seed);
        let walked = walk(&world, &TrotSettings::default(), &AHEAD, 20.0, seed);
        let physics = walked.measured();
        let replay = TrotSettings { mode: GaitMode::Strides, ..TrotSettings::default() };
        let replayed = walk(&world, &replay, &AHEAD, 20.0, seed);
        let strides = replayed.measured();
        let bent = |states: &[TrunkState]| distortion(&states[2000..]).1;
        let shaking = |one: &Measured| one.az_mps2[0].hypot(one.az_mps2[1]);
        for (name, found, wanted, share) in [
            ("az below 100 Hz", shaking(&strides), shaking(&physics), 0.2),
            ("roll", strides.roll_deg, physics.roll_deg, 0.25),
            ("pitch", strides.pitch_deg, physics.pitch_deg, 0.25),
            ("bob", strides.bob_m, physics.bob_m, 0.25),
            ("bending of a sweep", bent(&replayed.states), bent(&walked.states), 0.25),
        ] {
            assert!((found / wanted - 1.0).abs() < share, "{name} on {bump_m} m: {found} against {wanted}");
        }
    }
}

#[test]
fn ten_degrees_with_holes_are_climbed_and_fifteen_with_deep_ones_end_in_a_fall_that_says_why() {
    let climb = walk(&ground(0.05, 10.0, 1), &TrotSettings::default(), &Guide::Rectangle(0.5), 6.0, 1);
    assert_eq!(climb.fall, None);
    let steep = walk(&ground(0.08, 15.0, 3), &TrotSettings::default(), &Guide::Rectangle(0.5), 30.0, 3);
    let fall = steep.fall.unwrap();
    assert!(matches!(fall.cause, FallCause::Tipped | FallCause::Collapsed), "{fall:?}");
    assert_eq!(fall.after.nanos() / 1_000_000, steep.states.len() as i64 + 1);
}

#[test]
fn five_kilograms_of_luggage_are_carried_and_fifty_are_not() {
    let loaded = |luggage_kg: f64, seconds: f64| {
        let mut settings = TrotSettings::default();
        settings.physics.luggage_kg = luggage_kg;
        walk(&ground(0.03, 0.0, 1), &settings, &AHEAD, seconds, 1)
    };
    let carried = loaded(5.0, 7.0);
    assert_eq!(carried.fall, None);
    let found = carried.measured();
    println!("{found:?}");
    assert!((found.speed_mps - 0.5).abs() < 0.05 && found.saturated < 0.01);
    let forces = carried.states[5000..].iter().filter_map(|state| state.loads);
    let mean_n =
        forces.map(|loads| loads.foot_forces_n.iter().map(|force| force.z).sum::<f64>()).sum::<f64>()
            / carried.states[5000..].len() as f64;
    let weight_n = 9.806_65 * Body::go1_with(5.0).mass_kg;
    assert!((mean_n / weight_n - 1.0).abs() < 0.03, "{mean_n} N on the feet of {weight_n} N");
    let fall = loaded(50.0, 3.0).fall.map(|fall| fall.cause);
    assert!(matches!(fall, Some(FallCause::Collapsed | FallCause::Tipped)), "{fall:?}");
}

#[test]
fn a_fall_ends_a_run_with_its_cause() {
    let changes = ["gait.mode=\"physics\"", "gait.physics.friction=0.02", "world.terrain.slope_deg=20.0"];
    let document = Scenario::embedded("cone-field-go1-short").unwrap();
    let scenario = Scenario::read(&document.overridden(&changes.map(str::to_owned)).unwrap()).unwrap();
    let mut sim = Simulator::new(&scenario, Seed(1));
    let outcome = run(&mut sim, &mut [], Driver::Truth, &mut Nowhere, &mut |_, _| true).unwrap();
    assert!(matches!(outcome.end, End::Fell(_)), "{:?}", outcome.end);
    assert!(outcome.end.to_string().starts_with("Fell (the trunk "), "{}", outcome.end);
    assert!(outcome.duration.seconds() < 20.0);
}

#[test]
fn legs_tell_how_far_a_physics_walk_went() {
    let changes = [
        "gait.mode=\"physics\"",
        "odometry.source=\"legs\"",
        "odometry.scale_error_ratio=0.0",
        "odometry.speed_noise_mps=0.0",
        "odometry.turn_noise_radps=0.0",
        "imu.bandwidth_hz=150.0",
        "run.duration_s_max=6.0",
    ];
    let document = Scenario::embedded("cone-field-go1-short").unwrap();
    let scenario = Scenario::read(&document.overridden(&changes.map(str::to_owned)).unwrap()).unwrap();
    let mut sim = Simulator::new(&scenario, Seed(1));
    sim.obey(Command { forward_mps: 0.5, turn_radps: 0.0 });
    let (mut told_m, mut felt) = (0.0, 0.0);
    for _ in 0..6000 {
        for observation in sim.step() {
            match observation {
                Observation::Odometry(one) => told_m += one.twist.linear_mps.x / 50.0,
                Observation::Imu(one) => felt += one.specific_force_mps2.z / 3000.0,
                _ => {}
            }
        }
    }
    let truth = sim.truth();
    let went_m =
        (truth.world_from_base.translation.vector - truth.world_from_start.translation.vector).norm();
    assert!(went_m > 2.0 && (told_m / went_m - 1.0).abs() < 0.05, "{told_m} m told of {went_m} m");
    // However hard the feet land, what is felt is gravity on the average: the robot ends as high as it began.
    assert!((felt - 9.806_65).abs() < 0.1, "{felt} m/s2");
}

struct Nowhere;

impl Sink for Nowhere {
    fn write(&mut self, _now: Time, _record: &Record<'_>) -> Result<(), SinkError> {
        Ok(())
    }
}
