mod bearings;
mod body;
mod canopy;
mod echoes;
mod extremes;
mod faults;
mod footprints;
mod leaf_area;
mod models;
mod returns;
mod scene;
mod weather;

use super::*;
use arborloop_base::Seed;
use arborloop_base::vlp16::{self, CYCLE_STEP, LASER_STEP, LASERS};
use arborloop_base::{Class, Return};
use arborloop_worlds::{GrassSpec, Planting, SurroundingsSpec, TerrainSpec, WindSpec, WorldSpec, build};
use nalgebra::Vector3;
use std::f64::consts::TAU;

fn level_ground() -> Optics {
    let spec = WorldSpec {
        terrain: TerrainSpec { relief_m: 0.0, bump_m: 0.0, slope_deg: 0.0, ..TerrainSpec::default() },
        grass: GrassSpec { height_m: 0.0, ..GrassSpec::default() },
        planting: Planting::None,
        surroundings: SurroundingsSpec { trees: 0, bushes: 0, ..SurroundingsSpec::default() },
        wind: WindSpec::default(),
    };
    Optics::new(&build(&spec, Seed(1)))
}

fn exact(rate_hz: f64) -> Lidar {
    let spec = LidarSpec { range_noise_m: 0.0, dropout_ratio: 0.0, rate_hz, ..LidarSpec::default() };
    let period = Span::from_seconds(1.0 / rate_hz);
    Lidar::new(&spec, period, Pose::translation(0.0, 0.0, 0.16), Seed(1).stream("lidar"))
}

/// A body that drives, climbs and turns at constant rates, sampled at 1 kHz.
fn moving() -> (Motion, impl Fn(Time) -> Pose) {
    let start = Pose::translation(0.0, 0.0, 0.3);
    let pose = move |time: Time| {
        let t = (time - Time::SIMULATION_START).seconds();
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 0.3, 2.0) * t);
        Pose::from_parts(Vector3::new(1.0 * t, 0.2 * t, 0.3 + 0.1 * t).into(), turn)
    };
    let tick = Span::from_millis(1);
    let mut motion = Motion::new(Time::SIMULATION_START, start, tick, Span::from_millis(400));
    (1..=350).for_each(|n| motion.push(pose(Time::SIMULATION_START + tick * n)));
    (motion, pose)
}

#[test]
fn consecutive_sweeps_hold_every_firing_once_at_the_manuals_instants() {
    let (mut lidar, optics) = (exact(10.0), level_ground());
    let (motion, _) = moving();
    let ends = [100, 200, 300].map(|ms| Time::SIMULATION_START + Span::from_millis(ms));
    let mut next = Time::SIMULATION_START;
    for end in ends {
        let (sweep, labels) = lidar.sweep(end, Surroundings { motion: &motion, optics: &optics });
        assert_eq!(labels.len(), sweep.returns.len());
        assert!((1808..=1809).contains(&(sweep.returns.len() / LASERS)), "{}", sweep.returns.len());
        for (n, one) in sweep.returns.iter().enumerate() {
            let stamp = sweep.start + one.fired_after;
            assert_eq!(stamp, next + LASER_STEP * (n % LASERS) as i64);
            assert!(stamp < end);
            if n % LASERS == LASERS - 1 {
                next += CYCLE_STEP;
            }
        }
    }
}

#[test]
fn a_sweep_put_back_with_its_own_true_poses_restores_the_ground_to_the_wires_steps() {
    let (mut lidar, optics) = (exact(10.0), level_ground());
    let (motion, pose) = moving();
    let (sweep, _) = lidar.sweep(
        Time::SIMULATION_START + Span::from_millis(300),
        Surroundings { motion: &motion, optics: &optics },
    );
    let mut ground = 0;
    for one in &sweep.returns {
        let Some(point) = one.point() else { continue };
        let world_from_lidar = pose(sweep.start + one.fired_after) * Pose::translation(0.0, 0.0, 0.16);
        let height = (world_from_lidar * point).z;
        // Half a step of 2 mm along the beam and 1.5 steps of 0.01 degree across a tilted one.
        let bound = 0.001 + 1.5 * TAU / 36_000.0 * one.range_m.unwrap_or(0.0) + 1e-4;
        assert!(height.abs() < bound, "{height} m above the plane at {:?}", one);
        ground += 1;
    }
    assert!(ground > 10_000);
    let still = pose(sweep.end) * Pose::translation(0.0, 0.0, 0.16);
    let smeared =
        sweep.returns.iter().filter_map(Return::point).map(|p| (still * p).z.abs()).fold(0.0, f64::max);
    assert!(smeared > 0.02, "without the true poses the plane is bent, here by {smeared} m");
}

#[test]
fn range_noise_and_dropout_follow_their_laws() {
    let spec = LidarSpec { dropout_ratio: 0.1, reach_m: 1e6, ..LidarSpec::default() };
    let mut noisy =
        Lidar::new(&spec, Span::from_millis(100), Pose::translation(0.0, 0.0, 0.16), Seed(7).stream("lidar"));
    let (motion, _) = moving();
    let (sweep, labels) = noisy.sweep(
        Time::SIMULATION_START + Span::from_millis(300),
        Surroundings { motion: &motion, optics: &level_ground() },
    );
    let met: Vec<_> =
        sweep.returns.iter().zip(&labels).filter(|(_, label)| label.class != Class::Sky).collect();
    let lost = met.iter().filter(|(one, _)| one.range_m.is_none()).count();
    let count = met.len() as f64;
    assert!((lost as f64 - 0.1 * count).abs() < 4.0 * (0.09 * count).sqrt(), "{lost} of {count} lost");
    let errors: Vec<f64> = met
        .iter()
        .filter_map(|(one, label)| {
            let laser = vlp16::laser_of(one.ring);
            let along =
                one.range_m? * one.elevation_rad.cos() / vlp16::ELEVATION_DEG[laser].to_radians().cos();
            Some(along - f64::from(label.range_m))
        })
        .collect();
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let variance = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n;
    // Rounding to 2 mm adds a twelfth of its square.
    let law = 0.02_f64.powi(2) + 0.002_f64.powi(2) / 12.0;
    assert!(mean.abs() < 4.0 * (law / n).sqrt());
    assert!((variance - law).abs() < 4.0 * law * (2.0 / n).sqrt());
}

#[test]
fn an_os1s_columns_fire_all_beams_at_once_where_its_table_says() {
    let spec = LidarSpec {
        dropout_ratio: 0.0,
        range_noise_m: 0.0,
        ..LidarSpec::of(LidarModel::embedded("os1-16").unwrap())
    };
    let mount = Pose::translation(0.0, 0.0, 0.16);
    let mut lidar = Lidar::new(&spec, Span::from_millis(100), mount, Seed(1).stream("lidar"));
    let (motion, _) = moving();
    let optics = level_ground();
    for turn in 1..=3 {
        let end = Time::SIMULATION_START + Span::from_millis(100) * turn;
        let (sweep, _) = lidar.sweep(end, Surroundings { motion: &motion, optics: &optics });
        assert_eq!((sweep.start, sweep.end, sweep.rings), (end + Span::from_millis(-100), end, 16));
        assert_eq!(sweep.returns.len(), 16 * 1024);
        for (n, one) in sweep.returns.iter().enumerate() {
            let (column, beam) = (n / 16, n % 16);
            assert_eq!(one.fired_after.nanos(), column as i64 * 100_000_000 / 1024);
            assert_eq!(one.ring, 15 - beam as u16);
            let azimuth_rad = std::f64::consts::PI
                - TAU * column as f64 / 1024.0
                - spec.model.beams.azimuth_deg[beam].to_radians();
            let elevation_rad = spec.model.beams.elevation_deg[beam].to_radians();
            // The beams leave the sensor 16 mm off its axis, which turns a point's bearing by that over its range.
            let bound = one.range_m.map_or(1e-9, |range_m| 0.016 / range_m);
            assert!(arborloop_base::wrap_angle(one.azimuth_rad - azimuth_rad).abs() <= bound, "{one:?}");
            assert!((one.elevation_rad - elevation_rad).abs() <= bound, "{one:?}");
        }
    }
}

#[test]
fn an_os1s_sweep_and_footprints_put_back_with_true_poses_restore_the_ground() {
    let mount = Pose::translation(0.0, 0.0, 0.16);
    let (motion, pose) = moving();
    let optics = level_ground();
    for (name, sub_rays) in [("os1-16", 1), ("os1-16", 7), ("vlp16", 5)] {
        let spec = LidarSpec {
            dropout_ratio: 0.0,
            range_noise_m: 0.0,
            sub_rays,
            ..LidarSpec::of(LidarModel::embedded(name).unwrap())
        };
        let mut lidar = Lidar::new(&spec, Span::from_millis(100), mount, Seed(1).stream("lidar"));
        let end = Time::SIMULATION_START + Span::from_millis(300);
        let (sweep, _) = lidar.sweep(end, Surroundings { motion: &motion, optics: &optics });
        let mut ground = 0;
        for one in &sweep.returns {
            let Some(point) = one.point() else { continue };
            let height_m = (pose(sweep.start + one.fired_after) * mount * point).z;
            // Half a wire's step along the beam; of the VLP-16 1.5 steps of azimuth; a footprint's mean stays within it.
            let wire =
                if name == "vlp16" { 0.001 + 1.5 * TAU / 36_000.0 * one.range_m.unwrap() } else { 0.0005 };
            let half_rad = if sub_rays == 1 { 0.0 } else { 0.5 * lidar.width_rad };
            let bound = wire + half_rad * one.range_m.unwrap() + 1e-4;
            assert!(
                height_m.abs() < bound,
                "{name}, {sub_rays} rays: {height_m} m above the plane at {one:?}"
            );
            ground += 1;
        }
        assert!(ground > 5_000, "{name}: {ground}");
    }
}
