//! The Go1 moved by physics: what it senses goes to its controller, the controller's torques to its body, every tick.

use super::plant::{Plant, PlantSpec, PlantState};
use arborloop_base::{Contact, Draws, Pose, Pose2, Seed, Span, Stream};
use arborloop_robots::{
    Body, Carry, Command, Fall, FallCause, Ground, Loads, Sensed, TrotSettings, TrunkMotion, TrunkState,
    Walker, go1,
};
use arborloop_worlds::{Terrain, World};
use nalgebra::{Point2, Point3, Rotation3, UnitQuaternion, Vector3};
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// A trunk whose origin is nearer to the ground than this lies on it, meters: half the trunk's height and a margin.
const LYING_M: f64 = 0.09;

/// A robot in the physics engine with its controller, behind the gait seam.
pub struct PhysicsGait {
    plant: Plant,
    walker: Walker,
    terrain: Terrain,
    settings: TrotSettings,
    tick: Span,
    ticks: u64,
    /// What the motors really give of what they are asked for.
    gains: [f64; 12],
    tilt_error: UnitQuaternion<f64>,
    senses: Stream,
    pushes: Stream,
    /// Torques on their way from the controller to the motors.
    delayed: VecDeque<[f64; 12]>,
    torques_nm: [f64; 12],
    state: TrunkState,
    fall: Option<Fall>,
}

impl PhysicsGait {
    /// Stands at `start` (world), all feet on the ground.
    ///
    /// # Panics
    /// When the settings do not pass [`TrotSettings::check`] or the tick is not positive.
    pub fn new(world: &World, settings: &TrotSettings, start: Pose2, tick: Span, seed: Seed) -> Self {
        let body = Body::go1_with(settings.physics.luggage_kg);
        let (world_from_base, angles_rad) = standing(&world.terrain, &start, settings.stand_height_m);
        let physics = &settings.physics;
        let spec = PlantSpec {
            tick_s: tick.seconds(),
            substeps: physics.substeps as usize,
            friction: physics.friction,
            rotors_kgm2: body.motors.map(|motor| motor.rotor_kgm2),
            payload: go1::payload().plus(&go1::luggage(physics.luggage_kg)),
        };
        let plant = Plant::new(world, &go1::go1(), &spec, &world_from_base, &angles_rad);
        let motors = seed.stream("robot/walk/motor");
        let mut tilt = seed.stream("robot/walk/tilt").at(0);
        let tilt_rad = physics.tilt_error_deg.to_radians();
        let tilt_error = UnitQuaternion::from_scaled_axis(Vector3::new(
            tilt.normal() * tilt_rad,
            tilt.normal() * tilt_rad,
            0.0,
        ));
        let now = plant.state();
        let delay = (physics.delay_s / tick.seconds()).round() as usize;
        PhysicsGait {
            walker: Walker::new(body, settings.clone(), &exact(&now), tick.seconds()),
            terrain: world.terrain.clone(),
            tick,
            ticks: 0,
            gains: std::array::from_fn(|joint| {
                1.0 + physics.torque_error_ratio * motors.at(joint as u64).normal()
            }),
            tilt_error,
            senses: seed.stream("robot/walk/sense"),
            pushes: seed.stream("robot/walk/push"),
            delayed: VecDeque::from(vec![[0.0; 12]; delay]),
            torques_nm: [0.0; 12],
            state: told(&now, 0.0, [0.0; 12], physics.contact_n),
            settings: settings.clone(),
            plant,
            fall: None,
        }
    }

    /// Solid things that the robot touches; the ground is none of them; sorted.
    pub fn touching(&self) -> Vec<Contact> {
        self.plant.touching()
    }

    /// The controller's view of a state: exact, or with the errors that the settings ask for.
    fn sense(&self, now: &PlantState) -> Sensed {
        let physics = &self.settings.physics;
        let mut sensed = exact(now);
        let mut draws = self.senses.at(self.ticks);
        let mut error = |sigma: f64| if sigma > 0.0 { draws.normal() * sigma } else { 0.0 };
        for joint in 0..12 {
            sensed.joint_angles_rad[joint] += error(physics.joint_noise_rad);
            sensed.joint_rates_radps[joint] += error(physics.joint_rate_noise_radps);
        }
        sensed.linear_mps += Vector3::from_fn(|_, _| error(physics.velocity_noise_mps));
        sensed.odom_from_base.rotation *= self.tilt_error;
        sensed
    }

    /// From what is asked for to what the motors give: late, a little off, and inside their envelope, which comes last.
    fn drive(&mut self, asked: [f64; 12], now: &PlantState) {
        self.delayed.push_back(asked);
        let asked = self.delayed.pop_front().unwrap_or(asked);
        let motors = &self.walker.body().motors;
        self.torques_nm = std::array::from_fn(|joint| {
            motors[joint % 3].torque_nm(asked[joint] * self.gains[joint], now.joint_rates_radps[joint])
        });
    }

    /// A push from the side now and then, from its own address.
    fn disturb(&mut self) {
        let physics = &self.settings.physics;
        let every = (physics.push_every_s / self.tick.seconds()).round() as u64;
        if physics.push_mps > 0.0 && self.ticks > 0 && self.ticks.is_multiple_of(every.max(1)) {
            let mut draws: Draws = self.pushes.at(self.ticks / every.max(1));
            let bearing = draws.within(0.0, TAU);
            self.plant.push(&(Vector3::new(bearing.cos(), bearing.sin(), 0.0) * physics.push_mps));
        }
    }

    fn fallen(&self, now: &PlantState) -> Option<FallCause> {
        let pose = &now.world_from_base;
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let sound = finite(pose.translation.vector.as_slice())
            && finite(pose.rotation.coords.as_slice())
            && finite(now.linear_mps.as_slice())
            && finite(now.angular_radps.as_slice())
            && finite(&now.joint_angles_rad)
            && finite(&now.joint_rates_radps);
        if !sound {
            return Some(FallCause::NotFinite);
        }
        let up = pose.rotation * Vector3::z();
        if up.z < self.settings.physics.fallen_deg.to_radians().cos() {
            return Some(FallCause::Tipped);
        }
        let at = pose.translation;
        (at.z - self.terrain.height_m(at.x, at.y) < LYING_M).then_some(FallCause::Collapsed)
    }
}

impl TrunkMotion for PhysicsGait {
    /// The ground is the world's own, which the engine holds already.
    fn advance(&mut self, command: &Command, _ground: &dyn Ground) -> &TrunkState {
        if self.fall.is_some() {
            return &self.state;
        }
        let before = self.plant.state();
        let sensed = self.sense(&before);
        let asked = self.walker.step(command, &sensed);
        self.drive(asked, &before);
        self.disturb();
        self.plant.step(&self.torques_nm);
        self.ticks += 1;
        let now = self.plant.state();
        if let Some(cause) = self.fallen(&now) {
            self.fall = Some(Fall { after: self.tick * self.ticks as i64, cause });
            if cause == FallCause::NotFinite {
                return &self.state;
            }
        }
        let contact_n = self.settings.physics.contact_n;
        self.state = told(&now, self.walker.phase(), self.torques_nm, contact_n);
        &self.state
    }

    fn carry(&mut self, by: &Pose2, ground: &dyn Ground) {
        if self.fall.is_some() {
            return;
        }
        let carry = Carry::of(&self.state, by, ground);
        self.plant.carry(&carry.world_from_world());
        self.walker.carry(&carry);
        self.state = self.state.carried(&carry);
    }

    fn state(&self) -> &TrunkState {
        &self.state
    }

    fn fall(&self) -> Option<Fall> {
        self.fall
    }
}

/// The base over four feet on the ground, parallel to the plane through them, and the joints that reach them.
fn standing(terrain: &Terrain, start: &Pose2, height_m: f64) -> (Pose, [f64; 12]) {
    let feet: [Point3<f64>; 4] = std::array::from_fn(|leg| {
        let ahead = if leg < 2 { go1::HIP_X_M } else { -go1::HIP_X_M };
        let left = if leg % 2 == 0 { -go1::FOOT_Y_M } else { go1::FOOT_Y_M };
        let place = start * Point2::new(ahead, left);
        let lift_m = go1::FOOT_RADIUS_M / terrain.normal(place.x, place.y).z;
        Point3::new(place.x, place.y, terrain.height_m(place.x, place.y) + lift_m)
    });
    let [fr, fl, rr, rl] = feet.map(|foot| foot.coords);
    let ahead = (fr + fl - rr - rl).normalize();
    let up = ahead.cross(&(fl + rl - fr - rr)).normalize();
    let axes = Rotation3::from_basis_unchecked(&[ahead, up.cross(&ahead), up]);
    let middle = (fr + fl + rr + rl) / 4.0;
    let origin = middle + Vector3::z() * (height_m - go1::FOOT_RADIUS_M);
    let world_from_base = Pose::from_parts(origin.into(), UnitQuaternion::from_rotation_matrix(&axes));
    let mut angles_rad = [0.0; 12];
    for (leg, foot) in feet.iter().enumerate() {
        let found = go1::angles(leg, &world_from_base.inverse_transform_point(foot));
        angles_rad[3 * leg..3 * leg + 3].copy_from_slice(&found);
    }
    (world_from_base, angles_rad)
}

/// What a robot with a perfect estimate of itself senses.
fn exact(now: &PlantState) -> Sensed {
    Sensed {
        odom_from_base: now.world_from_base,
        linear_mps: now.linear_mps,
        angular_radps: now.angular_radps,
        joint_angles_rad: now.joint_angles_rad,
        joint_rates_radps: now.joint_rates_radps,
        foot_forces_n: now.foot_forces_n.map(|force| force.norm()),
    }
}

fn told(now: &PlantState, phase: f64, torques_nm: [f64; 12], contact_n: f64) -> TrunkState {
    TrunkState {
        world_from_base: now.world_from_base,
        linear_mps: now.linear_mps,
        angular_radps: now.angular_radps,
        phase,
        stance: now.foot_forces_n.map(|force| force.norm() > contact_n),
        feet_world: now.feet_world,
        joint_angles_rad: now.joint_angles_rad,
        loads: Some(Loads {
            joint_rates_radps: now.joint_rates_radps,
            joint_torques_nm: torques_nm,
            foot_forces_n: now.foot_forces_n,
        }),
        rolled: None,
    }
}
