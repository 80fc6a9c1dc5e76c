//! URDF files read and refused.

use arborloop_robots::{Body, Form, JointKind, Robot, SensorFrame, Wheeled, go1, wheels};
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

const ORIGIN_OF_NAN: &str =
    r#"<joint name="j" type="fixed"><origin xyz="nan 0 0"/><parent link="a"/><child link="b"/></joint>"#;
const NO_AXIS: &str = r#"<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 0"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>"#;

fn fixed(name: &str, parent: &str, child: &str) -> String {
    format!(r#"<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>"#)
}

fn weighing(mass: &str) -> String {
    format!(
        r#"<link name="a"><inertial><mass value="{mass}"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>"#
    )
}

#[test]
fn texts_that_are_no_robot_are_refused_with_their_file_line_and_element() {
    let two = r#"<link name="a"/><link name="b"/>"#;
    let three = format!(r#"{two}<link name="c"/>"#);
    let kind = |kind: &str| fixed("j", "a", "b").replace("fixed", kind);
    for (inside, says) in [
        ("<link/>".to_owned(), "link: found no name"),
        (r#"<link name="a"/><link name="a"/>"#.to_owned(), "link \"a\": found a second link"),
        (two.to_owned(), "2 links that hang on no joint (a, b)"),
        (fixed("j", "a", "b"), "the parent \"a\", which is no link"),
        (format!("{two}{}{}", fixed("j", "a", "b"), fixed("j", "a", "b")), "a second joint of this name"),
        (
            format!("{two}{}{}", fixed("j", "a", "b"), fixed("k", "a", "b")),
            "which hangs on joint \"j\" already",
        ),
        (format!("{three}{}{}", fixed("j", "b", "c"), fixed("k", "c", "b")), "a ring of joints above it"),
        (format!("{two}{}{}", fixed("j", "a", "b"), fixed("k", "b", "a")), "every link on a joint"),
        (weighing("-1"), "link \"a\": found a mass of -1 kg"),
        (weighing("NaN"), "link \"a\": found value=\"NaN\"; wanted a finite number"),
        (weighing("1e999"), "value=\"1e999\""),
        (weighing("${m}"), "mass: found value=\"${m}\"; wanted a URDF without xacro"),
        (r#"<xacro:macro name="x"/>"#.to_owned(), "wanted a URDF without xacro"),
        (format!("{two}{ORIGIN_OF_NAN}"), "xyz=\"nan 0 0\"; wanted 3 finite numbers"),
        (format!("{two}{NO_AXIS}"), "joint \"j\": found an axis of no length"),
        (format!("{two}{}", kind("ball")), "type \"ball\"; wanted one of fixed, revolute"),
        (format!("{two}{}", kind("revolute")), "joint \"j\": found no <limit>"),
        (
            r#"<link name="a"><collision><geometry><box size="1 -1 1"/></geometry></collision></link>"#
                .to_owned(),
            "size of -1",
        ),
        (
            r#"<link name="a"><visual><geometry><donut/></geometry></visual></link>"#.to_owned(),
            "found <donut>",
        ),
        (r#"<link name="a"><inertial><mass value="1"/></inertial></link>"#.to_owned(), "without <inertia>"),
    ] {
        // The element stands on the third line or below.
        let text = format!("<robot name=\"r\">\n\n{inside}</robot>");
        let message = Robot::from_urdf(&text, "broken.urdf").unwrap_err().to_string();
        assert!(message.starts_with("broken.urdf:") && message.contains(says), "{message}\nwanted: {says}");
        let line: u32 = message.split(':').nth(1).unwrap().parse().unwrap();
        assert!(line >= 3 || message.contains("ring") || message.contains("every link"), "{message}");
    }
    for text in
        ["", "not xml", r#"<robot name="r"><link name="a">"#, "<robot/>", r#"<robot name="r"/>"#, "<sdf/>"]
    {
        let message = Robot::from_urdf(text, "broken.urdf").unwrap_err().to_string();
        assert!(message.starts_with("broken.urdf:1: ") && message.contains("wanted"), "{text}: {message}");
    }
}

#[test]
fn what_moves_without_mass_and_inertias_of_no_body_are_told_and_drawn_all_the_same() {
    let text = r#"<robot name="r"><link name="a"/>
        <link name="b"/>
        <link name="c"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="9"/></inertial></link>
        <joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>
        <joint name="k" type="continuous"><parent link="a"/><child link="c"/></joint></robot>"#;
    let robot = Robot::from_urdf(text, "light.urdf").unwrap();
    let [inertia, weightless] = robot.warnings.as_slice() else { panic!("{:?}", robot.warnings) };
    assert!(inertia.contains("line 3: link \"c\"") && inertia.contains("no body has"), "{inertia}");
    assert!(
        weightless.contains("line 4: joint \"j\"") && weightless.contains("weighs nothing"),
        "{weightless}"
    );
}

#[test]
fn a_mesh_that_is_not_found_is_stood_for_by_a_box_of_the_same_mass_and_inertia() {
    let link = |name: &str, inertial: &str| {
        format!(
            r#"<link name="{name}">{inertial}<visual><geometry><mesh filename="package://p/{name}.stl"/></geometry></visual></link>"#
        )
    };
    let heavy = r#"<inertial><mass value="2"/><inertia ixx="0.02" iyy="0.03" izz="0.04"/></inertial>"#;
    let text = format!(
        r#"<robot name="r">{}{}{}{}{}</robot>"#,
        link("a", heavy),
        link("b", heavy),
        link("c", ""),
        fixed("j", "a", "b"),
        fixed("k", "a", "c")
    );
    let mut robot = Robot::from_urdf(&text, "mesh.urdf").unwrap();
    let notes = robot.box_meshes(&|file| file == "package://p/a.stl");
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].contains("link \"b\"") && notes[0].contains("package://p/b.stl"), "{}", notes[0]);
    assert!(notes[1].contains("link \"c\"") && notes[1].contains("touches nothing"), "{}", notes[1]);
    assert!(matches!(robot.links[0].shapes[0].form, Form::Mesh { .. }));
    assert!(matches!(robot.links[1].shapes[0].form, Form::Box { .. }));
    assert!(robot.links[2].shapes.is_empty());
}

#[test]
fn the_robots_that_come_with_the_program_have_what_moves_them_and_every_sensor_frame() {
    for robot in [go1(), wheels::jackal().robot, wheels::thorvald().robot] {
        assert_eq!(robot.warnings, Vec::<String>::new(), "{}", robot.name);
        for sensor in [SensorFrame::Lidar, SensorFrame::Imu, SensorFrame::Antenna] {
            assert!(robot.mount(sensor).is_some(), "{}: {sensor:?}", robot.name);
        }
        let (legs, rolls) = (Body::like_go1(&robot).is_ok(), Wheeled::new(robot.clone()).is_ok());
        assert!(legs != rolls && legs == (robot.name == "go1"), "{}", robot.name);
    }
    // jackal.urdf.xacro: 16.523 + 4 x 0.477 kg, and the lidar's 0.83 kg.
    assert!((wheels::jackal().mass_kg - 19.261).abs() < 1e-9);
    assert!(wheels::thorvald().steers() && !wheels::jackal().steers());
}

#[test]
fn a_body_on_three_wheels_or_with_an_arm_says_what_it_lacks() {
    let text = include_str!("../models/jackal.urdf");
    let three = text.replacen("type=\"continuous\"", "type=\"fixed\"", 1);
    let says = |text: &str| Wheeled::new(Robot::from_urdf(text, "w.urdf").unwrap()).unwrap_err().to_string();
    assert!(says(&three).contains("found 3 wheels; wanted four"), "{}", says(&three));
    let arm = text.replacen(
        "<joint name=\"gps_joint\" type=\"fixed\">",
        "<joint name=\"gps_joint\" type=\"continuous\">",
        1,
    );
    assert!(says(&arm).contains("joint \"gps_joint\""), "{}", says(&arm));
    let legs = Body::like_go1(&wheels::jackal().robot).unwrap_err().to_string();
    assert!(legs.contains("no revolute joint \"FR_hip_joint\""), "{legs}");
}
