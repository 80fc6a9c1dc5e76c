//! Worlds held against what their specs promise: geometry, addressed chance, laws of their random parts.

use arborloop_base::{Class, Seed};
use arborloop_worlds::{
    ConesSpec, GrassSpec, Planting, Solid, SurroundingsSpec, Terrain, TerrainSpec, WindSpec, World,
    WorldSpec, build, cones, trunk_map,
};
use nalgebra::{Point2, Point3};
use std::f64::consts::PI;

fn solids_of(world: &World, class: Class) -> Vec<Solid> {
    world.solids.iter().copied().filter(|solid| solid.class == class).collect()
}

/// A world whose terrain and leaves cost nothing.
fn bare(planting: Planting) -> WorldSpec {
    WorldSpec {
        terrain: TerrainSpec { extent_m: 40.0, cell_m: 1.0, ..TerrainSpec::default() },
        grass: GrassSpec { height_m: 0.0, ..GrassSpec::default() },
        planting,
        surroundings: SurroundingsSpec { trees: 0, bushes: 0, ..SurroundingsSpec::default() },
        wind: WindSpec::default(),
    }
}

/// Distance from the rectangle's outline, positive outside.
fn outside_m(field: &ConesSpec, place: &Point2<f64>) -> f64 {
    let beyond = |value: f64, most: f64| (value - most / 2.0).abs() - most / 2.0;
    let (x, y) = (beyond(place.x, field.length_m), beyond(place.y, field.width_m));
    if x > 0.0 || y > 0.0 { x.max(0.0).hypot(y.max(0.0)) } else { x.max(y) }
}

#[test]
fn cones_stand_on_the_ground_around_the_rectangle_and_apart() {
    let field = ConesSpec::default();
    for seed in 0..50 {
        let places = cones::places(&field, Seed(seed));
        assert_eq!(places.len(), 12);
        for (index, place) in places.iter().enumerate() {
            let reach_m = 2_f64.sqrt() * field.jitter_m + 1e-9;
            assert!(
                (outside_m(&field, place) - field.clearance_m).abs() <= reach_m,
                "cone {index} at {place}"
            );
            for other in &places[..index] {
                assert!(
                    (place - other).norm() > 2.0 * field.plate_radius_m,
                    "seed {seed}: two cones in one place"
                );
            }
        }
    }
    let world = build(&WorldSpec::default(), Seed(3));
    for cone in solids_of(&world, Class::Cone).iter().filter(|solid| solid.shape.radius_base_m == 0.19) {
        let base = cone.shape.base;
        assert!((base.z - world.terrain.height_m(base.x, base.y)).abs() < 1e-12);
    }
    let heights: f64 = solids_of(&world, Class::Cone).iter().map(|solid| solid.shape.height_m).sum();
    assert!((heights / 12.0 - 0.72).abs() < 1e-9);
}

#[test]
fn cones_without_jitter_stand_exactly_on_the_ring() {
    let field = ConesSpec { jitter_m: 0.0, count: 400, ..ConesSpec::default() };
    let places = cones::places(&field, Seed(1));
    for place in &places {
        assert!((outside_m(&field, place) - field.clearance_m).abs() < 1e-9);
    }
    // All around, on every side and corner: no gap is wider than the spacing and both its variations.
    let ring_m = 2.0 * (field.length_m + field.width_m) + 2.0 * PI * field.clearance_m;
    let most_m = ring_m / 400.0 * (1.0 + 2.0 * field.spacing_variation_ratio) + 1e-9;
    for (index, place) in places.iter().enumerate() {
        let next = &places[(index + 1) % places.len()];
        assert!((next - place).norm() <= most_m, "gap after cone {index}");
    }
}

#[test]
fn a_field_without_cones_is_a_valid_empty_world() {
    let world = build(&bare(Planting::Cones(ConesSpec { count: 0, ..ConesSpec::default() })), Seed(1));
    assert!(world.solids.is_empty() && world.plants.is_empty() && world.prototypes.is_empty());
    assert!(trunk_map(&world).is_empty());
    assert!(build(&bare(Planting::None), Seed(1)).solids.is_empty());
}

#[test]
fn one_more_tree_or_bush_moves_nothing_else() {
    let spec = |trees, bushes| WorldSpec {
        surroundings: SurroundingsSpec {
            trees,
            bushes,
            leaf_area_per_m: 0.05,
            ..SurroundingsSpec::default()
        },
        ..WorldSpec::default()
    };
    let (before, after) = (build(&spec(5, 4), Seed(8)), build(&spec(6, 5), Seed(8)));
    assert_eq!(before.terrain, after.terrain);
    assert_eq!(before.grass, after.grass);
    assert_eq!(solids_of(&before, Class::Cone), solids_of(&after, Class::Cone));
    assert_eq!(solids_of(&before, Class::Trunk), solids_of(&after, Class::Trunk)[..5]);
    assert_eq!(before.plants[..5], after.plants[..5]);
    let bushes = |world: &World, trees: usize| -> Vec<_> {
        world.plants[trees..].iter().take(4).map(|plant| plant.world_from_plant).collect()
    };
    assert_eq!(bushes(&before, 5), bushes(&after, 6));
}

#[test]
fn a_world_is_its_spec_and_its_seed() {
    let spec = WorldSpec::default();
    assert_eq!(build(&spec, Seed(5)), build(&spec, Seed(5)));
    assert_ne!(build(&spec, Seed(5)).solids, build(&spec, Seed(6)).solids);
}

#[test]
fn surroundings_stand_in_their_ring_with_trunk_and_crown_together() {
    let spec = WorldSpec::default();
    let world = build(&spec, Seed(2));
    assert_eq!(
        (world.plants.len(), solids_of(&world, Class::Trunk).len(), world.prototypes.len()),
        (9, 5, 5)
    );
    for plant in &world.plants {
        let foot = plant.world_from_plant * Point3::origin();
        let distance_m = (foot.xy() - Point2::new(3.0, 1.0)).norm();
        assert!((12.0..=28.0).contains(&distance_m));
        assert!((foot.z - world.terrain.height_m(foot.x, foot.y)).abs() < 1e-9);
    }
    for (trunk, plant) in solids_of(&world, Class::Trunk).iter().zip(&world.plants) {
        assert_eq!(trunk.instance, plant.instance);
        let foot = plant.world_from_plant * Point3::origin();
        assert!((trunk.shape.base.xy() - foot.xy()).norm() < 1e-9);
    }
    for prototype in &world.prototypes[..3] {
        assert!((2000..4000).contains(&prototype.leaves.len()), "{} leaves", prototype.leaves.len());
    }
    let lowest = world.prototypes.iter().flat_map(|p| &p.leaves).flat_map(|leaf| leaf.corners()).map(|c| c.z);
    assert!(lowest.fold(f64::MAX, f64::min) > 0.0, "a leaf grows into the ground");
}

#[test]
fn a_crown_dims_light_as_its_leaf_area_says() {
    let spec = SurroundingsSpec { leaf_area_per_m: 2.0, ..SurroundingsSpec::default() };
    let world = build(&WorldSpec { surroundings: spec.clone(), ..WorldSpec::default() }, Seed(4));
    let leaves = &world.prototypes[0].leaves;
    // Upright ellipsoid of the tree: center 0.6, half height 0.4, radius 0.31 of the height.
    let (middle, half_m, radius_m) =
        (0.6 * spec.tree_height_m, 0.4 * spec.tree_height_m, 0.31 * spec.tree_height_m);
    let volume_m3 = 4.0 / 3.0 * PI * radius_m * radius_m * half_m;
    let area_m2: f64 = leaves.iter().map(|leaf| leaf.area_m2()).sum();
    // A leaf's area varies by 13 %: over thousands of leaves the sum is within a percent.
    assert!((area_m2 / volume_m3 / 2.0 - 1.0).abs() < 0.01, "{} m2/m3", area_m2 / volume_m3);

    // Level rays through the crown's core: the leaves met per meter are half the leaf area density (spherical law).
    let (mut met, mut length_m, mut rays) = (0_usize, 0.0, 0);
    for n in 0..40 {
        for m in 0..40 {
            let across = (n as f64 / 39.0 - 0.5) * radius_m;
            let up = (m as f64 / 39.0 - 0.5) * half_m;
            let inside = 1.0 - (across / radius_m).powi(2) - (up / half_m).powi(2);
            // Leaves keep half their diagonal from the crown's edge: stay as far away from it.
            let chord_m = 2.0 * (radius_m * inside.sqrt() - 0.15);
            length_m += chord_m;
            rays += 1;
            let hit = |leaf: &&arborloop_worlds::Leaf| {
                let normal = leaf.half_u.cross(&leaf.half_v);
                let from = Point3::new(0.0, across, middle + up);
                let along = (leaf.center - from).dot(&normal) / normal.x;
                let offset = from + nalgebra::Vector3::x() * along - leaf.center;
                let within = |half: &nalgebra::Vector3<f64>| offset.dot(half).abs() <= half.norm_squared();
                along.abs() < chord_m / 2.0 && within(&leaf.half_u) && within(&leaf.half_v)
            };
            met += leaves.iter().filter(hit).count();
        }
    }
    let per_m = met as f64 / length_m;
    // Pulling leaves inward by half a diagonal packs the core denser by the volumes' ratio.
    let pulled = |size: f64| 1.0 - spec.leaf_size_m * 0.5 * 2_f64.sqrt() / size;
    let expected = 0.5 * 2.0 / (pulled(radius_m).powi(2) * pulled(half_m));
    // Neighboring rays share leaves: the independent samples are the leaves met, about each ten times.
    let error = 4.0 * (10.0 / met as f64).sqrt();
    assert!(
        (per_m / expected - 1.0).abs() < error,
        "{per_m} leaves per meter, wanted {expected} ({rays} rays)"
    );
}

#[test]
fn the_ground_is_its_triangles() {
    let terrain = build(&WorldSpec::default(), Seed(1)).terrain;
    let grid = terrain.grid();
    for (column, row, u, v) in
        [(3, 4, 0.25, 0.75), (100, 230, 0.9, 0.1), (239, 240, 0.5, 0.5), (0, 0, 0.0, 0.3)]
    {
        let node = |c: usize, r: usize| terrain.node(column + c, row + r).unwrap().coords;
        let corners =
            if u >= v { [node(0, 0), node(1, 0), node(1, 1)] } else { [node(0, 0), node(0, 1), node(1, 1)] };
        // Barycentric: from (0, 0) the longer of u and v is walked first, the rest along the diagonal.
        let (long, short) = (f64::max(u, v), f64::min(u, v));
        let point = corners[0] * (1.0 - long) + corners[1] * (long - short) + corners[2] * short;
        assert!((terrain.height_m(point.x, point.y) - point.z).abs() < 1e-12);
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
        assert!((terrain.normal(point.x + 1e-9, point.y).dot(&normal).abs() - 1.0).abs() < 1e-9);
    }
    assert_eq!(terrain.height_m(0.0, 0.0), 0.0);
    assert!(
        terrain.bounds().low == Point2::new(-60.0, -60.0) && terrain.bounds().high == Point2::new(60.0, 60.0)
    );
    assert_eq!(grid.columns(), 481);
}

#[test]
fn outside_its_extent_the_ground_goes_on_level() {
    let terrain = build(&WorldSpec::default(), Seed(1)).terrain;
    assert_eq!(terrain.height_m(1e6, 3.0), terrain.height_m(60.0, 3.0));
    assert_eq!(terrain.height_m(f64::NEG_INFINITY, -1e9), terrain.height_m(-60.0, -60.0));
    assert_eq!(terrain.normal(-70.0, 70.0), nalgebra::Vector3::z_axis());
    assert!(terrain.height_m(f64::NAN, 0.0).is_nan());
}

#[test]
fn a_slope_falls_toward_its_bearing() {
    let spec = TerrainSpec {
        relief_m: 0.0,
        bump_m: 0.0,
        slope_deg: 5.0,
        slope_toward_deg: 90.0,
        ..TerrainSpec::default()
    };
    let terrain = build(&WorldSpec { terrain: spec, ..WorldSpec::default() }, Seed(1)).terrain;
    let fall = 5_f64.to_radians().tan();
    assert!((terrain.height_m(7.0, 10.0) + 10.0 * fall).abs() < 1e-9);
    assert!((terrain.normal(3.3, -4.4).angle(&nalgebra::Vector3::z_axis()).to_degrees() - 5.0).abs() < 1e-9);
}

#[test]
fn relief_is_as_mild_as_an_orchard_floor() {
    for seed in 0..5 {
        let terrain = build(&bare_with_relief(), Seed(seed)).terrain;
        let (low, high) = terrain.height_range_m();
        assert!((0.1..1.2).contains(&(high - low)), "seed {seed}: {low} to {high} m");
        // The path itself: slopes that a blind trot with 8 cm swing clears.
        for n in 0..60 {
            let tilt =
                terrain.normal(0.1 * f64::from(n), 1.0).angle(&nalgebra::Vector3::z_axis()).to_degrees();
            assert!(tilt < 10.0, "seed {seed}: {tilt} degrees");
        }
    }
}

fn bare_with_relief() -> WorldSpec {
    WorldSpec { terrain: TerrainSpec::default(), ..bare(Planting::None) }
}

#[test]
fn grass_is_uneven_around_its_mean_and_off_at_zero() {
    let world = build(&WorldSpec::default(), Seed(6));
    let heights = world.grass.grid().cells();
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    assert!((mean / 0.05 - 1.0).abs() < 0.05, "mean height {mean} m");
    assert!(heights.iter().all(|height| (0.0..=0.1).contains(height)));
    assert!(world.grass.height_m_max() > 0.06);
    let mown = build(&bare(Planting::None), Seed(6)).grass;
    assert_eq!((mown.height_m_max(), mown.height_m(1.0, 2.0)), (0.0, 0.0));
}

#[test]
fn the_trunk_map_measures_each_upright_thing_once() {
    let world = build(&WorldSpec::default(), Seed(9));
    let map = trunk_map(&world);
    assert_eq!(map.len(), 12 + 5);
    for truth in &map {
        let level = world.terrain.height_m(truth.x_m, truth.y_m) + 0.3;
        let inside = |share: f64| {
            let point = Point3::new(truth.x_m + share * truth.radius_m, truth.y_m, level);
            let of_it = |solid: &&Solid| solid.class == truth.class && solid.instance == truth.instance;
            world.solids.iter().filter(of_it).any(|solid| solid.shape.contains(&point))
        };
        // Slopes of a few degrees move the section by a millimeter or two.
        assert!(inside(0.0) && inside(0.95) && !inside(1.05), "{truth:?}");
    }
    // Body from radius 0.13 at 0.035 m to 0.03 at 0.72 m.
    let expected = 0.13 - 0.10 * (0.3 - 0.035) / 0.685;
    assert!(map.iter().filter(|t| t.class == Class::Cone).all(|t| (t.radius_m - expected).abs() < 0.002));
}

#[test]
fn level_terrain_is_level() {
    let terrain = Terrain::level(10.0, 0.5);
    assert_eq!(terrain.height_range_m(), (0.0, 0.0));
    assert_eq!(terrain.normal(1.2, 3.4), nalgebra::Vector3::z_axis());
}
