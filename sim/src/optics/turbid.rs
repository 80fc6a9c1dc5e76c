//! What stops a beam by chance along its way: grass and haze, by Beer and Lambert, from one budget of optical depth.

use super::exact::LEAF_TRANSMITTANCE_RATIO;
use super::grass::Grass;
use super::haze;
use super::trace::{Scene, Worker};
use super::{Hit, Ray};
use arborloop_base::{Class, Seed};
use arborloop_worlds::World;
use nalgebra::Vector3;

/// A stretch of a beam through one medium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub(super) from_m: f64,
    pub(super) to_m: f64,
    /// Optical depth per meter.
    pub(super) extinction_per_m: f64,
    pub(super) medium: Medium,
}

/// What a stretch goes through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Medium {
    Grass,
    /// Haze of the plant with this index.
    Haze(usize),
}

/// Where the beam's budget is used up before `end_m`. Media that overlap add up; which of them stops the beam is drawn
/// in proportion, by the budget itself, because the caller's one number is all the chance there is.
pub(super) fn stop(spans: &mut [Span], depth: f64, end_m: f64) -> Option<(f64, Medium)> {
    spans.sort_by(|a, b| a.from_m.total_cmp(&b.from_m));
    let mut left = depth;
    let mut at_m = spans.first()?.from_m;
    while at_m < end_m {
        // Until the next border the same media hold.
        let inside = |span: &&Span| span.from_m <= at_m && at_m < span.to_m;
        let total: f64 = spans.iter().filter(inside).map(|span| span.extinction_per_m).sum();
        let borders = spans.iter().flat_map(|span| [span.from_m, span.to_m]).filter(|border| *border > at_m);
        let next_m = borders.fold(f64::INFINITY, f64::min).min(end_m);
        let used = total * (next_m - at_m);
        if total > 0.0 && used >= left {
            let stop_m = at_m + left / total;
            let mut share = total * Seed(depth.to_bits()).stream("optics/overlap").at(0).unit();
            let chosen = spans.iter().filter(inside).find(|span| {
                share -= span.extinction_per_m;
                share < 0.0
            });
            let medium = chosen.or(spans.iter().rfind(inside))?.medium;
            return (stop_m < end_m).then_some((stop_m, medium));
        }
        left -= if total > 0.0 { used } else { 0.0 };
        at_m = next_m;
    }
    None
}

/// All that is turbid in a world.
#[derive(Debug)]
pub(super) struct Turbid {
    grass: Grass,
    mist: haze::Mist,
}

impl Turbid {
    pub(super) fn new(world: &World) -> Self {
        Turbid { grass: Grass::new(world), mist: haze::Mist::new(world) }
    }

    /// Whether a beam can be stopped by chance anywhere.
    pub(super) fn is_clear(&self) -> bool {
        self.grass.is_bare() && self.mist.is_empty()
    }

    /// What stops the beam before `end_m`, if anything.
    pub(super) fn cast(
        &self,
        world: &World,
        scene: &Scene,
        ray: &Ray,
        end_m: f64,
        spans: &mut Vec<Span>,
        worker: &mut Worker,
    ) -> Option<Hit> {
        spans.clear();
        self.grass.spans(ray, end_m, spans);
        self.mist.spans(world, scene, ray, end_m, spans, worker);
        let (range_m, medium) = stop(spans, ray.depth, end_m)?;
        // Blades and leaves of a medium lie at every angle: the mean cosine of a random one.
        let mut hit = Hit {
            range_m,
            class: Class::Grass,
            instance: 0,
            cos_incidence: 0.5,
            reflectivity_ratio: world.grass.reflectivity_ratio,
            transmittance_ratio: 0.0,
            displacement_m: Vector3::zeros(),
        };
        if let Medium::Haze(index) = medium {
            let plant = &world.plants[index];
            hit.class = Class::Leaf;
            hit.instance = plant.instance;
            hit.reflectivity_ratio = world.prototypes[plant.prototype].leaf_reflectivity_ratio;
            hit.transmittance_ratio = LEAF_TRANSMITTANCE_RATIO;
            if world.wind.blows() {
                let now = ray.origin + ray.direction * range_m;
                let moment = scene.moment(world, index, ray.stamp, worker);
                let rest = plant.world_from_plant * moment.plant_from_world.point(&now);
                hit.displacement_m = now - rest;
            }
        }
        Some(hit)
    }
}
