//! The shapes that worlds are made of.

use nalgebra::{Point2, Point3, Similarity3, Unit, Vector3};

/// A rectangle on the ground, aligned with the axes, meters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Least x and y.
    pub low: Point2<f64>,
    /// Greatest x and y.
    pub high: Point2<f64>,
}

impl Bounds {
    /// Whether a point is inside or on the border.
    pub fn contains(&self, point: &Point2<f64>) -> bool {
        (self.low.x..=self.high.x).contains(&point.x) && (self.low.y..=self.high.y).contains(&point.y)
    }
}

/// A cone cut off square to its axis: also a cylinder, a cone and a disc. Closed at both ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frustum {
    /// Center of the lower end.
    pub base: Point3<f64>,
    /// From the lower to the upper end.
    pub axis: Unit<Vector3<f64>>,
    /// Length along the axis, meters.
    pub height_m: f64,
    /// Radius at the lower end, meters.
    pub radius_base_m: f64,
    /// Radius at the upper end, meters.
    pub radius_top_m: f64,
}

impl Frustum {
    /// The center of the section at `along_m` meters from the lower end.
    pub fn center(&self, along_m: f64) -> Point3<f64> {
        self.base + self.axis.into_inner() * along_m
    }

    /// Radius of the section at `along_m` meters from the lower end, meters.
    pub fn radius_m(&self, along_m: f64) -> f64 {
        self.radius_base_m + (self.radius_top_m - self.radius_base_m) * along_m / self.height_m
    }

    /// Whether a point is inside or on the surface.
    pub fn contains(&self, point: &Point3<f64>) -> bool {
        let offset = point - self.base;
        let along_m = offset.dot(&self.axis);
        let across_m = (offset - self.axis.into_inner() * along_m).norm();
        (0.0..=self.height_m).contains(&along_m) && across_m <= self.radius_m(along_m)
    }

    /// The part between two distances from the lower end, meters.
    pub fn part(&self, from_m: f64, to_m: f64) -> Frustum {
        Frustum {
            base: self.center(from_m),
            axis: self.axis,
            height_m: to_m - from_m,
            radius_base_m: self.radius_m(from_m),
            radius_top_m: self.radius_m(to_m),
        }
    }

    /// The same frustum seen from another frame, scaled with it.
    pub fn transformed(&self, to_from_from: &Similarity3<f64>) -> Frustum {
        let scale = to_from_from.scaling();
        Frustum {
            base: to_from_from * self.base,
            axis: to_from_from.isometry.rotation * self.axis,
            height_m: self.height_m * scale,
            radius_base_m: self.radius_base_m * scale,
            radius_top_m: self.radius_top_m * scale,
        }
    }
}

/// A leaf: the parallelogram `center + a half_u + b half_v` for a and b in [-1, 1].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leaf {
    /// Its middle.
    pub center: Point3<f64>,
    /// From the middle to the middle of one side, meters.
    pub half_u: Vector3<f64>,
    /// From the middle to the middle of a neighboring side, meters.
    pub half_v: Vector3<f64>,
}

impl Leaf {
    /// Its four corners, in order around.
    pub fn corners(&self) -> [Point3<f64>; 4] {
        let (u, v) = (self.half_u, self.half_v);
        [self.center - u - v, self.center + u - v, self.center + u + v, self.center - u + v]
    }

    /// One-sided area, m2.
    pub fn area_m2(&self) -> f64 {
        4.0 * self.half_u.cross(&self.half_v).norm()
    }

    /// The same leaf seen from another frame, scaled with it.
    pub fn transformed(&self, to_from_from: &Similarity3<f64>) -> Leaf {
        Leaf {
            center: to_from_from * self.center,
            half_u: to_from_from * self.half_u,
            half_v: to_from_from * self.half_v,
        }
    }
}
