//! What stops a beam by chance along its way: grass and haze, by Beer and Lambert, from one budget of optical depth.

use super::exact::LEAF_TRANSMITTANCE_RATIO;
use super::extent::Extent;
use super::grass::{GROUP, Grass};
use super::haze;
use super::trace::{InstructionSet, Scene, Worker};
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
            let mut media = spans.iter().filter(inside);
            let (first, several) = (media.next()?, media.next().is_some());
            let medium =
                if several { drawn(spans.iter().filter(inside), total, depth)? } else { first.medium };
            return (stop_m < end_m).then_some((stop_m, medium));
        }
        left -= if total > 0.0 { used } else { 0.0 };
        at_m = next_m;
    }
    None
}

/// One of several media that overlap, drawn in proportion by the beam's own budget.
fn drawn<'a>(media: impl Iterator<Item = &'a Span>, total: f64, depth: f64) -> Option<Medium> {
    let mut share = total * Seed(depth.to_bits()).stream("optics/overlap").at(0).unit();
    let mut last = None;
    for span in media {
        last = Some(span.medium);
        share -= span.extinction_per_m;
        if share < 0.0 {
            break;
        }
    }
    last
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

    /// Memory, bytes.
    pub(super) fn bytes(&self) -> usize {
        self.grass.bytes()
    }

    /// From where on each of some beams may be in grass before its `end_m`; see [`Grass::begins`].
    pub(super) fn begins(
        &self,
        rays: &[Ray],
        extent: &Extent,
        ends_m: &[f64; GROUP],
    ) -> [Option<f64>; GROUP] {
        self.grass.begins(rays, extent, ends_m)
    }

    /// Whether nothing but grass can stop a beam by chance.
    pub(super) fn is_grass_alone(&self) -> bool {
        self.mist.is_empty()
    }

    /// Where grass stops each of some beams before its `end_m`; see [`Grass::stops`].
    pub(super) fn stops(
        &self,
        rays: &[Ray],
        begins: &[Option<f64>; GROUP],
        ends_m: &[f64; GROUP],
        isa: InstructionSet,
    ) -> [Option<f64>; GROUP] {
        self.grass.stops(rays, begins, ends_m, isa)
    }

    /// A blade at a distance.
    #[inline(always)]
    pub(super) fn blade(world: &World, range_m: f64) -> Hit {
        Hit {
            range_m,
            class: Class::Grass,
            instance: 0,
            // Blades and leaves of a medium lie at every angle: the mean cosine of a random one.
            cos_incidence: 0.5,
            reflectivity_ratio: world.grass.reflectivity_ratio,
            transmittance_ratio: 0.0,
            displacement_m: Vector3::zeros(),
        }
    }

    /// What stops the beam before `end_m`, if anything; it may be in grass from `begin` on.
    pub(super) fn cast(
        &self,
        world: &World,
        scene: &Scene,
        ray: &Ray,
        (begin, end_m): (Option<f64>, f64),
        spans: &mut Vec<Span>,
        worker: &mut Worker,
    ) -> Option<Hit> {
        spans.clear();
        begin.into_iter().for_each(|begin| self.grass.spans(ray, begin, end_m, spans));
        self.mist.spans(world, scene, ray, end_m, spans, worker);
        if spans.is_empty() {
            return None;
        }
        let (range_m, medium) = stop(spans, ray.depth.get(), end_m)?;
        let mut hit = Turbid::blade(world, range_m);
        if let Medium::Haze(index) = medium {
            let plant = &world.plants[index];
            hit.class = Class::Leaf;
            hit.instance = plant.instance;
            hit.reflectivity_ratio = world.prototypes[plant.prototype].leaf_reflectivity_ratio;
            hit.transmittance_ratio = LEAF_TRANSMITTANCE_RATIO;
            if world.wind.blows() {
                let now = ray.origin + ray.direction * range_m;
                let map = scene.plant_from_world(world, index, ray.stamp, worker);
                let rest = plant.world_from_plant * map.point(&now);
                hit.displacement_m = now - rest;
            }
        }
        Some(hit)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Depth, Optics};
    use super::*;
    use arborloop_base::Time;
    use arborloop_worlds::{
        GrassSpec, Haze, Hinge, LeafAngle, Outline, Plant, Planting, Prototype, SurroundingsSpec, WindSpec,
        WorldSpec, build,
    };
    use nalgebra::{Point3, Similarity3, UnitQuaternion};

    /// Level ground, and haze of these outlines over x from 2 to 6 m in the plant frame, at this scale.
    fn hazy(outlines: &[Outline], scale: f64) -> World {
        let mut spec = WorldSpec {
            grass: GrassSpec { height_m: 0.0, ..GrassSpec::default() },
            planting: Planting::None,
            surroundings: SurroundingsSpec { trees: 0, bushes: 0, ..SurroundingsSpec::default() },
            wind: WindSpec::default(),
            ..WorldSpec::default()
        };
        (spec.terrain.relief_m, spec.terrain.bump_m, spec.terrain.slope_deg) = (0.0, 0.0, 0.0);
        let mut world = build(&spec, Seed(1));
        let haze = |&outline: &Outline| Haze {
            outline,
            center: Point3::new(4.0, 0.0, 1.0),
            half_size: Vector3::new(2.0, 1.0, 0.9),
            leaf_area_per_m: 0.6,
            leaf_angle: LeafAngle::Spherical,
        };
        world.prototypes = vec![Prototype {
            leaves: Vec::new(),
            haze: outlines.iter().map(haze).collect(),
            branches: Vec::new(),
            leaf_reflectivity_ratio: 0.5,
            bark_reflectivity_ratio: 0.3,
        }];
        let foot = Point3::origin();
        world.plants = vec![Plant {
            prototype: 0,
            world_from_plant: Similarity3::from_parts(foot.coords.into(), UnitQuaternion::identity(), scale),
            instance: 7,
            hinge: Hinge { foot, height_m: 2.0, fork: foot, reach_m: 1.0 },
        }];
        world
    }

    /// Share of level beams through the middle of the haze that nothing stops, and how many there were.
    fn through(world: &World, height_m: f64) -> (f64, f64) {
        let optics = Optics::new(world);
        let stream = Seed(3).stream("depth");
        let count = 20_000;
        let free = (0..count).filter(|&n| {
            let ray = Ray {
                stamp: Time::SIMULATION_START,
                origin: Point3::new(0.0, 0.0, height_m),
                direction: Vector3::x(),
                range_m_min: 0.0,
                range_m_max: 40.0,
                depth: Depth::drawn(&mut stream.at(n)),
            };
            let hit = optics.cast(&ray);
            assert!(hit.is_none_or(|hit| hit.class == Class::Leaf && hit.instance == 7));
            hit.is_none()
        });
        (free.count() as f64 / count as f64, count as f64)
    }

    #[test]
    fn haze_lets_light_through_as_beer_and_lambert_say_and_overlapping_volumes_add() {
        let both = [Outline::Box, Outline::Ellipsoid];
        for (outlines, scale, optical_depth) in [
            // Four meters at G = 1/2 and 0.6 m2/m3. Grown to twice the size: twice as far, half as dense.
            (&both[..1], 1.0, 1.2),
            (&both[1..], 1.0, 1.2),
            (&both[..], 1.0, 2.4),
            (&both[..1], 2.0, 1.2),
        ] {
            let (share, count) = through(&hazy(outlines, scale), scale);
            let law = f64::exp(-optical_depth);
            let sigma = (law * (1.0 - law) / count).sqrt();
            assert!((share - law).abs() < 4.0 * sigma, "{outlines:?} x {scale}: {share} {law}");
        }
    }

    #[test]
    fn a_budget_is_used_up_in_the_order_along_the_beam() {
        let span = |from_m, to_m, extinction_per_m, medium| Span { from_m, to_m, extinction_per_m, medium };
        let mut spans = vec![
            span(5.0, 9.0, 0.5, Medium::Haze(1)),
            span(1.0, 2.0, 1.0, Medium::Grass),
            span(8.0, 12.0, 1.0, Medium::Haze(2)),
        ];
        // 1 in the grass, 1.5 in the first haze alone, 1.5 where both are, 3 in the second alone.
        for (depth, wanted_m) in [(0.25, 1.25), (1.5, 6.0), (3.25, 8.5), (4.5, 9.5)] {
            let (stop_m, _) = stop(&mut spans, depth, 100.0).unwrap();
            assert!((stop_m - wanted_m).abs() < 1e-12, "{depth}: {stop_m}");
        }
        assert_eq!(stop(&mut spans, 0.25, 100.0).unwrap().1, Medium::Grass);
        assert_eq!(stop(&mut spans, 7.5, 100.0), None);
        assert_eq!(stop(&mut spans, 0.25, 1.2), None);
        assert_eq!(stop(&mut [], 0.25, 1.2), None);
    }
}
