//! Axis-aligned boxes, and how a crowd of them is parted: the surface-area heuristic in sixteen bins.

use nalgebra::{Point3, Vector3};

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Aabb {
    pub(super) low: Point3<f64>,
    pub(super) high: Point3<f64>,
}

const BINS: usize = 16;

impl Aabb {
    /// Holds nothing; grows with the first point.
    pub(super) fn empty() -> Self {
        Aabb {
            low: Point3::from(Vector3::repeat(f64::INFINITY)),
            high: Point3::from(Vector3::repeat(f64::NEG_INFINITY)),
        }
    }

    pub(super) fn around(points: impl IntoIterator<Item = Point3<f64>>) -> Self {
        points.into_iter().fold(Aabb::empty(), |bounds, point| bounds.with(&Aabb { low: point, high: point }))
    }

    pub(super) fn with(&self, other: &Aabb) -> Self {
        Aabb { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    pub(super) fn half_area(&self) -> f64 {
        let side = self.high - self.low;
        if side.x < 0.0 { 0.0 } else { side.x * side.y + side.y * side.z + side.z * side.x }
    }

    pub(super) fn center(&self) -> Point3<f64> {
        nalgebra::center(&self.low, &self.high)
    }

    /// The box around this box's corners after a map; nothing stays nothing.
    pub(super) fn transformed(&self, map: impl Fn(Point3<f64>) -> Point3<f64>) -> Self {
        if self.low.x > self.high.x {
            return Aabb::empty();
        }
        Aabb::around(self.corners().map(map))
    }

    pub(super) fn corners(&self) -> impl Iterator<Item = Point3<f64>> + use<> {
        let Aabb { low, high } = *self;
        (0..8).map(move |corner| {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            Point3::new(pick(0), pick(1), pick(2))
        })
    }

    /// Whether it holds something and every number is finite.
    pub(super) fn is_real(&self) -> bool {
        (0..3).all(|axis| self.low[axis] <= self.high[axis] && (self.high[axis] - self.low[axis]).is_finite())
    }

    /// The stretch of a beam inside the box, between two distances; `inverse` is one over its direction.
    pub(super) fn stretch(
        &self,
        origin: &Point3<f64>,
        inverse: &Vector3<f64>,
        begin: f64,
        end: f64,
    ) -> Option<(f64, f64)> {
        let (mut enter, mut leave) = (begin, end);
        for axis in 0..3 {
            let a = (self.low[axis] - origin[axis]) * inverse[axis];
            let b = (self.high[axis] - origin[axis]) * inverse[axis];
            // `max` and `min` drop the NaN of a beam that lies in a box's face: the face then bounds nothing.
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some((enter, leave))
    }

    /// The box with this much more on every side.
    pub(super) fn grown(&self, by: &Vector3<f64>) -> Self {
        Aabb { low: self.low - by, high: self.high + by }
    }
}

/// Sorts the items, indices of boxes, to both sides of the cheapest plane and says how many come before it; half and
/// half where no plane divides them.
pub(super) fn split(bounds: &[Aabb], items: &mut [usize]) -> usize {
    let centers = Aabb::around(items.iter().map(|&item| bounds[item].center()));
    let mut best = (f64::INFINITY, 0, 0);
    for axis in 0..3 {
        let extent = centers.high[axis] - centers.low[axis];
        if extent <= 0.0 {
            continue;
        }
        let mut bins = [(Aabb::empty(), 0_usize); BINS];
        for &item in items.iter() {
            let bin = &mut bins[bin_of(&bounds[item], &centers, axis)];
            *bin = (bin.0.with(&bounds[item]), bin.1 + 1);
        }
        let mut right = [0.0; BINS];
        let mut swept = (Aabb::empty(), 0);
        for plane in (1..BINS).rev() {
            swept = (swept.0.with(&bins[plane].0), swept.1 + bins[plane].1);
            right[plane] = swept.0.half_area() * swept.1 as f64;
        }
        swept = (Aabb::empty(), 0);
        for plane in 1..BINS {
            swept = (swept.0.with(&bins[plane - 1].0), swept.1 + bins[plane - 1].1);
            let cost = swept.0.half_area() * swept.1 as f64 + right[plane];
            if swept.1 > 0 && swept.1 < items.len() && cost < best.0 {
                best = (cost, axis, plane);
            }
        }
    }
    let (cost, axis, plane) = best;
    if cost.is_infinite() {
        return items.len() / 2;
    }
    items.sort_by_key(|&item| (bin_of(&bounds[item], &centers, axis) >= plane, item));
    items.partition_point(|&item| bin_of(&bounds[item], &centers, axis) < plane)
}

fn bin_of(bounds: &Aabb, centers: &Aabb, axis: usize) -> usize {
    let share = (bounds.center()[axis] - centers.low[axis]) / (centers.high[axis] - centers.low[axis]);
    ((share * BINS as f64) as usize).min(BINS - 1)
}
