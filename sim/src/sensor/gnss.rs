//! RTK position of the antenna. Recorded in every data set; no system sees it unless it asks.

use crate::scenario::{Wrong, whole_ticks, within};
use arborloop_base::{Fix, FixQuality, Pose, Span, Stream, Time};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// What the satellite receiver is set to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GnssSpec {
    /// Fixes a second.
    pub rate_hz: f64,
    /// Standard deviation of east and of north, meters.
    pub horizontal_noise_m: f64,
    /// Standard deviation of height, meters.
    pub vertical_noise_m: f64,
    /// The world's origin on Earth.
    pub datum: DatumSpec,
}

/// A place on the WGS-84 ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DatumSpec {
    /// Geodetic latitude, degrees.
    pub latitude_deg: f64,
    /// Longitude, degrees.
    pub longitude_deg: f64,
    /// Height above the ellipsoid, meters.
    pub altitude_m: f64,
}

impl Default for GnssSpec {
    fn default() -> Self {
        // Residual noise of the Pullally receiver: 2-3 cm a sample; 1 Hz there, 5 Hz is the receiver's usual rate.
        GnssSpec {
            rate_hz: 5.0,
            horizontal_noise_m: 0.02,
            vertical_noise_m: 0.03,
            datum: DatumSpec::default(),
        }
    }
}

impl Default for DatumSpec {
    fn default() -> Self {
        // assumed: near Pullally, Chile.
        DatumSpec { latitude_deg: -32.42, longitude_deg: -71.35, altitude_m: 40.0 }
    }
}

impl GnssSpec {
    pub(crate) fn check(&self, tick: Span) -> Result<(), Wrong> {
        within("gnss.rate_hz", self.rate_hz, 0.1, 100.0)?;
        whole_ticks("gnss.rate_hz", self.rate_hz, tick)?;
        within("gnss.horizontal_noise_m", self.horizontal_noise_m, 0.0, 100.0)?;
        within("gnss.vertical_noise_m", self.vertical_noise_m, 0.0, 100.0)?;
        within("gnss.datum.latitude_deg", self.datum.latitude_deg, -90.0, 90.0)?;
        within("gnss.datum.longitude_deg", self.datum.longitude_deg, -180.0, 180.0)?;
        within("gnss.datum.altitude_m", self.datum.altitude_m, -500.0, 9000.0)
    }
}

pub(crate) struct Gnss {
    spec: GnssSpec,
    period: Span,
    base_from_antenna: Pose,
    stream: Stream,
}

impl Gnss {
    pub(crate) fn new(spec: &GnssSpec, period: Span, base_from_antenna: Pose, stream: Stream) -> Self {
        Gnss { spec: spec.clone(), period, base_from_antenna, stream }
    }

    pub(crate) fn period(&self) -> Span {
        self.period
    }

    pub(crate) fn sample(&self, stamp: Time, world_from_base: &Pose) -> Fix {
        let mut draws = self.stream.at((stamp - Time::SIMULATION_START).nanos() as u64);
        let (flat, up) = (self.spec.horizontal_noise_m, self.spec.vertical_noise_m);
        let noise = Vector3::new(draws.normal() * flat, draws.normal() * flat, draws.normal() * up);
        Fix {
            stamp,
            position_m: (world_from_base * self.base_from_antenna).translation.vector + noise,
            covariance_m2: Matrix3::from_diagonal(&Vector3::new(flat * flat, flat * flat, up * up)),
            quality: FixQuality::Fixed,
        }
    }
}
