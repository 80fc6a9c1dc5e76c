//! From a command to the speed and the bearing of each wheel.

use super::{WheelSettings, Wheeled};
use crate::gait::Command;
use arborloop_base::wrap_angle;
use nalgebra::{Point2, Vector2};
use std::f64::consts::PI;

/// A wheel that is to move slower than this keeps its bearing, m/s.
const STILL_MPS: f64 = 1e-3;
/// A wheel this far off its bearing does not push yet, radians; assumed.
const ASTRAY_RAD: f64 = 0.5;

/// Limits commands and shares them among the wheels.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    settings: WheelSettings,
    wheels: [Rolling; 4],
    track_m: f64,
    steers: bool,
    tick_s: f64,
    wanted: Command,
    bearings_rad: [f64; 4],
}

/// What is to be known of a wheel for driving it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rolling {
    /// Ahead of and to the left of the middle between the wheels, meters.
    place: Point2<f64>,
    radius_m: f64,
    speed_radps_max: f64,
    bearings_rad: [f64; 2],
    turning_radps_max: f64,
}

/// What the wheels are to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelTargets {
    /// Speed about the axle, rad/s, forward positive.
    pub rates_radps: [f64; 4],
    /// Bearing, radians, counter-clockwise from ahead.
    pub bearings_rad: [f64; 4],
}

impl Drive {
    /// Of a robot that stands, for ticks of one length.
    pub fn new(robot: &Wheeled, settings: &WheelSettings, tick_s: f64) -> Self {
        let middle = robot.wheels.iter().map(|wheel| wheel.center.coords.xy()).sum::<Vector2<f64>>() / 4.0;
        let wheels = robot.wheels.each_ref().map(|wheel| {
            let steer = wheel.steer.as_ref().and_then(|joint| joint.limits);
            Rolling {
                place: wheel.center.xy() - middle,
                radius_m: wheel.radius_m,
                speed_radps_max: wheel.roll.limits.map_or(f64::INFINITY, |limits| limits.speed),
                bearings_rad: steer.map_or([0.0; 2], |limits| [limits.low, limits.high]),
                turning_radps_max: steer.map_or(0.0, |limits| limits.speed),
            }
        });
        Drive {
            settings: settings.clone(),
            wheels,
            track_m: robot.track_m(),
            steers: robot.steers(),
            tick_s,
            wanted: Command::default(),
            bearings_rad: [0.0; 4],
        }
    }

    /// The command after the limits on it and on its change.
    pub fn wanted(&self) -> Command {
        self.wanted
    }

    /// One tick under a command; `steered_rad` is where the wheels bear now.
    pub fn step(&mut self, command: &Command, steered_rad: &[f64; 4]) -> WheelTargets {
        self.limit(command);
        let mut targets = if self.steers { self.steer(steered_rad) } else { self.skid() };
        // All wheels slow down alike, so that the way keeps its shape.
        let share = |n: usize| {
            let most = self.wheels[n].speed_radps_max;
            if targets.rates_radps[n].abs() > most { most / targets.rates_radps[n].abs() } else { 1.0 }
        };
        let least = (0..4).map(share).fold(1.0, f64::min);
        targets.rates_radps = targets.rates_radps.map(|rate| rate * least);
        targets
    }

    fn limit(&mut self, command: &Command) {
        let finite = command.forward_mps.is_finite() && command.turn_radps.is_finite();
        let command = if finite { *command } else { Command::default() };
        let settings = &self.settings;
        let toward = |from: f64, to: f64, most: f64, rate: f64| {
            from + (to.clamp(-most, most) - from).clamp(-rate * self.tick_s, rate * self.tick_s)
        };
        let (speed, turn) = (settings.speed_mps_max, settings.turn_radps_max);
        self.wanted = Command {
            forward_mps: toward(
                self.wanted.forward_mps,
                command.forward_mps,
                speed,
                settings.acceleration_mps2_max,
            ),
            turn_radps: toward(
                self.wanted.turn_radps,
                command.turn_radps,
                turn,
                settings.turn_acceleration_radps2_max,
            ),
        };
    }

    /// Left against right, by the wider track that skidding makes.
    fn skid(&self) -> WheelTargets {
        let half_m = 0.5 * self.settings.track_ratio * self.track_m;
        let rates_radps = self.wheels.map(|wheel| {
            let side = wheel.place.y.signum();
            (self.wanted.forward_mps - self.wanted.turn_radps * half_m * side) / wheel.radius_m
        });
        WheelTargets { rates_radps, bearings_rad: [0.0; 4] }
    }

    /// Each wheel along the way of its own place; the shorter turn of two, forward or backward.
    fn steer(&mut self, steered_rad: &[f64; 4]) -> WheelTargets {
        let mut rates_radps = [0.0; 4];
        let mut waits = false;
        for (n, wheel) in self.wheels.iter().enumerate() {
            let Command { forward_mps, turn_radps } = self.wanted;
            let way = Vector2::new(forward_mps - turn_radps * wheel.place.y, turn_radps * wheel.place.x);
            let speed_mps = way.norm();
            if speed_mps < STILL_MPS {
                continue;
            }
            let ahead_rad = way.y.atan2(way.x);
            let ways = [(ahead_rad, 1.0), (wrap_angle(ahead_rad + PI), -1.0)];
            let [low, high] = wheel.bearings_rad;
            let turn_to = |bearing: f64| (bearing - steered_rad[n]).abs();
            let best = ways
                .into_iter()
                .filter(|(bearing, _)| (low..=high).contains(bearing))
                .min_by(|one, other| turn_to(one.0).total_cmp(&turn_to(other.0)));
            let (bearing_rad, sense) = best.unwrap_or((self.bearings_rad[n], 0.0));
            let most = wheel.turning_radps_max * self.tick_s;
            self.bearings_rad[n] += (bearing_rad - self.bearings_rad[n]).clamp(-most, most);
            let astray_rad = turn_to(bearing_rad);
            // One wheel that waits for its bearing holds the others back.
            waits |= astray_rad > ASTRAY_RAD;
            rates_radps[n] = sense * astray_rad.cos() * speed_mps / wheel.radius_m;
        }
        if waits {
            rates_radps = [0.0; 4];
        }
        WheelTargets { rates_radps, bearings_rad: self.bearings_rad }
    }
}
