//! What the tracer is tested on: six trees on bumpy ground, a sweep through them, and a search through every surface.

use super::super::super::{Depth, Hit, Optics, Ray, surface};
use arborloop_base::{Class, Seed, Span, Time};
use arborloop_worlds::{
    Frustum, GrassSpec, Hinge, Leaf, Plant, Planting, Prototype, Solid, SurroundingsSpec, TerrainSpec, Wind,
    WindSpec, World, WorldSpec, build,
};
use nalgebra::{Point3, Similarity3, Unit, UnitQuaternion, Vector3};

/// Bumpy ground without anything on it.
pub(super) fn soil() -> World {
    let spec = WorldSpec {
        terrain: TerrainSpec { extent_m: 12.0, ..TerrainSpec::default() },
        grass: GrassSpec { height_m: 0.0, ..GrassSpec::default() },
        planting: Planting::None,
        surroundings: SurroundingsSpec { trees: 0, bushes: 0, ..SurroundingsSpec::default() },
        wind: WindSpec::default(),
    };
    build(&spec, Seed(8))
}

pub(super) fn prototype(leaves: u64, seed: u64) -> Prototype {
    let stream = Seed(seed).stream("leaves");
    let mut leaves: Vec<Leaf> = (0..leaves)
        .map(|index| {
            let mut draws = stream.at(index);
            let mut point = |reach: f64| Vector3::from_fn(|_, _| draws.within(-reach, reach));
            let (center, half_u, other) = (point(0.8), point(1.0).normalize() * 0.035, point(1.0));
            let center = Point3::new(center.x, center.y, 1.0 + center.z);
            Leaf { center, half_u, half_v: half_u.cross(&other).normalize() * 0.03 }
        })
        .collect();
    leaves.sort_by(|a, b| a.center.z.total_cmp(&b.center.z));
    let branch = |n: u64| Frustum {
        base: Point3::new(0.0, 0.0, 0.3 + 0.1 * n as f64),
        axis: Unit::new_normalize(Vector3::new((n as f64).cos(), (n as f64).sin(), 0.8)),
        height_m: 0.9,
        radius_base_m: 0.02,
        radius_top_m: 0.006,
    };
    Prototype {
        leaves,
        haze: Vec::new(),
        branches: (0..5).map(branch).collect(),
        leaf_reflectivity_ratio: 0.5,
        bark_reflectivity_ratio: 0.3,
    }
}

/// Six trees of two prototypes on bumpy ground, in the wind if it blows.
pub(super) fn grove(mean_mps: f64) -> World {
    let mut world = soil();
    world.prototypes = vec![prototype(300, 1), prototype(250, 2)];
    for index in 0..6_u32 {
        let (x, y) = (2.5 + 1.7 * f64::from(index % 3), -1.5 + 3.0 * f64::from(index / 3));
        let foot = Point3::new(x, y, world.terrain.height_m(x, y));
        let turn = UnitQuaternion::from_euler_angles(0.05, -0.03, 1.3 * f64::from(index));
        world.plants.push(Plant {
            prototype: index as usize % 2,
            world_from_plant: Similarity3::from_parts(
                foot.coords.into(),
                turn,
                0.9 + 0.05 * f64::from(index),
            ),
            instance: index + 1,
            hinge: Hinge { foot, height_m: 2.0, fork: foot + Vector3::z() * 0.3, reach_m: 1.7 },
        });
        world.solids.push(Solid {
            class: Class::Trunk,
            instance: index + 1,
            shape: Frustum {
                base: foot - Vector3::z() * 0.1,
                axis: Vector3::z_axis(),
                height_m: 0.9,
                radius_base_m: 0.05,
                radius_top_m: 0.04,
            },
            reflectivity_ratio: 0.3,
        });
    }
    world.wind =
        Wind::new(&WindSpec { mean_mps, gust_ratio: 0.3, ..WindSpec::default() }, &world.plants, Seed(6));
    world
}

/// One laser after the other, sixteen azimuths side by side: the order in which packets are whole. The sensor moves at
/// `speed`; a firing cycle takes 55.296 us.
pub(super) fn sweep(speed: Vector3<f64>, columns: usize) -> Vec<Ray> {
    let mut rays = Vec::new();
    for block in 0..columns / 16 {
        for laser in 0..16 {
            for column in block * 16..block * 16 + 16 {
                let since = Span::from_nanos(column as i64 * 55_296 + laser * 2_304);
                let azimuth = -0.5 + column as f64 * 0.0034;
                let elevation = (-15.0 + 2.0 * laser as f64).to_radians();
                let level = elevation.cos();
                rays.push(Ray {
                    stamp: Time::SIMULATION_START + since,
                    origin: Point3::new(0.0, 0.0, 0.6) + speed * since.seconds(),
                    direction: Vector3::new(level * azimuth.cos(), level * azimuth.sin(), elevation.sin()),
                    range_m_min: 0.0,
                    range_m_max: 100.0,
                    depth: Depth::ENDLESS,
                });
            }
        }
    }
    rays
}

/// Every surface, one after the other, each where it is at the ray's own instant.
pub(super) fn slow(world: &World, ray: &Ray) -> Option<(f64, Class)> {
    let start = ray.origin + ray.direction * ray.range_m_min;
    let mut found: Vec<(f64, Class)> = Vec::new();
    for solid in &world.solids {
        let crossing = surface::cross_frustum(&solid.shape, &start, &ray.direction, f64::INFINITY);
        found.extend(crossing.map(|met| (met.range_m, solid.class)));
    }
    for (index, plant) in world.plants.iter().enumerate() {
        let sway = world.wind.sway(index, plant, ray.stamp.seconds());
        let plant_from_world = sway.world_from_plant.inverse();
        let (origin, direction) = (plant_from_world * start, plant_from_world * ray.direction);
        let prototype = &world.prototypes[plant.prototype];
        for (index, leaf) in prototype.leaves.iter().enumerate() {
            let leaf = sway.leaf(index, leaf);
            let crossing = surface::cross_leaf(&leaf, &origin, &direction, f64::INFINITY);
            found.extend(crossing.map(|met| (met.range_m, Class::Leaf)));
        }
        for branch in &prototype.branches {
            let crossing = surface::cross_frustum(branch, &origin, &direction, f64::INFINITY);
            found.extend(crossing.map(|met| (met.range_m, Class::Branch)));
        }
    }
    // The soil in small steps down to where it is crossed, then by halving.
    let above = |range: f64| {
        let at = start + ray.direction * range;
        at.z - world.terrain.height_m(at.x, at.y)
    };
    let over = |range: f64| world.terrain.bounds().contains(&(start + ray.direction * range).xy());
    let steps = (0..8000).map(|n| f64::from(n) * 2e-3).take_while(|&range| over(range));
    if let Some(under) = steps.into_iter().find(|&range| above(range) < 0.0) {
        let (mut low, mut high) = (under - 2e-3, under);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if above(middle) < 0.0 { high = middle } else { low = middle }
        }
        found.push((high, Class::Ground));
    }
    let nearest = found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let range_m = nearest.0 + ray.range_m_min;
    (range_m <= ray.range_m_max).then_some((range_m, nearest.1))
}

pub(super) fn alike(fast: Option<Hit>, slow: Option<(f64, Class)>, within_m: f64) -> bool {
    match (fast, slow) {
        (Some(hit), Some((range_m, class))) => {
            (hit.range_m - range_m).abs() <= within_m && hit.class == class
        }
        (None, None) => true,
        _ => false,
    }
}

/// Whether the ray meets what the hit says once it is moved sideways by no more than `lateral_m`.
pub(super) fn is_silhouette(world: &World, ray: &Ray, hit: Option<Hit>, lateral_m: f64) -> bool {
    let across = ray.direction.cross(&Vector3::z()).normalize();
    let up = across.cross(&ray.direction);
    (0..24).any(|n| {
        let (sin, cos) = (f64::from(n % 8) * std::f64::consts::FRAC_PI_4).sin_cos();
        let shift = (across * cos + up * sin) * (lateral_m * f64::from(n / 8 + 1) / 3.0);
        // A surface that is seen at a flat angle is met much farther on or nearer when the ray is moved.
        alike(hit, slow(world, &Ray { origin: ray.origin + shift, ..*ray }), 20.0 * lateral_m)
    })
}

pub(super) fn cast_all(optics: &Optics, rays: &[Ray]) -> Vec<Option<Hit>> {
    let mut hits = Vec::new();
    optics.cast_all(rays, &mut hits);
    hits
}
