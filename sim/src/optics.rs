//! What a beam meets: terrain, grass, solids and the leaves and branches of plants. Not what a body touches.
//!
//! Two levels: every plant is an instance of a shared prototype, traced in the prototype's own frame.

mod bvh;
mod surface;
mod turf;

use arborloop_base::{Class, Time};
use arborloop_worlds::{Frustum, Leaf, World};
use bvh::{Aabb, Bvh};
use nalgebra::{Point3, Similarity3, Vector3};
use surface::Crossing;
use turf::Turf;

/// A thin beam: when it flies, where it starts, where it goes, and which stretch of it counts.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// When. Light needs no time to fly.
    pub stamp: Time,
    /// Start, world frame, meters.
    pub origin: Point3<f64>,
    /// Direction, world frame, of length 1.
    pub direction: Vector3<f64>,
    /// Nothing nearer than this is met.
    pub range_m_min: f64,
    /// Nothing beyond this distance is met.
    pub range_m_max: f64,
    /// Optical depth of turbid things (grass, haze) that it gets through before one stops it, drawn by the caller from
    /// the exponential law of mean one.
    pub depth: f64,
}

/// What a beam met first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the beam, meters.
    pub range_m: f64,
    /// What it is.
    pub class: Class,
    /// Which one of its class.
    pub instance: u32,
    /// Cosine of the angle between beam and surface normal, in [0, 1].
    pub cos_incidence: f64,
    /// Share of light that the surface throws back; above 1 for retro-reflectors.
    pub reflectivity_ratio: f64,
    /// Share of light that goes through the surface.
    pub transmittance_ratio: f64,
    /// How far the wind has moved this point of the surface from where it rests, world frame, meters.
    pub displacement_m: Vector3<f64>,
}

/// A world made ready for beams.
#[derive(Debug)]
pub struct Optics {
    turf: Turf,
    solids: Vec<Solid>,
    plants: Vec<Plant>,
    prototypes: Vec<Prototype>,
    /// Over `solids`, then `plants`.
    top: Bvh,
}

#[derive(Debug)]
struct Solid {
    class: Class,
    instance: u32,
    shape: Frustum,
    reflectivity_ratio: f64,
}

#[derive(Debug)]
struct Plant {
    prototype: usize,
    plant_from_world: Similarity3<f64>,
    instance: u32,
}

#[derive(Debug)]
struct Prototype {
    leaves: Vec<Leaf>,
    branches: Vec<Frustum>,
    leaf_reflectivity_ratio: f64,
    bark_reflectivity_ratio: f64,
    /// Over `leaves`, then `branches`.
    parts: Bvh,
}

impl Optics {
    /// Sorts the world's surfaces for tracing.
    pub fn new(world: &World) -> Self {
        let solids: Vec<Solid> = world
            .solids
            .iter()
            .map(|solid| Solid {
                class: solid.class,
                instance: solid.instance,
                shape: solid.shape,
                reflectivity_ratio: solid.reflectivity_ratio,
            })
            .collect();
        let prototypes: Vec<Prototype> = world
            .prototypes
            .iter()
            .map(|prototype| {
                let leaves = prototype.leaves.iter().map(surface::leaf_bounds);
                let branches = prototype.branches.iter().map(surface::frustum_bounds);
                Prototype {
                    parts: Bvh::new(&leaves.chain(branches).collect::<Vec<_>>()),
                    leaves: prototype.leaves.clone(),
                    branches: prototype.branches.clone(),
                    leaf_reflectivity_ratio: prototype.leaf_reflectivity_ratio,
                    bark_reflectivity_ratio: prototype.bark_reflectivity_ratio,
                }
            })
            .collect();
        let plants: Vec<Plant> = world
            .plants
            .iter()
            .map(|plant| Plant {
                prototype: plant.prototype,
                plant_from_world: plant.world_from_plant.inverse(),
                instance: plant.instance,
            })
            .collect();
        let solid_bounds = solids.iter().map(|solid| surface::frustum_bounds(&solid.shape));
        let plant_bounds = world.plants.iter().map(|plant| {
            prototypes[plant.prototype].parts.bounds().transformed(|corner| plant.world_from_plant * corner)
        });
        let top = Bvh::new(&solid_bounds.chain(plant_bounds).collect::<Vec<Aabb>>());
        Optics { turf: Turf::new(&world.terrain, &world.grass), solids, plants, prototypes, top }
    }

    /// What each ray meets first, in the same order. Rays that follow each other are traced together: order them so
    /// that neighbors look alike (sixteen azimuths of one laser, not sixteen lasers of one azimuth).
    pub fn cast_all(&self, rays: &[Ray], hits: &mut Vec<Option<Hit>>) {
        hits.clear();
        hits.extend(rays.iter().map(|ray| self.cast(ray)));
    }

    /// What the ray meets first.
    pub fn cast(&self, ray: &Ray) -> Option<Hit> {
        let skipped_m = ray.range_m_min;
        let from = Ray {
            origin: ray.origin + ray.direction * skipped_m,
            range_m_min: 0.0,
            range_m_max: ray.range_m_max - skipped_m,
            ..*ray
        };
        let hit = self.cast_from_origin(&from)?;
        Some(Hit { range_m: hit.range_m + skipped_m, ..hit })
    }

    fn cast_from_origin(&self, ray: &Ray) -> Option<Hit> {
        let ground = self.turf.cast(ray, ray.depth);
        let mut nearest = ground.map_or(ray.range_m_max, |hit| hit.range_m);
        let mut best = ground;
        self.top.traverse(&ray.origin, &ray.direction, &mut nearest, |index, nearest| {
            if let Some(solid) = self.solids.get(index) {
                if let Some(crossing) =
                    surface::cross_frustum(&solid.shape, &ray.origin, &ray.direction, *nearest)
                {
                    *nearest = crossing.range_m;
                    best = Some(crossing.hit(solid.class, solid.instance, solid.reflectivity_ratio));
                }
            } else if let Some(hit) = self.cast_plant(&self.plants[index - self.solids.len()], ray, *nearest)
            {
                *nearest = hit.range_m;
                best = Some(hit);
            }
        });
        best
    }

    /// The beam is turned into the plant's frame with its direction scaled alike, so distances stay the world's.
    fn cast_plant(&self, plant: &Plant, ray: &Ray, range_m_max: f64) -> Option<Hit> {
        let prototype = &self.prototypes[plant.prototype];
        let origin = plant.plant_from_world * ray.origin;
        let direction = plant.plant_from_world * ray.direction;
        let mut nearest = range_m_max;
        let mut best = None;
        prototype.parts.traverse(&origin, &direction, &mut nearest, |index, nearest| {
            let (crossing, class, reflectivity_ratio) = match prototype.leaves.get(index) {
                Some(leaf) => (
                    surface::cross_leaf(leaf, &origin, &direction, *nearest),
                    Class::Leaf,
                    prototype.leaf_reflectivity_ratio,
                ),
                None => (
                    surface::cross_frustum(
                        &prototype.branches[index - prototype.leaves.len()],
                        &origin,
                        &direction,
                        *nearest,
                    ),
                    Class::Branch,
                    prototype.bark_reflectivity_ratio,
                ),
            };
            if let Some(crossing) = crossing {
                *nearest = crossing.range_m;
                best = Some(crossing.hit(class, plant.instance, reflectivity_ratio));
            }
        });
        best
    }
}

impl Crossing {
    fn hit(self, class: Class, instance: u32, reflectivity_ratio: f64) -> Hit {
        Hit {
            range_m: self.range_m,
            class,
            instance,
            cos_incidence: self.cos_incidence,
            reflectivity_ratio,
            // Leaves near 905 nm let through 42 to 50 % (Helios spectral library: grape, almond).
            transmittance_ratio: if class == Class::Leaf { 0.44 } else { 0.0 },
            displacement_m: Vector3::zeros(),
        }
    }
}

#[cfg(test)]
mod tests;
