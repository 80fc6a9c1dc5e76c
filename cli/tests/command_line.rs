//! The binary as a user meets it: exit codes, messages, files, and runs that come out the same.

use std::path::Path;
use std::process::{Command, Output};

/// A walk of a meter: long enough to move, short enough for every build.
const SHORT: [&str; 4] =
    ["--set", "route.waypoints_m=[[0.0, 0.0], [1.0, 0.0]]", "--set", "route.closed=false"];

fn arborloop(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_arborloop"))
        .args(arguments)
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .output()
        .expect("the binary was built with this test")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs, checks the exit code, and gives standard output and standard error.
fn with_code(folder: &Path, arguments: &[&str], code: i32) -> (String, String) {
    let output = arborloop(folder, arguments);
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "{arguments:?}\n{out}\n{err}");
    assert!(!err.contains("panicked"), "{err}");
    (out, err)
}

/// Long messages are broken into lines with a bar before each: one line again.
fn flat(message: &str) -> String {
    message.replace(['│', '|'], " ").split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn what_is_refused_is_refused_with_its_place_and_exit_code_three() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let scenario = arborloop_sim::Scenario::embedded("cone-field-go1").unwrap().text;
    let write = |name: &str, text: &str| std::fs::write(at.join(name), text).unwrap();
    write("typo.toml", &scenario.replace("dropout_ratio", "drop_out_ratio"));
    write("type.toml", &scenario.replace("rate_hz = 10.0", "rate_hz = \"fast\""));
    write("far.toml", &scenario.replace("range_noise_m = 0.02", "range_m_max = 130.0"));
    write("tick.toml", &scenario.replace("rate_hz = 500.0", "rate_hz = 333.0"));
    write("empty.toml", "");
    write("empty.mcap", "");
    write("empty.npz", "");
    write("empty.tum", "");
    write("nan.tum", "1.0 0 0 0 0 0 0 1\n2.0 nan 0 0 0 0 0 1\n");
    write("short.tum", "1.0 0 0 0\n");
    write("good.tum", "1.0 0 0 0 0 0 0 1\n2.0 1 0 0 0 0 0 1\n");
    write("binary.toml", "x");
    std::fs::write(at.join("binary.toml"), [0xff, 0xfe, 0x00]).unwrap();
    let refused: [(&[&str], &[&str]); 14] = [
        (&["check", "typo.toml"], &["typo.toml", "drop_out_ratio", "did you mean `dropout_ratio`"]),
        (&["check", "type.toml"], &["type.toml", "fast", "f64"]),
        (&["check", "far.toml"], &["far.toml", "130", "100"]),
        (&["check", "tick.toml"], &["tick.toml", "333", "whole number of ticks"]),
        (&["check", "empty.toml"], &["empty.toml", "schema"]),
        (&["check", "binary.toml"], &["binary.toml", "UTF-8"]),
        (&["check", "nowhere.toml"], &["nowhere.toml"]),
        (&["run", "cone-feild-go1"], &["cone-feild-go1", "did you mean `cone-field-go1`"]),
        (&["replay", "empty.mcap"], &["empty.mcap"]),
        (&["replay", "empty.npz"], &["empty.npz"]),
        (&["replay", "nowhere"], &["nowhere"]),
        (&["eval", "good.tum", "nan.tum", "--pose-time", "sweep_end"], &["nan.tum", "2"]),
        (&["eval", "good.tum", "short.tum", "--pose-time", "sweep_end"], &["short.tum", "1", "8"]),
        (&["eval", "good.tum", "empty.tum", "--pose-time", "sweep_end"], &["empty.tum"]),
    ];
    for (arguments, words) in refused {
        let (_, err) = with_code(at, arguments, 3);
        let flat = flat(&err);
        for word in words {
            assert!(flat.contains(word), "{arguments:?}: `{word}` is missing in\n{err}");
        }
    }
}

#[test]
fn usage_and_empty_selections_have_exit_codes_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    with_code(folder.path(), &["walk"], 2);
    let (_, err) = with_code(folder.path(), &["run", "cone-field-go1", "--system", "mdh"], 2);
    assert!(flat(&err).contains("did you mean `mhd`"), "{err}");
    with_code(folder.path(), &["eval", "a.tum", "b.tum"], 2);
    with_code(folder.path(), &["run", "cone-field-go1", "--expect", "mhd"], 2);
    with_code(folder.path(), &["run", "cone-field-go1", "--threads", "0"], 2);
    with_code(folder.path(), &["test", "smoke", "--filter", "no such run"], 4);
}

#[test]
fn what_comes_with_the_program_can_be_listed_shown_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let (out, _) = with_code(folder.path(), &["list"], 0);
    for name in ["cone-field-go1", "smoke", "mhd-paper", "vlp16", "os1-16"] {
        assert!(out.contains(name), "{name} is missing in\n{out}");
    }
    let (resolved, _) = with_code(folder.path(), &["show", "scenario", "cone-field-go1"], 0);
    std::fs::write(folder.path().join("resolved.toml"), &resolved).unwrap();
    with_code(folder.path(), &["check", "resolved.toml", "smoke", "cone-field-go1"], 0);
    let (again, _) = with_code(folder.path(), &["show", "scenario", "resolved.toml"], 0);
    assert_eq!(resolved, again);
    with_code(folder.path(), &["show", "world", "cone-field-go1-short", "-o", "pictures"], 0);
    for name in ["top.png", "view.png", "sweep.png"] {
        let bytes = std::fs::read(folder.path().join("pictures").join(name)).unwrap();
        assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 5_000, "{name}: {} bytes", bytes.len());
    }
    let (jackal, _) = with_code(folder.path(), &["show", "robot", "jackal"], 0);
    assert!(
        jackal.contains("skid steering") && jackal.contains("velodyne at (0.0000, 0.0000, 0.3217)"),
        "{jackal}"
    );
    let mesh = r#"<robot name="r"><link name="a"><inertial><mass value="2"/><inertia ixx="0.02" iyy="0.03" izz="0.04"/></inertial>
        <visual><geometry><mesh filename="package://p/a.stl"/></geometry></visual></link></robot>"#;
    std::fs::write(folder.path().join("mesh.urdf"), mesh).unwrap();
    std::fs::write(folder.path().join("a.stl"), "solid").unwrap();
    let (_, said) = with_code(folder.path(), &["show", "robot", "mesh.urdf"], 0);
    assert!(said.contains("warning: mesh.urdf: line 1: link \"a\"") && said.contains("--mesh"), "{said}");
    let (found, said) = with_code(folder.path(), &["show", "robot", "mesh.urdf", "--mesh", "p=."], 0);
    assert!(found.contains("mesh       a: ./a.stl") && !said.contains("warning"), "{found}{said}");
    std::fs::write(folder.path().join("broken.urdf"), mesh.replace("value=\"2\"", "value=\"two\"")).unwrap();
    let (_, refused) = with_code(folder.path(), &["show", "robot", "broken.urdf"], 3);
    assert!(
        refused.contains("broken.urdf:1: link \"a\": found value=\"two\"; wanted a finite number"),
        "{refused}"
    );
    let (robot, _) = with_code(folder.path(), &["show", "robot"], 0);
    assert!(robot.contains("velodyne") && robot.contains("kg"), "{robot}");
}

#[test]
fn a_run_is_the_same_at_any_thread_count_and_its_recording_replays_to_the_same_estimates() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut hashes = Vec::new();
    for threads in ["1", "8"] {
        let mut arguments = vec!["run", "cone-field-go1-short", "-q", "--threads", threads, "-o", threads];
        arguments.extend(["--system", "mhd", "--system", "still"].iter().chain(&SHORT));
        let (out, _) = with_code(at, &arguments, 0);
        assert!(out.starts_with("PASSED"), "{out}");
        hashes.push(out.lines().find(|line| line.starts_with("content hash")).unwrap().to_owned());
        for file in
            ["metrics.json", "report.html", "manifest.json", "metadata.yaml", "scenario.resolved.toml"]
        {
            assert!(at.join(threads).join(file).is_file(), "{file}");
        }
    }
    assert_eq!(hashes[0], hashes[1]);
    with_code(at, &["replay", "1", "-q", "--system", "mhd", "--system", "still", "-o", "again"], 0);
    for file in ["est_mhd.tum", "est_still.tum"] {
        let read = |folder: &str| std::fs::read(at.join(folder).join(file)).unwrap();
        assert_eq!(read("1"), read("8"), "{file} over threads");
        assert_eq!(read("1"), read("again"), "{file} over the recording");
    }
    let metrics = std::fs::read_to_string(at.join("1/metrics.json")).unwrap();
    assert_eq!(metrics, std::fs::read_to_string(at.join("8/metrics.json")).unwrap());
}

#[test]
fn a_run_with_an_os1_replays_to_the_same_estimates() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut arguments = vec!["run", "cone-field-go1-short", "-q", "-o", "run", "--system", "mhd"];
    arguments.extend(["--set", "lidar.model=os1-16"].iter().chain(&SHORT));
    with_code(at, &arguments, 0);
    with_code(at, &["replay", "run", "-q", "--system", "mhd", "-o", "again"], 0);
    let read = |folder: &str| std::fs::read(at.join(folder).join("est_mhd.tum")).unwrap();
    assert_eq!(read("run"), read("again"));
}

#[test]
fn a_lidar_of_the_users_own_is_found_beside_its_scenario_and_refused_in_its_own_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().join("site");
    std::fs::create_dir(&at).unwrap();
    let (text, _) = with_code(folder.path(), &["show", "lidar", "os1-16"], 0);
    let own = text.replace("name = \"os1-16\"", "name = \"mine\"").replace("\"ouster\"", "\"plain\"");
    let scenario = arborloop_sim::Scenario::embedded("cone-field-go1").unwrap().text;
    std::fs::write(at.join("field.toml"), scenario.replace("\"vlp16\"", "\"mine.toml\"")).unwrap();
    let (_, err) = with_code(folder.path(), &["check", "site/field.toml"], 3);
    assert!(flat(&err).contains("found no file `mine.toml`"), "{err}");
    std::fs::write(at.join("mine.toml"), own.replace("reach_m", "reech_m")).unwrap();
    let (_, err) = with_code(folder.path(), &["check", "site/field.toml"], 3);
    assert!(flat(&err).contains("mine.toml") && flat(&err).contains("did you mean `reach_m`"), "{err}");
    std::fs::write(at.join("mine.toml"), own).unwrap();
    with_code(folder.path(), &["check", "site/field.toml"], 0);
    let (resolved, _) = with_code(folder.path(), &["show", "scenario", "site/field.toml"], 0);
    assert!(resolved.contains("name = \"mine\"") && resolved.contains("wire = \"plain\""), "{resolved}");
    // The resolved scenario needs no other file.
    std::fs::write(folder.path().join("resolved.toml"), resolved).unwrap();
    with_code(folder.path(), &["check", "resolved.toml"], 0);
    let (shown, _) = with_code(folder.path(), &["show", "lidar", "site/mine.toml"], 0);
    assert!(shown.contains("-16.858"), "{shown}");
}

#[test]
fn a_beam_of_a_run_is_explained_and_what_it_has_not_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut arguments = vec!["run", "cone-field-go1-short", "-q", "-o", "run", "--system", "mhd"];
    arguments.extend(SHORT);
    with_code(at, &arguments, 0);
    // Laser 0 of the hundredth cycle looks at the ground near the robot.
    let (story, _) = with_code(at, &["explain", "run", "--sweep", "25", "--ray", "1600"], 0);
    for part in
        ["cone-field-go1-short, seed 1, sweep 25 of the vlp16", "beam 0 (ring 0)", "elevation -15.000 deg"]
    {
        assert!(story.contains(part), "`{part}` is missing in\n{story}");
    }
    assert!(story.contains("returned, measured at") || story.contains("lost by chance"), "{story}");
    // Laser 15 looks up into the sky.
    let (story, _) = with_code(at, &["explain", "run", "--sweep", "25", "--ray", "1615"], 0);
    assert!(story.contains("0: ") && story.contains("beam 15 (ring 15)"), "{story}");
    for (run, sweep, ray, code, says) in [
        ("run", "25", "40000", 2, "wanted 0 to 289"),
        ("run", "90000", "0", 2, "wanted 0 to "),
        ("nowhere", "0", "0", 3, "scenario.resolved.toml"),
    ] {
        let (_, err) = with_code(at, &["explain", run, "--sweep", sweep, "--ray", ray], code);
        assert!(flat(&err).contains(says), "{err}");
    }
    // Another scenario beside the recording makes another sweep.
    let resolved = std::fs::read_to_string(at.join("run/scenario.resolved.toml")).unwrap();
    let other = resolved.replace("dropout_ratio = 0.01", "dropout_ratio = 0.5");
    assert_ne!(resolved, other);
    std::fs::write(at.join("run/scenario.resolved.toml"), other).unwrap();
    let (_, err) = with_code(at, &["explain", "run", "--sweep", "25", "--ray", "0"], 3);
    assert!(flat(&err).contains("sweep 25 came out otherwise"), "{err}");
}

#[test]
fn an_expectation_that_fails_ends_with_code_one_hundred_and_everything_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments =
        vec!["run", "cone-field-go1-short", "-q", "-o", "run", "--no-recording", "--system", "still"];
    arguments.extend(["--driver", "truth", "--expect", "still.position_mean_m<=0.05"].iter().chain(&SHORT));
    let (out, err) = with_code(folder.path(), &arguments, 100);
    assert!(out.starts_with("FAILED") && err.contains("still position_mean_m"), "{out}\n{err}");
    assert!(folder.path().join("run/report.html").is_file());
}

#[test]
fn a_suite_runs_every_seed_and_writes_junit_with_its_failures() {
    let folder = tempfile::tempdir().unwrap();
    let suite = r#"
schema = 1
name = "tiny"
[[case]]
scenario = "cone-field-go1-short"
set = ["route.waypoints_m=[[0.0, 0.0], [0.5, 0.0]]", "route.closed=false", "world.planting={kind='none'}"]
seeds = [1, 2]
driver = "truth"
systems = ["still"]
expect = [{ system = "still", metric = "position_max_m", max = 0.1 }]
"#;
    std::fs::write(folder.path().join("tiny.toml"), suite).unwrap();
    let (out, _) = with_code(folder.path(), &["test", "tiny.toml", "-q"], 100);
    assert_eq!(out.matches("FAILED").count(), 2, "{out}");
    let xml = std::fs::read_to_string(folder.path().join("runs/tiny/junit.xml")).unwrap();
    assert!(xml.contains("tests=\"2\"") && xml.contains("failures=\"2\""), "{xml}");
    assert!(folder.path().join("runs/tiny/0-cone-field-go1-short-truth/2/scenario.resolved.toml").is_file());
    // The scenario is the twin of a site that the paper has: its rows stand beside ours, over two seeds and over one.
    let tables = std::fs::read_to_string(folder.path().join("runs/tiny/tables.md")).unwrap();
    assert!(
        out.contains(&tables) && tables.contains("twin of cone field: 2 seeds, driven by truth, route."),
        "{out}"
    );
    let row = tables.lines().find(|line| line.starts_with("| position mean (m)")).unwrap();
    assert!(row.contains("+- 0.0") && row.contains("0.08 +- 0.05") && row.contains("0.99 +- 0.78"), "{row}");
    with_code(folder.path(), &["test", "tiny.toml", "-q", "--seeds", "1", "-o", "one"], 100);
    assert!(!folder.path().join("one/0-cone-field-go1-short-truth/2").exists());
}

#[test]
fn a_suite_that_turns_a_dial_says_at_which_value_a_system_breaks() {
    let folder = tempfile::tempdir().unwrap();
    let suite = r#"
schema = 1
name = "dial"
[[case]]
scenario = "cone-field-go1-short"
set = ["route.closed=false", "world.planting={kind='none'}", "gait.mode='smooth'"]
seeds = [1, 2]
driver = "truth"
systems = ["still"]
expect = [{ system = "still", metric = "position_mean_m", max = 0.2 }]
[case.vary]
key = "route.waypoints_m"
values = [[[0.0, 0.0], [0.1, 0.0]], [[0.0, 0.0], [0.8, 0.0]]]
labels = ["a step", "a walk"]
"#;
    let file = folder.path().join("dial.toml");
    std::fs::write(&file, suite).unwrap();
    let (out, _) = with_code(folder.path(), &["test", "dial.toml", "-q"], 100);
    assert!(out.contains("route.waypoints_m in cone-field-go1-short, driven by truth, 2 seeds"), "{out}");
    let row =
        |label: &str| out.lines().find(|line| line.starts_with(&format!("| {label}"))).unwrap().to_owned();
    assert!(!row("a step").contains("**") && row("a walk").contains("**"), "{out}");
    assert!(out.contains("`still` breaks at a walk: seed 1: still position_mean_m: found 0."), "{out}");
    assert!(
        folder
            .path()
            .join("runs/dial/0-cone-field-go1-short-truth-route.waypoints_m-2/2/report.html")
            .is_file()
    );

    std::fs::write(&file, suite.replace(r#"labels = ["a step", "a walk"]"#, r#"labels = ["a step"]"#))
        .unwrap();
    let (_, err) = with_code(folder.path(), &["test", "dial.toml", "-q"], 3);
    assert!(flat(&err).contains("found 1 labels of 2 values") && err.contains("dial.toml"), "{err}");
    std::fs::write(&file, suite.replace(r#"key = "route.waypoints_m""#, r#"key = "route.waypoint_m""#))
        .unwrap();
    let (_, err) = with_code(folder.path(), &["test", "dial.toml", "-q"], 3);
    assert!(flat(&err).contains("waypoints_m"), "{err}");
}

#[test]
fn a_data_set_is_made_once_and_never_over_another() {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments = vec!["gen", "cone-field-go1-short", "-q", "-o", "set"];
    arguments.extend(SHORT);
    with_code(folder.path(), &arguments, 0);
    for file in
        ["DATASET.md", "calib.yaml", "gt/gt_base_link.tum", "gt/map.yaml", "gt/trunks.csv", "metadata.yaml"]
    {
        assert!(folder.path().join("set").join(file).is_file(), "{file}");
    }
    let (_, err) = with_code(folder.path(), &arguments, 3);
    assert!(err.contains("set"), "{err}");
}
