//! The kinematic trot: a floating trunk that follows its command, the ground under its feet, and its own stride.
//!
//! Not physics: no force balance, no fall, no slip. The phase-locked part and the impacts have the sizes that a physics
//! prototype showed. Every velocity is the analytic derivative of its pose.

use super::legs::Legs;
use super::planar::{Planar, Scatter, rotated};
use super::shaker::{Beat, Shaker};
use super::suspension::Suspension;
use super::{Command, Ground, TrotSettings, TrunkMotion, TrunkState};
use crate::go1;
use arborloop_base::{Pose, Pose2, Seed, Span, Stream, planar};
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector2, Vector3};

/// Commands below this stand still: m/s and rad/s.
const STILL: f64 = 1e-3;
/// The gait stops below this pace of the feet, m/s.
const STOPPING_MPS: f64 = 0.01;

/// A Go1 that trots by kinematics.
#[derive(Debug, Clone)]
pub struct KinematicTrot {
    settings: TrotSettings,
    tick_s: f64,
    strides: Stream,
    walking: bool,
    stride: u64,
    phase: f64,
    planar: Planar,
    legs: Legs,
    suspension: Suspension,
    shake: Shaker,
    state: TrunkState,
}

impl KinematicTrot {
    /// Stands at `start` (world), all feet on the ground, ready to take ticks of one length.
    ///
    /// # Panics
    /// When the settings do not pass [`TrotSettings::check`], the tick is not positive, or `start` is not finite.
    pub fn new(settings: TrotSettings, start: Pose2, tick: Span, ground: &dyn Ground, seed: Seed) -> Self {
        if let Err(error) = settings.check() {
            panic!("a trot is built from checked settings, but {error}");
        }
        assert!(tick > Span::ZERO, "a tick is longer than nothing, not {tick}");
        let finite =
            start.translation.vector.iter().all(|n| n.is_finite()) && start.rotation.angle().is_finite();
        assert!(finite, "a trot starts somewhere, not at {start}");
        let tick_s = tick.seconds();
        let planar = Planar::standing(&start);
        let legs = Legs::standing(&planar, ground);
        let suspension = Suspension::settled(&legs, &planar, &settings, tick_s);
        let shake = Shaker::new(&settings, seed, tick_s);
        let mut trot = KinematicTrot {
            tick_s,
            strides: seed.stream("robot/trot/stride"),
            walking: false,
            stride: 0,
            phase: 0.0,
            state: TrunkState {
                world_from_base: Pose::identity(),
                linear_mps: Vector3::zeros(),
                angular_radps: Vector3::zeros(),
                phase: 0.0,
                stance: [true; 4],
                feet_world: legs.feet,
                joint_angles_rad: [0.0; 12],
                loads: None,
                rolled: None,
            },
            planar,
            legs,
            suspension,
            shake,
            settings,
        };
        trot.compose();
        trot
    }

    /// Moves the stride on and the feet with it; the gait stops where both diagonals are down.
    fn step(&mut self, still: bool, ground: &dyn Ground) {
        if !self.walking {
            return;
        }
        self.phase += self.tick_s / self.settings.period_s;
        if self.phase >= 1.0 {
            self.phase -= 1.0;
            self.stride += 1;
        }
        let landed = self.legs.advance(self.phase, &self.planar, &self.settings, ground);
        for leg in (0..4).filter(|leg| landed[*leg]) {
            self.shake.land(leg, &self.settings, self.stride);
        }
        let both_down = landed.contains(&true);
        if still && both_down && self.shake.is_quiet() && self.planar.pace_mps() < STOPPING_MPS {
            self.walking = false;
            self.legs.stance = [true; 4];
            self.legs.feet = self.legs.footholds;
        }
    }

    /// Writes the state from its parts.
    fn compose(&mut self) {
        let phase_rate = if self.walking { 1.0 / self.settings.period_s } else { 0.0 };
        let shaken = self.shake.at(self.phase, phase_rate, &self.settings);
        let planar = &self.planar;
        let sway = rotated(Vector2::new(shaken.ahead.x, shaken.left.x), planar.yaw_rad);
        // The sway moves sideways and is carried around by the turn.
        let sway_rate = Vector2::new(
            shaken.ahead.rate - planar.turn_radps * shaken.left.x,
            shaken.left.rate + planar.turn_radps * shaken.ahead.x,
        );
        let sway_rate = rotated(sway_rate, planar.yaw_rad);
        let place = planar.place + sway;
        let velocity = planar.velocity_mps() + sway_rate;
        let roll = self.suspension.roll.x + shaken.roll.x;
        let pitch = self.suspension.pitch.x + shaken.pitch.x;
        let yaw = planar.yaw_rad + shaken.yaw.x;
        let world_from_base = Pose::from_parts(
            Translation3::new(place.x, place.y, self.suspension.height.x + shaken.up.x),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        );
        let rates = Vector3::new(
            self.suspension.roll.rate + shaken.roll.rate,
            self.suspension.pitch.rate + shaken.pitch.rate,
            planar.turn_radps + shaken.yaw.rate,
        );
        let mut joint_angles_rad = [0.0; 12];
        for (leg, foot) in self.legs.feet.iter().enumerate() {
            let in_base = world_from_base.inverse_transform_point(foot);
            joint_angles_rad[3 * leg..3 * leg + 3].copy_from_slice(&go1::angles(leg, &in_base));
        }
        self.state = TrunkState {
            world_from_base,
            linear_mps: Vector3::new(velocity.x, velocity.y, self.suspension.height.rate + shaken.up.rate),
            angular_radps: body_rates(roll, pitch, rates),
            phase: self.phase,
            stance: self.legs.stance,
            feet_world: self.legs.feet,
            joint_angles_rad,
            loads: None,
            rolled: None,
        };
    }
}

impl TrunkMotion for KinematicTrot {
    fn advance(&mut self, command: &Command, ground: &dyn Ground) -> &TrunkState {
        let finite = command.forward_mps.is_finite() && command.turn_radps.is_finite();
        let still = !finite || (command.forward_mps.abs() < STILL && command.turn_radps.abs() < STILL);
        let command = if still { Command::default() } else { *command };
        self.walking |= !still;
        let scatter = Scatter::of_stride(&self.settings, self.strides, self.stride);
        self.planar.advance(&command, &scatter, &self.settings, self.tick_s);
        self.step(still, ground);
        self.suspension.advance(&self.legs, &self.planar, &self.settings, self.tick_s);
        let pace_mps = if self.walking { self.planar.pace_mps() } else { 0.0 };
        let feet: [Point3<f64>; 4] = std::array::from_fn(|leg| {
            self.state.world_from_base.inverse_transform_point(&self.legs.feet[leg])
        });
        let beat = Beat { phase: self.phase, stride: self.stride, pace_mps };
        self.shake.advance(&beat, &self.planar, &feet, &self.legs.footholds, &self.settings);
        self.compose();
        &self.state
    }

    fn carry(&mut self, by: &Pose2, ground: &dyn Ground) {
        let base = planar(&self.state.world_from_base);
        let moved = base * by * base.inverse();
        let (legs, place) = (self.legs.clone(), self.planar.place);
        self.planar.carry(&moved);
        self.legs.carry(&moved, ground);
        self.suspension.carry(&legs, place, &self.legs, &self.planar, moved.rotation.angle());
        self.compose();
    }

    fn state(&self) -> &TrunkState {
        &self.state
    }
}

/// Turn rate in the body's own axes from the rates of roll, pitch and yaw (ZYX).
fn body_rates(roll: f64, pitch: f64, rates: Vector3<f64>) -> Vector3<f64> {
    let ((sin_roll, cos_roll), (sin_pitch, cos_pitch)) = (roll.sin_cos(), pitch.sin_cos());
    Vector3::new(
        rates.x - rates.z * sin_pitch,
        rates.y * cos_roll + rates.z * cos_pitch * sin_roll,
        -rates.y * sin_roll + rates.z * cos_pitch * cos_roll,
    )
}
