//! Same binary, same machine, same bytes: on any number of threads and in any process.

use crate::check::{check_into, cone_field, recorder};
use arborloop_sim::Driver;
use std::process::Command;

/// Asks the helper test below for the hash, in a process of its own.
const ASKED: &str = "ARBORLOOP_TEST_PRINT_HASH";
const SHORT: &str = "run.duration_s_max=6.0";

/// Content hash of a run that `mhd` steers, recorded whole: observations, estimates, commands, truth.
fn hash(threads: usize, changes: &[&str]) -> String {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let dir = tempfile::tempdir().unwrap();
        let mut recorder = recorder(dir.path(), false);
        check_into(&cone_field(changes), &["mhd"], Driver::System(0), &mut recorder);
        recorder.finish().unwrap().content_hash
    })
}

#[test]
fn a_run_has_one_content_hash_on_any_number_of_threads_and_in_another_process() {
    let one = hash(1, &[SHORT]);
    for threads in [2, 8] {
        assert_eq!(hash(threads, &[SHORT]), one, "{threads} threads");
    }
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "determinism::a_process_prints_its_hash_when_asked", "--nocapture"])
        .env(ASKED, "1")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains(&format!("content hash {one}.")), "wanted {one}, the other process said: {said}");
}

#[test]
fn a_run_in_which_the_robot_is_carried_off_repeats_and_is_another_one() {
    let kidnap = "kidnap=[{at_s=2.05, by_m=[0.5, 0.5], turned_deg=20.0}]";
    let short = "run.duration_s_max=3.0";
    assert_eq!(hash(1, &[short, kidnap]), hash(2, &[short, kidnap]));
    assert_ne!(hash(2, &[short, kidnap]), hash(2, &[short]));
}

#[test]
fn another_seed_is_another_run() {
    let short = "run.duration_s_max=1.0";
    assert_ne!(hash(2, &[short, "seed=2"]), hash(2, &[short, "seed=3"]));
}

#[test]
fn a_process_prints_its_hash_when_asked() {
    if std::env::var_os(ASKED).is_some() {
        println!("content hash {}.", hash(2, &[SHORT]));
    }
}
