//! From the surface that a beam meets to the hit: in double precision, with the beam's own origin at its own instant.
//!
//! The tracer decides which surface is met. Where the exact beam then misses that surface by a hair, a silhouette that
//! rounding or the packet's shared origin has moved, the surface is continued: a leaf and the soil by their planes, a
//! frustum by the tracer's own distance at grazing incidence.

use super::soil::Soil;
use super::trace::{Between, Map, Scene, Seen, Surface};
use super::{Hit, Ray, surface};
use arborloop_base::Class;
use arborloop_worlds::{Frustum, Leaf, World};
use nalgebra::{Point3, Vector3};

/// Leaves near 905 nm let through 42 to 50 % (Helios spectral library: grape, almond).
pub(super) const LEAF_TRANSMITTANCE_RATIO: f64 = 0.44;
/// A leaf's plane is not followed farther than this many half sides from its middle.
const HAIR: f64 = 1.2;
/// A crossing this close to the tracer's needs no second look, meters.
const NEAR_M: f64 = 1e-3;

/// The hit of a beam that meets the soil or a solid.
pub(super) fn on_fixed(world: &World, soil: &Soil, ray: &Ray, seen: &Seen) -> Option<Hit> {
    match seen.surface {
        Surface::Soil { facet } => {
            let (range_m, normal) = soil.crossing(ray, facet, seen.range_m);
            Some(Hit {
                range_m,
                class: Class::Ground,
                instance: 0,
                cos_incidence: cos_incidence(&normal, &ray.direction),
                reflectivity_ratio: world.terrain.reflectivity_ratio,
                transmittance_ratio: 0.0,
                displacement_m: Vector3::zeros(),
            })
        }
        Surface::Solid { index } => {
            let solid = &world.solids[index];
            let start = ray.origin + ray.direction * ray.range_m_min;
            let crossing = surface::cross_frustum(&solid.shape, &start, &ray.direction, f64::INFINITY);
            let (range_m, cos_incidence) = crossing
                .map_or((seen.range_m, 0.0), |met| (met.range_m + ray.range_m_min, met.cos_incidence));
            Some(Hit {
                range_m,
                class: solid.class,
                instance: solid.instance,
                cos_incidence,
                reflectivity_ratio: solid.reflectivity_ratio,
                transmittance_ratio: 0.0,
                displacement_m: Vector3::zeros(),
            })
        }
        Surface::Leaf { .. } | Surface::Branch { .. } => None,
    }
}

/// The hit of a beam that meets a part of the plant with this index, which is where the map says; `moment` is how its
/// leaves move, if they do.
#[inline(always)]
pub(super) fn on_plant(
    world: &World,
    scene: &Scene,
    plant: usize,
    ray: &Ray,
    seen: &Seen,
    plant_from_world: &Map,
    moment: Option<&Between>,
) -> Hit {
    let standing = &world.plants[plant];
    let prototype = &world.prototypes[standing.prototype];
    let origin = plant_from_world.point(&ray.origin);
    let direction = plant_from_world.vector(&ray.direction);
    let (leaf, (range_m, cos_incidence, rest)) = match seen.surface {
        Surface::Leaf { leaf: index, .. } => {
            let rest = &prototype.leaves[index];
            let now = moment.map_or(*rest, |moment| scene.leaf_at(plant, index, rest, moment));
            (true, on_leaf(rest, &now, &origin, &direction, seen, moment.is_some()))
        }
        Surface::Branch { branch, .. } => {
            (false, on_branch(&prototype.branches[branch], &origin, &direction, ray.range_m_min, seen))
        }
        Surface::Soil { .. } | Surface::Solid { .. } => (false, (seen.range_m, 0.0, origin)),
    };
    Hit {
        range_m,
        class: if leaf { Class::Leaf } else { Class::Branch },
        instance: standing.instance,
        cos_incidence,
        reflectivity_ratio: match leaf {
            true => prototype.leaf_reflectivity_ratio,
            false => prototype.bark_reflectivity_ratio,
        },
        transmittance_ratio: if leaf { LEAF_TRANSMITTANCE_RATIO } else { 0.0 },
        displacement_m: match moment {
            Some(_) => ray.origin + ray.direction * range_m - scene.world_from_resting(plant).point(&rest),
            None => Vector3::zeros(),
        },
    }
}

/// Distance, cosine of the incidence, and where the point of the surface rests; plant frame.
type Met = (f64, f64, Point3<f64>);

fn on_branch(
    branch: &Frustum,
    origin: &Point3<f64>,
    direction: &Vector3<f64>,
    range_m_min: f64,
    seen: &Seen,
) -> Met {
    let start = origin + direction * range_m_min;
    let crossing = surface::cross_frustum(branch, &start, direction, f64::INFINITY);
    let (range_m, cos_incidence) =
        crossing.map_or((seen.range_m, 0.0), |met| (met.range_m + range_m_min, met.cos_incidence));
    (range_m, cos_incidence, origin + direction * range_m)
}

#[inline(always)]
fn on_leaf(
    rest: &Leaf,
    now: &Leaf,
    origin: &Point3<f64>,
    direction: &Vector3<f64>,
    seen: &Seen,
    moves: bool,
) -> Met {
    let normal = now.half_u.cross(&now.half_v);
    let to_center = now.center - origin;
    let facing = normal.dot(direction);
    let area = normal.norm_squared();
    let mut range_m = normal.dot(&to_center) / facing;
    let cos_incidence = (facing * facing / (area * direction.norm_squared())).sqrt().min(1.0);
    let near = (range_m - seen.range_m).abs() < NEAR_M;
    if near && !moves {
        // The crossing is where the tracer found it, so it is on the leaf; and where nothing moves that is all.
        return (range_m, cos_incidence, *origin);
    }
    let place = |range_m: f64| {
        let from_center = direction * range_m - to_center;
        let a = from_center.cross(&now.half_v).dot(&normal) / area;
        (a, now.half_u.cross(&from_center).dot(&normal) / area)
    };
    let (mut a, mut b) = place(range_m);
    if !(a.abs() <= HAIR && b.abs() <= HAIR) {
        range_m = seen.range_m;
        (a, b) = place(range_m);
    }
    (range_m, cos_incidence, rest.center + rest.half_u * a + rest.half_v * b)
}

fn cos_incidence(normal: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
    (normal.dot(direction).abs() / (normal.norm_squared() * direction.norm_squared()).sqrt()).min(1.0)
}
