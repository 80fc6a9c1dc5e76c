use super::round_trip::{record, replay, settings};
use super::synthetic::walk;
use crate::dataset::ros2::{Message, PointCloud2};
use crate::dataset::*;
use arborloop_base::vlp16::ReturnMode;
use arborloop_base::{Imu, Observation, Return, Seed, Span, Sweep, Time};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::path::Path;

fn refused(path: &Path) -> String {
    open(path).unwrap_err().to_string()
}

/// What can be read before the end, and the error that ends it.
fn read_until_error(path: &Path) -> (Vec<Observation>, Option<String>) {
    let recording = match open(path) {
        Ok(recording) => recording,
        Err(error) => return (Vec::new(), Some(error.to_string())),
    };
    let mut read = Vec::new();
    for item in recording.observations().unwrap() {
        match item {
            Ok(observation) => read.push(observation),
            Err(error) => return (read, Some(error.to_string())),
        }
    }
    (read, None)
}

#[test]
fn what_is_no_recording_is_refused_with_what_is_understood() {
    let dir = tempfile::tempdir().unwrap();
    for (content, found) in [
        (&b""[..], "found an empty file"),
        (b"hello world", "found a file that starts with 68 65 6c 6c 6f 20 77 6f"),
        (b"#ROSBAG V2.0\n", "found a ROS 1 bag"),
        (b"SQLite format 3\0", "found an SQLite file"),
    ] {
        let path = dir.path().join("odd.mcap");
        std::fs::write(&path, content).unwrap();
        let message = refused(&path);
        assert!(message.contains("odd.mcap") && message.contains(found), "{message}");
        assert!(message.contains("wanted a rosbag2 directory"), "{message}");
    }
    assert!(refused(&dir.path().join("none.mcap")).contains("cannot open"));
    assert!(
        refused(tempfile::tempdir().unwrap().path()).contains("without metadata.yaml and without *.mcap")
    );
}

#[test]
fn a_directory_of_another_storage_is_refused_at_its_key() {
    let dir = tempfile::tempdir().unwrap();
    let metadata = dir.path().join("metadata.yaml");
    std::fs::write(&metadata, "rosbag2_bagfile_information:\n  storage_identifier: sqlite3\n").unwrap();
    let message = refused(dir.path());
    assert!(message.contains("metadata.yaml, field `storage_identifier`: found `sqlite3`"), "{message}");
    std::fs::write(&metadata, "rosbag2_bagfile_information:\n  storage_identifier: mcap\n").unwrap();
    assert!(refused(dir.path()).contains("field `relative_file_paths`: found no file"));
    let listed = "  storage_identifier: mcap\n  relative_file_paths:\n    - gone_0.mcap\n";
    std::fs::write(&metadata, listed).unwrap();
    let message = refused(dir.path());
    assert!(message.contains("gone_0.mcap: cannot open"), "{message}");
}

#[test]
fn a_recording_without_messages_or_without_a_lidar_says_so() {
    let dir = tempfile::tempdir().unwrap();
    Recorder::create(dir.path(), settings()).unwrap().finish().unwrap();
    let message = refused(dir.path());
    assert!(message.contains("a recording without messages; wanted a lidar topic"), "{message}");
    let dir = tempfile::tempdir().unwrap();
    record(dir.path(), RecorderSettings { clouds: false, packets: false, ..settings() }, 1);
    let message = refused(dir.path());
    assert!(message.contains("/imu/data (sensor_msgs/msg/Imu)"), "{message}");
}

#[test]
fn a_file_that_was_cut_off_gives_what_stands_before_the_cut_and_then_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let (given, _) = record(dir.path(), RecorderSettings { clouds: false, ..settings() }, 12);
    let whole = std::fs::read(dir.path().join("walk_0.mcap")).unwrap();
    let path = dir.path().join("cut.mcap");
    let mut most = 0;
    for share in [1, 2, 3, 4, 5, 6, 7] {
        let cut = whole.len() * share / 8;
        std::fs::write(&path, &whole[..cut]).unwrap();
        let (read, error) = read_until_error(&path);
        let error = error.unwrap();
        assert!(error.contains("cut.mcap: the file ends after "), "{error}");
        assert_eq!(read.iter().zip(&given).filter(|(a, b)| a.stamp() == b.stamp()).count(), read.len());
        assert!(read.len() >= most);
        most = read.len();
    }
    assert!(most > given.len() / 2, "{most} of {}", given.len());
    // Nothing but the summary is gone: every message is there.
    std::fs::write(&path, &whole[..whole.len() - 40]).unwrap();
    assert_eq!(read_until_error(&path).0.len(), given.len());
}

#[test]
fn a_run_that_was_aborted_keeps_all_that_it_had() {
    let dir = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(dir.path(), settings()).unwrap();
    let given = walk(2, &mut recorder);
    drop(recorder);
    assert_eq!(replay(dir.path()).len(), given.len());
    assert!(dir.path().join("metadata.yaml").is_file());
    assert!(dir.path().join("gt/gt_base_link.tum").is_file());
    // Killed: no metadata.yaml, no truth files, a file without an end. The truth is still in its topic.
    std::fs::remove_file(dir.path().join("metadata.yaml")).unwrap();
    std::fs::remove_dir_all(dir.path().join("gt")).unwrap();
    let mcap = dir.path().join("walk_0.mcap");
    let whole = std::fs::read(&mcap).unwrap();
    std::fs::write(&mcap, &whole[..whole.len() - 500]).unwrap();
    let (read, error) = read_until_error(dir.path());
    assert!(read.len() > 20 && error.is_some());
    assert!(!open(dir.path()).unwrap().reference().unwrap().unwrap().trajectory.is_empty());
}

#[test]
fn garbled_bytes_are_errors_or_other_numbers_but_never_a_panic() {
    let dir = tempfile::tempdir().unwrap();
    record(dir.path(), RecorderSettings { packets: false, ..settings() }, 1);
    let whole = std::fs::read(dir.path().join("walk_0.mcap")).unwrap();
    let path = dir.path().join("garbled.mcap");
    let stream = Seed(5).stream("garble");
    for round in 0..150 {
        let mut draws = stream.at(round);
        let mut bytes = whole.clone();
        for _ in 0..=round % 4 {
            // The ends of the file hold the records; the middle is one compressed chunk.
            let span = if draws.chance(0.5) { 2_000.min(bytes.len()) } else { bytes.len() };
            let from_front = (draws.unit() * span as f64) as usize;
            let at = if draws.chance(0.5) { from_front } else { bytes.len() - 1 - from_front };
            bytes[at] = draws.bits() as u8;
        }
        std::fs::write(&path, &bytes).unwrap();
        let _ = read_until_error(&path);
        let _ = open(&path).map(|recording| recording.reference());
        let _ = content_hash(&path);
    }
}

/// Writes one message after another with bytes of the payload changed, uncompressed, so that nothing but our own
/// decoders stands in the way.
fn garble_payloads<M: Message>(topic: &str, message: &M, rounds: u64) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("garbled.mcap");
    let whole = cdr::encode(message).unwrap();
    let stream = Seed(6).stream(topic);
    for round in 0..rounds {
        let file = std::fs::File::create(&path).unwrap();
        let mut writer = mcap::WriteOptions::new().compression(None).create(file).unwrap();
        let mark = mcap::records::Metadata { name: "arborloop".to_owned(), metadata: BTreeMap::new() };
        writer.write_metadata(&mark).unwrap();
        let schema = writer.add_schema(M::TYPE, "ros2msg", M::DEFINITION.as_bytes()).unwrap();
        let channel = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        let points =
            writer.add_schema(PointCloud2::TYPE, "ros2msg", PointCloud2::DEFINITION.as_bytes()).unwrap();
        let points = writer.add_channel(points, "/velodyne_points", "cdr", &BTreeMap::new()).unwrap();
        let mut draws = stream.at(round);
        let mut payload = whole.clone();
        for _ in 0..1 + round % 3 {
            // Headers, lengths and layouts stand in front.
            let span = if draws.chance(0.7) { payload.len().min(260) } else { payload.len() };
            let at = (draws.unit() * span as f64) as usize;
            payload[at] = if draws.chance(0.5) { 0xff } else { draws.bits() as u8 };
        }
        if draws.chance(0.2) {
            payload.truncate((draws.unit() * payload.len() as f64) as usize);
        }
        for (channel_id, payload) in [(channel, &payload), (points, &vec![0, 1, 0, 0])] {
            let log_time = if draws.chance(0.1) { u64::MAX } else { round };
            let header =
                mcap::records::MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, payload).unwrap();
        }
        writer.finish().unwrap();
        let (read, _) = read_until_error(&path);
        for sweep in read.iter().filter_map(|one| match one {
            Observation::Sweep(sweep) => Some(sweep),
            _ => None,
        }) {
            assert!(sweep.end >= sweep.start);
            assert!(sweep.returns.iter().all(|one| one.ring < sweep.rings && one.fired_after.nanos() >= 0));
            assert!(
                sweep.returns.iter().all(|one| one.point().is_none_or(|p| p.iter().all(|n| n.is_finite())))
            );
        }
    }
}

#[test]
fn garbled_messages_are_errors_or_sound_sweeps_but_never_a_panic() {
    let (sweep, _) = super::synthetic::sweep(Time::from_nanos(1_100_000_000));
    let few = Sweep { returns: sweep.returns[..800].to_vec(), ..sweep };
    let planar = Sweep { rings: 1, returns: Vec::new(), ..few.clone() };
    let planar = Sweep {
        returns: (0..90)
            .map(|n| Return {
                azimuth_rad: 0.01 * f64::from(n),
                ring: 0,
                fired_after: Span::ZERO,
                ..few.returns[0]
            })
            .collect(),
        ..planar
    };
    garble_payloads("/velodyne_points", &cloud::message_of(&few, few.end, "velodyne").unwrap(), 400);
    garble_payloads(
        "/velodyne_packets",
        &packets::message_of(&few, ReturnMode::Strongest, "velodyne").unwrap(),
        400,
    );
    garble_payloads("/scan", &scan::message_of(&planar, "laser").unwrap(), 400);
    garble_payloads("/imu/data", &states::imu_message(&imu(), "imu_link").unwrap(), 100);
}

fn imu() -> Imu {
    Imu { stamp: Time::default(), specific_force_mps2: Vector3::z() * 9.81, rate_radps: Vector3::zeros() }
}
