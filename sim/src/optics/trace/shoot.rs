//! Shoots: eight neighboring leaves as one block of a prototype's tree, and how they move in the wind.

use super::super::boxes::Aabb;
use super::super::surface;
use super::flutter::Flutter;
use super::lanes::{Isa, Lanes};
use super::moment::Between;
use super::patch::{self, Outline};
use super::walk::{Beams, Met, Nearest};
use arborloop_worlds::Leaf;
use arborloop_worlds::wind::{LEAVES_PER_SHOOT, own_turns, shoot_direction};
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
    /// Sine and cosine of the turns by which it is ahead of its plant's phase.
    ahead: [f32; 2],
    /// The product of `half_u` and `half_v` over the length of `half_u`, meters: where `half_v` is after a quarter turn.
    quarter: [[f32; 8]; 3],
    /// The length of `half_u`, meters.
    length_u: [f32; 8],
    /// Whether all leaves' half sides are at right angles, as grown leaves' are.
    square: bool,
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
            quarter: [[0.0; 8]; 3],
            length_u: [0.0; 8],
            square: leaves.iter().all(is_square),
        };
        for (slot, leaf) in leaves.iter().enumerate() {
            let quarter = quarter(leaf);
            shoot.length_u[slot] = leaf.half_u.norm() as f32;
            for axis in 0..3 {
                shoot.center[axis][slot] = leaf.center[axis] as f32;
                shoot.half_u[axis][slot] = leaf.half_u[axis] as f32;
                shoot.half_v[axis][slot] = leaf.half_v[axis] as f32;
                shoot.quarter[axis][slot] = quarter[axis] as f32;
            }
        }
        shoot
    }

    /// The line along which it moves, and sine and cosine of the turns by which it is ahead.
    pub(super) fn motion(&self) -> ([f32; 3], [f32; 2]) {
        (self.direction, self.ahead)
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
        let rest =
            [I::Half::load(&self.half_v[0]), I::Half::load(&self.half_v[1]), I::Half::load(&self.half_v[2])];
        let (mut v, mut normal) = (rest, rest);
        if let Some(flutter) = flutter {
            let shift = I::Half::splat(flutter.shift_m(index, self.ahead));
            let [sin, cos] = flutter.leaves(index);
            let (sin, cos) = (I::Half::load(sin), I::Half::load(cos));
            let length = I::Half::load(&self.length_u);
            let (long_sin, long_cos) = (length.mul(sin), length.mul(cos));
            let mut axis = 0;
            while axis < 3 {
                center[axis] = shift.fma(I::Half::splat(self.direction[axis]), center[axis]);
                // As `arborloop_worlds::Sway::leaf` says, and the product of `u` with it.
                let quarter = I::Half::load(&self.quarter[axis]);
                v[axis] = quarter.fma(sin, rest[axis].mul(cos));
                normal[axis] = rest[axis].nfma(long_sin, quarter.mul(long_cos));
                axis += 1;
            }
            if !self.square {
                normal = patch::cross::<I>(&u, &v);
            }
        } else {
            normal = patch::cross::<I>(&u, &v);
        }
        let met = Met { place, part: (index * LEAVES_PER_SHOOT) as u32 };
        patch::meet::<I>([&center, &u, &v, &normal], Outline::Parallelogram, beams, mask, met, nearest);
    }

    /// Where a leaf of this shoot is at an instant; `index` is the leaf's among its prototype's.
    #[inline(always)]
    pub(super) fn leaf_at(&self, index: usize, rest: &Leaf, moment: &Between) -> Leaf {
        let (shoot, slot) = (index / LEAVES_PER_SHOOT, index % LEAVES_PER_SHOOT);
        let shift_m = moment.of(|flutter| flutter.shift_m(shoot, self.ahead));
        let sin = moment.of(|flutter| flutter.leaves(shoot)[0][slot]);
        let cos = (1.0 - sin * sin).sqrt();
        let [x, y, z] = self.direction.map(f64::from);
        Leaf {
            center: rest.center + Vector3::new(x, y, z) * shift_m,
            half_u: rest.half_u,
            half_v: rest.half_v * cos + quarter(rest) * sin,
        }
    }
}

/// Where a leaf's `half_v` is after a quarter turn about `half_u`.
fn quarter(leaf: &Leaf) -> Vector3<f64> {
    leaf.half_u.cross(&leaf.half_v) / leaf.half_u.norm().max(f64::MIN_POSITIVE)
}

/// Whether a leaf's half sides are at right angles, but for what single precision could tell.
fn is_square(leaf: &Leaf) -> bool {
    leaf.half_u.dot(&leaf.half_v).abs() <= 1e-7 * leaf.half_u.norm() * leaf.half_v.norm()
}
