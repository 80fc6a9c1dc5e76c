//! Swings: a frequency and a phase, and the sine that all of the wind's motions share.

use arborloop_base::Draws;
use std::f64::consts::TAU;

/// One mode of a plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Swing {
    frequency_hz: f64,
    phase_turns: f64,
}

impl Swing {
    pub(super) fn draw([low_hz, high_hz]: [f64; 2], draws: &mut Draws) -> Self {
        Swing { frequency_hz: draws.within(low_hz, high_hz), phase_turns: draws.unit() }
    }

    /// The phase at an instant, turns in [0, 1).
    pub(super) fn turns(&self, seconds: f64) -> f64 {
        let turns = self.frequency_hz * seconds + self.phase_turns;
        let share = turns - floor(turns) as f64;
        // A hair below a whole turn may round up to it.
        if share < 1.0 { share } else { 0.0 }
    }

    /// The deflection at an instant, in [-1, 1].
    pub(super) fn at(&self, seconds: f64) -> f64 {
        sine(self.turns(seconds))
    }
}

/// The greatest whole number that is not above, for numbers of less than sixty bits. On processors of the first 64-bit
/// generation the library's is a call.
#[inline(always)]
pub(super) fn floor(x: f64) -> i64 {
    let toward_zero = x as i64;
    toward_zero - i64::from(toward_zero as f64 > x)
}

/// Sine of an angle in turns, [0, 2), within 1e-10: Taylor's series up to the fifteenth power on a quarter turn. Several
/// times faster than the library's, and the same on every system.
#[inline]
pub(super) fn sine(turns: f64) -> f64 {
    let share = if turns >= 1.0 { turns - 1.0 } else { turns };
    let share = if share > 0.5 { share - 1.0 } else { share };
    let x = TAU * (0.25 - (share.abs() - 0.25).abs());
    let square = x * x;
    let mut series = -1.0 / 1_307_674_368_000.0;
    for term in [6_227_020_800.0, -39_916_800.0, 362_880.0, -5040.0, 120.0, -6.0, 1.0] {
        series = series * square + 1.0 / term;
    }
    (series * x).copysign(share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_floor_agrees_with_the_library_s() {
        for step in -400..400 {
            let x = f64::from(step) / 8.0;
            assert_eq!(floor(x) as f64, x.floor());
        }
    }

    #[test]
    fn the_sine_agrees_with_the_library_s() {
        for step in 0..8000 {
            let turns = f64::from(step) / 4000.0;
            assert!((sine(turns) - (TAU * turns).sin()).abs() < 1e-10, "{turns}");
        }
    }
}
