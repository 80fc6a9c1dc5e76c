//! Leaf area turned back out of sweeps: the inverse of Beer and Lambert's law, and its standard error.

use super::super::*;
use super::canopy::*;
use super::scene::*;
use arborloop_base::{Class, Return};
use arborloop_worlds::{Haze, LeafAngle, Outline};
use nalgebra::{Point3, Vector3};

/// Leaf area density that explains the share of beams that got through (one equation, solved by halving), and its
/// standard error by the delta method: each beam is one chance.
fn leaf_area(depths_m: &[(f64, f64)], through: f64) -> (f64, f64) {
    let expected =
        |density: f64| depths_m.iter().map(|(g, chord_m)| (-g * density * chord_m).exp()).sum::<f64>();
    let (mut low, mut high) = (0.0, 50.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if expected(middle) > through { low = middle } else { high = middle }
    }
    let density = (low + high) / 2.0;
    let (mut variance, mut slope) = (0.0, 0.0);
    for (g, chord_m) in depths_m {
        let free = (-g * density * chord_m).exp();
        variance += free * (1.0 - free);
        slope += g * chord_m * free;
    }
    (density, variance.sqrt() / slope)
}

fn recovered(crossings: &[Crossing], angle: LeafAngle) -> (f64, f64) {
    let depths: Vec<_> = crossings.iter().map(|one| (angle.projection(one.up), one.chord_m)).collect();
    leaf_area(&depths, crossings.iter().filter(|one| one.stopped_m.is_none()).count() as f64)
}

#[test]
fn leaf_area_is_recovered_from_a_sweep_within_its_standard_error_at_every_leaf_angle() {
    for (number, angle) in LeafAngle::ALL.into_iter().enumerate() {
        for density in [0.4, 1.6] {
            let met = scan(&turbid(vec![haze(NEAR_M, FAR_M, density, angle)]), 10 + number as u64);
            let (found, error) = recovered(&met, angle);
            assert!(
                (found - density).abs() < 4.0 * error,
                "{angle:?}: {found} +- {error}, grown with {density}"
            );
            assert!(error < 0.06 * density + 0.02, "{error}");
        }
    }
    // Who takes level leaves, seen edge on, for a sphere of them is wrong by more than chance.
    let met = scan(&turbid(vec![haze(NEAR_M, FAR_M, 0.9, LeafAngle::Planophile)]), 3);
    let (wrong, error) = recovered(&met, LeafAngle::Spherical);
    assert!((wrong - 0.9).abs() > 4.0 * error, "{wrong} +- {error}");
}

#[test]
fn the_layers_above_and_below_the_lidar_are_recovered_alike() {
    let met = scan(&turbid(vec![haze(NEAR_M, FAR_M, LEAF_AREA_PER_M, LeafAngle::Spherical)]), 6);
    // The lidar stands at the middle of the box, and a beam that looks up stays above it.
    let (above, below): (Vec<_>, Vec<_>) = met.into_iter().partition(|one| one.up > 0.0);
    for layer in [above, below] {
        let (found, error) = recovered(&layer, LeafAngle::Spherical);
        assert!((found - LEAF_AREA_PER_M).abs() < 4.0 * error && error < 0.1, "{found} +- {error}");
    }
}

#[test]
fn the_standard_error_of_leaf_area_is_what_sweeps_scatter_by() {
    let optics = turbid(vec![haze(NEAR_M, FAR_M, LEAF_AREA_PER_M, LeafAngle::Spherical)]);
    let sweeps = 30;
    let squares = (0..sweeps).map(|seed| {
        let (found, error) = recovered(&scan(&optics, 100 + seed), LeafAngle::Spherical);
        ((found - LEAF_AREA_PER_M) / error).powi(2)
    });
    // Chi-squared: its mean is the number of sweeps, its variance twice that.
    let (sum, n) = (squares.sum::<f64>(), sweeps as f64);
    assert!((sum - n).abs() < 4.0 * (2.0 * n).sqrt(), "{sum} of {n}");
}

#[test]
fn leaf_area_of_single_leaves_is_recovered_within_the_spread_between_canopies() {
    let (mean, error) = over_canopies(|met| recovered(met, LeafAngle::Spherical).0);
    assert!((mean - LEAF_AREA_PER_M).abs() < 4.0 * error, "{mean} +- {error}, grown with {LEAF_AREA_PER_M}");
    assert!(error < 0.03 * LEAF_AREA_PER_M, "{error}");
}

#[test]
fn what_stands_behind_is_recovered_from_the_beams_that_reach_it() {
    let middle_m = 0.5 * (NEAR_M + FAR_M);
    let halves = [0.6, 1.4];
    let canopy = vec![
        haze(NEAR_M, middle_m, halves[0], LeafAngle::Spherical),
        haze(middle_m, FAR_M, halves[1], LeafAngle::Spherical),
    ];
    let met = scan(&turbid(canopy), 5);
    // The box is split across the beams, so each half is half the way.
    let reached = |half: usize| {
        met.iter()
            .filter(move |one| half == 0 || one.stopped_m.is_none_or(|deep_m| deep_m >= 0.5 * one.chord_m))
    };
    for (half, density) in halves.into_iter().enumerate() {
        let passed = |one: &&Crossing| {
            one.stopped_m.is_none_or(|deep_m| deep_m >= 0.5 * (half + 1) as f64 * one.chord_m)
        };
        let depths: Vec<_> = reached(half).map(|one| (0.5, 0.5 * one.chord_m)).collect();
        let (found, error) = leaf_area(&depths, reached(half).filter(passed).count() as f64);
        assert!(
            (found - density).abs() < 4.0 * error,
            "half {half}: {found} +- {error}, grown with {density}"
        );
    }
    assert!(reached(1).count() < met.len());
}

#[test]
fn leaf_area_is_recovered_from_a_lidar_that_moves_and_turns_with_each_firings_own_pose() {
    let pose = |time: Time| {
        let t = (time - Time::SIMULATION_START).seconds();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.2, 3.0) * t);
        Pose::from_parts(Vector3::new(2.0 * t, -1.5 * t, 0.0).into(), turn)
    };
    let tick = Span::from_millis(1);
    let mut motion =
        Motion::new(Time::SIMULATION_START, pose(Time::SIMULATION_START), tick, Span::from_millis(400));
    (1..=300).for_each(|n| motion.push(pose(Time::SIMULATION_START + tick * n)));
    let optics = turbid(vec![haze(NEAR_M, FAR_M, LEAF_AREA_PER_M, LeafAngle::Planophile)]);
    let mut lidar = keen(1, EchoChoice::Strongest, 8);
    let mount = Pose::translation(0.0, 0.0, HEIGHT_M);
    let mut met = Vec::new();
    for turn in 1..=3 {
        let end = Time::SIMULATION_START + lidar.period() * turn;
        let (sweep, labels) = lidar.sweep(end, Surroundings { motion: &motion, optics: &optics });
        met.extend(crossings(&sweep, &labels, |time| pose(time) * mount));
    }
    let (found, error) = recovered(&met, LeafAngle::Planophile);
    assert!((found - LEAF_AREA_PER_M).abs() < 4.0 * error, "{found} +- {error}");
}

#[test]
fn leaf_area_of_one_round_crown_is_recovered_from_beams_with_chords_of_every_length() {
    let (center, half) = (Point3::new(4.0, 0.3, HEIGHT_M), Vector3::new(1.2, 1.0, 0.9));
    // Where a beam from the lidar enters and leaves the ellipsoid, meters along it.
    let chord = |one: &Return| {
        let (up, flat) = one.elevation_rad.sin_cos();
        let (sin, cos) = one.azimuth_rad.sin_cos();
        let along = Vector3::new(flat * cos, flat * sin, up).component_div(&half);
        let from = (Point3::new(0.0, 0.0, HEIGHT_M) - center).component_div(&half);
        let (a, b, c) = (along.norm_squared(), along.dot(&from), from.norm_squared() - 1.0);
        let root = (b * b - a * c).max(0.0).sqrt();
        ((-b + root) / a > 0.0 && root > 0.0).then(|| ((-b - root) / a, (-b + root) / a))
    };
    for (number, angle) in [LeafAngle::Spherical, LeafAngle::Erectophile].into_iter().enumerate() {
        let crown = Haze {
            outline: Outline::Ellipsoid,
            center,
            half_size: half,
            leaf_area_per_m: 1.1,
            leaf_angle: angle,
        };
        let optics = turbid(vec![crown]);
        let mut lidar = keen(1, EchoChoice::Strongest, 20 + number as u64);
        let (mut depths, mut through, mut outside) = (Vec::new(), 0.0, 0);
        for turn in 1..=2 {
            let end = Time::SIMULATION_START + lidar.period() * turn;
            let (sweep, labels) = lidar.sweep(end, Surroundings { motion: &standing(), optics: &optics });
            for (one, label) in sweep.returns.iter().zip(&labels) {
                let leafy = label.class == Class::Leaf;
                match chord(one) {
                    Some((enters_m, leaves_m)) => {
                        depths.push((angle.projection(one.elevation_rad.sin()), leaves_m - enters_m));
                        through += f64::from(u8::from(!leafy));
                        // A bearing is said to 0.01 degree and an offset laser stands a centimeter off the middle.
                        let within = |range_m: f64| (enters_m - 0.05..leaves_m + 0.05).contains(&range_m);
                        assert!(
                            !leafy || leaves_m - enters_m < 0.3 || one.range_m.is_some_and(within),
                            "{one:?}"
                        );
                    }
                    None => outside += u32::from(leafy),
                }
            }
        }
        let (found, error) = leaf_area(&depths, through);
        assert!((found - 1.1).abs() < 4.0 * error, "{angle:?}: {found} +- {error}");
        assert!(error < 0.05 && outside < 10, "{error}, {outside} beams beside the crown met it");
    }
}
