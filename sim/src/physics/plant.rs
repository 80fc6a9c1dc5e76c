//! A legged robot as an articulated body in rapier: torques in, motion and contacts out. No rapier type leaves.
//!
//! Reduced coordinates (a multibody), so that joints hold exactly and rotors have their inertia. The root is the
//! trunk's center of mass: the engine takes the root's velocity for that of its center, and integrates its origin.

use super::FEET;
use super::engine::{
    GROUND, ROBOT, SOLIDS, body_of, carry, engine, force_on, groups, hinge, place_world, touching,
};
use crate::axes::{from_engine, to_engine, vector_from_engine, vector_to_engine};
use arborloop_base::{Contact, Pose};
use arborloop_robots::{JointKind, Lump, Robot, go1};
use arborloop_worlds::World;
use nalgebra::{Point3, Translation3, Vector3};
use rapier3d_f64::prelude::{
    ColliderBuilder, ColliderHandle, MultibodyJointHandle, PhysicsWorld, RigidBodyHandle,
};
use std::collections::BTreeMap;

/// Dry friction and damping of the joints, N m and N m s/rad (go1.urdf).
const JOINT_FRICTION_NM: f64 = 0.2;
const JOINT_DAMPING_NMS: f64 = 0.01;
/// Radius of thighs and calves, meters: half their thickness (go1.urdf).
const LIMB_RADIUS_M: f64 = 0.012;
/// What the plant is built from besides the world and the robot.
pub(crate) struct PlantSpec {
    pub(crate) tick_s: f64,
    pub(crate) substeps: usize,
    pub(crate) friction: f64,
    /// Rotor inertia as the joint feels it: hip, thigh, calf, kg m2.
    pub(crate) rotors_kgm2: [f64; 3],
    pub(crate) payload: Lump,
}

/// What is true of the body now.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PlantState {
    pub(crate) world_from_base: Pose,
    /// Of the base's origin, world axes.
    pub(crate) linear_mps: Vector3<f64>,
    /// Base axes.
    pub(crate) angular_radps: Vector3<f64>,
    pub(crate) joint_angles_rad: [f64; 12],
    pub(crate) joint_rates_radps: [f64; 12],
    pub(crate) feet_world: [Point3<f64>; 4],
    /// Force of the ground on each foot, world axes, mean over the last tick.
    pub(crate) foot_forces_n: [Vector3<f64>; 4],
}

pub(crate) struct Plant {
    engine: PhysicsWorld,
    tick_s: f64,
    root: RigidBodyHandle,
    base_from_root: Pose,
    joints: Vec<PlantJoint>,
    feet: [ColliderHandle; 4],
    parts: Vec<(String, ColliderHandle)>,
}

struct PlantJoint {
    handle: MultibodyJointHandle,
    parent: RigidBodyHandle,
    child: RigidBodyHandle,
    /// Axis in the child's frame.
    axis: Vector3<f64>,
    /// Place of its coordinate among the generalized ones.
    coordinate: usize,
}

impl Plant {
    /// Puts a robot with legs like the Go1's into a world.
    pub(crate) fn new(
        world: &World,
        robot: &Robot,
        spec: &PlantSpec,
        world_from_base: &Pose,
        angles_rad: &[f64; 12],
    ) -> Self {
        let mut engine = engine(spec.tick_s, spec.substeps);
        place_world(&mut engine, world, spec.friction);
        let trunk = Lump::of(robot, robot.root()).unwrap_or(Lump::NOTHING).plus(&spec.payload);
        let base_from_root = Pose::from(Translation3::from(trunk.center_of_mass.coords));
        let root = engine.insert_body(
            body_of(&trunk.seen_from(&base_from_root.inverse()))
                .pose(to_engine(&(world_from_base * base_from_root))),
        );
        let mut plant = Plant {
            engine,
            tick_s: spec.tick_s,
            root,
            base_from_root,
            joints: Vec::new(),
            feet: [ColliderHandle::invalid(); 4],
            parts: Vec::new(),
        };
        plant.hang_legs(robot, spec);
        plant.cover_trunk();
        plant.bend(angles_rad);
        plant
    }

    /// Links below the trunk, in the order of [`go1::JOINT_NAMES`], with their joints, motors and colliders.
    fn hang_legs(&mut self, robot: &Robot, spec: &PlantSpec) {
        let mut bodies: BTreeMap<&str, (RigidBodyHandle, Pose)> = BTreeMap::new();
        bodies.insert(robot.root(), (self.root, self.base_from_root));
        for (index, name) in go1::JOINT_NAMES.iter().enumerate() {
            let Some(joint) = robot.joints.iter().find(|joint| joint.name == *name) else { continue };
            let (parent, parent_from_body) = self.above(robot, &bodies, &joint.parent);
            let lump = Lump::of(robot, &joint.child).unwrap_or(Lump::NOTHING);
            let child = self.engine.insert_body(body_of(&lump));
            bodies.insert(&joint.child, (child, Pose::identity()));
            let built = hinge(joint, &parent_from_body, joint.kind == JointKind::Revolute);
            let handle = self
                .engine
                .insert_multibody_joint(parent, child, built)
                .expect("the joints of a checked robot are a tree, and each hangs a new body");
            let axis = joint.axis.into_inner();
            self.joints.push(PlantJoint { handle, parent, child, axis, coordinate: 0 });
            self.cover_limb(robot, index, &joint.child, child, spec);
        }
        let Some(first) = self.joints.first() else { return };
        let handle = first.handle;
        let coordinates: Vec<usize> = self
            .joints
            .iter()
            .map(|joint| self.engine.multibody_joints.get(joint.handle))
            .map(|found| found.and_then(|(body, link)| body.link(link)).map_or(0, |link| link.assembly_id()))
            .collect();
        self.joints.iter_mut().zip(&coordinates).for_each(|(joint, found)| joint.coordinate = *found);
        let Some((body, _)) = self.engine.multibody_joints.get_mut(handle) else { return };
        // The engine's own damping would hold the free root back as through honey.
        body.damping_mut().fill(0.0);
        for (index, coordinate) in coordinates.iter().enumerate() {
            body.damping_mut()[*coordinate] = JOINT_DAMPING_NMS;
            body.frictions_mut()[*coordinate] = JOINT_FRICTION_NM;
            body.armature_mut()[*coordinate] = spec.rotors_kgm2[index % 3];
        }
    }

    /// The body that carries a link, and the link's frame in which that body's own frame stands.
    fn above(
        &self,
        robot: &Robot,
        bodies: &BTreeMap<&str, (RigidBodyHandle, Pose)>,
        link: &str,
    ) -> (RigidBodyHandle, Pose) {
        if let Some(found) = bodies.get(link) {
            return *found;
        }
        let fixed = robot.joints.iter().find(|joint| joint.child == link);
        fixed.map_or((self.root, self.base_from_root), |joint| {
            let (body, parent_from_body) = self.above(robot, bodies, &joint.parent);
            (body, joint.parent_from_child.inverse() * parent_from_body)
        })
    }

    fn cover_limb(
        &mut self,
        robot: &Robot,
        index: usize,
        link: &str,
        body: RigidBodyHandle,
        spec: &PlantSpec,
    ) {
        let leg = index / 3;
        if index.is_multiple_of(3) {
            return;
        }
        let end = Vector3::new(0.0, 0.0, if index % 3 == 1 { -go1::THIGH_M } else { -go1::CALF_M });
        let limb = ColliderBuilder::capsule_from_endpoints(
            vector_to_engine(&Vector3::zeros()),
            vector_to_engine(&end),
            LIMB_RADIUS_M,
        );
        let limb = self.engine.insert_collider(
            limb.density(0.0).friction(spec.friction).collision_groups(groups(ROBOT, SOLIDS)),
            Some(body),
        );
        self.parts.push((link.to_owned(), limb));
        if index % 3 == 2 {
            let foot = ColliderBuilder::ball(go1::FOOT_RADIUS_M)
                .position(to_engine(&calf_from_foot(robot, leg, link)))
                .density(0.0)
                .friction(spec.friction)
                .collision_groups(groups(ROBOT, GROUND | SOLIDS));
            self.feet[leg] = self.engine.insert_collider(foot, Some(body));
            self.parts.push((FEET[leg].to_owned(), self.feet[leg]));
        }
    }

    fn cover_trunk(&mut self) {
        let root_from_base = self.base_from_root.inverse();
        for shape in go1::body_shapes() {
            let half = shape.half_extents_m;
            let cuboid = ColliderBuilder::cuboid(half.x, half.y, half.z)
                .position(to_engine(&(root_from_base * shape.base_from_shape)))
                .density(0.0)
                .collision_groups(groups(ROBOT, GROUND | SOLIDS));
            let collider = self.engine.insert_collider(cuboid, Some(self.root));
            self.parts.push((shape.part.to_owned(), collider));
        }
    }

    /// Sets the joints: a multibody is made with all of them at zero, outside the calves' limits.
    fn bend(&mut self, angles_rad: &[f64; 12]) {
        let Some(first) = self.joints.first() else { return };
        let Some((body, _)) = self.engine.multibody_joints.get_mut(first.handle) else { return };
        let mut shift = vec![0.0; body.ndofs()];
        for (joint, angle_rad) in self.joints.iter().zip(angles_rad) {
            shift[joint.coordinate] = *angle_rad;
        }
        body.apply_displacements(&shift);
        body.forward_kinematics(&self.engine.bodies, true);
        body.update_rigid_bodies(&mut self.engine.bodies, true);
    }

    /// One tick under joint torques, N m.
    pub(crate) fn step(&mut self, torques_nm: &[f64; 12]) {
        let bodies = &mut self.engine.bodies;
        for handle in self.joints.iter().map(|joint| joint.child).chain([self.root]) {
            if let Some(body) = bodies.get_mut(handle) {
                body.reset_torques(false);
            }
        }
        for (joint, torque_nm) in self.joints.iter().zip(torques_nm) {
            let Some(child) = bodies.get_mut(joint.child) else { continue };
            let torque = *child.rotation() * vector_to_engine(&(joint.axis * *torque_nm));
            child.add_torque(torque, false);
            if let Some(parent) = bodies.get_mut(joint.parent) {
                parent.add_torque(-torque, false);
            }
        }
        self.engine.step();
        // The engine never brings the root's quaternion back to unit length.
        if let Some(root) = self.engine.bodies.get_mut(self.root) {
            let turn = root.rotation().normalize();
            root.set_rotation(turn, false);
        }
    }

    /// Puts the whole body down elsewhere as it is.
    pub(crate) fn carry(&mut self, moved: &Pose) {
        let Some(first) = self.joints.first() else { return };
        let bodies: Vec<_> = self.joints.iter().map(|joint| joint.child).collect();
        carry(&mut self.engine, self.root, first.handle, &bodies, moved);
    }

    /// Gives the whole body a velocity, world axes, m/s.
    pub(crate) fn push(&mut self, velocity_mps: &Vector3<f64>) {
        let Some(first) = self.joints.first() else { return };
        if let Some((body, _)) = self.engine.multibody_joints.get_mut(first.handle) {
            let mut speeds = body.generalized_velocity_mut();
            (0..3).for_each(|axis| speeds[axis] += velocity_mps[axis]);
        }
    }

    /// What is true now.
    pub(crate) fn state(&self) -> PlantState {
        let root = &self.engine.bodies[self.root];
        let world_from_base = from_engine(root.position()) * self.base_from_root.inverse();
        let spin = vector_from_engine(&root.angvel());
        let arm = world_from_base.rotation * self.base_from_root.translation.vector;
        let mut joint_angles_rad = [0.0; 12];
        let mut joint_rates_radps = [0.0; 12];
        for (index, joint) in self.joints.iter().enumerate() {
            let Some((body, link)) = self.engine.multibody_joints.get(joint.handle) else { continue };
            // Whatever its axis, a hinge's angle is the first angular coordinate.
            joint_angles_rad[index] = body.link(link).map_or(0.0, |link| link.joint().coords()[3]);
            joint_rates_radps[index] = body.generalized_velocity()[joint.coordinate];
        }
        let feet_world = self.feet.map(|foot| {
            let place = self.engine.colliders[foot].position().translation;
            Point3::from(vector_from_engine(&place))
        });
        PlantState {
            world_from_base,
            linear_mps: vector_from_engine(&root.linvel()) - spin.cross(&arm),
            angular_radps: world_from_base.rotation.inverse() * spin,
            joint_angles_rad,
            joint_rates_radps,
            feet_world,
            foot_forces_n: self.feet.map(|foot| force_on(&self.engine, foot, self.tick_s)),
        }
    }

    /// Solid things that the robot touches; the ground is none of them; sorted.
    pub(crate) fn touching(&self) -> Vec<Contact> {
        touching(&self.engine, &self.parts)
    }
}

fn calf_from_foot(robot: &Robot, leg: usize, calf: &str) -> Pose {
    let foot = robot.frame(&format!("{}_foot", go1::LEGS[leg]));
    let calf = robot.frame(calf);
    calf.zip(foot).map_or(Pose::translation(0.0, 0.0, -go1::CALF_M), |(calf, foot)| calf.inverse() * foot)
}
