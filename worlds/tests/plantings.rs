//! Plantings held against what their specs promise: where plants stand, what moves nothing, how much leaf there is.

mod common;

use arborloop_base::{Cell, Class, Seed};
use arborloop_worlds::footprint::{HeightSlice, footprint};
use arborloop_worlds::wind::LEAVES_PER_SPUR;
use arborloop_worlds::{
    Bounds, CitrusSpec, OrchardSpec, Planting, RowsSpec, Season, World, WorldSpec, build, measure, rows,
    trunk_map,
};
use common::{bare, each_small, small_citrus, small_orchard, with_season};
use nalgebra::{Point2, Point3};
use std::collections::BTreeSet;

fn row_spec() -> RowsSpec {
    RowsSpec { count: 20, plants: 50, ..OrchardSpec::default().rows }
}

#[test]
fn places_without_jitter_are_a_lattice_along_the_bearing() {
    let spec = RowsSpec { jitter_m: 0.0, bearing_deg: 30.0, x_m: 5.0, y_m: -2.0, ..row_spec() };
    let places = rows::places(&spec, Seed(1));
    assert_eq!(places.len(), 1000);
    let along = nalgebra::Vector2::new(30_f64.to_radians().cos(), 30_f64.to_radians().sin());
    for place in &places {
        let from_first = place.point - Point2::new(5.0, -2.0);
        assert!((from_first.dot(&along) - place.plant as f64 * spec.plant_spacing_m).abs() < 1e-9);
        assert!((along.perp(&from_first) - place.row as f64 * spec.spacing_m).abs() < 1e-9);
        assert_eq!(place.point, place.nominal);
    }
}

#[test]
fn jitter_is_uniform_up_to_its_bound() {
    let spec = RowsSpec { jitter_m: 0.4, ..row_spec() };
    let offsets: Vec<f64> = rows::places(&spec, Seed(2))
        .iter()
        .flat_map(|place| {
            let offset = place.point - place.nominal;
            [offset.x, offset.y]
        })
        .collect();
    let n = offsets.len() as f64;
    assert!(offsets.iter().all(|offset| offset.abs() <= 0.4));
    // Mean 0 of deviation j/sqrt(3); square j2/3 of deviation j2 sqrt(4/45): four standard errors.
    let mean = offsets.iter().sum::<f64>() / n;
    assert!(mean.abs() < 4.0 * 0.4 / (3.0 * n).sqrt(), "mean {mean}");
    let square = offsets.iter().map(|offset| offset * offset).sum::<f64>() / n;
    assert!((square - 0.16 / 3.0).abs() < 4.0 * 0.16 * (4.0 / 45.0 / n).sqrt(), "square {square}");
}

#[test]
fn the_share_of_missing_plants_is_what_was_asked_for_and_more_missing_means_the_same_and_others() {
    let missing = |missing_ratio: f64| -> BTreeSet<u32> {
        let spec = RowsSpec { missing_ratio, ..row_spec() };
        let places = rows::places(&spec, Seed(3));
        places.iter().filter(|place| place.missing).map(|place| place.instance()).collect()
    };
    let fifth = missing(0.2);
    // Binomial: 1000 places, four standard deviations.
    assert!((fifth.len() as f64 - 200.0).abs() < 4.0 * (1000.0_f64 * 0.2 * 0.8).sqrt(), "{}", fifth.len());
    assert!(missing(0.1).is_subset(&fifth));
    assert!(missing(0.0).is_empty());
    assert_eq!(missing(1.0).len(), 1000);
}

#[test]
fn one_more_row_or_plant_moves_nobody() {
    let grown = |count: usize, plants: usize| {
        let mut spec = small_orchard();
        spec.rows = RowsSpec { count, plants, ..spec.rows };
        build(&bare(Planting::Orchard(spec)), Seed(4))
    };
    let (few, more) = (grown(3, 4), grown(4, 5));
    let same = |world: &World, instance: u32| {
        let solids: Vec<_> = world.solids.iter().filter(|s| s.instance == instance).copied().collect();
        let plants: Vec<_> = world.plants.iter().filter(|p| p.instance == instance).copied().collect();
        (solids, plants)
    };
    for crown in &few.crowns {
        assert_eq!(same(&few, crown.instance), same(&more, crown.instance));
    }
    assert_eq!(few.prototypes, more.prototypes);
}

#[test]
fn a_planting_is_its_spec_and_its_seed() {
    for (name, planting) in each_small() {
        let spec = bare(planting);
        assert!(build(&spec, Seed(5)) == build(&spec, Seed(5)), "{name}");
        assert!(build(&spec, Seed(5)).plants != build(&spec, Seed(6)).plants, "{name}");
    }
}

#[test]
fn leaf_area_measured_back_is_what_was_asked_for_in_every_planting_and_season() {
    for (name, planting) in each_small() {
        for season in Season::ALL {
            for turbid in [false, true] {
                let (planting, asked_per_m) = with_season(&planting, season, turbid);
                let world = build(&bare(planting), Seed(6));
                let found_per_m = measure::leaf_area_density(&measure::foliage(&world));
                let wanted_per_m = asked_per_m * season.scales().area_ratio;
                // Sizes vary by a tenth or two over a dozen plants, and rounding loses a leaf per plant.
                assert!(
                    (found_per_m - wanted_per_m).abs() <= 0.05 * wanted_per_m,
                    "{name} {season:?} turbid {turbid}: {found_per_m} m2/m3, wanted {wanted_per_m}"
                );
            }
        }
    }
}

#[test]
fn leaf_area_index_is_leaf_area_over_ground() {
    let spec =
        OrchardSpec { rows: RowsSpec { missing_ratio: 0.0, ..small_orchard().rows }, ..small_orchard() };
    let world = build(&bare(Planting::Orchard(spec.clone())), Seed(7));
    let plants = measure::foliage(&world);
    let (low, rows) = (Point2::new(-50.0, -50.0), &spec.rows);
    let index = measure::leaf_area_index(&plants, &Bounds { low, high: Point2::new(50.0, 50.0) });
    let area_m2: f64 = plants.iter().map(|plant| plant.leaf_area_m2).sum();
    assert!((index - area_m2 / 10_000.0).abs() < 1e-9);
    let expected = (rows.count * rows.plants) as f64 * spec.leaves.area_per_m * std::f64::consts::PI / 6.0
        * (spec.crown.height_m - spec.crown.base_m)
        * spec.crown.length_m
        * spec.crown.width_m;
    assert!((area_m2 / expected - 1.0).abs() < 0.15, "{area_m2} m2 of {expected}");
    assert_eq!(measure::leaf_area_index(&plants, &Bounds { low, high: low }), 0.0);
}

#[test]
fn the_year_goes_from_no_leaf_to_full_leaf_and_the_wood_stays() {
    for (name, planting) in each_small() {
        let area_m2 = |season| {
            let world = build(&bare(with_season(&planting, season, false).0), Seed(8));
            let leaves: usize = world.prototypes.iter().map(|prototype| prototype.leaves.len()).sum();
            let area_m2: f64 = measure::foliage(&world).iter().map(|plant| plant.leaf_area_m2).sum();
            assert_eq!(leaves == 0, season == Season::Leafless, "{name} {season:?}");
            (area_m2, world)
        };
        let [bare, flush, full, pruned] = Season::ALL.map(area_m2);
        assert!(bare.0 == 0.0 && bare.0 < flush.0 && flush.0 < full.0, "{name}");
        assert!(pruned.0 < full.0, "{name}");
        assert_eq!(bare.1.solids, full.1.solids, "{name}: trunks and posts have no season");
        let wood =
            |world: &World| -> Vec<_> { world.prototypes.iter().map(|p| p.branches.clone()).collect() };
        assert!(wood(&bare.1) == wood(&full.1), "{name}: branches have no season");
    }
}

#[test]
fn every_tip_is_within_reach_of_its_hinge() {
    for (name, planting) in each_small() {
        let world = build(&bare(planting), Seed(9));
        assert!(!world.plants.is_empty(), "{name}");
        for plant in &world.plants {
            let prototype = &world.prototypes[plant.prototype];
            let hinge = &plant.hinge;
            let leaves = prototype.leaves.iter().flat_map(|leaf| leaf.corners());
            let haze = prototype.haze.iter().flat_map(|haze| haze.corners());
            let tips = prototype.branches.iter().map(|branch| branch.center(branch.height_m));
            for point in leaves.chain(haze).chain(tips) {
                let point = plant.world_from_plant * point;
                assert!((point - hinge.fork).norm() <= hinge.reach_m + 1e-9, "{name}: {point}");
            }
            let foot = plant.world_from_plant * Point3::origin();
            assert!((foot - hinge.foot).norm() < 1e-9, "{name}");
            assert!((foot.z - world.terrain.height_m(foot.x, foot.y)).abs() < 1e-9, "{name}");
            assert!(hinge.height_m > 0.3 && hinge.reach_m > 0.1, "{name}: {hinge:?}");
        }
    }
}

#[test]
fn each_eight_leaves_are_neighbors() {
    for (name, planting) in each_small() {
        let world = build(&bare(planting), Seed(10));
        let (mut inside_m, mut spurs, mut around_m, mut prototypes) = (0.0, 0, 0.0, 0);
        for prototype in world.prototypes.iter().filter(|prototype| prototype.leaves.len() > 200) {
            let spread = |leaves: &[arborloop_worlds::Leaf]| {
                let middle = leaves.iter().map(|leaf| leaf.center.coords).sum::<nalgebra::Vector3<f64>>()
                    / leaves.len() as f64;
                leaves.iter().map(|leaf| (leaf.center.coords - middle).norm()).sum::<f64>()
                    / leaves.len() as f64
            };
            for spur in prototype.leaves.chunks_exact(LEAVES_PER_SPUR) {
                inside_m += spread(spur);
                spurs += 1;
            }
            around_m += spread(&prototype.leaves);
            prototypes += 1;
        }
        let (inside_m, around_m) = (inside_m / f64::from(spurs), around_m / f64::from(prototypes));
        // Eight of n leaves fill a share of 8/n of the volume: at n > 200, a third of the size.
        assert!(inside_m < 0.4 * around_m, "{name}: spurs spread {inside_m} m of {around_m} m");
    }
}

#[test]
fn trunks_stand_under_their_crowns_and_in_the_trunk_map() {
    for planting in [Planting::Citrus(small_citrus()), Planting::Orchard(small_orchard())] {
        let world = build(&bare(planting), Seed(11));
        let trunks = trunk_map(&world);
        assert_eq!(trunks.len(), world.crowns.len());
        for (trunk, crown) in trunks.iter().zip(&world.crowns) {
            assert_eq!((trunk.class, trunk.instance), (Class::Trunk, crown.instance));
            let foot = crown.world_from_plant * Point3::origin();
            // Leaning is a few degrees: at 0.3 m a trunk has moved by centimeters.
            assert!((Point2::new(trunk.x_m, trunk.y_m) - foot.xy()).norm() < 0.1);
            assert!((0.02..0.3).contains(&trunk.radius_m), "{trunk:?}");
        }
    }
}

#[test]
fn trunk_radii_follow_a_log_normal_law() {
    let mut spec = small_orchard();
    spec.rows = RowsSpec { count: 20, plants: 50, missing_ratio: 0.0, ..spec.rows };
    spec.leaves.area_per_m = 0.0;
    spec.trunk.radius_variation_ratio = 0.3;
    let world = build(&bare(Planting::Orchard(spec.clone())), Seed(12));
    let logs: Vec<f64> =
        world.solids.iter().map(|s| (s.shape.radius_base_m / spec.trunk.radius_m).ln()).collect();
    let n = logs.len() as f64;
    let variance = (1.0_f64 + 0.09).ln();
    let mean = logs.iter().sum::<f64>() / n;
    assert!((mean + variance / 2.0).abs() < 4.0 * (variance / n).sqrt(), "mean of logarithms {mean}");
    let found = logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>() / n;
    // Cutting at 2.5 standard deviations takes 3.5 % of the variance.
    assert!(
        (found / variance - 0.965).abs() < 4.0 * (2.0 / n).sqrt() + 0.01,
        "variance {found} of {variance}"
    );
}

#[test]
fn rows_without_plants_and_one_plant_are_worlds_and_too_many_are_refused() {
    for (count, plants, trees) in [(0, 5, 0), (5, 0, 0), (1, 1, 1)] {
        let mut spec = small_orchard();
        spec.rows = RowsSpec { count, plants, missing_ratio: 0.0, ..spec.rows };
        let world = build(&bare(Planting::Orchard(spec)), Seed(13));
        assert_eq!((world.crowns.len(), world.solids.len()), (trees, trees));
    }
    let refused = |change: fn(&mut CitrusSpec)| {
        let mut spec = CitrusSpec::default();
        change(&mut spec);
        WorldSpec { planting: Planting::Citrus(spec), ..WorldSpec::default() }
            .check()
            .unwrap_err()
            .to_string()
    };
    assert_eq!(refused(|spec| spec.rows.plants = 5000), "planting.rows.plants is 5000, wanted 999 at most");
    assert_eq!(
        refused(|spec| (spec.rows.count, spec.rows.plants) = (500, 100)),
        "planting.rows.plants is 100, wanted 20 at most in 500 rows"
    );
    assert_eq!(
        refused(|spec| spec.rows.jitter_m = 3.0),
        "planting.rows.jitter_m is 3, wanted a number from 0 to 2.025"
    );
    assert_eq!(
        refused(|spec| spec.crown.limbs = 0),
        "planting.crown.limbs is 0, wanted a number from 1 to 24"
    );
    assert!(
        refused(|spec| spec.leaves.size_m = 0.012).contains("so that a plant has 200000 leaves or fewer")
    );
    assert!(refused(|spec| spec.crown.height_m = f64::NAN).starts_with("planting.crown.height_m is NaN"));
}

#[test]
fn haze_and_leaves_fill_the_same_cells() {
    let slice = HeightSlice { low_m: 1.0, high_m: 1.6 };
    let grid = |turbid| {
        let mut spec = small_orchard();
        spec.rows = RowsSpec { count: 1, plants: 1, missing_ratio: 0.0, x_m: 0.0, y_m: 0.0, ..spec.rows };
        spec.leaves.area_per_m = 6.0;
        let world = build(&bare(with_season(&Planting::Orchard(spec), Season::Full, turbid).0), Seed(14));
        footprint(&world, slice, 0.1, &Bounds { low: Point2::new(-2.0, -2.0), high: Point2::new(2.0, 2.0) })
    };
    let (leaves, haze) = (grid(false), grid(true));
    let occupied = |cells: &[Cell]| cells.iter().filter(|cell| **cell == Cell::Occupied).count();
    let both =
        leaves.cells().iter().zip(haze.cells()).filter(|(a, b)| a == b && **a == Cell::Occupied).count();
    let (leaves, haze) = (occupied(leaves.cells()), occupied(haze.cells()));
    assert!(leaves > 100 && haze > 100, "{leaves} and {haze} cells");
    // Leaves reach half a diagonal beyond their clump, and leave the clump's rim thin.
    assert!(both * 100 > 85 * leaves.max(haze), "{both} of {leaves} and {haze} cells");
}
