//! How far a VLP-16 sees into a canopy: transmission by Beer and Lambert, through haze and between single leaves.

use super::super::*;
use super::scene::*;
use arborloop_base::{Class, Seed};
use arborloop_worlds::{Haze, Leaf, LeafAngle, Outline, Prototype};
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// The canopy: a box of leaves before the lidar, so wide and high that beams cross its near and far faces alone.
pub(super) const NEAR_M: f64 = 4.0;
pub(super) const FAR_M: f64 = 5.5;
const HALF_M: f64 = 2.0;
pub(super) const LEAF_AREA_PER_M: f64 = 0.9;
/// Beams keep this far from the sides, more than half a leaf's diagonal.
const MARGIN_M: f64 = 0.15;

pub(super) fn haze(near_m: f64, far_m: f64, leaf_area_per_m: f64, leaf_angle: LeafAngle) -> Haze {
    Haze {
        outline: Outline::Box,
        center: Point3::new((near_m + far_m) / 2.0, 0.0, HEIGHT_M),
        half_size: Vector3::new((far_m - near_m) / 2.0, HALF_M, HALF_M),
        leaf_area_per_m,
        leaf_angle,
    }
}

pub(super) fn turbid(haze: Vec<Haze>) -> Optics {
    grown(Prototype { haze, ..bare_prototype() })
}

/// The box filled with square leaves of 8 cm at random places, normals uniform on the sphere.
pub(super) fn leafy(seed: u64) -> Optics {
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
pub(super) struct Crossing {
    pub(super) chord_m: f64,
    pub(super) stopped_m: Option<f64>,
    pub(super) up: f64,
    label: Label,
}

/// Every firing of a sweep whose beam crosses both faces of the box; where a beam went is told by the sweep alone.
pub(super) fn crossings(sweep: &Sweep, labels: &[Label], pose: impl Fn(Time) -> Pose) -> Vec<Crossing> {
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

pub(super) fn scan(optics: &Optics, seed: u64) -> Vec<Crossing> {
    let (sweep, labels) = first_sweep(&mut keen(1, EchoChoice::Strongest, seed), optics);
    crossings(&sweep, &labels, still)
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

/// Beams that lie closer together than a leaf is wide meet the same leaf, so that chance is counted by canopies: mean
/// and standard error over sixteen of them.
pub(super) fn over_canopies(of: impl Fn(&[Crossing]) -> f64) -> (f64, f64) {
    static SCANS: LazyLock<Vec<Vec<Crossing>>> =
        LazyLock::new(|| (0..16).map(|seed| scan(&leafy(seed), seed)).collect());
    let found: Vec<f64> = SCANS.iter().map(|scan| of(scan)).collect();
    let n = found.len() as f64;
    let mean = found.iter().sum::<f64>() / n;
    (mean, (found.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt())
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
