//! A robot on wheels moved by physics: commands to wheel speeds, wheel speeds to torques, torques to its body, every tick.

use super::cart::{Cart, CartState};
use super::tire::rolling_radius_m;
use arborloop_base::{Contact, Pose, Pose2, Seed, Span};
use arborloop_robots::wheels::{Drive, Servo, twist_of_wheels};
use arborloop_robots::{
    Carry, Command, Fall, FallCause, Ground, Loads, TrunkMotion, TrunkState, WheelSettings, Wheeled,
};
use arborloop_worlds::{Terrain, World};
use nalgebra::{Point3, Rotation3, UnitQuaternion, Vector3};

/// A robot that was put down stands still after this, seconds.
const AT_REST_AFTER_S: f64 = 2.0;

/// A robot on wheels in the physics engine, behind the gait seam.
pub struct WheeledGait {
    cart: Cart,
    /// With the radii on which its wheels roll under their load.
    robot: Wheeled,
    settings: WheelSettings,
    drive: Drive,
    servos: [Servo; 4],
    /// Believed radius of the wheels over the true one.
    radius_belief: f64,
    tick: Span,
    ticks: u64,
    state: TrunkState,
    fall: Option<Fall>,
}

impl WheeledGait {
    /// Stands at `start` (world), all wheels on the ground.
    ///
    /// # Panics
    /// When the settings do not pass [`WheelSettings::check`] or the tick is not positive.
    pub fn new(
        world: &World,
        mut robot: Wheeled,
        settings: &WheelSettings,
        start: Pose2,
        tick: Span,
        seed: Seed,
    ) -> Self {
        if let Err(error) = settings.check() {
            panic!("a robot is driven by checked settings, but {error}");
        }
        assert!(tick > Span::ZERO, "a tick is longer than nothing, not {tick}");
        let world_from_base = standing(&world.terrain, &robot, &start);
        let cart = Cart::new(world, &robot, settings, tick.seconds(), &world_from_base);
        for wheel in &mut robot.wheels {
            wheel.radius_m = rolling_radius_m(wheel.radius_m, wheel.radius_m - settings.tire_give_m);
        }
        let radius_belief =
            1.0 + settings.radius_error_ratio * seed.stream("robot/wheels/radius").at(0).normal();
        let driven_kg = robot.mass_kg / 4.0;
        let now = cart.state();
        let mut gait = WheeledGait {
            drive: Drive::new(&robot, settings, tick.seconds()),
            servos: robot
                .wheels
                .each_ref()
                .map(|wheel| Servo::new(wheel, settings, driven_kg, tick.seconds())),
            state: blank(&now),
            cart,
            robot,
            settings: settings.clone(),
            radius_belief,
            tick,
            ticks: 0,
            fall: None,
        };
        gait.tell(&now, [0.0; 12]);
        gait.come_to_rest();
        gait
    }

    /// Lets the body sink into its tires: put down on four points of uneven ground it rolls and turns by tenths of a degree
    /// before it stands, and a run begins with a robot that stands.
    fn come_to_rest(&mut self) {
        let ticks = (AT_REST_AFTER_S / self.tick.seconds()).ceil() as u64;
        for _ in 0..ticks {
            self.step(&Command::default());
        }
        self.ticks = 0;
        if let Some(fall) = self.fall.as_mut() {
            fall.after = Span::ZERO;
        }
    }

    /// Moves on by a tick.
    fn step(&mut self, command: &Command) {
        if self.fall.is_some() {
            return;
        }
        let before = self.cart.state();
        let targets = self.drive.step(command, &before.bearings_rad);
        let mut torques_nm = [0.0; 12];
        for n in 0..4 {
            let servo = &mut self.servos[n];
            torques_nm[n] = servo.roll_nm(targets.rates_radps[n], before.rolling_radps[n]);
            torques_nm[4 + n] =
                servo.steer_nm(targets.bearings_rad[n], before.bearings_rad[n], before.steering_radps[n]);
        }
        let part = |from: usize| std::array::from_fn(|n| torques_nm[from + n]);
        self.cart.step(&part(0), &part(4));
        self.ticks += 1;
        let now = self.cart.state();
        if let Some(cause) = self.fallen(&now) {
            self.fall = Some(Fall { after: self.tick * self.ticks as i64, cause });
            if cause == FallCause::NotFinite {
                return;
            }
        }
        self.tell(&now, torques_nm);
    }

    /// Solid things that the robot touches; the ground is none of them; sorted.
    pub fn touching(&self) -> Vec<Contact> {
        self.cart.touching()
    }

    /// Writes the state from what is true.
    fn tell(&mut self, now: &CartState, torques_nm: [f64; 12]) {
        let joints = |first: &[f64; 4], second: &[f64; 4]| {
            let mut all = [0.0; 12];
            all[..4].copy_from_slice(first);
            all[4..8].copy_from_slice(second);
            all
        };
        let mut rolled =
            twist_of_wheels(&self.robot, self.settings.track_ratio, &now.rolling_radps, &now.bearings_rad);
        // A wheel believed to be larger tells of a longer way and a wider turn.
        rolled.linear_mps *= self.radius_belief;
        rolled.angular_radps *= self.radius_belief;
        self.state = TrunkState {
            world_from_base: now.world_from_base,
            linear_mps: now.linear_mps,
            angular_radps: now.angular_radps,
            phase: 0.0,
            stance: now.forces_n.map(|force| force.norm() > 0.0),
            feet_world: now.wheels_world,
            joint_angles_rad: joints(&now.rolled_rad, &now.bearings_rad),
            loads: Some(Loads {
                joint_rates_radps: joints(&now.rolling_radps, &now.steering_radps),
                joint_torques_nm: torques_nm,
                foot_forces_n: now.forces_n,
            }),
            rolled: Some(rolled),
        };
    }

    fn fallen(&self, now: &CartState) -> Option<FallCause> {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let pose = &now.world_from_base;
        let sound = finite(pose.translation.vector.as_slice())
            && finite(pose.rotation.coords.as_slice())
            && finite(now.linear_mps.as_slice())
            && finite(now.angular_radps.as_slice())
            && finite(&now.rolling_radps)
            && finite(&now.bearings_rad);
        if !sound {
            return Some(FallCause::NotFinite);
        }
        let up = pose.rotation * Vector3::z();
        (up.z < self.settings.fallen_deg.to_radians().cos()).then_some(FallCause::Tipped)
    }
}

impl TrunkMotion for WheeledGait {
    /// The ground is the world's own, which the engine holds already.
    fn advance(&mut self, command: &Command, _ground: &dyn Ground) -> &TrunkState {
        self.step(command);
        &self.state
    }

    fn carry(&mut self, by: &Pose2, ground: &dyn Ground) {
        if self.fall.is_some() {
            return;
        }
        let carry = Carry::of(&self.state, by, ground);
        self.cart.carry(&carry.world_from_world());
        self.state = self.state.carried(&carry);
    }

    fn state(&self) -> &TrunkState {
        &self.state
    }

    fn fall(&self) -> Option<Fall> {
        self.fall
    }
}

/// The base over four wheels on the ground, parallel to the plane through them.
fn standing(terrain: &Terrain, robot: &Wheeled, start: &Pose2) -> Pose {
    let middles = robot.wheels.each_ref().map(|wheel| {
        let place = start * wheel.center.xy();
        let lift_m = wheel.radius_m / terrain.normal(place.x, place.y).z;
        Point3::new(place.x, place.y, terrain.height_m(place.x, place.y) + lift_m)
    });
    let [fr, fl, rr, rl] = middles.map(|middle| middle.coords);
    let ahead = (fr + fl - rr - rl).normalize();
    let up = ahead.cross(&(fl + rl - fr - rr)).normalize();
    let axes = Rotation3::from_basis_unchecked(&[ahead, up.cross(&ahead), up]);
    let turn = UnitQuaternion::from_rotation_matrix(&axes);
    let base_middle = robot.wheels.iter().map(|wheel| wheel.center.coords).sum::<Vector3<f64>>() / 4.0;
    let origin = (fr + fl + rr + rl) / 4.0 - turn * base_middle;
    Pose::from_parts(origin.into(), turn)
}

fn blank(now: &CartState) -> TrunkState {
    TrunkState {
        world_from_base: now.world_from_base,
        linear_mps: now.linear_mps,
        angular_radps: now.angular_radps,
        phase: 0.0,
        stance: [true; 4],
        feet_world: now.wheels_world,
        joint_angles_rad: [0.0; 12],
        loads: None,
        rolled: None,
    }
}
