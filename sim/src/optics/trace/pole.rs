//! A frustum against a packet: trunks, branches, posts, cones.
//!
//! The quadratic of the side is solved from the beam's point nearest to the frustum's middle. From the beam's origin,
//! tens of meters away, single precision would drown a radius of millimeters.

use super::lanes::{Isa, Lanes};
use super::walk::{Beams, Met, Nearest};
use arborloop_worlds::Frustum;

/// A frustum in single precision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pole {
    base: [f32; 3],
    axis: [f32; 3],
    height_m: f32,
    radius_m: [f32; 2],
    /// Radius gained per meter along the axis.
    widening: f32,
}

type Sixteen<I> = [<I as Isa>::Wide; 3];

#[inline(always)]
fn dot<I: Isa>(a: &Sixteen<I>, b: &Sixteen<I>) -> I::Wide {
    a[2].fma(b[2], a[1].fma(b[1], a[0].mul(b[0])))
}

impl Pole {
    /// `shape` as seen from `center`.
    pub(super) fn new(shape: &Frustum, center: &nalgebra::Point3<f64>) -> Self {
        let widening = (shape.radius_top_m - shape.radius_base_m) / shape.height_m.max(f64::MIN_POSITIVE);
        Pole {
            base: (shape.base - center).map(|x| x as f32).into(),
            axis: shape.axis.map(|x| x as f32).into(),
            height_m: shape.height_m as f32,
            radius_m: [shape.radius_base_m as f32, shape.radius_top_m as f32],
            // A disc without height has no side.
            widening: if shape.height_m > 0.0 { widening as f32 } else { 0.0 },
        }
    }

    /// Offers the nearest crossing of each beam with the side or one of the two discs.
    #[inline(always)]
    pub(super) fn meet<I: Isa>(&self, beams: &Beams<I>, mask: u32, met: Met, nearest: &mut Nearest<I>) {
        let [dx, dy, dz] = beams.direction;
        let direction = [dx, dy, dz];
        let axis = [I::Wide::splat(self.axis[0]), I::Wide::splat(self.axis[1]), I::Wide::splat(self.axis[2])];
        let base = [
            I::Wide::splat(self.base[0] - beams.origin[0]),
            I::Wide::splat(self.base[1] - beams.origin[1]),
            I::Wide::splat(self.base[2] - beams.origin[2]),
        ];
        let halfway = I::Wide::splat(0.5 * self.height_m);
        let middle =
            [axis[0].fma(halfway, base[0]), axis[1].fma(halfway, base[1]), axis[2].fma(halfway, base[2])];
        let closest = dot::<I>(&middle, &direction).div(dot::<I>(&direction, &direction));
        let from_base = [
            dx.fma(closest, I::Wide::splat(0.0).sub(base[0])),
            dy.fma(closest, I::Wide::splat(0.0).sub(base[1])),
            dz.fma(closest, I::Wide::splat(0.0).sub(base[2])),
        ];
        let climb = dot::<I>(&direction, &axis);
        let height = dot::<I>(&from_base, &axis);
        let drift = [axis[0].nfma(climb, dx), axis[1].nfma(climb, dy), axis[2].nfma(climb, dz)];
        let across = [
            axis[0].nfma(height, from_base[0]),
            axis[1].nfma(height, from_base[1]),
            axis[2].nfma(height, from_base[2]),
        ];
        let narrow = I::Wide::splat(self.widening);
        let radius = narrow.fma(height, I::Wide::splat(self.radius_m[0]));
        let widening = narrow.mul(climb);
        let a = widening.nfma(widening, dot::<I>(&drift, &drift));
        let half_b = widening.nfma(radius, dot::<I>(&across, &drift));
        let c = radius.nfma(radius, dot::<I>(&across, &across));
        let root = a.nfma(c, half_b.mul(half_b)).sqrt();
        let zero = I::Wide::splat(0.0);
        // The root that does not cancel, then its twin; NaN where there is none, and NaN is never in order.
        let root = zero.sub(root).keep(half_b.lt(zero), root);
        let q = zero.sub(half_b.add(root));
        let top = I::Wide::splat(self.height_m);
        let begin = nearest.begin.sub(closest);
        let mut first = I::Wide::splat(f32::INFINITY);
        let mut found = 0;
        if self.height_m > 0.0 {
            let roots = [q.div(a), c.div(q)];
            let mut index = 0;
            while index < 2 {
                let t = roots[index];
                let at = climb.fma(t, height);
                let on_side = zero.le(at) & at.le(top) & zero.le(widening.fma(t, radius));
                let better = on_side & begin.lt(t) & t.lt(first) & mask;
                first = t.keep(better, first);
                found |= better;
                index += 1;
            }
        }
        let ends = [zero.sub(height), top.sub(height)];
        let mut index = 0;
        while index < 2 {
            let t = ends[index].div(climb);
            let x = drift[0].fma(t, across[0]);
            let y = drift[1].fma(t, across[1]);
            let z = drift[2].fma(t, across[2]);
            let reach = I::Wide::splat(self.radius_m[index] * self.radius_m[index]);
            let on_disc = dot::<I>(&[x, y, z], &[x, y, z]).le(reach);
            let better = on_disc & begin.lt(t) & t.lt(first) & mask;
            first = t.keep(better, first);
            found |= better;
            index += 1;
        }
        if found != 0 {
            nearest.offer(closest.add(first), found, met);
        }
    }
}
