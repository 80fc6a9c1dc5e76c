//! `arborloop show robot`: a description's tree, masses, sensor frames, meshes, and what could move it.

use crate::failure::Failure;
use crate::load;
use arborloop_robots::{Body, Form, Robot, SensorFrame, Wheeled, go1, wheels};
use std::path::{Path, PathBuf};

/// Shows a file, or a robot that comes with the program. What is doubtful goes to standard error.
pub(crate) fn show(name: &str, meshes: &[(String, PathBuf)]) -> Result<(), Failure> {
    let path = Path::new(name);
    let mut robot = match name {
        _ if path.is_file() => read(path)?,
        "go1" => go1(),
        "jackal" => wheels::jackal().robot,
        "thorvald" => wheels::thorvald().robot,
        _ => read(path)?,
    };
    let beside = path.parent().unwrap_or(Path::new(""));
    let resolve = |file: &str| place(file, meshes, beside).filter(|found| found.is_file());
    println!("{}", robot.tree());
    sensors(&robot);
    for (link, file) in drawn(&robot) {
        if let Some(found) = resolve(&file) {
            println!("mesh       {link}: {}", found.display());
        }
    }
    let boxed = robot.box_meshes(&|file| resolve(file).is_some());
    moves(&robot);
    for note in robot.warnings.iter().chain(&boxed) {
        eprintln!("warning: {name}: {note}");
    }
    if !boxed.is_empty() {
        eprintln!("help: --mesh PACKAGE=FOLDER says where package://PACKAGE/ is");
    }
    Ok(())
}

fn read(path: &Path) -> Result<Robot, Failure> {
    let text = load::file(path)?;
    Ok(Robot::from_urdf(&text.text, &text.name)?)
}

/// Where a mesh would be: in its package's folder, or beside the description.
fn place(file: &str, meshes: &[(String, PathBuf)], beside: &Path) -> Option<PathBuf> {
    if let Some(inside) = file.strip_prefix("package://") {
        let (package, rest) = inside.split_once('/')?;
        let (_, folder) = meshes.iter().find(|(name, _)| name == package)?;
        return Some(folder.join(rest));
    }
    Some(match file.strip_prefix("file://") {
        Some(absolute) => PathBuf::from(absolute),
        None => beside.join(file),
    })
}

fn drawn(robot: &Robot) -> Vec<(String, String)> {
    let meshes = robot.links.iter().flat_map(|link| {
        link.shapes.iter().filter_map(|shape| match &shape.form {
            Form::Mesh { file } => Some((link.name.clone(), file.clone())),
            _ => None,
        })
    });
    meshes.collect()
}

fn sensors(robot: &Robot) {
    for (what, sensor) in
        [("lidar", SensorFrame::Lidar), ("imu", SensorFrame::Imu), ("antenna", SensorFrame::Antenna)]
    {
        let Some((link, mount)) = robot.sensor_link(sensor).zip(robot.mount(sensor)) else {
            println!("{what:10} no frame; looked for {}", sensor.names().join(", "));
            continue;
        };
        let at = mount.translation;
        let (roll, pitch, yaw) = mount.rotation.euler_angles();
        let turned = [roll, pitch, yaw]
            .map(|angle| format!("{:.1}", (angle.to_degrees() * 10.0).round() / 10.0 + 0.0))
            .join(", ");
        println!(
            "{what:10} {link} at ({:.4}, {:.4}, {:.4}) m, turned by ({turned}) degrees",
            at.x, at.y, at.z
        );
    }
}

/// What this program's gaits and drives make of the robot.
fn moves(robot: &Robot) {
    match Body::like_go1(robot) {
        Ok(body) => {
            println!("legs       named, hinged and limited as the Go1's; {:.2} kg", body.mass_kg)
        }
        Err(lacks) => println!("legs       none that the gait can move: {lacks}"),
    }
    match Wheeled::new(robot.clone()) {
        Ok(wheeled) => println!(
            "wheels     {}: track {:.3} m, wheelbase {:.3} m, radius {:.3} m; {:.2} kg",
            if wheeled.steers() { "four, driven and steered" } else { "four, skid steering" },
            wheeled.track_m(),
            wheeled.wheelbase_m(),
            wheeled.wheels[0].radius_m,
            wheeled.mass_kg
        ),
        Err(lacks) => println!("wheels     none that the drive can move: {lacks}"),
    }
}
