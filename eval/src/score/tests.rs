use super::*;
use arborloop_base::{pose2, spatial};
use nalgebra::{Translation3, UnitQuaternion};

/// A path and a wrong estimate of it in closed form, 41 poses at 10 Hz, stamps 2 ms apart.
///
/// The values below are evo's own on these two trajectories, written as TUM with 17 digits: evo 1.38.1,
/// `evo_ape tum ref.tum est.tum -r RELATION [--align_origin | --align] [--project_to_plane xy] --save_results r.zip`
/// and `evo_rpe tum ref.tum est.tum -r RELATION -d 1 -u [f | m] --save_results r.zip`, `stats.json` in the archive.
fn closed_form() -> (Trajectory, Trajectory) {
    let pose = |x, y, z, roll, pitch, yaw| {
        Pose::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
    };
    let (mut reference, mut estimate) = (Vec::new(), Vec::new());
    for n in 0..41_i64 {
        let t = 0.1 * n as f64;
        let stamp = Time::from_nanos(1_000_000_000 + n * 100_000_000);
        let (x, y, z) = (4.0 * (0.5 * t).sin(), 3.0 * t.sin(), 0.2 * (0.8 * t).sin());
        let tilt = ((3.0 * t).sin(), (2.0 * t).cos());
        reference.push((stamp, pose(x, y, z, 0.05 * tilt.0, 0.04 * tilt.1, 0.7 * t)));
        estimate.push((
            stamp + Span::from_millis(2),
            pose(
                x + 0.03 * (5.0 * t).sin() + 1.0,
                y + 0.02 * (7.0 * t).cos() - 2.0,
                z + 0.01 * t,
                0.04 * tilt.0,
                0.03 * tilt.1 + 0.01,
                0.7 * t + 0.02 * (4.0 * t).sin() + 0.1,
            ),
        ));
    }
    (Trajectory::new(reference).unwrap(), Trajectory::new(estimate).unwrap())
}

fn scored(alignment: Alignment) -> Score {
    let (reference, estimate) = closed_form();
    score(&reference, &estimate, &ScoreSettings::new(alignment, PoseTime::SweepEnd)).unwrap()
}

/// Compares in evo's order: rmse, mean, median, std, min, max, sse.
fn same_as_evo(stats: &Stats, evo: [f64; 7]) {
    let ours = [stats.rmse, stats.mean, stats.median, stats.std, stats.min, stats.max, stats.sse];
    for (name, (a, b)) in
        ["rmse", "mean", "median", "std", "min", "max", "sse"].iter().zip(ours.iter().zip(evo))
    {
        assert!((a - b).abs() < 1e-9, "{name}: ours {a}, evo's {b}");
    }
}

#[test]
#[rustfmt::skip]
fn absolute_errors_equal_evos() {
    same_as_evo(&scored(Alignment::None).ape, [
        2.236691166462428, 2.2366281637861327, 2.2365582730573235, 0.01678782564020821, 2.205153146056838,
        2.2659448251221894, 205.11428233937326,
    ]);
    same_as_evo(&scored(Alignment::Origin).ape, [
        0.38215161856341756, 0.3622900724280792, 0.42630078957727374, 0.12159672277942736, 0.0,
        0.45337904241810917, 5.987634242396231,
    ]);
    same_as_evo(&scored(Alignment::Se3).ape, [
        0.025313302513555312, 0.024045091149004234, 0.02431880065425695, 0.007911818740267232,
        0.0038541260237008306, 0.036374340296442154, 0.02627129464985339,
    ]);
    same_as_evo(&scored(Alignment::Se3).ape_rotation_deg.unwrap(), [
        5.983100397427795, 5.933621875217939, 6.018494562032342, 0.7678683530630714, 4.62937338011075,
        6.959608699558362, 1467.6971049937263,
    ]);
    // `-r full`.
    let (reference, estimate) = closed_form();
    let pairs = associate(&reference, &estimate, Span::from_millis(10)).unwrap();
    same_as_evo(&Stats::of(&ape(&pairs, PoseRelation::Full)).unwrap(), [
        2.2415265468682843, 2.2414644680621145, 2.240430221309273, 0.016682287920931568, 2.2089902281743803,
        2.2715930133185456, 206.00209167292542,
    ]);
}

#[test]
#[rustfmt::skip]
fn relative_errors_equal_evos() {
    let score = scored(Alignment::None);
    same_as_evo(&score.rpe_translation.unwrap(), [
        0.03018310100372797, 0.027052149613583192, 0.027130251529505787, 0.013386589837802427,
        0.004586703378660544, 0.05422580857326026, 0.036440783448049775,
    ]);
    same_as_evo(&score.rpe_rotation_deg.unwrap(), [
        0.3603750061241776, 0.3398860945995015, 0.3677223233989941, 0.11978141649229139, 0.12859572433492167,
        0.5005081154119139, 5.194805801560042,
    ]);
    same_as_evo(&score.rpe_translation_per_meter.unwrap(), [
        0.12144005438386439, 0.11678849733276803, 0.11466330376308762, 0.03328864219985514, 0.06577440620442129,
        0.16815369762723623, 0.13272918127880348,
    ]);
}

#[test]
fn the_horizontal_rows_equal_evos_projected_to_the_plane() {
    let score = scored(Alignment::Origin);
    for (ours, evo) in [
        (score.position_mean_m, 0.3616572296435826),
        (score.position_rms_m, 0.38144443837948383),
        (score.position_max_m, 0.45161106729570044),
        (score.heading_mean_deg.unwrap(), 0.707738788467442),
        (score.heading_rms_deg.unwrap(), 0.7946269735290578),
    ] {
        assert!((ours - evo).abs() < 1e-9, "ours {ours}, evo's {evo}");
    }
}

#[test]
fn the_planar_fit_equals_evos_on_flattened_files() {
    // `evo_ape tum ref.tum est.tum --align` after z, roll and pitch were set to zero in both files.
    let evo = [
        0.025341818004517763,
        0.024065491890397573,
        0.024536473666400445,
        0.007941022594559803,
        0.003445891092722777,
        0.03656771569494291,
        0.02633051733073813,
    ];
    for alignment in [Alignment::None, Alignment::Origin, Alignment::Se2] {
        same_as_evo(&scored(alignment).ape_se2.unwrap(), evo);
    }
    assert!((scored(Alignment::Se2).position_rms_m - evo[0]).abs() < 1e-9);
}

/// Straight along x at 1 m a second, one pose a second; the estimate as `bend` maps the true planar pose.
fn straight(bend: impl Fn(f64) -> (f64, f64, f64)) -> (Trajectory, Trajectory) {
    let stamp = |n: i64| Time::from_nanos(n * 1_000_000_000);
    let truth = |n: i64| (stamp(n), spatial(&pose2(n as f64, 0.0, 0.0)));
    let guess = |n: i64| {
        let (x, y, yaw) = bend(n as f64);
        (stamp(n), spatial(&pose2(x, y, yaw)))
    };
    let build = |poses: Vec<_>| Trajectory::new(poses).unwrap();
    (build((0..11).map(truth).collect()), build((0..11).map(guess).collect()))
}

fn settings(alignment: Alignment) -> ScoreSettings {
    ScoreSettings::new(alignment, PoseTime::Instant)
}

#[test]
fn a_path_stretched_by_a_tenth_has_the_rows_computed_by_hand() {
    let (reference, estimate) = straight(|x| (1.1 * x, 0.0, 0.0));
    let score = score(&reference, &estimate, &settings(Alignment::Origin)).unwrap();
    // Errors are 0, 0.1, .. 1.0 m.
    let rms = (38.5_f64 / 11.0 / 10.0).sqrt();
    for (ours, hand) in [
        (score.position_mean_m, 0.5),
        (score.position_rms_m, rms),
        (score.position_max_m, 1.0),
        (score.position_increment_mean_m, 0.1),
        (score.position_increment_rms_m, 0.1),
        (score.path_length_m, 10.0),
        (score.error_ratio_percent.unwrap(), 5.0),
        (score.loop_m, 1.0),
        (score.motion_direction_mean_rad.unwrap(), 0.0),
        (score.coverage_ratio, 1.0),
    ] {
        assert!((ours - hand).abs() < 1e-12, "ours {ours}, by hand {hand}");
    }
    assert_eq!(score.samples, 11);
    assert!((score.errors[10].distance_m - 10.0).abs() < 1e-12);
}

#[test]
fn a_path_that_leaves_at_an_angle_shows_it_as_direction_and_not_as_heading() {
    let (reference, estimate) = straight(|x| (x, 0.1 * x, 0.0));
    let score = score(&reference, &estimate, &settings(Alignment::Origin)).unwrap();
    assert!((score.motion_direction_mean_rad.unwrap() - 0.1_f64.atan()).abs() < 1e-12);
    assert!(score.heading_mean_deg.unwrap() < 1e-12);
}

#[test]
fn a_motion_of_the_estimates_frame_changes_no_aligned_score() {
    let (reference, estimate) = closed_form();
    let turned = UnitQuaternion::from_euler_angles(0.0, 0.0, 2.5);
    let frame = Pose::from_parts(Translation3::new(40.0, -30.0, 0.0), turned);
    let elsewhere = estimate.poses().iter().map(|(stamp, pose)| (*stamp, frame * pose)).collect();
    let elsewhere = Trajectory::new(elsewhere).unwrap();
    for alignment in [Alignment::Origin, Alignment::OriginYaw, Alignment::Se2, Alignment::Se3] {
        let settings = ScoreSettings::new(alignment, PoseTime::SweepEnd);
        let (a, b) = (score(&reference, &estimate, &settings), score(&reference, &elsewhere, &settings));
        let (a, b) = (a.unwrap(), b.unwrap());
        for (a, b) in [
            (a.position_rms_m, b.position_rms_m),
            (a.ape.max, b.ape.max),
            (a.heading_rms_deg.unwrap(), b.heading_rms_deg.unwrap()),
            (a.motion_direction_rms_rad.unwrap(), b.motion_direction_rms_rad.unwrap()),
            (a.rpe_translation.unwrap().rmse, b.rpe_translation.unwrap().rmse),
        ] {
            assert!((a - b).abs() < 1e-9, "{alignment}: {a} and {b}");
        }
    }
}

#[test]
fn a_reference_without_headings_is_scored_by_positions_alone() {
    let (reference, estimate) = straight(|x| (3.0 - 0.6 * x, 0.8 * x, 2.0));
    let without = ScoreSettings { has_heading: false, ..settings(Alignment::OriginYaw) };
    let score_of = |settings| score(&reference, &estimate, &settings);
    let score = score_of(without).unwrap();
    assert!(score.position_max_m < 1e-12 && score.loop_m < 1e-12);
    assert_eq!(
        (score.heading_mean_deg, score.loop_heading_deg, score.heading_increment_rms_deg),
        (None, None, None)
    );
    assert_eq!((score.rpe_translation, score.rpe_rotation_deg, score.ape_rotation_deg), (None, None, None));
    assert!(score.errors.iter().all(|error| error.heading_deg.is_none()));
    let refused = score_of(ScoreSettings { alignment: Alignment::Origin, ..without });
    assert!(matches!(refused, Err(ScoreError::HeadingNeeded { alignment: Alignment::Origin })));
}

#[test]
fn poses_of_different_instants_are_not_compared() {
    let (reference, estimate) = closed_form();
    let mixed = ScoreSettings { pose_time_estimate: PoseTime::SweepStart, ..settings(Alignment::None) };
    let error = score(&reference, &estimate, &mixed).unwrap_err();
    assert!(error.to_string().contains("hold at the instant, the estimate's at the sweep start"), "{error}");
}

#[test]
fn too_little_to_compare_is_refused_with_a_sentence() {
    let (reference, estimate) = straight(|x| (x, 0.0, 0.0));
    let one = Trajectory::new(estimate.poses()[..1].to_vec()).unwrap();
    let error = score(&reference, &one, &settings(Alignment::None)).unwrap_err();
    assert_eq!(error.to_string(), "the estimate has 1 poses; at least 2 are wanted");
    let touching = estimate.poses().iter().map(|(t, p)| (*t + Span::from_seconds(10.0), *p)).collect();
    let error =
        score(&reference, &Trajectory::new(touching).unwrap(), &settings(Alignment::None)).unwrap_err();
    assert!(matches!(error, ScoreError::TooFewPairs { found: 1, .. }), "{error}");
    let odd = ScoreSettings { direction_step_m: f64::NAN, ..settings(Alignment::None) };
    assert!(matches!(
        score(&reference, &estimate, &odd),
        Err(ScoreError::Setting { name: "direction_step_m", .. })
    ));
}

#[test]
fn an_estimate_that_stops_early_says_how_much_it_covers() {
    let (reference, estimate) = straight(|x| (x, 0.0, 0.0));
    let half = Trajectory::new(estimate.poses()[..6].to_vec()).unwrap();
    let score = score(&reference, &half, &settings(Alignment::Origin)).unwrap();
    assert!((score.coverage_ratio - 0.5).abs() < 1e-12);
}

#[test]
fn a_robot_that_never_moves_still_has_a_score() {
    let poses = |n: i64| (Time::from_nanos(n), Pose::identity());
    let still = Trajectory::new((0..5).map(poses).collect()).unwrap();
    let score = score(&still, &still, &settings(Alignment::Origin)).unwrap();
    assert_eq!((score.position_max_m, score.path_length_m, score.error_ratio_percent), (0.0, 0.0, None));
    assert_eq!((score.motion_direction_mean_rad, score.ape_se2), (None, None));
}

#[test]
fn the_written_metrics_come_back_without_the_samples() {
    let score = scored(Alignment::Origin);
    let text = serde_json::to_string(&score).unwrap();
    assert!(
        text.contains("\"alignment\":\"origin\"") && text.contains("\"pose_time\":\"sweep_end\""),
        "{text}"
    );
    let back: Score = serde_json::from_str(&text).unwrap();
    assert_eq!(
        (back.samples, back.alignment, back.pose_time, back.errors.len()),
        (41, score.alignment, score.pose_time, 0)
    );
    assert!((back.position_rms_m - score.position_rms_m).abs() < 1e-15);
}
