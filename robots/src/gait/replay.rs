//! Strides of the library, one after the other: chosen by chance among those that continue the motion best.

use super::oscillator::Oscillator;
use super::planar::Planar;
use super::settings::TrotSettings;
use super::shake::{Moving, Shaken};
use super::strides::{Departure, FIRST_PHASE, OVERLAP, Pace, SAMPLES, StrideLibrary, between, blend};
use arborloop_base::Stream;

/// How many strides are drawn, of which the best continuation is taken; assumed: variety before smoothness.
const DRAWN: u64 = 4;
/// Below this pace the gait only treads, and its shaking fades, m/s; as the kinematic trot.
const TREADING_MPS: f64 = 0.1;
/// How fast the strength follows, hertz, and its damping ratio; as the kinematic trot.
const STRENGTH_HZ: f64 = 2.0;
const STRENGTH_DAMPING_RATIO: f64 = 0.9;
/// Strength below which the gait may stop without a visible jerk; as the kinematic trot.
const QUIET: f64 = 0.005;

/// What is being replayed.
#[derive(Debug, Clone)]
pub(crate) struct Replay {
    library: StrideLibrary,
    stream: Stream,
    strength: Oscillator,
    roughness_m: f64,
    played: u64,
    now: Vec<Departure>,
    /// The stride before, for the overlap.
    before: Vec<Departure>,
    /// Samples into the stride.
    at: f64,
    tick_s: f64,
    rate: f64,
}

impl Replay {
    pub(crate) fn new(library: StrideLibrary, stream: Stream, tick_s: f64) -> Self {
        let rest = vec![[0.0; 6]; SAMPLES + OVERLAP];
        let strength = Oscillator::at_rest(0.0, STRENGTH_HZ, STRENGTH_DAMPING_RATIO, tick_s);
        Replay {
            library,
            stream,
            strength,
            roughness_m: 0.0,
            played: 0,
            now: rest.clone(),
            before: rest,
            at: 0.0,
            tick_s,
            rate: 0.0,
        }
    }

    /// Whether the gait may stop here.
    pub(crate) fn is_quiet(&self) -> bool {
        self.strength.x.abs() < QUIET
    }

    /// One tick at a stride phase; `crosswise_m` is how far the feet stand off their plane.
    pub(crate) fn advance(
        &mut self,
        phase: f64,
        pace_mps: f64,
        crosswise_m: f64,
        planar: &Planar,
        settings: &TrotSettings,
    ) {
        let treading = (pace_mps / TREADING_MPS).min(1.0);
        let fade = treading * treading * (3.0 - 2.0 * treading);
        self.strength.advance(settings.vibration_ratio * fade);
        self.roughness_m += (crosswise_m - self.roughness_m) * (self.tick_s / 2.0).min(1.0);
        let share = (phase - FIRST_PHASE).rem_euclid(1.0);
        let at = share * SAMPLES as f64;
        self.rate = if pace_mps > 0.0 { SAMPLES as f64 / settings.period_s } else { 0.0 };
        if at + 1.0 < self.at || self.played == 0 && pace_mps > 0.0 {
            self.choose(planar);
        }
        self.at = at;
    }

    /// The next stride, from its own address.
    fn choose(&mut self, planar: &Planar) {
        let mut draws = self.stream.at(self.played);
        let pace = Pace {
            forward_mps: planar.speed_mps.x.abs(),
            turn_radps: planar.turn_radps,
            roughness_m: self.library.roughness_m(self.roughness_m, draws.unit()),
        };
        let bin = self.library.nearest(&pace);
        let end = between(&self.now, SAMPLES as f64);
        let mut best = (f64::INFINITY, &bin.strides[0]);
        for _ in 0..DRAWN {
            let stride = &bin.strides[(draws.unit() * bin.strides.len() as f64) as usize];
            let (value, slope) = between(stride, 0.0);
            // A meter is as far as a radian; slopes count over the overlap.
            let gap = (0..6)
                .map(|n| {
                    (value[n] - end.0[n]).powi(2) + ((slope[n] - end.1[n]) * 0.3 * OVERLAP as f64).powi(2)
                })
                .sum::<f64>();
            if gap < best.0 {
                best = (gap, stride);
            }
        }
        let next = best.1.clone();
        self.before = std::mem::replace(&mut self.now, next);
        self.played += 1;
    }

    /// What to add to the trunk's smooth motion.
    pub(crate) fn shaken(&self) -> Shaken {
        let (new, new_slope) = between(&self.now, self.at);
        let (old, old_slope) = between(&self.before, self.at + SAMPLES as f64);
        let (weight, weight_slope) = blend(self.at / OVERLAP as f64);
        let weight_slope = weight_slope / OVERLAP as f64;
        let channel = |n: usize| {
            let x = weight * new[n] + (1.0 - weight) * old[n];
            let slope =
                weight * new_slope[n] + (1.0 - weight) * old_slope[n] + weight_slope * (new[n] - old[n]);
            Moving {
                x: x * self.strength.x,
                rate: slope * self.rate * self.strength.x + x * self.strength.rate,
            }
        };
        Shaken {
            ahead: channel(0),
            left: channel(1),
            up: channel(2),
            roll: channel(3),
            pitch: channel(4),
            yaw: channel(5),
        }
    }
}
