use super::*;
use crate::{Alignment, MapScoreSettings, PoseTime, ScoreSettings, paper, score, score_map};
use arborloop_base::{Pose, Seed, planar, pose2, spatial};
use nalgebra::Point2;
use std::f64::consts::TAU;

/// A made-up run: five laps around a 6 m x 2 m rectangle of cones by two systems of different worth.
fn example() -> ReportInput {
    let stamp = |n: i64| Time::SIMULATION_START + arborloop_base::Span::from_millis(100 * n);
    let path = |n: i64| {
        let turn = TAU * n as f64 / 300.0;
        let (c, s) = (turn.cos(), turn.sin());
        let (x, y) = (3.6 * c.signum() * c.abs().powf(0.4), 1.6 * s.signum() * s.abs().powf(0.4));
        spatial(&pose2(x + 3.0, y + 1.0, turn + TAU / 4.0))
    };
    let reference = Trajectory::new((0..1500).map(|n| (stamp(n), path(n))).collect()).unwrap();
    let stream = Seed(7).stream("report/example");
    let start = path(0);
    let system = |name: &str, noise_m: f64, drift_radps: f64| {
        let poses = (0..1500).map(|n| {
            let mut draws = stream.at(n as u64);
            let (dx, dy, turn) = (draws.normal(), draws.normal(), draws.normal());
            let wobble = spatial(&pose2(noise_m * dx, noise_m * dy, 0.2 * noise_m * turn));
            let drift = spatial(&pose2(0.0, 0.0, drift_radps * 0.1 * n as f64));
            (stamp(n), drift * start.inverse() * path(n) * wobble)
        });
        let trajectory = Trajectory::new(poses.collect()).unwrap();
        let settings = ScoreSettings::new(Alignment::Origin, PoseTime::SweepEnd);
        let truth = truth_map();
        let truth_from_map = planar(&start);
        let map = drawn_map(&truth_from_map, noise_m);
        SystemReport {
            name: name.to_owned(),
            score: Some(score(&reference, &trajectory, &settings).unwrap()),
            map_score: Some(score_map(&truth, &map, &truth_from_map, MapScoreSettings::default()).unwrap()),
            map: Some(map),
            truth_from_map,
            trajectory,
            cpu_ms_per_sweep: Stats::of(&[3.0, 4.0, 6.5]),
            health: HealthCounts { tracking: 1480, degraded: 20, lost: 0 },
            ..SystemReport::default()
        }
    };
    let systems = vec![system("mhd", 0.01, 0.0), system("mhd-paper", 0.06, 0.002)];
    ReportInput {
        title: "cone-field-go1".to_owned(),
        verdict: Verdict {
            passed: false,
            lines: vec!["mhd-paper: position_mean_m 0.41 m, wanted <= 0.1 m".to_owned()],
        },
        scenario: "cone-field-go1".to_owned(),
        seed: 42,
        driver: "mhd".to_owned(),
        version: "0.1.0".to_owned(),
        hashes: vec![("scenario".to_owned(), "9f2c".repeat(16)), ("content".to_owned(), "07ab".repeat(16))],
        reproduce: vec!["arborloop run cone-field-go1 --seed 42 --slam mhd --slam mhd-paper".to_owned()],
        check: vec!["evo_ape tum gt_base_link.tum est_mhd.tum -r trans_part --align_origin".to_owned()],
        reference,
        truth_map: Some(truth_map()),
        landmarks: cones(),
        contacts: vec![Event { stamp: stamp(620), text: "trunk touches cone 4".to_owned() }],
        lanes: vec![
            Lane {
                name: "Tilt".to_owned(),
                unit: "deg".to_owned(),
                points: (0..150_000)
                    .map(|n| (f64::from(n) * 1e-3, (f64::from(n) * 0.0157).sin() * 2.0))
                    .collect(),
            },
            Lane {
                name: "Speed".to_owned(),
                unit: "m/s".to_owned(),
                points: (0..1500)
                    .map(|n| (f64::from(n) * 0.1, 0.5 + 0.05 * (f64::from(n) * 0.3).cos()))
                    .collect(),
            },
        ],
        expectations: ["mhd", "mhd-paper"]
            .into_iter()
            .map(|system| Expectation {
                system: system.to_owned(),
                metric: "position_mean_m".to_owned(),
                found: systems
                    .iter()
                    .find(|s| s.name == system)
                    .and_then(|s| Some(s.score.as_ref()?.position_mean_m)),
                limit: "<= 0.1 m".to_owned(),
                passed: system == "mhd",
            })
            .collect(),
        published: paper::rows_of("cone field"),
        published_map: Some(paper::CONE_FIELD_MAP),
        realtime_factor: Some(3.4),
        files: vec![("gt_base_link.tum".to_owned(), "true path, for evo_ape tum".to_owned())],
        systems,
        ..ReportInput::default()
    }
}

fn cones() -> Vec<Landmark> {
    let places =
        [(0.0, 0.0), (2.0, 0.0), (4.0, 0.0), (6.0, 0.0), (0.0, 2.0), (2.0, 2.0), (4.0, 2.0), (6.0, 2.0)];
    let cone = |(n, (x_m, y_m)): (usize, (f64, f64))| Landmark {
        class: Class::Cone,
        label: format!("cone {n}"),
        x_m,
        y_m,
        radius_m: 0.18,
    };
    places.into_iter().enumerate().map(cone).collect()
}

fn truth_map() -> Grid<Cell> {
    let mut grid = Grid::filled(Point2::new(-4.0, -4.0), 0.05, 280, 200, Cell::Free);
    for row in 0..200 {
        for column in 0..280 {
            let at = grid.center_of(column, row);
            let stands = cones().iter().any(|c| (at - Point2::new(c.x_m, c.y_m)).norm() < c.radius_m);
            if stands && let Some(cell) = grid.get_mut(column, row) {
                *cell = Cell::Occupied;
            }
        }
    }
    grid
}

/// Only the rims of the cones, each cell moved by a little noise; one cone is overlooked.
fn drawn_map(truth_from_map: &Pose2, noise_m: f64) -> Grid<Cell> {
    let mut map = Grid::filled(Point2::new(-4.0, -3.0), 0.05, 150, 220, Cell::Free);
    let stream = Seed(3).stream("map");
    for (n, cone) in cones().iter().enumerate().filter(|(n, _)| *n != 6) {
        for step in 0..60 {
            let mut draws = stream.child(n as u64).at(step);
            let (turn, radius_m) =
                (TAU * step as f64 / 60.0, cone.radius_m - 0.02 + 3.0 * noise_m * draws.normal());
            let at = Point2::new(cone.x_m + radius_m * turn.cos(), cone.y_m + radius_m * turn.sin());
            if let Some((column, row)) = map.index_of(&(truth_from_map.inverse() * at)) {
                *map.get_mut(column, row).unwrap() = Cell::Occupied;
            }
        }
    }
    map
}

fn as_written(input: &ReportInput) -> String {
    render(input).unwrap()
}

#[test]
fn a_page_needs_nothing_from_outside_and_stays_small() {
    let page = as_written(&example());
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
    for outside in ["http://", "https://", "src=", "@import", "url("] {
        assert!(!page.contains(outside), "found {outside}");
    }
    for wanted in
        ["cone-field-go1", "Failed", "position_mean_m", "0.08 \u{b1} 0.05", "trunk touches cone 4", "F1"]
    {
        assert!(page.contains(wanted), "{wanted} is missing");
    }
    assert!(!page.contains("NaN") && !page.contains("inf "));
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    assert_eq!(as_written(&example()), as_written(&example()));
}

#[test]
fn every_drawing_has_words_for_those_who_do_not_see_it() {
    let page = as_written(&example());
    assert_eq!(page.matches("<svg").count(), page.matches("role=\"img\" aria-label=\"").count());
    assert!(!page.contains("aria-label=\"\""));
}

#[test]
fn every_text_is_escaped() {
    let mark = "<script>alert('x')</script>\" onload=\"x";
    let text = || mark.to_owned();
    let mut input = example();
    input.title = text();
    input.scenario = text();
    input.driver = text();
    input.version = text();
    input.verdict.lines = vec![text()];
    input.hashes = vec![(text(), text())];
    input.reproduce = vec![text()];
    input.check = vec![text()];
    input.files = vec![(text(), text())];
    input.lanes[0].name = text();
    input.lanes[0].unit = text();
    input.landmarks[0].label = text();
    input.contacts[0].text = text();
    input.expectations[0] =
        Expectation { system: text(), metric: text(), found: None, limit: text(), passed: false };
    input.systems[0].name = text();
    input.systems[0].no_score = Some(text());
    let page = as_written(&input);
    assert!(!page.contains("<script>alert") && !page.contains("\" onload=\"x"));
    assert!(page.contains("&lt;script&gt;alert"));
}

#[test]
fn an_empty_run_is_a_sensible_page() {
    let page = as_written(&ReportInput::default());
    for wanted in ["Failed", "No system took part", "No path was recorded"] {
        assert!(page.contains(wanted), "{wanted} is missing");
    }
    let lost = SystemReport {
        name: "mute".to_owned(),
        no_score: Some("it gave no estimate".to_owned()),
        ..SystemReport::default()
    };
    let one_pose = Trajectory::new(vec![(Time::default(), Pose::identity())]).unwrap();
    let input = ReportInput { systems: vec![lost], reference: one_pose, ..ReportInput::default() };
    let page = as_written(&input);
    assert!(page.contains("it gave no estimate") && !page.contains("NaN"));
}

#[test]
fn hours_of_data_stay_below_three_megabytes() {
    let mut input = example();
    let long = |phase: f64| {
        let pose = |n: i64| (f64::from(n as i32) * 1e-3 + phase).sin_cos();
        let poses = (0..40_000_i64).map(|n| {
            (
                Time::from_nanos(n * 100_000_000),
                Pose::translation(90.0 * pose(n).0, 70.0 * pose(3 * n).1, 0.0),
            )
        });
        Trajectory::new(poses.collect()).unwrap()
    };
    input.reference = long(0.0);
    let settings = ScoreSettings::new(Alignment::None, PoseTime::SweepEnd);
    let mut noisy = Grid::filled(Point2::new(-30.0, -20.0), 0.02, 2200, 1400, Cell::Free);
    let stream = Seed(1).stream("noise");
    for (index, cell) in noisy.cells_mut().iter_mut().enumerate().step_by(37) {
        *cell = if stream.at(index as u64).chance(0.5) { Cell::Occupied } else { Cell::Unknown };
    }
    for system in &mut input.systems {
        system.trajectory = long(0.001);
        system.score = Some(score(&input.reference, &system.trajectory, &settings).unwrap());
        system.map = Some(noisy.clone());
    }
    assert!(as_written(&input).len() < 3_000_000);
}

#[test]
fn a_system_gone_astray_does_not_shrink_the_field() {
    let mut input = example();
    let far =
        input.systems[1].trajectory.poses().iter().map(|(t, p)| (*t, Pose::translation(1e5, 0.0, 0.0) * p));
    input.systems[1].trajectory = Trajectory::new(far.collect()).unwrap();
    let views = top_view::TopView::all(&input);
    let width: f64 = views[0].view_box.split(' ').nth(2).unwrap().parse().unwrap();
    assert!(width < 30.0, "{width} m wide");
}

#[test]
fn lanes_that_hold_no_number_leave_the_page_whole() {
    let mut input = example();
    input.lanes = vec![
        Lane { name: "nothing".to_owned(), unit: String::new(), points: Vec::new() },
        Lane {
            name: "gaps".to_owned(),
            unit: "m".to_owned(),
            points: vec![(0.0, f64::NAN), (1.0, f64::INFINITY)],
        },
    ];
    let page = as_written(&input);
    assert!(page.contains("gaps: no values") && !page.contains("NaN"));
}
