//! How the shoots and leaves of one plant move at an instant.

use super::lanes::{Isa, Lanes};
use super::spur::Turn;
use arborloop_worlds::wind::Bend;

/// Sines and cosines of the phases that shoots share, times their farthest shift or the sine of their leaves' farthest
/// turn, so that a shoot's own are an addition theorem away. Single precision, without instructions that some processors
/// lack: the same bits everywhere.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flutter {
    shoots: [[f32; 8]; 2],
    leaves: [[f32; 4]; 2],
    /// How far shoots shift at most, plant frame, meters.
    pub(super) shoot_m: f32,
    /// Sine of the farthest turn of leaves.
    pub(super) leaf_sin: f32,
}

impl Flutter {
    /// From the sines and cosines of a plant's phases, the shoots' in entries 8 to 11 and the leaves' from 12 on.
    #[inline(always)]
    pub(super) fn new(bend: &Bend, sin: &[f32; 16], cos: &[f32; 16]) -> Self {
        let (shoot_m, leaf_sin) = (bend.shoot_m as f32, bend.leaf_sin as f32);
        let mut flutter = Flutter { shoots: [[0.0; 8]; 2], leaves: [[0.0; 4]; 2], shoot_m, leaf_sin };
        let mut slot = 0;
        while slot < 8 {
            flutter.shoots[0][slot] = shoot_m * sin[8 + (slot & 3)];
            flutter.shoots[1][slot] = shoot_m * cos[8 + (slot & 3)];
            slot += 1;
        }
        let mut pitch = 0;
        while pitch < 4 {
            flutter.leaves[0][pitch] = leaf_sin * sin[12 + pitch];
            flutter.leaves[1][pitch] = leaf_sin * cos[12 + pitch];
            pitch += 1;
        }
        flutter
    }

    /// Sines and cosines of the phases that shoots share, times their farthest shift; shoot `k`'s in entry `k % 4`.
    #[inline(always)]
    pub(super) fn shared(&self) -> [&[f32; 8]; 2] {
        [&self.shoots[0], &self.shoots[1]]
    }

    /// How far a shoot is along its line, meters; `ahead` is its own.
    #[inline(always)]
    pub(super) fn shift_m(&self, shoot: usize, [sin, cos]: [f32; 2]) -> f32 {
        self.shoots[0][shoot & 3] * cos + self.shoots[1][shoot & 3] * sin
    }

    /// How far a shoot's leaves have turned.
    #[inline(always)]
    pub(super) fn turn(&self, shoot: usize, [sin, cos]: [f32; 2]) -> Turn {
        let sin = self.leaves[0][shoot & 3] * cos + self.leaves[1][shoot & 3] * sin;
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
