//! The robots on wheels that come with the program.

use super::Wheeled;
use crate::description::Robot;

/// Clearpath Jackal with a VLP-16: skid steering.
///
/// # Panics
/// Never: a test reads the embedded file.
pub fn jackal() -> Wheeled {
    embedded(include_str!("../../models/jackal.urdf"), "models/jackal.urdf")
}

/// Thorvald II, slim, with an OS1-16: four wheels driven and steered.
///
/// # Panics
/// Never: a test reads the embedded file.
pub fn thorvald() -> Wheeled {
    embedded(include_str!("../../models/thorvald.urdf"), "models/thorvald.urdf")
}

fn embedded(text: &str, name: &str) -> Wheeled {
    let robot = Robot::from_urdf(text, name).expect("the embedded models are read by this crate's tests");
    Wheeled::new(robot).expect("the embedded models have four wheels, as this crate's tests see")
}
