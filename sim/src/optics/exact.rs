//! From the surface that a beam meets to the hit: in double precision, with the beam's own origin at its own instant.
//!
//! The tracer decides which surface is met. Where the exact beam then misses that surface by a hair, a silhouette that
//! rounding or the packet's shared origin has moved, the surface is continued: a leaf and the soil by their planes, a
//! frustum by the tracer's own distance at grazing incidence.

use super::soil::Soil;
use super::trace::{Between, Map, Scene, Seen, Surface};
use super::{Hit, Ray, surface};
use arborloop_base::Class;
use arborloop_worlds::wind::{LEAVES_PER_SHOOT, own_turns};
use arborloop_worlds::{Frustum, Leaf, World};
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

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
            let direct = |shoot: usize| scene.shoot_direction(plant, shoot);
            let now = moment.map_or(*rest, |moment| leaf_now(moment, index, rest, direct));
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

/// Where a prototype's leaf is, plant frame; see [`arborloop_worlds::Sway::leaf`], which this repeats without calls of the
/// library's sines, to a ten-billionth. `direction` is the line along which a shoot moves.
#[inline(always)]
fn leaf_now(moment: &Between, index: usize, rest: &Leaf, direction: impl Fn(usize) -> Vector3<f64>) -> Leaf {
    let shoot = index / LEAVES_PER_SHOOT;
    let (shoot_m, turns) = moment.shoots(shoot % 4);
    let shift_m = shoot_m * sin_of_turns(turns + own_turns(shoot));
    let (leaf_rad, turns) = moment.leaves(index % 4);
    let (sin, cos) = sin_cos_of_small(leaf_rad * sin_of_turns(turns + own_turns(index)));
    let normal = rest.half_u.cross(&rest.half_v);
    Leaf {
        center: rest.center + direction(shoot) * shift_m,
        half_u: rest.half_u,
        half_v: rest.half_v * cos + normal * (sin / rest.half_u.norm().max(f64::MIN_POSITIVE)),
    }
}

/// Sine of an angle in turns, within 1e-10: Taylor's series up to the fifteenth power on a quarter turn.
#[inline(always)]
fn sin_of_turns(turns: f64) -> f64 {
    let share = turns - (turns as i64) as f64;
    let share = if share > 0.5 { share - 1.0 } else { share };
    let x = TAU * (0.25 - (share.abs() - 0.25).abs());
    let square = x * x;
    let mut series = -1.0 / 1_307_674_368_000.0;
    for term in [6_227_020_800.0, -39_916_800.0, 362_880.0, -5040.0, 120.0, -6.0, 1.0] {
        series = series * square + 1.0 / term;
    }
    (series * x).copysign(share)
}

/// Sine and cosine of an angle below 0.6 rad, within 1e-10.
#[inline(always)]
fn sin_cos_of_small(x: f64) -> (f64, f64) {
    let square = x * x;
    let (mut sin, mut cos) = (-1.0 / 39_916_800.0, -1.0 / 3_628_800.0);
    for term in [362_880.0, -5040.0, 120.0, -6.0, 1.0] {
        sin = sin * square + 1.0 / term;
    }
    for term in [40_320.0, -720.0, 24.0, -2.0, 1.0] {
        cos = cos * square + 1.0 / term;
    }
    (sin * x, cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_agree_with_the_library_s_sines() {
        for step in 0..8000 {
            let turns = f64::from(step) / 4000.0;
            assert!((sin_of_turns(turns) - (TAU * turns).sin()).abs() < 1e-10, "{turns}");
            let small = 0.6 * (turns - 1.0);
            let (sin, cos) = sin_cos_of_small(small);
            assert!((sin - small.sin()).abs() < 1e-10 && (cos - small.cos()).abs() < 1e-10, "{small}");
        }
    }
}
