//! What a robot's sensors say. There is no truth among them.

use crate::pose::Twist;
use crate::time::{Span, Time};
use nalgebra::{Matrix3, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// One beam's answer, in the lidar frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Return {
    /// Bearing of the point (or of the beam, for a miss) from the lidar's x axis, counter-clockwise, radians in (-pi, pi].
    pub azimuth_rad: f64,
    /// Elevation of the point (or of the beam) above the lidar's xy plane, radians.
    pub elevation_rad: f64,
    /// Distance from the lidar's origin, meters; `None` when the beam met nothing (free space is evidence).
    pub range_m: Option<f64>,
    /// Elevation rank of the beam, 0 the lowest.
    pub ring: u16,
    /// Which echo of the firing this is: 0 the only one or the nearer of two, 1 the farther.
    pub number: u8,
    /// When the beam fired, after the sweep's start.
    pub fired_after: Span,
    /// The sensor's intensity byte as a number: 0-100 diffuse, above 100 retro-reflecting.
    pub intensity: f32,
}

impl Return {
    /// The point that the beam met, lidar frame, meters.
    pub fn point(&self) -> Option<Point3<f64>> {
        let range_m = self.range_m?;
        let (sin_azimuth, cos_azimuth) = self.azimuth_rad.sin_cos();
        let (sin_elevation, cos_elevation) = self.elevation_rad.sin_cos();
        let horizontal = range_m * cos_elevation;
        Some(Point3::new(horizontal * cos_azimuth, horizontal * sin_azimuth, range_m * sin_elevation))
    }
}

/// One turn of the lidar, misses included; delivered at `end`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sweep {
    /// When the turn began.
    pub start: Time,
    /// When the turn was complete: the stamp of the estimate that answers it. Equal to `start` for an instant scan.
    pub end: Time,
    /// Number of beams, one above the other; 1 for a planar scanner.
    pub rings: u16,
    /// In firing order.
    pub returns: Vec<Return>,
}

/// Inertial measurement, IMU frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imu {
    /// When it was measured.
    pub stamp: Time,
    /// Specific force, m/s^2: +9.81 upward at rest (REP-145).
    pub specific_force_mps2: Vector3<f64>,
    /// Angular rate, rad/s.
    pub rate_radps: Vector3<f64>,
}

/// How good a satellite fix is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FixQuality {
    /// No position.
    None,
    /// Single point.
    Single,
    /// Carrier phase, integers not resolved.
    Float,
    /// Carrier phase, integers resolved.
    Fixed,
}

/// Satellite position of the antenna.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// When it was measured.
    pub stamp: Time,
    /// East, north, up from the site's datum, meters.
    pub position_m: Vector3<f64>,
    /// Covariance of `position_m`, m^2.
    pub covariance_m2: Matrix3<f64>,
    /// Quality as the receiver reports it.
    pub quality: FixQuality,
}

/// The motion that the robot believes it executed, base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Odometry {
    /// End of the interval that the twist describes.
    pub stamp: Time,
    /// Mean twist over the interval, base frame.
    pub twist: Twist,
}

/// Anything that a sensor says.
#[derive(Debug, Clone, PartialEq)]
pub enum Observation {
    /// A lidar turn.
    Sweep(Sweep),
    /// An inertial measurement.
    Imu(Imu),
    /// A satellite fix.
    Fix(Fix),
    /// Leg or wheel odometry.
    Odometry(Odometry),
}

/// The kind of an observation: what a system may ask to be fed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ObservationKind {
    /// Lidar turns.
    Lidar,
    /// Inertial measurements.
    Imu,
    /// Satellite fixes.
    Gnss,
    /// Odometry.
    Odometry,
}

impl Observation {
    /// When the observation is delivered: the end of a sweep, the stamp of all else.
    pub fn stamp(&self) -> Time {
        match self {
            Observation::Sweep(sweep) => sweep.end,
            Observation::Imu(imu) => imu.stamp,
            Observation::Fix(fix) => fix.stamp,
            Observation::Odometry(odometry) => odometry.stamp,
        }
    }

    /// Its kind.
    pub fn kind(&self) -> ObservationKind {
        match self {
            Observation::Sweep(_) => ObservationKind::Lidar,
            Observation::Imu(_) => ObservationKind::Imu,
            Observation::Fix(_) => ObservationKind::Gnss,
            Observation::Odometry(_) => ObservationKind::Odometry,
        }
    }
}
