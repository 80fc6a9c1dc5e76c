//! What a run leaves on disk: it replays to the same bits, says where things really are, and survives a crash.

use crate::check::{bits, check_into, cone_field, recorder, rig, system};
use arborloop_base::vlp16::{DISTANCE_STEP_M, ELEVATION_DEG, OFFSET_M, laser_of};
use arborloop_base::{Estimate, Label, Observation, Record, Sink, SinkError, Sweep, Time};
use arborloop_eval::dataset::{Recorder, RecorderSettings, content_hash, open};
use arborloop_sim::Driver;
use arborloop_slam::Rig;
use std::path::Path;

const SHORT: &str = "run.duration_s_max=6.0";

/// Sweeps and labels as the loop hands them out.
#[derive(Default)]
struct Seen {
    sweeps: Vec<Sweep>,
    labels: Vec<Vec<Label>>,
}

/// Two recorders side by side.
struct Both<'a>(&'a mut dyn Sink, &'a mut dyn Sink);

impl Sink for Seen {
    fn write(&mut self, _now: Time, record: &Record<'_>) -> Result<(), SinkError> {
        match record {
            Record::Observation(Observation::Sweep(sweep)) => self.sweeps.push(sweep.clone()),
            Record::Labels { labels, .. } => self.labels.push(labels.to_vec()),
            _ => {}
        }
        Ok(())
    }
}

impl Sink for Both<'_> {
    fn write(&mut self, now: Time, record: &Record<'_>) -> Result<(), SinkError> {
        self.0.write(now, record)?;
        self.1.write(now, record)
    }
}

/// The sweeps of a recording, up to where it ends or breaks.
fn sweeps(path: &Path) -> Vec<Sweep> {
    let recording = open(path).unwrap();
    let observations = recording.observations().unwrap().map_while(Result::ok);
    observations
        .filter_map(|observation| match observation {
            Observation::Sweep(sweep) => Some(sweep),
            _ => None,
        })
        .collect()
}

#[test]
fn the_replay_of_a_recording_gives_the_estimates_of_the_run_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    let mut recorder = recorder(dir.path(), false);
    let systems = ["mhd", "still"];
    let run = check_into(&cone_field(&[SHORT]), &systems, Driver::System(0), &mut recorder);
    let recorded = recorder.finish().unwrap();
    assert_eq!(content_hash(dir.path()).unwrap(), recorded.content_hash);

    let recording = open(dir.path()).unwrap();
    assert_eq!(recording.sweeps(), Some(60));
    for name in systems {
        // The mount comes from the recording as well: a replay knows nothing but the file.
        let mut system = system(name, &Rig { base_from_lidar: recording.base_from_lidar() });
        let replayed: Vec<Estimate> = recording
            .observations()
            .unwrap()
            .map(Result::unwrap)
            .filter(|observation| system.inputs.contains(&observation.kind()))
            .filter_map(|observation| system.slam.observe(&observation))
            .collect();
        assert_eq!(replayed.len(), 60);
        for (index, (again, once)) in replayed.iter().zip(&run.estimates[name]).enumerate() {
            assert_eq!(bits(again), bits(once), "{name}, sweep {index}");
        }
    }
    let reference = recording.reference().unwrap().unwrap();
    let ends: Vec<Time> = reference.trajectory.poses().iter().map(|(stamp, _)| *stamp).collect();
    assert!(run.truth.poses().iter().all(|(stamp, _)| ends.contains(stamp)));
}

#[test]
fn the_points_of_a_data_set_lie_where_the_labels_say_within_the_noise() {
    let dir = tempfile::tempdir().unwrap();
    let mut recorder = recorder(dir.path(), true);
    let mut seen = Seen::default();
    let scenario = cone_field(&["run.duration_s_max=3.0"]);
    check_into(&scenario, &[], Driver::Truth, &mut Both(&mut recorder, &mut seen));
    assert!(recorder.finish().unwrap().labels_hash.is_some());

    let read = sweeps(dir.path());
    assert_eq!(read.len(), seen.sweeps.len());
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for ((cloud, sweep), labels) in read.iter().zip(&seen.sweeps).zip(&seen.labels) {
        let hits = sweep.returns.iter().zip(labels).filter(|(one, _)| one.range_m.is_some());
        let hits: Vec<&Label> = hits.map(|(_, label)| label).collect();
        assert_eq!(cloud.returns.len(), hits.len());
        for (point, label) in cloud.returns.iter().zip(hits) {
            // Back from the point to the laser's own origin, a few millimeters above or below the center.
            let laser = laser_of(point.ring);
            let (sin, cos) = point.elevation_rad.sin_cos();
            let (range_m, elevation_rad) = (point.range_m.unwrap(), ELEVATION_DEG[laser].to_radians());
            let along_beam_m = range_m * cos / elevation_rad.cos();
            let height_m = along_beam_m * elevation_rad.sin() + OFFSET_M[laser];
            assert!((range_m * sin - height_m).abs() < 1e-4, "{point:?} is off its laser's cone");
            let error_m = along_beam_m - f64::from(label.range_m);
            // Seven standard deviations leave one draw in 10^11 outside; half a step is the wire's.
            let bound_m = 7.0 * scenario.lidar.range_noise_m + DISTANCE_STEP_M / 2.0 + 1e-4;
            assert!(error_m.abs() < bound_m, "{point:?} is {error_m} m from {label:?}");
            (count, sum, squares) = (count + 1.0, sum + error_m, squares + error_m * error_m);
        }
    }
    assert!(count > 100_000.0, "{count} points");
    let variance = scenario.lidar.range_noise_m.powi(2) + DISTANCE_STEP_M.powi(2) / 12.0;
    let mean: f64 = sum / count;
    assert!(mean.abs() < 5.0 * (variance / count).sqrt(), "mean {mean} m");
    assert!((squares / count - variance).abs() < 5.0 * variance * (2.0 / count).sqrt());
}

#[test]
fn whatever_the_lidar_and_its_faults_a_recording_holds_the_sweeps_of_the_run_to_the_bit() {
    let fault = |rest: &str| format!("fault=[{{from_s=0.25,for_s=0.3,{rest}}}]");
    let cases = [
        vec![fault("kind='blackout'")],
        vec![fault("kind='frozen_stamps'")],
        vec![fault("kind='skewed_stamps',offset_s=-0.04")],
        vec![fault("kind='swapped_rings',rings=[3,12]")],
        vec![fault("kind='dropped_packets',ratio=0.5")],
        vec![fault("kind='dropped_packets',ratio=1.0")],
        vec![fault("kind='dirt_sector',azimuth_deg_min=-30,azimuth_deg_max=30")],
        vec!["lidar.returns=dual".into(), "weather.fog_visibility_m=50".into()],
        vec![
            "lidar.model=os1-16".into(),
            "lidar.sub_rays=5".into(),
            fault("kind='dropped_packets',ratio=0.5"),
        ],
    ];
    for case in cases {
        let mut changes = vec!["run.duration_s_max=0.7"];
        changes.extend(case.iter().map(String::as_str));
        let scenario = cone_field(&changes);
        for clouds in [false, true] {
            let dir = tempfile::tempdir().unwrap();
            let settings = RecorderSettings {
                name: "run".into(),
                clouds,
                wire: scenario.wire(),
                base_from_lidar: rig().base_from_lidar,
                ..RecorderSettings::default()
            };
            let mut recorder = Recorder::create(dir.path(), settings).unwrap();
            let mut seen = Seen::default();
            check_into(&scenario, &[], Driver::Truth, &mut Both(&mut recorder, &mut seen));
            recorder.finish().unwrap();
            assert_eq!(seen.sweeps.len(), 7);
            assert!(
                seen.sweeps
                    .iter()
                    .zip(&seen.labels)
                    .all(|(sweep, labels)| sweep.returns.len() == labels.len())
            );
            assert!(sweeps(dir.path()) == seen.sweeps, "{changes:?}, clouds {clouds}");
        }
    }
}

#[test]
fn a_run_that_is_killed_leaves_the_sweeps_before_its_end() {
    let dir = tempfile::tempdir().unwrap();
    let mut recorder = recorder(dir.path(), false);
    let mut seen = Seen::default();
    check_into(&cone_field(&[SHORT]), &[], Driver::Truth, &mut Both(&mut recorder, &mut seen));
    // Nothing runs after a kill: no summary, no metadata.yaml, and the last block of the disk may be torn.
    std::mem::forget(recorder);
    let path = dir.path().join("run_0.mcap");
    let bytes = std::fs::read(&path).unwrap();
    for cut in [bytes.len(), bytes.len() * 7 / 8, bytes.len() / 2] {
        std::fs::write(&path, &bytes[..cut]).unwrap();
        let read = sweeps(dir.path());
        assert!(read.len() >= 10, "{} sweeps before the cut at {cut} of {} bytes", read.len(), bytes.len());
        assert_eq!(read, seen.sweeps[..read.len()]);
        // The mount stands at the front, so that the rest can be replayed.
        assert_eq!(open(dir.path()).unwrap().base_from_lidar(), rig().base_from_lidar);
    }
}

#[test]
fn a_run_that_is_aborted_leaves_a_complete_recording_of_its_beginning() {
    let dir = tempfile::tempdir().unwrap();
    let mut recorder = recorder(dir.path(), false);
    let run = check_into(&cone_field(&["run.duration_s_max=1.0"]), &["still"], Driver::Truth, &mut recorder);
    drop(recorder);
    assert_eq!(sweeps(dir.path()).len(), run.estimates["still"].len());
    assert!(dir.path().join("metadata.yaml").is_file());
    // The next run of the same name does not write over it.
    let settings = RecorderSettings { name: "run".into(), ..RecorderSettings::default() };
    assert!(Recorder::create(dir.path(), settings).is_err());
}
