//! What a robot is made of: links, joints, shapes, and where their frames are.

mod sensors;
mod shape;
mod tree;
mod urdf;

pub use sensors::SensorFrame;
pub use shape::{Form, Shape};

use arborloop_base::Pose;
use nalgebra::{Matrix3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use std::fmt::Write;

/// A robot's links and joints: one tree, its root first.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// Links in the file's order.
    pub links: Vec<Link>,
    /// Joints in the file's order.
    pub joints: Vec<Joint>,
    /// What could be read but not simulated as it stands, one sentence each.
    pub warnings: Vec<String>,
    root: String,
}

/// A rigid part.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Its name, which is also its frame's.
    pub name: String,
    /// Mass, kg; 0 for a bare frame.
    pub mass_kg: f64,
    /// Center of mass, link frame, meters.
    pub center_of_mass: Point3<f64>,
    /// Inertia about the center of mass, axes of the link frame, kg m2.
    pub inertia_kgm2: Matrix3<f64>,
    /// What it bumps into things with, or what it looks like where nothing else is said.
    pub shapes: Vec<Shape>,
    /// Line of the file on which it stands, from 1.
    pub line: u32,
}

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// Not at all.
    Fixed,
    /// Turns within limits.
    Revolute,
    /// Turns without end.
    Continuous,
    /// Slides within limits.
    Prismatic,
    /// Moves in more than one way; its frames are those at zero.
    Other,
}

/// How far, how hard and how fast a joint may move: radians, N m and rad/s, or meters, N and m/s for a prismatic one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Lowest position.
    pub low: f64,
    /// Highest position.
    pub high: f64,
    /// Greatest torque or force.
    pub effort: f64,
    /// Greatest speed.
    pub speed: f64,
}

/// What holds two links together.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// The link nearer the root.
    pub parent: String,
    /// The link farther from the root.
    pub child: String,
    /// The child's frame in the parent's when the joint is at zero.
    pub parent_from_child: Pose,
    /// Its axis, child frame.
    pub axis: Unit<Vector3<f64>>,
    /// Limits; `None` where the file gives none, and a continuous joint's positions have no end.
    pub limits: Option<JointLimits>,
    /// Dry friction, N m or N.
    pub friction: f64,
    /// Damping, N m s/rad or N s/m.
    pub damping: f64,
    /// Line of the file on which it stands, from 1.
    pub line: u32,
}

/// Why a text describes no robot: the place, what was found and what would do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}: {element}: found {found}; wanted {wanted}")]
pub struct RobotError {
    /// The file.
    pub file: String,
    /// The line, from 1.
    pub line: u32,
    /// The element, for instance `link "trunk"`.
    pub element: String,
    /// What was found there.
    pub found: String,
    /// What would do.
    pub wanted: String,
}

impl Robot {
    /// Reads a URDF text; meshes are neither needed nor opened. `source_name` is the file's name, for errors.
    ///
    /// # Errors
    /// What is no robot, with its line: broken XML, xacro that was not expanded, numbers that are none, links that form
    /// no single tree.
    pub fn from_urdf(text: &str, source_name: &str) -> Result<Robot, RobotError> {
        urdf::read(text, source_name)
    }

    /// The link that is no joint's child.
    pub fn root(&self) -> &str {
        &self.root
    }

    /// A link's frame in the root's with every joint at zero; `None` for an unknown link.
    pub fn frame(&self, link: &str) -> Option<Pose> {
        self.frame_at(link, &|_| 0.0)
    }

    /// A link's frame in the root's, with each moving joint where `position` puts it by name (radians, or meters for a
    /// prismatic joint); `None` for an unknown link.
    pub fn frame_at(&self, link: &str, position: &dyn Fn(&str) -> f64) -> Option<Pose> {
        self.links.iter().find(|one| one.name == link)?;
        let mut base_from_link = Pose::identity();
        let mut at = link;
        while let Some(joint) = self.joints.iter().find(|joint| joint.child == at) {
            base_from_link = joint.parent_from_child * joint.motion(position(&joint.name)) * base_from_link;
            at = &joint.parent;
        }
        Some(base_from_link)
    }

    /// Mass of all links, kg.
    pub fn mass_kg(&self) -> f64 {
        self.links.iter().map(|link| link.mass_kg).sum()
    }

    /// A drawing of the links as a tree, one line each: name, joint, place in the parent (m), mass (kg).
    pub fn tree(&self) -> String {
        let mut drawing =
            format!("{}: {} links, {:.3} kg\n{}\n", self.name, self.links.len(), self.mass_kg(), self.root);
        self.draw_below(&self.root, "", &mut drawing);
        drawing
    }

    fn draw_below(&self, parent: &str, indent: &str, drawing: &mut String) {
        let below: Vec<&Joint> = self.joints.iter().filter(|joint| joint.parent == parent).collect();
        for (index, joint) in below.iter().enumerate() {
            let (fork, rail) = if index + 1 == below.len() { ("`-- ", "    ") } else { ("|-- ", "|   ") };
            let place = joint.parent_from_child.translation;
            let mass_kg =
                self.links.iter().find(|link| link.name == joint.child).map_or(0.0, |link| link.mass_kg);
            let kind = format!("{:?}", joint.kind).to_lowercase();
            // Writing to a string cannot fail.
            let _ = write!(drawing, "{indent}{fork}{} [{kind}] at ", joint.child);
            let _ = write!(drawing, "({:.4}, {:.4}, {:.4}) m", place.x, place.y, place.z);
            if mass_kg > 0.0 {
                let _ = write!(drawing, ", {mass_kg:.3} kg");
            }
            drawing.push('\n');
            self.draw_below(&joint.child, &format!("{indent}{rail}"), drawing);
        }
    }
}

impl Joint {
    fn motion(&self, position: f64) -> Pose {
        match self.kind {
            JointKind::Revolute | JointKind::Continuous => {
                let turn = UnitQuaternion::from_axis_angle(&self.axis, position);
                Pose::from_parts(Translation3::identity(), turn)
            }
            JointKind::Prismatic => {
                Pose::from_parts((self.axis.into_inner() * position).into(), UnitQuaternion::identity())
            }
            JointKind::Fixed | JointKind::Other => Pose::identity(),
        }
    }
}
