//! The gait seam: what moves a trunk, whether by kinematics (the trot here) or by torques in a physics engine.

mod carry;
mod legs;
mod oscillator;
mod planar;
mod replay;
mod settings;
mod shake;
mod shaker;
pub mod strides;
mod suspension;
mod trot;
mod walk;

pub use carry::Carry;
pub use settings::{GaitMode, TrotSettings};
pub use trot::KinematicTrot;
pub use walk::{Body, BodyError, Motor, Sensed, WalkSettings, Walker};

use arborloop_base::{Pose, Pose2, Span, Twist};
use nalgebra::{Point3, Vector3};

/// The ground under a robot, world frame.
pub trait Ground {
    /// Height of the ground, meters.
    fn height_m(&self, x_m: f64, y_m: f64) -> f64;
}

/// What a robot is told to do.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Command {
    /// Forward speed, m/s.
    pub forward_mps: f64,
    /// Turn rate, counter-clockwise, rad/s.
    pub turn_radps: f64,
}

/// A moving robot at one instant. Legs, and wheels, are ordered FR, FL, RR, RL.
#[derive(Debug, Clone, PartialEq)]
pub struct TrunkState {
    /// The base in the world; of a Go1 the trunk's origin, the middle between the four hips.
    pub world_from_base: Pose,
    /// Velocity of the base's origin, world frame, m/s.
    pub linear_mps: Vector3<f64>,
    /// Turn rate, base frame, rad/s.
    pub angular_radps: Vector3<f64>,
    /// Stride phase in [0, 1); 0 on wheels.
    pub phase: f64,
    /// Which feet, or wheels, carry weight.
    pub stance: [bool; 4],
    /// Centers of the feet, world frame; a foot that stands has its center one foot radius above the ground. On wheels the
    /// wheels' middles.
    pub feet_world: [Point3<f64>; 4],
    /// Hip, thigh and calf angle of each leg in turn, in the order of [`crate::go1::JOINT_NAMES`], radians. On wheels
    /// the angles in the order of [`crate::Wheeled::joint_names`], then zeros.
    pub joint_angles_rad: [f64; 12],
    /// Forces and rates, from gaits that know them: physics does, kinematics does not.
    pub loads: Option<Loads>,
    /// What the wheels tell of the motion, base axes; `None` on legs.
    pub rolled: Option<Twist>,
}

/// What a body's joints and feet bear at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loads {
    /// Joint rates in the order of the angles, rad/s.
    pub joint_rates_radps: [f64; 12],
    /// Torques of the joints' motors in the same order, N m.
    pub joint_torques_nm: [f64; 12],
    /// Force of the ground on each foot, world axes, N.
    pub foot_forces_n: [Vector3<f64>; 4],
}

/// Why a robot walks no more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FallCause {
    /// The trunk is tilted beyond recovery.
    Tipped,
    /// The trunk lies on the ground.
    Collapsed,
    /// The body's motion is not a number any more: the engine failed, not the robot.
    NotFinite,
}

/// A fall: how long after the gait began, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fall {
    /// Time from the gait's first tick.
    pub after: Span,
    /// Why.
    pub cause: FallCause,
}

impl std::fmt::Display for FallCause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            FallCause::Tipped => "the trunk tipped over",
            FallCause::Collapsed => "the trunk came down on the ground",
            FallCause::NotFinite => "the body's motion is not finite",
        })
    }
}

/// The gait seam: the kinematic trot fills it here, a physics gait elsewhere, and no sensor knows which.
pub trait TrunkMotion: Send {
    /// Moves on by exactly one tick.
    fn advance(&mut self, command: &Command, ground: &dyn Ground) -> &TrunkState;

    /// Puts the body down elsewhere as it is, at the instant of its last tick: `by` forward and to the left of the base, and turned. Its
    /// joints, and its velocity as it sees it, stay what they are; [`TrunkMotion::state`] tells of the new place.
    fn carry(&mut self, by: &Pose2, ground: &dyn Ground);

    /// The state after the last tick.
    fn state(&self) -> &TrunkState;

    /// The fall, once there was one: the state stays as it was then.
    fn fall(&self) -> Option<Fall> {
        None
    }
}
