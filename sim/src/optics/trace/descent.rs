//! A list of rays on its way down: packets through the upper tree, into each plant's frame, through its own tree.

use super::ease::{AtRest, Ease, Poses, Prepare, Swaying};
use super::lanes::{Isa, Lanes};
use super::moment::Knots;
use super::node::Child;
use super::walk::{self, Beams, Expect, Met, Nearest, Pending, Visit};
use super::{Found, Grown, PLANT, SHOOT, SOLID, Scene, Surface, TILE, Worker, packet, simd};
use crate::optics::Ray;
use arborloop_base::Time;
use arborloop_worlds::World;
use nalgebra::Point3;

/// Tracing a list of rays, packet by packet.
pub(super) struct Tracing<'a> {
    pub(super) scene: &'a Scene,
    pub(super) world: &'a World,
    pub(super) rays: &'a [Ray],
    pub(super) worker: &'a mut Worker,
    pub(super) found: &'a mut [Option<Found>],
}

impl simd::Job for Tracing<'_> {
    type Out = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let mut done = 0;
        while done < self.rays.len() {
            let end = (done / packet::GROUP + 1) * packet::GROUP;
            let packet = packet::first(&self.rays[done..end.min(self.rays.len())]);
            let wide = packet.wide::<I>();
            let mut nearest = Nearest::<I>::new(wide.begin, wide.end);
            let origin = packet.origin - self.scene.center;
            let origin = [origin.x as f32, origin.y as f32, origin.z as f32];
            let beams = Beams::<I>::new(origin, wide.direction, wide.mask);
            let Worker { knots, fitted, stack, poses } = &mut *self.worker;
            let mut visit = InWorld {
                scene: self.scene,
                world: self.world,
                packet_origin: packet.origin,
                stamp: packet.stamp,
                beams: &beams,
                knots,
                poses,
            };
            let top = fitted.at(self.scene, self.world, packet.stamp);
            walk::walk(top, &beams, wide.mask, &mut AtRest, &mut nearest, stack, &mut visit);
            let mut ranges = [0.0_f32; packet::GROUP];
            nearest.range.sub(wide.ahead).store(&mut ranges);
            let mut lane = 0;
            while lane < packet.rays.len() {
                let Met { place, part } = nearest.met[lane];
                let found = Found { range_m: ranges[lane], place, part };
                self.found[done + lane] = if place == Met::NOTHING.place { None } else { Some(found) };
                lane += 1;
            }
            done += packet.rays.len();
        }
    }
}

impl Scene {
    /// The surface that was found.
    #[inline(always)]
    pub(in crate::optics) fn surface(&self, found: &Found) -> Surface {
        let part = found.part as usize;
        match found.place {
            Met::GROUND => Surface::Soil { facet: self.soil.facet(found.part) },
            Met::SOLID => Surface::Solid { index: part },
            plant if found.part & Met::BRANCH != 0 => {
                Surface::Branch { plant: plant as usize, branch: part & !(Met::BRANCH as usize) }
            }
            plant => Surface::Leaf { plant: plant as usize, leaf: part },
        }
    }
}

/// The upper tree's items.
struct InWorld<'a, I: Isa> {
    scene: &'a Scene,
    world: &'a World,
    packet_origin: Point3<f64>,
    stamp: Time,
    beams: &'a Beams<I>,
    knots: &'a mut Knots,
    poses: &'a mut [Poses],
}

impl<I: Isa> Visit<I, AtRest> for InWorld<'_, I> {
    #[inline(always)]
    fn visit(
        &mut self,
        _: &AtRest,
        child: Child,
        mask: u32,
        nearest: &mut Nearest<I>,
        stack: &mut Vec<Pending>,
    ) {
        let index = child.index();
        match child.kind() {
            TILE => self.scene.soil.meet(index, self.beams, mask, nearest),
            SOLID => {
                let met = Met { place: Met::SOLID, part: index as u32 };
                self.scene.solids[index].meet(self.beams, mask, met, nearest);
            }
            _ => self.enter(index, mask, nearest, stack),
        }
    }
}

impl<I: Isa> Expect<AtRest> for InWorld<'_, I> {
    #[inline(always)]
    fn expect(&mut self, _: &AtRest, child: Child, _: usize) {
        if child.kind() == PLANT {
            if self.world.wind.blows() {
                self.knots.foresee(self.scene, self.world, child.index(), self.stamp);
            } else {
                simd::prefetch(&self.scene.plants[child.index()].plant_from_world);
            }
        }
    }
}

impl<I: Isa> InWorld<'_, I> {
    /// Turns the packet into a plant's frame, its directions scaled alike, so that distances stay the world's.
    #[inline(always)]
    fn enter(&mut self, index: usize, mask: u32, nearest: &mut Nearest<I>, stack: &mut Vec<Pending>) {
        let (scene, all, packet_origin) = (self.scene, self.beams, self.packet_origin);
        let (map, flutter, prototype) = if self.world.wind.blows() {
            let moment = self.knots.near(scene, self.world, index, self.stamp);
            (&moment.plant_from_world, Some(&moment.flutter), moment.prototype)
        } else {
            let standing = &scene.plants[index];
            (&standing.plant_from_world, None, standing.prototype)
        };
        let grown = &scene.grown[prototype as usize];
        let origin = map.point(&packet_origin);
        let mut direction = all.direction;
        let mut axis = 0;
        while axis < 3 {
            let [x, y, z, _] = map.0[axis];
            let [dx, dy, dz] = all.direction;
            direction[axis] = dz.fma(
                I::Wide::splat(z as f32),
                dy.fma(I::Wide::splat(y as f32), dx.mul(I::Wide::splat(x as f32))),
            );
            axis += 1;
        }
        let origin = [origin.x as f32, origin.y as f32, origin.z as f32];
        let beams = Beams::<I>::new(origin, direction, mask);
        let (place, beams) = (index as u32, &beams);
        match flutter {
            Some(flutter) => {
                let mut ease = Swaying::new(&grown.mobility, flutter, grown.half_v_m_max, self.poses);
                let mut visit = InPlant { grown, place, beams };
                walk::walk(&grown.nodes, beams, mask, &mut ease, nearest, stack, &mut visit);
            }
            None => {
                let mut visit = InPlant { grown, place, beams };
                walk::walk(&grown.nodes, beams, mask, &mut AtRest, nearest, stack, &mut visit);
            }
        }
    }
}

/// A prototype's items.
struct InPlant<'a, I: Isa> {
    grown: &'a Grown,
    place: u32,
    beams: &'a Beams<I>,
}

impl<I: Isa, E: Ease<I>> Visit<I, E> for InPlant<'_, I> {
    #[inline(always)]
    fn visit(
        &mut self,
        ease: &E,
        child: Child,
        mask: u32,
        nearest: &mut Nearest<I>,
        stack: &mut Vec<Pending>,
    ) {
        let (index, place) = (child.index(), self.place);
        if child.kind() == SHOOT {
            let Grown { shoots, spurs, .. } = self.grown;
            let shoot = &shoots[index];
            shoot.meet(index, spurs, ease.pose(shoot.seat()), self.beams, mask, place, nearest, stack);
        } else {
            let met = Met { place, part: Met::BRANCH | index as u32 };
            self.grown.branches[index].meet(self.beams, mask, met, nearest);
        }
    }
}

impl<I: Isa, E: Prepare> Expect<E> for InPlant<'_, I> {
    #[inline(always)]
    fn expect(&mut self, ease: &E, child: Child, seat: usize) {
        if child.kind() == SHOOT {
            self.grown.shoots[child.index()].expect(ease.pose(seat));
        }
    }
}
