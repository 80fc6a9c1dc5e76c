//! What a body touches: the robot's parts against cones and trunks, in rapier. Leaves and grass stop no robot.
//!
//! A kinematic gait moves the body, so rapier only finds contacts here, once a tick. Where physics moves the body,
//! [`PhysicsGait`] or [`WheeledGait`] has an engine of its own, and what is touched pushes back.

mod cart;
mod engine;
mod legged;
mod plant;
mod soil;
mod tire;
mod tread;
mod wheeled;

pub use legged::PhysicsGait;
pub use wheeled::WheeledGait;

use crate::axes::{point_to_engine, to_engine};
use arborloop_base::{Class, Contact, Pose};
use arborloop_robots::{TrunkState, go1};
use arborloop_worlds::{Frustum, World};
use nalgebra::{Point3, Vector3};
use rapier3d_f64::prelude::{
    ActiveCollisionTypes, ColliderBuilder, ColliderHandle, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle,
};
use std::collections::BTreeSet;

/// Corners of the polygon around a round solid; it stays inside the circle by 2 % of the radius at the most.
const CORNERS: usize = 16;

/// Finds what a body that something else moves touches.
pub(crate) struct Touch {
    engine: PhysicsWorld,
    parts: Vec<Part>,
}

struct Part {
    name: &'static str,
    body: RigidBodyHandle,
    collider: ColliderHandle,
    place: Place,
}

/// What a part hangs on.
enum Place {
    Trunk,
    Foot(usize),
}

impl Touch {
    pub(crate) fn new(world: &World, state: &TrunkState, tick_s: f64) -> Self {
        let mut engine = PhysicsWorld::new();
        engine.integration_parameters.dt = tick_s;
        for solid in &world.solids {
            let corners: Vec<_> = outline(&solid.shape).iter().map(point_to_engine).collect();
            // A disc or a needle has no volume, hence no hull: nothing to bump into.
            if let Some(hull) = ColliderBuilder::convex_hull(&corners) {
                engine.insert_collider(hull.user_data(tag(solid.class, solid.instance)), None);
            }
        }
        let trunk = go1::body_shapes().into_iter().map(|shape| {
            let half = shape.half_extents_m;
            let cuboid =
                ColliderBuilder::cuboid(half.x, half.y, half.z).position(to_engine(&shape.base_from_shape));
            (shape.part, cuboid, Place::Trunk)
        });
        let feet = (0..4).map(|leg| (FEET[leg], ColliderBuilder::ball(go1::FOOT_RADIUS_M), Place::Foot(leg)));
        let parts = trunk
            .chain(feet)
            .map(|(name, collider, place)| {
                let body = RigidBodyBuilder::kinematic_position_based().pose(to_engine(&place.pose(state)));
                let types = ActiveCollisionTypes::default() | ActiveCollisionTypes::KINEMATIC_FIXED;
                let (body, collider) = engine.insert(body, collider.active_collision_types(types));
                Part { name, body, collider, place }
            })
            .collect();
        Touch { engine, parts }
    }

    /// Puts the robot where its gait says, and tells what it touches there; sorted.
    pub(crate) fn step(&mut self, state: &TrunkState) -> Vec<Contact> {
        for part in &self.parts {
            if let Some(body) = self.engine.bodies.get_mut(part.body) {
                body.set_position(to_engine(&part.place.pose(state)), true);
            }
        }
        self.engine.step();
        let mut contacts = BTreeSet::new();
        for part in &self.parts {
            for pair in self.engine.narrow_phase.contact_pairs_with(part.collider) {
                let touching = pair
                    .manifolds()
                    .iter()
                    .flat_map(|manifold| &manifold.points)
                    .any(|point| point.dist <= 0.0);
                let other = if pair.collider1 == part.collider { pair.collider2 } else { pair.collider1 };
                let Some((class, instance)) =
                    self.engine.colliders.get(other).and_then(|c| untag(c.user_data))
                else {
                    continue;
                };
                if touching {
                    contacts.insert(Contact { part: part.name.into(), class, instance });
                }
            }
        }
        contacts.into_iter().collect()
    }
}

const FEET: [&str; 4] = ["FR_foot", "FL_foot", "RR_foot", "RL_foot"];

impl Place {
    fn pose(&self, state: &TrunkState) -> Pose {
        match self {
            Place::Trunk => state.world_from_base,
            Place::Foot(leg) => {
                Pose::from_parts(state.feet_world[*leg].into(), nalgebra::UnitQuaternion::identity())
            }
        }
    }
}

fn tag(class: Class, instance: u32) -> u128 {
    // Zero is the engine's "no data": classes are shifted by one.
    (u128::from(class as u8) + 1) << 32 | u128::from(instance)
}

fn untag(data: u128) -> Option<(Class, u32)> {
    [Class::Cone, Class::Trunk, Class::Branch, Class::Post, Class::Wire]
        .into_iter()
        .find(|class| u128::from(*class as u8) + 1 == data >> 32)
        .map(|class| (class, data as u32))
}

fn outline(shape: &Frustum) -> Vec<Point3<f64>> {
    let axis = shape.axis.into_inner();
    let aside = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let u = axis.cross(&aside).normalize();
    let v = axis.cross(&u);
    let ring = |along: f64, radius: f64| {
        (0..CORNERS).map(move |corner| {
            let (sin, cos) = (corner as f64 / CORNERS as f64 * std::f64::consts::TAU).sin_cos();
            shape.base + axis * along + (u * cos + v * sin) * radius
        })
    };
    ring(0.0, shape.radius_base_m).chain(ring(shape.height_m, shape.radius_top_m)).collect()
}
