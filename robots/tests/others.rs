//! Descriptions of robots that are none of ours, written as their makers write them.

use arborloop_robots::{Body, JointKind, Robot, SensorFrame, Wheeled};

fn read(text: &str, file: &str) -> Robot {
    Robot::from_urdf(text, file).unwrap_or_else(|error| panic!("{error}"))
}

fn kinds(robot: &Robot, kind: JointKind) -> usize {
    robot.joints.iter().filter(|joint| joint.kind == kind).count()
}

#[test]
fn a_spot_s_tree_is_read_with_what_its_simulator_left_in_it() {
    let mut robot = read(include_str!("urdf/spot_like.urdf"), "spot_like.urdf");
    assert_eq!((robot.root(), robot.warnings.len()), ("body", 0));
    assert_eq!((kinds(&robot, JointKind::Revolute), kinds(&robot, JointKind::Fixed)), (2, 2));
    assert!((robot.mass_kg() - 22.5).abs() < 1e-12);
    assert_eq!(robot.sensor_link(SensorFrame::Lidar), Some("velodyne"));
    let lidar = robot.mount(SensorFrame::Lidar).unwrap();
    assert!((lidar.translation.vector - nalgebra::Vector3::new(-0.2, 0.0, 0.2)).norm() < 1e-12);
    let notes = robot.box_meshes(&|_| false);
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].contains("package://spot_like/meshes/body_collision.stl"), "{}", notes[0]);
    let lacks = Body::like_go1(&robot).unwrap_err().to_string();
    assert!(lacks.contains("FR_hip_joint"), "{lacks}");
}

#[test]
fn an_anymal_s_tree_hangs_on_a_floating_joint_and_has_its_shells_masses_and_turned_frames() {
    let robot = read(include_str!("urdf/anymal_like.urdf"), "anymal_like.urdf");
    assert_eq!((robot.root(), robot.warnings.len()), ("world", 0), "{:?}", robot.warnings);
    assert_eq!((kinds(&robot, JointKind::Other), kinds(&robot, JointKind::Revolute)), (2, 1));
    assert!((robot.mass_kg() - 8.7).abs() < 1e-12);
    // A quarter turn about z swaps the inertia's x and y.
    let trunk = robot.links.iter().find(|link| link.name == "base_inertia").unwrap();
    assert!((trunk.inertia_kgm2[(0, 0)] - 0.14).abs() < 1e-5, "{}", trunk.inertia_kgm2);
    let imu = robot.mount(SensorFrame::Imu).unwrap();
    assert!((imu.rotation * nalgebra::Vector3::z() + nalgebra::Vector3::z()).norm() < 1e-6);
    let hip = robot.joints.iter().find(|joint| joint.name == "LF_HAA").unwrap();
    assert_eq!(hip.axis.into_inner(), nalgebra::Vector3::x(), "a joint without an axis turns about x");
    assert!(robot.tree().contains("LF_SLED"));
}

#[test]
fn a_husky_s_wheels_touch_by_their_cylinders_and_its_mass_is_where_its_own_link_has_it() {
    let mut robot = read(include_str!("urdf/husky_like.urdf"), "husky_like.urdf");
    assert_eq!((robot.root(), robot.warnings.len()), ("base_footprint", 0), "{:?}", robot.warnings);
    assert_eq!(kinds(&robot, JointKind::Continuous), 4);
    assert!((robot.mass_kg() - 56.4).abs() < 1e-9);
    // Meshes that are drawn only are not missed: the wheels and the base touch by other forms.
    let notes = robot.box_meshes(&|_| false);
    assert!(notes.len() == 1 && notes[0].contains("front_bumper_link"), "{notes:?}");
    let wheeled = Wheeled::new(robot).unwrap_or_else(|lacks| panic!("{lacks}"));
    assert!(!wheeled.steers());
    assert!((wheeled.track_m() - 0.5708).abs() < 1e-9 && (wheeled.wheelbase_m() - 0.512).abs() < 1e-9);
    assert!((wheeled.wheels[0].radius_m - 0.1651).abs() < 1e-12);
}

#[test]
fn what_is_left_of_xacro_is_still_refused_where_it_is_read() {
    let text =
        include_str!("urdf/spot_like.urdf").replace("mass value=\"1.5\"", "mass value=\"${hip_mass}\"");
    let message = Robot::from_urdf(&text, "spot_like.urdf").unwrap_err().to_string();
    assert!(message.contains("${hip_mass}") && message.contains("without xacro"), "{message}");
    let zero = text.replace("${hip_mass}", "1.5").replace("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 0 0\"/>");
    let message = Robot::from_urdf(&zero, "spot_like.urdf").unwrap_err().to_string();
    assert!(message.contains("joint \"fl_kn\": found an axis of no length"), "{message}");
}

#[test]
fn a_robot_that_weighs_nothing_or_more_than_numbers_reach_is_not_said_to_walk() {
    let weighing = |kg: &str| {
        let mut text = include_str!("../models/go1.urdf").to_owned();
        for (start, _) in include_str!("../models/go1.urdf").rmatch_indices("mass value=\"") {
            let from = start + "mass value=\"".len();
            let to = from + text[from..].find('"').unwrap();
            text.replace_range(from..to, kg);
        }
        Body::like_go1(&read(&text, "go1.urdf")).map_err(|lacks| lacks.to_string())
    };
    assert!(weighing("1.0").is_ok());
    assert!(weighing("0").unwrap_err().contains("weighs 0 kg, wanted more than nothing"));
    assert!(weighing("1e308").unwrap_err().contains("weighs inf kg"));
}
