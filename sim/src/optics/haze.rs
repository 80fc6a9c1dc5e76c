//! Foliage as haze: which volumes of leaves a beam passes, and how dense they are along it.

use super::Ray;
use super::boxes::Aabb;
use super::trace::{Scene, Worker};
use super::turbid::{Medium, Span};
use arborloop_worlds::{Haze, Outline, World};
use nalgebra::{Point3, Vector3};

/// The plants that are haze.
#[derive(Debug)]
pub(super) struct Mist {
    /// Sorted so that plants near each other follow each other: [`CLUSTER`] at a time share a box.
    plants: Vec<Hazy>,
    clusters: Vec<Aabb>,
}

#[derive(Debug, Clone, Copy)]
struct Hazy {
    index: usize,
    bounds: Aabb,
}

const CLUSTER: usize = 16;

impl Mist {
    pub(super) fn new(world: &World) -> Self {
        let mut plants: Vec<Hazy> = Vec::new();
        for (index, plant) in world.plants.iter().enumerate() {
            let haze = &world.prototypes[plant.prototype].haze;
            if haze.is_empty() {
                continue;
            }
            let own = haze.iter().fold(Aabb::empty(), |all, one| {
                all.with(&Aabb { low: one.center - one.half_size, high: one.center + one.half_size })
            });
            let room_m = if world.wind.blows() { world.wind.drift_max(plant).plant_m } else { 0.0 };
            let bounds = own.transformed(|corner| plant.world_from_plant * corner);
            plants.push(Hazy { index, bounds: bounds.grown(&Vector3::repeat(room_m)) });
        }
        gather(&mut plants);
        let around = |some: &[Hazy]| some.iter().fold(Aabb::empty(), |all, one| all.with(&one.bounds));
        Mist { clusters: plants.chunks(CLUSTER).map(around).collect(), plants }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.plants.is_empty()
    }

    /// Adds the stretches of the beam, from its begin to `end_m`, through each volume.
    pub(super) fn spans(
        &self,
        world: &World,
        scene: &Scene,
        ray: &Ray,
        end_m: f64,
        spans: &mut Vec<Span>,
        worker: &mut Worker,
    ) {
        let inverse = ray.direction.map(|d| 1.0 / d);
        for (cluster, plants) in self.clusters.iter().zip(self.plants.chunks(CLUSTER)) {
            if cluster.stretch(&ray.origin, &inverse, ray.range_m_min, end_m).is_none() {
                continue;
            }
            for hazy in plants {
                if hazy.bounds.stretch(&ray.origin, &inverse, ray.range_m_min, end_m).is_none() {
                    continue;
                }
                let plant = &world.plants[hazy.index];
                let map = scene.plant_from_world(world, hazy.index, ray.stamp, worker);
                let (origin, direction) = (map.point(&ray.origin), map.vector(&ray.direction));
                for haze in &world.prototypes[plant.prototype].haze {
                    let Some((from_m, to_m)) = through(haze, &origin, &direction) else { continue };
                    let (from_m, to_m) = (from_m.max(ray.range_m_min), to_m.min(end_m));
                    if from_m < to_m {
                        let projection = haze.leaf_angle.projection(ray.direction.z.abs());
                        // Grown larger, a plant has the same leaves on more space: area by the square, space by the cube.
                        let leaf_area_per_m = haze.leaf_area_per_m / plant.world_from_plant.scaling();
                        spans.push(Span {
                            from_m,
                            to_m,
                            extinction_per_m: projection * leaf_area_per_m,
                            medium: Medium::Haze(hazy.index),
                        });
                    }
                }
            }
        }
    }
}

/// Halves along the wider of x and y, down to a cluster.
fn gather(plants: &mut [Hazy]) {
    if plants.len() <= CLUSTER {
        return;
    }
    let centers = Aabb::around(plants.iter().map(|one| one.bounds.center()));
    let axis = (centers.high - centers.low).imax();
    plants.sort_by(|a, b| {
        let place = |one: &Hazy| one.bounds.center()[axis];
        place(a).total_cmp(&place(b)).then(a.index.cmp(&b.index))
    });
    let middle = (plants.len() / 2).next_multiple_of(CLUSTER).min(plants.len());
    let (near, far) = plants.split_at_mut(middle);
    gather(near);
    gather(far);
}

/// Where a line enters and leaves a volume, in lengths of its direction.
fn through(haze: &Haze, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<(f64, f64)> {
    // In units of the half sizes the ellipsoid is the unit ball and the box the unit cube.
    let from_center = (origin - haze.center).component_div(&haze.half_size);
    let along = direction.component_div(&haze.half_size);
    match haze.outline {
        Outline::Ellipsoid => {
            let a = along.norm_squared();
            let half_b = from_center.dot(&along);
            // Measured from the point nearest to the middle, so that a far origin costs no digits.
            let nearest = -half_b / a;
            let room = 1.0 - (from_center + along * nearest).norm_squared();
            (room > 0.0).then(|| {
                let half = (room / a).sqrt();
                (nearest - half, nearest + half)
            })
        }
        Outline::Box => {
            let unit = Vector3::repeat(1.0);
            let cube = Aabb { low: Point3::from(-unit), high: Point3::from(unit) };
            let inverse = along.map(|d| 1.0 / d);
            cube.stretch(&Point3::from(from_center), &inverse, f64::NEG_INFINITY, f64::INFINITY)
        }
    }
}
