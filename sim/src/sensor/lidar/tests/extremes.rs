//! Much, little and nothing before the lidar, or all around it.

use super::super::*;
use super::scene::*;
use arborloop_base::vlp16::{ELEVATION_DEG, OFFSET_M, laser_of};
use arborloop_base::{Class, Return, Seed};
use arborloop_worlds::{Frustum, Leaf, Prototype, Solid};
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

#[test]
fn one_leaf_is_met_by_exactly_the_firings_that_geometry_names() {
    let leaf = leaf(6.0);
    let optics = grown(Prototype { leaves: vec![leaf], ..bare_prototype() });
    let (sweep, labels) = first_sweep(&mut keen(1, EchoChoice::Strongest, 2), &optics);
    let (mut met, mut grazed) = (0, 0);
    for (one, label) in sweep.returns.iter().zip(&labels) {
        let laser = laser_of(one.ring);
        let (up, height_m) = (ELEVATION_DEG[laser].to_radians(), OFFSET_M[laser]);
        // The head turns clockwise from straight behind, evenly.
        let turned = (sweep.start + one.fired_after - Time::SIMULATION_START).seconds() / 0.1;
        let azimuth_rad = std::f64::consts::PI - TAU * turned;
        let along_m = 6.0 / azimuth_rad.cos();
        let (y_m, z_m) = (6.0 * azimuth_rad.tan(), height_m + along_m * up.tan());
        let inside_m = (0.5 - y_m.abs()).min(0.5 - z_m.abs());
        if azimuth_rad.cos() <= 0.0 || inside_m < -1e-5 {
            assert_ne!(label.class, Class::Leaf, "{one:?}");
        } else if inside_m > 1e-5 {
            assert_eq!((label.class, label.instance), (Class::Leaf, 1), "{one:?}");
            met += 1;
        } else {
            grazed += 1;
        }
    }
    assert!(met > 100 && grazed < 5, "{met} met, {grazed} at the edge");
}

#[test]
fn without_a_tree_nothing_is_met_above_the_horizon_and_level_ground_below() {
    let (sweep, labels) =
        first_sweep(&mut keen(5, EchoChoice::Strongest, 2), &optics(Vec::new(), Vec::new()));
    for (one, label) in sweep.returns.iter().zip(&labels) {
        let up_rad = ELEVATION_DEG[laser_of(one.ring)].to_radians();
        match one.point() {
            Some(point) => {
                assert!(up_rad < 0.0 && label.class == Class::Ground && (point.z + HEIGHT_M).abs() < 0.02)
            }
            None => assert_eq!(label.class, Class::Sky),
        }
        assert_eq!(one.range_m.is_none(), up_rad > 0.0 || label.class == Class::Sky);
    }
}

#[test]
fn ten_million_leaves_of_shared_prototypes_fit_into_memory_and_one_sweep() {
    let stream = Seed(9).stream("test/crowd");
    let leaves: Vec<Leaf> = (0..2000)
        .map(|index| {
            let mut draws = stream.at(index);
            let mut within = |half: f64| draws.within(-half, half);
            let center = Point3::new(within(1.0), within(1.0), 2.0 + within(1.0));
            Leaf { center, half_u: Vector3::new(0.0, 0.03, 0.0), half_v: Vector3::new(0.02, 0.0, 0.02) }
        })
        .collect();
    let places = (0..5000).map(|n| {
        let (row, place) = (n / 100, n % 100);
        (4.0 + f64::from(row) * 1.5, 1.5 * (f64::from(place) - 49.5))
    });
    let optics = planted(Prototype { leaves, ..bare_prototype() }, places);
    assert!(optics.bytes() < 30_000_000, "{} bytes", optics.bytes());
    let (sweep, labels) = first_sweep(&mut keen(1, EchoChoice::Strongest, 2), &optics);
    let mut leafy = 0;
    for (one, label) in sweep.returns.iter().zip(&labels).filter(|(_, label)| label.class == Class::Leaf) {
        // Every leaf hangs within a meter of its plant, of which there are none behind the lidar.
        let point = one.point().unwrap();
        assert!(point.x > 2.9 && point.x < 80.0 && point.z.abs() < 1.03, "{point}");
        assert!((1..=5000).contains(&label.instance));
        leafy += 1;
    }
    assert!(leafy > 3000, "{leafy}");
}

/// An upright trunk around a place, from the ground to three meters.
fn trunk(x_m: f64, y_m: f64, radius_m: f64) -> Solid {
    let base = Point3::new(x_m, y_m, 0.0);
    let shape = Frustum {
        base,
        axis: Vector3::z_axis(),
        height_m: 3.0,
        radius_base_m: radius_m,
        radius_top_m: radius_m,
    };
    Solid { class: Class::Trunk, instance: 5, shape, reflectivity_ratio: 0.3 }
}

#[test]
fn a_lidar_inside_a_trunk_sees_its_bark_all_around_or_nothing_when_that_is_too_near() {
    for (radius_m, seen) in [(0.6, true), (0.2, false)] {
        let scene = optics(vec![trunk(0.1, 0.0, radius_m)], Vec::new());
        let (sweep, labels) = first_sweep(&mut keen(5, EchoChoice::Strongest, 1), &scene);
        assert!(sweep.returns.len() > 28_000);
        for (one, label) in sweep.returns.iter().zip(&labels) {
            assert_eq!((label.class, label.instance), (Class::Trunk, 5));
            // The beam from the lidar, off the trunk's middle, to the bark.
            let (sin, cos) = one.azimuth_rad.sin_cos();
            let flat_m = 0.1 * cos + (radius_m * radius_m - (0.1 * sin).powi(2)).sqrt();
            let up = ELEVATION_DEG[laser_of(one.ring)].to_radians();
            let along_m = flat_m / up.cos();
            assert!((f64::from(label.range_m) - along_m).abs() < 1e-3, "{one:?} {label:?}, wanted {along_m}");
            match one.point() {
                Some(point) => assert!(along_m > 0.399 && (point.x.hypot(point.y) - flat_m).abs() < 3e-3),
                None => assert!(along_m < 0.401),
            }
            assert!(one.range_m.is_some() == seen || (along_m - 0.4).abs() < 0.01 || radius_m > 0.5);
        }
    }
}

#[test]
fn a_trunk_that_stands_through_the_robot_hides_its_side_alone() {
    // A quarter of a meter to the left: inside the body's reach, nearer than the sensor reports.
    let scene = optics(vec![trunk(0.0, 0.25, 0.1), plate(10.0, 0.0, 60.0, 0.9, 0.0)], Vec::new());
    let (sweep, labels) = first_sweep(&mut keen(1, EchoChoice::Strongest, 1), &scene);
    let half_rad = (0.1_f64 / 0.25).asin();
    for (one, label) in sweep.returns.iter().zip(&labels) {
        let off_rad = arborloop_base::wrap_angle(one.azimuth_rad - std::f64::consts::FRAC_PI_2).abs();
        if off_rad < half_rad - 1e-3 {
            assert_eq!((label.class, one.range_m), (Class::Trunk, None), "{one:?}");
        } else if off_rad > half_rad + 1e-3 {
            assert_ne!(label.class, Class::Trunk, "{one:?}");
        }
    }
    let wall = |one: &&Return| one.azimuth_rad.abs() < 0.5;
    assert!(sweep.returns.iter().filter(wall).all(|one| one.range_m.is_some()));
}
