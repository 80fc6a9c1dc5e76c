//! What the controller knows of its body: legs, masses, and what its motors can do.

use super::error::BodyError;
use super::leg::Leg;
use crate::description::Robot;
use crate::go1;
use crate::lump::Lump;
use nalgebra::{Matrix3, Point3};

/// A four-legged body with a payload, as its controller knows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Mass of everything, kg.
    pub mass_kg: f64,
    /// Center of mass in the nominal stance, base frame.
    pub center_of_mass: Point3<f64>,
    /// Inertia about it in the nominal stance, axes of the base, kg m2.
    pub inertia_kgm2: Matrix3<f64>,
    /// Hip, thigh and calf: what their motors can do.
    pub motors: [Motor; 3],
    pub(crate) legs: [Leg; 4],
}

/// A joint's motor behind its gear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motor {
    /// Greatest torque, N m.
    pub torque_nm_max: f64,
    /// Speed at which no torque is left, rad/s.
    pub speed_radps_max: f64,
    /// Inertia of the rotor as the joint feels it, kg m2.
    pub rotor_kgm2: f64,
}

/// Share of the greatest speed up to which a motor gives its greatest torque; assumed: the makers publish two points
/// only, and the torque of a brushless motor falls linearly once its voltage is used up.
const FULL_TORQUE_SHARE: f64 = 0.6;

impl Motor {
    /// The torque that the motor gives when asked for one at a speed: never more than its envelope, less when fast, and
    /// a brake when it is turned faster than its voltage reaches. A number that is none asks for nothing.
    pub fn torque_nm(&self, asked_nm: f64, speed_radps: f64) -> f64 {
        if !asked_nm.is_finite() || !speed_radps.is_finite() {
            return 0.0;
        }
        // Only a motor that drives is short of voltage: one that brakes has its speed's voltage to spare.
        let most_nm = |driving_radps: f64| {
            let falling_radps = (1.0 - FULL_TORQUE_SHARE) * self.speed_radps_max;
            let left = (self.speed_radps_max - driving_radps) / falling_radps;
            self.torque_nm_max * left.clamp(-1.0, 1.0)
        };
        let (low_nm, high_nm) = (-most_nm(-speed_radps), most_nm(speed_radps));
        asked_nm.clamp(low_nm, high_nm)
    }
}

impl Body {
    /// The Go1 with the lidar and its bracket on its back.
    ///
    /// # Panics
    /// Never: a test builds it from the embedded model.
    pub fn go1() -> Body {
        Body::go1_with(0.0)
    }

    /// The same with luggage on its back, kg: see [`go1::luggage`].
    ///
    /// # Panics
    /// Never: a test builds it from the embedded model.
    pub fn go1_with(luggage_kg: f64) -> Body {
        let robot = go1::go1();
        let links = go1::LEGS.map(|leg| format!("{leg}_foot"));
        let feet = [&*links[0], &*links[1], &*links[2], &*links[3]];
        let payload = go1::payload().plus(&go1::luggage(luggage_kg));
        Body::new(&robot, go1::JOINT_NAMES, feet, go1::MOTORS, &payload)
            .expect("the embedded model has the legs that this crate's tests build")
    }

    /// A body with legs named and hinged as the Go1's: hips that turn about x, thighs and calves about y, and limits that
    /// hold the Go1's stance. No payload.
    ///
    /// # Errors
    /// The first thing that it lacks.
    pub fn like_go1(robot: &Robot) -> Result<Body, BodyError> {
        let links = go1::LEGS.map(|leg| format!("{leg}_foot"));
        let feet = [&*links[0], &*links[1], &*links[2], &*links[3]];
        let body = Body::new(robot, go1::JOINT_NAMES, feet, go1::MOTORS, &Lump::NOTHING)?;
        if !(body.mass_kg > 0.0 && body.mass_kg.is_finite()) {
            return Err(BodyError::Mass { robot: robot.name.clone(), found: body.mass_kg.to_string() });
        }
        for (index, name) in go1::JOINT_NAMES.iter().enumerate() {
            let Some(joint) = robot.joints.iter().find(|joint| joint.name == *name) else { continue };
            let Some(base_from_child) = robot.frame(&joint.child) else { continue };
            let axis = base_from_child.rotation * joint.axis.into_inner();
            let (along, wanted) = if index % 3 == 0 { (axis.x, "x: 1 0 0") } else { (axis.y, "y: 0 1 0") };
            if along < 0.999 {
                let found = format!("{:.3} {:.3} {:.3}", axis.x, axis.y, axis.z);
                return Err(BodyError::Axis {
                    robot: robot.name.clone(),
                    joint: joint.name.clone(),
                    found,
                    wanted,
                });
            }
            let angle_rad = go1::STANDING_RAD[index % 3];
            let inside = |limits: &crate::JointLimits| (limits.low..=limits.high).contains(&angle_rad);
            if let Some(limits) = joint.limits.filter(|limits| !inside(limits)) {
                return Err(BodyError::Stance {
                    robot: robot.name.clone(),
                    joint: joint.name.clone(),
                    low: limits.low.to_string(),
                    high: limits.high.to_string(),
                    wanted: angle_rad.to_string(),
                });
            }
        }
        Ok(body)
    }

    /// A body from its description: joints leg by leg (hip, thigh, calf), the links that are feet, motors of hip, thigh
    /// and calf, and a payload in the base frame.
    ///
    /// # Errors
    /// A joint or a foot that is not there.
    pub fn new(
        robot: &Robot,
        joints: [&str; 12],
        feet: [&str; 4],
        motors: [Motor; 3],
        payload: &Lump,
    ) -> Result<Body, BodyError> {
        let rotors = motors.map(|motor| motor.rotor_kgm2);
        let leg = |n: usize| {
            Leg::new(robot, [joints[3 * n], joints[3 * n + 1], joints[3 * n + 2]], feet[n], rotors)
        };
        let legs = [leg(0)?, leg(1)?, leg(2)?, leg(3)?];
        let trunk = Lump::of(robot, robot.root()).unwrap_or(Lump::NOTHING).plus(payload);
        let whole = legs.iter().fold(trunk, |sum, leg| sum.plus(&leg.lump(go1::STANDING_RAD)));
        Ok(Body {
            mass_kg: whole.mass_kg,
            center_of_mass: whole.center_of_mass,
            inertia_kgm2: whole.inertia_kgm2,
            motors,
            legs,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_go1_with_its_payload_weighs_the_sum_of_its_parts() {
        let body = Body::go1();
        assert!((body.mass_kg - 13.19).abs() < 0.05, "{} kg", body.mass_kg);
        // Left and right legs balance; the trunk's own center is 2 mm to the left.
        assert!(body.center_of_mass.y.abs() < 0.002, "{:?}", body.center_of_mass);
        assert!(body.inertia_kgm2.symmetric_eigenvalues().iter().all(|one| *one > 0.05));
    }

    #[test]
    fn a_motor_never_leaves_its_envelope_and_brakes_at_any_speed() {
        let motor = go1::MOTORS[2];
        assert_eq!(motor.torque_nm(100.0, 0.0), motor.torque_nm_max);
        assert_eq!(motor.torque_nm(-100.0, 0.0), -motor.torque_nm_max);
        assert_eq!(motor.torque_nm(10.0, motor.speed_radps_max), 0.0);
        assert_eq!(motor.torque_nm(-100.0, motor.speed_radps_max), -motor.torque_nm_max);
        assert!(
            motor.torque_nm(10.0, 1.2 * motor.speed_radps_max) < 0.0,
            "driven beyond its speed it brakes"
        );
        assert_eq!(motor.torque_nm(f64::NAN, 0.0), 0.0);
        assert_eq!(motor.torque_nm(5.0, 1.0), 5.0);
    }
}
