//! Where beams point, turn by turn: every rate and mode, the seam between turns, mounts, and the wires' steps.

use super::super::*;
use super::scene::*;
use arborloop_base::vlp16::{self, LASERS};
use arborloop_base::{Return, Seed, wrap_angle};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use std::f64::consts::{PI, TAU};

fn exact(name: &str, change: impl Fn(&mut LidarSpec), mount: Pose) -> Lidar {
    let mut spec = LidarSpec {
        range_noise_m: 0.0,
        dropout_ratio: 0.0,
        ..LidarSpec::of(LidarModel::embedded(name).unwrap())
    };
    change(&mut spec);
    let period = Span::from_seconds(1.0 / spec.rate_hz);
    Lidar::new(&spec, period, mount, Seed(1).stream("lidar"))
}

fn turns(lidar: &mut Lidar, scene: &Optics) -> [Sweep; 3] {
    let motion = standing();
    [1, 2, 3].map(|number| {
        let end = Time::SIMULATION_START + lidar.period() * number;
        lidar.sweep(end, Surroundings { motion: &motion, optics: scene }).0
    })
}

#[test]
fn at_every_rate_a_vlp16_turns_evenly_across_the_seam_between_turns() {
    let scene = optics(Vec::new(), Vec::new());
    for rate_hz in [5.0, 10.0, 20.0] {
        let mut lidar = exact("vlp16", |spec| spec.rate_hz = rate_hz, Pose::translation(0.0, 0.0, HEIGHT_M));
        let all: Vec<Return> =
            turns(&mut lidar, &scene).into_iter().flat_map(|sweep| sweep.returns).collect();
        // Clockwise by 360 degrees x rate x 55.296 us from cycle to cycle, 0.1991 degrees at 10 Hz, within a wire's step.
        let step_rad = TAU * rate_hz * 55.296e-6;
        for laser in 0..LASERS {
            let bearings: Vec<f64> =
                all.iter().skip(laser).step_by(LASERS).map(|one| one.azimuth_rad).collect();
            for pair in bearings.windows(2) {
                let stepped = wrap_angle(pair[0] - pair[1]);
                assert!((stepped - step_rad).abs() < 1.01 * 0.01_f64.to_radians(), "{rate_hz} Hz: {stepped}");
            }
            // Three turns in all: nothing doubled, nothing left out.
            let turned = bearings.len() as f64 * step_rad / TAU;
            assert!((turned - 3.0).abs() < 1.01 * step_rad / TAU, "{turned} turns");
        }
    }
}

#[test]
fn in_every_mode_an_os1s_beams_look_off_their_columns_by_their_own_offset() {
    let scene = optics(Vec::new(), Vec::new());
    for (columns, rate_hz) in [(512, 10.0), (1024, 10.0), (2048, 10.0), (512, 20.0), (1024, 20.0)] {
        let change = |spec: &mut LidarSpec| (spec.columns, spec.rate_hz) = (Some(columns), rate_hz);
        // Up in the air, so that every firing is a miss and says its bearing exactly.
        let mut lidar = exact("os1-16", change, Pose::translation(0.0, 0.0, 60.0));
        let offsets = lidar.spec.model.beams.azimuth_deg.clone();
        for sweep in turns(&mut lidar, &scene) {
            assert_eq!(sweep.returns.len(), 16 * columns as usize);
            for (n, one) in sweep.returns.iter().enumerate() {
                let (column, beam) = (n / 16, n % 16);
                let encoder_rad = PI - TAU * column as f64 / f64::from(columns);
                let off_rad = wrap_angle(encoder_rad - one.azimuth_rad);
                assert!((off_rad - offsets[beam].to_radians()).abs() < 1e-9, "column {column}, beam {beam}");
                // A column is a turn's share of the time, whole nanoseconds rounded down.
                let after_ns = (1e9 / rate_hz) as i64 * column as i64 / i64::from(columns);
                assert_eq!(one.fired_after.nanos(), after_ns);
            }
        }
    }
}

#[test]
fn a_tilted_and_turned_mount_moves_every_beam_by_its_own_pose() {
    let lean = UnitQuaternion::from_euler_angles(0.12, -0.2, 1.1);
    let mount = Pose::from_parts(Vector3::new(0.3, -0.2, HEIGHT_M).into(), lean);
    for name in ["vlp16", "os1-16"] {
        let (sweep, _) = first_sweep(&mut exact(name, |_| (), mount), &optics(Vec::new(), Vec::new()));
        let mut met = 0;
        for one in &sweep.returns {
            // Whoever turns the point by the mount finds the ground under it; the wire's steps are as in the sweep tests.
            let Some(point) = one.point() else { continue };
            let bound_m = 0.001 + 1.5 * 0.01_f64.to_radians() * one.range_m.unwrap() + 1e-4;
            assert!((mount * point).z.abs() < bound_m, "{name}: {point}");
            met += 1;
        }
        assert!(met > 5000, "{name}: {met}");
        // A beam that returns nothing looks above the horizon, or meets soil of reflectance 0.25 where its light, falling
        // with the square of the range, is less than that of 10 % at 40 m; within the wire's steps.
        for one in sweep.returns.iter().filter(|one| one.range_m.is_none()) {
            let (up, flat) = one.elevation_rad.sin_cos();
            let along = lean * Vector3::new(flat * one.azimuth_rad.cos(), flat * one.azimuth_rad.sin(), up);
            let light = |down: f64| 0.25 * down * (down / HEIGHT_M).powi(2);
            assert!(along.z > -2e-3 || light(-along.z - 2e-3) < 0.1 / 1600.0, "{name}: {one:?}");
        }
    }
}

#[test]
fn a_vlp16_says_whole_steps_along_its_beams_and_an_os1_whole_millimeters_from_its_axis() {
    let scene = optics(vec![plate(7.0, 0.0, 5.0, 0.5, 0.3)], Vec::new());
    let whole = |value: f64| (value - value.round()).abs() < 1e-6;
    let mount = Pose::translation(0.0, 0.0, HEIGHT_M);
    let (sweep, _) = first_sweep(&mut exact("vlp16", |spec| spec.range_noise_m = 0.02, mount), &scene);
    for one in sweep.returns.iter().filter(|one| one.range_m.is_some()) {
        let laser = vlp16::laser_of(one.ring);
        let point = one.point().unwrap();
        let up = vlp16::ELEVATION_DEG[laser].to_radians();
        let along_m = point.x.hypot(point.y) * up.cos() + (point.z - vlp16::OFFSET_M[laser]) * up.sin();
        assert!(whole(along_m / vlp16::DISTANCE_STEP_M), "{along_m}");
        assert!(one.intensity.fract() == 0.0 && (1.0..=255.0).contains(&one.intensity));
    }
    let lidar = &mut exact("os1-16", |spec| spec.range_noise_m = 0.02, mount);
    let beams = lidar.spec.model.beams.clone();
    let (sweep, _) = first_sweep(lidar, &scene);
    for (n, one) in sweep.returns.iter().enumerate().filter(|(_, one)| one.range_m.is_some()) {
        let encoder_rad = PI - TAU * (n / 16) as f64 / 1024.0;
        let exit = Point3::new(beams.radius_m * encoder_rad.cos(), beams.radius_m * encoder_rad.sin(), 0.0);
        let from_exit_m = (one.point().unwrap() - exit).norm();
        assert!(whole((from_exit_m + beams.radius_m) * 1000.0), "{from_exit_m}");
    }
}
