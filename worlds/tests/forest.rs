//! A forest: trees keep their distance, the trail stays clear, and one more tree moves none.

mod common;

use arborloop_base::{Class, Seed};
use arborloop_worlds::{ForestSpec, Planting, StandSpec, World, build, forest, measure, trunk_map};
use common::{bare, small_forest};
use nalgebra::Point2;

fn grown(spec: &ForestSpec) -> World {
    build(&bare(Planting::Forest(spec.clone())), Seed(1))
}

/// Distance from the trail by walking along it in steps of a centimeter: no formula.
fn from_trail_m(spec: &StandSpec, place: &Point2<f64>) -> f64 {
    let corners: Vec<Point2<f64>> = spec.trail_m.iter().map(|corner| Point2::from(*corner)).collect();
    let steps = corners.windows(2).flat_map(|pair| {
        let count = ((pair[1] - pair[0]).norm() / 0.01).ceil() as usize;
        (0..=count).map(move |step| pair[0] + (pair[1] - pair[0]) * (step as f64 / count as f64))
    });
    steps.map(|point| (point - place).norm()).fold(f64::MAX, f64::min)
}

#[test]
fn trees_keep_their_distance_from_each_other_and_from_the_trail() {
    let stand = StandSpec { trees: 300, ..ForestSpec::default().stand };
    for seed in 0..3 {
        let places: Vec<_> = forest::tree_places(&stand, Seed(seed)).into_iter().flatten().collect();
        assert!(places.len() > 200, "{} trees found room", places.len());
        for (index, place) in places.iter().enumerate() {
            assert!((place.x - stand.x_m).abs() <= stand.length_m / 2.0);
            assert!((place.y - stand.y_m).abs() <= stand.width_m / 2.0);
            assert!(from_trail_m(&stand, place) >= stand.trail_clearance_m - 0.005);
            let near = |other: &&Point2<f64>| (*other - place).norm() < stand.spacing_m_min;
            assert!(!places[..index].iter().any(|other| near(&other)), "seed {seed}: tree {index}");
        }
    }
}

#[test]
fn bushes_leave_the_trail_clear_to_their_very_leaves() {
    let mut spec = small_forest();
    spec.stand.trees = 0;
    spec.undergrowth.bushes = 60;
    let world = grown(&spec);
    assert!(world.crowns.len() > 50 && world.solids.is_empty());
    for plant in &world.plants {
        for leaf in &world.prototypes[plant.prototype].leaves {
            let place = (plant.world_from_plant * leaf.center).xy();
            assert!(from_trail_m(&spec.stand, &place) >= spec.stand.trail_clearance_m - 0.005);
        }
    }
    let found_per_m = measure::leaf_area_density(&measure::foliage(&world));
    let wanted_per_m = spec.undergrowth.leaf_area_per_m;
    assert!((found_per_m / wanted_per_m - 1.0).abs() < 0.1, "{found_per_m} m2/m3 of {wanted_per_m}");
}

#[test]
fn one_more_tree_or_bush_moves_none() {
    let mut spec = small_forest();
    spec.undergrowth.bushes = 20;
    let few = grown(&spec);
    spec.stand.trees += 1;
    spec.undergrowth.bushes += 1;
    let more = grown(&spec);
    for crown in &few.crowns {
        let same = more.crowns.iter().find(|other| other.instance == crown.instance);
        assert_eq!(Some(crown), same);
    }
    for solid in &few.solids {
        assert!(more.solids.contains(solid));
    }
}

#[test]
fn the_share_of_conifers_is_what_was_asked_for() {
    let mut spec = small_forest();
    spec.stand =
        StandSpec { trees: 400, conifer_ratio: 0.25, spacing_m_min: 0.1, trail_m: Vec::new(), ..spec.stand };
    spec.leaves.area_per_m = 0.0;
    let cones = |world: &World| {
        let cone = arborloop_worlds::CrownShape::Cone;
        world.crowns.iter().filter(|crown| crown.crown.shape == cone).count() as f64
    };
    let world = grown(&spec);
    assert_eq!(world.crowns.len(), 400);
    // Binomial, four standard deviations.
    assert!((cones(&world) - 100.0).abs() < 4.0 * (400.0_f64 * 0.25 * 0.75).sqrt(), "{}", cones(&world));
    spec.stand.conifer_ratio = 1.0;
    assert_eq!(cones(&grown(&spec)), 400.0);
}

#[test]
fn every_trunk_is_in_the_trunk_map_and_stems_are_bare_at_lidar_height() {
    let world = grown(&small_forest());
    assert_eq!(trunk_map(&world).len(), world.crowns.len());
    assert!(trunk_map(&world).iter().all(|trunk| trunk.class == Class::Trunk));
    for plant in &world.plants {
        let foot = plant.hinge.foot.z;
        let leaves = world.prototypes[plant.prototype].leaves.iter();
        let lowest = leaves.map(|leaf| (plant.world_from_plant * leaf.center).z).fold(f64::MAX, f64::min);
        assert!(lowest - foot > 1.0, "a crown hangs down to {} m", lowest - foot);
    }
}

#[test]
fn no_tree_one_tree_and_no_room_are_worlds_and_too_many_are_refused() {
    let mut spec = small_forest();
    for trees in [0, 1] {
        spec.stand.trees = trees;
        assert_eq!(grown(&spec).crowns.len(), trees);
    }
    let crowded = StandSpec { trees: 50, spacing_m_min: 40.0, ..spec.stand.clone() };
    let places = forest::tree_places(&crowded, Seed(1));
    assert_eq!(places.len(), 50);
    assert!(places.iter().flatten().count() <= 4, "four fit into 56 m x 43 m at the most");
    spec.stand.trees = 1_000_000;
    let error = bare(Planting::Forest(spec)).check().unwrap_err();
    assert_eq!(error.to_string(), "planting.stand.trees is 1000000, wanted 10000 at most");
}
