//! The shared words of arborloop: time, poses, observations, estimates, grids, seeds and the two open traits.
//!
//! No file is read or written here and no engine is known. Units are meters, radians, kilograms and integer
//! nanoseconds; frames are named `to_from_from`, so `map_from_base * base_from_lidar` reads left to right.

mod estimate;
mod grid;
mod observation;
pub mod os1;
mod pose;
mod seam;
mod seed;
mod time;
mod truth;
pub mod vlp16;
mod wire;

pub use estimate::{Estimate, Health};
pub use grid::{Cell, Grid};
pub use observation::{Fix, FixQuality, Imu, Observation, ObservationKind, Odometry, Return, Sweep};
pub use pose::{
    Pose, Pose2, Trajectory, TrajectoryError, Twist, interpolate, planar, pose2, spatial, wrap_angle, yaw_of,
};
pub use seam::{Record, Sink, SinkError, Slam};
pub use seed::{Draws, Seed, Stream};
pub use time::{Span, Time};
pub use truth::{Class, Contact, Label, Truth};
pub use wire::{CarryError, Wire};
