//! What every body in rapier shares: the engine's settings, the world as colliders, hinges, forces, contacts.

use super::{outline, soil, tag, untag};
use crate::axes::{from_engine, point_to_engine, to_engine, vector_from_engine, vector_to_engine};
use arborloop_base::{Contact, Pose};
use arborloop_robots::{Joint, Lump};
use arborloop_worlds::World;
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rapier3d_f64::prelude::{
    ColliderBuilder, ColliderHandle, FrictionModel, GenericJoint, GenericJointBuilder, Group,
    InteractionGroups, JointAxesMask, JointAxis, MassProperties, Matrix, MultibodyJointHandle, PhysicsWorld,
    RigidBodyBuilder, RigidBodyHandle,
};
use std::collections::BTreeSet;

/// Standard gravity, m/s2.
pub(super) const GRAVITY_MPS2: f64 = 9.806_65;
/// Who meets whom: the robot's parts meet the ground and what stands on it, never each other. Limbs do not meet the
/// ground: knees and shins of a standing robot are above it, and a fallen one lies on its trunk.
pub(super) const ROBOT: Group = Group::GROUP_1;
pub(super) const GROUND: Group = Group::GROUP_2;
pub(super) const SOLIDS: Group = Group::GROUP_3;

/// The engine with everything spelled out that the walk relies on.
pub(super) fn engine(tick_s: f64, substeps: usize) -> PhysicsWorld {
    let mut engine = PhysicsWorld::new();
    engine.gravity = vector_to_engine(&Vector3::new(0.0, 0.0, -GRAVITY_MPS2));
    let parameters = &mut engine.integration_parameters;
    parameters.dt = tick_s;
    parameters.num_solver_iterations = substeps;
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
pub(super) fn place_world(engine: &mut PhysicsWorld, world: &World, friction: f64) {
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

pub(super) fn groups(member: Group, meets: Group) -> InteractionGroups {
    InteractionGroups { memberships: member, filter: meets, ..InteractionGroups::all() }
}

pub(super) fn body_of(lump: &Lump) -> RigidBodyBuilder {
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

/// A hinge between a body that stands in a parent link's frame and a child link, limited if so wanted and known.
pub(super) fn hinge(joint: &Joint, parent_from_body: &Pose, limited: bool) -> GenericJoint {
    // The engine's hinge turns about the x axis of its own frames.
    let hinge = UnitQuaternion::rotation_between(&Vector3::x(), &joint.axis)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI));
    let hinge = Pose::from_parts(Translation3::identity(), hinge);
    let mut built = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
        .contacts_enabled(false)
        .local_frame1(to_engine(&(parent_from_body.inverse() * joint.parent_from_child * hinge)))
        .local_frame2(to_engine(&hinge));
    if let Some(limits) = joint.limits.filter(|_| limited) {
        built = built.limits(JointAxis::AngX, [limits.low, limits.high]);
    }
    built.build()
}

/// Puts a multibody down elsewhere as it is: `bodies` are those that hang on the root with their joints, velocities turn
/// with them.
pub(super) fn carry(
    engine: &mut PhysicsWorld,
    root: RigidBodyHandle,
    joint: MultibodyJointHandle,
    bodies: &[RigidBodyHandle],
    moved: &Pose,
) {
    let turned = |vector: Vector3<f64>| vector_to_engine(&(moved.rotation * vector));
    for handle in bodies.iter().chain([&root]) {
        let Some(body) = engine.bodies.get_mut(*handle) else { continue };
        let (linear, angular) = (vector_from_engine(&body.linvel()), vector_from_engine(&body.angvel()));
        body.set_linvel(turned(linear), false);
        body.set_angvel(turned(angular), false);
    }
    if let Some(root) = engine.bodies.get_mut(root) {
        let pose = moved * from_engine(root.position());
        root.set_position(to_engine(&pose), false);
    }
    let Some((body, _)) = engine.multibody_joints.get_mut(joint) else { return };
    // The free root's coordinates come first: three of its velocity, three of its turn rate, world axes.
    let mut speeds = body.generalized_velocity_mut();
    for first in [0, 3] {
        let vector = moved.rotation * Vector3::from_fn(|axis, _| speeds[first + axis]);
        (0..3).for_each(|axis| speeds[first + axis] = vector[axis]);
    }
    body.forward_kinematics(&engine.bodies, true);
    body.update_rigid_bodies(&mut engine.bodies, true);
}

/// Mean force of everything on a collider over the last tick, world axes, N.
pub(super) fn force_on(engine: &PhysicsWorld, collider: ColliderHandle, tick_s: f64) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for pair in engine.narrow_phase.contact_pairs_with(collider) {
        let sign = if pair.collider2 == collider { 1.0 } else { -1.0 };
        for manifold in pair.solver_manifolds() {
            let normal = vector_from_engine(&manifold.data.normal);
            for point in &manifold.points {
                let data = &point.data;
                // The engine keeps friction as a vector for its last substep only: scaled up to all of them.
                let share =
                    if data.warmstart_impulse > 0.0 { data.impulse / data.warmstart_impulse } else { 0.0 };
                let aside = vector_from_engine(&data.warmstart_tangent_world) * share;
                sum += (normal * data.impulse - aside) * sign;
            }
        }
    }
    sum / tick_s
}

/// Solid things that the robot touches; the ground is none of them; sorted.
pub(super) fn touching(engine: &PhysicsWorld, parts: &[(String, ColliderHandle)]) -> Vec<Contact> {
    let mut contacts = BTreeSet::new();
    for (part, collider) in parts {
        for pair in engine.narrow_phase.contact_pairs_with(*collider) {
            let touches = pair.manifolds().iter().flat_map(|one| &one.points).any(|p| p.dist <= 0.0);
            let other = if pair.collider1 == *collider { pair.collider2 } else { pair.collider1 };
            let met = engine.colliders.get(other).and_then(|one| untag(one.user_data));
            if let (true, Some((class, instance))) = (touches, met) {
                contacts.insert(Contact { part: part.clone(), class, instance });
            }
        }
    }
    contacts.into_iter().collect()
}
