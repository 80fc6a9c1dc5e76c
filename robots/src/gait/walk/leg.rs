//! One leg as a chain of three turning links: where its foot is, how it moves, what it weighs. Base frame.

use super::error::BodyError;
use crate::description::{JointKind, Robot};
use crate::lump::Lump;
use arborloop_base::Pose;
use nalgebra::{Matrix3, Point3, Unit, UnitQuaternion, Vector3};

/// A leg of a robot.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Leg {
    links: [LegLink; 3],
    calf_from_foot: Point3<f64>,
}

#[derive(Debug, Clone, PartialEq)]
struct LegLink {
    parent_from_child: Pose,
    axis: Unit<Vector3<f64>>,
    lump: Lump,
    /// Inertia of the motor's rotor as the joint feels it, kg m2.
    rotor_kgm2: f64,
}

/// A leg at given joint angles.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LegState {
    /// Center of the foot, base frame.
    pub(crate) foot: Point3<f64>,
    /// Foot's velocity in the base per joint rate.
    pub(crate) jacobian: Matrix3<f64>,
    /// Calf's turn rate in the base per joint rate: the joints' axes.
    pub(crate) axes: Matrix3<f64>,
    /// Joint-space inertia with the rotors, kg m2.
    pub(crate) inertia: Matrix3<f64>,
    /// Row per joint: the moment of the leg's mass, kg m; times a field of gravity it is the joint's torque.
    pub(crate) moment: Matrix3<f64>,
}

impl Leg {
    /// From the three moving joints of a chain that ends in a foot.
    pub(crate) fn new(
        robot: &Robot,
        joints: [&str; 3],
        foot: &str,
        rotors_kgm2: [f64; 3],
    ) -> Result<Self, BodyError> {
        let mut links = Vec::with_capacity(3);
        for (name, rotor_kgm2) in joints.iter().zip(rotors_kgm2) {
            let joint = robot.joints.iter().find(|joint| joint.name == *name);
            let joint = joint
                .filter(|joint| joint.kind == JointKind::Revolute)
                .ok_or_else(|| BodyError::NoJoint { robot: robot.name.clone(), joint: (*name).to_owned() })?;
            let lump = Lump::of(robot, &joint.child).unwrap_or(Lump::NOTHING);
            let (parent_from_child, axis) = (joint.parent_from_child, joint.axis);
            links.push(LegLink { parent_from_child, axis, lump, rotor_kgm2 });
        }
        let missing =
            || BodyError::NoFoot { robot: robot.name.clone(), foot: foot.to_owned(), calf: joints[2].into() };
        let calf = robot.joints.iter().find(|joint| joint.name == joints[2]).ok_or_else(missing)?;
        let base_from_calf = robot.frame(&calf.child).ok_or_else(missing)?;
        let base_from_foot = robot.frame(foot).ok_or_else(missing)?;
        let calf_from_foot = base_from_calf.inverse() * base_from_foot;
        let links: [LegLink; 3] = links.try_into().map_err(|_| missing())?;
        Ok(Leg { links, calf_from_foot: calf_from_foot.translation.vector.into() })
    }

    /// The leg's links as one body at given angles, base frame.
    pub(crate) fn lump(&self, angles_rad: [f64; 3]) -> Lump {
        let mut base_from_link = Pose::identity();
        let mut sum = Lump::NOTHING;
        for (link, angle_rad) in self.links.iter().zip(angles_rad) {
            base_from_link = base_from_link
                * link.parent_from_child
                * UnitQuaternion::from_axis_angle(&link.axis, angle_rad);
            sum = sum.plus(&link.lump.seen_from(&base_from_link));
        }
        sum
    }

    /// Everything that a controller asks, at given angles (radians).
    pub(crate) fn at(&self, angles_rad: [f64; 3]) -> LegState {
        let mut base_from_link = Pose::identity();
        let mut axes = [Vector3::zeros(); 3];
        let mut anchors = [Vector3::zeros(); 3];
        let mut inertia = Matrix3::zeros();
        let mut moment = Matrix3::zeros();
        for (index, link) in self.links.iter().enumerate() {
            base_from_link *= link.parent_from_child;
            axes[index] = base_from_link.rotation * link.axis.into_inner();
            anchors[index] = base_from_link.translation.vector;
            base_from_link *= UnitQuaternion::from_axis_angle(&link.axis, angles_rad[index]);
            let center = base_from_link * link.lump.center_of_mass;
            let turn = base_from_link.rotation.to_rotation_matrix();
            let turned = turn.matrix() * link.lump.inertia_kgm2 * turn.matrix().transpose();
            let mut linear = [Vector3::zeros(); 3];
            for joint in 0..=index {
                linear[joint] = axes[joint].cross(&(center.coords - anchors[joint]));
                moment.set_row(joint, &(moment.row(joint) + (linear[joint] * link.lump.mass_kg).transpose()));
            }
            for row in 0..=index {
                let angular = turned * axes[row];
                for column in 0..=index {
                    inertia[(row, column)] +=
                        link.lump.mass_kg * linear[row].dot(&linear[column]) + angular.dot(&axes[column]);
                }
            }
            inertia[(index, index)] += link.rotor_kgm2;
        }
        let foot = base_from_link * self.calf_from_foot;
        let column = |joint: usize| axes[joint].cross(&(foot.coords - anchors[joint]));
        let jacobian = Matrix3::from_columns(&[column(0), column(1), column(2)]);
        LegState { foot, jacobian, axes: Matrix3::from_columns(&axes), inertia, moment }
    }

    /// The foot's acceleration in the base when the joint rates stay as they are, m/s2.
    pub(crate) fn bias_mps2(
        &self,
        state: &LegState,
        angles_rad: [f64; 3],
        rates_radps: &Vector3<f64>,
    ) -> Vector3<f64> {
        // A directional difference of the Jacobian; its error is of the order of the step.
        let step_s = 1e-5;
        let ahead = std::array::from_fn(|joint| angles_rad[joint] + rates_radps[joint] * step_s);
        (self.at(ahead).jacobian - state.jacobian) * rates_radps / step_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gait::walk::Body;
    use crate::go1;

    const ANGLES_RAD: [f64; 3] = [0.2, 0.9, -1.7];

    #[test]
    fn the_chain_puts_the_foot_where_the_closed_form_does_and_its_jacobian_is_the_derivative() {
        let body = Body::go1();
        for leg in 0..4 {
            let state = body.legs[leg].at(ANGLES_RAD);
            assert!((state.foot - go1::foot(leg, ANGLES_RAD)).norm() < 1e-12);
            for joint in 0..3 {
                let moved = |by: f64| {
                    let mut angles = ANGLES_RAD;
                    angles[joint] += by;
                    go1::foot(leg, angles)
                };
                let slope = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                assert!((state.jacobian.column(joint) - slope).norm() < 1e-8);
            }
        }
    }

    #[test]
    fn the_torque_against_gravity_is_the_slope_of_the_potential_energy() {
        let body = Body::go1();
        let gravity = Vector3::new(0.3, -0.2, -9.8);
        let energy = |angles: [f64; 3]| {
            let lump = body.legs[1].lump(angles);
            -lump.mass_kg * gravity.dot(&lump.center_of_mass.coords)
        };
        let torque = -(body.legs[1].at(ANGLES_RAD).moment * gravity);
        for joint in 0..3 {
            let moved = |by: f64| {
                let mut angles = ANGLES_RAD;
                angles[joint] += by;
                energy(angles)
            };
            let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!((torque[joint] - slope).abs() < 1e-7, "joint {joint}: {} against {slope}", torque[joint]);
        }
    }

    #[test]
    fn the_joint_inertia_is_twice_the_kinetic_energy_of_the_moving_links() {
        let body = Body::go1();
        let leg = &body.legs[2];
        let rates = Vector3::new(0.7, -1.1, 2.3);
        // Kinetic energy from the links' own motion, by differences of their places.
        let step_s = 1e-6;
        let place = |link: usize, time_s: f64| {
            let mut pose = Pose::identity();
            for (index, one) in leg.links.iter().enumerate().take(link + 1) {
                let angle = ANGLES_RAD[index] + rates[index] * time_s;
                pose = pose * one.parent_from_child * UnitQuaternion::from_axis_angle(&one.axis, angle);
            }
            pose
        };
        let mut energy = 0.0;
        for link in 0..3 {
            let one = &leg.links[link];
            let (before, after) = (place(link, -step_s), place(link, step_s));
            let velocity =
                (after * one.lump.center_of_mass - before * one.lump.center_of_mass) / (2.0 * step_s);
            let spin = (before.rotation.inverse() * after.rotation).scaled_axis() / (2.0 * step_s);
            energy += 0.5 * one.lump.mass_kg * velocity.norm_squared()
                + 0.5 * spin.dot(&(one.lump.inertia_kgm2 * spin))
                + 0.5 * one.rotor_kgm2 * rates[link] * rates[link];
        }
        let by_matrix = 0.5 * rates.dot(&(leg.at(ANGLES_RAD).inertia * rates));
        assert!((by_matrix / energy - 1.0).abs() < 1e-6, "{by_matrix} J against {energy} J");
    }
}
