//! Masses that move as one: a link with all that is fixed to it, and what a robot carries.

use crate::description::{JointKind, Link, Robot};
use arborloop_base::Pose;
use nalgebra::{Matrix3, Point3, Vector3};

/// A rigid body's mass properties in the frame that its holder names.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lump {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Center of mass, meters.
    pub center_of_mass: Point3<f64>,
    /// Inertia about the center of mass, axes of the frame, kg m2.
    pub inertia_kgm2: Matrix3<f64>,
}

impl Lump {
    /// Nothing at the origin.
    pub const NOTHING: Lump =
        Lump { mass_kg: 0.0, center_of_mass: Point3::new(0.0, 0.0, 0.0), inertia_kgm2: ZERO };

    /// A uniform box with its middle at a point, axes along the frame's; sides in meters.
    pub fn cuboid(mass_kg: f64, middle: Point3<f64>, sides_m: Vector3<f64>) -> Self {
        let squares = sides_m.component_mul(&sides_m);
        let diagonal = Vector3::new(squares.y + squares.z, squares.x + squares.z, squares.x + squares.y)
            * mass_kg
            / 12.0;
        Lump { mass_kg, center_of_mass: middle, inertia_kgm2: Matrix3::from_diagonal(&diagonal) }
    }

    /// A link and everything that hangs on it by fixed joints, in the link's frame; `None` for an unknown link.
    pub fn of(robot: &Robot, link: &str) -> Option<Self> {
        let mut sum = Lump::from(robot.links.iter().find(|one| one.name == link)?);
        let fixed =
            robot.joints.iter().filter(|joint| joint.kind == JointKind::Fixed && joint.parent == link);
        for joint in fixed {
            sum = sum.plus(&Lump::of(robot, &joint.child)?.seen_from(&joint.parent_from_child));
        }
        Some(sum)
    }

    /// Both as one body; they share a frame.
    pub fn plus(&self, other: &Lump) -> Lump {
        let mass_kg = self.mass_kg + other.mass_kg;
        if mass_kg <= 0.0 {
            return Lump { mass_kg, inertia_kgm2: self.inertia_kgm2 + other.inertia_kgm2, ..*self };
        }
        let share = other.mass_kg / mass_kg;
        let center = self.center_of_mass + (other.center_of_mass - self.center_of_mass) * share;
        let inertia_kgm2 = self.inertia_about(&center) + other.inertia_about(&center);
        Lump { mass_kg, center_of_mass: center, inertia_kgm2 }
    }

    /// The same body in another frame.
    pub fn seen_from(&self, to_from_from: &Pose) -> Lump {
        let turn = to_from_from.rotation.to_rotation_matrix();
        Lump {
            mass_kg: self.mass_kg,
            center_of_mass: to_from_from * self.center_of_mass,
            inertia_kgm2: turn.matrix() * self.inertia_kgm2 * turn.matrix().transpose(),
        }
    }

    /// Inertia about another point of the frame, kg m2 (Steiner).
    pub fn inertia_about(&self, point: &Point3<f64>) -> Matrix3<f64> {
        let arm = self.center_of_mass - point;
        self.inertia_kgm2 + (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * self.mass_kg
    }
}

const ZERO: Matrix3<f64> = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);

impl From<&Link> for Lump {
    fn from(link: &Link) -> Self {
        Lump { mass_kg: link.mass_kg, center_of_mass: link.center_of_mass, inertia_kgm2: link.inertia_kgm2 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::go1::go1;

    #[test]
    fn two_halves_of_a_box_weigh_and_turn_as_the_whole() {
        let half = |x| Lump::cuboid(1.5, Point3::new(x, 0.2, 0.0), Vector3::new(0.5, 0.3, 0.2));
        let whole = Lump::cuboid(3.0, Point3::new(0.0, 0.2, 0.0), Vector3::new(1.0, 0.3, 0.2));
        let sum = half(-0.25).plus(&half(0.25));
        assert!((sum.mass_kg - 3.0).abs() < 1e-12);
        assert!((sum.center_of_mass - whole.center_of_mass).norm() < 1e-12);
        assert!((sum.inertia_kgm2 - whole.inertia_kgm2).norm() < 1e-12);
    }

    #[test]
    fn the_lumps_between_the_joints_are_the_whole_robot() {
        let robot = go1();
        let moved = robot.joints.iter().filter(|joint| joint.kind == JointKind::Revolute);
        let masses = moved.map(|joint| Lump::of(&robot, &joint.child).unwrap().mass_kg).sum::<f64>();
        let trunk = Lump::of(&robot, robot.root()).unwrap();
        assert!((masses + trunk.mass_kg - robot.mass_kg()).abs() < 1e-12);
        assert!((trunk.mass_kg - 5.204).abs() < 1e-12);
        let calf = Lump::of(&robot, "FR_calf").unwrap();
        assert!((calf.mass_kg - 0.191).abs() < 1e-12);
        assert_eq!(Lump::of(&robot, "nowhere"), None);
    }
}
