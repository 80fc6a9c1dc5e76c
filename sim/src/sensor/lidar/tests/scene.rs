//! Small worlds of plates and leaves before a lidar that stands still, two meters above level ground.

use super::super::*;
use crate::document::Document;
use arborloop_base::{Class, Seed};
use arborloop_worlds::{
    Frustum, GrassSpec, Hinge, Leaf, Plant, Planting, Prototype, Solid, SurroundingsSpec, TerrainSpec, Wind,
    WindSpec, World, WorldSpec, build,
};
use nalgebra::{Similarity3, Unit, Vector3};

pub(super) const HEIGHT_M: f64 = 2.0;

/// One level beam that looks straight ahead in column 1800, without noise.
const MODEL: &str = r#"
name = "probe"
wire = "plain"
wavelength_nm = 905.0
returns = ["strongest", "first", "last", "dual"]
[turn]
rate_hz = 10.0
columns = 3600
modes = ["3600x10"]
[beams]
elevation_deg = [0.0]
[pulse]
divergence_mrad = [10.0, 10.0]
edge_ratio = 0.1353352832366127
length_m = 1.0
[range]
range_m_min = 0.4
range_m_max = 100.0
reach_m = 40.0
range_noise_m = 0.0
"#;

pub(super) fn probe(change: impl Fn(&mut LidarSpec)) -> Lidar {
    let mut spec = LidarSpec { dropout_ratio: 0.0, ..LidarSpec::of(model(MODEL).unwrap()) };
    change(&mut spec);
    let period = Span::from_seconds(1.0 / spec.rate_hz);
    Lidar::new(&spec, period, Pose::translation(0.0, 0.0, HEIGHT_M), Seed(3).stream("lidar"))
}

pub(super) fn model(text: &str) -> Result<LidarModel, crate::document::Refusal> {
    LidarModel::read(&Document::new("probe.toml", text))
}

pub(super) fn probe_text(line: &str, instead: &str) -> String {
    assert!(MODEL.contains(line), "{line}");
    MODEL.replace(line, instead)
}

pub(super) fn spec() -> WorldSpec {
    WorldSpec {
        terrain: TerrainSpec { relief_m: 0.0, bump_m: 0.0, slope_deg: 0.0, ..TerrainSpec::default() },
        grass: GrassSpec { height_m: 0.0, ..GrassSpec::default() },
        planting: Planting::None,
        surroundings: SurroundingsSpec { trees: 0, bushes: 0, ..SurroundingsSpec::default() },
        wind: WindSpec::default(),
    }
}

/// A disc that faces the lidar, turned by an angle about the vertical.
pub(super) fn plate(x_m: f64, y_m: f64, radius_m: f64, reflectivity_ratio: f64, turned_rad: f64) -> Solid {
    let axis = Unit::new_normalize(Vector3::new(turned_rad.cos(), turned_rad.sin(), 0.0));
    let base = nalgebra::Point3::new(x_m, y_m, HEIGHT_M);
    let shape = Frustum { base, axis, height_m: 0.001, radius_base_m: radius_m, radius_top_m: radius_m };
    Solid { class: Class::Post, instance: x_m.round() as u32, shape, reflectivity_ratio }
}

/// A leaf of a square meter across the beam.
pub(super) fn leaf(x_m: f64) -> Leaf {
    Leaf {
        center: nalgebra::Point3::new(x_m, 0.0, HEIGHT_M),
        half_u: Vector3::new(0.0, 0.5, 0.0),
        half_v: Vector3::new(0.0, 0.0, 0.5),
    }
}

pub(super) fn optics(solids: Vec<Solid>, leaves: Vec<Leaf>) -> Optics {
    let mut world = build(&spec(), Seed(1));
    world.solids.extend(solids);
    if !leaves.is_empty() {
        let origin = std::iter::once((0.0, 0.0));
        plant(&mut world, Prototype { leaves, ..bare_prototype() }, origin);
    }
    Optics::new(&world)
}

/// A plant without leaves.
pub(super) fn bare_prototype() -> Prototype {
    Prototype {
        leaves: Vec::new(),
        haze: Vec::new(),
        branches: Vec::new(),
        leaf_reflectivity_ratio: 0.5,
        bark_reflectivity_ratio: 0.3,
    }
}

/// One plant at the origin.
pub(super) fn grown(prototype: Prototype) -> Optics {
    planted(prototype, std::iter::once((0.0, 0.0)))
}

/// The same plant at many places, x and y in meters.
pub(super) fn planted(prototype: Prototype, places_m: impl Iterator<Item = (f64, f64)>) -> Optics {
    let mut world = build(&spec(), Seed(1));
    plant(&mut world, prototype, places_m);
    Optics::new(&world)
}

fn plant(world: &mut World, prototype: Prototype, places_m: impl Iterator<Item = (f64, f64)>) {
    world.prototypes.push(prototype);
    for (x_m, y_m) in places_m {
        let foot = nalgebra::Point3::new(x_m, y_m, 0.0);
        let world_from_plant = Similarity3::from_parts(foot.coords.into(), UnitQuaternion::identity(), 1.0);
        world.plants.push(Plant {
            prototype: world.prototypes.len() - 1,
            world_from_plant,
            instance: world.plants.len() as u32 + 1,
            hinge: Hinge { foot, height_m: 3.0, fork: foot, reach_m: 3.0 },
        });
    }
    world.wind = Wind::new(&WindSpec::default(), &world.plants, Seed(1));
}

/// A VLP-16 that sees every leaf, exactly.
pub(super) fn keen(sub_rays: u32, returns: EchoChoice, seed: u64) -> Lidar {
    let spec = LidarSpec {
        sub_rays,
        returns,
        reach_m: 1e6,
        range_noise_m: 0.0,
        dropout_ratio: 0.0,
        ..LidarSpec::default()
    };
    let mount = Pose::translation(0.0, 0.0, HEIGHT_M);
    Lidar::new(&spec, Span::from_millis(100), mount, Seed(seed).stream("lidar"))
}

/// A body that does not move.
pub(super) fn standing() -> Motion {
    let tick = Span::from_millis(1);
    let mut motion = Motion::new(Time::SIMULATION_START, Pose::identity(), tick, Span::from_millis(400));
    (0..350).for_each(|_| motion.push(Pose::identity()));
    motion
}

/// The sweep that ends a tenth of a second after the beginning.
pub(super) fn first_sweep(lidar: &mut Lidar, optics: &Optics) -> (Sweep, Vec<Label>) {
    let motion = standing();
    let end = Time::SIMULATION_START + lidar.period();
    lidar.sweep(end, Surroundings { motion: &motion, optics })
}

/// What the beam straight ahead returned.
pub(super) fn ahead(lidar: &mut Lidar, optics: &Optics) -> Vec<(arborloop_base::Return, Label)> {
    let (sweep, labels) = first_sweep(lidar, optics);
    let straight = sweep.returns.into_iter().zip(labels);
    straight.filter(|(one, _)| one.fired_after == Span::from_millis(50)).collect()
}
