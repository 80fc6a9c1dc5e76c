//! The balancing walk: from what a robot senses to the torques of its joints, every tick. Pure mathematics, no engine.
//!
//! A clock times a trot; feet in the air follow paths to footholds after Raibert; feet on the ground share a wrench
//! that keeps the trunk over them. It knows contacts, joints and its own belief of its motion, never the terrain.

mod body;
mod error;
mod forces;
mod leg;
mod odometry;
mod plane;
mod settings;
mod stepping;
mod swing;
mod wrench;

pub use body::{Body, Motor};
pub use error::BodyError;
pub use settings::WalkSettings;

use super::planar::NOMINAL_MPS;
use super::{Carry, Command, TrotSettings};
use crate::go1::{FOOT_Y_M, HIP_X_M};
use arborloop_base::{Pose, wrap_angle, yaw_of};
use forces::{Distribution, Footing};
use leg::LegState;
use nalgebra::{Point3, Vector2, Vector3, Vector6};
pub(crate) use plane::FootPlane;
use stepping::{Cue, Stepping};
use wrench::{GRAVITY_MPS2, heading, wanted_wrench};

/// Phase by which each leg (FR, FL, RR, RL) is ahead: diagonals together (unitree_guide).
const PHASE_AHEAD: [f64; 4] = [0.0, 0.5, 0.5, 0.0];
/// Commands below this stand still: m/s and rad/s.
const STILL: f64 = 1e-3;
/// The walk stops below this speed of the trunk, m/s; assumed.
const STOPPING_MPS: f64 = 0.12;
/// A standing trunk that moves faster than this steps to catch itself, m/s; assumed.
const CATCHING_MPS: f64 = 0.3;
/// How far the place and heading asked for may run ahead of the trunk, meters and radians; assumed.
const LEASH_M: f64 = 0.05;
const LEASH_RAD: f64 = 0.15;
/// Most that a single foot is asked to carry, N; assumed: twice the robot.
const LOAD_N_MAX: f64 = 250.0;
/// How far a step may be put off its neutral place, meters; assumed: a third of the leg.
const REACH_M: f64 = 0.14;
/// How much higher a foot is swung per roughness of the ground beyond what any field has, and at the most; assumed.
const CARE: f64 = 5.0;
const CARELESS_M: f64 = 0.007;
const CARE_M_MAX: f64 = 0.03;
/// Damping ratio of a swinging foot's tracking; assumed.
const SWING_DAMPING_RATIO: f64 = 0.8;
/// Time constant of the plane under the feet, seconds; assumed: a quarter of a stride.
const PLANE_LAG_S: f64 = 0.1;

/// What a walking robot knows at one tick. The odometry frame is any that is level and moves slowly.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensed {
    /// Where the robot believes its base to be.
    pub odom_from_base: Pose,
    /// Velocity of the base's origin, odometry axes, m/s.
    pub linear_mps: Vector3<f64>,
    /// Turn rate, base axes, rad/s.
    pub angular_radps: Vector3<f64>,
    /// Joint angles, leg by leg (hip, thigh, calf), radians.
    pub joint_angles_rad: [f64; 12],
    /// Joint rates in the same order, rad/s.
    pub joint_rates_radps: [f64; 12],
    /// Force on each foot's sensor, N.
    pub foot_forces_n: [f64; 4],
}

/// The command after its limits, and where it has led so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wanted {
    pub(crate) command: Command,
    pub(crate) place: Vector2<f64>,
    pub(crate) yaw_rad: f64,
}

/// The controller of a balancing walk.
#[derive(Debug, Clone)]
pub struct Walker {
    body: Body,
    settings: TrotSettings,
    tick_s: f64,
    walking: bool,
    phase: f64,
    wanted: Wanted,
    plane: FootPlane,
    legs: [Stepping; 4],
    distribution: Distribution,
}

/// One leg's motion, odometry axes.
struct Foot {
    angles_rad: [f64; 3],
    rates: Vector3<f64>,
    state: LegState,
    at: Point3<f64>,
    velocity_mps: Vector3<f64>,
}

impl Walker {
    /// Takes over a robot that stands on four feet.
    ///
    /// # Panics
    /// When the settings do not pass [`TrotSettings::check`] or the tick is not positive.
    pub fn new(body: Body, settings: TrotSettings, sensed: &Sensed, tick_s: f64) -> Self {
        if let Err(error) = settings.check() {
            panic!("a walk is built from checked settings, but {error}");
        }
        assert!(tick_s > 0.0, "a tick is longer than nothing, not {tick_s} s");
        let place = sensed.odom_from_base.translation.vector.xy();
        let feet: [Point3<f64>; 4] =
            std::array::from_fn(|leg| sensed.odom_from_base * body.legs[leg].at(sensed.angles_rad(leg)).foot);
        Walker {
            distribution: Distribution::new(settings.physics.friction_believed),
            walking: false,
            phase: 0.0,
            wanted: Wanted { command: Command::default(), place, yaw_rad: yaw_of(&sensed.odom_from_base) },
            plane: FootPlane::through(&feet),
            legs: feet.map(Stepping::standing),
            body,
            settings,
            tick_s,
        }
    }

    /// The body that is controlled.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Stride phase in [0, 1).
    pub fn phase(&self) -> f64 {
        self.phase
    }

    /// Moves what it remembers of the ground along with a body that is carried off: what it then feels is the tilt.
    pub fn carry(&mut self, carry: &Carry) {
        let moved = carry.world_from_world();
        let place = self.wanted.place;
        let wanted = moved * Point3::new(place.x, place.y, self.plane.height_m(place));
        self.wanted.place = wanted.coords.xy();
        self.wanted.yaw_rad += carry.turned_rad();
        let upright = self.plane.upright();
        self.plane.carry(&moved);
        self.distribution.turn(&(self.plane.upright() * moved.rotation * upright.inverse()));
        self.legs.iter_mut().for_each(|leg| leg.carry(&moved));
    }

    /// One tick: the torques of the joints, N m, leg by leg. Commands that are not finite stand still.
    pub fn step(&mut self, command: &Command, sensed: &Sensed) -> [f64; 12] {
        let feet: [Foot; 4] = std::array::from_fn(|leg| self.foot(leg, sensed));
        self.follow_command(command, sensed);
        self.keep_time(sensed, &feet);
        let standing: [Point3<f64>; 4] = std::array::from_fn(|leg| {
            if self.legs[leg].carries() { feet[leg].at } else { self.legs[leg].foothold }
        });
        self.plane.follow(&standing, 1.0 - (-self.tick_s / PLANE_LAG_S).exp());

        let forces = self.share_load(sensed, &feet);
        let to_base = sensed.odom_from_base.rotation.inverse();
        let down = to_base * Vector3::new(0.0, 0.0, -GRAVITY_MPS2);
        let mut torques = [0.0; 12];
        for (leg, foot) in feet.iter().enumerate() {
            let held = -(foot.state.moment * down);
            let torque = held
                + if self.legs[leg].carries() {
                    -(foot.state.jacobian.transpose() * (to_base * forces[leg]))
                } else {
                    self.swung(leg, foot, sensed)
                };
            torques[3 * leg..3 * leg + 3].copy_from_slice(torque.as_slice());
        }
        torques
    }

    fn foot(&self, leg: usize, sensed: &Sensed) -> Foot {
        let angles_rad = sensed.angles_rad(leg);
        let rates = Vector3::from_fn(|joint, _| sensed.joint_rates_radps[3 * leg + joint]);
        let state = self.body.legs[leg].at(angles_rad);
        let relative = sensed.angular_radps.cross(&state.foot.coords) + state.jacobian * rates;
        Foot {
            at: sensed.odom_from_base * state.foot,
            velocity_mps: sensed.linear_mps + sensed.odom_from_base.rotation * relative,
            angles_rad,
            rates,
            state,
        }
    }

    /// Limits the command and moves the place asked for along with it, on a short leash to the trunk.
    fn follow_command(&mut self, command: &Command, sensed: &Sensed) {
        let settings = &self.settings;
        let finite = command.forward_mps.is_finite() && command.turn_radps.is_finite();
        let command = if finite { *command } else { Command::default() };
        let toward = |from: f64, to: f64, most: f64, rate: f64| {
            from + (to.clamp(-most, most) - from).clamp(-rate * self.tick_s, rate * self.tick_s)
        };
        let before = self.wanted.command;
        let (speed, turn) = (settings.speed_mps_max, settings.turn_radps_max);
        let now = Command {
            forward_mps: toward(
                before.forward_mps,
                command.forward_mps,
                speed,
                settings.acceleration_mps2_max,
            ),
            turn_radps: toward(
                before.turn_radps,
                command.turn_radps,
                turn,
                settings.turn_acceleration_radps2_max,
            ),
        };
        let yaw_rad = yaw_of(&sensed.odom_from_base);
        let place = sensed.odom_from_base.translation.vector.xy();
        let moved = self.wanted.place + heading(yaw_rad) * now.forward_mps * self.tick_s;
        let turned = wrap_angle(self.wanted.yaw_rad + now.turn_radps * self.tick_s - yaw_rad);
        self.wanted = Wanted {
            command: now,
            place: place + (moved - place).cap_magnitude(LEASH_M),
            yaw_rad: yaw_rad + turned.clamp(-LEASH_RAD, LEASH_RAD),
        };
    }

    /// Moves the stride on; feet lift when their time has come and carry again when they touch the ground.
    fn keep_time(&mut self, sensed: &Sensed, feet: &[Foot; 4]) {
        let wanted = self.wanted.command;
        let still = wanted.forward_mps.abs() < STILL && wanted.turn_radps.abs() < STILL;
        let speed_mps = sensed.linear_mps.xy().norm();
        if self.walking {
            self.phase += self.tick_s / self.settings.period_s;
            if self.phase >= 1.0 {
                self.phase -= 1.0;
            }
            let all_down = self.legs.iter().all(Stepping::carries);
            if still && all_down && speed_mps < STOPPING_MPS {
                self.walking = false;
                self.stand_over(feet);
            }
        } else if !still || speed_mps > CATCHING_MPS {
            self.walking = true;
            self.phase = 0.0;
        }
        let carrying = self.legs.map(|leg| leg.carries());
        for (leg, foot) in feet.iter().enumerate() {
            let (stands, share) = self.timing(leg);
            // The legs of a diagonal are each other's mirror: 0 and 3, 1 and 2.
            let relieved =
                (0..4).filter(|other| *other != leg && *other != 3 - leg).all(|other| carrying[other]);
            let cue = Cue {
                stands,
                share,
                left_s: self.left_s(leg),
                relieved,
                foot: foot.at,
                touches: sensed.foot_forces_n[leg] > self.settings.physics.contact_n,
            };
            self.legs[leg].advance(&cue, self.settings.physics.load_ramp_s, self.tick_s);
        }
    }

    /// The place asked for becomes the middle of the feet: standing is balancing over them.
    fn stand_over(&mut self, feet: &[Foot; 4]) {
        let middle = feet.iter().map(|foot| foot.at.coords.xy()).sum::<Vector2<f64>>() / 4.0;
        self.wanted.place = middle;
    }

    /// Whether a leg's time is to stand, and the share of its swing that is over (above one: late).
    fn timing(&self, leg: usize) -> (bool, f64) {
        if !self.walking {
            return (true, 1.0);
        }
        let phase = (self.phase + PHASE_AHEAD[leg]).fract();
        let duty = self.settings.duty_ratio;
        if phase < duty { (true, 1.0 + phase / (1.0 - duty)) } else { (false, (phase - duty) / (1.0 - duty)) }
    }

    /// Forces of the ground on the feet that carry, odometry axes, N.
    fn share_load(&mut self, sensed: &Sensed, feet: &[Foot; 4]) -> [Vector3<f64>; 4] {
        let pose = &sensed.odom_from_base;
        let center = pose * self.body.center_of_mass;
        // Friction holds against the ground, not against gravity: the cones stand on the plane under the feet.
        let plane_from_odom = self.plane.upright();
        let footings = std::array::from_fn(|leg| Footing {
            arm: plane_from_odom * (feet[leg].at - center),
            most_n: LOAD_N_MAX * self.legs[leg].load(),
        });
        let height_m = self.settings.stand_height_m;
        let wrench =
            wanted_wrench(&self.body, &self.settings.physics, height_m, sensed, &self.plane, &self.wanted);
        let turned = |row: usize| plane_from_odom * wrench.fixed_rows::<3>(row).into_owned();
        let (force, torque) = (turned(0), turned(3));
        let wrench = Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
        let odom_from_plane = plane_from_odom.inverse();
        self.distribution.share(&wrench, &footings).map(|force| odom_from_plane * force)
    }

    /// Time until a standing leg is to lift, seconds; without end while the robot stands or the leg swings.
    fn left_s(&self, leg: usize) -> f64 {
        let phase = (self.phase + PHASE_AHEAD[leg]).fract();
        let left_s = (self.settings.duty_ratio - phase) * self.settings.period_s;
        // A foot that touched down early has a whole stance before it.
        if self.walking && left_s >= 0.0 { left_s } else { f64::INFINITY }
    }

    /// Torques that move a swinging foot along its path, without what holds the leg's weight.
    fn swung(&self, leg: usize, foot: &Foot, sensed: &Sensed) -> Vector3<f64> {
        let physics = &self.settings.physics;
        let (_, share) = self.timing(leg);
        let swing_s = (1.0 - self.settings.duty_ratio) * self.settings.period_s;
        let to = self.next_foothold(leg, ((1.0 - share) * swing_s).max(0.0), sensed);
        // Who stumbles steps higher.
        let height_m =
            physics.swing_height_m + (CARE * (self.plane.roughness_m - CARELESS_M)).clamp(0.0, CARE_M_MAX);
        let touchdown_mps = physics.touchdown_mps * self.haste();
        let Some(aim) = self.legs[leg].aim(share, to, height_m, touchdown_mps, swing_s) else {
            return Vector3::zeros();
        };
        let w = physics.swing_radps;
        let pull = (aim.at - foot.at) * (w * w)
            + (aim.velocity_mps - foot.velocity_mps) * (2.0 * SWING_DAMPING_RATIO * w)
            + aim.acceleration_mps2;
        let wanted = sensed.odom_from_base.rotation.inverse() * pull
            - self.body.legs[leg].bias_mps2(&foot.state, foot.angles_rad, &foot.rates);
        // Operational space: the joint accelerations that accelerate the foot so, times the leg's inertia. A stretched
        // leg has no such accelerations; it is then pulled by a force instead.
        let joints = foot.state.jacobian.try_inverse().map(|inverse| inverse * wanted);
        match joints.filter(|joints| joints.iter().all(|a| a.is_finite())) {
            Some(joints) => foot.state.inertia * joints,
            None => foot.state.jacobian.transpose() * wanted * 0.2,
        }
    }

    /// How much harder than at 0.5 m/s a foot comes down: its last part is passed the faster, the wider the step.
    fn haste(&self) -> f64 {
        0.5 + 0.5 * self.wanted.command.forward_mps.abs() / NOMINAL_MPS
    }

    /// Raibert: under the hip in the middle of the stance to come, and farther along an excess of speed.
    fn next_foothold(&self, leg: usize, until_s: f64, sensed: &Sensed) -> Point3<f64> {
        let settings = &self.settings;
        let command = self.wanted.command;
        let yaw_rad = yaw_of(&sensed.odom_from_base) + command.turn_radps * until_s;
        let speed = sensed.linear_mps.xy();
        let excess = speed - heading(yaw_rad) * command.forward_mps;
        let stance_s = settings.duty_ratio * settings.period_s;
        // Around the center of mass: a diagonal that stands beside it tips the trunk, each the other way, into a roll.
        let center = self.body.center_of_mass;
        let (ahead, left) = neutral(leg);
        let (ahead, left) = (ahead + center.x, left + center.y);
        // Half the stance's turn: the foot is to be neutral in the middle of its stance.
        let middle = heading(yaw_rad + 0.5 * command.turn_radps * stance_s);
        let arm = middle * ahead + Vector2::new(-middle.y, middle.x) * left;
        let step = (speed * (0.5 * stance_s) + excess * settings.physics.step_gain_s).cap_magnitude(REACH_M);
        let place = sensed.odom_from_base.translation.vector.xy() + speed * until_s + arm + step;
        Point3::new(place.x, place.y, self.plane.height_m(place))
    }
}

impl Sensed {
    fn angles_rad(&self, leg: usize) -> [f64; 3] {
        std::array::from_fn(|joint| self.joint_angles_rad[3 * leg + joint])
    }
}

/// Where a foot stands under a body at rest, ahead and to the left of its middle, meters.
fn neutral(leg: usize) -> (f64, f64) {
    let front = if leg < 2 { HIP_X_M } else { -HIP_X_M };
    (front, if leg.is_multiple_of(2) { -FOOT_Y_M } else { FOOT_Y_M })
}
