use super::*;
use arborloop_base::Seed;
use arborloop_worlds::{
    Frustum, GrassSpec, Leaf, Plant as WorldPlant, Planting, Solid as WorldSolid, SurroundingsSpec,
    TerrainSpec, WindSpec, WorldSpec, build,
};
use nalgebra::{Unit, UnitQuaternion};

fn bare() -> WorldSpec {
    WorldSpec {
        terrain: TerrainSpec { relief_m: 0.0, bump_m: 0.0, slope_deg: 0.0, ..TerrainSpec::default() },
        grass: GrassSpec { height_m: 0.0, ..GrassSpec::default() },
        planting: Planting::None,
        surroundings: SurroundingsSpec { trees: 0, bushes: 0, ..SurroundingsSpec::default() },
        wind: WindSpec::default(),
    }
}

fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
    along(Point3::from(origin), Vector3::from(direction).normalize(), 100.0)
}

/// A ray that gets through all grass.
fn along(origin: Point3<f64>, direction: Vector3<f64>, range_m_max: f64) -> Ray {
    let stamp = Time::SIMULATION_START;
    Ray { stamp, origin, direction, range_m_min: 0.0, range_m_max, depth: Depth::ENDLESS }
}

/// Rays from one place in every direction, by the golden spiral.
fn all_around(count: usize) -> impl Iterator<Item = Vector3<f64>> {
    (0..count).map(move |n| {
        let z = 1.0 - 2.0 * (n as f64 + 0.5) / count as f64;
        let turn = n as f64 * 2.399_963_229_728_653;
        Vector3::new((1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z)
    })
}

#[test]
fn level_ground_is_met_where_geometry_says() {
    let optics = Optics::new(&build(&bare(), Seed(1)));
    for (down, bearing) in [(1.0_f64, 0.3_f64), (3.0, 2.0), (15.0, -1.0), (89.0, 0.0), (90.0, 0.0)] {
        let (sin, cos) = down.to_radians().sin_cos();
        let beam = ray([0.3, -0.2, 0.45], [cos * bearing.cos(), cos * bearing.sin(), -sin]);
        let hit = optics.cast(&beam).unwrap();
        assert!((hit.range_m - 0.45 / sin).abs() < 1e-9, "{down} deg: {}", hit.range_m);
        assert_eq!(hit.class, Class::Ground);
        assert!((hit.cos_incidence - sin).abs() < 1e-9);
    }
    assert_eq!(optics.cast(&ray([0.0, 0.0, 0.45], [1.0, 0.0, 0.01])), None);
}

#[test]
fn uneven_ground_is_met_on_its_own_surface() {
    let spec = WorldSpec { terrain: TerrainSpec { relief_m: 0.5, ..TerrainSpec::default() }, ..bare() };
    let world = build(&spec, Seed(5));
    let optics = Optics::new(&world);
    let origin = Point3::new(0.7, 1.3, world.terrain.height_m(0.7, 1.3) + 0.45);
    let mut met = 0;
    for direction in all_around(4000) {
        let beam = along(origin, direction, 100.0);
        let reach = |range: f64| {
            let point = origin + direction * range;
            point.z - world.terrain.height_m(point.x, point.y)
        };
        match optics.cast(&beam) {
            Some(hit) => {
                met += 1;
                assert!(reach(hit.range_m).abs() < 1e-7, "off the surface by {}", reach(hit.range_m));
                // The slow twin walks in steps: nowhere before the hit is the beam under ground.
                let first =
                    (0..2000).map(|n| hit.range_m * 0.9995 * f64::from(n) / 2000.0).find(|&r| reach(r) < 0.0);
                assert_eq!(first, None);
            }
            None => {
                let over_terrain =
                    |range: f64| world.terrain.bounds().contains(&(origin + direction * range).xy());
                let ranges = (0..4000).map(|n| f64::from(n) * 0.02);
                assert!(ranges.take_while(|&range| over_terrain(range)).all(|range| reach(range) > 0.0));
            }
        }
    }
    assert!(met > 1900);
}

#[test]
fn grass_lets_light_through_as_beer_and_lambert_say() {
    let (height, density) = (0.05, 8.0);
    let grass = GrassSpec {
        height_m: height,
        density_per_m: density,
        height_variation_ratio: 0.0,
        ..GrassSpec::default()
    };
    let optics = Optics::new(&build(&WorldSpec { grass, ..bare() }, Seed(1)));
    let sin = 10.0_f64.to_radians().sin();
    let beam = ray([0.0, 0.0, 0.45], [10.0_f64.to_radians().cos(), 0.0, -sin]);
    let stream = Seed(9).stream("blades");
    let count = 20_000;
    let through = (0..count)
        .filter(|&n| {
            let hit = optics.cast(&Ray { depth: Depth::drawn(&mut stream.at(n)), ..beam }).unwrap();
            assert!(hit.range_m >= (0.45 - height) / sin - 1e-9 && hit.range_m <= 0.45 / sin + 1e-9);
            hit.class == Class::Ground
        })
        .count();
    let law = (-density * height / sin).exp();
    let sigma = (law * (1.0 - law) / count as f64).sqrt();
    assert!((through as f64 / count as f64 - law).abs() < 4.0 * sigma);
}

#[test]
fn a_frustum_is_met_where_sampling_finds_its_surface() {
    let shape = Frustum {
        base: Point3::new(2.0, 0.5, 0.2),
        axis: Unit::new_normalize(Vector3::new(0.3, -0.2, 1.0)),
        height_m: 0.8,
        radius_base_m: 0.3,
        radius_top_m: 0.05,
    };
    let origin = Point3::new(0.0, 0.0, 0.5);
    let mut met = 0;
    for direction in all_around(20_000) {
        let inside = |range: f64| shape.contains(&(origin + direction * range));
        let sampled = (0..6000).map(|n| f64::from(n) * 5e-4).find(|&range| inside(range));
        match (surface::cross_frustum(&shape, &origin, &direction, 100.0), sampled) {
            (Some(crossing), Some(sampled)) => {
                met += 1;
                assert!(
                    (0.0..=5.1e-4).contains(&(sampled - crossing.range_m)),
                    "{} {sampled}",
                    crossing.range_m
                );
            }
            // Sampling steps over a corner that the beam only grazes.
            (Some(crossing), None) => assert!(!inside(crossing.range_m + 5e-4)),
            (None, sampled) => assert_eq!(sampled, None),
        }
    }
    assert!(met > 100);
}

#[test]
fn a_crowded_world_is_met_as_a_search_through_every_surface_says() {
    let spec =
        WorldSpec { surroundings: SurroundingsSpec::default(), planting: Planting::default(), ..bare() };
    let world = build(&spec, Seed(3));
    assert!(!world.plants.is_empty() && !world.solids.is_empty());
    let optics = Optics::new(&world);
    let origin = Point3::new(1.0, 0.5, 0.45);
    let mut met_leaves = 0;
    for direction in all_around(6000) {
        let beam = along(origin, direction, 60.0);
        let solids = world
            .solids
            .iter()
            .filter_map(|WorldSolid { shape, .. }| surface::cross_frustum(shape, &origin, &direction, 60.0));
        let plants = world.plants.iter().flat_map(|WorldPlant { prototype, world_from_plant, .. }| {
            let prototype = &world.prototypes[*prototype];
            let leaves = prototype.leaves.iter().filter_map(|leaf| {
                surface::cross_leaf(&leaf.transformed(world_from_plant), &origin, &direction, 60.0)
            });
            let branches = prototype.branches.iter().filter_map(|branch| {
                surface::cross_frustum(&branch.transformed(world_from_plant), &origin, &direction, 60.0)
            });
            leaves.chain(branches).collect::<Vec<_>>()
        });
        let ground = (direction.z < 0.0).then(|| -origin.z / direction.z).filter(|range| *range < 60.0);
        let slow = solids.chain(plants).map(|crossing| crossing.range_m).chain(ground).reduce(f64::min);
        let fast = optics.cast(&beam);
        met_leaves += usize::from(fast.is_some_and(|hit| hit.class == Class::Leaf));
        match (fast, slow) {
            (Some(fast), Some(slow)) => {
                assert!((fast.range_m - slow).abs() < 1e-6, "{} {slow}", fast.range_m)
            }
            (fast, slow) => assert_eq!(fast.map(|hit| hit.range_m), slow),
        }
    }
    assert!(met_leaves > 20, "only {met_leaves} leaves met");
}

#[test]
fn a_leaf_is_seen_from_both_sides_and_missed_beside_its_edge() {
    let leaf = Leaf {
        center: Point3::new(1.0, 0.0, 0.0),
        half_u: UnitQuaternion::from_euler_angles(0.0, 0.0, 0.4) * Vector3::new(0.0, 0.04, 0.0),
        half_v: Vector3::new(0.0, 0.0, 0.05),
    };
    for from in [-1.0, 3.0] {
        let hit = surface::cross_leaf(
            &leaf,
            &Point3::new(from, 0.0, 0.0),
            &Vector3::new((1.0 - from) / 2.0, 0.0, 0.0),
            10.0,
        );
        assert!((hit.unwrap().range_m - 2.0).abs() < 1e-12);
    }
    let beside = Point3::new(-1.0, 0.0, 0.0501);
    assert_eq!(surface::cross_leaf(&leaf, &beside, &Vector3::x(), 10.0), None);
}
