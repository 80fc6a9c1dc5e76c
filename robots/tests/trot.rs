//! The kinematic trot held against what a trot must do: geometry exactly, shaking within the published bars.

use arborloop_base::{Pose, Seed, Span, pose2};
use arborloop_robots::go1::{self, FOOT_RADIUS_M};
use arborloop_robots::{Command, Ground, KinematicTrot, TrotSettings, TrunkMotion, TrunkState};
use nalgebra::Vector3;
use std::f64::consts::TAU;

const TICK: Span = Span::from_millis(1);
const TICK_S: f64 = 1e-3;
const STRIDE_HZ: f64 = 1.0 / 0.45;

/// Ground that anyone can compute: a slope with bumps.
struct Hills {
    slope: f64,
    bump_m: f64,
}

impl Ground for Hills {
    fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        self.slope * x_m + self.bump_m * ((3.1 * x_m).sin() * (2.3 * y_m + 0.4).cos())
    }
}

const FLAT: Hills = Hills { slope: 0.0, bump_m: 0.0 };
const UNEVEN: Hills = Hills { slope: 0.05, bump_m: 0.03 };

fn walk(
    settings: TrotSettings,
    ground: &Hills,
    seed: u64,
    command: impl Fn(f64) -> Command,
    ticks: usize,
) -> Vec<TrunkState> {
    let mut trot = KinematicTrot::new(settings, pose2(0.3, -0.2, 0.4), TICK, ground, Seed(seed));
    (0..ticks).map(|tick| trot.advance(&command(tick as f64 * TICK_S), ground).clone()).collect()
}

fn ahead(_: f64) -> Command {
    Command { forward_mps: 0.5, turn_radps: 0.0 }
}

fn weaving(seconds: f64) -> Command {
    Command { forward_mps: 0.45 + 0.1 * (0.7 * seconds).sin(), turn_radps: 0.8 * (1.3 * seconds).sin() }
}

/// Vertical acceleration at the IMU without gravity, m/s2, from the stated velocities.
fn imu_az(states: &[TrunkState]) -> Vec<f64> {
    let lever = go1::go1().frame("imu_link").map_or(Vector3::zeros(), |pose| pose.translation.vector);
    let velocity = |state: &TrunkState| {
        state.linear_mps + state.world_from_base.rotation * state.angular_radps.cross(&lever)
    };
    states.windows(3).map(|w| (velocity(&w[2]) - velocity(&w[0])).z / (2.0 * TICK_S)).collect()
}

/// Root mean square of a signal's part between two frequencies, by a plain Fourier sum.
fn band_rms(signal: &[f64], low_hz: f64, high_hz: f64) -> f64 {
    let step_hz = 1.0 / (signal.len() as f64 * TICK_S);
    let (first, last) = ((low_hz / step_hz).ceil() as usize, (high_hz / step_hz).floor() as usize);
    (first..=last).map(|bin| 2.0 * power(signal, bin as f64 * step_hz)).sum::<f64>().sqrt()
}

fn power(signal: &[f64], hz: f64) -> f64 {
    // A phasor turned step by step: its rounding grows linearly and stays below 1e-11 here.
    let (turn_sin, turn_cos) = (TAU * hz * TICK_S).sin_cos();
    let (mut cos, mut sin, mut re, mut im) = (1.0, 0.0, 0.0, 0.0);
    for value in signal {
        re += value * cos;
        im += value * sin;
        (cos, sin) = (cos * turn_cos - sin * turn_sin, sin * turn_cos + cos * turn_sin);
    }
    (re * re + im * im) / (signal.len() as f64).powi(2)
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn a_standing_foot_does_not_slip_and_no_foot_goes_underground() {
    let states = walk(TrotSettings::default(), &UNEVEN, 3, weaving, 12_000);
    for pair in states.windows(2) {
        for leg in 0..4 {
            let foot = pair[1].feet_world[leg];
            let clearance_m = foot.z - FOOT_RADIUS_M - UNEVEN.height_m(foot.x, foot.y);
            assert!(clearance_m > -1e-12, "leg {leg} is {clearance_m} m under the ground");
            if pair[0].stance[leg] && pair[1].stance[leg] {
                assert_eq!(pair[0].feet_world[leg], foot);
                assert!(clearance_m < 1e-12, "leg {leg} stands {clearance_m} m above the ground");
            }
        }
    }
}

#[test]
fn a_foot_never_jumps() {
    let states = walk(TrotSettings::default(), &UNEVEN, 3, weaving, 12_000);
    // Minimum jerk peaks at 15/8 of the mean speed: a step of at most 0.5 m in 0.2 s, and the arc on top.
    let most_m = 15.0 / 8.0 * 0.5 / 0.2025 * TICK_S + 0.002;
    for pair in states.windows(2) {
        for leg in 0..4 {
            let step_m = (pair[1].feet_world[leg] - pair[0].feet_world[leg]).norm();
            assert!(step_m < most_m, "leg {leg} moved {step_m} m in a tick");
        }
    }
}

#[test]
fn each_foot_stands_for_its_share_of_the_stride() {
    let states = walk(TrotSettings::default(), &FLAT, 1, ahead, 9_000);
    for leg in 0..4 {
        let share = states.iter().filter(|state| state.stance[leg]).count() as f64 / states.len() as f64;
        assert!((share - 0.55).abs() < 0.01, "leg {leg} stands {share} of the time");
    }
    assert!(
        states.iter().all(|state| state.stance[0] == state.stance[3] && state.stance[1] == state.stance[2])
    );
}

#[test]
fn joint_angles_put_the_feet_where_they_are_and_stay_inside_their_limits() {
    for state in walk(TrotSettings::default(), &UNEVEN, 5, weaving, 12_000) {
        for leg in 0..4 {
            let angles: [f64; 3] = std::array::from_fn(|joint| state.joint_angles_rad[3 * leg + joint]);
            let foot = state.world_from_base * go1::foot(leg, angles);
            assert!((foot - state.feet_world[leg]).norm() < 1e-9, "leg {leg} at phase {}", state.phase);
            let limits = [go1::HIP_LIMITS_RAD, go1::THIGH_LIMITS_RAD, go1::CALF_LIMITS_RAD];
            for (angle, [low, high]) in angles.iter().zip(limits) {
                assert!((low..=high).contains(angle));
            }
        }
    }
}

#[test]
fn stated_velocities_are_the_derivatives_of_the_poses() {
    for (settings, ground) in [
        (TrotSettings::default(), &UNEVEN),
        (TrotSettings { vibration_ratio: 3.0, ..TrotSettings::default() }, &FLAT),
    ] {
        let states = walk(settings, ground, 7, weaving, 10_000);
        let (mut linear, mut angular, mut linear_error, mut angular_error) = (0.0, 0.0, 0.0, 0.0);
        for w in states.windows(3) {
            let [before, now, after] = [&w[0].world_from_base, &w[1].world_from_base, &w[2].world_from_base];
            let moved = (after.translation.vector - before.translation.vector) / (2.0 * TICK_S);
            let turned = (before.rotation.inverse() * after.rotation).scaled_axis() / (2.0 * TICK_S);
            // Turning by halves is seen from the middle pose's own axes.
            let turned = now.rotation.inverse() * (before.rotation * turned);
            linear += w[1].linear_mps.norm_squared();
            angular += w[1].angular_radps.norm_squared();
            linear_error += (moved - w[1].linear_mps).norm_squared();
            angular_error += (turned - w[1].angular_radps).norm_squared();
        }
        assert!((linear_error / linear).sqrt() < 1e-2, "{}", (linear_error / linear).sqrt());
        assert!((angular_error / angular).sqrt() < 1e-2, "{}", (angular_error / angular).sqrt());
    }
}

#[test]
fn the_trunk_shakes_as_much_as_a_walking_go1_is_expected_to() {
    for (ground, seed) in [(&FLAT, 1), (&FLAT, 2), (&UNEVEN, 3)] {
        let states = walk(TrotSettings::default(), ground, seed, ahead, 22_000);
        let az = imu_az(&states[2000..]);
        let (gait, impacts) = (band_rms(&az, 1.0, 20.0), band_rms(&az, 20.0, 100.0));
        assert!((0.7..1.8).contains(&gait), "1-20 Hz: {gait} m/s2");
        assert!((0.5..2.0).contains(&impacts), "20-100 Hz: {impacts} m/s2");
    }
}

#[test]
fn vertical_acceleration_peaks_at_the_footfalls() {
    let states = walk(TrotSettings::default(), &FLAT, 1, ahead, 22_000);
    let az = imu_az(&states[2000..]);
    for harmonic in [2.0, 4.0] {
        let around = |offset_hz: f64| power(&az, harmonic * STRIDE_HZ + offset_hz);
        let peak = (-10..=10).map(|n| around(0.01 * f64::from(n))).fold(0.0, f64::max);
        let beside =
            (15..80).map(|n| 0.01 * f64::from(n)).map(|hz| around(hz).max(around(-hz))).fold(0.0, f64::max);
        assert!(peak > 4.0 * beside, "harmonic {harmonic}: {peak} against {beside}");
    }
    let line = |harmonic: f64| band_rms(&az, harmonic * STRIDE_HZ - 0.2, harmonic * STRIDE_HZ + 0.2);
    assert!(line(2.0) > 2.0 * line(1.0));
}

#[test]
fn attitude_and_bob_on_flat_ground_stay_within_the_bars() {
    let states = walk(TrotSettings::default(), &FLAT, 4, ahead, 12_000);
    let states = &states[2000..];
    let angles = |n: usize| {
        let pick = move |state: &TrunkState| {
            let (roll, pitch, _) = state.world_from_base.rotation.euler_angles();
            [roll, pitch][n].to_degrees()
        };
        rms(states.iter().map(pick))
    };
    assert!((0.1..1.0).contains(&angles(0)), "roll {} degrees rms", angles(0));
    assert!((0.1..1.0).contains(&angles(1)), "pitch {} degrees rms", angles(1));
    let heights = || states.iter().map(|state| state.world_from_base.translation.z);
    let bob_m = heights().fold(f64::MIN, f64::max) - heights().fold(f64::MAX, f64::min);
    assert!((0.001..0.008).contains(&bob_m), "bob {bob_m} m peak to peak");
}

#[test]
fn harder_touchdowns_and_faster_walking_shake_more() {
    let impacts = |touchdown_mps: f64, forward_mps: f64| {
        let settings = TrotSettings { touchdown_mps, ..TrotSettings::default() };
        let states = walk(settings, &FLAT, 1, |_| Command { forward_mps, turn_radps: 0.0 }, 12_000);
        band_rms(&imu_az(&states[2000..]), 20.0, 100.0)
    };
    assert!(impacts(0.6, 0.5) > 2.0 * impacts(0.2, 0.5));
    assert!(impacts(0.4, 1.0) > 1.4 * impacts(0.4, 0.25));
}

#[test]
fn without_vibration_the_trunk_glides_level_over_flat_ground() {
    let settings = TrotSettings { vibration_ratio: 0.0, ..TrotSettings::default() };
    let stand_height_m = settings.stand_height_m;
    for state in walk(settings, &FLAT, 1, weaving, 8_000) {
        let (roll, pitch, _) = state.world_from_base.rotation.euler_angles();
        assert!(roll.abs() < 1e-12 && pitch.abs() < 1e-12);
        assert!((state.world_from_base.translation.z - stand_height_m).abs() < 1e-12);
    }
}

#[test]
fn a_robot_told_nothing_stands_exactly_where_it_is() {
    let still = |_: f64| Command::default();
    let states = walk(TrotSettings::default(), &UNEVEN, 1, still, 10_000);
    let (first, last) = (&states[0], &states[states.len() - 1]);
    assert_eq!(first.feet_world, last.feet_world);
    assert!(last.stance.iter().all(|stands| *stands));
    let moved = first.world_from_base.inverse() * last.world_from_base;
    assert!(moved.translation.vector.norm() < 1e-9 && moved.rotation.angle() < 1e-9);
}

#[test]
fn a_robot_told_to_stop_stops_with_all_feet_down_and_then_drifts_no_more() {
    let halt = |seconds: f64| if seconds < 5.0 { weaving(seconds) } else { Command::default() };
    let states = walk(TrotSettings::default(), &UNEVEN, 9, halt, 14_000);
    let stopped = states.iter().rposition(|state| state.stance.contains(&false)).map_or(0, |last| last + 1);
    assert!(stopped < 8_000, "still treading after {stopped} ms");
    let (from, to) = (&states[12_000].world_from_base, &states[13_999].world_from_base);
    let drift_mps = (to.translation.vector - from.translation.vector).norm() / 2.0;
    let drift_degps = from.rotation.angle_to(&to.rotation).to_degrees() / 2.0;
    assert!(drift_mps < 2e-4 && drift_degps < 0.05, "{drift_mps} m/s, {drift_degps} deg/s");
    // No jerk anywhere on the way: a walking trunk's own peaks are the bar.
    let peak = |part: &[TrunkState]| imu_az(part).iter().fold(0.0_f64, |most, a| most.max(a.abs()));
    assert!(peak(&states[5_000..14_000]) <= peak(&states[..5_000]));
}

#[test]
fn the_gaits_of_other_controllers_walk_and_stop_as_well() {
    // unitree_guide: 0.45 s at one half and the alternative 0.4 s at 0.6; learned gaits: 3 Hz.
    for (period_s, duty_ratio) in [(0.45, 0.5), (0.4, 0.6), (1.0 / 3.0, 0.5), (0.8, 0.75)] {
        let settings = TrotSettings { period_s, duty_ratio, ..TrotSettings::default() };
        let halt = |seconds: f64| if seconds < 4.0 { ahead(seconds) } else { Command::default() };
        let states = walk(settings, &UNEVEN, 2, halt, 9_000);
        for leg in 0..4 {
            let walking = &states[..4_000];
            let share = walking.iter().filter(|state| state.stance[leg]).count() as f64 / 4_000.0;
            assert!(
                (share - duty_ratio).abs() < 0.05,
                "leg {leg} stands {share} of the time, wanted {duty_ratio}"
            );
        }
        assert!(states[8_000..].iter().all(|state| state.stance == [true; 4]), "{period_s} s, {duty_ratio}");
        let moved = states[8_999].world_from_base.translation.vector
            - states[8_000].world_from_base.translation.vector;
        assert!(moved.norm() < 2e-4);
        let walked =
            states[3_999].world_from_base.translation.vector - states[0].world_from_base.translation.vector;
        assert!((1.5..2.0).contains(&walked.xy().norm()), "walked {} m", walked.xy().norm());
    }
}

#[test]
fn a_robot_walks_as_told_within_a_few_percent_but_never_exactly() {
    let mut lengths = Vec::new();
    for seed in 0..8 {
        let states = walk(TrotSettings::default(), &FLAT, seed, ahead, 12_000);
        let (from, to) = (&states[2_000].world_from_base, &states[11_999].world_from_base);
        lengths.push((to.translation.vector - from.translation.vector).norm() / 9.999);
    }
    for speed in &lengths {
        // 22 strides of 3 % scatter and the fade of the sway: four standard errors and a centimeter.
        assert!((speed / 0.5 - 1.0).abs() < 4.0 * 0.03 / 22_f64.sqrt() + 0.01, "{speed} m/s");
    }
    assert!(lengths.windows(2).all(|pair| pair[0] != pair[1]));
}

#[test]
fn the_same_seed_walks_the_same_way_and_another_does_not() {
    let run = |seed| walk(TrotSettings::default(), &UNEVEN, seed, weaving, 3_000);
    assert_eq!(run(11), run(11));
    assert_ne!(run(11).last(), run(12).last());
}

#[test]
fn the_trunk_follows_a_slope_without_lagging_behind() {
    let slope = Hills { slope: 0.1, bump_m: 0.0 };
    let settings = TrotSettings { vibration_ratio: 0.0, ..TrotSettings::default() };
    let stand_height_m = settings.stand_height_m;
    let state = walk(settings, &slope, 1, ahead, 10_000).pop().expect("ten thousand ticks were walked");
    let at = state.world_from_base.translation;
    // The suspension trails a ramp by 2 zeta / omega times the climbing speed: 0.048 s of at most 0.05 m/s.
    assert!((at.z - slope.height_m(at.x, at.y) - stand_height_m).abs() < 0.003);
    let up = state.world_from_base.rotation * Vector3::z();
    let normal = Vector3::new(-0.1, 0.0, 1.0).normalize();
    assert!(up.angle(&normal) < 1e-3, "trunk is {} rad off the slope", up.angle(&normal));
}

#[test]
fn commands_beyond_the_limits_or_not_finite_do_no_harm() {
    let wild = |seconds: f64| match (seconds * 2.0) as i64 % 4 {
        0 => Command { forward_mps: 1e9, turn_radps: -1e9 },
        1 => Command { forward_mps: f64::NAN, turn_radps: 0.0 },
        2 => Command { forward_mps: f64::INFINITY, turn_radps: 0.3 },
        _ => Command { forward_mps: -0.4, turn_radps: 0.9 },
    };
    for state in walk(TrotSettings::default(), &UNEVEN, 1, wild, 8_000) {
        let pose: Pose = state.world_from_base;
        assert!(pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|n| n.is_finite()));
        assert!(state.linear_mps.xy().norm() < 1.3);
    }
}

#[test]
fn settings_that_make_no_gait_are_refused_by_name() {
    let refused = TrotSettings { duty_ratio: f64::NAN, ..TrotSettings::default() }.check().unwrap_err();
    assert_eq!(refused.to_string(), "duty_ratio is NaN, wanted a number from 0.5 to 0.9");
    assert!(toml::from_str::<TrotSettings>("perod_s = 0.4").is_err());
    let written = toml::to_string(&TrotSettings::default()).unwrap();
    assert_eq!(toml::from_str::<TrotSettings>(&written).unwrap(), TrotSettings::default());
}
