//! Robot bodies: how they are built (URDF), how they move (gait) and how they steer (follower).
//!
//! Nothing here knows a world, a sensor or an engine: the ground is a height function, and a pose to steer by is given.

pub mod description;
pub mod follow;
pub mod gait;
pub mod go1;
mod lump;
mod setting;
pub mod wheels;

pub use description::{Form, Joint, JointKind, JointLimits, Link, Robot, RobotError, SensorFrame, Shape};
pub use follow::{Follower, FollowerSettings, Progress, Route};
pub use gait::strides;
pub use gait::{
    Body, BodyError, Carry, Command, Fall, FallCause, GaitMode, Ground, KinematicTrot, Loads, Motor, Sensed,
    TrotSettings, TrunkMotion, TrunkState, WalkSettings, Walker,
};
pub use go1::{BodyShape, go1};
pub use lump::Lump;
pub use setting::SettingError;
pub use wheels::{Wheel, WheelSettings, Wheeled, WheelsError};
