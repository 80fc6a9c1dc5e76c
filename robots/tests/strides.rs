//! The stride library and the gait that replays it.

use arborloop_base::{Seed, Span, pose2};
use arborloop_robots::strides::{SAMPLES, StrideLibrary};
use arborloop_robots::{Command, GaitMode, Ground, KinematicTrot, TrotSettings, TrunkMotion, TrunkState};

const TICK_S: f64 = 0.001;

struct Level;

impl Ground for Level {
    fn height_m(&self, _x_m: f64, _y_m: f64) -> f64 {
        0.0
    }
}

fn walk(mode: GaitMode, vibration_ratio: f64, seed: u64) -> Vec<TrunkState> {
    let settings = TrotSettings { mode, vibration_ratio, ..TrotSettings::default() };
    let tick = Span::from_seconds(TICK_S);
    let mut gait = KinematicTrot::new(settings, pose2(0.0, 0.0, 0.0), tick, &Level, Seed(seed));
    let turning = |n: i32| 0.5 * f64::sin(f64::from(n) * 1e-3);
    (0..6000)
        .map(|n| gait.advance(&Command { forward_mps: 0.5, turn_radps: turning(n) }, &Level).clone())
        .collect()
}

#[test]
fn the_embedded_library_is_read_and_written_back_byte_by_byte() {
    let library = StrideLibrary::go1();
    assert!(library.bins().iter().all(|bin| bin.strides.len() >= 8), "variety within every bin");
    assert_eq!(StrideLibrary::decode(&library.encode()).unwrap(), library);
}

#[test]
fn bytes_that_are_no_library_are_refused_at_their_place() {
    let bytes = StrideLibrary::go1().encode();
    for length in [0, 1, 11, 15, 16, 100, bytes.len() - 1] {
        assert!(StrideLibrary::decode(&bytes[..length]).is_err(), "{length} bytes");
    }
    let mut broken = bytes;
    broken[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let refusal = StrideLibrary::decode(&broken).unwrap_err().to_string();
    assert_eq!(refusal, "stride library: found no number at byte 0, wanted a finite number");
}

#[test]
fn a_stride_ends_where_the_next_could_begin() {
    // The strides of a bin are samples of one periodic motion: ends and beginnings are of the same size.
    for bin in StrideLibrary::go1().bins() {
        let mean = |at: usize| {
            bin.strides.iter().map(|one| one[at][2].abs()).sum::<f64>() / bin.strides.len() as f64
        };
        assert!(mean(0) < 0.01 && mean(SAMPLES) < 0.01, "{:?}", bin.pace);
    }
}

#[test]
fn replayed_velocities_are_the_derivatives_of_the_poses() {
    for mode in [GaitMode::Strides, GaitMode::Smooth] {
        let (mut size, mut error) = (0.0, 0.0);
        for w in walk(mode, 1.0, 3).windows(3) {
            let [before, now, after] = [&w[0].world_from_base, &w[1].world_from_base, &w[2].world_from_base];
            let moved = (after.translation.vector - before.translation.vector) / (2.0 * TICK_S);
            let turned = (before.rotation.inverse() * after.rotation).scaled_axis() / (2.0 * TICK_S);
            let turned = now.rotation.inverse() * (before.rotation * turned);
            size += w[1].linear_mps.norm_squared() + w[1].angular_radps.norm_squared();
            error += (moved - w[1].linear_mps).norm_squared() + (turned - w[1].angular_radps).norm_squared();
        }
        assert!((error / size).sqrt() < 0.02, "{mode:?}: {}", (error / size).sqrt());
    }
}

#[test]
fn the_dial_scales_the_shaking_from_a_smooth_ride_to_twice_the_nominal() {
    let smooth = walk(GaitMode::Smooth, 1.0, 5);
    let off = |dial: f64| -> Vec<f64> {
        let shaken = walk(GaitMode::Strides, dial, 5);
        shaken
            .iter()
            .zip(&smooth)
            .map(|(a, b)| a.world_from_base.translation.z - b.world_from_base.translation.z)
            .collect()
    };
    let (none, nominal, twice) = (off(0.0), off(1.0), off(2.0));
    assert!(none.iter().all(|one| one.abs() < 1e-12));
    assert!(nominal.iter().any(|one| one.abs() > 5e-4));
    assert!(nominal.iter().zip(&twice).all(|(one, two)| (two - 2.0 * one).abs() < 1e-9));
}

#[test]
fn strides_are_drawn_by_the_seed() {
    assert_eq!(walk(GaitMode::Strides, 1.0, 1), walk(GaitMode::Strides, 1.0, 1));
    assert_ne!(walk(GaitMode::Strides, 1.0, 1).last(), walk(GaitMode::Strides, 1.0, 2).last());
}
