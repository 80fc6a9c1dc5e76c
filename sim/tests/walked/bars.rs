//! Measures of a few bars that need more than the states at a kilohertz: filters, other ticks, poses between ticks.

use super::Soil;
use arborloop_base::{Pose, Seed, Span, pose2};
use arborloop_robots::{Command, TrotSettings, TrunkMotion, TrunkState, go1};
use arborloop_sim::PhysicsGait;
use arborloop_worlds::World;
use nalgebra::UnitQuaternion;
use std::f64::consts::PI;

/// A signal at a kilohertz through two Butterworth low-passes of second order at 100 Hz.
pub(crate) fn below_100_hz(signal: &[f64]) -> Vec<f64> {
    let k = (PI * 100.0 * super::TICK_S).tan();
    let norm = 1.0 / (1.0 + 2_f64.sqrt() * k + k * k);
    let (b0, a1, a2) = (k * k * norm, 2.0 * (k * k - 1.0) * norm, (1.0 - 2_f64.sqrt() * k + k * k) * norm);
    let pass = |signal: &[f64]| {
        let (mut x, mut y) = ([0.0; 2], [0.0; 2]);
        let mut out = Vec::with_capacity(signal.len());
        for value in signal {
            let now = b0 * (value + 2.0 * x[0] + x[1]) - a1 * y[0] - a2 * y[1];
            (x, y) = ([*value, x[0]], [now, y[0]]);
            out.push(now);
        }
        out
    };
    pass(&pass(signal))
}

/// The magnitude that one value in a hundred exceeds.
pub(crate) fn percentile(signal: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = signal.iter().map(|value| value.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() * 99 / 100).copied().unwrap_or(0.0)
}

/// A walk straight on with ticks of any length, after half a second of standing.
pub(crate) fn stepped(world: &World, forward_mps: f64, tick_s: f64, seconds: f64) -> Vec<TrunkState> {
    let tick = Span::from_seconds(tick_s);
    let settings = TrotSettings::default();
    let mut gait = PhysicsGait::new(world, &settings, pose2(0.0, 0.0, 0.0), tick, Seed(1));
    let mut states = Vec::new();
    for number in 0..(seconds / tick_s).round() as usize {
        let forward_mps = if number as f64 * tick_s < 0.5 { 0.0 } else { forward_mps };
        let command = Command { forward_mps, turn_radps: 0.0 };
        states.push(gait.advance(&command, &Soil(&world.terrain)).clone());
    }
    states
}

fn lidar(state: &TrunkState) -> Pose {
    state.world_from_base * Pose::translation(0.0, 0.0, go1::LIDAR_Z_M)
}

/// How far the lidar is from where a motion at constant speed and turn rate between two poses has it: meters, degrees.
fn off(from: &Pose, to: &Pose, share: f64, truth: &Pose) -> (f64, f64) {
    let shift = to.translation.vector - from.translation.vector;
    let turn = (from.rotation.inverse() * to.rotation).scaled_axis();
    let place = from.translation.vector + shift * share;
    let rotation = from.rotation * UnitQuaternion::from_scaled_axis(turn * share);
    ((place - truth.translation.vector).norm(), rotation.angle_to(&truth.rotation).to_degrees())
}

/// Greatest error of poses between every `every`-th state, meters and degrees.
pub(crate) fn between_ticks(states: &[TrunkState], every: usize) -> (f64, f64) {
    let mut most = (0.0_f64, 0.0_f64);
    for window in states.windows(every + 1).step_by(every) {
        for (n, state) in window.iter().enumerate() {
            let share = n as f64 / every as f64;
            let (m, deg) = off(&lidar(&window[0]), &lidar(&window[every]), share, &lidar(state));
            most = (most.0.max(m), most.1.max(deg));
        }
    }
    most
}

/// Root mean square of what a sweep of 100 ms is bent by when it is taken for a motion at constant speed and turn rate:
/// meters and degrees.
pub(crate) fn distortion(states: &[TrunkState]) -> (f64, f64) {
    let (mut meters, mut degrees, mut count) = (0.0, 0.0, 0.0);
    for window in states.windows(101).step_by(100) {
        for (n, state) in window.iter().enumerate() {
            let (m, deg) = off(&lidar(&window[0]), &lidar(&window[100]), n as f64 / 100.0, &lidar(state));
            (meters, degrees, count) = (meters + m * m, degrees + deg * deg, count + 1.0);
        }
    }
    ((meters / f64::max(count, 1.0)).sqrt(), (degrees / f64::max(count, 1.0)).sqrt())
}
