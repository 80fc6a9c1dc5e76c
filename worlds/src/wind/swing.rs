//! Swings: a plant's frequencies and phases, and the sine that all of the wind's motions share.

use super::{LEAF_HZ, LIMB_HZ, SHOOT_HZ, TRUNK_HZ};
use crate::Plant;
use arborloop_base::{Draws, Stream};
use std::f64::consts::TAU;

/// Modes of a plant: two of the trunk, three of the limb, three that nothing follows, four of the shoots, four of the
/// leaves.
const COUNT: usize = 16;

/// One plant's own frequencies, Hz, and phases, turns: the exact values of numbers in single precision, because the
/// processor reads them anew for each plant and instant.
#[derive(Debug, Clone, PartialEq)]
#[repr(align(64))]
pub(super) struct Modes {
    frequency_hz: [f32; COUNT],
    phase_turns: [f32; COUNT],
}

impl Modes {
    pub(super) fn new(plant: &Plant, index: usize, trees: Stream, limbs: Stream) -> Self {
        let mut tree = trees.at(u64::from(plant.instance));
        let mut limb = limbs.at(index as u64);
        let mut modes = Modes { frequency_hz: [0.0; COUNT], phase_turns: [0.0; COUNT] };
        (0..2).for_each(|mode| modes.draw(mode, TRUNK_HZ, &mut tree));
        (2..5).for_each(|mode| modes.draw(mode, LIMB_HZ, &mut limb));
        (8..12).for_each(|mode| modes.draw(mode, SHOOT_HZ, &mut limb));
        (12..16).for_each(|mode| modes.draw(mode, LEAF_HZ, &mut limb));
        modes
    }

    fn draw(&mut self, mode: usize, [low_hz, high_hz]: [f64; 2], draws: &mut Draws) {
        self.frequency_hz[mode] = draws.within(low_hz, high_hz) as f32;
        self.phase_turns[mode] = draws.unit() as f32;
    }

    /// The phases at an instant, turns in [0, 1).
    #[inline(always)]
    pub(super) fn turns(&self, seconds: f64) -> [f64; COUNT] {
        let mut turns = [0.0; COUNT];
        let mut mode = 0;
        while mode < COUNT {
            let all = f64::from(self.frequency_hz[mode]) * seconds + f64::from(self.phase_turns[mode]);
            let share = all - round(all);
            let share = if share < 0.0 { share + 1.0 } else { share };
            // A hair below a whole turn may round up to it.
            turns[mode] = if share < 1.0 { share } else { 0.0 };
            mode += 1;
        }
        turns
    }
}

/// The nearest whole number, for numbers of less than fifty bits: a sum whose last bit is one.
#[inline(always)]
fn round(x: f64) -> f64 {
    const ONES: f64 = 1.5 * (1_u64 << 52) as f64;
    (x + ONES) - ONES
}

/// The greatest whole number that is not above, for numbers of less than sixty bits. On processors of the first 64-bit
/// generation the library's is a call.
#[inline(always)]
pub(super) fn floor(x: f64) -> i64 {
    let toward_zero = x as i64;
    toward_zero - i64::from(toward_zero as f64 > x)
}

/// Sines of angles in turns, each in [0, 2).
#[inline(always)]
pub(super) fn sines(turns: &[f64; 8]) -> [f64; 8] {
    let mut sines = [0.0; 8];
    let mut each = 0;
    while each < 8 {
        sines[each] = sine(turns[each]);
        each += 1;
    }
    sines
}

/// Sine of an angle in turns, [0, 2), within 1e-10: Taylor's series up to the fifteenth power on a quarter turn. Several
/// times faster than the library's, and the same on every system.
#[inline(always)]
pub(super) fn sine(turns: f64) -> f64 {
    let share = if turns >= 1.0 { turns - 1.0 } else { turns };
    let share = if share > 0.5 { share - 1.0 } else { share };
    let x = TAU * (0.25 - (share.abs() - 0.25).abs());
    let square = x * x;
    let series = square * (-1.0 / 1_307_674_368_000.0) + 1.0 / 6_227_020_800.0;
    let series = square * series - 1.0 / 39_916_800.0;
    let series = square * series + 1.0 / 362_880.0;
    let series = square * series - 1.0 / 5040.0;
    let series = square * series + 1.0 / 120.0;
    let series = square * series - 1.0 / 6.0;
    (square * series * x + x).copysign(share)
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
    fn phases_are_what_is_left_of_whole_turns() {
        let mut modes = Modes { frequency_hz: [0.0; COUNT], phase_turns: [0.0; COUNT] };
        for mode in 0..COUNT {
            (modes.frequency_hz[mode], modes.phase_turns[mode]) = (0.25 * mode as f32, 0.125);
        }
        for step in -400..400 {
            let seconds = f64::from(step) / 8.0;
            for (mode, turns) in modes.turns(seconds).into_iter().enumerate() {
                assert_eq!(turns, (0.25 * mode as f64 * seconds + 0.125).rem_euclid(1.0));
            }
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
