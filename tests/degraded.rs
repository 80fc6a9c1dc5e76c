//! Little to see, or nothing: a run still ends with a verdict, and a system that is blind says so.

use crate::check::{Run, check};
use arborloop_base::{Health, Pose, Time};
use arborloop_sim::{Driver, End};

/// What holds whatever a system sees: a verdict, one finite answer for each sweep, stamps of the sweeps' ends.
fn is_sound(run: &Run) {
    assert_ne!(run.outcome.end, End::Stopped, "nobody asked to stop");
    for (name, estimates) in &run.estimates {
        assert_eq!(estimates.len(), run.truth.len(), "{name} answers every sweep");
        for (estimate, (stamp, _)) in estimates.iter().zip(run.truth.poses()) {
            assert_eq!(estimate.stamp, *stamp);
            let numbers = estimate.map_from_base.translation.vector;
            assert!(numbers.iter().all(|number| number.is_finite()), "{name}: {estimate:?}");
            let attitude = estimate.map_from_base.rotation;
            assert!((attitude.coords.norm() - 1.0).abs() < 1e-9, "{name}: {estimate:?}");
        }
    }
}

#[test]
fn a_field_without_cones_and_a_field_with_one_far_tree_end_with_a_verdict() {
    let short = "run.duration_s_max=5.0";
    for changes in [
        vec![short, "world.planting.count=0"],
        vec![short, "world.planting.count=0", "world.surroundings.trees=1", "world.surroundings.bushes=0"],
        vec![short, "world.planting.count=0", "world.surroundings.trees=0", "world.surroundings.bushes=0"],
    ] {
        let run = check(&changes, &["mhd", "mhd-paper"], Driver::System(0));
        is_sound(&run);
        assert_eq!(run.outcome.contacts, []);
    }
}

#[test]
fn a_driver_that_gets_no_returns_says_so_and_stands_until_it_is_given_up() {
    for change in ["lidar.dropout_ratio=1.0", "lidar.range_m_max=0.4"] {
        let run =
            check(&[change, "run.lost_s_max=2.0", "run.duration_s_max=8.0"], &["mhd"], Driver::System(0));
        is_sound(&run);
        assert_eq!(run.outcome.end, End::Lost, "{change}");
        assert_eq!(run.outcome.contacts, []);
        let estimates = &run.estimates["mhd"];
        assert!(estimates.iter().all(|estimate| estimate.health != Health::Tracking), "{change}");
        assert_eq!(estimates[estimates.len() - 1].health, Health::Lost);
        // A command takes effect after the stand and before the loss is noticed at the earliest: less than a meter.
        let end = run.truth.poses()[run.truth.len() - 1].1.translation.vector;
        assert!(end.xy().norm() < 1.0, "walked blind to {end:?}");
    }
}

#[test]
fn a_lap_with_a_third_of_the_returns_lost_is_survived() {
    let run = check(&["lidar.dropout_ratio=0.3"], &["mhd"], Driver::System(0));
    is_sound(&run);
    assert_eq!(run.outcome.end, End::Finished);
    assert_eq!(run.outcome.contacts, []);
    let score = run.score("mhd");
    println!("position mean {:.4} m, loop {:.4} m", score.position_mean_m, score.loop_m);
    // The nearest cone leaves 0.9 m; half a trunk is 0.3 m of it.
    assert!(score.position_max_m < 0.6, "{} m", score.position_max_m);
    // Disturbed or not, it ends in calm seconds in which the system must be sure of itself.
    let last = &run.estimates["mhd"][run.truth.len() - 10..];
    assert!(last.iter().all(|estimate| estimate.health == Health::Tracking));
}

#[test]
fn blind_for_half_a_second_or_three_mhd_says_so_finds_itself_again_and_is_honest_about_its_errors() {
    for for_s in [0.5, 3.0] {
        let blind = format!("fault=[{{kind='blackout', from_s=8.0, for_s={for_s:?}}}]");
        let run = check(&["gait.mode='strides'", &blind], &["mhd"], Driver::Truth);
        is_sound(&run);
        let estimates = &run.estimates["mhd"];
        let lasts = estimates.iter().filter(|estimate| estimate.health != Health::Tracking).count() as f64;
        assert!(lasts >= 10.0 * for_s - 1.0 && lasts < 10.0 * for_s + 5.0, "not tracking for {lasts} sweeps");
        let score = run.score("mhd");
        let consistency = score.consistency.unwrap();
        println!(
            "{for_s} s: position {:.4} m, loop {:.4} m, {consistency:?}",
            score.position_mean_m, score.loop_m
        );
        assert!(score.loop_m < 0.06, "{} m", score.loop_m);
        // Errors about as large as said, in either direction, and none far beyond.
        assert!((0.02..2.0).contains(&consistency.anees), "{consistency:?}");
        assert_eq!(consistency.confidently_wrong, 0, "{consistency:?}");
    }
}

#[test]
fn carried_off_by_a_meter_mhd_is_there_at_once_and_honest_about_its_errors() {
    for (by_m, turned_deg) in [([1.0, 0.0], 0.0), ([0.0, 1.0], 0.0), ([-0.6, 0.8], 120.0)] {
        let carried = format!("kidnap=[{{at_s=12.0, by_m={by_m:?}, turned_deg={turned_deg:?}}}]");
        let run = check(&["gait.mode='strides'", &carried], &["mhd"], Driver::Truth);
        is_sound(&run);
        assert_eq!(run.outcome.end, End::Finished, "{carried}");
        let poses = run.truth.poses();
        let jump_m =
            |pair: &[(Time, Pose)]| (pair[1].1.translation.vector - pair[0].1.translation.vector).xy().norm();
        // A sweep's walk is some centimeters, one way or the other.
        let jumps: Vec<f64> = poses.windows(2).map(jump_m).filter(|jump_m| *jump_m > 0.5).collect();
        assert!(jumps.len() == 1 && (jumps[0] - 1.0).abs() < 0.1, "{carried}: {jumps:?}");
        let score = run.score("mhd");
        let consistency = score.consistency.unwrap();
        println!(
            "{carried}: position {:.4} m, at the most {:.4} m, loop {:.4} m, {consistency:?}",
            score.position_mean_m, score.position_max_m, score.loop_m
        );
        // Between two sweeps: no sweep is drawn, or answered, from two places.
        assert!(score.position_max_m < 0.1 && score.loop_m < 0.06, "{carried}");
        assert!((0.02..2.0).contains(&consistency.anees), "{carried}: {consistency:?}");
        assert_eq!(consistency.confidently_wrong, 0, "{carried}");
        let last = &run.estimates["mhd"][run.truth.len() - 10..];
        assert!(last.iter().all(|estimate| estimate.health == Health::Tracking), "{carried}");
    }
}

#[test]
fn carried_off_farther_than_it_looks_at_first_mhd_finds_itself_before_it_believes_a_poor_match() {
    for (by_m, turned_deg) in [([2.0, 0.0], 0.0), ([3.0, 1.0], 180.0)] {
        let carried = format!("kidnap=[{{at_s=15.0, by_m={by_m:?}, turned_deg={turned_deg:?}}}]");
        let run = check(&["gait.mode='strides'", &carried], &["mhd"], Driver::Truth);
        is_sound(&run);
        let score = run.score("mhd");
        let consistency = score.consistency.unwrap();
        assert!(score.loop_m < 0.06, "{carried}: {} m", score.loop_m);
        assert_eq!(consistency.confidently_wrong, 0, "{carried}: {consistency:?}");
    }
}
