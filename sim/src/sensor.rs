//! The robot's sensors: what they are set to, and how they make observations from the body's true motion.

mod gnss;
mod imu;
pub mod lidar;
mod lowpass;
mod motion;
mod odometry;

pub use gnss::{DatumSpec, GnssSpec};
pub use imu::ImuSpec;
pub use lidar::{EchoChoice, FaultSpec, FiringStory, LidarModel, LidarSpec, WeatherSpec};
pub use odometry::{OdometrySource, OdometrySpec};

pub(crate) use gnss::Gnss;
pub(crate) use imu::InertialSensor;
pub(crate) use lidar::{Lidar, Surroundings, wire_under};
pub(crate) use motion::Motion;
pub(crate) use odometry::LegOdometry;
