//! Gusts: a record of the wind that begins anew, and how far plants give way at each of its entries.

use super::swing::floor;
use super::{GUST_STEP_S, GUST_STEPS, LEAF_RAD, WindSpec};
use arborloop_base::Stream;
use std::f64::consts::TAU;

/// Stronger gusts bend nothing further, m/s: leaves have reconfigured, and this is no place for a robot.
pub(super) const SPEED_MPS_MAX: f64 = 15.0;
/// The speed at which deflections are named, m/s.
const SPEED_MPS_NAMED: f64 = 10.0;
/// Bending grows with this power of the speed: drag with the Vogel exponent -0.7 of reconfiguring foliage.
const BENDING_POWER: f64 = 1.3;
/// Flutter grows with this power only (Tadrist et al. 2018: weakly wind-dependent).
const FLUTTER_POWER: f64 = 0.5;
/// Sines in the record.
const SINES: u64 = 32;

/// The wind at one place and instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Gust {
    pub(super) speed_mps: f64,
    /// How far trunks, limbs and shoots give way, as a share of their deflections at the named speed.
    pub(super) bending: f64,
    /// How far leaves turn, as a share of their turn at the named speed, and the sine of that turn.
    pub(super) flutter: f64,
    pub(super) leaf_sin: f64,
}

/// Gusts at one place, [`GUST_STEP_S`] apart; periodic. Between two entries each number is interpolated, so no power of
/// the speed is taken more often than once an entry.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Record(Vec<Gust>);

impl Gust {
    fn of(speed_mps: f64) -> Self {
        let flutter = (speed_mps / SPEED_MPS_NAMED).powf(FLUTTER_POWER).min(1.0);
        let bending = (speed_mps / SPEED_MPS_NAMED).powf(BENDING_POWER);
        Gust { speed_mps, bending, flutter, leaf_sin: (flutter * LEAF_RAD).sin() }
    }

    fn most(self, other: Gust) -> Self {
        Gust {
            speed_mps: self.speed_mps.max(other.speed_mps),
            bending: self.bending.max(other.bending),
            flutter: self.flutter.max(other.flutter),
            leaf_sin: self.leaf_sin.max(other.leaf_sin),
        }
    }
}

impl Record {
    /// Still air: no entry, and nobody asks for one.
    pub(super) fn still() -> Self {
        Record(Vec::new())
    }

    /// A periodic record of speeds whose fluctuation has Kaimal's spectrum, `S(n) ~ 1 / (1 + 10 n)^(5/3)` with
    /// `n = f z / U`, between 0.01 and 1 Hz.
    pub(super) fn new(spec: &WindSpec, stream: Stream) -> Self {
        let length_s = GUST_STEP_S * GUST_STEPS as f64;
        // Height over mean speed of the reduced frequency: 10 m eddies.
        let eddy_s = 10.0 / spec.mean_mps;
        let mut sines: Vec<(f64, f64, f64)> = (0..SINES)
            .map(|index| {
                let mut draws = stream.at(index);
                let frequency_hz = 0.01 * 100.0_f64.powf((index as f64 + draws.unit()) / SINES as f64);
                // A whole number of periods in the record, so that it closes on itself.
                let periods = (frequency_hz * length_s).round().max(1.0);
                let frequency_hz = periods / length_s;
                // On a logarithmic axis each sine stands for f S(f).
                let power = frequency_hz / (1.0 + 10.0 * frequency_hz * eddy_s).powf(5.0 / 3.0);
                (periods, power.sqrt(), draws.unit())
            })
            .collect();
        let variance: f64 = sines.iter().map(|(_, amplitude, _)| amplitude * amplitude / 2.0).sum();
        let scale = spec.gust_ratio / variance.sqrt();
        sines.iter_mut().for_each(|(_, amplitude, _)| *amplitude *= scale);
        let speeds = (0..GUST_STEPS).map(|step| {
            let share = step as f64 / GUST_STEPS as f64;
            let gust: f64 =
                sines.iter().map(|(n, amplitude, phase)| amplitude * (TAU * (n * share + phase)).sin()).sum();
            (spec.mean_mps * (1.0 + gust)).clamp(0.0, SPEED_MPS_MAX)
        });
        Record(speeds.map(Gust::of).collect())
    }

    /// At an instant of the record's own time.
    #[inline(always)]
    pub(super) fn at(&self, seconds: f64) -> Gust {
        let (step, share) = place(seconds);
        let (a, b) = (self.entry(step), self.entry(step + 1));
        let mixed = |a: f64, b: f64| a + (b - a) * share;
        Gust {
            speed_mps: mixed(a.speed_mps, b.speed_mps),
            bending: mixed(a.bending, b.bending),
            flutter: mixed(a.flutter, b.flutter),
            leaf_sin: mixed(a.leaf_sin, b.leaf_sin),
        }
    }

    /// The most of each number between two instants, at most one record apart.
    pub(super) fn most_between(&self, from_s: f64, to_s: f64) -> Gust {
        let (first, last) = (place(from_s).0, place(to_s).0 + 1);
        let count = (last - first).rem_euclid(GUST_STEPS as i64);
        (0..=count).fold(Gust::default(), |most, step| most.most(self.entry(first + step)))
    }

    /// The most of each number ever.
    pub(super) fn most(&self) -> Gust {
        self.0.iter().copied().fold(Gust::default(), Gust::most)
    }

    #[inline(always)]
    fn entry(&self, step: i64) -> Gust {
        self.0[step.rem_euclid(GUST_STEPS as i64) as usize]
    }
}

/// The entry before an instant, and how far on to the next one it is.
#[inline(always)]
fn place(seconds: f64) -> (i64, f64) {
    let at = seconds * (1.0 / GUST_STEP_S);
    let step = floor(at);
    (step, at - step as f64)
}
