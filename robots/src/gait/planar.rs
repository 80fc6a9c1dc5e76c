//! How a commanded speed and turn rate become motion over the ground: limited, lagging, and a little off.

use super::{Command, TrotSettings};
use arborloop_base::{Pose2, Stream, pose2};
use nalgebra::{Point2, Vector2};

/// The body's path over the ground, without the gait's own sway and yaw.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Planar {
    /// Place, world frame, meters.
    pub(crate) place: Vector2<f64>,
    /// Heading, radians, not wrapped.
    pub(crate) yaw_rad: f64,
    /// Speed ahead and to the left, m/s.
    pub(crate) speed_mps: Vector2<f64>,
    /// Turn rate, rad/s.
    pub(crate) turn_radps: f64,
    /// The command after the limits on its change.
    wanted: Command,
}

/// How this stride departs from its command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scatter {
    forward_gain: f64,
    turn_gain: f64,
    side_mps: f64,
    turn_radps: f64,
}

impl Scatter {
    /// The departures of one stride, from its own address.
    pub(crate) fn of_stride(settings: &TrotSettings, stream: Stream, stride: u64) -> Self {
        let mut draws = stream.at(stride);
        Scatter {
            forward_gain: 1.0 + settings.scatter_ratio * draws.normal(),
            turn_gain: 1.0 + settings.scatter_ratio * draws.normal(),
            side_mps: settings.drift_mps * draws.normal(),
            turn_radps: settings.drift_degps.to_radians() * draws.normal(),
        }
    }
}

/// The speed at which drifts and amplitudes are stated, m/s.
pub(crate) const NOMINAL_MPS: f64 = 0.5;

impl Planar {
    /// Standing at a place.
    pub(crate) fn standing(at: &Pose2) -> Self {
        Planar {
            place: at.translation.vector,
            yaw_rad: at.rotation.angle(),
            speed_mps: Vector2::zeros(),
            turn_radps: 0.0,
            wanted: Command::default(),
        }
    }

    /// One tick under a command that is finite.
    pub(crate) fn advance(
        &mut self,
        command: &Command,
        scatter: &Scatter,
        settings: &TrotSettings,
        tick_s: f64,
    ) {
        let toward = |from: f64, to: f64, most: f64| from + (to - from).clamp(-most * tick_s, most * tick_s);
        let limited = |value: f64, most: f64| value.clamp(-most, most);
        let forward = limited(command.forward_mps, settings.speed_mps_max);
        let turn = limited(command.turn_radps, settings.turn_radps_max);
        self.wanted = Command {
            forward_mps: toward(self.wanted.forward_mps, forward, settings.acceleration_mps2_max),
            turn_radps: toward(self.wanted.turn_radps, turn, settings.turn_acceleration_radps2_max),
        };
        let pace = (self.wanted.forward_mps / NOMINAL_MPS).abs();
        let target = Vector2::new(self.wanted.forward_mps * scatter.forward_gain, scatter.side_mps * pace);
        let target_turn = self.wanted.turn_radps * scatter.turn_gain + scatter.turn_radps * pace;
        let share = 1.0 - (-tick_s / settings.lag_s).exp();
        let (speed_before, turn_before) = (self.speed_mps, self.turn_radps);
        self.speed_mps += (target - self.speed_mps) * share;
        self.turn_radps += (target_turn - self.turn_radps) * share;

        // Trapezoid in both: the pose's central difference is the stated velocity to second order in the tick.
        let turned = 0.5 * (turn_before + self.turn_radps) * tick_s;
        let moved = 0.5 * (speed_before + self.speed_mps) * tick_s;
        self.place += rotated(moved, self.yaw_rad + 0.5 * turned);
        self.yaw_rad += turned;
    }

    /// Goes on from another place and heading, as fast as before.
    pub(crate) fn carry(&mut self, moved: &Pose2) {
        self.place = (moved * Point2::from(self.place)).coords;
        self.yaw_rad += moved.rotation.angle();
    }

    /// Velocity over the ground, world frame, m/s.
    pub(crate) fn velocity_mps(&self) -> Vector2<f64> {
        rotated(self.speed_mps, self.yaw_rad)
    }

    /// How fast the feet have to move, m/s: the speed, and the turn at the feet's distance from the middle.
    pub(crate) fn pace_mps(&self) -> f64 {
        let lever_m = crate::go1::HIP_X_M.hypot(crate::go1::FOOT_Y_M);
        self.speed_mps.norm() + lever_m * self.turn_radps.abs()
    }

    /// Where the body will be if nothing changes for a while.
    pub(crate) fn after(&self, seconds: f64) -> Pose2 {
        let turned = self.turn_radps * seconds;
        let place = self.place + rotated(self.speed_mps * seconds, self.yaw_rad + 0.5 * turned);
        pose2(place.x, place.y, self.yaw_rad + turned)
    }
}

/// A vector of the body's frame turned into the world's.
pub(crate) fn rotated(vector: Vector2<f64>, yaw_rad: f64) -> Vector2<f64> {
    let (sin, cos) = yaw_rad.sin_cos();
    Vector2::new(cos * vector.x - sin * vector.y, sin * vector.x + cos * vector.y)
}
