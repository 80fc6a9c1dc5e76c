//! Shoots: eight neighboring leaves as one block of a prototype's tree, and how they move in the wind.

use super::super::boxes::Aabb;
use super::super::surface;
use super::lanes::{Isa, Lanes};
use super::moment::Between;
use super::patch::{self, Eight, Outline};
use super::walk::{Beams, Met, Nearest};
use arborloop_worlds::wind::{LEAVES_PER_SHOOT, own_turns, shoot_direction};
use arborloop_worlds::{Leaf, Sway};
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// Eight leaves, coordinate by coordinate, plant frame. Leaves that are not there are points, which no beam meets.
#[derive(Debug, Clone)]
#[repr(C, align(32))]
pub(super) struct Shoot {
    center: [[f32; 8]; 3],
    half_u: [[f32; 8]; 3],
    half_v: [[f32; 8]; 3],
    /// The line along which the wind moves it.
    direction: [f32; 3],
    /// Sine and cosine of the turns by which it is ahead of its plant's phase, and by which its first leaf is.
    ahead: [f32; 2],
    leaf_ahead: [f32; 2],
    /// One over the length of `half_u`, 1/m.
    inverse_u: [f32; 8],
}

/// How the shoots and leaves of one plant move at an instant: sines and cosines of the phases that they share, so that a
/// shoot's own are an addition theorem away.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flutter {
    /// How far shoots shift at most, plant frame, meters.
    pub(super) shoot_m: f32,
    /// Sine of the farthest turn of leaves.
    pub(super) leaf_sin: f32,
    shoots: [[f32; 4]; 2],
    /// Of the eight leaves of a shoot; their own turns within the shoot are in it.
    leaves: [[f32; 8]; 2],
}

/// By how many turns a leaf is ahead of the first of its shoot.
const WITHIN: [f32; 8] = {
    let mut turns = [0.0; 8];
    let mut leaf = 0;
    while leaf < 8 {
        let all = leaf as f64 * 0.618_033_988_749_895;
        turns[leaf] = (all - (all as i64) as f64) as f32;
        leaf += 1;
    }
    turns
};

impl Flutter {
    pub(super) fn new(sway: &Sway) -> Self {
        let mut turns = [0.0_f32; 16];
        turns[..4].copy_from_slice(&sway.shoot_turns.map(|turns| turns as f32));
        for leaf in 0..LEAVES_PER_SHOOT {
            turns[4 + leaf] = sway.leaf_turns[leaf % 4] as f32 + WITHIN[leaf];
        }
        let all = [sines(turns), sines(turns.map(|turns| turns + 0.25))];
        Flutter {
            shoot_m: sway.shoot_m as f32,
            leaf_sin: sway.leaf_rad.sin() as f32,
            shoots: all.map(|[a, b, c, d, ..]| [a, b, c, d]),
            leaves: all.map(|[_, _, _, _, a, b, c, d, e, f, g, h, ..]| [a, b, c, d, e, f, g, h]),
        }
    }

    /// How far a point of a leaf moves at most, plant frame, meters, if no leaf is wider than this. The chord of a turn is
    /// its sine over the cosine of its half, which is below 1.04 for all turns up to 30 degrees.
    pub(super) fn moves_m(&self, half_v_m_max: f32) -> f32 {
        self.shoot_m + 1.04 * self.leaf_sin * half_v_m_max
    }

    /// How far a shoot is along its line, meters; `ahead` is its own.
    #[inline(always)]
    fn shift_m(&self, shoot: usize, [sin, cos]: [f32; 2]) -> f32 {
        let [shared_sin, shared_cos] = [self.shoots[0][shoot & 3], self.shoots[1][shoot & 3]];
        self.shoot_m * (shared_sin * cos + shared_cos * sin)
    }

    /// The sine of a leaf's turn; `ahead` is its shoot's.
    #[inline(always)]
    fn turn_sin(&self, slot: usize, [sin, cos]: [f32; 2]) -> f32 {
        self.leaf_sin * (self.leaves[0][slot] * cos + self.leaves[1][slot] * sin)
    }
}

/// A prototype's leaves as shoots, with the box of each at rest.
pub(super) fn shoots(leaves: &[Leaf]) -> (Vec<Shoot>, Vec<Aabb>) {
    let shoots = leaves.chunks(LEAVES_PER_SHOOT).enumerate().map(|(index, leaves)| Shoot::new(index, leaves));
    let bounds = leaves
        .chunks(LEAVES_PER_SHOOT)
        .map(|leaves| leaves.iter().fold(Aabb::empty(), |all, leaf| all.with(&surface::leaf_bounds(leaf))));
    (shoots.collect(), bounds.collect())
}

impl Shoot {
    fn new(index: usize, leaves: &[Leaf]) -> Self {
        let sin_cos = |turns: f64| [(TAU * turns).sin() as f32, (TAU * turns).cos() as f32];
        let mut shoot = Shoot {
            center: [[0.0; 8]; 3],
            half_u: [[0.0; 8]; 3],
            half_v: [[0.0; 8]; 3],
            direction: shoot_direction(index).map(|x| x as f32).into(),
            ahead: sin_cos(own_turns(index)),
            leaf_ahead: sin_cos(own_turns(index * LEAVES_PER_SHOOT)),
            inverse_u: [0.0; 8],
        };
        for (slot, leaf) in leaves.iter().enumerate() {
            shoot.inverse_u[slot] = leaf.half_u.norm().max(1e-12).recip() as f32;
            for axis in 0..3 {
                shoot.center[axis][slot] = leaf.center[axis] as f32;
                shoot.half_u[axis][slot] = leaf.half_u[axis] as f32;
                shoot.half_v[axis][slot] = leaf.half_v[axis] as f32;
            }
        }
        shoot
    }

    /// Offers the leaves' crossings. `index` is the shoot's own.
    #[inline(always)]
    pub(super) fn meet<I: Isa>(
        &self,
        index: usize,
        flutter: Option<&Flutter>,
        beams: &Beams<I>,
        mask: u32,
        place: u32,
        nearest: &mut Nearest<I>,
    ) {
        let [ox, oy, oz] = beams.origin;
        let mut center = [
            I::Half::load(&self.center[0]).sub(I::Half::splat(ox)),
            I::Half::load(&self.center[1]).sub(I::Half::splat(oy)),
            I::Half::load(&self.center[2]).sub(I::Half::splat(oz)),
        ];
        let u =
            [I::Half::load(&self.half_u[0]), I::Half::load(&self.half_u[1]), I::Half::load(&self.half_u[2])];
        let mut v =
            [I::Half::load(&self.half_v[0]), I::Half::load(&self.half_v[1]), I::Half::load(&self.half_v[2])];
        if let Some(flutter) = flutter {
            let shift = I::Half::splat(flutter.shift_m(index, self.ahead));
            let mut axis = 0;
            while axis < 3 {
                center[axis] = shift.fma(I::Half::splat(self.direction[axis]), center[axis]);
                axis += 1;
            }
            v = self.turned::<I>(&u, &v, flutter);
        }
        let met = Met { place, part: (index * LEAVES_PER_SHOOT) as u32 };
        patch::meet::<I>([&center, &u, &v], Outline::Parallelogram, beams, mask, met, nearest);
    }

    /// The half sides `v`, turned about `u`: `v cos + n sin / |u|`, as [`arborloop_worlds::Sway::leaf`] says.
    #[inline(always)]
    fn turned<I: Isa>(&self, u: &Eight<I>, v: &Eight<I>, flutter: &Flutter) -> Eight<I> {
        let [sin, cos] = [I::Half::load(&flutter.leaves[0]), I::Half::load(&flutter.leaves[1])];
        let [ahead_sin, ahead_cos] = self.leaf_ahead;
        let most = flutter.leaf_sin;
        let sin = sin.fma(I::Half::splat(most * ahead_cos), cos.mul(I::Half::splat(most * ahead_sin)));
        let cos = sin.nfma(sin, I::Half::splat(1.0)).sqrt();
        let normal = patch::cross::<I>(u, v);
        let share = sin.mul(I::Half::load(&self.inverse_u));
        [
            normal[0].fma(share, v[0].mul(cos)),
            normal[1].fma(share, v[1].mul(cos)),
            normal[2].fma(share, v[2].mul(cos)),
        ]
    }

    /// Where a leaf of this shoot is at an instant; `index` is the leaf's among its prototype's.
    #[inline(always)]
    pub(super) fn leaf_at(&self, index: usize, rest: &Leaf, moment: &Between) -> Leaf {
        let (shoot, slot) = (index / LEAVES_PER_SHOOT, index % LEAVES_PER_SHOOT);
        let shift_m = moment.of(|flutter| flutter.shift_m(shoot, self.ahead));
        let sin = moment.of(|flutter| flutter.turn_sin(slot, self.leaf_ahead));
        let cos = (1.0 - sin * sin).sqrt();
        let normal = rest.half_u.cross(&rest.half_v);
        let [x, y, z] = self.direction.map(f64::from);
        Leaf {
            center: rest.center + Vector3::new(x, y, z) * shift_m,
            half_u: rest.half_u,
            half_v: rest.half_v * cos + normal * (sin * f64::from(self.inverse_u[slot])),
        }
    }
}

/// Sines of angles in turns, within 4e-6: Taylor's series up to the ninth power on a quarter turn.
#[inline(always)]
fn sines(turns: [f32; 16]) -> [f32; 16] {
    turns.map(|turns| {
        let turns = turns - (turns as i32) as f32;
        let share = if turns > 0.5 { turns - 1.0 } else { turns };
        let x = std::f32::consts::TAU * (0.25 - (share.abs() - 0.25).abs());
        let square = x * x;
        let series = square * (1.0 / 362_880.0) - 1.0 / 5040.0;
        let series = square * series + 1.0 / 120.0;
        let series = square * series - 1.0 / 6.0;
        (square * series * x + x).copysign(share)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_agree_with_the_library_s() {
        for step in 0..9000 {
            let turns = step as f32 / 4000.0;
            let found = f64::from(sines([turns; 16])[5]);
            assert!((found - (TAU * f64::from(turns)).sin()).abs() < 5e-6, "{turns}");
        }
    }
}
