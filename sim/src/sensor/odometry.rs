//! Leg odometry: the motion that the robot believes it made, with a scale error and noise.

use crate::scenario::{Wrong, whole_ticks, within};
use arborloop_base::{Odometry, Pose, Span, Stream, Time, Twist};
use serde::{Deserialize, Serialize};

/// What the leg odometry is set to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OdometrySpec {
    /// Twists a second.
    pub rate_hz: f64,
    /// Standard deviation over runs of the speed's scale error.
    pub scale_error_ratio: f64,
    /// Standard deviation of each twist's speed, m/s.
    pub speed_noise_mps: f64,
    /// Standard deviation of each twist's turn rate, rad/s.
    pub turn_noise_radps: f64,
}

impl Default for OdometrySpec {
    fn default() -> Self {
        // assumed: feet that slip a little; a few percent of distance.
        OdometrySpec { rate_hz: 50.0, scale_error_ratio: 0.03, speed_noise_mps: 0.05, turn_noise_radps: 0.05 }
    }
}

impl OdometrySpec {
    pub(crate) fn check(&self, tick: Span) -> Result<(), Wrong> {
        within("odometry.rate_hz", self.rate_hz, 0.1, 1000.0)?;
        whole_ticks("odometry.rate_hz", self.rate_hz, tick)?;
        within("odometry.scale_error_ratio", self.scale_error_ratio, 0.0, 1.0)?;
        within("odometry.speed_noise_mps", self.speed_noise_mps, 0.0, 10.0)?;
        within("odometry.turn_noise_radps", self.turn_noise_radps, 0.0, 10.0)
    }
}

pub(crate) struct LegOdometry {
    spec: OdometrySpec,
    period: Span,
    stream: Stream,
    last: Option<Pose>,
}

impl LegOdometry {
    pub(crate) fn new(spec: &OdometrySpec, period: Span, stream: Stream) -> Self {
        LegOdometry { spec: spec.clone(), period, stream, last: None }
    }

    pub(crate) fn period(&self) -> Span {
        self.period
    }

    pub(crate) fn sample(&mut self, stamp: Time, world_from_base: &Pose) -> Option<Odometry> {
        let before = self.last.replace(*world_from_base)?;
        let motion = before.inverse() * world_from_base;
        let seconds = self.period.seconds();
        let scale = 1.0 + self.stream.child(0).at(0).normal() * self.spec.scale_error_ratio;
        let mut noise = self.stream.at((stamp - Time::SIMULATION_START).nanos() as u64);
        let mut twist = Twist {
            linear_mps: motion.translation.vector * scale / seconds,
            angular_radps: motion.rotation.scaled_axis() / seconds,
        };
        twist.linear_mps.x += noise.normal() * self.spec.speed_noise_mps;
        twist.linear_mps.y += noise.normal() * self.spec.speed_noise_mps;
        twist.angular_radps.z += noise.normal() * self.spec.turn_noise_radps;
        Some(Odometry { stamp, twist })
    }
}
