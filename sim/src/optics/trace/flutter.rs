//! How the shoots and leaves of one plant move at an instant.

use super::lanes::{Isa, Lanes};
use super::spur::Turn;
use arborloop_worlds::wind::Bend;

/// Sines and cosines of the phases that shoots share, times their farthest shift or the sine of their leaves' farthest
/// turn, so that a shoot's own are an addition theorem away. Single precision, without instructions that some processors
/// lack: the same bits everywhere.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flutter {
    /// Four sines for shoots, four for leaves, four cosines for shoots, four for leaves, then what they are multiplied by,
    /// shoots' and leaves'. So who reads eight at once may begin with any of the fours.
    phases: [f32; 20],
}

impl Flutter {
    /// From the sines and cosines of a plant's phases, the shoots' in entries 8 to 11 and the leaves' from 12 on.
    #[inline(always)]
    pub(super) fn new(bend: &Bend, sin: &[f32; 16], cos: &[f32; 16]) -> Self {
        let (shoot_m, leaf_sin) = (bend.shoot_m as f32, bend.leaf_sin as f32);
        let mut flutter = Flutter { phases: [0.0; 20] };
        (flutter.phases[16], flutter.phases[17]) = (shoot_m, leaf_sin);
        let mut pitch = 0;
        while pitch < 4 {
            flutter.phases[pitch] = shoot_m * sin[8 + pitch];
            flutter.phases[4 + pitch] = leaf_sin * sin[12 + pitch];
            flutter.phases[8 + pitch] = shoot_m * cos[8 + pitch];
            flutter.phases[12 + pitch] = leaf_sin * cos[12 + pitch];
            pitch += 1;
        }
        flutter
    }

    /// How far shoots shift at most, plant frame, meters.
    #[inline(always)]
    pub(super) fn shoot_m(&self) -> f32 {
        self.phases[16]
    }

    /// Sine of the farthest turn of leaves.
    #[inline(always)]
    pub(super) fn leaf_sin(&self) -> f32 {
        self.phases[17]
    }

    /// Sines and cosines of the phases that shoots share, times their farthest shift; shoot `k`'s in entry `k % 4`.
    #[inline(always)]
    pub(super) fn shoots(&self) -> [&[f32; 8]; 2] {
        [self.eight::<0>(), self.eight::<8>()]
    }

    /// Those that leaves share, times the sine of their farthest turn; those of shoot `k` in entry `k % 4`.
    #[inline(always)]
    pub(super) fn leaves(&self) -> [&[f32; 8]; 2] {
        [self.eight::<4>(), self.eight::<12>()]
    }

    #[inline(always)]
    fn eight<const FROM: usize>(&self) -> &[f32; 8] {
        const { assert!(FROM + 8 <= 20) };
        // There are eight: the compiler leaves the other way out.
        self.phases[FROM..].first_chunk().unwrap_or(&[0.0; 8])
    }

    /// How far a shoot is along its line, meters; `ahead` is its own.
    #[inline(always)]
    pub(super) fn shift_m(&self, shoot: usize, [sin, cos]: [f32; 2]) -> f32 {
        self.phases[shoot & 3] * cos + self.phases[8 + (shoot & 3)] * sin
    }

    /// How far a shoot's leaves have turned.
    #[inline(always)]
    pub(super) fn turn(&self, shoot: usize, [sin, cos]: [f32; 2]) -> Turn {
        let sin = self.phases[4 + (shoot & 3)] * cos + self.phases[12 + (shoot & 3)] * sin;
        Turn { sin, cos: (1.0 - sin * sin).sqrt() }
    }
}

/// Sines and cosines of angles in turns, [-1/2, 1/2], within 4e-6: Taylor's series up to the ninth power on a quarter
/// turn.
#[inline(always)]
pub(super) fn sin_cos<I: Isa>(turns: &[f32; 16]) -> [[f32; 16]; 2] {
    let share = I::Wide::load(turns);
    let zero = I::Wide::splat(0.0);
    let (quarter, away) = (I::Wide::splat(0.25), share.abs());
    let sin = series::<I>(quarter.sub(away.sub(quarter).abs()));
    let sin = zero.sub(sin).keep(share.lt(zero), sin);
    // The cosine is the sine of a quarter turn less the angle.
    let cos = quarter.sub(away);
    let rise = series::<I>(cos.abs());
    let cos = zero.sub(rise).keep(cos.lt(zero), rise);
    let mut both = [[0.0; 16]; 2];
    sin.store(&mut both[0]);
    cos.store(&mut both[1]);
    both
}

/// Sines of up to a quarter turn.
#[inline(always)]
fn series<I: Isa>(turns: I::Wide) -> I::Wide {
    let x = turns.mul(I::Wide::splat(std::f32::consts::TAU));
    let square = x.mul(x);
    let series = square.fma(I::Wide::splat(1.0 / 362_880.0), I::Wide::splat(-1.0 / 5040.0));
    let series = square.fma(series, I::Wide::splat(1.0 / 120.0));
    let series = square.fma(series, I::Wide::splat(-1.0 / 6.0));
    square.mul(x).fma(series, x)
}

#[cfg(test)]
mod tests {
    use super::super::lanes::Portable;
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn sines_and_cosines_agree_with_the_library_s() {
        for step in -2000..=2000_i16 {
            let turns = f32::from(step) / 4000.0;
            let [sin, cos] = sin_cos::<Portable>(&[turns; 16]).map(|all| f64::from(all[5]));
            let angle = TAU * f64::from(turns);
            assert!((sin - angle.sin()).abs() < 5e-6 && (cos - angle.cos()).abs() < 5e-6, "{turns}");
        }
    }
}
