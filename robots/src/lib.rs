//! Robot bodies: how they are built (URDF), how they move (gait) and how they steer (follower).
//!
//! Nothing here knows a world, a sensor or an engine: the ground is a height function, and a pose to steer by is given.

pub mod description;
pub mod follow;
pub mod gait;
pub mod go1;
mod setting;

pub use description::{Joint, JointKind, JointLimits, Link, Robot, RobotError};
pub use follow::{Follower, FollowerSettings, Progress, Route};
pub use gait::{Command, Ground, KinematicTrot, TrotSettings, TrunkMotion, TrunkState};
pub use go1::{BodyShape, go1};
pub use setting::SettingError;
