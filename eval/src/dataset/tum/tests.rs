use super::*;

fn refused(text: &str) -> String {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("bad.tum");
    std::fs::write(&path, text).unwrap();
    read_tum(&path).unwrap_err().to_string()
}

#[test]
fn a_trajectory_goes_to_text_and_comes_back() {
    let poses = (0..50_i64).map(|n| {
        let turn = UnitQuaternion::from_euler_angles(0.01 * n as f64, -0.02, 0.1 * n as f64);
        let place = Translation3::new(0.123_456_789 * n as f64, -5.0, 1e-9);
        (Time::from_nanos(1_691_337_600_000_000_000 + n * 99_999_999), Pose::from_parts(place, turn))
    });
    let trajectory = Trajectory::new(poses.collect()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.tum");
    write_tum(&path, &trajectory).unwrap();
    let back = read_tum(&path).unwrap();
    assert_eq!(back.len(), trajectory.len());
    for ((stamp, pose), (stamp_back, pose_back)) in trajectory.poses().iter().zip(back.poses()) {
        assert_eq!(stamp, stamp_back);
        // Nine decimals: half a nanometer per axis, and as much per component of the quaternion.
        assert!((pose.translation.vector - pose_back.translation.vector).amax() <= 0.5e-9 + 1e-15);
        assert!(pose.rotation.angle_to(&pose_back.rotation) < 5e-9);
    }
    for line in std::fs::read_to_string(&path).unwrap().lines() {
        assert_eq!(line.split(' ').count(), 8);
        assert!(line.split(' ').all(|column| column.split_once('.').is_some_and(|(_, d)| d.len() == 9)));
    }
}

#[test]
fn remarks_blank_lines_and_evo_exponents_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("evo.tum");
    let text = "# stamp x y z qx qy qz qw\n\n1.000000000000000000e+00 1.0e+00 0 0 0 0 0 2\n2 1 0 0 0 0 0 1\n";
    std::fs::write(&path, text).unwrap();
    let trajectory = read_tum(&path).unwrap();
    assert_eq!(trajectory.poses()[0].0, Time::from_nanos(1_000_000_000));
    assert_eq!(trajectory.poses()[0].1.rotation, UnitQuaternion::identity());
}

#[test]
fn a_refused_line_is_named_with_what_was_found_and_what_was_wanted() {
    let good = "1 0 0 0 0 0 0 1\n";
    for (bad, found, wanted) in [
        ("2 0 0 0 0 0 0", "7 columns", "8 numbers"),
        ("2 0 0 0 0 0 0 1 9", "9 columns", "8 numbers"),
        ("2,0,0,0,0,0,0,1", "1 columns", "8 numbers"),
        ("2 nan 0 0 0 0 0 1", "`nan`", "a finite number"),
        ("2 0 0 inf 0 0 0 1", "`inf`", "a finite number"),
        ("2 0 0 x 0 0 0 1", "`x`", "a finite number"),
        ("NaN 0 0 0 0 0 0 1", "stamp `NaN`", "seconds as a decimal number"),
        ("2 0 0 0 0 0 0 0", "quaternion 0 0 0 0", "a quaternion with a length"),
        ("1 0 0 0 0 0 0 1", "stamp 1.000000000 after 1.000000000", "strictly increase"),
        ("0.5 0 0 0 0 0 0 1", "stamp 0.500000000 after 1.000000000", "strictly increase"),
    ] {
        let message = refused(&format!("# remark\n{good}{bad}\n"));
        assert!(message.contains("bad.tum:3: found "), "{message}");
        assert!(message.contains(found) && message.contains(wanted), "{message}");
    }
}

#[test]
fn a_file_without_poses_or_without_text_is_refused() {
    assert!(refused("").contains("0 bytes without a pose"));
    assert!(refused("# only a remark\n").contains("without a pose"));
    let dir = tempfile::tempdir().unwrap();
    let missing = read_tum(&dir.path().join("none.tum")).unwrap_err().to_string();
    assert!(missing.contains("none.tum") && missing.contains("cannot read"), "{missing}");
    let path = dir.path().join("bytes.tum");
    std::fs::write(&path, [0xff, 0xfe, 0x00]).unwrap();
    assert!(read_tum(&path).unwrap_err().to_string().contains("no text"));
}
