//! The packet tracer: which surface each beam meets first. Single precision, two levels, wind by moving the beam.
//!
//! The upper tree stands in the world and holds plants, solids and tiles of soil; below it each prototype has one tree of
//! shoots and branches, shared by all plants grown from it. Both are built once. A plant that sways is met by turning
//! the packet into its moved frame, and the boxes in it are moved and held wider as the wind has it at that moment.
//! What is met, and nothing else, is decided here; distances come from [`super::exact`].

mod descent;
mod ease;
mod flutter;
mod ground;
mod lanes;
mod moment;
mod node;
mod packet;
mod patch;
mod pole;
mod shoot;
mod simd;
mod spur;
mod upper;
mod walk;

use super::boxes::Aabb;
use super::soil::Facet;
use super::{Ray, surface};
use arborloop_base::Time;
use arborloop_worlds::wind::{Drift, LEAVES_PER_SHOOT, shoot_direction};
use arborloop_worlds::{Leaf, Plant, Prototype, World};
use ease::{Mobility, Poses};
use ground::Soil;
pub(super) use lanes::Isa;
use moment::Knots;
pub(super) use moment::{Between, Map};
use nalgebra::{Affine3, Point3, Similarity3, Vector3};
use node::{Child, Node};
use pole::Pole;
use shoot::Shoot;
pub use simd::InstructionSet;
pub(super) use simd::{Job, run};
pub(crate) use simd::{Loops, spread};
use spur::Spur;
use upper::{Fitted, Upper};
use walk::Pending;

/// Boxes are this much wider than what is in them, meters: more than single precision loses at a kilometer.
const MARGIN_M: f32 = 3e-4;
const PLANT: u32 = 1;
const SOLID: u32 = 2;
const TILE: u32 = 3;
const SHOOT: u32 = 1;
const BRANCH: u32 = 2;
const SPUR: u32 = 3;
/// Branches enter their tree in pieces of about this length, meters: a long slanting one would fill a large box.
const PIECE_M: f64 = 0.3;

/// A world's surfaces, sorted.
#[derive(Debug)]
pub(super) struct Scene {
    isa: InstructionSet,
    loops: InstructionSet,
    /// Single-precision coordinates are seen from here.
    center: Point3<f64>,
    upper: Upper,
    soil: Soil,
    solids: Vec<Pole>,
    plants: Vec<Standing>,
    grown: Vec<Grown>,
}

/// A plant at rest. What the tracer reads comes first, in two lines of memory.
#[derive(Debug)]
#[repr(C, align(64))]
struct Standing {
    plant_from_world: Map,
    prototype: u32,
    world_from_plant: Map,
    /// Around all of it, seen from the scene's center.
    resting: Aabb,
    /// The same with all leaves turned as far to both sides as can be, then with all shoots as far to both sides as they
    /// ever shift besides.
    turned: Aabb,
    blown: Aabb,
    /// How far that is, meters.
    shoot_m_max: f64,
}

/// A prototype.
#[derive(Debug)]
struct Grown {
    nodes: Vec<Node>,
    /// One for each node.
    mobility: Vec<Mobility>,
    shoots: Vec<Shoot>,
    spurs: Vec<Spur>,
    branches: Vec<Pole>,
    /// No leaf reaches farther than this from its `half_u`, meters.
    half_v_m_max: f32,
}

/// What one thread needs to trace; kept from sweep to sweep.
#[derive(Debug)]
pub(super) struct Worker {
    knots: Knots,
    fitted: Fitted,
    stack: Vec<Pending>,
    /// Where the shoots of the plant that is looked at are, node by node.
    poses: Vec<Poses>,
}

/// A surface that a beam meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Surface {
    Soil { facet: Facet },
    Solid { index: usize },
    Leaf { plant: usize, leaf: usize },
    Branch { plant: usize, branch: usize },
}

/// What a beam meets, and where about: the range is from the beam's own origin and good to a tenth of a millimeter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    pub(super) surface: Surface,
    pub(super) range_m: f64,
}

/// What the tracer itself answers: which surface a beam meets, and how far away in single precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// From the beam's own origin, meters.
    pub range_m: f32,
    /// The plant's index among the world's, or one of the two greatest numbers below `u32::MAX`: soil and solids.
    pub place: u32,
    /// Which leaf or branch, solid or triangle of the soil.
    pub part: u32,
}

impl Scene {
    pub(super) fn new(world: &World) -> Self {
        let bounds = world.terrain.bounds();
        let middle = nalgebra::center(&bounds.low, &bounds.high);
        let center = Point3::new(middle.x, middle.y, 0.0);
        let (grown, parts): (Vec<Grown>, Vec<Vec<Part>>) = world.prototypes.iter().map(Grown::new).unzip();
        let mut scene = Scene {
            isa: InstructionSet::fastest_to_trace(),
            loops: InstructionSet::widest(),
            center,
            upper: Upper::new(Vec::new(), &[]),
            soil: Soil::new(&world.terrain, &center),
            solids: world.solids.iter().map(|solid| Pole::new(&solid.shape, &center)).collect(),
            plants: world
                .plants
                .iter()
                .map(|plant| {
                    Standing::new(
                        plant,
                        &parts[plant.prototype],
                        &center,
                        world.wind.drift_max(plant).shoot_m,
                    )
                })
                .collect(),
            grown,
        };
        let (mut boxes, mut children) = scene.soil.tiles(TILE);
        for (index, solid) in world.solids.iter().enumerate() {
            let bounds = surface::frustum_bounds(&solid.shape);
            boxes.push(bounds.transformed(|corner| Point3::from(corner - center)));
            children.push(Child::new(SOLID, index));
        }
        for index in 0..world.plants.len() {
            boxes.push(scene.plants[index].resting);
            children.push(Child::new(PLANT, index));
        }
        scene.upper = Upper::new(boxes, &children);
        scene
    }

    pub(super) fn set_instruction_set(&mut self, isa: InstructionSet) {
        (self.isa, self.loops) = (isa, isa);
    }

    /// For loops that are not part of the tracing.
    pub(super) fn loops(&self) -> InstructionSet {
        self.loops
    }

    pub(super) fn worker(&self, world: &World) -> Worker {
        let nodes = self.grown.iter().map(|grown| grown.nodes.len()).max().unwrap_or(0);
        Worker {
            knots: Knots::new(self, world),
            fitted: self.upper.fitted(world),
            stack: Vec::with_capacity(256),
            poses: vec![Poses::default(); if world.wind.blows() { nodes } else { 0 }],
        }
    }

    /// What each ray meets first, in order; `found` is as long as `rays`.
    pub(super) fn trace(
        &self,
        world: &World,
        rays: &[Ray],
        worker: &mut Worker,
        found: &mut [Option<Found>],
    ) {
        assert_eq!(rays.len(), found.len(), "one answer a ray");
        simd::run(self.isa, descent::Tracing { scene: self, world, rays, worker, found });
    }

    /// Where a plant is at an instant, in a world where the wind blows.
    #[inline(always)]
    pub(super) fn swaying<'a>(
        &self,
        world: &World,
        index: usize,
        stamp: Time,
        worker: &'a mut Worker,
    ) -> Between<'a> {
        worker.knots.at(self, world, index, stamp)
    }

    /// From the world to a plant at an instant.
    pub(super) fn plant_from_world(
        &self,
        world: &World,
        index: usize,
        stamp: Time,
        worker: &mut Worker,
    ) -> Map {
        match world.wind.blows() {
            true => self.swaying(world, index, stamp, worker).plant_from_world(),
            false => *self.at_rest(index),
        }
    }

    /// Where a leaf of a plant's prototype is at an instant, plant frame: see [`arborloop_worlds::Sway::leaf`], which this
    /// repeats from sines that are known, to ten micrometers.
    #[inline(always)]
    pub(super) fn leaf_at(&self, plant: usize, leaf: usize, rest: &Leaf, moment: &Between) -> Leaf {
        let grown = &self.grown[self.plants[plant].prototype as usize];
        let shoot = leaf / LEAVES_PER_SHOOT;
        grown.shoots[shoot].leaf_at(shoot, rest, moment)
    }

    /// The box of all that a plant fills while it drifts no farther than this, seen from the scene's center.
    fn filled(&self, world: &World, index: usize, drift: &Drift) -> Aabb {
        let Standing { resting, turned, blown, shoot_m_max, .. } = &self.plants[index];
        if !resting.is_real() {
            return *resting;
        }
        // Sides are convex in how far shoots shift and leaves turn together.
        let shift = if *shoot_m_max > 0.0 { drift.shoot_m / shoot_m_max } else { 0.0 };
        let turn = (drift.leaf_rad.sin() / shoot::LEAF_SIN_MAX).max(shift);
        let side = |resting: &Point3<f64>, turned: &Point3<f64>, blown: &Point3<f64>| {
            resting + (turned - resting) * (turn - shift) + (blown - resting) * shift + self.center.coords
        };
        let corners =
            [side(&resting.low, &turned.low, &blown.low), side(&resting.high, &turned.high, &blown.high)];
        let [low, high] = world.wind.swept(index, drift, corners);
        Aabb { low: low - self.center.coords, high: high - self.center.coords }
    }

    /// From a resting plant's frame to the world.
    pub(super) fn world_from_resting(&self, plant: usize) -> &Map {
        &self.plants[plant].world_from_plant
    }

    /// Where a plant rests.
    pub(super) fn at_rest(&self, index: usize) -> &Map {
        &self.plants[index].plant_from_world
    }

    /// Memory of the structure, bytes.
    pub(super) fn bytes(&self) -> usize {
        fn of<T>(all: &Vec<T>) -> usize {
            all.capacity() * size_of::<T>()
        }
        let grown = |one: &Grown| {
            of(&one.nodes) + of(&one.mobility) + of(&one.shoots) + of(&one.spurs) + of(&one.branches)
        };
        let shared: usize = self.grown.iter().map(grown).sum();
        self.upper.bytes() + self.soil.bytes() + of(&self.solids) + of(&self.plants) + shared
    }
}

impl Standing {
    /// `shoot_m_max` is how far shoots ever shift, world meters.
    fn new(plant: &Plant, parts: &[Part], center: &Point3<f64>, shoot_m_max: f64) -> Self {
        let map = |pose: &Similarity3<f64>| Map::new(&Affine3::from_matrix_unchecked(pose.to_homogeneous()));
        let world_from_plant = &plant.world_from_plant;
        let (mut resting, mut turned, mut blown) = (Aabb::empty(), Aabb::empty(), Aabb::empty());
        for part in parts {
            let [rest, turn] = [part.rest, part.turned]
                .map(|bounds| bounds.transformed(|corner| world_from_plant * corner - center.coords));
            let along = world_from_plant.isometry.rotation * part.along;
            resting = resting.with(&rest);
            turned = turned.with(&turn);
            blown = blown.with(&turn.grown(&(along.abs() * shoot_m_max)));
        }
        Standing {
            prototype: plant.prototype as u32,
            plant_from_world: map(&world_from_plant.inverse()),
            world_from_plant: map(world_from_plant),
            resting,
            turned,
            blown,
            shoot_m_max,
        }
    }
}

/// A box of things that move together, plant frame.
struct Part {
    rest: Aabb,
    /// The same with leaves turned as far to both sides as can be.
    turned: Aabb,
    /// The line along which the wind moves it; zero if it does not.
    along: Vector3<f64>,
}

impl Grown {
    /// With the boxes of everything in it.
    fn new(prototype: &Prototype) -> (Self, Vec<Part>) {
        let (mut shoots, mut boxes, spurs) = shoot::shoots(&prototype.leaves);
        let mut children: Vec<Child> = (0..shoots.len()).map(|index| Child::new(SHOOT, index)).collect();
        for (index, branch) in prototype.branches.iter().enumerate() {
            let pieces = (branch.height_m / PIECE_M).ceil().clamp(1.0, 64.0) as usize;
            for piece in 0..pieces {
                let at = |n: usize| branch.height_m * n as f64 / pieces as f64;
                // A disc without height has no parts.
                let part = if pieces == 1 { *branch } else { branch.part(at(piece), at(piece + 1)) };
                boxes.push(surface::frustum_bounds(&part));
                children.push(Child::new(BRANCH, index));
            }
        }
        let half_v_m = prototype.leaves.iter().map(|leaf| leaf.half_v.norm());
        let half_v_m_max = half_v_m.fold(1e-9, f64::max) as f32;
        let nodes = node::tree(&boxes, &children);
        for (index, node) in nodes.iter().enumerate() {
            for (slot, child) in node.things().filter(|(_, child)| child.kind() == SHOOT) {
                shoots[child.index()].sit(8 * index + slot);
            }
        }
        let mobility = |node: &Node| Mobility::new(node, &shoots, &prototype.leaves, half_v_m_max);
        let along = |index: usize| shoots.get(index).map_or(Vector3::zeros(), |_| shoot_direction(index));
        let parts = boxes.iter().enumerate().filter(|(_, rest)| rest.is_real());
        let parts = parts.map(|(index, rest)| {
            let turned = if index < shoots.len() { shoot::turned(index, &prototype.leaves) } else { *rest };
            Part { rest: *rest, turned, along: along(index) }
        });
        let parts = parts.collect();
        let grown = Grown {
            mobility: nodes.iter().map(mobility).collect(),
            nodes,
            shoots,
            spurs,
            branches: prototype.branches.iter().map(|branch| Pole::new(branch, &Point3::origin())).collect(),
            half_v_m_max,
        };
        (grown, parts)
    }
}

#[cfg(test)]
mod tests;
