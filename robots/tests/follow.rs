//! The follower on the paper's rectangle, walked by a perfect unicycle and by the trot.

use arborloop_base::{Pose2, Seed, Span, planar, pose2};
use arborloop_robots::{
    Command, Follower, FollowerSettings, Ground, KinematicTrot, Progress, Route, TrotSettings, TrunkMotion,
};
use nalgebra::Point2;

const RECTANGLE: [[f64; 2]; 4] = [[0.0, 0.0], [6.0, 0.0], [6.0, 2.0], [0.0, 2.0]];

struct Flat;

impl Ground for Flat {
    fn height_m(&self, _: f64, _: f64) -> f64 {
        0.0
    }
}

fn rectangle(laps: u32) -> Route {
    Route { waypoints_m: RECTANGLE.to_vec(), closed: true, laps }
}

/// Walks by a unicycle that does what it is told, steered at 50 Hz, until finished or out of time.
fn ride(route: Route, seconds: f64) -> (Vec<Point2<f64>>, Vec<Progress>) {
    let mut follower = Follower::new(route, FollowerSettings::default());
    let mut start_from_base = Pose2::identity();
    let (mut places, mut progress) = (Vec::new(), Vec::new());
    for _ in 0..(seconds * 50.0) as usize {
        let command = follower.steer(&start_from_base);
        let moved = pose2(command.forward_mps * 0.02, 0.0, command.turn_radps * 0.02);
        start_from_base *= moved;
        places.push(start_from_base.translation.vector.into());
        progress.push(follower.progress());
        if follower.progress().finished {
            break;
        }
    }
    (places, progress)
}

/// Distance of a place from the rectangle's outline.
fn off_rectangle(place: &Point2<f64>) -> f64 {
    let beyond = |value: f64, most: f64| (value - most / 2.0).abs() - most / 2.0;
    let (x, y) = (beyond(place.x, 6.0), beyond(place.y, 2.0));
    if x > 0.0 || y > 0.0 { x.max(0.0).hypot(y.max(0.0)) } else { -x.max(y) }
}

fn report(places: &[Point2<f64>]) -> (f64, f64) {
    let corner_cut = RECTANGLE
        .iter()
        .map(|[x, y]| places.iter().map(|p| (p - Point2::new(*x, *y)).norm()).fold(f64::MAX, f64::min))
        .fold(0.0, f64::max);
    (places.iter().map(off_rectangle).fold(0.0, f64::max), corner_cut)
}

#[test]
fn five_laps_of_the_rectangle_are_walked_and_finished_where_they_began() {
    let (places, progress) = ride(rectangle(5), 300.0);
    let last = progress[progress.len() - 1];
    assert!(last.finished, "{last:?}");
    assert!((last.distance_m - 80.0).abs() <= 0.03 + 1e-9);
    assert!(places[places.len() - 1].coords.norm() < 0.1, "ends at {}", places[places.len() - 1]);
    assert!(progress.windows(2).all(|pair| pair[0].distance_m <= pair[1].distance_m));
    assert!(progress.iter().any(|p| p.lap == 4));
}

#[test]
fn corners_are_cut_by_a_quarter_of_a_metre_at_most() {
    let (off_m, corner_m) = report(&ride(rectangle(5), 300.0).0);
    println!("unicycle: off the route {off_m:.3} m, nearest to a corner {corner_m:.3} m");
    assert!(off_m < 0.25 && corner_m < 0.25, "{off_m} {corner_m}");
}

#[test]
fn the_trot_walks_the_rectangle_as_narrowly() {
    let tick = Span::from_millis(2);
    let mut trot = KinematicTrot::new(TrotSettings::default(), pose2(0.0, 0.0, 0.0), tick, &Flat, Seed(4));
    let mut follower = Follower::new(rectangle(5), FollowerSettings::default());
    let mut command = Command::default();
    let mut places = Vec::new();
    for step in 0..150_000 {
        if step % 50 == 0 {
            command = follower.steer(&planar(&trot.state().world_from_base));
        }
        trot.advance(&command, &Flat);
        places.push(Point2::from(trot.state().world_from_base.translation.vector.xy()));
    }
    let (off_m, corner_m) = report(&places);
    println!("trot: off the route {off_m:.3} m, nearest to a corner {corner_m:.3} m");
    assert!(follower.progress().finished);
    assert!(off_m < 0.25 && corner_m < 0.25, "{off_m} {corner_m}");
    assert!(places[places.len() - 1].coords.norm() < 0.15, "ends at {}", places[places.len() - 1]);
}

#[test]
fn a_route_of_no_length_is_finished_at_once() {
    for waypoints_m in [vec![], vec![[1.0, 2.0]], vec![[1.0, 2.0], [1.0, 2.0]]] {
        for closed in [false, true] {
            let route = Route { waypoints_m: waypoints_m.clone(), closed, laps: 3 };
            let mut follower = Follower::new(route, FollowerSettings::default());
            assert!(follower.progress().finished);
            assert_eq!(follower.steer(&pose2(5.0, 5.0, 1.0)), Command::default());
        }
    }
}

#[test]
fn an_open_route_ends_at_its_last_waypoint() {
    let route = Route { waypoints_m: vec![[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]], closed: false, laps: 9 };
    let (places, progress) = ride(route, 60.0);
    assert!(progress[progress.len() - 1].finished);
    assert!((places[places.len() - 1] - Point2::new(3.0, 4.0)).norm() < 0.1);
}

#[test]
fn an_estimate_that_is_not_finite_moves_nothing_and_forgets_nothing() {
    let mut follower = Follower::new(rectangle(1), FollowerSettings::default());
    follower.steer(&pose2(0.5, 0.0, 0.0));
    let before = follower.progress();
    assert_eq!(follower.steer(&pose2(f64::NAN, 0.0, 0.0)), Command::default());
    assert_eq!(follower.steer(&pose2(0.0, f64::INFINITY, 0.0)), Command::default());
    assert_eq!(follower.steer(&pose2(0.0, 0.0, f64::NAN)), Command::default());
    assert_eq!(follower.progress(), before);
    assert!(follower.steer(&pose2(0.6, 0.0, 0.0)).forward_mps > 0.0);
}

#[test]
fn a_pose_that_jumps_across_the_field_takes_no_shortcut() {
    let mut follower = Follower::new(rectangle(2), FollowerSettings::default());
    follower.steer(&pose2(1.0, 0.0, 0.0));
    follower.steer(&pose2(1.0, 2.0, 0.0));
    // The window ahead is a meter: the far side, twelve meters on, is not reached by looking.
    assert!(follower.progress().distance_m <= 2.0);
}

#[test]
fn routes_and_settings_that_lead_nowhere_are_refused_by_name() {
    let mut route = rectangle(1);
    route.waypoints_m[2][1] = f64::NAN;
    assert_eq!(route.check().unwrap_err().key, "waypoints_m[2].y");
    assert_eq!(rectangle(0).check().unwrap_err().key, "laps");
    let settings = FollowerSettings { look_ahead_m: 0.0, ..FollowerSettings::default() };
    assert_eq!(settings.check().unwrap_err().key, "look_ahead_m");
    assert!(toml::from_str::<Route>("waypoints_m = []\nlap = 1").is_err());
}
