//! The systems from outside: accuracy against exact geometry, symmetry, bad input.

mod grove;

use arborloop_base::{
    Cell, Estimate, Health, Observation, Odometry, Pose, Pose2, Seed, Sweep, Time, Twist, planar, pose2,
    wrap_angle,
};
use arborloop_slam::{NAMES, Rig, build_default};
use grove::{Grove, beam};
use nalgebra::{Matrix3, Point2, Vector3};
use proptest::prelude::*;

const SYSTEMS: [&str; 2] = ["mhd", "mhd-paper"];

fn run(name: &str, sweeps: impl IntoIterator<Item = Sweep>) -> Vec<Estimate> {
    let mut slam = build_default(name, &Rig::default()).expect("the names are the crate's own");
    let answer = |sweep| slam.observe(&Observation::Sweep(sweep)).expect("every sweep is answered");
    sweeps.into_iter().map(answer).collect()
}

fn at(seconds: f64) -> Time {
    Time::SIMULATION_START + arborloop_base::Span::from_seconds(seconds)
}

/// Largest distance (meters) and heading difference (radians) between estimates and poses.
fn apart(estimates: &[Estimate], poses: &[Pose2]) -> (f64, f64) {
    let each = estimates.iter().zip(poses).map(|(estimate, pose)| {
        let found = planar(&estimate.map_from_base);
        let off = pose.inverse() * found;
        (off.translation.vector.norm(), off.rotation.angle().abs())
    });
    each.fold((0.0, 0.0), |worst, one| (f64::max(worst.0, one.0), f64::max(worst.1, one.1)))
}

/// A walk along an arc of 3 m radius, beginning at the origin along x at rest and speeding up to 0.6 m/s.
fn walk(seconds: f64) -> Pose2 {
    let way_m = if seconds < 1.0 { 0.3 * seconds * seconds } else { 0.6 * seconds - 0.3 };
    let turn = way_m / 3.0;
    pose2(3.0 * turn.sin(), 3.0 - 3.0 * turn.cos(), turn)
}

fn scans(turn_rad: f64) -> (Vec<Sweep>, Vec<Pose2>) {
    let grove = Grove::new();
    (0..40)
        .map(|n| {
            let pose = walk(0.3 * f64::from(n));
            (grove.scan(&pose, at(0.3 * f64::from(n)), turn_rad), pose)
        })
        .unzip()
}

#[test]
fn mhd_follows_a_walk_past_posts_to_half_a_cell_with_planar_scans() {
    let (sweeps, poses) = scans(0.0);
    let estimates = run("mhd", sweeps);
    let (position_m, heading_rad) = apart(&estimates, &poses);
    // Cells are 0.1 m and the posts stand 4 m away and more.
    assert!(position_m < 0.05 && heading_rad < 0.05 / 4.0, "{position_m} m, {heading_rad} rad");
    assert!(estimates.iter().all(|estimate| estimate.health == Health::Tracking));
}

#[test]
fn mhd_follows_a_walk_past_posts_to_half_a_cell_with_rolling_sweeps() {
    let grove = Grove::new();
    let (sweeps, poses): (Vec<Sweep>, Vec<Pose2>) = (1..100)
        .map(|n| {
            let end_s = 0.1 * f64::from(n);
            // The first sweep is seen at rest: the map's origin is its end.
            (
                grove.sweep(|after_s| walk(f64::max(end_s - 0.2 + after_s, 0.0)), at(end_s)),
                walk((end_s - 0.1).max(0.0)),
            )
        })
        .unzip();
    let (position_m, heading_rad) = apart(&run("mhd", sweeps), &poses);
    assert!(position_m < 0.05 && heading_rad < 0.05 / 4.0, "{position_m} m, {heading_rad} rad");
}

/// The walk seen by rolling sweeps whose ranges have a noise of 2 cm; the pose at each sweep's end beside it.
fn noisy_walk(seed: u64) -> (Vec<Sweep>, Vec<Pose2>) {
    let grove = Grove::new();
    let noise = Seed(seed).stream("range");
    let sweep_at = |n: u32| {
        let end_s = 0.1 * f64::from(n);
        let mut sweep = grove.sweep(|after_s| walk(f64::max(end_s - 0.2 + after_s, 0.0)), at(end_s));
        let mut draws = noise.at(n.into());
        for range_m in sweep.returns.iter_mut().filter_map(|one| one.range_m.as_mut()) {
            *range_m += 0.02 * draws.normal();
        }
        (sweep, walk((end_s - 0.1).max(0.0)))
    };
    (1..80).map(sweep_at).unzip()
}

/// How much too long, as a share, `mhd` finds the way between two rows of trunks, three meters apart, from end to end.
fn stretch_between_rows_of(radius_m: f64) -> f64 {
    let trunk = |n: u32| {
        let side_m = if n.is_multiple_of(2) { 1.6 } else { -1.8 };
        (Point2::new(1.5 * f64::from(n) - 6.0 + 0.4 * f64::from(n % 5), side_m), radius_m)
    };
    let avenue = Grove((0..30).map(trunk).collect());
    let (noise, pace_mps, sweeps) = (Seed(5).stream("range"), 0.8, 250);
    let place = |seconds: f64| pose2(pace_mps * seconds.max(0.0), 0.0, 0.0);
    let sweep_at = |n: u32| {
        let end_s = 0.1 * f64::from(n);
        let mut sweep = avenue.sweep(|after_s| place(end_s - 1.1 + after_s), at(end_s));
        let mut draws = noise.at(n.into());
        for range_m in sweep.returns.iter_mut().filter_map(|one| one.range_m.as_mut()) {
            *range_m += 0.02 * draws.normal();
        }
        sweep
    };
    let estimates = run("mhd", (1..=sweeps).map(sweep_at));
    let way_m = place(0.1 * f64::from(sweeps) - 1.0).translation.vector.x;
    let found_m = estimates.last().expect("every sweep is answered").map_from_base.translation.vector.x;
    found_m / way_m - 1.0
}

#[test]
fn between_rows_of_trunks_mhd_finds_the_way_as_long_as_it_is() {
    for radius_m in [0.04, 0.06, 0.09, 0.12] {
        let off = stretch_between_rows_of(radius_m);
        assert!(off.abs() < 0.0015, "trunks of {radius_m} m: {:.2} %", 100.0 * off);
    }
}

#[test]
fn the_covariance_of_mhd_holds_its_errors() {
    let mut squares = Vec::new();
    for seed in 1..=3 {
        let (sweeps, poses) = noisy_walk(seed);
        for (estimate, pose) in run("mhd", sweeps).iter().zip(&poses) {
            let Some(covariance) = estimate.covariance else { continue };
            let found = planar(&estimate.map_from_base);
            let off = found.translation.vector - pose.translation.vector;
            let turn = wrap_angle(found.rotation.angle() - pose.rotation.angle());
            let off = Vector3::new(off.x, off.y, turn);
            let planar = Matrix3::from_fn(|i, j| covariance[([0, 1, 5][i], [0, 1, 5][j])]);
            let weighted = planar.try_inverse().unwrap() * off;
            squares.push(off.dot(&weighted) / 3.0);
        }
    }
    assert!(squares.len() > 200);
    // The mean of n independent squares is 1 with standard deviation sqrt(2 / 3n). Errors of neighboring sweeps go
    // together, some ten sweeps long, so n is a tenth of the sweeps. The map's own share makes the covariance generous.
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    let n = squares.len() as f64 / 10.0;
    assert!(mean < 1.0 + 4.0 * (2.0 / (3.0 * n)).sqrt() && mean > 0.05, "{mean}");
}

#[test]
fn mhd_carried_off_by_a_meter_or_blind_while_it_walks_is_never_wrong_without_saying_so() {
    let grove = Grove::new();
    let carried = |n: u32| match n {
        0..20 => pose2(0.02 * f64::from(n), 0.0, 0.0),
        _ => pose2(0.02 * f64::from(n) - 0.6, 0.8, 0.5),
    };
    for (name, blind) in [("carried", 0..0), ("carried blindly", 15..35)] {
        let mut slam = build_default("mhd", &Rig::default()).unwrap();
        for n in 0..60 {
            let mut sweep = grove.sweep(|_| carried(n), at(0.1 * f64::from(n)));
            if blind.contains(&n) {
                sweep.returns.iter_mut().for_each(|one| one.range_m = None);
            }
            let estimate = slam.observe(&Observation::Sweep(sweep)).unwrap();
            let off = carried(n).inverse() * planar(&estimate.map_from_base);
            let right = off.translation.vector.norm() < 0.1 && off.rotation.angle().abs() < 0.05;
            assert!(right || estimate.health != Health::Tracking, "{name}, sweep {n}: {off:?}");
            assert!(right || n < 45, "{name}, sweep {n}: not found again");
        }
    }
}

#[test]
fn icp2d_follows_a_walk_past_posts_to_a_cell() {
    let (sweeps, poses) = scans(0.0);
    let (position_m, heading_rad) = apart(&run("icp2d", sweeps), &poses);
    // Cells are 0.1 m and the posts stand 4 m away and more.
    assert!(position_m < 0.1 && heading_rad < 0.1 / 4.0, "{position_m} m, {heading_rad} rad");
}

#[test]
fn mhd_paper_follows_a_walk_past_posts_to_the_thickness_of_its_obstacles() {
    // The cadence that its noises are made for: a scan every 4.5 s and 0.27 m.
    let grove = Grove::new();
    let (sweeps, poses): (Vec<Sweep>, Vec<Pose2>) = (0..40)
        .map(|n| {
            let pose = walk(0.45 * f64::from(n));
            (grove.scan(&pose, at(4.5 * f64::from(n)), 0.0), pose)
        })
        .unzip();
    let (position_m, heading_rad) = apart(&run("mhd-paper", sweeps), &poses);
    // An obstacle is drawn 0.12 m thick; headings are tried every 0.03 rad.
    assert!(position_m < 0.12 && heading_rad < 0.03, "{position_m} m, {heading_rad} rad");
}

#[test]
fn turning_all_bearings_turns_the_answers_of_mhd() {
    // The lidar turned on its mount by 0.3 rad is a robot that heads 0.3 rad to the other side.
    let turn_rad = 0.3;
    let straight = run("mhd", scans(0.0).0);
    let turned = run("mhd", scans(turn_rad).0);
    let turn = pose2(0.0, 0.0, turn_rad);
    for (a, b) in straight.iter().zip(&turned) {
        let expected = turn * planar(&a.map_from_base) * turn.inverse();
        let off = expected.inverse() * planar(&b.map_from_base);
        // The rasters lie otherwise under the same points: both answers are good to half a cell.
        assert!(off.translation.vector.norm() < 0.1 && off.rotation.angle().abs() < 0.025, "{off:?}");
    }
}

#[test]
fn a_turn_of_two_radians_between_two_scans_is_found() {
    let grove = Grove::new();
    let poses = [pose2(0.0, 0.0, 0.0), pose2(0.1, 0.0, 0.1), pose2(0.3, 0.1, 2.1), pose2(0.3, 0.3, -2.0)];
    let sweeps = poses.iter().enumerate().map(|(n, pose)| grove.scan(pose, at(4.5 * n as f64), 0.0));
    let (position_m, heading_rad) = apart(&run("mhd", sweeps), &poses);
    assert!(position_m < 0.05 && heading_rad < 0.0125, "{position_m} m, {heading_rad} rad");
}

#[test]
fn a_system_answers_the_same_whether_or_not_it_is_told_to_settle() {
    let (sweeps, _) = scans(0.0);
    for name in NAMES {
        let mut told = build_default(name, &Rig::default()).unwrap();
        let settled: Vec<Estimate> = sweeps
            .iter()
            .map(|sweep| {
                let answer = told.observe(&Observation::Sweep(sweep.clone())).unwrap();
                told.settle();
                answer
            })
            .collect();
        assert!(settled == run(name, sweeps.clone()), "{name}");
    }
}

#[test]
fn a_robot_that_stands_stays_put_and_is_told_free_from_occupied() {
    let grove = Grove::new();
    for name in SYSTEMS {
        let rig = Rig { base_from_lidar: Pose::translation(0.1, 0.0, 0.2) };
        let mut slam = build_default(name, &rig).unwrap();
        for n in 0..5 {
            // The lidar stands 0.1 m ahead of the base.
            let sweep = grove.scan(&pose2(0.1, 0.0, 0.0), at(f64::from(n)), 0.0);
            let estimate = slam.observe(&Observation::Sweep(sweep)).unwrap();
            assert!(estimate.map_from_base.translation.vector.norm() < 0.02, "{name}: {estimate:?}");
        }
        slam.settle();
        let map = slam.map().unwrap();
        let cell = |x: f64, y: f64| {
            let (column, row) = map.index_of(&nalgebra::Point2::new(x, y)).unwrap();
            *map.get(column, row).unwrap()
        };
        let (center, radius) = grove.0[0];
        let toward = -center.coords.normalize();
        let face = center + toward * radius;
        let near = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (f64::from(i), f64::from(j))));
        let mut around = near.map(|(i, j)| cell(face.x + 0.1 * i, face.y + 0.1 * j));
        assert!(around.any(|cell| cell == Cell::Occupied), "{name}");
        assert_eq!(cell(center.x * 0.5, center.y * 0.5), Cell::Free, "{name}");
    }
}

#[test]
fn odometry_carries_mhd_paper_through_scans_that_show_nothing() {
    let mut slam = build_default("mhd-paper", &Rig::default()).unwrap();
    let grove = Grove::new();
    slam.observe(&Observation::Sweep(grove.scan(&pose2(0.0, 0.0, 0.0), at(0.0), 0.0)));
    for n in 1..=4 {
        let stamp = at(f64::from(n));
        slam.observe(&Observation::Odometry(Odometry { stamp, twist: Twist::planar(0.5, 0.0) }));
        let blind = Sweep { start: stamp, end: stamp, rings: 1, returns: Vec::new() };
        let estimate = slam.observe(&Observation::Sweep(blind)).unwrap();
        assert_eq!(estimate.health, Health::Degraded);
        assert!((estimate.map_from_base.translation.x - 0.5 * f64::from(n)).abs() < 1e-9);
    }
}

#[test]
fn every_sweep_is_answered_at_its_end_and_nothing_else_is_answered() {
    for name in NAMES {
        let mut slam = build_default(name, &Rig::default()).unwrap();
        let twist = Odometry { stamp: at(0.0), twist: Twist::planar(1.0, 0.0) };
        assert_eq!(slam.observe(&Observation::Odometry(twist)), None);
        let sweep = Sweep { start: at(0.1), end: at(0.2), rings: 16, returns: Vec::new() };
        let estimate = slam.observe(&Observation::Sweep(sweep)).unwrap();
        assert_eq!((estimate.stamp, estimate.map_from_base), (at(0.2), Pose::identity()));
    }
}

#[test]
fn a_blind_system_says_that_it_is_lost_and_recovers_when_it_sees_again() {
    let grove = Grove::new();
    let mut slam = build_default("mhd", &Rig::default()).unwrap();
    let mut health = Vec::new();
    for n in 0..40 {
        let stamp = at(0.1 * f64::from(n));
        let mut sweep = grove.scan(&pose2(0.0, 0.0, 0.0), stamp, 0.0);
        if (10..25).contains(&n) {
            sweep.returns.iter_mut().for_each(|one| one.range_m = None);
        }
        health.push(slam.observe(&Observation::Sweep(sweep)).unwrap().health);
    }
    assert!(health[..10].iter().all(|health| *health == Health::Tracking));
    assert!(health[10..15].iter().all(|health| *health == Health::Degraded));
    assert_eq!(health[24], Health::Lost);
    assert!(health[25..].iter().all(|health| *health == Health::Tracking));
}

#[test]
fn ground_alone_is_no_landmark() {
    // Sixteen rings over a bare plane: whatever the robot does, no feature may pretend to know.
    let bare = Grove(Vec::new());
    let estimates = run("mhd", (1..6).map(|n| bare.sweep(|_| pose2(0.0, 0.0, 0.0), at(0.1 * f64::from(n)))));
    assert!(estimates.iter().all(|estimate| estimate.health != Health::Tracking));
}

#[test]
fn absurd_stamps_and_odometry_leave_the_estimates_finite() {
    let grove = Grove::new();
    for name in NAMES {
        let mut slam = build_default(name, &Rig::default()).unwrap();
        let nanos = [0, 1, 2, 3, -5, 3, i64::from(u32::MAX) * 1_000_000_000, 4];
        for (n, nanos) in nanos.into_iter().enumerate() {
            for forward_mps in [1e12, f64::NAN] {
                let twist = Twist::planar(forward_mps, 1e9);
                slam.observe(&Observation::Odometry(Odometry { stamp: Time::from_nanos(nanos), twist }));
            }
            let sweep = grove.scan(&pose2(0.2 * n as f64, 0.0, 0.0), Time::from_nanos(nanos), 0.0);
            let pose = slam.observe(&Observation::Sweep(sweep)).unwrap().map_from_base;
            assert!(
                pose.translation.vector.iter().chain(&pose.rotation.coords).all(|n| n.is_finite()),
                "{name}"
            );
        }
    }
}

fn any_range() -> impl Strategy<Value = Option<f64>> {
    prop_oneof![
        Just(None),
        Just(Some(f64::NAN)),
        Just(Some(f64::INFINITY)),
        Just(Some(-1.0)),
        Just(Some(0.0)),
        (0.1..150.0_f64).prop_map(Some),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_sweep_makes_an_estimate_that_is_not_finite(
        sweeps in prop::collection::vec(
            (0_u16..20, prop::collection::vec((-4.0..7.0_f64, -2.0..2.0_f64, any_range(), 0_u16..40, -1.0..1.0_f64), 0..60), -1.0..2.0_f64),
            1..6,
        )
    ) {
        for name in NAMES {
            let mut slam = build_default(name, &Rig::default()).unwrap();
            for (n, (rings, returns, lasts_s)) in sweeps.iter().enumerate() {
                let end = at(n as f64 * 0.1);
                let returns = returns.iter().map(|(azimuth, elevation, range_m, ring, after_s)| {
                    beam(*azimuth, *elevation, *range_m, *ring, arborloop_base::Span::from_seconds(*after_s))
                });
                let start = end - arborloop_base::Span::from_seconds(*lasts_s);
                let sweep = Sweep { start, end, rings: *rings, returns: returns.collect() };
                let estimate = slam.observe(&Observation::Sweep(sweep)).unwrap();
                prop_assert_eq!(estimate.stamp, end);
                let pose = estimate.map_from_base;
                prop_assert!(pose.translation.vector.iter().all(|n| n.is_finite()));
                prop_assert!(pose.rotation.coords.iter().all(|n| n.is_finite()));
                prop_assert!(wrap_angle(planar(&pose).rotation.angle()).is_finite());
                prop_assert!(estimate.covariance.is_none_or(|c| c.iter().all(|n| n.is_finite())));
            }
            let _ = slam.map();
        }
    }
}
