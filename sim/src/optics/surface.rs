//! Where a beam crosses a leaf or the side and caps of a frustum.

use super::boxes::Aabb;
use arborloop_worlds::{Frustum, Leaf};
use nalgebra::{Point3, Vector3};

/// A beam crosses a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    /// In lengths of the beam's direction.
    pub(super) range_m: f64,
    /// Of the angle between beam and normal, in [0, 1].
    pub(super) cos_incidence: f64,
}

/// The nearest distance that is a crossing: a beam does not meet the surface that it starts on.
const RANGE_MIN: f64 = 1e-9;

pub(super) fn leaf_bounds(leaf: &Leaf) -> Aabb {
    let reach = leaf.half_u.abs() + leaf.half_v.abs();
    Aabb { low: leaf.center - reach, high: leaf.center + reach }
}

pub(super) fn frustum_bounds(shape: &Frustum) -> Aabb {
    // A disc of radius r and unit normal n reaches r sqrt(1 - n_i^2) along axis i.
    let flat = shape.axis.map(|n| (1.0 - n * n).max(0.0).sqrt());
    let top = shape.base + shape.axis.into_inner() * shape.height_m;
    let disc = |center: Point3<f64>, radius: f64| [center - flat * radius, center + flat * radius];
    Aabb::around(disc(shape.base, shape.radius_base_m).into_iter().chain(disc(top, shape.radius_top_m)))
}

/// A leaf is a parallelogram seen from both sides. The slow twin of the tracer's patches.
#[cfg(test)]
pub(super) fn cross_leaf(
    leaf: &Leaf,
    origin: &Point3<f64>,
    direction: &Vector3<f64>,
    nearest: f64,
) -> Option<Crossing> {
    let normal = leaf.half_u.cross(&leaf.half_v);
    let facing = normal.dot(direction);
    let range_m = normal.dot(&(leaf.center - origin)) / facing;
    if !(range_m > RANGE_MIN && range_m < nearest) {
        return None;
    }
    // The point is center + a u + b v; the cofactors give a and b without inverting.
    let from_center = origin + direction * range_m - leaf.center;
    let area = normal.norm_squared();
    let a = from_center.cross(&leaf.half_v).dot(&normal);
    let b = leaf.half_u.cross(&from_center).dot(&normal);
    (a.abs() <= area && b.abs() <= area).then(|| Crossing {
        range_m,
        cos_incidence: (facing.abs() / (area.sqrt() * direction.norm())).min(1.0),
    })
}

/// A frustum is met from outside and from inside: on its side, or on one of its two discs.
pub(super) fn cross_frustum(
    shape: &Frustum,
    origin: &Point3<f64>,
    direction: &Vector3<f64>,
    nearest: f64,
) -> Option<Crossing> {
    let axis = shape.axis.into_inner();
    let from_base = origin - shape.base;
    let (height0, climb) = (from_base.dot(&axis), direction.dot(&axis));
    let (across0, drift) = (from_base - axis * height0, direction - axis * climb);
    let narrowing = (shape.radius_top_m - shape.radius_base_m) / shape.height_m.max(f64::MIN_POSITIVE);
    let mut best: Option<Crossing> = None;
    let mut offer = |range_m: f64, normal: Vector3<f64>| {
        if range_m > RANGE_MIN && range_m < best.map_or(nearest, |crossing| crossing.range_m) {
            let cos_incidence = (normal.dot(direction).abs() / (normal.norm() * direction.norm())).min(1.0);
            best = Some(Crossing { range_m, cos_incidence });
        }
    };
    if shape.height_m > 0.0 {
        // |across0 + t drift| = radius(height0 + t climb), a quadratic in t.
        let (radius0, widening) = (shape.radius_base_m + narrowing * height0, narrowing * climb);
        let a = drift.norm_squared() - widening * widening;
        let half_b = across0.dot(&drift) - radius0 * widening;
        let c = across0.norm_squared() - radius0 * radius0;
        for range_m in roots(a, half_b, c).into_iter().flatten() {
            let height = height0 + climb * range_m;
            let on_this_nappe = radius0 + widening * range_m >= 0.0;
            if (0.0..=shape.height_m).contains(&height) && on_this_nappe {
                let outward = across0 + drift * range_m;
                offer(range_m, outward - axis * (narrowing * outward.norm()));
            }
        }
    }
    for (height, radius) in [(0.0, shape.radius_base_m), (shape.height_m, shape.radius_top_m)] {
        let range_m = (height - height0) / climb;
        if range_m.is_finite() && (across0 + drift * range_m).norm_squared() <= radius * radius {
            offer(range_m, axis);
        }
    }
    best
}

/// Real roots of a t^2 + 2 half_b t + c, without cancellation.
fn roots(a: f64, half_b: f64, c: f64) -> [Option<f64>; 2] {
    let discriminant = half_b * half_b - a * c;
    if discriminant < 0.0 {
        return [None, None];
    }
    let q = -(half_b + discriminant.sqrt().copysign(half_b));
    let keep = |root: f64| root.is_finite().then_some(root);
    [keep(q / a), keep(c / q)]
}
