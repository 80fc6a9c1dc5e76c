//! A robot on wheels as an articulated body in rapier: torques in, motion and contacts out. No rapier type leaves.
//!
//! The engine moves body, legs and wheels and finds what solid things they touch. What holds the wheels on the ground is
//! ours: tires that give, and treads that hold before they slide.

use super::engine::{
    GRAVITY_MPS2, GROUND, ROBOT, SOLIDS, body_of, carry, engine, groups, hinge, place_world, touching,
};
use super::tire::{Footing, Hub, Tire, rolling_radius_m};
use super::tread::{Grip, Tread};
use crate::axes::{from_engine, point_to_engine, to_engine, vector_from_engine, vector_to_engine};
use arborloop_base::{Contact, Pose};
use arborloop_robots::{Form, Joint, JointKind, Lump, Robot, Shape, Wheel, WheelSettings, Wheeled};
use arborloop_worlds::{Terrain, World};
use nalgebra::{Point3, Translation3, Vector3};
use rapier3d_f64::prelude::{
    ColliderBuilder, ColliderHandle, MultibodyJointHandle, PhysicsWorld, RigidBodyHandle,
};

/// Damping ratio of a wheel's rim on its tread; assumed.
const TREAD_DAMPING_RATIO: f64 = 0.5;

/// What is true of the body now; wheels are ordered FR, FL, RR, RL.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CartState {
    pub(crate) world_from_base: Pose,
    /// Of the base's origin, world axes.
    pub(crate) linear_mps: Vector3<f64>,
    /// Base axes.
    pub(crate) angular_radps: Vector3<f64>,
    pub(crate) rolled_rad: [f64; 4],
    pub(crate) rolling_radps: [f64; 4],
    pub(crate) bearings_rad: [f64; 4],
    pub(crate) steering_radps: [f64; 4],
    pub(crate) wheels_world: [Point3<f64>; 4],
    /// Force of the ground on each wheel, world axes, mean over the last tick.
    pub(crate) forces_n: [Vector3<f64>; 4],
}

pub(crate) struct Cart {
    engine: PhysicsWorld,
    tick_s: f64,
    root: RigidBodyHandle,
    base_from_root: Pose,
    rolls: Vec<Hinge>,
    steers: Vec<Hinge>,
    terrain: Terrain,
    tires: Vec<Tire>,
    treads: Vec<Tread>,
    grips: [Grip; 4],
    /// Where each wheel stood in the last tick.
    footings: [Option<Footing>; 4],
    /// Pull of the ground on each wheel in the last tick, N.
    pulls_n: [Vector3<f64>; 4],
    parts: Vec<(String, ColliderHandle)>,
}

struct Hinge {
    handle: MultibodyJointHandle,
    parent: RigidBodyHandle,
    child: RigidBodyHandle,
    /// Axis in the child's frame.
    axis: Vector3<f64>,
    /// Place of its coordinate among the generalized ones.
    coordinate: usize,
}

impl Cart {
    /// Puts a robot on wheels into a world.
    pub(crate) fn new(
        world: &World,
        wheeled: &Wheeled,
        settings: &WheelSettings,
        tick_s: f64,
        world_from_base: &Pose,
    ) -> Self {
        let mut engine = engine(tick_s, settings.substeps as usize);
        place_world(&mut engine, world, settings.friction);
        let robot = &wheeled.robot;
        let body = Lump::of(robot, robot.root()).unwrap_or(Lump::NOTHING);
        let base_from_root = Pose::from(Translation3::from(body.center_of_mass.coords));
        let root = engine.insert_body(
            body_of(&body.seen_from(&base_from_root.inverse()))
                .pose(to_engine(&(world_from_base * base_from_root))),
        );
        let mut cart = Cart {
            engine,
            tick_s,
            root,
            base_from_root,
            rolls: Vec::new(),
            steers: Vec::new(),
            terrain: world.terrain.clone(),
            tires: wheeled.wheels.iter().map(|wheel| tire(wheel, wheeled, settings)).collect(),
            treads: wheeled.wheels.iter().map(|wheel| tread(wheel, wheeled, settings)).collect(),
            grips: [Grip::default(); 4],
            footings: [None; 4],
            pulls_n: [Vector3::zeros(); 4],
            parts: Vec::new(),
        };
        cart.cover(robot, robot.root(), root, &base_from_root.inverse());
        for wheel in &wheeled.wheels {
            let mut above = (root, base_from_root);
            if let Some(steer) = &wheel.steer {
                above = cart.hang(robot, steer, above, true);
            }
            cart.hang(robot, &wheel.roll, above, false);
        }
        cart.prepare(wheeled, settings);
        cart
    }

    /// Hangs a joint's child, with all that is fixed to it, on the body above; answers with that child as a body whose
    /// frame is the link's.
    fn hang(
        &mut self,
        robot: &Robot,
        joint: &Joint,
        (above, base_from_above): (RigidBodyHandle, Pose),
        steers: bool,
    ) -> (RigidBodyHandle, Pose) {
        let lump = Lump::of(robot, &joint.child).unwrap_or(Lump::NOTHING);
        let child = self.engine.insert_body(body_of(&lump));
        let frame = |link: &str| robot.frame(link).unwrap_or_else(Pose::identity);
        let parent_from_above = frame(&joint.parent).inverse() * base_from_above;
        let handle = self
            .engine
            .insert_multibody_joint(above, child, hinge(joint, &parent_from_above, steers))
            .expect("the joints of a checked robot are a tree, and each hangs a new body");
        let hung = Hinge { handle, parent: above, child, axis: joint.axis.into_inner(), coordinate: 0 };
        if steers {
            self.steers.push(hung)
        } else {
            self.rolls.push(hung)
        }
        self.cover(robot, &joint.child, child, &Pose::identity());
        (child, frame(&joint.child))
    }

    /// Colliders of a link and of all that is fixed to it.
    fn cover(&mut self, robot: &Robot, link: &str, body: RigidBodyHandle, body_from_link: &Pose) {
        let rolls =
            robot.joints.iter().any(|joint| joint.child == link && joint.kind == JointKind::Continuous);
        let found = robot.links.iter().find(|one| one.name == link);
        for shape in found.iter().flat_map(|link| &link.shapes) {
            let meets = if rolls { SOLIDS } else { GROUND | SOLIDS };
            let Some(collider) = collider(shape, body_from_link) else { continue };
            let collider = collider.density(0.0).collision_groups(groups(ROBOT, meets));
            self.parts.push((link.to_owned(), self.engine.insert_collider(collider, Some(body))));
        }
        let fixed = robot.joints.iter().filter(|one| one.parent == link && one.kind == JointKind::Fixed);
        for joint in fixed {
            self.cover(robot, &joint.child, body, &(body_from_link * joint.parent_from_child));
        }
    }

    /// Damping, friction and rolling resistance of the joints.
    fn prepare(&mut self, wheeled: &Wheeled, settings: &WheelSettings) {
        for hinge in self.rolls.iter_mut().chain(&mut self.steers) {
            let found = self.engine.multibody_joints.get(hinge.handle);
            hinge.coordinate =
                found.and_then(|(body, link)| body.link(link)).map_or(0, |link| link.assembly_id());
        }
        let load_n = wheeled.mass_kg * GRAVITY_MPS2 / 4.0;
        let Some(first) = self.rolls.first() else { return };
        let Some((body, _)) = self.engine.multibody_joints.get_mut(first.handle) else { return };
        // The engine's own damping would hold the free root back as through honey.
        body.damping_mut().fill(0.0);
        for (wheel, hinge) in wheeled.wheels.iter().zip(&self.rolls) {
            let resistance_nm = settings.rolling_resistance_ratio * load_n * wheel.radius_m;
            body.damping_mut()[hinge.coordinate] = wheel.roll.damping;
            body.frictions_mut()[hinge.coordinate] = wheel.roll.friction + resistance_nm;
        }
        let steering = wheeled.wheels.iter().filter_map(|wheel| wheel.steer.as_ref());
        for (joint, hinge) in steering.zip(&self.steers) {
            body.damping_mut()[hinge.coordinate] = joint.damping;
            body.frictions_mut()[hinge.coordinate] = joint.friction;
        }
        body.forward_kinematics(&self.engine.bodies, true);
        body.update_rigid_bodies(&mut self.engine.bodies, true);
    }

    /// One tick under torques of the wheels and of their steering, N m.
    pub(crate) fn step(&mut self, rolls_nm: &[f64; 4], steers_nm: &[f64; 4]) {
        let bodies = &mut self.engine.bodies;
        for handle in self.rolls.iter().chain(&self.steers).map(|hinge| hinge.child).chain([self.root]) {
            if let Some(body) = bodies.get_mut(handle) {
                body.reset_torques(false);
                body.reset_forces(false);
            }
        }
        let driven = self.rolls.iter().zip(rolls_nm).chain(self.steers.iter().zip(steers_nm));
        for (hinge, torque_nm) in driven {
            let Some(child) = bodies.get_mut(hinge.child) else { continue };
            let torque = *child.rotation() * vector_to_engine(&(hinge.axis * *torque_nm));
            child.add_torque(torque, false);
            if let Some(parent) = bodies.get_mut(hinge.parent) {
                parent.add_torque(-torque, false);
            }
        }
        self.hold();
        self.engine.step();
        // The engine never brings the root's quaternion back to unit length.
        if let Some(root) = self.engine.bodies.get_mut(self.root) {
            let turn = root.rotation().normalize();
            root.set_rotation(turn, false);
        }
    }

    /// Puts the whole body down elsewhere as it is, its tires' treads as strained as they were.
    pub(crate) fn carry(&mut self, moved: &Pose) {
        let Some(first) = self.rolls.first() else { return };
        let bodies: Vec<_> = self.rolls.iter().chain(&self.steers).map(|hinge| hinge.child).collect();
        carry(&mut self.engine, self.root, first.handle, &bodies, moved);
        self.grips.iter_mut().for_each(|grip| grip.turn(&moved.rotation));
    }

    /// Applies what the ground pulls at the wheels.
    fn hold(&mut self) {
        for n in 0..4 {
            let Some(body) = self.engine.bodies.get_mut(self.rolls[n].child) else { continue };
            let center = from_engine(body.position());
            let hub = Hub {
                center: center.translation.vector.into(),
                velocity_mps: vector_from_engine(&body.linvel()),
                axle: center.rotation * self.rolls[n].axis,
            };
            self.footings[n] = self.tires[n].footing(&hub, &self.terrain);
            let Some(footing) = self.footings[n] else {
                (self.grips[n], self.pulls_n[n]) = (Grip::default(), Vector3::zeros());
                continue;
            };
            // The tread is as long as the tire was before it was pressed flat: it rolls on a wider circle.
            let arm = footing.at - hub.center;
            let rolling_m = rolling_radius_m(self.tires[n].radius_m(), arm.norm());
            let at = point_to_engine(&(hub.center + arm.normalize() * rolling_m));
            let velocity_mps = vector_from_engine(&body.velocity_at_point(at));
            let pull_n = self.grips[n].pull(
                &self.treads[n],
                &footing.normal,
                footing.load_n,
                &velocity_mps,
                self.tick_s,
            );
            // The springs push through the axle.
            let push_n = footing.normal.into_inner() * footing.load_n;
            body.add_force(vector_to_engine(&push_n), false);
            body.add_force_at_point(vector_to_engine(&pull_n), at, false);
            self.pulls_n[n] = pull_n;
        }
    }

    /// What is true now.
    pub(crate) fn state(&self) -> CartState {
        let root = &self.engine.bodies[self.root];
        let world_from_base = from_engine(root.position()) * self.base_from_root.inverse();
        let spin = vector_from_engine(&root.angvel());
        let arm = world_from_base.rotation * self.base_from_root.translation.vector;
        let (rolled_rad, rolling_radps) = self.turned(&self.rolls);
        let (bearings_rad, steering_radps) = self.turned(&self.steers);
        let place = |n: usize| {
            let place = self.engine.bodies[self.rolls[n].child].position().translation;
            Point3::from(vector_from_engine(&place))
        };
        CartState {
            world_from_base,
            linear_mps: vector_from_engine(&root.linvel()) - spin.cross(&arm),
            angular_radps: world_from_base.rotation.inverse() * spin,
            rolled_rad,
            rolling_radps,
            bearings_rad,
            steering_radps,
            wheels_world: std::array::from_fn(place),
            forces_n: std::array::from_fn(|n| {
                self.footings[n].map_or(Vector3::zeros(), |footing| {
                    footing.normal.into_inner() * footing.load_n + self.pulls_n[n]
                })
            }),
        }
    }

    /// Angles and rates of hinges; zeros for those that are not there.
    fn turned(&self, hinges: &[Hinge]) -> ([f64; 4], [f64; 4]) {
        let (mut angles, mut rates) = ([0.0; 4], [0.0; 4]);
        for (n, hinge) in hinges.iter().enumerate() {
            let Some((body, link)) = self.engine.multibody_joints.get(hinge.handle) else { continue };
            // Whatever its axis, a hinge's angle is the first angular coordinate.
            angles[n] = body.link(link).map_or(0.0, |link| link.joint().coords()[3]);
            rates[n] = body.generalized_velocity()[hinge.coordinate];
        }
        (angles, rates)
    }

    /// Solid things that the robot touches; the ground is none of them; sorted.
    pub(crate) fn touching(&self) -> Vec<Contact> {
        touching(&self.engine, &self.parts)
    }
}

/// The tire of a wheel that carries its share of the robot.
fn tire(wheel: &Wheel, wheeled: &Wheeled, settings: &WheelSettings) -> Tire {
    let load_n = wheeled.mass_kg * GRAVITY_MPS2 / 4.0;
    Tire::new(wheel.radius_m, load_n, settings.tire_give_m, settings.tire_damping_ratio)
}

/// The tread of a wheel that carries its share of the robot.
fn tread(wheel: &Wheel, wheeled: &Wheeled, settings: &WheelSettings) -> Tread {
    let stiffness_npm = settings.friction * wheeled.mass_kg * GRAVITY_MPS2 / 4.0 / settings.tread_give_m;
    let rim_kg = wheel.inertia_kgm2 / (wheel.radius_m * wheel.radius_m);
    Tread {
        friction: settings.friction,
        give_m: settings.tread_give_m,
        damping_nspm: 2.0 * TREAD_DAMPING_RATIO * (stiffness_npm * rim_kg).sqrt(),
    }
}

fn collider(shape: &Shape, body_from_link: &Pose) -> Option<ColliderBuilder> {
    let built = match &shape.form {
        Form::Box { size_m } => ColliderBuilder::cuboid(size_m.x / 2.0, size_m.y / 2.0, size_m.z / 2.0),
        Form::Sphere { radius_m } => ColliderBuilder::ball(*radius_m),
        Form::Cylinder { radius_m, length_m } => ColliderBuilder::cylinder(length_m / 2.0, *radius_m),
        Form::Mesh { .. } => return None,
    };
    // The engine's cylinders stand along y, URDF's along z.
    let shape_from_engine = match shape.form {
        Form::Cylinder { .. } => Pose::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2),
        _ => Pose::identity(),
    };
    Some(built.position(to_engine(&(body_from_link * shape.link_from_shape * shape_from_engine))))
}
