//! A legged robot as an articulated body in rapier: torques in, motion and contacts out. No rapier type leaves.
//!
//! Reduced coordinates (a multibody), so that joints hold exactly and rotors have their inertia. The root is the
//! trunk's center of mass: the engine takes the root's velocity for that of its center, and integrates its origin.

use super::{FEET, outline, soil, tag, untag};
use crate::axes::{from_engine, point_to_engine, to_engine, vector_from_engine, vector_to_engine};
use arborloop_base::{Contact, Pose};
use arborloop_robots::{JointKind, Lump, Robot, go1};
use arborloop_worlds::World;
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use rapier3d_f64::prelude::{
    ColliderBuilder, ColliderHandle, FrictionModel, GenericJointBuilder, Group, InteractionGroups,
    JointAxesMask, JointAxis, MassProperties, Matrix, MultibodyJointHandle, PhysicsWorld, RigidBodyBuilder,
    RigidBodyHandle,
};
use std::collections::{BTreeMap, BTreeSet};

/// Standard gravity, m/s2.
const GRAVITY_MPS2: f64 = 9.806_65;
/// Dry friction and damping of the joints, N m and N m s/rad (go1.urdf).
const JOINT_FRICTION_NM: f64 = 0.2;
const JOINT_DAMPING_NMS: f64 = 0.01;
/// Radius of thighs and calves, meters: half their thickness (go1.urdf).
const LIMB_RADIUS_M: f64 = 0.012;
/// Who meets whom: the robot's parts meet the ground and what stands on it, never each other. Limbs do not meet the
/// ground: knees and shins of a standing robot are above it, and a fallen one lies on its trunk.
const ROBOT: Group = Group::GROUP_1;
const GROUND: Group = Group::GROUP_2;
const SOLIDS: Group = Group::GROUP_3;

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
        let mut engine = engine_for(spec);
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
            // The engine's hinge turns about the x axis of its own frames.
            let hinge = UnitQuaternion::rotation_between(&Vector3::x(), &joint.axis)
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI));
            let hinge = Pose::from_parts(Translation3::identity(), hinge);
            let mut built = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
                .contacts_enabled(false)
                .local_frame1(to_engine(&(parent_from_body.inverse() * joint.parent_from_child * hinge)))
                .local_frame2(to_engine(&hinge));
            if let Some(limits) = joint.limits.filter(|_| joint.kind == JointKind::Revolute) {
                built = built.limits(JointAxis::AngX, [limits.low, limits.high]);
            }
            let handle = self
                .engine
                .insert_multibody_joint(parent, child, built.build())
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
            foot_forces_n: self.feet.map(|foot| self.force_on(foot)),
        }
    }

    /// Mean force of everything on a collider over the last tick, world axes, N.
    fn force_on(&self, collider: ColliderHandle) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for pair in self.engine.narrow_phase.contact_pairs_with(collider) {
            let sign = if pair.collider2 == collider { 1.0 } else { -1.0 };
            for manifold in pair.solver_manifolds() {
                let normal = vector_from_engine(&manifold.data.normal);
                for point in &manifold.points {
                    let data = &point.data;
                    // The engine keeps friction as a vector for its last substep only: scaled up to all of them.
                    let share = if data.warmstart_impulse > 0.0 {
                        data.impulse / data.warmstart_impulse
                    } else {
                        0.0
                    };
                    let aside = vector_from_engine(&data.warmstart_tangent_world) * share;
                    sum += (normal * data.impulse - aside) * sign;
                }
            }
        }
        sum / self.tick_s
    }

    /// Solid things that the robot touches; the ground is none of them; sorted.
    pub(crate) fn touching(&self) -> Vec<Contact> {
        let mut contacts = BTreeSet::new();
        for (part, collider) in &self.parts {
            for pair in self.engine.narrow_phase.contact_pairs_with(*collider) {
                let touches = pair.manifolds().iter().flat_map(|one| &one.points).any(|p| p.dist <= 0.0);
                let other = if pair.collider1 == *collider { pair.collider2 } else { pair.collider1 };
                let met = self.engine.colliders.get(other).and_then(|one| untag(one.user_data));
                if let (true, Some((class, instance))) = (touches, met) {
                    contacts.insert(Contact { part: part.clone(), class, instance });
                }
            }
        }
        contacts.into_iter().collect()
    }
}

/// The engine with everything spelled out that the walk relies on.
fn engine_for(spec: &PlantSpec) -> PhysicsWorld {
    let mut engine = PhysicsWorld::new();
    engine.gravity = vector_to_engine(&Vector3::new(0.0, 0.0, -GRAVITY_MPS2));
    let parameters = &mut engine.integration_parameters;
    parameters.dt = spec.tick_s;
    parameters.num_solver_iterations = spec.substeps;
    parameters.num_internal_pgs_iterations = 1;
    parameters.num_internal_stabilization_iterations = 1;
    parameters.max_ccd_substeps = 0;
    // Without friction in both passes a loaded foot creeps by millimeters a second.
    parameters.friction_in_bias_pass = true;
    parameters.friction_model = FrictionModel::Coulomb;
    // Recycled contacts drift by more than a foot is wide.
    parameters.contact_recycling = false;
    parameters.contact_clustering = false;
    engine
}

/// The ground and all that can be bumped into.
fn place_world(engine: &mut PhysicsWorld, world: &World, friction: f64) {
    let ground = soil::collider(&world.terrain).friction(friction).collision_groups(groups(GROUND, ROBOT));
    engine.insert_collider(ground, None);
    for solid in &world.solids {
        let corners: Vec<_> = outline(&solid.shape).iter().map(point_to_engine).collect();
        // A disc or a needle has no volume, hence no hull: nothing to bump into.
        if let Some(hull) = ColliderBuilder::convex_hull(&corners) {
            let hull = hull.user_data(tag(solid.class, solid.instance)).friction(friction);
            engine.insert_collider(hull.collision_groups(groups(SOLIDS, ROBOT)), None);
        }
    }
}

fn groups(member: Group, meets: Group) -> InteractionGroups {
    InteractionGroups { memberships: member, filter: meets, ..InteractionGroups::all() }
}

fn body_of(lump: &Lump) -> RigidBodyBuilder {
    let columns = lump.inertia_kgm2.column_iter().map(|column| vector_to_engine(&column.into_owned()));
    let [x, y, z]: [_; 3] = std::array::from_fn({
        let columns: Vec<_> = columns.collect();
        move |axis| columns[axis]
    });
    RigidBodyBuilder::dynamic().can_sleep(false).additional_mass_properties(
        MassProperties::with_inertia_matrix(
            point_to_engine(&lump.center_of_mass),
            lump.mass_kg,
            Matrix::from_cols(x, y, z),
        ),
    )
}

fn calf_from_foot(robot: &Robot, leg: usize, calf: &str) -> Pose {
    let foot = robot.frame(&format!("{}_foot", go1::LEGS[leg]));
    let calf = robot.frame(calf);
    calf.zip(foot).map_or(Pose::translation(0.0, 0.0, -go1::CALF_M), |(calf, foot)| calf.inverse() * foot)
}
