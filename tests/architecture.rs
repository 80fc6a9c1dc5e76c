//! The rules of ARCHITECTURE.md that a compiler does not hold: who may import whom, and who may name what.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Who may import whom among our own packages, directly or not.
const IMPORTS: &[(&str, &[&str])] = &[
    ("arborloop-base", &[]),
    ("arborloop-worlds", &["arborloop-base"]),
    ("arborloop-robots", &["arborloop-base"]),
    ("arborloop-slam", &["arborloop-base"]),
    ("arborloop-eval", &["arborloop-base"]),
    ("arborloop-sim", &["arborloop-base", "arborloop-worlds", "arborloop-robots"]),
];

/// Foreign things and the only files of our libraries that may name them.
const DOORS: &[(&str, &[&str])] = &[
    (
        "rapier3d_f64",
        &[
            "sim/src/axes.rs",
            "sim/src/physics.rs",
            "sim/src/physics/cart.rs",
            "sim/src/physics/engine.rs",
            "sim/src/physics/plant.rs",
            "sim/src/physics/soil.rs",
        ],
    ),
    ("roxmltree", &["robots/src/description/urdf.rs"]),
    ("cdr_encoding", &["eval/src/dataset/cdr.rs"]),
    ("mcap::", &["eval/src/dataset/bag.rs", "eval/src/dataset/mcap_file.rs"]),
    ("npyz", &["eval/src/dataset/pullally.rs"]),
    ("minijinja", &["eval/src/report.rs"]),
    ("toml::", &["sim/src/document.rs", "sim/src/scenario.rs"]),
    (
        "rayon",
        &[
            "sim/src/optics.rs",
            "sim/src/run.rs",
            "sim/src/sensor/lidar.rs",
            "sim/src/sensor/lidar/deliver.rs",
            "sim/src/simulator.rs",
        ],
    ),
    ("rand_pcg", &["base/src/seed.rs"]),
];

/// Chance and clocks that no library may know: runs repeat.
const NOWHERE: &[&str] = &[
    "Instant::now",
    "SystemTime::now",
    "thread_rng",
    "rand::rng",
    "StdRng",
    "SmallRng",
    "HashMap",
    "HashSet",
];

/// Words that would tell a system what only a simulator knows.
const UNKNOWN_TO_SYSTEMS: &[&str] = &["truth", "world", "simulator", "scenario", "gnss", "rtk"];

const LIBRARIES: &[&str] = &["base", "worlds", "robots", "sim", "slam", "eval"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Our packages that a package needs, itself left out.
fn needed_by(package: &str) -> BTreeSet<String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["tree", "-p", package, "--edges", "normal", "--prefix", "none", "--offline"])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(output.status.success(), "{package}: {}", String::from_utf8_lossy(&output.stderr));
    let lines = String::from_utf8(output.stdout).unwrap();
    let names = lines.lines().filter_map(|line| line.split_whitespace().next());
    let ours = names.filter(|name| name.starts_with("arborloop") && *name != package);
    ours.map(str::to_owned).collect()
}

/// Every source file below a folder as path from the root (with `/`) and text, in order; unit tests in files of their
/// own are left out.
fn sources(folder: &str) -> Vec<(String, String)> {
    let mut found = files(folder);
    found.retain(|(name, _)| {
        let below = &name[folder.len()..];
        !below.contains("/tests/") && !below.ends_with("/tests.rs")
    });
    found
}

/// Every Rust file below a folder, tests included.
fn files(folder: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|kind| kind == "rs") {
                let name = path.strip_prefix(root()).unwrap();
                let parts: Vec<_> = name.iter().map(|part| part.to_string_lossy()).collect();
                found.push((parts.join("/"), std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    found.sort();
    assert!(!found.is_empty(), "{folder} has no sources");
    found
}

/// The sources of all libraries, each cut off where its unit tests begin.
fn library_sources() -> Vec<(String, String)> {
    let files = LIBRARIES.iter().flat_map(|member| sources(&format!("{member}/src")));
    files
        .map(|(name, text)| (name, text.split("#[cfg(test)]\nmod tests {").next().unwrap().to_owned()))
        .collect()
}

/// Lines of a text that hold a word, not a part of one.
fn lines_with<'a>(text: &'a str, word: &str) -> Vec<&'a str> {
    let has = |line: &&str| {
        let lower = line.to_lowercase();
        lower.split(|c: char| !c.is_alphanumeric()).any(|found| found == word)
    };
    text.lines().filter(has).collect()
}

#[test]
fn every_member_imports_only_what_it_may() {
    for (package, may) in IMPORTS {
        let found = needed_by(package);
        let wanted: BTreeSet<String> = may.iter().map(|name| (*name).to_owned()).collect();
        assert!(found.is_subset(&wanted), "{package} needs {found:?}, it may need {wanted:?}");
    }
}

#[test]
fn systems_do_not_know_what_only_a_simulator_knows() {
    for (name, text) in sources("slam/src") {
        for word in UNKNOWN_TO_SYSTEMS {
            let lines = lines_with(&text, word);
            assert!(lines.is_empty(), "{name} says `{word}`: {lines:?}");
        }
    }
}

#[test]
fn a_word_is_found_whole_or_not_at_all() {
    let text = "let truth = 1;\nlet untruthful = 2;\nTruth\nworld_from_base\nworldly";
    assert_eq!(lines_with(text, "truth"), ["let truth = 1;", "Truth"]);
    assert_eq!(lines_with(text, "world"), ["world_from_base"]);
}

#[test]
fn every_foreign_thing_has_one_door() {
    let files = library_sources();
    for (foreign, doors) in DOORS {
        let named: Vec<&str> =
            files.iter().filter(|(_, text)| text.contains(foreign)).map(|(name, _)| name.as_str()).collect();
        for name in &named {
            assert!(doors.contains(name), "{name} names `{foreign}`, whose doors are {doors:?}");
        }
        for door in *doors {
            assert!(named.contains(door), "{door} is listed as a door of `{foreign}` but does not name it");
        }
    }
}

#[test]
fn no_library_reads_a_clock_or_unnamed_chance() {
    for (name, text) in library_sources() {
        for word in NOWHERE {
            let line = text.lines().find(|line| line.contains(word));
            assert!(line.is_none(), "{name} names `{word}`: {line:?}");
        }
    }
}

#[test]
fn the_map_of_the_code_names_every_member_and_every_rule_has_its_file() {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let members = manifest.lines().find_map(|line| line.strip_prefix("members = [")).unwrap();
    for member in members.trim_end_matches(']').split(',').map(|name| name.trim().trim_matches('"')) {
        assert!(text.contains(&format!("`{member}")), "ARCHITECTURE.md does not speak of {member}");
    }
    // Paths in backticks that look like files of ours exist.
    let quoted = text.split('`').skip(1).step_by(2);
    let looks_ours = |path: &&str| {
        LIBRARIES.iter().chain(&["cli", "tests"]).any(|member| path.starts_with(&format!("{member}/")))
            && !path.contains(['*', '{', '<', ' '])
    };
    for path in quoted.filter(looks_ours) {
        assert!(root().join(path).exists(), "ARCHITECTURE.md names {path}, which does not exist");
    }
}

#[test]
fn every_test_that_the_page_of_laws_names_exists() {
    let text = std::fs::read_to_string(root().join("docs/lidar-laws.md")).unwrap();
    let folders = ["base/src", "sim/src", "sim/tests", "eval/src", "worlds/tests", "tests"];
    let all: String = folders.iter().flat_map(|folder| files(folder)).map(|(_, text)| text).collect();
    // Names of tests are sentences of at least five words.
    let named = text.split('`').skip(1).step_by(2).filter(|name| name.matches('_').count() >= 4);
    let mut found = 0;
    for name in named.filter(|name| *name != "default_lidar_origin_to_beam_origin") {
        assert!(all.contains(&format!("fn {name}()")), "docs/lidar-laws.md names {name}, which is no test");
        found += 1;
    }
    assert!(found > 50, "{found}");
}
