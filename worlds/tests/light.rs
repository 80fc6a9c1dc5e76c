//! What foliage does to light, held against its laws: Ross' projection and Beer-Lambert's transmission.

mod common;

use arborloop_base::{Draws, Seed};
use arborloop_worlds::{
    CitrusSpec, Haze, Leaf, LeafAngle, Outline, Planting, RowsSpec, Season, World, build,
};
use common::{bare, small_orchard, small_vineyard, with_season};
use nalgebra::{Point3, Vector3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Mean over all leaves of |cos| between beam and normal, by two midpoint rules over the density: no shortcut.
fn projection_by_integral(angle: LeafAngle, zenith_rad: f64) -> f64 {
    const STEPS: usize = 400;
    let mut sum = 0.0;
    for i in 0..STEPS {
        let t = (i as f64 + 0.5) / STEPS as f64 * FRAC_PI_2;
        let weight = angle.density_per_rad(t) * FRAC_PI_2 / STEPS as f64;
        for j in 0..STEPS {
            let turn = (j as f64 + 0.5) / STEPS as f64 * PI;
            let cos = zenith_rad.cos() * t.cos() + zenith_rad.sin() * t.sin() * turn.cos();
            sum += weight * cos.abs() / STEPS as f64;
        }
    }
    sum
}

#[test]
fn the_projection_is_the_mean_cosine_over_all_leaves() {
    for angle in LeafAngle::ALL {
        for degrees in [0.0, 5.0, 30.0, 57.3, 75.0, 89.0, 90.0] {
            let zenith_rad = f64::to_radians(degrees);
            let expected = projection_by_integral(angle, zenith_rad);
            let found = angle.projection(zenith_rad.cos());
            assert!((found - expected).abs() < 1e-3, "{angle:?} at {degrees}: {found}, wanted {expected}");
            assert_eq!(found, angle.projection(-zenith_rad.cos()));
        }
    }
}

#[test]
fn over_all_directions_every_leaf_shows_half_its_area() {
    for angle in LeafAngle::ALL {
        // Uniform directions have uniform cosines; trapezoids over a table of 128 cells.
        let sum: f64 = (0..1280).map(|n| angle.projection((f64::from(n) + 0.5) / 1280.0)).sum();
        assert!((sum / 1280.0 - 0.5).abs() < 1e-3, "{angle:?}: {}", sum / 1280.0);
    }
}

#[test]
fn sampled_inclinations_have_the_density_that_they_are_named_for() {
    const N: u64 = 20_000;
    const BINS: usize = 12;
    for angle in LeafAngle::ALL {
        let stream = Seed(1).stream("test/inclination");
        let mut counts = [0_u32; BINS];
        for n in 0..N {
            let inclination_rad = angle.inclination_rad(stream.at(n).unit());
            assert!((0.0..=FRAC_PI_2).contains(&inclination_rad));
            counts[((inclination_rad / FRAC_PI_2 * BINS as f64) as usize).min(BINS - 1)] += 1;
        }
        for (bin, count) in counts.into_iter().enumerate() {
            let share: f64 = (0..100)
                .map(|n| (bin as f64 + (f64::from(n) + 0.5) / 100.0) / BINS as f64 * FRAC_PI_2)
                .map(|t| angle.density_per_rad(t) * FRAC_PI_2 / BINS as f64 / 100.0)
                .sum();
            let expected = share * N as f64;
            let error = 4.0 * (expected * (1.0 - share)).sqrt() + 1.0;
            assert!(
                (f64::from(count) - expected).abs() < error,
                "{angle:?} bin {bin}: {count} of {expected}"
            );
        }
    }
}

/// A beam with a direction of length 1.
struct Beam {
    from: Point3<f64>,
    along: Vector3<f64>,
}

/// Through a point uniform in a box, in a direction uniform on the sphere, from far outside.
fn random_beam(low: &Point3<f64>, high: &Point3<f64>, draws: &mut Draws) -> Beam {
    let through = Point3::from(low.coords.zip_map(&high.coords, |a, b| draws.within(a, b)));
    let up = draws.within(-1.0, 1.0);
    let (sin, cos) = draws.within(0.0, TAU).sin_cos();
    let level = (1.0_f64 - up * up).sqrt();
    let along = Vector3::new(level * cos, level * sin, up);
    Beam { from: through - along * 50.0, along }
}

fn meets(beam: &Beam, leaf: &Leaf) -> bool {
    let normal = leaf.half_u.cross(&leaf.half_v);
    let at = (leaf.center - beam.from).dot(&normal) / beam.along.dot(&normal);
    let offset = beam.from + beam.along * at - leaf.center;
    offset.dot(&leaf.half_u).abs() <= leaf.half_u.norm_squared()
        && offset.dot(&leaf.half_v).abs() <= leaf.half_v.norm_squared()
}

/// Length of a line inside an outline, in units of the line's direction.
fn chord(from: &Point3<f64>, along: &Vector3<f64>, haze: &Haze) -> f64 {
    let from = (from - haze.center).component_div(&haze.half_size);
    let along = along.component_div(&haze.half_size);
    match haze.outline {
        Outline::Ellipsoid => {
            let (a, b, c) = (along.norm_squared(), from.dot(&along), from.norm_squared() - 1.0);
            2.0 * (b * b - a * c).max(0.0).sqrt() / a
        }
        Outline::Box => {
            let span = (0..3).fold((f64::NEG_INFINITY, f64::INFINITY), |(low, high), axis| {
                let ends = [-1.0, 1.0].map(|side| (side - from[axis]) / along[axis]);
                (low.max(ends[0].min(ends[1])), high.min(ends[0].max(ends[1])))
            });
            (span.1 - span.0).max(0.0)
        }
    }
}

/// Beer-Lambert through a world of haze.
fn transmitted(beam: &Beam, world: &World) -> f64 {
    let depth: f64 = world
        .plants
        .iter()
        .map(|plant| {
            let plant_from_world = plant.world_from_plant.inverse();
            let (from, along) = (plant_from_world * beam.from, plant_from_world * beam.along);
            let cos_zenith = along.z / along.norm();
            let haze = world.prototypes[plant.prototype].haze.iter();
            // The plant's own lengths: the scaled direction makes the chord the plant's, as the density is.
            let plant_m = along.norm();
            haze.map(|haze| {
                let unit = along / plant_m;
                chord(&from, &unit, haze) * haze.leaf_area_per_m * haze.leaf_angle.projection(cos_zenith)
            })
            .sum::<f64>()
        })
        .sum();
    (-depth).exp()
}

/// Light that gets through one plant's leaves is what Beer-Lambert says of the same plant as haze.
fn leaves_and_haze_agree(planting: &Planting, name: &str) {
    const BEAMS: u64 = 400;
    const TREES: u64 = 5;
    let (mut free, mut expected, mut variance) = (0.0, 0.0, 0.0);
    for tree in 0..TREES {
        let world = |turbid| build(&bare(with_season(planting, Season::Full, turbid).0), Seed(100 + tree));
        let (leafy, turbid) = (world(false), world(true));
        assert_eq!((leafy.crowns.len(), &leafy.crowns), (1, &turbid.crowns));
        let leaves: Vec<Leaf> = leafy
            .plants
            .iter()
            .flat_map(|plant| {
                let leaves = leafy.prototypes[plant.prototype].leaves.iter();
                leaves.map(|leaf| leaf.transformed(&plant.world_from_plant))
            })
            .collect();
        let crown = &leafy.crowns[0];
        // The middle of the crown, where its clumps are thick.
        let half = crown.crown.half_size * 0.7 * crown.world_from_plant.scaling();
        let middle = crown.world_from_plant * crown.crown.center;
        let stream = Seed(tree).stream("test/beams");
        for n in 0..BEAMS {
            let beam = random_beam(&(middle - half), &(middle + half), &mut stream.at(n));
            let share = transmitted(&beam, &turbid);
            free += f64::from(u8::from(!leaves.iter().any(|leaf| meets(&beam, leaf))));
            expected += share;
            variance += share * (1.0 - share);
        }
    }
    // Each beam is a coin with the share that Beer-Lambert says.
    assert!(
        (free - expected).abs() < 4.0 * f64::sqrt(variance),
        "{name}: {free} of {} beams pass, wanted {expected} +- {}",
        BEAMS * TREES,
        variance.sqrt()
    );
    let share = expected / (BEAMS * TREES) as f64;
    assert!((0.05..0.95).contains(&share), "{name}: {share} passes, which tests nothing");
}

fn one_plant(rows: RowsSpec) -> RowsSpec {
    RowsSpec { count: 1, plants: 1, missing_ratio: 0.0, ..rows }
}

#[test]
fn an_orchard_tree_dims_light_as_its_haze_does_at_every_leaf_angle() {
    for angle in LeafAngle::ALL {
        let mut spec = small_orchard();
        spec.rows = one_plant(spec.rows);
        spec.leaves.size_m = 0.04;
        spec.leaves.angle = angle;
        leaves_and_haze_agree(&Planting::Orchard(spec), &format!("{angle:?}"));
    }
}

#[test]
fn a_vine_dims_light_as_its_haze_does() {
    let mut spec = small_vineyard();
    spec.rows = one_plant(spec.rows);
    spec.leaves.size_m = 0.02;
    leaves_and_haze_agree(&Planting::Vineyard(spec), "vine");
}

#[test]
fn a_lidar_in_the_alley_hardly_sees_a_citrus_trunk_for_leaves() {
    let mut spec = CitrusSpec::default();
    spec.rows = RowsSpec { count: 1, plants: 6, missing_ratio: 0.0, ..spec.rows };
    let world = build(&bare(Planting::Citrus(spec.clone())), Seed(21));
    let alley_m = spec.rows.y_m + spec.rows.spacing_m / 2.0;
    let (mut seen, mut rays) = (0, 0);
    for (trunk, crown) in world.solids.iter().zip(&world.crowns) {
        let leaves: Vec<Leaf> = world
            .plants
            .iter()
            .filter(|plant| plant.instance == crown.instance)
            .flat_map(|plant| {
                let leaves = world.prototypes[plant.prototype].leaves.iter();
                leaves.map(|leaf| leaf.transformed(&plant.world_from_plant))
            })
            .collect();
        let stream = Seed(22).stream("test/trunk");
        for n in 0..60 {
            let mut draws = stream.child(u64::from(trunk.instance)).at(n);
            let target = trunk.shape.center(draws.within(0.15, 0.55));
            let ground_m = world.terrain.height_m(target.x, alley_m);
            let from = Point3::new(target.x + draws.within(-2.0, 2.0), alley_m, ground_m + 0.5);
            let beam = Beam { from, along: (target - from).normalize() };
            let before = |leaf: &&Leaf| (leaf.center - from).norm() < (target - from).norm() + 0.1;
            seen += usize::from(!leaves.iter().filter(before).any(|leaf| meets(&beam, leaf)));
            rays += 1;
        }
    }
    // Photos of CitrusFarm show none; through leaves as dense as the facts allow, a beam in ten may slip.
    assert!(seen * 10 < rays, "{seen} of {rays} beams reach a trunk");
}
