use super::round_trip::replay;
use crate::dataset::bag::{Bag, Moment};
use crate::dataset::ros2::{
    Header, Imu, Message, NavSatFix, NavSatStatus, PointCloud2, PointField, Quaternion, Text,
};
use crate::dataset::*;
use arborloop_base::{FixQuality, Observation, Record, Return, Sink, Span, Sweep, Time, wrap_angle};
use std::collections::BTreeMap;
use std::path::Path;

const NOW: Time = Time::from_nanos(1_700_000_000_123_456_789);

fn write<M: Message>(path: &Path, messages: &[(&str, M)]) {
    let mut bag = Bag::create(path, "someone", BTreeMap::new()).unwrap();
    for (topic, message) in messages {
        bag.write(NOW, topic, Moment::Beside, message).unwrap();
    }
    bag.finish().unwrap();
}

fn field(name: &str, offset: u32, datatype: u8) -> PointField {
    PointField { name: name.to_owned(), offset, datatype, count: 1 }
}

/// Two columns of two beams in ouster-ros' layout, highest beam first; one beam has no return.
fn ouster() -> PointCloud2 {
    let mut data = Vec::new();
    for (ring, up) in [(0_u16, 0.5_f32), (1, -0.5)] {
        for column in 0..2_u32 {
            let missed = ring == 1 && column == 1;
            let mut point = [0_u8; 48];
            let xyz = if missed { [0.0; 3] } else { [4.0, column as f32, up] };
            for (axis, number) in xyz.into_iter().enumerate() {
                point[4 * axis..][..4].copy_from_slice(&number.to_le_bytes());
            }
            point[16..20].copy_from_slice(&33.0_f32.to_le_bytes());
            point[20..24].copy_from_slice(&(column * 97_656).to_le_bytes());
            point[26..28].copy_from_slice(&ring.to_le_bytes());
            data.extend_from_slice(&point);
        }
    }
    PointCloud2 {
        header: Header::new(NOW, "os_lidar").unwrap(),
        height: 2,
        width: 2,
        fields: vec![
            field("x", 0, 7),
            field("y", 4, 7),
            field("z", 8, 7),
            field("intensity", 16, 7),
            field("t", 20, 6),
            field("ring", 26, 4),
        ],
        is_bigendian: false,
        point_step: 48,
        row_step: 96,
        data,
        is_dense: true,
    }
}

fn only_sweep(path: &Path) -> Sweep {
    match replay(path).as_slice() {
        [Observation::Sweep(sweep)] => sweep.clone(),
        other => panic!("not one sweep: {other:?}"),
    }
}

fn refused(cloud: PointCloud2) -> String {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bad.mcap");
    write(&path, &[("/points", cloud)]);
    let recording = open(&path).unwrap();
    let message = recording.observations().unwrap().next().unwrap().unwrap_err().to_string();
    assert!(message.contains("bad.mcap, message 0 of /points: found "), "{message}");
    message
}

#[test]
fn an_organized_ouster_cloud_becomes_a_sweep_in_firing_order_with_rings_from_below() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("o.mcap");
    write(&path, &[("/ouster/points", ouster())]);
    let sweep = only_sweep(&path);
    assert_eq!((sweep.start, sweep.end, sweep.rings), (NOW, NOW + Span::from_nanos(97_656), 2));
    let seen: Vec<(u16, i64)> = sweep.returns.iter().map(|one| (one.ring, one.fired_after.nanos())).collect();
    assert_eq!(seen, [(1, 0), (0, 0), (1, 97_656)]);
    assert!((sweep.returns[2].point().unwrap() - nalgebra::Point3::new(4.0, 1.0, 0.5)).norm() < 1e-12);
    assert_eq!(sweep.returns[0].intensity, 33.0);
}

#[test]
fn an_organized_cloud_without_rings_ranks_its_rows() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("o.mcap");
    let mut cloud = ouster();
    cloud.fields.retain(|field| field.name != "ring");
    write(&path, &[("/points", cloud)]);
    assert_eq!(only_sweep(&path).returns.iter().map(|one| one.ring).collect::<Vec<_>>(), [1, 0, 1]);
}

#[test]
fn point_times_on_the_stamps_own_clock_are_understood() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("h.mcap");
    let mut cloud = ouster();
    cloud.fields.retain(|field| field.name != "t");
    cloud.fields.push(field("timestamp", 32, 8));
    for (index, point) in cloud.data.chunks_exact_mut(48).enumerate() {
        let seconds = NOW.seconds() - 0.05 + 0.1 * (index % 2) as f64;
        point[32..40].copy_from_slice(&seconds.to_le_bytes());
    }
    write(&path, &[("/hesai", cloud)]);
    let sweep = only_sweep(&path);
    // Unix seconds in 64 bits step by a quarter of a microsecond.
    assert!((sweep.start - (NOW - Span::from_millis(50))).abs() < Span::from_nanos(1_000));
    assert!((sweep.end - (NOW + Span::from_millis(50))).abs() < Span::from_nanos(1_000));
}

#[test]
fn a_cloud_that_lies_about_itself_is_refused_with_its_topic_and_number() {
    let change = |change: fn(&mut PointCloud2)| {
        let mut cloud = ouster();
        change(&mut cloud);
        refused(cloud)
    };
    let message = change(|cloud| cloud.fields.retain(|field| field.name != "z"));
    assert!(message.contains("found the fields x, y, intensity, t, ring; wanted a field `z`"), "{message}");
    let message = change(|cloud| {
        cloud.fields.retain(|field| field.name != "ring");
        (cloud.height, cloud.width, cloud.row_step) = (1, 4, 192);
    });
    assert!(message.contains("wanted a field `ring`"), "{message}");
    for lie in [
        |cloud: &mut PointCloud2| cloud.width = 3,
        |cloud: &mut PointCloud2| cloud.height = u32::MAX,
        |cloud: &mut PointCloud2| cloud.row_step = 0,
        |cloud: &mut PointCloud2| cloud.data.truncate(100),
    ] {
        assert!(change(lie).contains("wanted data as long as the header says"));
    }
    assert!(change(|cloud| cloud.point_step = 4).contains("wanted a field inside the point"));
    assert!(change(|cloud| cloud.fields[1].offset = u32::MAX).contains("wanted a field inside the point"));
    assert!(change(|cloud| cloud.fields[0].datatype = 9).contains("wanted a datatype from 1 (INT8)"));
}

#[test]
fn a_payload_that_is_no_cdr_is_refused_with_its_topic_and_number() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.mcap");
    let mut writer = mcap::Writer::new(std::fs::File::create(&path).unwrap()).unwrap();
    let schema = writer.add_schema(PointCloud2::TYPE, "ros2msg", b"").unwrap();
    let channel = writer.add_channel(schema, "/points", "cdr", &BTreeMap::new()).unwrap();
    let header =
        mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, &[0, 1, 0, 0, 7, 7]).unwrap();
    writer.finish().unwrap();
    let recording = open(&path).unwrap();
    let items: Vec<_> = recording.observations().unwrap().collect();
    assert_eq!(items.len(), 1);
    let message = items[0].as_ref().unwrap_err().to_string();
    assert!(message.contains("t.mcap, message 0 of /points: found 6 bytes that do not decode"), "{message}");
}

#[test]
fn several_clouds_without_a_usual_name_are_not_guessed_between() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("two.mcap");
    write(&path, &[("/front", ouster()), ("/rear", ouster())]);
    let message = open(&path).unwrap_err().to_string();
    assert!(
        message.contains(r#"["/front", "/rear"]; wanted one, or one named /velodyne_points"#),
        "{message}"
    );
    write(&dir.path().join("text.mcap"), &[("/chat", Text { data: "hi".to_owned() })]);
    let message = open(&dir.path().join("text.mcap")).unwrap_err().to_string();
    assert!(message.contains("/chat (std_msgs/msg/String); wanted a lidar topic"), "{message}");
}

#[test]
fn without_a_datum_of_its_own_a_recordings_first_fix_is_the_origin() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("f.mcap");
    let fix = |latitude: f64| NavSatFix {
        header: Header::new(NOW, "gps").unwrap(),
        status: NavSatStatus { status: 0, service: 1 },
        latitude,
        longitude: 10.0,
        altitude: 100.0,
        position_covariance: [9.0; 9],
        position_covariance_type: 0,
    };
    let zero = crate::dataset::ros2::PoseMsg::from(&arborloop_base::Pose::identity()).position;
    let imu = Imu {
        header: Header::new(NOW, "imu").unwrap(),
        orientation: Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 },
        orientation_covariance: [0.0; 9],
        angular_velocity: zero,
        angular_velocity_covariance: [0.0; 9],
        linear_acceleration: zero,
        linear_acceleration_covariance: [0.0; 9],
    };
    let mut bag = Bag::create(&path, "someone", BTreeMap::new()).unwrap();
    bag.write(NOW, "/fix", Moment::Beside, &fix(50.0)).unwrap();
    bag.write(NOW, "/fix", Moment::Beside, &fix(50.000_01)).unwrap();
    bag.write(NOW, "/points", Moment::Beside, &ouster()).unwrap();
    bag.write(NOW, "/imu", Moment::Beside, &imu).unwrap();
    bag.finish().unwrap();
    let read = replay(&path);
    let [Observation::Fix(first), Observation::Fix(second), Observation::Sweep(_), Observation::Imu(_)] =
        &read[..]
    else {
        panic!("{read:?}")
    };
    assert!(first.position_m.norm() < 1e-9);
    // A degree of latitude at 50 degrees north is 111 229 m.
    assert!((second.position_m.y - 1.112_29).abs() < 1e-4, "{}", second.position_m);
    assert_eq!((second.quality, second.covariance_m2.norm()), (FixQuality::Single, 0.0));
    assert!(open(&path).unwrap().reference().unwrap().is_none());
}

#[test]
fn a_planar_sweep_goes_by_laser_scan_and_comes_back_in_single_precision() {
    let returns = (0..897).map(|bin: u32| Return {
        azimuth_rad: wrap_angle(-std::f64::consts::PI + 0.007 * f64::from(bin)),
        elevation_rad: 0.0,
        range_m: (!bin.is_multiple_of(10)).then(|| 0.5 + 0.013 * f64::from(bin)),
        ring: 0,
        number: 0,
        fired_after: Span::ZERO,
        intensity: 0.0,
    });
    let sweep = Sweep { start: NOW, end: NOW, rings: 1, returns: returns.collect() };
    let dir = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(dir.path(), RecorderSettings::default()).unwrap();
    recorder.write(NOW, &Record::Observation(&Observation::Sweep(sweep.clone()))).unwrap();
    recorder.finish().unwrap();
    let read = only_sweep(dir.path());
    assert_eq!((read.start, read.end, read.rings, read.returns.len()), (NOW, NOW, 1, 897));
    for (given, read) in sweep.returns.iter().zip(&read.returns) {
        // 897 steps of a single-precision increment near 0.007: 897 * 2^-32, and the first bearing's 2^-23.
        assert!(wrap_angle(given.azimuth_rad - read.azimuth_rad).abs() < 1e-6);
        assert_eq!(given.range_m.map(|range_m| range_m as f32), read.range_m.map(|range_m| range_m as f32));
    }
    let mut uneven = sweep.clone();
    uneven.returns[100].azimuth_rad += 0.001;
    let mut recorder = Recorder::create(&dir.path().join("uneven"), RecorderSettings::default()).unwrap();
    let refused = recorder.write(NOW, &Record::Observation(&Observation::Sweep(uneven))).unwrap_err();
    assert!(refused.to_string().contains("wanted a planar sweep of evenly spaced bearings"), "{refused}");
}
