//! What a robot is made of, read from URDF. This file alone names the URDF crate.

use arborloop_base::Pose;
use nalgebra::{Matrix3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
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
    /// Limits; `None` for fixed and continuous joints.
    pub limits: Option<JointLimits>,
}

/// Why a text describes no robot.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RobotError {
    /// It is no URDF.
    #[error("{file}: not a URDF robot: {found}; wanted <robot> with named links and joints")]
    Syntax {
        /// The file.
        file: String,
        /// What the reader met.
        found: String,
    },
    /// Two elements share a name.
    #[error("{file}: {element} appears twice, wanted one of each name")]
    Twice {
        /// The file.
        file: String,
        /// The element, for instance `link "trunk"`.
        element: String,
    },
    /// A joint names a link that is not there.
    #[error("{file}: joint \"{joint}\" names link \"{link}\", wanted one of the file's links")]
    UnknownLink {
        /// The file.
        file: String,
        /// The joint.
        joint: String,
        /// The link it names.
        link: String,
    },
    /// The links form no single tree.
    #[error("{file}: {found}, wanted one tree of links with one root")]
    NoTree {
        /// The file.
        file: String,
        /// What is wrong.
        found: String,
    },
    /// A number is out of its range.
    #[error("{file}: {element} has {found}, wanted {wanted}")]
    Number {
        /// The file.
        file: String,
        /// The element.
        element: String,
        /// The number found.
        found: String,
        /// What would do.
        wanted: &'static str,
    },
}

impl Robot {
    /// Reads a URDF text; meshes are neither needed nor opened. `source_name` is the file's name, for errors.
    pub fn from_urdf(text: &str, source_name: &str) -> Result<Robot, RobotError> {
        let file = || source_name.to_owned();
        let read = urdf_rs::read_from_string(text)
            .map_err(|error| RobotError::Syntax { file: file(), found: error.to_string() })?;
        let links = read.links.iter().map(|one| link(one, source_name)).collect::<Result<Vec<_>, _>>()?;
        let joints = read.joints.iter().map(|one| joint(one, source_name)).collect::<Result<Vec<_>, _>>()?;
        let root = root_of_tree(&links, &joints, source_name)?;
        Ok(Robot { name: read.name, links, joints, root })
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

fn link(read: &urdf_rs::Link, file: &str) -> Result<Link, RobotError> {
    let inertial = &read.inertial;
    let refuse = |found: String, wanted| RobotError::Number {
        file: file.to_owned(),
        element: format!("link \"{}\"", read.name),
        found,
        wanted,
    };
    let mass_kg = inertial.mass.value;
    if !(mass_kg.is_finite() && mass_kg >= 0.0) {
        return Err(refuse(format!("mass {mass_kg}"), "a mass of zero or more kg"));
    }
    let inertia = &inertial.inertia;
    let (xy, xz, yz) = (inertia.ixy, inertia.ixz, inertia.iyz);
    let written = Matrix3::new(inertia.ixx, xy, xz, xy, inertia.iyy, yz, xz, yz, inertia.izz);
    if !written.iter().all(|n| n.is_finite()) {
        return Err(refuse("an inertia that is not finite".to_owned(), "six finite numbers"));
    }
    let link_from_inertial = pose(&inertial.origin)
        .ok_or_else(|| refuse("an inertial origin that is not finite".to_owned(), "finite xyz and rpy"))?;
    let turn = link_from_inertial.rotation.to_rotation_matrix();
    Ok(Link {
        name: read.name.clone(),
        mass_kg,
        center_of_mass: link_from_inertial.translation.vector.into(),
        inertia_kgm2: turn.matrix() * written * turn.matrix().transpose(),
    })
}

fn joint(read: &urdf_rs::Joint, file: &str) -> Result<Joint, RobotError> {
    let refuse = |found: String, wanted| RobotError::Number {
        file: file.to_owned(),
        element: format!("joint \"{}\"", read.name),
        found,
        wanted,
    };
    let kind = match read.joint_type {
        urdf_rs::JointType::Fixed => JointKind::Fixed,
        urdf_rs::JointType::Revolute => JointKind::Revolute,
        urdf_rs::JointType::Continuous => JointKind::Continuous,
        urdf_rs::JointType::Prismatic => JointKind::Prismatic,
        _ => JointKind::Other,
    };
    let axis = Vector3::from(read.axis.xyz.0);
    let axis =
        Unit::try_new(axis, 1e-9).filter(|unit| unit.iter().all(|n| n.is_finite())).ok_or_else(|| {
            refuse(format!("axis {:?}", read.axis.xyz.0), "three finite numbers that are not all zero")
        })?;
    let limit = &read.limit;
    let limited = matches!(kind, JointKind::Revolute | JointKind::Prismatic);
    // A NaN has no order and is refused.
    let ordered = limit.lower.partial_cmp(&limit.upper).is_some_and(std::cmp::Ordering::is_le);
    if limited && !ordered {
        return Err(refuse(format!("limits {} to {}", limit.lower, limit.upper), "lower at most upper"));
    }
    Ok(Joint {
        name: read.name.clone(),
        kind,
        parent: read.parent.link.clone(),
        child: read.child.link.clone(),
        parent_from_child: pose(&read.origin)
            .ok_or_else(|| refuse("an origin that is not finite".to_owned(), "finite xyz and rpy"))?,
        axis,
        limits: limited.then_some(JointLimits {
            low: limit.lower,
            high: limit.upper,
            effort: limit.effort,
            speed: limit.velocity,
        }),
    })
}

fn pose(read: &urdf_rs::Pose) -> Option<Pose> {
    let ([x, y, z], [roll, pitch, yaw]) = (read.xyz.0, read.rpy.0);
    let finite = [x, y, z, roll, pitch, yaw].iter().all(|n| n.is_finite());
    let turn = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    finite.then(|| Pose::from_parts(Translation3::new(x, y, z), turn))
}

/// The root, if the joints hang every link below it exactly once.
fn root_of_tree(links: &[Link], joints: &[Joint], file: &str) -> Result<String, RobotError> {
    let no_tree = |found: String| RobotError::NoTree { file: file.to_owned(), found };
    let twice = |element: String| RobotError::Twice { file: file.to_owned(), element };
    let mut joint_above: BTreeMap<&str, Option<&Joint>> = BTreeMap::new();
    for link in links {
        if joint_above.insert(&link.name, None).is_some() {
            return Err(twice(format!("link \"{}\"", link.name)));
        }
    }
    let mut joint_names: BTreeMap<&str, ()> = BTreeMap::new();
    for joint in joints {
        if joint_names.insert(&joint.name, ()).is_some() {
            return Err(twice(format!("joint \"{}\"", joint.name)));
        }
        let unknown = |link: &str| RobotError::UnknownLink {
            file: file.to_owned(),
            joint: joint.name.clone(),
            link: link.to_owned(),
        };
        if !joint_above.contains_key(joint.parent.as_str()) {
            return Err(unknown(&joint.parent));
        }
        let above = joint_above.get_mut(joint.child.as_str()).ok_or_else(|| unknown(&joint.child))?;
        if let Some(other) = above.replace(joint) {
            let found =
                format!("link \"{}\" hangs on joints \"{}\" and \"{}\"", joint.child, other.name, joint.name);
            return Err(no_tree(found));
        }
    }
    let roots: Vec<&str> =
        joint_above.iter().filter(|(_, above)| above.is_none()).map(|(name, _)| *name).collect();
    let [root] = roots.as_slice() else {
        return Err(no_tree(format!("{} links hang on no joint ({})", roots.len(), roots.join(", "))));
    };
    // With one parent each and one root, a link that does not reach the root hangs in a ring.
    for link in links {
        let mut at = link.name.as_str();
        for _ in 0..links.len() {
            match joint_above.get(at).copied().flatten() {
                Some(joint) => at = &joint.parent,
                None => break,
            }
        }
        if at != *root {
            return Err(no_tree(format!("link \"{}\" hangs in a ring of joints", link.name)));
        }
    }
    Ok((*root).to_owned())
}
