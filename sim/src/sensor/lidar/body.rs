//! The robot's own body in the way of its lidar's beams: the trunk's boxes and the legs, base frame.

use crate::optics::Hit;
use arborloop_base::{Class, Pose};
use arborloop_robots::{Form, Robot, go1};
use nalgebra::{Point3, Vector3};

/// Boxes and limits of a body.
#[derive(Debug, Clone)]
pub(super) struct Body {
    boxes: Vec<(Pose, Vector3<f64>)>,
    around: Around,
    has_legs: bool,
    top_m: f64,
}

/// No part of a body is farther from the base's axis, meters: of the Go1 a leg stretched out, of the Thorvald a wheel's corner.
const REACH_M: f64 = 0.9;
/// Radii of thigh and calf, meters; assumed: half the width of a1.urdf's boxes.
const THIGH_RADIUS_M: f64 = 0.02;
const CALF_RADIUS_M: f64 = 0.012;
/// Reflectance of the body; assumed: gray plastic.
const REFLECTIVITY_RATIO: f64 = 0.3;

impl Body {
    /// The Go1's, the lidar itself left out.
    pub(super) fn go1() -> Self {
        let shapes = go1::body_shapes().into_iter().filter(|shape| shape.part != "lidar");
        let boxes: Vec<_> =
            shapes.map(|shape| (shape.base_from_shape.inverse(), shape.half_extents_m)).collect();
        let top = |(shape_from_base, half): &(Pose, Vector3<f64>)| {
            let up = shape_from_base.rotation * Vector3::z();
            shape_from_base.inverse().translation.z + up.abs().dot(half)
        };
        // A leg's joints are no higher than the hips plus the thigh's length when it is raised.
        let top_m = boxes.iter().map(top).fold(go1::HIP_OFFSET_M, f64::max);
        Body { around: Around::boxes(&boxes), boxes, has_legs: true, top_m }
    }

    /// Of a robot on wheels: the boxes around its shapes, wheels as they stand straight on, the lidar left out.
    pub(super) fn on_wheels(robot: &Robot, lidar: &str) -> Self {
        let mut body =
            Body { boxes: Vec::new(), around: Around::boxes(&[]), has_legs: false, top_m: f64::NEG_INFINITY };
        for link in robot.links.iter().filter(|link| link.name != lidar) {
            let Some(base_from_link) = robot.frame(&link.name) else { continue };
            for shape in &link.shapes {
                let half = match shape.form {
                    Form::Box { size_m } => size_m / 2.0,
                    Form::Cylinder { radius_m, length_m } => Vector3::new(radius_m, radius_m, length_m / 2.0),
                    Form::Sphere { radius_m } => Vector3::repeat(radius_m),
                    Form::Mesh { .. } => continue,
                };
                let base_from_shape = base_from_link * shape.link_from_shape;
                let up = base_from_shape.rotation.inverse() * Vector3::z();
                body.top_m = body.top_m.max(base_from_shape.translation.z + up.abs().dot(&half));
                body.boxes.push((base_from_shape.inverse(), half));
            }
        }
        body.around = Around::boxes(&body.boxes);
        body
    }

    /// Whether a beam from a place at an elevation can meet the body at all, whatever its bearing.
    pub(super) fn is_near(&self, origin: &Point3<f64>, elevation_rad: f64) -> bool {
        let reach_m = REACH_M + origin.x.hypot(origin.y);
        origin.z + reach_m * elevation_rad.tan() < self.top_m || origin.z < self.top_m
    }

    /// What a beam meets of the body first, base frame, with the legs in a stance.
    pub(super) fn cast(
        &self,
        origin: &Point3<f64>,
        direction: &Vector3<f64>,
        stance: &Stance,
    ) -> Option<Hit> {
        let mut nearest: Option<(f64, f64)> = None;
        let mut offer = |met: Option<(f64, Vector3<f64>)>| {
            if let Some((range_m, normal)) = met
                && nearest.is_none_or(|(before, _)| range_m < before)
            {
                nearest = Some((range_m, normal.dot(direction).abs().min(1.0)));
            }
        };
        let inverse = direction.map(f64::recip);
        let boxes = if self.around.may_be_met(origin, &inverse) { self.boxes.as_slice() } else { &[] };
        for (shape_from_base, half) in boxes {
            let met = cross_box(half, &(shape_from_base * origin), &(shape_from_base * direction));
            offer(met.map(|(range_m, normal)| (range_m, shape_from_base.rotation.inverse() * normal)));
        }
        if self.has_legs && stance.around.may_be_met(origin, &inverse) {
            for [shoulder, knee, foot] in &stance.legs {
                offer(cross_capsule(shoulder, knee, THIGH_RADIUS_M, origin, direction));
                offer(cross_capsule(knee, foot, CALF_RADIUS_M, origin, direction));
            }
        }
        nearest.map(|(range_m, cos_incidence)| Hit {
            range_m,
            class: Class::Robot,
            instance: 1,
            cos_incidence,
            reflectivity_ratio: REFLECTIVITY_RATIO,
            transmittance_ratio: 0.0,
            displacement_m: Vector3::zeros(),
        })
    }
}

/// Where the legs are at one instant, base frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stance {
    legs: [[Point3<f64>; 3]; 4],
    around: Around,
}

/// A box along the base's axes around several things; most beams pass it.
#[derive(Debug, Clone, Copy)]
struct Around {
    low: Point3<f64>,
    high: Point3<f64>,
}

impl Stance {
    /// Of joint angles in radians.
    pub(crate) fn of(joint_angles_rad: &[f64; 12]) -> Self {
        let legs: [_; 4] =
            std::array::from_fn(|leg| joints(leg, [0, 1, 2].map(|joint| joint_angles_rad[3 * leg + joint])));
        let margin = Vector3::repeat(THIGH_RADIUS_M);
        let mut around = Around { low: legs[0][0], high: legs[0][0] };
        for joint in legs.iter().flatten() {
            around.low = around.low.inf(&(joint - margin));
            around.high = around.high.sup(&(joint + margin));
        }
        Stance { legs, around }
    }
}

impl Around {
    /// Around boxes that stand in their own frames; around nothing, what no beam comes through.
    fn boxes(boxes: &[(Pose, Vector3<f64>)]) -> Self {
        let nothing = Vector3::repeat(f64::INFINITY);
        let mut around = Around { low: Point3::from(nothing), high: Point3::from(-nothing) };
        for (shape_from_base, half) in boxes {
            let base_from_shape = shape_from_base.inverse();
            let turned = base_from_shape.rotation.to_rotation_matrix().into_inner().abs();
            // A hair for rounding.
            let reach = turned * half + Vector3::repeat(1e-9);
            let middle = Point3::from(base_from_shape.translation.vector);
            around.low = around.low.inf(&(middle - reach));
            around.high = around.high.sup(&(middle + reach));
        }
        around
    }

    /// Whether a beam may come through the box: true for every beam that does. `inverse` is one over its direction.
    #[inline]
    fn may_be_met(&self, origin: &Point3<f64>, inverse: &Vector3<f64>) -> bool {
        let (mut enters, mut leaves) = (0.0, f64::INFINITY);
        for axis in 0..3 {
            let to_low = (self.low[axis] - origin[axis]) * inverse[axis];
            let to_high = (self.high[axis] - origin[axis]) * inverse[axis];
            // Along a side of the box.
            if to_low.is_nan() || to_high.is_nan() {
                continue;
            }
            let (near, far) = if to_low < to_high { (to_low, to_high) } else { (to_high, to_low) };
            enters = if near > enters { near } else { enters };
            leaves = if far < leaves { far } else { leaves };
        }
        // A hair for rounding.
        enters <= leaves + 1e-9 * (1.0 + enters)
    }
}

/// Thigh joint, knee and foot of a leg, base frame.
fn joints(leg: usize, [hip_rad, thigh_rad, calf_rad]: [f64; 3]) -> [Point3<f64>; 3] {
    let foot = go1::foot(leg, [hip_rad, thigh_rad, calf_rad]);
    // The calf turned back onto the thigh leaves the foot at the thigh joint: both are as long.
    let shoulder = go1::foot(leg, [hip_rad, thigh_rad, std::f64::consts::PI]);
    // Stretched out, the foot is twice as far from the joint as the knee.
    let stretched = go1::foot(leg, [hip_rad, thigh_rad, 0.0]);
    [shoulder, nalgebra::center(&shoulder, &stretched), foot]
}

/// Where a beam enters a box around the origin, and the normal there; `None` from inside.
fn cross_box(
    half: &Vector3<f64>,
    origin: &Point3<f64>,
    direction: &Vector3<f64>,
) -> Option<(f64, Vector3<f64>)> {
    let (mut enters, mut leaves, mut normal) = (0.0, f64::INFINITY, None);
    for axis in 0..3 {
        let (low, high) =
            ((-half[axis] - origin[axis]) / direction[axis], (half[axis] - origin[axis]) / direction[axis]);
        if low.is_nan() || high.is_nan() {
            return None;
        }
        if low.min(high) > enters {
            enters = low.min(high);
            normal = Some(Vector3::ith(axis, 1.0));
        }
        leaves = low.max(high).min(leaves);
    }
    normal.filter(|_| enters < leaves).map(|normal| (enters, normal))
}

/// Where a beam enters a rod with round ends, and the unit normal there.
fn cross_capsule(
    a: &Point3<f64>,
    b: &Point3<f64>,
    radius_m: f64,
    origin: &Point3<f64>,
    direction: &Vector3<f64>,
) -> Option<(f64, Vector3<f64>)> {
    let length_m = (b - a).norm();
    let axis = (b - a) / length_m;
    let from_a = origin - a;
    let (drift, across) = (direction - axis * direction.dot(&axis), from_a - axis * from_a.dot(&axis));
    // |across + t drift| = radius, then the ends' spheres.
    let side = root(drift.norm_squared(), drift.dot(&across), across.norm_squared() - radius_m * radius_m)
        .filter(|t| (0.0..=length_m).contains(&(from_a + direction * *t).dot(&axis)))
        .map(|t| (t, (across + drift * t) / radius_m));
    let ball = |center: &Point3<f64>| {
        let off = origin - center;
        root(1.0, off.dot(direction), off.norm_squared() - radius_m * radius_m)
            .map(|t| (t, (off + direction * t) / radius_m))
    };
    [side, ball(a), ball(b)].into_iter().flatten().min_by(|one, other| one.0.total_cmp(&other.0))
}

/// The lesser root of a t^2 + 2 half_b t + c where it is ahead.
fn root(a: f64, half_b: f64, c: f64) -> Option<f64> {
    let discriminant = half_b * half_b - a * c;
    (discriminant > 0.0 && a > 0.0).then(|| (-half_b - discriminant.sqrt()) / a).filter(|t| *t > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_beam_straight_down_meets_the_trunk_and_one_to_the_knee_the_leg() {
        let body = Body::go1();
        let angles = [0.0, 0.9, -1.8, 0.0, 0.9, -1.8, 0.0, 0.9, -1.8, 0.0, 0.9, -1.8];
        let stance = Stance::of(&angles);
        let above = Point3::new(0.02, 0.01, 0.3);
        let hit = body.cast(&above, &-Vector3::z(), &stance).unwrap();
        assert!((hit.range_m - (0.3 - go1::TRUNK_SIZE_M[2] / 2.0)).abs() < 1e-12);
        assert_eq!((hit.class, hit.cos_incidence), (Class::Robot, 1.0));
        for leg in 0..4 {
            let [shoulder, knee, foot] = joints(leg, [0.0, 0.9, -1.8]);
            assert!(((knee - shoulder).norm() - go1::THIGH_M).abs() < 1e-12);
            assert!(((foot - knee).norm() - go1::CALF_M).abs() < 1e-12);
            // From beside, square to the leg's plane, at the middle of the calf.
            let target = nalgebra::center(&knee, &foot);
            let from = target + Vector3::y() * (3.0 * target.y.signum());
            let hit = body.cast(&from, &(target - from).normalize(), &stance).unwrap();
            assert!((hit.range_m - (3.0 - CALF_RADIUS_M)).abs() < 1e-9, "leg {leg}: {hit:?}");
        }
        assert!(body.cast(&above, &Vector3::z(), &stance).is_none());
    }

    #[test]
    fn beams_that_cannot_meet_the_body_are_told_by_height_and_elevation_alone() {
        let body = Body::go1();
        let mut draws = arborloop_base::Seed(5).stream("test/body").at(0);
        let mut met = 0;
        for _ in 0..20_000 {
            let elevation_rad = draws.within(-0.9, 0.3);
            let azimuth_rad = draws.within(-3.2, 3.2);
            let angles: [f64; 12] = std::array::from_fn(|n| match n % 3 {
                0 => draws.within(-0.5, 0.5),
                1 => draws.within(0.0, 1.5),
                _ => draws.within(-2.5, -0.9),
            });
            let flat = elevation_rad.cos();
            let direction =
                Vector3::new(flat * azimuth_rad.cos(), flat * azimuth_rad.sin(), elevation_rad.sin());
            let hit = body.cast(&Point3::new(0.0, 0.0, 0.16), &direction, &Stance::of(&angles));
            met += u32::from(hit.is_some());
            assert!(
                hit.is_none() || body.is_near(&Point3::new(0.0, 0.0, 0.16), elevation_rad),
                "{elevation_rad} rad meets {hit:?}"
            );
        }
        assert!(met > 1000, "{met} beams met the body");
    }
}
