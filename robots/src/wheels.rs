//! Bodies on wheels: which joints of a description roll and which steer, how they are driven, what they tell of the way.
//!
//! Four wheels, in the order FR, FL, RR, RL; either none of them steers (skid steering, as the Jackal) or all do (as the
//! Thorvald II).

mod drive;
mod models;
mod odometer;
mod servo;
mod settings;

pub use drive::{Drive, WheelTargets};
pub use models::{jackal, thorvald};
pub use odometer::twist_of_wheels;
pub use servo::Servo;
pub use settings::WheelSettings;

use crate::description::{Form, Joint, JointKind, Robot};
use crate::lump::Lump;
use arborloop_base::Pose;
use nalgebra::{Point3, Vector3};

/// A robot on four wheels.
#[derive(Debug, Clone, PartialEq)]
pub struct Wheeled {
    /// Its description.
    pub robot: Robot,
    /// FR, FL, RR, RL.
    pub wheels: [Wheel; 4],
    /// Mass of everything, kg.
    pub mass_kg: f64,
}

/// A wheel.
#[derive(Debug, Clone, PartialEq)]
pub struct Wheel {
    /// Joint about which it rolls.
    pub roll: Joint,
    /// Joint about which it steers.
    pub steer: Option<Joint>,
    /// Its middle in the base frame, joints at zero.
    pub center: Point3<f64>,
    /// Radius, meters.
    pub radius_m: f64,
    /// Width, meters.
    pub width_m: f64,
    /// Inertia about its axle, kg m2.
    pub inertia_kgm2: f64,
    /// Inertia about its steering axis of all that steers with it, kg m2; 0 without steering.
    pub steered_kgm2: f64,
}

/// Why a robot has no wheels to drive on.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("robot \"{robot}\": found {found}; wanted {wanted}")]
pub struct WheelsError {
    /// The robot's name.
    pub robot: String,
    /// What was found.
    pub found: String,
    /// What would do.
    pub wanted: &'static str,
}

/// An axis this near to one of the base's counts as along it.
const ALONG: f64 = 0.999;

impl Wheeled {
    /// Finds the wheels of a description.
    ///
    /// # Errors
    /// What the description lacks: four wheels, two in front and two behind on either side; nothing else that moves.
    pub fn new(robot: Robot) -> Result<Wheeled, WheelsError> {
        let refuse = |found: String, wanted| WheelsError { robot: robot.name.clone(), found, wanted };
        let rolling = robot.joints.iter().filter(|joint| joint.kind == JointKind::Continuous);
        let found: Vec<Wheel> = rolling.filter_map(|joint| wheel(&robot, joint)).collect();
        if found.len() != 4 {
            return Err(refuse(
                format!("{} wheels", found.len()),
                "four: continuous joints about the base's y axis whose links are cylinders of some mass",
            ));
        }
        let middle = found.iter().map(|wheel| wheel.center.coords).sum::<Vector3<f64>>() / 4.0;
        let corner = |ahead: f64, left: f64| {
            found.iter().find(|wheel| {
                let off = wheel.center.coords - middle;
                off.x * ahead > 0.0 && off.y * left > 0.0
            })
        };
        let corners = [corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, -1.0), corner(-1.0, 1.0)];
        let [Some(fr), Some(fl), Some(rr), Some(rl)] = corners.map(|one| one.cloned()) else {
            return Err(refuse("wheels that form no rectangle".into(), "one wheel at each corner"));
        };
        let wheels = [fr, fl, rr, rl];
        let steered = wheels.iter().filter(|wheel| wheel.steer.is_some()).count();
        if steered % 4 != 0 {
            return Err(refuse(format!("{steered} wheels that steer"), "none or all four"));
        }
        let ours = |joint: &Joint| {
            wheels.iter().any(|wheel| {
                wheel.roll.name == joint.name
                    || wheel.steer.as_ref().is_some_and(|steer| steer.name == joint.name)
            })
        };
        let mut others = robot.joints.iter().filter(|joint| joint.kind != JointKind::Fixed && !ours(joint));
        if let Some(other) = others.next() {
            let found = format!("joint \"{}\", which moves but neither rolls nor steers a wheel", other.name);
            return Err(refuse(found, "type=\"fixed\" for it"));
        }
        let mass_kg = robot.mass_kg();
        Ok(Wheeled { wheels, mass_kg, robot })
    }

    /// Whether the wheels steer.
    pub fn steers(&self) -> bool {
        self.wheels.iter().all(|wheel| wheel.steer.is_some())
    }

    /// Names of the joints whose angles a run records: the wheels', then their steering's.
    pub fn joint_names(&self) -> Vec<String> {
        let rolls = self.wheels.iter().map(|wheel| wheel.roll.name.clone());
        rolls
            .chain(
                self.wheels.iter().filter_map(|wheel| wheel.steer.as_ref()).map(|joint| joint.name.clone()),
            )
            .collect()
    }

    /// Distance between left and right wheels, meters.
    pub fn track_m(&self) -> f64 {
        let [fr, fl, rr, rl] = &self.wheels;
        (fl.center.y + rl.center.y - fr.center.y - rr.center.y) / 2.0
    }

    /// Distance between front and rear wheels, meters.
    pub fn wheelbase_m(&self) -> f64 {
        let [fr, fl, rr, rl] = &self.wheels;
        (fr.center.x + fl.center.x - rr.center.x - rl.center.x) / 2.0
    }

    /// Height of the base's origin above level ground under the wheels, meters.
    pub fn height_m(&self) -> f64 {
        self.wheels.iter().map(|wheel| wheel.radius_m - wheel.center.z).sum::<f64>() / 4.0
    }
}

fn wheel(robot: &Robot, roll: &Joint) -> Option<Wheel> {
    let link = robot.links.iter().find(|link| link.name == roll.child)?;
    let (radius_m, width_m) = link.shapes.iter().find_map(|shape| match shape.form {
        Form::Cylinder { radius_m, length_m } => Some((radius_m, length_m)),
        _ => None,
    })?;
    let base_from_wheel = robot.frame(&roll.child)?;
    if (base_from_wheel.rotation * roll.axis.into_inner()).y < ALONG {
        return None;
    }
    let lump = Lump::of(robot, &roll.child).filter(|lump| lump.mass_kg > 0.0)?;
    let steer =
        robot.joints.iter().find(|joint| joint.child == roll.parent && joint.kind != JointKind::Fixed);
    let steer = steer.filter(|joint| upright(robot, joint));
    let steered_kgm2 = steer.map_or(0.0, |joint| {
        let child_from_wheel: Pose = roll.parent_from_child;
        let leg = Lump::of(robot, &joint.child).unwrap_or(Lump::NOTHING);
        let both = leg.plus(&lump.seen_from(&child_from_wheel));
        both.inertia_about(&Point3::origin())[(2, 2)]
    });
    let axis = roll.axis.into_inner();
    Some(Wheel {
        center: Point3::from(base_from_wheel.translation.vector),
        inertia_kgm2: axis.dot(&(lump.inertia_kgm2 * axis)),
        steered_kgm2,
        steer: steer.cloned(),
        roll: roll.clone(),
        radius_m,
        width_m,
    })
}

fn upright(robot: &Robot, joint: &Joint) -> bool {
    let axis = |pose: Pose| pose.rotation * joint.axis.into_inner();
    robot.frame(&joint.child).is_some_and(|pose| axis(pose).z > ALONG)
}
