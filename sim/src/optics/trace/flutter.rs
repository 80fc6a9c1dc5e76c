//! How the shoots and leaves of one plant move at an instant.

use arborloop_worlds::wind::{Bend, LEAF_PHASES, LEAVES_PER_SHOOT, own_turns};
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// Every so many shoots, leaves swing in step.
const STEPS: usize = LEAF_PHASES / LEAVES_PER_SHOOT;

/// Sines and cosines of the phases that shoots share, times their farthest shift, so that a shoot's own are an addition theorem away, and the turns
/// of all leaves. Single precision, without instructions that some processors lack: the same bits everywhere.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flutter {
    /// Sines of the turns of a shoot's eight leaves, then their cosines; shoot `k`'s in entry `k % STEPS`.
    leaves: [[[f32; 8]; 2]; STEPS],
    shoots: [[f32; 8]; 2],
    /// How far shoots shift at most, plant frame, meters.
    pub(super) shoot_m: f32,
    /// Sine of the farthest turn of leaves.
    pub(super) leaf_sin: f32,
}

/// Sines and cosines of the turns by which leaves are ahead of their plant's phase.
static AHEAD: LazyLock<[[[f32; 8]; 2]; STEPS]> = LazyLock::new(|| {
    std::array::from_fn(|step| {
        let angle = |slot: usize| TAU * own_turns(step * LEAVES_PER_SHOOT + slot);
        [
            std::array::from_fn(|slot| angle(slot).sin() as f32),
            std::array::from_fn(|slot| angle(slot).cos() as f32),
        ]
    })
});

impl Flutter {
    #[inline(always)]
    pub(super) fn new(bend: &Bend) -> Self {
        let mut turns = [0.0_f32; 16];
        let mut slot = 0;
        while slot < 8 {
            turns[slot] = bend.shoot_turns[slot % 4] as f32;
            turns[8 + slot] = bend.leaf_turns[slot % 4] as f32;
            slot += 1;
        }
        let (sin, cos) = (sines(&turns, 0.0), sines(&turns, 0.25));
        let (shoot_m, leaf_sin) = (bend.shoot_m as f32, bend.leaf_sin as f32);
        let mut flutter =
            Flutter { leaves: [[[0.0; 8]; 2]; STEPS], shoots: [[0.0; 8]; 2], shoot_m, leaf_sin };
        let ahead: &[[[f32; 8]; 2]; STEPS] = &AHEAD;
        let mut step = 0;
        while step < STEPS {
            let mut slot = 0;
            while slot < 8 {
                let [ahead_sin, ahead_cos] = [ahead[step][0][slot], ahead[step][1][slot]];
                let turn_sin = leaf_sin * (sin[8 + slot] * ahead_cos + cos[8 + slot] * ahead_sin);
                flutter.leaves[step][0][slot] = turn_sin;
                flutter.leaves[step][1][slot] = (1.0 - turn_sin * turn_sin).sqrt();
                slot += 1;
            }
            step += 1;
        }
        let mut slot = 0;
        while slot < 8 {
            flutter.shoots[0][slot] = shoot_m * sin[slot];
            flutter.shoots[1][slot] = shoot_m * cos[slot];
            slot += 1;
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
        let [shared_sin, shared_cos] = [self.shoots[0][shoot & 3], self.shoots[1][shoot & 3]];
        shared_sin * cos + shared_cos * sin
    }

    /// Sines and cosines of the turns of a shoot's leaves.
    #[inline(always)]
    pub(super) fn leaves(&self, shoot: usize) -> [&[f32; 8]; 2] {
        let [sin, cos] = &self.leaves[shoot % STEPS];
        [sin, cos]
    }
}

/// Sines of angles in turns, each further by `more`, within 4e-6: Taylor's series up to the ninth power on a quarter
/// turn. Angles and their sums are in [0, 2).
#[inline(always)]
fn sines(turns: &[f32; 16], more: f32) -> [f32; 16] {
    let mut sines = [0.0; 16];
    let mut each = 0;
    while each < 16 {
        let turns = turns[each] + more;
        let turns = if turns >= 1.0 { turns - 1.0 } else { turns };
        let share = if turns > 0.5 { turns - 1.0 } else { turns };
        let x = std::f32::consts::TAU * (0.25 - (share.abs() - 0.25).abs());
        let square = x * x;
        let series = square * (1.0 / 362_880.0) - 1.0 / 5040.0;
        let series = square * series + 1.0 / 120.0;
        let series = square * series - 1.0 / 6.0;
        sines[each] = (square * series * x + x).copysign(share);
        each += 1;
    }
    sines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_agree_with_the_library_s() {
        for step in 0..7000 {
            let turns = step as f32 / 4000.0;
            let found = f64::from(sines(&[turns; 16], 0.25)[5]);
            assert!((found - (TAU * (0.25 + f64::from(turns))).sin()).abs() < 5e-6, "{turns}");
        }
    }
}
