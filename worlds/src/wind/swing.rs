//! Swings: a plant's frequencies and phases, and the sine that all of the wind's motions share.

use super::{LEAF_HZ, LIMB_HZ, SHOOT_HZ, TRUNK_HZ};
use crate::Plant;
use arborloop_base::{Draws, Stream};
use std::f64::consts::TAU;

/// Modes of a plant: two of the trunk, three of the limb, three that nothing follows, four of the shoots, four of the
/// leaves.
pub(super) const MODES: usize = 16;

/// One plant's own frequencies and phases, as whole numbers of which a turn has 2^32: sums that run over begin a new
/// turn by themselves, so that phases are exact however late it is.
#[derive(Debug, Clone, PartialEq)]
#[repr(align(64))]
pub(super) struct Modes {
    /// Per millisecond.
    frequency: [u32; MODES],
    phase: [u32; MODES],
}

const TURN: f64 = (1_u64 << 32) as f64;

impl Modes {
    pub(super) fn new(plant: &Plant, index: usize, trees: Stream, limbs: Stream) -> Self {
        let mut tree = trees.at(u64::from(plant.instance));
        let mut limb = limbs.at(index as u64);
        let mut modes = Modes { frequency: [0; MODES], phase: [0; MODES] };
        (0..2).for_each(|mode| modes.draw(mode, TRUNK_HZ, &mut tree));
        (2..5).for_each(|mode| modes.draw(mode, LIMB_HZ, &mut limb));
        (8..12).for_each(|mode| modes.draw(mode, SHOOT_HZ, &mut limb));
        (12..16).for_each(|mode| modes.draw(mode, LEAF_HZ, &mut limb));
        modes
    }

    fn draw(&mut self, mode: usize, [low_hz, high_hz]: [f64; 2], draws: &mut Draws) {
        self.frequency[mode] = (draws.within(low_hz, high_hz) * 1e-3 * TURN) as u32;
        self.phase[mode] = (draws.unit() * TURN) as u32;
    }

    /// The phases at an instant, turns in [0, 1).
    pub(super) fn turns(&self, seconds: f64) -> [f64; MODES] {
        std::array::from_fn(|mode| {
            let turns =
                f64::from(self.frequency[mode]) / TURN * (1e3 * seconds) + f64::from(self.phase[mode]) / TURN;
            let share = turns - floor(turns) as f64;
            // A hair below a whole turn may round up to it.
            if share < 1.0 { share } else { 0.0 }
        })
    }

    /// The phases at a whole millisecond, turns in [-1/2, 1/2].
    #[inline(always)]
    pub(super) fn turns_at(&self, millis: i64) -> [f32; MODES] {
        let mut turns = [0.0; MODES];
        let mut mode = 0;
        while mode < MODES {
            let all = self.frequency[mode].wrapping_mul(millis as u32).wrapping_add(self.phase[mode]);
            turns[mode] = all as i32 as f32 * (1.0 / TURN) as f32;
            mode += 1;
        }
        turns
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
    fn whole_numbers_and_real_ones_agree_on_phases_however_late_it_is() {
        let mut modes = Modes { frequency: [0; MODES], phase: [0; MODES] };
        for mode in 0..MODES {
            modes.frequency[mode] = 1_300_021 * (1 + 2 * mode as u32);
            modes.phase[mode] = 273_000_013 * mode as u32;
        }
        for step in -400..400_i64 {
            let millis = 123_457 * step;
            let (real, whole) = (modes.turns(1e-3 * millis as f64), modes.turns_at(millis));
            for (real, whole) in real.into_iter().zip(whole) {
                let apart = real - f64::from(whole);
                assert!((apart - apart.round()).abs() < 1e-7, "{millis}: {real} {whole}");
                assert!((0.0..1.0).contains(&real) && whole.abs() <= 0.5);
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
