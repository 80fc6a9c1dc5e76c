//! Eight flat patches against a packet: parallelograms or triangles, seen from the packet's origin.
//!
//! A beam `t d` from the origin meets the patch `c + a u + b v` where Cramer's rule says: with `n = u x v`,
//! `t = n.c / n.d`, `a = (v x c).d / n.d` and `b = (c x u).d / n.d`. All beams of a packet share the three vectors, so a
//! beam costs three dot products, and only beams inside the patch cost a division.

use super::lanes::{Isa, Lanes};
use super::walk::{Beams, Met, Nearest};

/// Three coordinates of eight vectors.
pub(super) type Eight<I> = [<I as Isa>::Half; 3];

/// Where `a` and `b` may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outline {
    /// Both in [-1, 1].
    Parallelogram,
    /// Not negative, their sum at most one, with a seam of a hundred thousandth on each side against leaks.
    Triangle,
}

const SEAM: f32 = 1e-5;

#[inline(always)]
pub(super) fn cross<I: Isa>(a: &Eight<I>, b: &Eight<I>) -> Eight<I> {
    [a[2].nfma(b[1], a[1].mul(b[2])), a[0].nfma(b[2], a[2].mul(b[0])), a[1].nfma(b[0], a[0].mul(b[1]))]
}

#[inline(always)]
fn dot<I: Isa>(a: &Eight<I>, b: &Eight<I>) -> I::Half {
    a[2].fma(b[2], a[1].fma(b[1], a[0].mul(b[0])))
}

/// Middle and spread of the products of eight vectors with every direction of the packet.
#[inline(always)]
fn products<I: Isa>(vectors: &Eight<I>, middle: &Eight<I>, half: &Eight<I>) -> (I::Half, I::Half) {
    let spread = [vectors[0].abs(), vectors[1].abs(), vectors[2].abs()];
    (dot::<I>(vectors, middle).abs(), dot::<I>(&spread, half))
}

/// Offers the crossings of eight patches, `center` from the packet's origin and `normal` the product of `u` and `v`.
/// Patch `j` has the part `part + j`.
#[inline(always)]
pub(super) fn meet<I: Isa>(
    [center, u, v, normal]: [&Eight<I>; 4],
    outline: Outline,
    beams: &Beams<I>,
    mask: u32,
    met: Met,
    nearest: &mut Nearest<I>,
) {
    let (side_a, side_b) = (cross::<I>(v, center), cross::<I>(center, u));
    let gap = dot::<I>(normal, center);
    let [mx, my, mz] = beams.middle;
    let [hx, hy, hz] = beams.half;
    let middle = [I::Half::splat(mx), I::Half::splat(my), I::Half::splat(mz)];
    let half = [I::Half::splat(hx), I::Half::splat(hy), I::Half::splat(hz)];
    // Which patches might any beam meet? Bounds of the products over the box of directions.
    let (facing, spread) = products::<I>(normal, &middle, &half);
    let most = facing.add(spread);
    let (a, spread_a) = products::<I>(&side_a, &middle, &half);
    let (b, spread_b) = products::<I>(&side_b, &middle, &half);
    // A triangle's beams have 0 <= a, b <= 1 but for the seam, which the factor covers.
    let room = I::Half::splat(1.0 + 4.0 * SEAM).mul(most);
    let reach = I::Half::splat(nearest.far).mul(room);
    let mut maybe = a.sub(spread_a).le(room) & b.sub(spread_b).le(room) & gap.abs().le(reach);
    if maybe == 0 {
        return;
    }
    let mut rows = [[0.0_f32; 8]; 10];
    let mut axis = 0;
    while axis < 3 {
        normal[axis].store(&mut rows[axis]);
        side_a[axis].store(&mut rows[3 + axis]);
        side_b[axis].store(&mut rows[6 + axis]);
        axis += 1;
    }
    gap.store(&mut rows[9]);
    let [dx, dy, dz] = beams.direction;
    while maybe != 0 {
        let slot = maybe.trailing_zeros() as usize & 7;
        maybe &= maybe - 1;
        let facing = I::Wide::splat(rows[2][slot])
            .fma(dz, I::Wide::splat(rows[1][slot]).fma(dy, I::Wide::splat(rows[0][slot]).mul(dx)));
        let a = I::Wide::splat(rows[5][slot])
            .fma(dz, I::Wide::splat(rows[4][slot]).fma(dy, I::Wide::splat(rows[3][slot]).mul(dx)));
        let b = I::Wide::splat(rows[8][slot])
            .fma(dz, I::Wide::splat(rows[7][slot]).fma(dy, I::Wide::splat(rows[6][slot]).mul(dx)));
        let inside = match outline {
            Outline::Parallelogram => {
                let facing = facing.abs();
                a.abs().le(facing) & b.abs().le(facing) & mask
            }
            Outline::Triangle => {
                let (a, b) = (a.div(facing), b.div(facing));
                let low = I::Wide::splat(-SEAM);
                low.le(a) & low.le(b) & a.add(b).le(I::Wide::splat(1.0 + SEAM)) & mask
            }
        };
        if inside != 0 {
            let range = I::Wide::splat(rows[9][slot]).div(facing);
            nearest.offer(range, inside, Met { place: met.place, part: met.part + slot as u32 });
        }
    }
}
