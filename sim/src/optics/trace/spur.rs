//! Spurs: eight neighboring leaves of a shoot, met as one block.

use super::lanes::{Isa, Lanes};
use super::patch::{self, Outline};
use super::walk::{Beams, Met, Nearest};
use arborloop_worlds::Leaf;
use nalgebra::Vector3;

/// Eight leaves, coordinate by coordinate, plant frame. Leaves that are not there are points, which no beam meets.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Spur {
    pub(super) rest: Rest,
    turning: Turning,
}

/// What there is to know of leaves that do not move.
#[derive(Debug, Clone, Default)]
#[repr(C)]
pub(super) struct Rest {
    center: [[f32; 8]; 3],
    half_u: [[f32; 8]; 3],
    half_v: [[f32; 8]; 3],
}

/// What there is to know besides of leaves that turn.
#[derive(Debug, Clone, Default)]
#[repr(C)]
struct Turning {
    /// The product of `half_u` and `half_v` over the length of `half_u`, meters: where `half_v` is after a quarter turn.
    quarter: [[f32; 8]; 3],
    /// The length of `half_u`, meters.
    length_u: [f32; 8],
}

/// How far leaves have turned about their own `half_u`: sine and cosine.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    pub(super) sin: f32,
    pub(super) cos: f32,
}

impl Spur {
    /// At most eight leaves.
    pub(super) fn new(leaves: &[Leaf]) -> Self {
        let (mut rest, mut turning) = (Rest::default(), Turning::default());
        for (slot, leaf) in leaves.iter().enumerate() {
            let quarter = quarter(leaf);
            turning.length_u[slot] = leaf.half_u.norm() as f32;
            for axis in 0..3 {
                rest.center[axis][slot] = leaf.center[axis] as f32;
                rest.half_u[axis][slot] = leaf.half_u[axis] as f32;
                rest.half_v[axis][slot] = leaf.half_v[axis] as f32;
                turning.quarter[axis][slot] = quarter[axis] as f32;
            }
        }
        Spur { rest, turning }
    }

    /// Offers the leaves' crossings; `origin` is where the beams begin as seen from the leaves' shoot. `slanted` says that
    /// some leaf's half sides are not at right angles.
    #[inline(always)]
    pub(super) fn meet<I: Isa>(
        &self,
        turn: Option<Turn>,
        slanted: bool,
        [ox, oy, oz]: [f32; 3],
        beams: &Beams<I>,
        mask: u32,
        met: Met,
        nearest: &mut Nearest<I>,
    ) {
        let Rest { center, half_u, half_v } = &self.rest;
        let center = [
            I::Half::load(&center[0]).sub(I::Half::splat(ox)),
            I::Half::load(&center[1]).sub(I::Half::splat(oy)),
            I::Half::load(&center[2]).sub(I::Half::splat(oz)),
        ];
        let u = [I::Half::load(&half_u[0]), I::Half::load(&half_u[1]), I::Half::load(&half_u[2])];
        let rest = [I::Half::load(&half_v[0]), I::Half::load(&half_v[1]), I::Half::load(&half_v[2])];
        let (mut v, mut normal) = (rest, rest);
        if let Some(Turn { sin, cos }) = turn {
            let (sin, cos) = (I::Half::splat(sin), I::Half::splat(cos));
            let length = I::Half::load(&self.turning.length_u);
            let (long_sin, long_cos) = (length.mul(sin), length.mul(cos));
            let mut axis = 0;
            while axis < 3 {
                // As `arborloop_worlds::Sway::leaf` says, and the product of `u` with it.
                let quarter = I::Half::load(&self.turning.quarter[axis]);
                v[axis] = quarter.fma(sin, rest[axis].mul(cos));
                normal[axis] = rest[axis].nfma(long_sin, quarter.mul(long_cos));
                axis += 1;
            }
        }
        if turn.is_none() || slanted {
            normal = patch::cross::<I>(&u, &v);
        }
        patch::meet::<I>([&center, &u, &v, &normal], Outline::Parallelogram, beams, mask, met, nearest);
    }
}

/// Where a leaf's `half_v` is after a quarter turn about `half_u`.
pub(super) fn quarter(leaf: &Leaf) -> Vector3<f64> {
    leaf.half_u.cross(&leaf.half_v) / leaf.half_u.norm().max(f64::MIN_POSITIVE)
}

/// Whether a leaf's half sides are at right angles, but for what single precision could tell.
pub(super) fn is_square(leaf: &Leaf) -> bool {
    leaf.half_u.dot(&leaf.half_v).abs() <= 1e-7 * leaf.half_u.norm() * leaf.half_v.norm()
}
