//! What a VLP-16 says of a canopy: transmission by Beer and Lambert, and leaf area turned back out of a sweep.

use super::super::*;
use super::scene::*;
use arborloop_base::{Class, Return, Seed};
use arborloop_worlds::{Haze, Leaf, LeafAngle, Outline, Prototype};
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// The canopy: a box of leaves before the lidar, so wide and high that beams cross its near and far faces alone.
const NEAR_M: f64 = 4.0;
const FAR_M: f64 = 5.5;
const HALF_M: f64 = 2.0;
const LEAF_AREA_PER_M: f64 = 0.9;
/// Beams keep this far from the sides, more than half a leaf's diagonal.
const MARGIN_M: f64 = 0.15;

fn haze(near_m: f64, far_m: f64, leaf_area_per_m: f64, leaf_angle: LeafAngle) -> Haze {
    Haze {
        outline: Outline::Box,
        center: Point3::new((near_m + far_m) / 2.0, 0.0, HEIGHT_M),
        half_size: Vector3::new((far_m - near_m) / 2.0, HALF_M, HALF_M),
        leaf_area_per_m,
        leaf_angle,
    }
}

fn turbid(haze: Vec<Haze>) -> Optics {
    grown(Prototype { haze, ..bare_prototype() })
}

/// The box filled with square leaves of 8 cm at random places, normals uniform on the sphere.
fn leafy(seed: u64) -> Optics {
    const SIDE_M: f64 = 0.08;
    let volume_m3 = (FAR_M - NEAR_M) * (2.0 * HALF_M).powi(2);
    let count = (LEAF_AREA_PER_M * volume_m3 / (SIDE_M * SIDE_M)).round() as u64;
    let stream = Seed(seed).stream("test/leaves");
    let leaves = (0..count).map(|index| {
        let mut draws = stream.at(index);
        let center = Point3::new(
            draws.within(NEAR_M, FAR_M),
            draws.within(-HALF_M, HALF_M),
            HEIGHT_M + draws.within(-HALF_M, HALF_M),
        );
        let (up, turn) = (draws.within(-1.0, 1.0), draws.within(0.0, TAU));
        let flat = (1.0_f64 - up * up).sqrt();
        let normal = Vector3::new(flat * turn.cos(), flat * turn.sin(), up);
        let across = Vector3::new(-turn.sin(), turn.cos(), 0.0);
        Leaf { center, half_u: across * (SIDE_M / 2.0), half_v: normal.cross(&across) * (SIDE_M / 2.0) }
    });
    grown(Prototype { leaves: leaves.collect(), ..bare_prototype() })
}

/// One beam that crossed the box: its way in it, where it stopped on that way, and what it met.
struct Crossing {
    chord_m: f64,
    stopped_m: Option<f64>,
    up: f64,
    label: Label,
}

/// Every firing of a sweep whose beam crosses both faces of the box; where a beam went is told by the sweep alone.
fn crossings(sweep: &Sweep, labels: &[Label], pose: impl Fn(Time) -> Pose) -> Vec<Crossing> {
    let mut found = Vec::new();
    for (one, label) in sweep.returns.iter().zip(labels).filter(|(one, _)| one.number == 0) {
        let world_from_lidar = pose(sweep.start + one.fired_after);
        let (up, flat) = one.elevation_rad.sin_cos();
        let (sin, cos) = one.azimuth_rad.sin_cos();
        let along = world_from_lidar * Vector3::new(flat * cos, flat * sin, up);
        let from = world_from_lidar * Point3::origin();
        if along.x <= 0.0 {
            continue;
        }
        let at = |x_m: f64| (x_m - from.x) / along.x;
        let (enters_m, leaves_m) = (at(NEAR_M), at(FAR_M));
        let within = |range_m: f64| {
            let place = from + along * range_m;
            place.y.abs() < HALF_M - MARGIN_M && (place.z - HEIGHT_M).abs() < HALF_M - MARGIN_M
        };
        if within(enters_m) && within(leaves_m) {
            let stopped_m = one.range_m.filter(|_| label.class == Class::Leaf);
            found.push(Crossing {
                chord_m: leaves_m - enters_m,
                stopped_m: stopped_m.map(|range_m| range_m - enters_m),
                up: along.z,
                label: *label,
            });
        }
    }
    found
}

fn still(_: Time) -> Pose {
    Pose::translation(0.0, 0.0, HEIGHT_M)
}

fn scan(optics: &Optics, seed: u64) -> Vec<Crossing> {
    let (sweep, labels) = first_sweep(&mut keen(1, EchoChoice::Strongest, seed), optics);
    crossings(&sweep, &labels, still)
}

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
fn a_vlp16_sees_through_a_turbid_canopy_as_beer_and_lambert_say() {
    let met = scan(&turbid(vec![haze(NEAR_M, FAR_M, LEAF_AREA_PER_M, LeafAngle::Spherical)]), 1);
    let law = |one: &Crossing| (-0.5 * LEAF_AREA_PER_M * one.chord_m).exp();
    let through = met.iter().filter(|one| one.stopped_m.is_none()).count() as f64;
    let (wanted, variance) = met.iter().map(law).fold((0.0, 0.0), |(sum, v), p| (sum + p, v + p * (1.0 - p)));
    assert!(met.len() > 2500, "{} beams", met.len());
    assert!(
        (through - wanted).abs() < 4.0 * variance.sqrt(),
        "{through} of {} got through, the law says {wanted}",
        met.len()
    );
    // How deep the others got: an exponential law that the far face cuts off, its mean within four standard errors.
    let rate = 0.5 * LEAF_AREA_PER_M;
    let (mut sum, mut wanted, mut variance) = (0.0, 0.0, 0.0);
    for one in &met {
        let Some(stopped_m) = one.stopped_m else { continue };
        let (c, left) = (rate * one.chord_m, law(one));
        let mean = (1.0 - (1.0 + c) * left) / (rate * (1.0 - left));
        let square = (2.0 - (2.0 + 2.0 * c + c * c) * left) / (rate * rate * (1.0 - left));
        (sum, wanted, variance) = (sum + stopped_m, wanted + mean, variance + square - mean * mean);
    }
    assert!(
        (sum - wanted).abs() < 4.0 * variance.sqrt() + 0.002 * met.len() as f64,
        "{sum} m deep, wanted {wanted}"
    );
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

/// Beams that lie closer together than a leaf is wide meet the same leaf, so that chance is counted by canopies: mean
/// and standard error over sixteen of them.
fn over_canopies(of: impl Fn(&[Crossing]) -> f64) -> (f64, f64) {
    static SCANS: LazyLock<Vec<Vec<Crossing>>> =
        LazyLock::new(|| (0..16).map(|seed| scan(&leafy(seed), seed)).collect());
    let found: Vec<f64> = SCANS.iter().map(|scan| of(scan)).collect();
    let n = found.len() as f64;
    let mean = found.iter().sum::<f64>() / n;
    (mean, (found.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt())
}

#[test]
fn leaf_area_of_single_leaves_is_recovered_within_the_spread_between_canopies() {
    let (mean, error) = over_canopies(|met| recovered(met, LeafAngle::Spherical).0);
    assert!((mean - LEAF_AREA_PER_M).abs() < 4.0 * error, "{mean} +- {error}, grown with {LEAF_AREA_PER_M}");
    assert!(error < 0.03 * LEAF_AREA_PER_M, "{error}");
}

#[test]
fn a_vlp16_sees_through_leaves_as_beer_and_lambert_say() {
    let excess = |met: &[Crossing]| {
        let law = met.iter().map(|one| (-0.5 * LEAF_AREA_PER_M * one.chord_m).exp()).sum::<f64>();
        (met.iter().filter(|one| one.stopped_m.is_none()).count() as f64 - law) / met.len() as f64
    };
    let (mean, error) = over_canopies(excess);
    assert!(mean.abs() < 4.0 * error && error < 0.01, "{mean} +- {error}");
}

#[test]
fn leaves_at_every_angle_are_met_in_proportion_to_what_they_show() {
    // Cosines of a sphere of normals are uniform; those of the leaves met follow 2 c, whose mean is 2/3.
    let (mean, error) = over_canopies(|met| {
        let leaves = met.iter().filter(|one| one.stopped_m.is_some());
        let (sum, count) = leaves.fold((0.0, 0.0), |(sum, count), one| {
            (sum + f64::from(one.label.incidence_rad).cos(), count + 1.0)
        });
        sum / count
    });
    assert!((mean - 2.0 / 3.0).abs() < 4.0 * error && error < 0.01, "{mean} +- {error}");
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
fn every_ray_of_a_footprint_finds_its_own_way_through_haze() {
    let optics = turbid(vec![haze(NEAR_M, FAR_M, 0.2, LeafAngle::Spherical)]);
    for sub_rays in [1, 5, 19] {
        let (sweep, labels) = first_sweep(&mut keen(sub_rays, EchoChoice::First, 4), &optics);
        let met = crossings(&sweep, &labels, still);
        // A beam is seen through where none of its rays met a leaf.
        let law = |one: &Crossing| (-0.5 * 0.2 * one.chord_m * f64::from(sub_rays)).exp();
        let (wanted, variance) =
            met.iter().map(law).fold((0.0, 0.0), |(sum, v), p| (sum + p, v + p * (1.0 - p)));
        let through = met.iter().filter(|one| one.stopped_m.is_none()).count() as f64;
        // The rays' chords differ from the beam's by their angle's square: nothing beside chance.
        assert!(
            (through - wanted).abs() < 4.0 * variance.sqrt(),
            "{sub_rays} rays: {through}, wanted {wanted}"
        );
    }
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
