//! Shoots: eight neighboring leaves as one block of a prototype's tree, and how they move in the wind.

use super::super::boxes::Aabb;
use super::super::surface;
use super::lanes::{Isa, Lanes};
use super::patch::{self, Eight, Outline};
use super::walk::{Beams, Met, Nearest};
use arborloop_worlds::Leaf;
use arborloop_worlds::wind::{LEAVES_PER_SHOOT, own_turns, shoot_direction};
use std::f64::consts::TAU;

/// Eight leaves, coordinate by coordinate, plant frame. Leaves that are not there are points, which no beam meets.
#[derive(Debug, Clone)]
#[repr(C, align(32))]
pub(super) struct Shoot {
    center: [[f32; 8]; 3],
    half_u: [[f32; 8]; 3],
    half_v: [[f32; 8]; 3],
    /// The line along which the wind moves it.
    pub(super) direction: [f32; 3],
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
    /// Plant frame, meters.
    pub(super) shoot_m: f32,
    pub(super) leaf_rad: f32,
    shoots: [[f32; 8]; 2],
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
    /// From the plant's phases, turns.
    #[inline(always)]
    pub(super) fn new<I: Isa>(
        shoot_m: f32,
        shoot_turns: [f32; 4],
        leaf_rad: f32,
        leaf_turns: [f32; 4],
    ) -> Self {
        let eight = |[a, b, c, d]: [f32; 4]| [a, b, c, d, a, b, c, d];
        let quarter = I::Half::splat(0.25);
        let shoot = I::Half::load(&eight(shoot_turns));
        let leaf = I::Half::load(&eight(leaf_turns)).add(I::Half::load(&WITHIN));
        let mut flutter = Flutter { shoot_m, leaf_rad, shoots: [[0.0; 8]; 2], leaves: [[0.0; 8]; 2] };
        sin_of_turns::<I>(shoot).store(&mut flutter.shoots[0]);
        sin_of_turns::<I>(shoot.add(quarter)).store(&mut flutter.shoots[1]);
        sin_of_turns::<I>(leaf).store(&mut flutter.leaves[0]);
        sin_of_turns::<I>(leaf.add(quarter)).store(&mut flutter.leaves[1]);
        flutter
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
            let [sin, cos] = [flutter.shoots[0][index & 3], flutter.shoots[1][index & 3]];
            let swing = sin.mul_add(self.ahead[1], cos * self.ahead[0]);
            let shift = I::Half::splat(flutter.shoot_m * swing);
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
        let swing = sin.fma(I::Half::splat(ahead_cos), cos.mul(I::Half::splat(ahead_sin)));
        let (sin, cos) = sin_cos_of_small::<I>(I::Half::splat(flutter.leaf_rad).mul(swing));
        let normal = patch::cross::<I>(u, v);
        let share = sin.mul(I::Half::load(&self.inverse_u));
        [
            v[0].fma(cos, normal[0].mul(share)),
            v[1].fma(cos, normal[1].mul(share)),
            v[2].fma(cos, normal[2].mul(share)),
        ]
    }
}

/// Sine of an angle in turns, within 4e-6: Taylor's series up to the ninth power on a quarter turn.
#[inline(always)]
fn sin_of_turns<I: Isa>(turns: I::Half) -> I::Half {
    let turns = turns.sub(turns.round());
    let quarter = I::Half::splat(0.25);
    let folded = quarter.sub(turns.abs().sub(quarter).abs());
    let x = folded.mul(I::Half::splat(std::f32::consts::TAU));
    let square = x.mul(x);
    let series = square.fma(I::Half::splat(1.0 / 362_880.0), I::Half::splat(-1.0 / 5040.0));
    let series = square.fma(series, I::Half::splat(1.0 / 120.0));
    let series = square.fma(series, I::Half::splat(-1.0 / 6.0));
    let sine = square.mul(series).fma(x, x);
    let backward = turns.lt(I::Half::splat(0.0));
    I::Half::splat(0.0).sub(sine).keep(backward, sine)
}

/// Sine and cosine of an angle below 0.6 rad, within 1e-7.
#[inline(always)]
fn sin_cos_of_small<I: Isa>(x: I::Half) -> (I::Half, I::Half) {
    let square = x.mul(x);
    let series = square.fma(I::Half::splat(-1.0 / 5040.0), I::Half::splat(1.0 / 120.0));
    let series = square.fma(series, I::Half::splat(-1.0 / 6.0));
    let sin = square.mul(series).fma(x, x);
    let series = square.fma(I::Half::splat(1.0 / 40_320.0), I::Half::splat(-1.0 / 720.0));
    let series = square.fma(series, I::Half::splat(1.0 / 24.0));
    let series = square.fma(series, I::Half::splat(-0.5));
    (sin, square.fma(series, I::Half::splat(1.0)))
}

#[cfg(test)]
mod tests {
    use super::super::lanes::Portable;
    use super::*;

    #[test]
    fn sines_agree_with_the_library_s() {
        for step in -4000..4000 {
            let turns = step as f32 / 1000.0;
            let found = f64::from(sin_of_turns::<Portable>([turns; 8])[0]);
            assert!((found - (std::f64::consts::TAU * f64::from(turns)).sin()).abs() < 5e-6, "{turns}");
            let small = turns * 0.15;
            let (sin, cos) = sin_cos_of_small::<Portable>([small; 8]);
            assert!((f64::from(sin[3]) - f64::from(small).sin()).abs() < 2e-7);
            assert!((f64::from(cos[3]) - f64::from(small).cos()).abs() < 2e-7);
        }
    }
}
