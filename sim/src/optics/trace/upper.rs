//! The upper tree: where plants, solids and tiles of soil stand, with boxes that fit what they fill for a while.
//!
//! In the wind the boxes are fitted anew for each stretch of [`STRETCH_NS`], as wide as plants can drift in it; the
//! tree's shape stays. Stretches stand at fixed instants and boxes only decide what it costs to find a surface, so
//! neither packets nor threads have a say in the result.

use super::super::boxes::Aabb;
use super::node::{self, Child, Node};
use super::{PLANT, Scene};
use arborloop_base::{Span, Time};
use arborloop_worlds::wind::Drift;
use arborloop_worlds::{Hinge, World};

/// A gust takes seconds to grow; fitting the boxes of a thousand plants takes as long as tracing a thousand rays.
const STRETCH_NS: i64 = 200_000_000;
/// Packets and knots at a stretch's border are less than this outside of it.
const BORDER: Span = Span::from_millis(4);
/// A stretch that no instant is in.
const NEVER: i64 = i64::MIN;
/// Stretches that are remembered: beams from both sides of a border may take turns.
const KEPT: usize = 2;

/// The tree, with everything at rest.
#[derive(Debug)]
pub(super) struct Upper {
    nodes: Vec<Node>,
    /// What each child of each node is among the items.
    items: Vec<[u32; 8]>,
    /// Where the items are at rest, seen from the scene's center.
    bounds: Vec<Aabb>,
    /// Around all of each node at rest.
    wholes: Vec<Aabb>,
    /// Nodes with a plant in them or below, last ones first: all that wind moves.
    moving: Vec<u32>,
}

/// The tree as it was fitted last. One per thread.
#[derive(Debug)]
pub(super) struct Fitted {
    stretches: [(i64, Vec<Node>); KEPT],
    /// Around all of each node.
    wholes: Vec<Aabb>,
}

impl Upper {
    pub(super) fn new(bounds: Vec<Aabb>, children: &[Child]) -> Self {
        let numbered: Vec<Child> = (0..children.len()).map(|item| Child::new(1, item)).collect();
        let mut nodes = node::tree(&bounds, &numbered);
        let mut items = vec![[0; 8]; nodes.len()];
        for (node, items) in nodes.iter_mut().zip(&mut items) {
            for (slot, child) in node.things().filter(|(_, child)| child.kind() != Child::NODE) {
                items[slot] = child.index() as u32;
                node.children[slot] = children[child.index()];
            }
        }
        let (mut wholes, mut moves) = (vec![Aabb::empty(); nodes.len()], vec![false; nodes.len()]);
        for (index, node) in nodes.iter().enumerate().rev() {
            for (slot, child) in node.things() {
                let node = child.kind() == Child::NODE;
                moves[index] |= if node { moves[child.index()] } else { child.kind() == PLANT };
                let part = if node { &wholes[child.index()] } else { &bounds[items[index][slot] as usize] };
                wholes[index] = wholes[index].with(part);
            }
        }
        let moving = (0..nodes.len() as u32).rev().filter(|&index| moves[index as usize]).collect();
        Upper { nodes, items, bounds, wholes, moving }
    }

    /// Nothing is remembered where nothing moves.
    pub(super) fn fitted(&self, world: &World) -> Fitted {
        let moves = world.wind.blows();
        let copy = || if moves { self.nodes.clone() } else { Vec::new() };
        let wholes = if moves { self.wholes.clone() } else { Vec::new() };
        Fitted { stretches: std::array::from_fn(|_| (NEVER, copy())), wholes }
    }

    /// Memory, bytes.
    pub(super) fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
            + self.items.capacity() * size_of::<[u32; 8]>()
            + (self.bounds.capacity() + self.wholes.capacity()) * size_of::<Aabb>()
            + self.moving.capacity() * size_of::<u32>()
    }
}

impl Fitted {
    /// The tree for an instant.
    #[inline(always)]
    pub(super) fn at<'a>(&'a mut self, scene: &'a Scene, world: &World, stamp: Time) -> &'a [Node] {
        if !world.wind.blows() {
            return &scene.upper.nodes;
        }
        let number = stamp.nanos().div_euclid(STRETCH_NS);
        let slot = number as usize % KEPT;
        if self.stretches[slot].0 != number {
            self.fit(scene, world, number);
        }
        &self.stretches[slot].1
    }

    #[cold]
    #[inline(never)]
    fn fit(&mut self, scene: &Scene, world: &World, number: i64) {
        let (known, nodes) = &mut self.stretches[number as usize % KEPT];
        *known = number;
        let begin = Time::from_nanos(number * STRETCH_NS);
        let from_s = (begin - BORDER).seconds();
        let to_s = (begin + Span::from_nanos(STRETCH_NS) + BORDER).seconds();
        let upper = &scene.upper;
        // Limbs of one tree drift alike.
        let mut last: Option<(Hinge, Drift)> = None;
        for index in upper.moving.iter().map(|&index| index as usize) {
            let node = &mut nodes[index];
            let mut parts = [Aabb::empty(); 8];
            for (slot, child) in node.things() {
                parts[slot] = match child.kind() {
                    Child::NODE => self.wholes[child.index()],
                    PLANT => {
                        let plant = &world.plants[child.index()];
                        let drift = match &last {
                            Some((hinge, drift)) if alike(hinge, &plant.hinge) => *drift,
                            _ => world.wind.drift_between(plant, from_s, to_s),
                        };
                        last = Some((plant.hinge, drift));
                        scene.filled(world, child.index(), &drift)
                    }
                    _ => upper.bounds[upper.items[index][slot] as usize],
                };
            }
            self.wholes[index] = parts.iter().fold(Aabb::empty(), |all, part| all.with(part));
            node.fit(&self.wholes[index], &parts);
        }
    }
}

fn alike(one: &Hinge, other: &Hinge) -> bool {
    one.foot == other.foot && one.height_m == other.height_m
}
