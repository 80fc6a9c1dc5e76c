//! The simulator: scenarios, physics, what beams meet, sensors, and the loop.
//!
//! A scenario and a seed become a world, a robot and sensors; [`run`] lets systems answer what the sensors say, and
//! a follower steers the robot by one of the answers, or by truth. Systems are known as `dyn Slam` only, recorders as
//! `dyn Sink`.

mod axes;
pub mod document;
mod gait;
pub mod kidnap;
pub mod optics;
mod physics;
mod run;
pub mod scenario;
pub mod sensor;
mod simulator;

pub use document::{Document, Refusal};
pub use physics::{PhysicsGait, WheeledGait};
pub use run::{ContactEvent, Driver, End, Outcome, System, run};
pub use scenario::Scenario;
pub use simulator::Simulator;
