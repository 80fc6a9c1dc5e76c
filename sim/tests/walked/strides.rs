//! Strides cut out of walks of the physics gait: what `robots/assets/go1.strides` is made of.

use super::{Guide, TICK_S, Walk, ground, walk};
use arborloop_robots::strides::{Bin, Departure, FIRST_PHASE, OVERLAP, Pace, SAMPLES, StrideLibrary};
use arborloop_robots::{Command, TrotSettings};
use nalgebra::{Rotation2, Vector3};

/// Ticks of a stride.
const STRIDE: usize = 450;
/// Strides that are kept of each kind.
const KEPT: usize = 12;

/// Every kind: three speeds, three turns, smooth and rough ground.
pub(crate) fn library() -> Option<StrideLibrary> {
    let mut bins = Vec::new();
    for (bump_m, roughness_m) in [(0.0, 0.0), (0.045, 0.006)] {
        for forward_mps in [0.25, 0.5, 0.8] {
            for turn_radps in [-0.6, 0.0, 0.6] {
                bins.push(bin(Pace { forward_mps, turn_radps, roughness_m }, bump_m));
            }
        }
    }
    StrideLibrary::new(bins)
}

/// Strides of one kind, from one walk; the first seconds are left out.
pub(crate) fn bin(pace: Pace, bump_m: f64) -> Bin {
    let guide = Guide::Always(Command { forward_mps: pace.forward_mps, turn_radps: pace.turn_radps });
    let seconds = 3.0 + (KEPT + 4) as f64 * 0.45;
    let strides = (1..=5)
        .map(|seed| walk(&ground(bump_m, 0.0, seed), &TrotSettings::default(), &guide, seconds, seed))
        .find(|walk| walk.fall.is_none())
        .map_or(Vec::new(), |walk| cut(&walk));
    Bin { pace, strides }
}

/// Departures from the mean over one stride around each instant, cut at the middle of a stance.
pub(crate) fn cut(walk: &Walk) -> Vec<Vec<Departure>> {
    let states = &walk.states;
    let mut yaw = Vec::with_capacity(states.len());
    for state in states {
        let (_, _, now) = state.world_from_base.rotation.euler_angles();
        let before = yaw.last().copied().unwrap_or(now);
        yaw.push(before + arborloop_base::wrap_angle(now - before));
    }
    let channel = |pick: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..states.len()).map(pick).collect() };
    let at = |n: usize| states[n].world_from_base.translation.vector;
    let tilt = |n: usize| states[n].world_from_base.rotation.euler_angles();
    let channels = [
        channel(&|n| at(n).x),
        channel(&|n| at(n).y),
        channel(&|n| at(n).z),
        channel(&|n| tilt(n).0),
        channel(&|n| tilt(n).1),
        yaw,
    ];
    let smooth = channels.each_ref().map(|values| moving_mean(values));
    let departure = |n: usize| -> Departure {
        let off = |c: usize| channels[c][n] - smooth[c][n];
        let flat = Rotation2::new(-smooth[5][n]) * Vector3::new(off(0), off(1), 0.0).xy();
        [flat.x, flat.y, off(2), off(3), off(4), off(5)]
    };
    let first = (2.5 / TICK_S) as usize;
    let begins = (first..states.len() - 2 * STRIDE)
        .filter(|n| states[n - 1].phase < FIRST_PHASE && states[*n].phase >= FIRST_PHASE);
    // Two ticks a sample.
    begins.take(KEPT).map(|n| (0..SAMPLES + OVERLAP).map(|k| departure(n + 2 * k)).collect()).collect()
}

/// The mean over one stride around each value; nearer to an end over what there is.
fn moving_mean(values: &[f64]) -> Vec<f64> {
    let mut sums = vec![0.0];
    for value in values {
        sums.push(sums[sums.len() - 1] + value);
    }
    (0..values.len())
        .map(|n| {
            let (from, to) = (n.saturating_sub(STRIDE / 2), (n + STRIDE / 2).min(values.len()));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}
