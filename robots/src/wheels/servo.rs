//! A wheel's speed loop and a leg's steering loop: torques inside what their motors give.

use super::{Wheel, WheelSettings};
use std::f64::consts::TAU;

/// Share of the speed loop's frequency at which its integral works; assumed.
const INTEGRAL_SHARE: f64 = 0.25;
/// Natural frequency of the steering, hertz, and its damping ratio; assumed.
const STEERING_HZ: f64 = 5.0;
const STEERING_DAMPING_RATIO: f64 = 1.0;

/// The loops of one wheel.
#[derive(Debug, Clone, PartialEq)]
pub struct Servo {
    tick_s: f64,
    gain_nms: f64,
    integral_nm: f64,
    integral_per_s: f64,
    torque_nm_max: f64,
    steering_nm: f64,
    steering_nms: f64,
    steering_nm_max: f64,
}

impl Servo {
    /// Of a wheel that drives a share of the robot's mass, kg.
    pub fn new(wheel: &Wheel, settings: &WheelSettings, driven_kg: f64, tick_s: f64) -> Self {
        let loop_radps = TAU * settings.servo_hz;
        let inertia = wheel.inertia_kgm2 + driven_kg * wheel.radius_m * wheel.radius_m;
        // A wheel in the air has its own inertia only: beyond a third of a tick's worth the loop would hunt.
        let gain_nms = (inertia * loop_radps).min(wheel.inertia_kgm2 / (3.0 * tick_s));
        let steering_radps = TAU * STEERING_HZ;
        let torque = |limits: Option<crate::JointLimits>| limits.map_or(0.0, |limits| limits.effort);
        Servo {
            tick_s,
            gain_nms,
            integral_nm: 0.0,
            integral_per_s: INTEGRAL_SHARE * loop_radps,
            torque_nm_max: torque(wheel.roll.limits),
            steering_nm: wheel.steered_kgm2 * steering_radps * steering_radps,
            steering_nms: 2.0 * STEERING_DAMPING_RATIO * wheel.steered_kgm2 * steering_radps,
            steering_nm_max: torque(wheel.steer.as_ref().and_then(|joint| joint.limits)),
        }
    }

    /// Torque on the axle, N m, for a wanted speed and the speed that the encoder tells, rad/s.
    pub fn roll_nm(&mut self, wanted_radps: f64, rate_radps: f64) -> f64 {
        let most = self.torque_nm_max;
        let error = wanted_radps - rate_radps;
        let asked = self.gain_nms * error + self.integral_nm;
        // A motor at its limit has nothing to add up.
        if asked.abs() < most || asked * error < 0.0 {
            self.integral_nm += self.gain_nms * error * self.integral_per_s * self.tick_s;
        }
        asked.clamp(-most, most)
    }

    /// Torque about the steering axis, N m, for a wanted bearing, radians.
    pub fn steer_nm(&self, wanted_rad: f64, bearing_rad: f64, rate_radps: f64) -> f64 {
        let asked = self.steering_nm * (wanted_rad - bearing_rad) - self.steering_nms * rate_radps;
        asked.clamp(-self.steering_nm_max, self.steering_nm_max)
    }
}
