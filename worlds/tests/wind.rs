//! The wind's laws: how fast it blows, how far and how quickly each scale of a plant gives way, and what stays put.

use arborloop_base::Seed;
use arborloop_worlds::wind::{
    Drift, LEAVES_PER_SHOOT, LEAVES_PER_SPUR, STILL_BELOW_M, shoot_direction, swing_of,
};
use arborloop_worlds::{Sway, TerrainSpec, WindSpec, World, WorldSpec, build};
use nalgebra::Vector3;

fn breezy(mean_mps: f64) -> World {
    let spec = WorldSpec {
        terrain: TerrainSpec { cell_m: 2.0, bump_wavelength_m: 4.0, ..TerrainSpec::default() },
        wind: WindSpec { mean_mps, ..WindSpec::default() },
        ..WorldSpec::default()
    };
    build(&spec, Seed(5))
}

fn seconds(count: u32, step_s: f64) -> impl Iterator<Item = f64> {
    (0..count).map(move |n| 1.0 + f64::from(n) * step_s)
}

#[test]
fn still_air_moves_nothing_at_all() {
    let world = breezy(0.0);
    assert!(!world.wind.blows());
    for (index, plant) in world.plants.iter().enumerate() {
        let sway = world.wind.sway(index, plant, 12.345);
        assert_eq!(sway, Sway::at_rest(plant));
        assert_eq!(sway.world_from_plant.to_homogeneous(), plant.world_from_plant.to_homogeneous());
        for (number, leaf) in world.prototypes[plant.prototype].leaves.iter().enumerate().take(50) {
            assert_eq!(sway.leaf(number, leaf), *leaf);
        }
    }
    let drift = world.wind.drift_max(&world.plants[0]);
    assert_eq!(drift, Drift { plant_m: 0.0, shoot_m: 0.0, leaf_rad: 0.0, bend_ratio: 0.0 });
    assert_eq!(drift, world.wind.drift_between(&world.plants[0], 3.0, 4.0));
    assert_eq!(world.wind.speed_mps(1.0, 2.0, 3.0), 0.0);
}

#[test]
fn the_speed_has_the_mean_and_the_gustiness_that_were_asked_for() {
    let world = breezy(4.0);
    // One whole record: its sines are orthogonal over it, so mean and deviation are exact where nothing is clamped.
    let speeds: Vec<f64> = seconds(8192, 0.04).map(|t| world.wind.speed_mps(3.0, -7.0, t)).collect();
    let n = speeds.len() as f64;
    let mean = speeds.iter().sum::<f64>() / n;
    let deviation = (speeds.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
    assert!((mean - 4.0).abs() < 0.05, "{mean}");
    assert!((deviation / 4.0 - 0.4).abs() < 0.02, "{deviation}");
    assert!(speeds.iter().all(|v| *v >= 0.0));
}

#[test]
fn a_gust_travels_with_the_mean_wind_and_lies_across_it() {
    let world = breezy(4.0);
    let (sin, cos) = WindSpec::default().toward_deg.to_radians().sin_cos();
    for t in seconds(200, 0.77) {
        let here = world.wind.speed_mps(0.0, 0.0, t);
        let later = world.wind.speed_mps(20.0 * cos, 20.0 * sin, t + 5.0);
        let beside = world.wind.speed_mps(-30.0 * sin, 30.0 * cos, t);
        assert!((here - later).abs() < 1e-6 && (here - beside).abs() < 1e-6);
    }
}

#[test]
fn gusts_lose_power_with_frequency_as_kaimal_found() {
    let world = breezy(4.0);
    let speeds: Vec<f64> = seconds(8192, 0.04).map(|t| world.wind.speed_mps(0.0, 0.0, t)).collect();
    let power_at = |periods: usize| {
        let (mut re, mut im) = (0.0, 0.0);
        for (n, v) in speeds.iter().enumerate() {
            let (sin, cos) = (std::f64::consts::TAU * (periods * n) as f64 / 8192.0).sin_cos();
            re += v * cos;
            im += v * sin;
        }
        re * re + im * im
    };
    // Bins are 1 / 327.68 s apart. Half a decade each: 0.1-0.316 Hz, and 0.316-1 Hz.
    let [low, high] = [33..104, 104..328].map(|band| band.map(power_at).sum::<f64>());
    // Per sine f / (1 + 25 f)^(5/3), eight sines in each half decade.
    let law = |f: f64| f / (1.0 + 25.0 * f).powf(5.0 / 3.0);
    let share =
        |from: f64| (0..8).map(|n| law(from * 10.0_f64.powf((f64::from(n) + 0.5) / 16.0))).sum::<f64>();
    let (found, wanted) = (low / high, share(0.1) / share(0.316));
    assert!((found / wanted - 1.0).abs() < 0.25, "{found} {wanted}");
}

#[test]
fn no_point_ever_drifts_farther_than_the_bound_that_boxes_are_built_with() {
    for mean_mps in [1.0, 4.0, 12.0] {
        let world = breezy(mean_mps);
        let (mut shares, mut fills) = (Vec::new(), Vec::new());
        for (index, plant) in world.plants.iter().enumerate() {
            let ever = world.wind.drift_max(plant);
            let scale = plant.world_from_plant.scaling();
            for t in seconds(400, 0.31) {
                let sway = world.wind.sway(index, plant, t);
                let now = world.wind.drift_between(plant, t - 0.02, t + 0.03);
                assert!(sway.shoot_m * scale <= now.shoot_m + 1e-12 && now.shoot_m <= ever.shoot_m);
                assert!(sway.leaf_sin <= now.leaf_rad.sin() + 1e-10 && now.leaf_rad <= ever.leaf_rad);
                assert!(now.plant_m <= ever.plant_m);
                for leaf in world.prototypes[plant.prototype].leaves.iter().step_by(97) {
                    let rest = plant.world_from_plant * leaf.center;
                    let moved = (sway.world_from_plant * leaf.center - rest).norm();
                    let [low, high] = world.wind.swept(index, &now, [rest, rest]);
                    let place = sway.world_from_plant * leaf.center;
                    let inside =
                        |axis: usize| (low[axis] - 1e-12..=high[axis] + 1e-12).contains(&place[axis]);
                    assert!((0..3).all(inside), "{place} is not between {low} and {high}");
                    fills.push(moved / (high - low).norm());
                    assert!(moved <= now.plant_m + 1e-12, "{moved} of {now:?}");
                    shares.push(moved / ever.plant_m);
                }
            }
        }
        // A bound that nothing comes near would make every box too large.
        assert!(shares.iter().copied().fold(0.0, f64::max) > 0.3);
        assert!(fills.iter().copied().fold(0.0, f64::max) > 0.3);
    }
}

#[test]
fn a_leaf_keeps_its_size_and_its_shoot_while_it_moves() {
    let world = breezy(8.0);
    let plant = &world.plants[0];
    let leaves = &world.prototypes[plant.prototype].leaves;
    for t in seconds(20, 0.13) {
        let sway = world.wind.sway(0, plant, t);
        for (number, rest) in leaves.iter().enumerate().take(400) {
            let now = sway.leaf(number, rest);
            assert!((now.area_m2() / rest.area_m2() - 1.0).abs() < 1e-9);
            assert!(now.half_u == rest.half_u && now.half_u.dot(&now.half_v).abs() < 1e-12);
            let first = number / LEAVES_PER_SHOOT * LEAVES_PER_SHOOT;
            let shift = now.center - rest.center;
            let mates = sway.leaf(first, &leaves[first]).center - leaves[first].center;
            assert!((shift - mates).norm() < 1e-12);
        }
    }
}

#[test]
fn neighboring_leaves_of_a_shoot_and_a_spur_lie_closer_together_than_the_crown() {
    let world = breezy(0.0);
    for prototype in &world.prototypes {
        let spread = |leaves: &[arborloop_worlds::Leaf]| {
            let center = leaves.iter().fold(Vector3::zeros(), |sum, leaf| sum + leaf.center.coords)
                / leaves.len() as f64;
            leaves.iter().map(|leaf| (leaf.center.coords - center).norm()).fold(0.0, f64::max)
        };
        let crown = spread(&prototype.leaves);
        for members in [LEAVES_PER_SHOOT, LEAVES_PER_SPUR] {
            let spreads: Vec<f64> = prototype.leaves.chunks_exact(members).map(spread).collect();
            let mean = spreads.iter().sum::<f64>() / spreads.len() as f64;
            // A cube of as large a share of a ball's volume has this half diagonal; boxes are up to twice as long as wide.
            let cube = 1.4 * (members as f64 / prototype.leaves.len() as f64).cbrt();
            assert!(mean < 1.25 * cube * crown, "{mean} of {crown}, {members} leaves");
        }
    }
}

#[test]
fn each_scale_swings_within_its_own_band_of_frequencies() {
    let world = breezy(5.0);
    let plant = &world.plants[1];
    let turns = |pick: &dyn Fn(&Sway) -> f64| {
        let all: Vec<f64> = seconds(20_000, 0.005).map(|t| pick(&world.wind.sway(1, plant, t))).collect();
        // A phase that runs through whole turns jumps back once a turn.
        all.windows(2).filter(|pair| pair[1] < pair[0] - 0.5).count() as f64 / 100.0
    };
    for pitch in 0..4 {
        let shoots_hz = turns(&|sway| sway.shoot_turns[pitch]);
        let leaves_hz = turns(&|sway| sway.leaf_turns[pitch]);
        assert!((1.98..=5.02).contains(&shoots_hz), "{shoots_hz}");
        assert!((2.98..=8.02).contains(&leaves_hz), "{leaves_hz}");
    }
}

#[test]
fn a_tree_leans_before_the_wind_and_not_at_the_height_where_trunks_are_measured() {
    let world = breezy(6.0);
    let (sin, cos) = WindSpec::default().toward_deg.to_radians().sin_cos();
    let plant = &world.plants[0];
    let hinge = &plant.hinge;
    let world_point = |above_m: f64| hinge.foot + Vector3::z() * above_m;
    let plant_point = |above_m: f64| plant.world_from_plant.inverse() * world_point(above_m);
    let times: Vec<f64> = seconds(4000, 0.05).collect();
    let mean = |above_m: f64| {
        let sum = times.iter().fold(Vector3::zeros(), |sum, t| {
            sum + (world.wind.sway(0, plant, *t).world_from_plant * plant_point(above_m)
                - world_point(above_m))
        });
        sum / times.len() as f64
    };
    let top = mean(hinge.height_m);
    assert!(top.x * cos + top.y * sin > 0.003, "{top:?}");
    assert!((top.x * sin - top.y * cos).abs() < 0.3 * (top.x * cos + top.y * sin));
    // The trunk's own mode has its node there; what is left is the limb's turn about its fork.
    let node = mean(STILL_BELOW_M);
    let arm = (hinge.fork.z - hinge.foot.z - STILL_BELOW_M).abs();
    assert!(node.norm() < 0.05 * (arm / hinge.reach_m).max(0.05), "{node:?}");
}

#[test]
fn any_instant_may_be_asked_for_in_any_order() {
    let (one, other) = (breezy(3.0), breezy(3.0));
    let times: Vec<f64> = seconds(50, 0.31).collect();
    let forward: Vec<Sway> = times.iter().map(|t| one.wind.sway(2, &one.plants[2], *t)).collect();
    let backward: Vec<Sway> = times.iter().rev().map(|t| other.wind.sway(2, &other.plants[2], *t)).collect();
    assert!(forward.iter().eq(backward.iter().rev()));
}

#[test]
fn shoots_go_all_ways_and_out_of_step() {
    let sum = (0..1000).fold(Vector3::zeros(), |sum, shoot| {
        let direction = shoot_direction(shoot);
        assert!((direction.norm() - 1.0).abs() < 1e-12);
        sum + direction
    });
    assert!(sum.norm() < 20.0, "{sum:?}");
    let swing: f64 = (0..1000).map(|shoot| swing_of(0.3, shoot)).sum();
    assert!(swing.abs() < 20.0);
}

#[test]
fn a_wind_that_is_no_number_or_a_storm_is_refused() {
    for (mean_mps, gust_ratio) in [(f64::NAN, 0.3), (-1.0, 0.3), (40.0, 0.3), (3.0, 1.5)] {
        let error = WindSpec { mean_mps, gust_ratio, ..WindSpec::default() }.check().unwrap_err();
        assert!(error.key.starts_with("wind."), "{error}");
    }
}
