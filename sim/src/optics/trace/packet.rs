//! Which rays are traced together: those of a group of sixteen that start and fly alike, else its halves.
//!
//! A packet is traced from one origin at one instant, its middle ray's. A ray's own origin is then at most
//! [`APART_M`] beside the shared one, along the ray that is made good exactly, and across it only silhouettes shift.

use super::super::Ray;
use super::lanes::{Isa, Lanes};
use arborloop_base::{Span, Time};
use nalgebra::{Point3, Vector3};

/// Rays that may be traced together. One group never reaches into the next, so how a list is cut at multiples of this
/// changes nothing.
pub(super) const GROUP: usize = 16;
/// Origins of a packet's rays are at most this far from its middle ray's, meters.
pub(super) const APART_M: f64 = 2e-3;
/// Stamps of a packet's rays are at most this far from its middle ray's.
const APART: Span = Span::from_millis(1);
/// Directions are at most 6 degrees from the middle ray's: the cosine. Wider packets are slower than their halves.
const ALIKE: f64 = 0.9945;

/// A packet's rays, sixteen at most.
pub(super) struct Packet<'a> {
    pub(super) rays: &'a [Ray],
    pub(super) origin: Point3<f64>,
    pub(super) stamp: Time,
}

/// The same in lanes, world frame.
pub(super) struct WideRays<I: Isa> {
    pub(super) direction: [I::Wide; 3],
    /// Where each ray's stretch begins and ends, measured from the shared origin.
    pub(super) begin: I::Wide,
    pub(super) end: I::Wide,
    /// How far along each ray its own origin is from the shared one.
    pub(super) ahead: I::Wide,
    pub(super) mask: u32,
}

/// The longest packet that begins with the group's first ray, among the group, its half, its quarter and so on.
pub(super) fn first(group: &[Ray]) -> Packet<'_> {
    let mut count = group.len().min(GROUP);
    loop {
        let rays = &group[..count];
        let middle = &rays[count / 2];
        if count == 1 || rays.iter().all(|ray| alike(ray, middle)) {
            return Packet { rays, origin: middle.origin, stamp: middle.stamp };
        }
        count = count.div_ceil(2);
    }
}

fn alike(ray: &Ray, middle: &Ray) -> bool {
    (ray.origin - middle.origin).norm_squared() <= APART_M * APART_M
        && (ray.stamp - middle.stamp).abs() <= APART
        && ray.direction.dot(&middle.direction) >= ALIKE
}

impl Packet<'_> {
    /// How far along the ray its own origin is from the shared one, meters.
    #[inline(always)]
    fn ahead_m(&self, ray: &Ray) -> f64 {
        let apart: Vector3<f64> = ray.origin - self.origin;
        apart.x * ray.direction.x + apart.y * ray.direction.y + apart.z * ray.direction.z
    }

    #[inline(always)]
    pub(super) fn wide<I: Isa>(&self) -> WideRays<I> {
        let mut direction = [[0.0_f32; GROUP]; 3];
        let mut begin = [f32::INFINITY; GROUP];
        let mut end = [f32::NEG_INFINITY; GROUP];
        let mut ahead = [0.0_f32; GROUP];
        let mut mask = 0;
        let mut lane = 0;
        while lane < self.rays.len() && lane < GROUP {
            let ray = &self.rays[lane];
            let ahead_m = self.ahead_m(ray);
            direction[0][lane] = ray.direction.x as f32;
            direction[1][lane] = ray.direction.y as f32;
            direction[2][lane] = ray.direction.z as f32;
            begin[lane] = (ray.range_m_min + ahead_m) as f32;
            end[lane] = (ray.range_m_max + ahead_m) as f32;
            ahead[lane] = ahead_m as f32;
            mask |= 1 << lane;
            lane += 1;
        }
        WideRays {
            direction: [
                I::Wide::load(&direction[0]),
                I::Wide::load(&direction[1]),
                I::Wide::load(&direction[2]),
            ],
            begin: I::Wide::load(&begin),
            end: I::Wide::load(&end),
            ahead: I::Wide::load(&ahead),
            mask,
        }
    }
}
