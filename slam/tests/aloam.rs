//! The baseline from outside, where its method is at home: a room of walls and pillars, seen by exact geometry.

use arborloop_base::{Estimate, Observation, Pose2, Return, Span, Sweep, Time, planar, pose2, wrap_angle};
use arborloop_slam::{Rig, build_default};
use nalgebra::{Point2, Vector2};
use std::f64::consts::{PI, TAU};

/// Half the sides of the room, and its floor and ceiling from the lidar, meters.
const HALF_M: Vector2<f64> = Vector2::new(6.0, 5.0);
const FLOOR_M: f64 = -0.5;
const CEILING_M: f64 = 2.5;
/// Pillars from floor to ceiling: center and radius, meters.
const PILLARS: [(f64, f64, f64); 4] =
    [(3.0, 2.0, 0.15), (-2.0, 3.0, 0.2), (-3.5, -2.5, 0.15), (2.0, -3.5, 0.1)];

/// Level distance from a place along a unit direction to the nearest pillar or wall.
fn level_m(from: &Point2<f64>, along: &Vector2<f64>) -> f64 {
    let pillars = PILLARS.iter().filter_map(|(x, y, radius)| {
        let to = Point2::new(*x, *y) - from;
        let ahead = to.dot(along);
        let square = radius * radius - (to.norm_squared() - ahead * ahead);
        (square > 0.0 && ahead > 0.0).then(|| ahead - square.sqrt())
    });
    let walls = (0..2).map(|axis| (HALF_M[axis] * along[axis].signum() - from[axis]) / along[axis]);
    pillars.chain(walls).fold(f64::INFINITY, f64::min)
}

/// A rolling sweep of sixteen rings in 0.1 s that ends at `end_s`; `pose_at` is the lidar at seconds.
fn sweep(pose_at: impl Fn(f64) -> Pose2, end_s: f64) -> Sweep {
    let end = Time::SIMULATION_START + Span::from_seconds(end_s);
    let start = end - Span::from_millis(100);
    let returns = (0..1800).flat_map(|column| {
        let after = Span::from_nanos(i64::from(column) * 55_555);
        let pose = pose_at(end_s - 0.1 + after.seconds());
        let bearing = wrap_angle(PI - TAU * f64::from(column) / 1800.0);
        let along = pose.rotation * Vector2::new(bearing.cos(), bearing.sin());
        let side_m = level_m(&Point2::from(pose.translation.vector), &along);
        (0..16_u16).map(move |ring| {
            let elevation_rad = (2.0 * f64::from(ring) - 15.0).to_radians();
            let flat_m = if elevation_rad < 0.0 { FLOOR_M } else { CEILING_M } / elevation_rad.tan();
            Return {
                azimuth_rad: bearing,
                elevation_rad,
                range_m: Some(side_m.min(flat_m) / elevation_rad.cos()),
                ring,
                number: 0,
                fired_after: after,
                intensity: 0.0,
            }
        })
    });
    Sweep { start, end, rings: 16, returns: returns.collect() }
}

fn run(pose_at: impl Fn(f64) -> Pose2, sweeps: u32) -> Vec<(Estimate, Pose2)> {
    let mut slam = build_default("aloam", &Rig::default()).expect("the name is the crate's own");
    let each = (1..=sweeps).map(|n| {
        let end_s = 0.1 * f64::from(n);
        let seen = Observation::Sweep(sweep(&pose_at, end_s));
        (slam.observe(&seen).expect("every sweep is answered"), pose_at(end_s))
    });
    each.collect()
}

/// At rest for half a second, then along an arc of 2 m radius at 0.5 m/s.
fn arc(seconds: f64) -> Pose2 {
    let turn = 0.25 * (seconds - 0.5).max(0.0);
    pose2(2.0 * turn.sin(), 2.0 - 2.0 * turn.cos(), turn)
}

fn worst(path: &[(Estimate, Pose2)]) -> (f64, f64) {
    let each = path.iter().map(|(estimate, pose)| {
        let off = pose.inverse() * planar(&estimate.map_from_base);
        (off.translation.vector.norm(), off.rotation.angle().abs())
    });
    each.fold((0.0, 0.0), |worst, one| (f64::max(worst.0, one.0), f64::max(worst.1, one.1)))
}

#[test]
fn aloam_follows_a_walk_through_a_room_of_walls_and_pillars() {
    let (position_m, heading_rad) = worst(&run(arc, 60));
    // Half a sweep of walking is 2.5 cm and 0.0125 rad: points are taken as met at once, so as much is smeared.
    assert!(position_m < 0.05 && heading_rad < 0.0125, "{position_m} m, {heading_rad} rad");
}

#[test]
fn aloam_stays_put_in_a_room_that_does_not_move() {
    let (position_m, heading_rad) = worst(&run(|_| Pose2::identity(), 10));
    // Points are matched with means of voxels of 0.2 m: a twentieth of that is what the corners of the room may pull.
    assert!(position_m < 0.01 && heading_rad < 1e-3, "{position_m} m, {heading_rad} rad");
}
