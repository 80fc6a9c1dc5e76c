//! The scenarios that come with the program: each world grows, and its route can be walked.

#![allow(clippy::unwrap_used)] // Everything here is a test.

use arborloop_base::{Seed, spatial};
use arborloop_sim::scenario::EMBEDDED;
use arborloop_sim::{Scenario, Simulator};
use arborloop_worlds::{World, build};
use nalgebra::{Point2, Point3};

/// A Go1 with a lidar on its back is lower than this, meters.
const ROBOT_M: f64 = 0.7;
/// Half a Go1's width and what its follower cuts corners by, meters.
const CLEARANCE_M: f64 = 0.4;

fn read(name: &str) -> Scenario {
    Scenario::read(&Scenario::embedded(name).unwrap()).unwrap()
}

/// The route's corners, world frame; the first again at the end of a closed one.
fn corners(scenario: &Scenario) -> Vec<Point2<f64>> {
    let world_from_start = spatial(&scenario.start.pose());
    let mut corners: Vec<Point2<f64>> = scenario
        .route
        .waypoints_m
        .iter()
        .map(|[x, y]| (world_from_start * Point3::new(*x, *y, 0.0)).xy())
        .collect();
    if scenario.route.closed {
        corners.push(corners[0]);
    }
    corners
}

fn from_route_m(corners: &[Point2<f64>], place: &Point2<f64>) -> f64 {
    let legs = corners.windows(2).map(|pair| {
        let leg = pair[1] - pair[0];
        let share = ((place - pair[0]).dot(&leg) / leg.norm_squared()).clamp(0.0, 1.0);
        (place - (pair[0] + leg * share)).norm()
    });
    legs.fold(f64::MAX, f64::min)
}

/// Least distance between the route and the surface of any solid that a robot is tall enough to touch, meters.
fn clearance_m(world: &World, corners: &[Point2<f64>]) -> f64 {
    let mut least_m = f64::MAX;
    for solid in &world.solids {
        for step in 0..=100 {
            let along_m = f64::from(step) / 100.0 * solid.shape.height_m;
            let center = solid.shape.center(along_m);
            if center.z - world.terrain.height_m(center.x, center.y) < ROBOT_M {
                let away_m = from_route_m(corners, &center.xy()) - solid.shape.radius_m(along_m);
                least_m = least_m.min(away_m);
            }
        }
    }
    least_m
}

#[test]
fn every_route_stays_clear_of_everything_that_a_robot_can_touch() {
    for (name, _) in EMBEDDED {
        let scenario = read(name);
        for seed in 1..=3 {
            let world = build(&scenario.world, Seed(seed));
            let least_m = clearance_m(&world, &corners(&scenario));
            assert!(
                least_m >= CLEARANCE_M,
                "{name} with seed {seed}: something stands {least_m} m from the route"
            );
            let bounds = world.terrain.bounds();
            assert!(
                corners(&scenario).iter().all(|corner| bounds.contains(corner)),
                "{name} leaves its ground"
            );
        }
    }
}

#[test]
fn routes_are_as_long_as_the_papers_and_can_be_walked_in_time() {
    for (name, wanted_m) in [
        ("cone-field-go1", 80.0),
        ("citrus-jackal", 865.33),
        ("vineyard-thorvald", 102.3),
        ("orchard-go1", 150.0),
    ] {
        let found_m = read(name).route.length_m();
        assert!((found_m / wanted_m - 1.0).abs() < 0.01, "{name}: {found_m} m, wanted {wanted_m} m");
    }
    for (name, _) in EMBEDDED {
        let scenario = read(name);
        let fastest_s = scenario.route.length_m() / scenario.follower.speed_mps;
        let least_s = scenario.run.stand_s + 1.3 * fastest_s + scenario.run.calm_s;
        assert!(scenario.run.duration_s_max >= least_s, "{name}: {fastest_s} s at full speed");
    }
}

#[test]
fn a_robot_stands_free_among_trunks_posts_and_wires() {
    for name in ["vineyard-thorvald", "orchard-go1", "forest-go1"] {
        let mut simulator = Simulator::new(&read(name), Seed(1));
        for _ in 0..50 {
            simulator.step();
        }
        assert!(simulator.truth().contacts.is_empty(), "{name}: {:?}", simulator.truth().contacts);
    }
}
