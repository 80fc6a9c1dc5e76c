//! URDF texts: what is read, and how a text that is none is refused. This file alone names the XML crate.

use super::tree::root_of_tree;
use super::{Form, Joint, JointKind, JointLimits, Link, Robot, RobotError, Shape};
use crate::lump::Lump;
use arborloop_base::Pose;
use nalgebra::{Matrix3, Translation3, Unit, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};

/// Joint types of the URDF specification.
const KINDS: [(&str, JointKind); 6] = [
    ("fixed", JointKind::Fixed),
    ("revolute", JointKind::Revolute),
    ("continuous", JointKind::Continuous),
    ("prismatic", JointKind::Prismatic),
    ("floating", JointKind::Other),
    ("planar", JointKind::Other),
];

pub(super) fn read(text: &str, file: &str) -> Result<Robot, RobotError> {
    let text = text.trim_start_matches('\u{feff}');
    let document = Document::parse(text).map_err(|error| broken(&error, text, file))?;
    let place = Place { document: &document, file };
    let top = document.root_element();
    refuse_xacro(&place, &document)?;
    if top.tag_name().name() != "robot" {
        return Err(place.refuse(
            top,
            "the root",
            format!("<{}>", top.tag_name().name()),
            "<robot name=...>",
        ));
    }
    let name = place.name(top)?.to_owned();
    let named = |tag: &'static str| top.children().filter(move |node| node.has_tag_name(tag));
    let mut warnings = Vec::new();
    let links = named("link").map(|node| link(&place, node, &mut warnings)).collect::<Result<Vec<_>, _>>()?;
    let joints = named("joint").map(|node| joint(&place, node)).collect::<Result<Vec<_>, _>>()?;
    let root = root_of_tree(&links, &joints, file)?;
    let mut robot = Robot { name, links, joints, warnings, root };
    weigh(&mut robot);
    Ok(robot)
}

/// Notes of links that move but weigh nothing.
fn weigh(robot: &mut Robot) {
    let moved = robot.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
    let weightless =
        moved.filter(|joint| Lump::of(robot, &joint.child).is_some_and(|lump| lump.mass_kg <= 0.0));
    let notes: Vec<String> = weightless
        .map(|joint| {
            format!(
                "line {}: joint \"{}\" moves link \"{}\", which weighs nothing with all that is fixed to it: it can be \
                 shown, not simulated",
                joint.line, joint.name, joint.child
            )
        })
        .collect();
    robot.warnings.extend(notes);
}

/// Where the reader is.
struct Place<'a> {
    document: &'a Document<'a>,
    file: &'a str,
}

impl Place<'_> {
    fn line(&self, node: Node<'_, '_>) -> u32 {
        self.document.text_pos_at(node.range().start).row
    }

    fn refuse(&self, node: Node<'_, '_>, element: &str, found: String, wanted: &str) -> RobotError {
        RobotError {
            file: self.file.to_owned(),
            line: self.line(node),
            element: element.to_owned(),
            found,
            wanted: wanted.to_owned(),
        }
    }

    fn name<'n>(&self, node: Node<'n, '_>) -> Result<&'n str, RobotError> {
        let tag = node.tag_name().name();
        let name = node.attribute("name").filter(|name| !name.trim().is_empty());
        name.ok_or_else(|| self.refuse(node, tag, "no name".into(), "name=\"...\""))
    }

    fn attribute<'n>(&self, node: Node<'n, '_>, of: &str, key: &str) -> Result<&'n str, RobotError> {
        let tag = node.tag_name().name();
        node.attribute(key).ok_or_else(|| {
            self.refuse(node, of, format!("<{tag}> without {key}"), &format!("<{tag} {key}=\"...\"/>"))
        })
    }

    /// One finite number.
    fn number(&self, node: Node<'_, '_>, of: &str, key: &str) -> Result<f64, RobotError> {
        self.numbers::<1>(node, of, key).map(|[number]| number)
    }

    /// One finite number, or what stands for it where the file says nothing.
    fn number_or(
        &self,
        node: Option<Node<'_, '_>>,
        of: &str,
        key: &str,
        absent: f64,
    ) -> Result<f64, RobotError> {
        match node.filter(|node| node.has_attribute(key)) {
            Some(node) => self.number(node, of, key),
            None => Ok(absent),
        }
    }

    /// As many finite numbers as wanted.
    fn numbers<const N: usize>(
        &self,
        node: Node<'_, '_>,
        of: &str,
        key: &str,
    ) -> Result<[f64; N], RobotError> {
        let said = self.attribute(node, of, key)?;
        let read: Vec<f64> = said.split_whitespace().map_while(|word| word.parse().ok()).collect();
        let whole = said.split_whitespace().count() == N && read.iter().all(|number| number.is_finite());
        read.try_into().ok().filter(|_| whole).ok_or_else(|| {
            let wanted = if N == 1 { "a finite number".to_owned() } else { format!("{N} finite numbers") };
            self.refuse(node, of, format!("{key}=\"{said}\""), &wanted)
        })
    }

    /// The pose of an `<origin>` below a node; no origin is no shift.
    fn origin(&self, node: Node<'_, '_>, of: &str) -> Result<Pose, RobotError> {
        let Some(origin) = child(node, "origin") else { return Ok(Pose::identity()) };
        let part = |key: &str| match origin.attribute(key) {
            Some(_) => self.numbers::<3>(origin, of, key),
            None => Ok([0.0; 3]),
        };
        let ([x, y, z], [roll, pitch, yaw]) = (part("xyz")?, part("rpy")?);
        let turn = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        Ok(Pose::from_parts(Translation3::new(x, y, z), turn))
    }
}

fn child<'a, 'n>(node: Node<'a, 'n>, tag: &str) -> Option<Node<'a, 'n>> {
    node.children().find(|one| one.has_tag_name(tag))
}

fn broken(error: &roxmltree::Error, text: &str, file: &str) -> RobotError {
    let xacro = text.contains("xacro:");
    RobotError {
        file: file.to_owned(),
        line: error.pos().row,
        element: "XML".to_owned(),
        found: error.to_string(),
        wanted: if xacro { EXPANDED } else { "a URDF: <robot> with named links and joints" }.to_owned(),
    }
}

const EXPANDED: &str = "a URDF without xacro: `xacro robot.urdf.xacro > robot.urdf` writes one";

/// What simulators and controllers keep in a description: nothing of it is read, so nothing of it is refused.
const FOREIGN: [&str; 3] = ["gazebo", "transmission", "ros2_control"];

fn refuse_xacro(place: &Place<'_>, document: &Document<'_>) -> Result<(), RobotError> {
    let foreign = |node: &Node<'_, '_>| {
        node.ancestors().any(|above| FOREIGN.iter().any(|tag| above.has_tag_name(*tag)))
    };
    for node in document.descendants().filter(Node::is_element).filter(|node| !foreign(node)) {
        let tag = node.tag_name();
        if tag.namespace().is_some_and(|space| space.contains("xacro")) {
            let found = format!("<xacro:{}>", tag.name());
            return Err(place.refuse(node, "robot", found, EXPANDED));
        }
        let left = node.attributes().find(|one| one.value().contains("${") || one.value().contains("$("));
        if let Some(left) = left {
            let found = format!("{}=\"{}\"", left.name(), left.value());
            return Err(place.refuse(node, tag.name(), found, EXPANDED));
        }
    }
    Ok(())
}

fn link(place: &Place<'_>, node: Node<'_, '_>, warnings: &mut Vec<String>) -> Result<Link, RobotError> {
    let name = place.name(node)?.to_owned();
    let of = format!("link \"{name}\"");
    let line = place.line(node);
    let mut link = Link {
        mass_kg: 0.0,
        center_of_mass: nalgebra::Point3::origin(),
        inertia_kgm2: Matrix3::zeros(),
        shapes: Vec::new(),
        line,
        name,
    };
    if let Some(inertial) = child(node, "inertial") {
        let inside = |tag: &str| {
            child(inertial, tag).ok_or_else(|| {
                place.refuse(inertial, &of, format!("<inertial> without <{tag}>"), "<mass> and <inertia>")
            })
        };
        link.mass_kg = place.number(inside("mass")?, &of, "value")?;
        if link.mass_kg < 0.0 {
            let found = format!("a mass of {} kg", link.mass_kg);
            return Err(place.refuse(inertial, &of, found, "zero or more"));
        }
        let inertia = inside("inertia")?;
        let moment = |key: &str| place.number_or(Some(inertia), &of, key, 0.0);
        let (xy, xz, yz) = (moment("ixy")?, moment("ixz")?, moment("iyz")?);
        let written = Matrix3::new(moment("ixx")?, xy, xz, xy, moment("iyy")?, yz, xz, yz, moment("izz")?);
        let link_from_inertial = place.origin(inertial, &of)?;
        let turn = link_from_inertial.rotation.to_rotation_matrix();
        link.center_of_mass = link_from_inertial.translation.vector.into();
        link.inertia_kgm2 = turn.matrix() * written * turn.matrix().transpose();
        if link.mass_kg > 0.0 && link.inertial_box().is_none() {
            let note = format!("line {line}: {of} has an inertia that no body has: check its axes and units");
            warnings.push(note);
        }
    }
    for tag in ["collision", "visual"] {
        if link.shapes.is_empty() {
            let drawn = node.children().filter(|one| one.has_tag_name(tag));
            link.shapes = drawn.map(|one| shape(place, one, &of)).collect::<Result<_, _>>()?;
        }
    }
    Ok(link)
}

fn shape(place: &Place<'_>, node: Node<'_, '_>, of: &str) -> Result<Shape, RobotError> {
    let wanted = "<geometry> with a box, a cylinder, a sphere or a mesh";
    let form = child(node, "geometry").and_then(|geometry| geometry.children().find(Node::is_element));
    let form = form
        .ok_or_else(|| place.refuse(node, of, format!("<{}> of no form", node.tag_name().name()), wanted))?;
    let link_from_shape = place.origin(node, of)?;
    let positive = |value: f64, key: &str| {
        if value > 0.0 {
            return Ok(value);
        }
        Err(place.refuse(form, of, format!("{key} of {value}"), "a length above zero"))
    };
    let length = |key: &str| positive(place.number(form, of, key)?, key);
    let form = match form.tag_name().name() {
        "box" => {
            let [x, y, z] = place.numbers::<3>(form, of, "size")?;
            [x, y, z].into_iter().try_for_each(|side| positive(side, "size").map(drop))?;
            Form::Box { size_m: Vector3::new(x, y, z) }
        }
        "cylinder" => Form::Cylinder { radius_m: length("radius")?, length_m: length("length")? },
        "sphere" => Form::Sphere { radius_m: length("radius")? },
        "mesh" => Form::Mesh { file: place.attribute(form, of, "filename")?.to_owned() },
        other => return Err(place.refuse(form, of, format!("<{other}>"), wanted)),
    };
    Ok(Shape { form, link_from_shape })
}

fn joint(place: &Place<'_>, node: Node<'_, '_>) -> Result<Joint, RobotError> {
    let name = place.name(node)?.to_owned();
    let of = format!("joint \"{name}\"");
    let said = place.attribute(node, &of, "type")?;
    let kind = KINDS.iter().find(|(known, _)| *known == said).map(|(_, kind)| *kind).ok_or_else(|| {
        let known: Vec<&str> = KINDS.iter().map(|(name, _)| *name).collect();
        place.refuse(node, &of, format!("type \"{said}\""), &format!("one of {}", known.join(", ")))
    })?;
    let end = |tag: &str| {
        let found = child(node, tag).and_then(|one| one.attribute("link"));
        found
            .map(str::to_owned)
            .ok_or_else(|| place.refuse(node, &of, format!("no <{tag} link=...>"), "a parent and a child"))
    };
    // Exporters write an axis of zeros where a joint has none to turn about.
    let turns = !matches!(kind, JointKind::Fixed | JointKind::Other);
    let axis = match child(node, "axis").filter(|_| turns) {
        Some(axis) => Vector3::from(place.numbers::<3>(axis, &of, "xyz")?),
        None => Vector3::x(),
    };
    let axis = Unit::try_new(axis, 1e-9).ok_or_else(|| {
        place.refuse(node, &of, "an axis of no length".into(), "three numbers, not all zero")
    })?;
    let dynamics = child(node, "dynamics");
    Ok(Joint {
        kind,
        parent: end("parent")?,
        child: end("child")?,
        parent_from_child: place.origin(node, &of)?,
        axis,
        limits: limits(place, node, &of, kind)?,
        friction: place.number_or(dynamics, &of, "friction", 0.0)?,
        damping: place.number_or(dynamics, &of, "damping", 0.0)?,
        line: place.line(node),
        name,
    })
}

fn limits(
    place: &Place<'_>,
    node: Node<'_, '_>,
    of: &str,
    kind: JointKind,
) -> Result<Option<JointLimits>, RobotError> {
    let ends = matches!(kind, JointKind::Revolute | JointKind::Prismatic);
    let limit = child(node, "limit");
    let Some(limit) = limit.filter(|_| ends || kind == JointKind::Continuous) else {
        return match ends {
            true => {
                Err(place.refuse(node, of, "no <limit>".into(), "<limit lower, upper, effort, velocity>"))
            }
            false => Ok(None),
        };
    };
    let number = |key: &str, absent: f64| place.number_or(Some(limit), of, key, absent);
    let (low, high) = match ends {
        true => (number("lower", 0.0)?, number("upper", 0.0)?),
        false => (f64::NEG_INFINITY, f64::INFINITY),
    };
    if low > high {
        return Err(place.refuse(limit, of, format!("limits {low} to {high}"), "lower at most upper"));
    }
    Ok(Some(JointLimits { low, high, effort: number("effort", 0.0)?, speed: number("velocity", 0.0)? }))
}
