use super::synthetic::{self, base_from_lidar, walk};
use crate::dataset::mcap_file::{Item, McapCursor};
use crate::dataset::observations::decode;
use crate::dataset::ros2::PointCloud2;
use crate::dataset::*;
use arborloop_base::{Observation, Pose, Record, Sink, Span, Sweep, Time, Twist, vlp16};
use std::path::Path;

pub(super) fn settings() -> RecorderSettings {
    RecorderSettings {
        name: "walk".to_owned(),
        clouds: true,
        packets: true,
        base_from_lidar: base_from_lidar(),
        base_from_imu: Pose::translation(-0.02, 0.0, 0.05),
        base_from_antenna: Pose::translation(-0.2, 0.0, 0.3),
        datum: Datum { latitude_deg: -33.65, longitude_deg: -70.92, altitude_m: 412.0 },
        ..RecorderSettings::default()
    }
}

pub(super) fn record(dir: &Path, settings: RecorderSettings, sweeps: i64) -> (Vec<Observation>, Recorded) {
    let mut recorder = Recorder::create(dir, settings).unwrap();
    recorder.truth_map(Time::SIMULATION_START, &synthetic::map()).unwrap();
    let given = walk(sweeps, &mut recorder);
    (given, recorder.finish().unwrap())
}

pub(super) fn replay(path: &Path) -> Vec<Observation> {
    open(path).unwrap().observations().unwrap().collect::<Result<_, _>>().unwrap()
}

fn assert_same(given: &Observation, read: &Observation) {
    match (given, read) {
        // Latitude and longitude are decimal degrees in 64 bits: a tenth of a millimeter is kept a thousandfold.
        (Observation::Fix(given), Observation::Fix(read)) => {
            assert!((given.position_m - read.position_m).norm() < 1e-7);
            assert_eq!((given.stamp, given.quality), (read.stamp, read.quality));
            assert_eq!(given.covariance_m2, read.covariance_m2);
        }
        _ => assert_eq!(given, read),
    }
}

#[test]
fn a_run_is_replayed_to_the_bit_and_in_the_order_of_delivery() {
    for clouds in [false, true] {
        let dir = tempfile::tempdir().unwrap();
        let (given, recorded) = record(dir.path(), RecorderSettings { clouds, ..settings() }, 4);
        let recording = open(dir.path()).unwrap();
        assert_eq!(recording.kind(), RecordingKind::Rosbag2);
        assert_eq!((recording.name(), recording.sweeps()), ("walk", Some(4)));
        assert_eq!(recording.base_from_lidar(), base_from_lidar());
        let read = replay(dir.path());
        assert_eq!(given.len(), read.len());
        given.iter().zip(&read).for_each(|(given, read)| assert_same(given, read));
        assert_eq!(content_hash(dir.path()).unwrap(), recorded.content_hash);
        let bare = dir.path().join("walk_0.mcap");
        assert_eq!(replay(&bare), read);
        assert_eq!(open(&bare).unwrap().kind(), RecordingKind::Mcap);
    }
}

#[test]
fn a_sweep_without_firings_keeps_its_start_and_its_end() {
    let dir = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(dir.path(), settings()).unwrap();
    let (start, end) = (Time::from_nanos(1_000_000_000), Time::from_nanos(1_100_000_000));
    let empty = Observation::Sweep(Sweep { start, end, rings: vlp16::LASERS as u16, returns: Vec::new() });
    recorder.write(end, &Record::Observation(&empty)).unwrap();
    recorder.finish().unwrap();
    assert_eq!(replay(dir.path()), [empty]);
}

#[test]
fn clouds_alone_give_the_hits_back_within_the_precision_of_their_fields() {
    for cloud_stamp in [CloudStamp::ScanEnd, CloudStamp::ScanStart] {
        let dir = tempfile::tempdir().unwrap();
        let (given, _) =
            record(dir.path(), RecorderSettings { packets: false, cloud_stamp, ..settings() }, 2);
        let sweeps = |all: Vec<Observation>| {
            all.into_iter().filter_map(|one| match one {
                Observation::Sweep(sweep) => Some(sweep),
                _ => None,
            })
        };
        let read: Vec<Sweep> = sweeps(replay(dir.path())).collect();
        assert_eq!(read.len(), 2);
        for (given, read) in sweeps(given).zip(&read) {
            assert_eq!((given.end, given.rings), (read.end, read.rings));
            let hits: Vec<_> = given.returns.iter().filter(|one| one.range_m.is_some()).collect();
            assert_eq!(hits.len(), read.returns.len());
            for (given_return, read_return) in hits.into_iter().zip(&read.returns) {
                let distance = given_return.point().unwrap() - read_return.point().unwrap();
                // Coordinates under 32 m in single precision: 2^-20 m each.
                assert!(distance.amax() <= 1e-6);
                assert_eq!(given_return.ring, read_return.ring);
                assert_eq!(given_return.intensity, read_return.intensity);
                let fired = given.start + given_return.fired_after;
                let fired_back = read.start + read_return.fired_after;
                // A tenth of a second in single precision: under 4 ns.
                assert!((fired - fired_back).abs() <= Span::from_nanos(5));
            }
        }
    }
}

#[test]
fn every_point_moved_by_the_true_pose_of_its_own_firing_lies_on_the_floor_or_a_wall() {
    for packets in [true, false] {
        let dir = tempfile::tempdir().unwrap();
        record(dir.path(), RecorderSettings { packets, ..settings() }, 2);
        for observation in replay(dir.path()) {
            let Observation::Sweep(sweep) = observation else { continue };
            for one in &sweep.returns {
                let Some(point) = one.point() else { continue };
                let world_from_base = synthetic::world_from_base(sweep.start + one.fired_after);
                let p = world_from_base * base_from_lidar() * point;
                let off_m = [p.z.abs(), (p.x.abs() - 12.0).abs(), (p.y.abs() - 9.0).abs()];
                let off_m = off_m.into_iter().fold(f64::INFINITY, f64::min);
                // The wire's cost: the lasers' offsets (the walk's beams start at the center), a distance step, a
                // step and a half of azimuth. Half a sweep of motion would be a decimeter.
                let azimuth_rad = 1.5 * 0.01_f64.to_radians();
                let limit_m =
                    vlp16::OFFSET_M[0] + vlp16::DISTANCE_STEP_M + azimuth_rad * one.range_m.unwrap();
                assert!(off_m < limit_m, "{off_m} m at {p}, fired after {}", one.fired_after);
            }
        }
    }
}

#[test]
fn log_times_strictly_increase_and_a_sweep_is_logged_at_its_very_end() {
    let dir = tempfile::tempdir().unwrap();
    let (_, recorded) = record(dir.path(), settings(), 3);
    let mut cursor = McapCursor::new(&[dir.path().join("walk_0.mcap")]);
    let (mut last, mut messages, mut ends) = (0, 0, Vec::new());
    while let Some(item) = cursor.next() {
        let Item::Message { topic, log_time, .. } = item.unwrap() else { continue };
        assert!(log_time > last, "{} at {log_time} after {last}", topic.name);
        (last, messages) = (log_time, messages + 1);
        if topic.name == "/velodyne_points" {
            ends.push(log_time);
        }
    }
    assert_eq!(messages, recorded.messages);
    assert_eq!(ends, [1_100_000_000, 1_200_000_000, 1_300_000_000]);
}

#[test]
fn equal_runs_have_equal_hashes_and_files_and_a_changed_bit_changes_them() {
    let dirs = [(); 3].map(|()| tempfile::tempdir().unwrap());
    let (_, first) = record(dirs[0].path(), settings(), 1);
    let (_, again) = record(dirs[1].path(), settings(), 1);
    assert_eq!(first, again);
    for file in ["walk_0.mcap", "metadata.yaml", "gt/gt_base_link.tum", "gt/gt_200hz.tum"] {
        let read = |dir: usize| std::fs::read(dirs[dir].path().join(file)).unwrap();
        assert_eq!(read(0), read(1), "{file}");
    }
    let moved = RecorderSettings { base_from_imu: Pose::translation(-0.02, 0.0, 0.050_000_1), ..settings() };
    let (_, other) = record(dirs[2].path(), moved, 1);
    assert_ne!(first.content_hash, other.content_hash);
    assert!(first.labels_hash.is_some() && first.labels_hash == other.labels_hash);
}

#[test]
fn the_reference_is_the_truth_at_sweep_ends_in_the_frame_of_the_start() {
    let dir = tempfile::tempdir().unwrap();
    record(dir.path(), settings(), 3);
    let reference = open(dir.path()).unwrap().reference().unwrap().unwrap();
    assert_eq!((reference.has_heading, reference.pose_time), (true, PoseTime::SweepEnd));
    assert_eq!(reference.trajectory.len(), 3);
    for (index, (stamp, pose)) in reference.trajectory.poses().iter().enumerate() {
        assert_eq!(*stamp, Time::from_nanos(1_100_000_000 + 100_000_000 * index as i64));
        let wanted = synthetic::start_from_base(*stamp);
        assert!((pose.translation.vector - wanted.translation.vector).norm() < 2e-9);
        assert!(pose.rotation.angle_to(&wanted.rotation) < 5e-9);
    }
    // A bare MCAP tells the same in the frame of the world.
    let bare = open(&dir.path().join("walk_0.mcap")).unwrap().reference().unwrap().unwrap();
    for ((_, start_from_base), (stamp, world_from_base)) in
        reference.trajectory.poses().iter().zip(bare.trajectory.poses())
    {
        let wanted = synthetic::world_from_start() * start_from_base;
        assert!((wanted.translation.vector - world_from_base.translation.vector).norm() < 5e-9, "{stamp}");
    }
}

#[test]
fn truth_files_hold_the_lidar_at_both_ends_of_every_sweep() {
    let dir = tempfile::tempdir().unwrap();
    record(dir.path(), settings(), 3);
    let start_from_lidar = |stamp: Time| synthetic::start_from_base(stamp) * base_from_lidar();
    for (file, first) in [
        ("gt_lidar.tum", 1_100_000_000),
        ("gt_lidar_scan_end.tum", 1_100_000_000),
        // Before the first tick: carried back with the twist.
        ("gt_lidar_scan_start.tum", 1_000_000_000),
    ] {
        let trajectory = read_tum(&dir.path().join("gt").join(file)).unwrap();
        assert_eq!(trajectory.len(), 3, "{file}");
        for (index, (stamp, pose)) in trajectory.poses().iter().enumerate() {
            assert_eq!(*stamp, Time::from_nanos(first + 100_000_000 * index as i64), "{file}");
            let wanted = start_from_lidar(*stamp);
            assert!((pose.translation.vector - wanted.translation.vector).norm() < 2e-9, "{file} {stamp}");
        }
    }
    let dense = read_tum(&dir.path().join("gt/gt_200hz.tum")).unwrap();
    let steps: Vec<i64> = dense.poses().windows(2).map(|w| (w[1].0 - w[0].0).nanos()).collect();
    assert!(steps.iter().all(|step| *step == 5_000_000), "{steps:?}");
}

#[test]
fn labels_stand_in_a_recording_of_their_own_one_per_point_at_the_log_time_of_the_cloud() {
    let dir = tempfile::tempdir().unwrap();
    let (given, recorded) = record(dir.path(), settings(), 2);
    assert!(recorded.topics.iter().all(|topic| topic.topic != "/ground_truth/labels"));
    let labels = dir.path().join("gt/labels");
    assert_eq!(Some(content_hash(&labels).unwrap()), recorded.labels_hash);
    let mut cursor = McapCursor::new(&[labels.join("labels_0.mcap")]);
    let mut messages = Vec::new();
    while let Some(item) = cursor.next() {
        if let Item::Message { topic, log_time, payload } = item.unwrap() {
            messages.push((log_time, decode::<PointCloud2>(&topic, &payload).unwrap()));
        }
    }
    let sweeps = given.iter().filter_map(|one| match one {
        Observation::Sweep(sweep) => Some(sweep),
        _ => None,
    });
    assert_eq!(messages.len(), 2);
    for (sweep, (log_time, cloud)) in sweeps.zip(&messages) {
        assert_eq!(*log_time as i64, sweep.end.nanos());
        let hits = sweep.returns.iter().filter(|one| one.range_m.is_some());
        assert_eq!(hits.clone().count(), cloud.width as usize);
        for (one, entry) in hits.zip(cloud.data.chunks_exact(20)) {
            // Class ground is 1; the walk numbers objects by ring.
            assert_eq!((entry[0], entry[4]), (1, one.ring as u8));
            let range_m = f32::from_le_bytes([entry[8], entry[9], entry[10], entry[11]]);
            assert_eq!(Some(range_m), one.range_m.map(|range_m| range_m as f32));
        }
    }
}

#[test]
fn nothing_that_is_already_on_disk_is_overwritten() {
    let dir = tempfile::tempdir().unwrap();
    record(dir.path(), settings(), 1);
    let message = Recorder::create(dir.path(), settings()).err().unwrap().to_string();
    assert!(message.contains("walk_0.mcap: cannot create"), "{message}");
    assert_eq!(replay(dir.path()).len(), 26);
}

#[test]
fn an_instant_that_goes_back_and_a_foreign_sweep_are_refused_with_the_file_named() {
    let dir = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(dir.path(), settings()).unwrap();
    let (sweep, labels) = synthetic::sweep(Time::from_nanos(1_100_000_000));
    let observation = Observation::Sweep(sweep.clone());
    recorder.write(sweep.end, &Record::Observation(&observation)).unwrap();
    let mut refused = |now: Time, record: &Record<'_>| recorder.write(now, record).unwrap_err().to_string();
    let message = refused(Time::from_nanos(1_050_000_000), &Record::Observation(&observation));
    assert!(message.contains("walk_0.mcap") && message.contains("never go back"), "{message}");
    let message = refused(sweep.end, &Record::Labels { sweep: &sweep, labels: &labels[1..] });
    assert!(message.contains("one label per return"), "{message}");
    let mut odd = sweep.clone();
    odd.returns[5].fired_after = Span::from_nanos(1);
    let message = refused(sweep.end, &Record::Observation(&Observation::Sweep(odd)));
    assert!(message.contains("no firing of a VLP-16"), "{message}");
}

#[test]
fn a_recorder_in_the_background_writes_the_same_bits_and_says_what_it_cannot_write() {
    let (front, back) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (given, hash) = record(front.path(), settings(), 3);
    let mut recorder = Recorder::create(back.path(), settings()).unwrap();
    recorder.truth_map(Time::SIMULATION_START, &synthetic::map()).unwrap();
    let mut recorder = BackgroundRecorder::start(recorder).unwrap();
    walk(3, &mut recorder);
    let recorded = recorder.finish().unwrap().unwrap().finish().unwrap();
    assert_eq!(recorded, hash);
    assert_eq!(replay(back.path()).len(), given.len());

    let dropped = tempfile::tempdir().unwrap();
    let mut recorder =
        BackgroundRecorder::start(Recorder::create(dropped.path(), settings()).unwrap()).unwrap();
    walk(3, &mut recorder);
    drop(recorder);
    assert_eq!(replay(dropped.path()), replay(back.path()));

    // One firing that no VLP-16 makes: the run goes on for a while, then it is told, once.
    let odd = tempfile::tempdir().unwrap();
    let mut recorder = BackgroundRecorder::start(Recorder::create(odd.path(), settings()).unwrap()).unwrap();
    let (mut sweep, _) = synthetic::sweep(Time::from_nanos(1_100_000_000));
    sweep.returns[5].fired_after = Span::from_nanos(1);
    let end = sweep.end;
    let observation = Observation::Sweep(sweep);
    recorder.write(end, &Record::Observation(&observation)).unwrap();
    let told = (0..1000).find_map(|_| recorder.write(end, &Record::Command(&Twist::default())).err());
    let message = told.unwrap().to_string();
    assert!(message.contains("walk_0.mcap") && message.contains("no firing of a VLP-16"), "{message}");
    assert!(recorder.finish().unwrap().is_none());
    let mut recorder =
        BackgroundRecorder::start(Recorder::create(&odd.path().join("end"), settings()).unwrap()).unwrap();
    recorder.write(end, &Record::Observation(&observation)).unwrap();
    let message = recorder.finish().err().unwrap().to_string();
    assert!(message.contains("no firing of a VLP-16"), "{message}");
}
