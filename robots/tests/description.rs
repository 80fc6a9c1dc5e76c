//! URDF files read and refused.

use arborloop_robots::{JointKind, Robot, RobotError, go1};
use std::path::PathBuf;

#[test]
fn the_go1_has_its_sensor_frames_where_its_mount_says() {
    let robot = go1();
    assert_eq!(robot.root(), "base_link");
    let lidar = robot.frame("velodyne").unwrap();
    assert!((lidar.translation.vector - nalgebra::Vector3::new(0.0, 0.0, 0.16)).norm() < 1e-12);
    assert!(lidar.rotation.angle() < 1e-12);
    let imu = robot.frame("imu_link").unwrap();
    assert!((imu.translation.vector - nalgebra::Vector3::new(-0.01592, -0.06659, -0.00617)).norm() < 1e-12);
    assert!(robot.frame("gps_link").is_some() && robot.frame("base_link").is_some());
    assert_eq!(robot.frame("no_such_link"), None);
    assert_eq!(robot.joints.iter().filter(|joint| joint.kind == JointKind::Revolute).count(), 12);
}

#[test]
fn every_inertia_of_the_go1_could_belong_to_a_body() {
    for link in go1().links.iter().filter(|link| link.mass_kg > 0.0) {
        let mut moments: Vec<f64> = link.inertia_kgm2.symmetric_eigenvalues().iter().copied().collect();
        moments.sort_by(f64::total_cmp);
        assert!(
            moments[0] > 0.0 && moments[0] + moments[1] >= moments[2] * (1.0 - 1e-9),
            "{}: {moments:?}",
            link.name
        );
    }
}

#[test]
fn a_tree_names_every_link_once() {
    let (robot, tree) = (go1(), go1().tree());
    for link in &robot.links {
        let lines =
            tree.lines().filter(|line| line.split([' ', '-', '|', '`']).any(|word| word == link.name));
        assert_eq!(lines.count(), 1, "{}\n{tree}", link.name);
    }
}

#[test]
fn a_real_quadrupeds_urdf_is_read_without_its_meshes() {
    let data = std::env::var_os("ARBORLOOP_DATA").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data")),
        PathBuf::from,
    );
    let path = data.join("robots/a1.urdf");
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("absent, not tried: {} (set ARBORLOOP_DATA)", path.display());
        return;
    };
    let robot = Robot::from_urdf(&text, "a1.urdf").unwrap();
    assert_eq!((robot.name.as_str(), robot.root()), ("a1", "base"));
    // The A1's foot: hip (0.1805, -0.047), offset 0.0838, thigh and calf 0.2 m each.
    let foot = robot.frame("FR_foot").unwrap().translation.vector;
    assert!((foot - nalgebra::Vector3::new(0.1805, -0.047 - 0.0838, -0.4)).norm() < 1e-6, "{foot}");
    assert!((10.0..15.0).contains(&robot.mass_kg()), "{} kg", robot.mass_kg());
}

#[test]
fn texts_that_are_no_robot_are_refused_with_their_file() {
    let link = r#"<link name="a"/>"#;
    let joint = |name: &str, parent: &str, child: &str| {
        format!(
            r#"<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>"#
        )
    };
    let robot = |inside: &str| format!(r#"<robot name="r">{inside}</robot>"#);
    let heavy = r#"<link name="a"><inertial><mass value="-1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>"#;
    let nan =
        r#"<joint name="j" type="fixed"><origin xyz="nan 0 0"/><parent link="a"/><child link="b"/></joint>"#;
    let b = r#"<link name="b"/>"#;
    let texts = [
        String::new(),
        "not xml".to_owned(),
        r#"<robot name="r"><link name="a">"#.to_owned(),
        "<robot/>".to_owned(),
        robot(""),
        robot("<link/>"),
        robot(&format!("{link}{link}")),
        robot(&format!("{link}{b}")),
        robot(&format!("{link}{}", joint("j", "a", "b"))),
        robot(&format!("{link}{b}{}{}", joint("j", "a", "b"), joint("j", "a", "b"))),
        robot(&format!("{link}{b}{}{}", joint("j", "a", "b"), joint("k", "a", "b"))),
        robot(&format!(r#"{link}{b}<link name="c"/>{}{}"#, joint("j", "b", "c"), joint("k", "c", "b"))),
        robot(heavy),
        robot(&format!("{link}{b}{nan}")),
        robot(&format!(
            r#"{link}{b}<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>"#
        )),
    ];
    for text in texts {
        let refused = Robot::from_urdf(&text, "broken.urdf").map(|robot| robot.tree());
        let message = refused.expect_err(&text).to_string();
        assert!(message.starts_with("broken.urdf: ") && message.contains("wanted"), "{message}");
    }
    let ring =
        robot(&format!(r#"{link}{b}<link name="c"/>{}{}"#, joint("j", "b", "c"), joint("k", "c", "b")));
    assert!(matches!(Robot::from_urdf(&ring, "r.urdf"), Err(RobotError::NoTree { .. })));
}
