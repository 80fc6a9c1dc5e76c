//! Odometry of legs or wheels: the motion that the robot believes it made, with a scale error and noise.

use crate::scenario::{Wrong, whole_ticks, within};
use arborloop_base::{Odometry, Pose, Span, Stream, Time, Twist};
use arborloop_robots::{Body, TrunkState};
use nalgebra::Vector3;
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
    /// What the speed is made from, before these errors.
    pub source: OdometrySource,
}

/// What leg odometry is made from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OdometrySource {
    /// The true motion: all errors are those of the settings. A robot on wheels is told by its wheels all the same.
    #[default]
    Motion,
    /// The legs: joints, gyroscope and foot sensors, with the errors that slipping and landing feet make. Gaits that know
    /// no joint rates are answered with the true motion.
    Legs,
}

impl Default for OdometrySpec {
    fn default() -> Self {
        // assumed: feet that slip a little; a few percent of distance.
        OdometrySpec {
            rate_hz: 50.0,
            scale_error_ratio: 0.03,
            speed_noise_mps: 0.05,
            turn_noise_radps: 0.05,
            source: OdometrySource::Motion,
        }
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
    legs: Option<Legs>,
    rolled: Rolled,
}

/// What the wheels told since the last sample: sums over the ticks, base axes, and how many they were.
#[derive(Default)]
struct Rolled {
    sum_mps: Vector3<f64>,
    sum_radps: Vector3<f64>,
    ticks: f64,
}

/// What the legs told since the last sample.
struct Legs {
    body: Body,
    /// Sum over the ticks, base axes, and how many they were.
    sum_mps: Vector3<f64>,
    ticks: f64,
    /// What they told last, for moments in which no foot stands.
    last_mps: Vector3<f64>,
}

impl LegOdometry {
    pub(crate) fn new(spec: &OdometrySpec, period: Span, stream: Stream) -> Self {
        LegOdometry { spec: spec.clone(), period, stream, last: None, legs: None, rolled: Rolled::default() }
    }

    pub(crate) fn period(&self) -> Span {
        self.period
    }

    /// One tick of the body. Wheels always tell: nothing else knows how they slip.
    pub(crate) fn feel(&mut self, state: &TrunkState) {
        if let Some(twist) = state.rolled {
            self.rolled.sum_mps += twist.linear_mps;
            self.rolled.sum_radps += twist.angular_radps;
            self.rolled.ticks += 1.0;
            return;
        }
        let Some(loads) = state.loads.filter(|_| self.spec.source == OdometrySource::Legs) else { return };
        let legs = self.legs.get_or_insert_with(|| Legs {
            body: Body::go1(),
            sum_mps: Vector3::zeros(),
            ticks: 0.0,
            last_mps: Vector3::zeros(),
        });
        let told = legs.body.velocity_over_feet_mps(
            &state.joint_angles_rad,
            &loads.joint_rates_radps,
            &state.angular_radps,
            &(state.world_from_base.rotation.inverse() * Vector3::z()),
            &state.stance,
        );
        legs.last_mps = told.unwrap_or(legs.last_mps);
        legs.sum_mps += legs.last_mps;
        legs.ticks += 1.0;
    }

    /// The body is carried off: neither legs nor wheels see it.
    pub(crate) fn carry(&mut self, moved: &Pose) {
        self.last = self.last.map(|last| moved * last);
    }

    pub(crate) fn sample(&mut self, stamp: Time, world_from_base: &Pose) -> Option<Odometry> {
        let before = self.last.replace(*world_from_base)?;
        let motion = before.inverse() * world_from_base;
        let seconds = self.period.seconds();
        let scale = 1.0 + self.stream.child(0).at(0).normal() * self.spec.scale_error_ratio;
        let mut noise = self.stream.at((stamp - Time::SIMULATION_START).nanos() as u64);
        let told = self.legs.as_mut().filter(|legs| legs.ticks > 0.0).map(|legs| {
            let mean_mps = legs.sum_mps / legs.ticks;
            (legs.sum_mps, legs.ticks) = (Vector3::zeros(), 0.0);
            mean_mps
        });
        let rolled = std::mem::take(&mut self.rolled);
        let (speed_mps, turn_radps) = if rolled.ticks > 0.0 {
            (rolled.sum_mps / rolled.ticks, rolled.sum_radps / rolled.ticks)
        } else {
            (told.unwrap_or(motion.translation.vector / seconds), motion.rotation.scaled_axis() / seconds)
        };
        let mut twist = Twist { linear_mps: speed_mps * scale, angular_radps: turn_radps };
        twist.linear_mps.x += noise.normal() * self.spec.speed_noise_mps;
        twist.linear_mps.y += noise.normal() * self.spec.speed_noise_mps;
        twist.angular_radps.z += noise.normal() * self.spec.turn_noise_radps;
        Some(Odometry { stamp, twist })
    }
}
