//! The Unitree Go1: dimensions with their sources, forward and inverse kinematics of a leg, collision shapes.
//!
//! Legs are ordered FR, FL, RR, RL; the base frame is the trunk's: x forward, y left, z up, origin in the middle
//! between the hips. "go1.urdf" below is unitreerobotics/unitree_ros `robots/go1_description/urdf/go1.urdf`.

use crate::description::Robot;
use crate::gait::Motor;
use crate::lump::Lump;
use arborloop_base::Pose;
use nalgebra::{Point3, Vector3};

/// Names of the legs.
pub const LEGS: [&str; 4] = ["FR", "FL", "RR", "RL"];
/// Names of the joints, leg by leg.
pub const JOINT_NAMES: [&str; 12] = [
    "FR_hip_joint",
    "FR_thigh_joint",
    "FR_calf_joint",
    "FL_hip_joint",
    "FL_thigh_joint",
    "FL_calf_joint",
    "RR_hip_joint",
    "RR_thigh_joint",
    "RR_calf_joint",
    "RL_hip_joint",
    "RL_thigh_joint",
    "RL_calf_joint",
];
/// Distance of the hip joints from the trunk's middle along x, meters (go1.urdf).
pub const HIP_X_M: f64 = 0.1881;
/// Distance of the hip joints from the trunk's middle along y, meters (go1.urdf).
pub const HIP_Y_M: f64 = 0.04675;
/// Sideways offset of the thigh from the hip joint, meters (go1.urdf).
pub const HIP_OFFSET_M: f64 = 0.08;
/// Length of the thigh, meters (go1.urdf).
pub const THIGH_M: f64 = 0.213;
/// Length of the calf down to the foot's center, meters (go1.urdf).
pub const CALF_M: f64 = 0.213;
/// Radius of a foot, meters (go1.urdf).
pub const FOOT_RADIUS_M: f64 = 0.02;
/// Length, width and height of the trunk box, meters (go1.urdf).
pub const TRUNK_SIZE_M: [f64; 3] = [0.3762, 0.0935, 0.114];
/// Sideways distance of a foot from the middle when standing, meters (unitree_guide `unitreeRobot.cpp`).
pub const FOOT_Y_M: f64 = 0.130;
/// Mass without payload, kg (sum of go1.urdf).
pub const MASS_KG: f64 = 12.012;
/// Mass of the VLP-16, kg (the maker's data sheet).
pub const LIDAR_KG: f64 = 0.83;
/// Mass of the lidar's bracket, kg; assumed: an aluminum plate with four posts.
pub const BRACKET_KG: f64 = 0.35;
/// Height of the lidar's center above the trunk origin, meters; assumed: the paper does not give its mount.
pub const LIDAR_Z_M: f64 = 0.16;
/// Inertia of the whole body about its axes, kg m2 (unitree_guide `unitreeRobot.cpp`, balance controller).
pub const INERTIA_KGM2: [f64; 3] = [0.0792, 0.2085, 0.2265];
/// Lowest and highest hip angle, radians (go1.urdf).
pub const HIP_LIMITS_RAD: [f64; 2] = [-1.047, 1.047];
/// Lowest and highest thigh angle, radians (go1.urdf).
pub const THIGH_LIMITS_RAD: [f64; 2] = [-0.663, 2.967];
/// Lowest and highest calf angle, radians (go1.urdf).
pub const CALF_LIMITS_RAD: [f64; 2] = [-2.723, -0.838];

/// Hip, thigh and calf angle when standing with the trunk 0.28 m above the ground, radians; with 0 the feet are below
/// the thighs.
pub const STANDING_RAD: [f64; 3] = [0.0, 0.914, -1.829];
/// Hip, thigh and knee motors: torque and speed limits (mujocolab/mjlab `go1_constants.py`), rotor inertia of
/// 1.11842e-4 kg m2 through gears of 6, 6 and 9 (the same file).
pub const MOTORS: [Motor; 3] = [
    Motor { torque_nm_max: 23.7, speed_radps_max: 30.1, rotor_kgm2: 0.004_026_3 },
    Motor { torque_nm_max: 23.7, speed_radps_max: 30.1, rotor_kgm2: 0.004_026_3 },
    Motor { torque_nm_max: 35.55, speed_radps_max: 20.06, rotor_kgm2: 0.009_059_2 },
];

/// What the Go1 carries on its back, base frame: the lidar, and its bracket between it and the trunk.
pub fn payload() -> Lump {
    let lidar =
        Lump::cuboid(LIDAR_KG, Point3::new(0.0, 0.0, LIDAR_Z_M), Vector3::new(0.1033, 0.1033, 0.0717));
    let (top, bottom) = (LIDAR_Z_M - 0.0717 / 2.0, TRUNK_SIZE_M[2] / 2.0);
    let middle = Point3::new(0.0, 0.0, (top + bottom) / 2.0);
    lidar.plus(&Lump::cuboid(BRACKET_KG, middle, Vector3::new(0.12, 0.12, top - bottom)))
}

/// Luggage on the trunk's back, base frame; its mass in kg. Assumed: bags around the bracket, 30 x 20 x 10 cm.
pub fn luggage(mass_kg: f64) -> Lump {
    let sides_m = Vector3::new(0.3, 0.2, 0.1);
    Lump::cuboid(mass_kg, Point3::new(0.0, 0.0, (TRUNK_SIZE_M[2] + sides_m.z) / 2.0), sides_m)
}

/// The Go1 of `models/go1.urdf`, as published in this crate.
///
/// # Panics
/// Never: a test parses the embedded file.
pub fn go1() -> Robot {
    Robot::from_urdf(include_str!("../models/go1.urdf"), "models/go1.urdf")
        .expect("the embedded model is parsed by this crate's tests")
}

/// A box fixed to the body, for a simulator to place its colliders.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyShape {
    /// Which part of the robot, as named in contacts.
    pub part: &'static str,
    /// Half its length, width and height, meters.
    pub half_extents_m: Vector3<f64>,
    /// Its middle and axes in the base frame.
    pub base_from_shape: Pose,
}

/// The boxes that touch things: trunk, the two pairs of hips with the thighs beside them, and the lidar.
/// Feet are spheres of [`FOOT_RADIUS_M`] at [`crate::TrunkState::feet_world`].
pub fn body_shapes() -> Vec<BodyShape> {
    let half = |[x, y, z]: [f64; 3]| Vector3::new(x, y, z) / 2.0;
    let shape = |part, half_extents_m, [x, y, z]: [f64; 3]| BodyShape {
        part,
        half_extents_m,
        base_from_shape: Pose::translation(x, y, z),
    };
    // Outer face of the thigh: joint, offset and half its thickness. The motors are as thick as the hip's cylinder.
    let hips = Vector3::new(HIP_RADIUS_M, HIP_Y_M + HIP_OFFSET_M + THIGH_THICKNESS_M / 2.0, HIP_RADIUS_M);
    vec![
        shape("trunk", half(TRUNK_SIZE_M), [0.0; 3]),
        shape("front_hips", hips, [HIP_X_M, 0.0, 0.0]),
        shape("rear_hips", hips, [-HIP_X_M, 0.0, 0.0]),
        // VLP-16 manual: 103.3 mm across, 71.7 mm high.
        shape("lidar", Vector3::new(0.05165, 0.05165, 0.03585), [0.0, 0.0, LIDAR_Z_M]),
    ]
}

/// Radius of a hip's motor, meters (a1.urdf's hip cylinder; assumed alike on the Go1).
const HIP_RADIUS_M: f64 = 0.046;
/// Thickness of a thigh across, meters (a1.urdf's thigh box; assumed alike on the Go1).
const THIGH_THICKNESS_M: f64 = 0.0245;

/// Hip joint of a leg, base frame.
pub fn hip(leg: usize) -> Point3<f64> {
    Point3::new(if leg < 2 { HIP_X_M } else { -HIP_X_M }, side(leg) * HIP_Y_M, 0.0)
}

/// -1 on the right, 1 on the left.
fn side(leg: usize) -> f64 {
    if leg.is_multiple_of(2) { -1.0 } else { 1.0 }
}

/// Center of a leg's foot in the base frame for hip, thigh and calf angles in radians.
pub fn foot(leg: usize, angles_rad: [f64; 3]) -> Point3<f64> {
    let [hip_rad, thigh_rad, calf_rad] = angles_rad;
    let (sin, cos) = hip_rad.sin_cos();
    let offset = side(leg) * HIP_OFFSET_M;
    let ahead = -THIGH_M * thigh_rad.sin() - CALF_M * (thigh_rad + calf_rad).sin();
    let down = -THIGH_M * thigh_rad.cos() - CALF_M * (thigh_rad + calf_rad).cos();
    hip(leg) + Vector3::new(ahead, offset * cos - down * sin, offset * sin + down * cos)
}

/// Hip, thigh and calf angles in radians that put a leg's foot at a point of the base frame, knee backward.
///
/// A point out of reach is answered by the angles at the joints' limits that point toward it.
pub fn angles(leg: usize, foot: &Point3<f64>) -> [f64; 3] {
    let at = foot - hip(leg);
    let offset = side(leg) * HIP_OFFSET_M;
    // The leg's own plane stands `offset` beside the hip axis and turns with it.
    let down = -(at.y * at.y + at.z * at.z - offset * offset).max(0.0).sqrt();
    let hip_rad = arborloop_base::wrap_angle(at.z.atan2(at.y) - down.atan2(offset));
    let cos_calf =
        (at.x * at.x + down * down - THIGH_M * THIGH_M - CALF_M * CALF_M) / (2.0 * THIGH_M * CALF_M);
    let calf_rad = clamped(-cos_calf.clamp(-1.0, 1.0).acos(), CALF_LIMITS_RAD);
    let bend_rad = (CALF_M * calf_rad.sin()).atan2(THIGH_M + CALF_M * calf_rad.cos());
    let thigh_rad = arborloop_base::wrap_angle((-at.x).atan2(-down) - bend_rad);
    [clamped(hip_rad, HIP_LIMITS_RAD), clamped(thigh_rad, THIGH_LIMITS_RAD), calf_rad]
}

fn clamped(angle_rad: f64, [low, high]: [f64; 2]) -> f64 {
    angle_rad.clamp(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;

    #[test]
    fn angles_of_a_foot_put_the_foot_back_where_it_was() {
        let stream = Seed(1).stream("test/legs");
        for index in 0..2000 {
            let mut draws = stream.at(index);
            let leg = index as usize % 4;
            // Inside the limits, below the hip: the knee-backward branch is the only one.
            let wanted = [draws.within(-0.8, 0.8), draws.within(-0.3, 1.6), draws.within(-2.5, -0.9)];
            let foot_wanted = foot(leg, wanted);
            if foot_wanted.z > -0.12 {
                continue;
            }
            let found = angles(leg, &foot_wanted);
            assert!((foot(leg, found) - foot_wanted).norm() < 1e-9, "leg {leg}: {wanted:?} gave {found:?}");
        }
    }

    #[test]
    fn a_foot_agrees_with_the_chain_of_joints_in_the_model() {
        let robot = go1();
        for (leg, name) in LEGS.iter().enumerate() {
            let angles_rad = [0.2, 0.9, -1.8];
            let names = [0, 1, 2].map(|joint| JOINT_NAMES[3 * leg + joint]);
            let joint_at =
                |joint: &str| names.iter().position(|n| *n == joint).map_or(0.0, |n| angles_rad[n]);
            let pose = robot.frame_at(&format!("{name}_foot"), &joint_at).unwrap();
            let by_model = Point3::from(pose.translation.vector);
            assert!((by_model - foot(leg, angles_rad)).norm() < 1e-12, "{name}");
        }
    }

    #[test]
    fn a_foot_out_of_reach_is_answered_within_the_limits() {
        for target in [Point3::new(9.0, 0.0, 0.0), Point3::new(0.19, -0.05, 0.0), Point3::new(-1.0, 2.0, 3.0)]
        {
            for leg in 0..4 {
                let [hip_rad, thigh_rad, calf_rad] = angles(leg, &target);
                assert!((HIP_LIMITS_RAD[0]..=HIP_LIMITS_RAD[1]).contains(&hip_rad));
                assert!((THIGH_LIMITS_RAD[0]..=THIGH_LIMITS_RAD[1]).contains(&thigh_rad));
                assert!((CALF_LIMITS_RAD[0]..=CALF_LIMITS_RAD[1]).contains(&calf_rad));
            }
        }
    }

    #[test]
    fn the_model_weighs_what_its_maker_publishes() {
        assert!((go1().mass_kg() - 12.01).abs() < 0.05, "{}", go1().mass_kg());
    }
}
