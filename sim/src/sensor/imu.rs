//! Accelerometer and gyroscope on the body.

use super::lowpass::LowPass;
use crate::scenario::{Wrong, whole_ticks, within};
use arborloop_base::{Imu, Pose, Span, Stream, Time};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Standard gravity, m/s^2.
const GRAVITY_MPS2: f64 = 9.806_65;

/// What the inertial sensor is set to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ImuSpec {
    /// Samples a second.
    pub rate_hz: f64,
    /// White noise of the specific force, (m/s^2)/sqrt(Hz).
    pub force_noise_mps2_per_sqrt_hz: f64,
    /// White noise of the rate, (rad/s)/sqrt(Hz).
    pub rate_noise_radps_per_sqrt_hz: f64,
    /// Standard deviation of the constant bias of the specific force, m/s^2.
    pub force_bias_mps2: f64,
    /// Standard deviation of the constant bias of the rate, rad/s.
    pub rate_bias_radps: f64,
    /// Where the sensor's own low-pass of second order has half the power, hertz; absent means no bandwidth but that of
    /// averaging over the period. Physics walks have contact ringing above 150 Hz that no sensor of this kind passes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bandwidth_hz: Option<f64>,
}

impl Default for ImuSpec {
    fn default() -> Self {
        // assumed: a consumer MEMS sensor of the kind that walking robots carry.
        ImuSpec {
            rate_hz: 500.0,
            force_noise_mps2_per_sqrt_hz: 2e-3,
            rate_noise_radps_per_sqrt_hz: 2e-4,
            force_bias_mps2: 0.02,
            rate_bias_radps: 2e-3,
            bandwidth_hz: None,
        }
    }
}

impl ImuSpec {
    pub(crate) fn check(&self, tick: Span) -> Result<(), Wrong> {
        within("imu.rate_hz", self.rate_hz, 1.0, 10_000.0)?;
        whole_ticks("imu.rate_hz", self.rate_hz, tick)?;
        within("imu.force_noise_mps2_per_sqrt_hz", self.force_noise_mps2_per_sqrt_hz, 0.0, 10.0)?;
        within("imu.rate_noise_radps_per_sqrt_hz", self.rate_noise_radps_per_sqrt_hz, 0.0, 10.0)?;
        within("imu.force_bias_mps2", self.force_bias_mps2, 0.0, 10.0)?;
        within("imu.rate_bias_radps", self.rate_bias_radps, 0.0, 10.0)?;
        // The filter runs once a tick: half the tick's rate is as far as it reaches.
        let reach_hz = 0.49 / tick.seconds();
        self.bandwidth_hz.map_or(Ok(()), |hz| within("imu.bandwidth_hz", hz, 1.0, reach_hz))
    }
}

/// Averages over its own period, as an anti-aliased sensor does: velocity and attitude differences are exact, so that the
/// whole impulse of a touchdown is felt however short it is. A bandwidth filters velocity and rate at every tick, which
/// is the same as filtering the force: differences and low-passes change places.
pub(crate) struct InertialSensor {
    spec: ImuSpec,
    period: Span,
    base_from_imu: Pose,
    stream: Stream,
    last: Option<Sample>,
    filtered: Option<Filtered>,
}

/// Velocity of the sensor (world) and rate (base) behind the sensor's bandwidth.
struct Filtered {
    velocity: LowPass,
    rate: LowPass,
    velocity_mps: Vector3<f64>,
    rate_radps: Vector3<f64>,
}

struct Sample {
    world_from_imu: Pose,
    velocity_mps: Vector3<f64>,
}

impl InertialSensor {
    pub(crate) fn new(spec: &ImuSpec, period: Span, base_from_imu: Pose, stream: Stream) -> Self {
        InertialSensor { spec: spec.clone(), period, base_from_imu, stream, last: None, filtered: None }
    }

    pub(crate) fn period(&self) -> Span {
        self.period
    }

    /// One tick of the body's motion, for a sensor with a bandwidth; `linear_mps` in the world, `angular_radps` in the
    /// base.
    pub(crate) fn feel(
        &mut self,
        tick: Span,
        world_from_base: &Pose,
        linear_mps: &Vector3<f64>,
        angular_radps: &Vector3<f64>,
    ) {
        let Some(corner_hz) = self.spec.bandwidth_hz else { return };
        let arm = self.base_from_imu.translation.vector;
        let velocity_mps = linear_mps + world_from_base.rotation * angular_radps.cross(&arm);
        let resting = |value| LowPass::resting(corner_hz, tick.seconds(), value);
        let filtered = self.filtered.get_or_insert_with(|| Filtered {
            velocity: resting(velocity_mps),
            rate: resting(*angular_radps),
            velocity_mps,
            rate_radps: *angular_radps,
        });
        filtered.velocity_mps = filtered.velocity.pass(velocity_mps);
        filtered.rate_radps = filtered.rate.pass(*angular_radps);
    }

    /// The body is carried off in an instant: no force and no turn of it is felt.
    pub(crate) fn carry(&mut self, moved: &Pose) {
        if let Some(last) = self.last.as_mut() {
            last.world_from_imu = moved * last.world_from_imu;
            last.velocity_mps = moved.rotation * last.velocity_mps;
        }
        if let Some(filtered) = self.filtered.as_mut() {
            filtered.velocity.turn(&moved.rotation);
            filtered.velocity_mps = moved.rotation * filtered.velocity_mps;
        }
    }

    /// A sample at a multiple of the period; `linear_mps` in the world, `angular_radps` in the base.
    pub(crate) fn sample(
        &mut self,
        stamp: Time,
        world_from_base: &Pose,
        linear_mps: &Vector3<f64>,
        angular_radps: &Vector3<f64>,
    ) -> Option<Imu> {
        let arm = self.base_from_imu.translation.vector;
        let now = Sample {
            world_from_imu: world_from_base * self.base_from_imu,
            velocity_mps: self.filtered.as_ref().map_or_else(
                || linear_mps + world_from_base.rotation * angular_radps.cross(&arm),
                |filtered| filtered.velocity_mps,
            ),
        };
        let before = self.last.replace(now)?;
        let now = self.last.as_ref()?;
        let seconds = self.period.seconds();
        let acceleration = (now.velocity_mps - before.velocity_mps) / seconds;
        let turn = (before.world_from_imu.rotation.inverse() * now.world_from_imu.rotation).scaled_axis();
        // Force is read in the sensor's attitude in the middle of the period.
        let middle = before.world_from_imu.rotation * nalgebra::UnitQuaternion::from_scaled_axis(turn * 0.5);
        let force = middle.inverse() * (acceleration + Vector3::z() * GRAVITY_MPS2);
        let mut bias = self.stream.child(0).at(0);
        let mut noise = self.stream.at((stamp - Time::SIMULATION_START).nanos() as u64);
        let root_rate = seconds.recip().sqrt();
        let mut draw = |bias_sigma: f64, noise_density: f64| {
            Vector3::from_fn(|_, _| bias.normal() * bias_sigma + noise.normal() * noise_density * root_rate)
        };
        let force_error = draw(self.spec.force_bias_mps2, self.spec.force_noise_mps2_per_sqrt_hz);
        let rate_error = draw(self.spec.rate_bias_radps, self.spec.rate_noise_radps_per_sqrt_hz);
        let rate_radps = self
            .filtered
            .as_ref()
            .map_or(turn / seconds, |filtered| self.base_from_imu.rotation.inverse() * filtered.rate_radps);
        Some(Imu { stamp, specific_force_mps2: force + force_error, rate_radps: rate_radps + rate_error })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;

    fn exact() -> ImuSpec {
        ImuSpec {
            force_noise_mps2_per_sqrt_hz: 0.0,
            rate_noise_radps_per_sqrt_hz: 0.0,
            force_bias_mps2: 0.0,
            rate_bias_radps: 0.0,
            ..ImuSpec::default()
        }
    }

    #[test]
    fn at_rest_the_sensor_feels_gravity_upward_and_on_a_circle_the_pull_inward() {
        let period = Span::from_millis(1);
        let arm = Pose::translation(0.0, 0.0, 0.0);
        let mut sensor = InertialSensor::new(&exact(), period, arm, Seed(1).stream("imu"));
        let (radius, rate): (f64, f64) = (2.0, 0.8);
        let mut last = None;
        for tick in 0..50 {
            let angle = rate * f64::from(tick) * 1e-3;
            let pose = Pose::new(
                Vector3::new(radius * angle.cos(), radius * angle.sin(), 0.0),
                Vector3::z() * (angle + std::f64::consts::FRAC_PI_2),
            );
            let velocity = Vector3::new(-angle.sin(), angle.cos(), 0.0) * radius * rate;
            let stamp = Time::SIMULATION_START + period * i64::from(tick);
            last = sensor.sample(stamp, &pose, &velocity, &(Vector3::z() * rate));
        }
        let sample = last.unwrap();
        let wanted = Vector3::new(0.0, radius * rate * rate, GRAVITY_MPS2);
        assert!((sample.specific_force_mps2 - wanted).norm() < 1e-6, "{:?}", sample.specific_force_mps2);
        assert!((sample.rate_radps - Vector3::z() * rate).norm() < 1e-9);
    }

    #[test]
    fn an_impulse_is_felt_whole_with_a_bandwidth_and_without() {
        // 0.2 m/s upward within one tick, in the middle of a period of 2 ms.
        let (tick, period) = (Span::from_millis(1), Span::from_millis(2));
        for bandwidth_hz in [None, Some(150.0)] {
            let spec = ImuSpec { bandwidth_hz, ..exact() };
            let mut sensor = InertialSensor::new(&spec, period, Pose::identity(), Seed(1).stream("imu"));
            let (mut felt_mps, mut most_mps2) = (0.0, 0.0_f64);
            for n in 0..200 {
                let velocity = Vector3::z() * if n >= 51 { 0.2 } else { 0.0 };
                sensor.feel(tick, &Pose::identity(), &velocity, &Vector3::zeros());
                let stamp = Time::SIMULATION_START + tick * n;
                if n % 2 == 0
                    && let Some(sample) =
                        sensor.sample(stamp, &Pose::identity(), &velocity, &Vector3::zeros())
                {
                    let az = sample.specific_force_mps2.z - GRAVITY_MPS2;
                    felt_mps += az * period.seconds();
                    most_mps2 = most_mps2.max(az);
                }
            }
            assert!((felt_mps - 0.2).abs() < 1e-6, "{bandwidth_hz:?}: {felt_mps} m/s");
            // All of it within one period, or spread over the filter's own time.
            let wanted = if bandwidth_hz.is_some() { 30.0..90.0 } else { 99.9..100.1 };
            assert!(wanted.contains(&most_mps2), "{bandwidth_hz:?}: {most_mps2} m/s2");
        }
    }
}
