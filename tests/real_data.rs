//! The paper's own orchard, recorded by its authors on a real robot: the same `mhd`, no setting changed.

use crate::check::{bits, system, trajectory};
use arborloop_base::{Estimate, Observation};
use arborloop_eval::dataset::{Recording, open};
use arborloop_eval::{Alignment, PoseTime, ScoreSettings, score};
use arborloop_slam::Rig;
use std::path::{Path, PathBuf};

/// A recording of the Pullally orchard; `None`, and a word on standard error, where there is none.
fn pullally(file: &str) -> Option<Recording> {
    let data = std::env::var_os("ARBORLOOP_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let path = data.join("pullally").join(file);
    if !path.is_file() {
        eprintln!("skipped: {} is absent (set ARBORLOOP_DATA)", path.display());
        return None;
    }
    Some(open(&path).unwrap())
}

fn replay(recording: &Recording) -> Vec<Estimate> {
    let mut mhd = system("mhd", &Rig { base_from_lidar: recording.base_from_lidar() }).slam;
    recording.observations().unwrap().map(|item| mhd.observe(&item.unwrap()).unwrap()).collect()
}

fn check(file: &str) {
    let Some(recording) = pullally(file) else { return };
    let estimates = replay(&recording);
    let reference = recording.reference().unwrap().unwrap();
    let settings = ScoreSettings {
        has_heading: reference.has_heading,
        ..ScoreSettings::new(Alignment::OriginYaw, PoseTime::Instant)
    };
    assert_eq!(reference.pose_time, PoseTime::Instant);
    let score = score(&reference.trajectory, &trajectory(&estimates), &settings).unwrap();
    let said = format!(
        "{file}: position mean {:.4} m, largest {:.3} m, loop {:.4} m over {:.1} m",
        score.position_mean_m, score.position_max_m, score.loop_m, score.path_length_m
    );
    println!("{said}");
    assert_eq!(score.samples, reference.trajectory.len());
    assert!(score.position_mean_m <= 0.10, "{said}");
    assert!(score.loop_m <= 0.2, "{said}");
}

#[test]
fn mhd_follows_the_first_real_run_within_the_bars() {
    check("run1.npz");
}

#[test]
fn mhd_follows_the_second_real_run_within_the_bars() {
    check("run2.npz");
}

#[test]
fn nothing_but_planar_scans_reaches_a_system_and_its_answers_repeat() {
    let Some(recording) = pullally("run1.npz") else { return };
    let sweeps: Vec<Observation> = recording.observations().unwrap().take(40).map(Result::unwrap).collect();
    for observation in &sweeps {
        let Observation::Sweep(sweep) = observation else { panic!("{observation:?} is no scan") };
        assert_eq!((sweep.rings, sweep.start, sweep.returns.len()), (1, sweep.end, 897));
    }
    let answers = |_: usize| -> Vec<_> {
        let mut mhd = system("mhd", &Rig::default()).slam;
        sweeps.iter().map(|sweep| bits(&mhd.observe(sweep).unwrap())).collect()
    };
    assert_eq!(answers(1), answers(2));
}
