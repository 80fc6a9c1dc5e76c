//! What really happened. Systems never see this: it goes from the simulator to recorders and to scoring.

use crate::estimate::{Estimate, Health};
use crate::pose::{Pose, Twist};
use crate::time::Time;
use serde::{Deserialize, Serialize};

/// What a beam met.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Class {
    /// Nothing within range.
    Sky = 0,
    /// Bare soil.
    Ground = 1,
    /// A blade of grass above the soil.
    Grass = 2,
    /// The stem of a tree.
    Trunk = 3,
    /// A branch.
    Branch = 4,
    /// A leaf.
    Leaf = 5,
    /// A traffic cone.
    Cone = 6,
    /// A post.
    Post = 7,
    /// A wire.
    Wire = 8,
    /// The robot's own body.
    Robot = 9,
    /// Rain, fog or dust in the air.
    Weather = 10,
}

/// Truth of one return: same order as the sweep's returns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Label {
    /// What the beam met; [`Class::Sky`] for a true miss.
    pub class: Class,
    /// Which object of that class, as numbered by the world; 0 where the class has no objects.
    pub instance: u32,
    /// Distance along the beam before noise, quantization and dropout, meters; of a mixed return the mean of what was
    /// met, weighted by energy; NaN when nothing was met.
    pub range_m: f32,
    /// Angle between the beam and the surface normal, radians in [0, pi/2]; NaN when nothing was met.
    pub incidence_rad: f32,
    /// Several surfaces share this return: its range belongs to none of them.
    pub mixed: bool,
    /// How far the wind has moved the surface from where it rests, meters.
    pub displaced_m: f32,
}

impl Label {
    /// Nothing was met.
    pub const MISS: Label = Label {
        class: Class::Sky,
        instance: 0,
        range_m: f32::NAN,
        incidence_rad: f32::NAN,
        mixed: false,
        displaced_m: 0.0,
    };
}

/// Two bodies touch.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Contact {
    /// The robot's part, for instance `trunk`.
    pub part: String,
    /// What it touches.
    pub class: Class,
    /// Which object of that class.
    pub instance: u32,
}

/// The robot's true state at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The instant.
    pub stamp: Time,
    /// The base in the scenario's world (east, north, up).
    pub world_from_base: Pose,
    /// The base at time zero in the world: where routes and maps begin.
    pub world_from_start: Pose,
    /// Velocity of the base's origin and turn rate, both in the base frame.
    pub twist: Twist,
    /// Solid things that the body touches now (the ground is none of them), sorted.
    pub contacts: Vec<Contact>,
}

impl Truth {
    /// The truth as a perfect system would say it, in the frame of the start.
    pub fn as_estimate(&self) -> Estimate {
        Estimate {
            stamp: self.stamp,
            map_from_base: self.world_from_start.inverse() * self.world_from_base,
            covariance: None,
            health: Health::Tracking,
        }
    }
}
