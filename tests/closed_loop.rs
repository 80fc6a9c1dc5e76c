//! One lap of the paper's cone field, steered by what a system believes.

use crate::check::check;
use arborloop_sim::{Driver, End};
use std::sync::LazyLock;

/// The lap, walked once for all tests of this file: `mhd` steers, `still` sits beside it.
static LAP: LazyLock<crate::check::Run> = LazyLock::new(|| check(&[], &["mhd", "still"], Driver::System(0)));

#[test]
fn a_lap_steered_by_mhd_ends_at_its_start_and_touches_nothing() {
    assert_eq!(LAP.outcome.end, End::Finished);
    assert_eq!(LAP.outcome.contacts, []);
    // Arrival is 0.03 m before the end of the route: `arrival_m`.
    assert!(LAP.outcome.progress.finished && LAP.outcome.progress.remaining_m <= 0.03);
    // The lap is 16 m; pure pursuit cuts its three inner corners by less than the look-ahead of 0.6 m each.
    let score = LAP.score("mhd");
    assert!((14.0..19.0).contains(&score.path_length_m), "{} m walked", score.path_length_m);
    assert_eq!(score.coverage_ratio, 1.0);
    // Where it believes to be is off by the loop's error; from arrival it coasts for the latency and its own braking.
    let end = LAP.truth.poses()[LAP.truth.len() - 1].1.translation.vector.xy().norm();
    assert!(end <= 0.03 + score.loop_m + 0.1, "{end} m from the start");
}

#[test]
fn mhd_holds_the_bars_of_the_cone_field() {
    let score = LAP.score("mhd");
    let heading_deg = score.heading_mean_deg.unwrap();
    let said = format!(
        "position mean {:.4} m, heading mean {heading_deg:.3} deg, loop {:.4} m",
        score.position_mean_m, score.loop_m
    );
    println!("{said}");
    assert!(score.position_mean_m <= 0.05, "{said}");
    assert!(heading_deg <= 0.4, "{said}");
    assert!(score.loop_m <= 0.06, "{said}");
}

#[test]
fn a_system_that_believes_to_stand_still_is_as_wrong_as_the_robot_is_far() {
    // Over the boundary of the rectangle the mean distance from one corner is above half of the long side.
    let score = LAP.score("still");
    assert!(score.position_mean_m > 3.0, "{} m", score.position_mean_m);
    assert!(score.position_mean_m > 20.0 * LAP.score("mhd").position_mean_m);
    // It is the robot's own path that it misses: nothing else can be its error.
    let far =
        LAP.truth.poses().iter().map(|(_, pose)| pose.translation.vector.xy().norm()).fold(0.0, f64::max);
    assert!((score.position_max_m - far).abs() < 1e-9);
}

#[test]
fn a_driver_that_believes_to_stand_still_walks_out_of_the_field() {
    // It always believes to head for the first meter of the route: straight on, at walking speed, until the time is
    // up. The cones stand 0.9 m outside the rectangle, 6.9 m ahead.
    let lost = check(&["run.duration_s_max=20.0"], &["still"], Driver::System(0));
    assert_eq!(lost.outcome.end, End::TimeUp);
    assert!(!lost.outcome.progress.finished);
    assert!(lost.outcome.progress.distance_m < 0.1, "{:?}", lost.outcome.progress);
    let end = lost.truth.poses()[lost.truth.len() - 1].1.translation.vector;
    assert!(end.xy().norm() > 7.5, "ended at {end:?}");
    assert!(lost.score("still").position_mean_m > 20.0 * 0.05);
}

#[test]
fn a_jackal_drives_the_same_lap_by_the_same_system_and_touches_nothing() {
    let lap = check(&["robot.model=\"jackal\""], &["mhd"], Driver::System(0));
    assert_eq!((lap.outcome.end, lap.outcome.contacts.as_slice()), (End::Finished, &[][..]));
    let score = lap.score("mhd");
    assert!(score.position_mean_m <= 0.05, "{} m", score.position_mean_m);
}
