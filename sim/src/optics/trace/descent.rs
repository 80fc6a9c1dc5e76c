//! A list of rays on its way down: packets through the upper tree, into each plant's frame, through its own tree.

use super::ease::{AtRest, Swaying};
use super::flutter::Flutter;
use super::lanes::{Isa, Lanes};
use super::moment::Knots;
use super::node::Child;
use super::walk::{self, Beams, Foresee, Met, Nearest, Pending, Visit};
use super::{Found, Grown, PLANT, SHOOT, SOLID, SPUR, Scene, Surface, TILE, Worker, packet, simd};
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
            let Worker { knots, fitted, stack } = &mut *self.worker;
            let mut visit = InWorld {
                scene: self.scene,
                world: self.world,
                packet_origin: packet.origin,
                stamp: packet.stamp,
                beams: &beams,
                knots,
            };
            let top = fitted.at(self.scene, self.world, packet.stamp);
            walk::walk(top, &beams, wide.mask, &AtRest, &mut nearest, stack, &mut visit);
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
}

impl<I: Isa> Visit<I> for InWorld<'_, I> {
    #[inline(always)]
    fn visit(&mut self, child: Child, mask: u32, nearest: &mut Nearest<I>, stack: &mut Vec<Pending>) {
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

impl<I: Isa> Foresee for InWorld<'_, I> {
    #[inline(always)]
    fn foresee(&self, child: Child) {
        if child.kind() == PLANT {
            simd::prefetch(&self.scene.plants[child.index()].plant_from_world);
            if self.world.wind.blows() {
                self.knots.foresee(self.world, child.index(), self.stamp);
            }
        }
    }
}

impl<I: Isa> InWorld<'_, I> {
    /// Turns the packet into a plant's frame, its directions scaled alike, so that distances stay the world's.
    #[inline(always)]
    fn enter(&mut self, index: usize, mask: u32, nearest: &mut Nearest<I>, stack: &mut Vec<Pending>) {
        let (scene, all, packet_origin) = (self.scene, self.beams, self.packet_origin);
        let standing = &scene.plants[index];
        let grown = &scene.grown[standing.prototype as usize];
        let (map, flutter) = if self.world.wind.blows() {
            let moment = self.knots.near(scene, self.world, index, self.stamp);
            (&moment.plant_from_world, Some(&moment.flutter))
        } else {
            (&standing.plant_from_world, None)
        };
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
        let mut visit = InPlant { grown, place: index as u32, flutter, beams: &beams };
        match flutter {
            Some(flutter) => {
                let ease = Swaying::new(&grown.mobility, flutter, grown.half_v_m_max);
                walk::walk(&grown.nodes, &beams, mask, &ease, nearest, stack, &mut visit);
            }
            None => walk::walk(&grown.nodes, &beams, mask, &AtRest, nearest, stack, &mut visit),
        }
    }
}

/// A prototype's items.
struct InPlant<'a, I: Isa> {
    grown: &'a Grown,
    place: u32,
    flutter: Option<&'a Flutter>,
    beams: &'a Beams<I>,
}

impl<I: Isa> Visit<I> for InPlant<'_, I> {
    #[inline(always)]
    fn visit(&mut self, child: Child, mask: u32, nearest: &mut Nearest<I>, stack: &mut Vec<Pending>) {
        let index = child.index();
        if child.kind() == SHOOT {
            let Grown { shoots, spurs, .. } = self.grown;
            let (flutter, beams, place) = (self.flutter, self.beams, self.place);
            shoots[index].meet(index, spurs, flutter, beams, mask, place, nearest, stack, &*self);
        } else {
            let met = Met { place: self.place, part: Met::BRANCH | index as u32 };
            self.grown.branches[index].meet(self.beams, mask, met, nearest);
        }
    }
}

impl<I: Isa> Foresee for InPlant<'_, I> {
    #[inline(always)]
    fn foresee(&self, child: Child) {
        match child.kind() {
            SHOOT => self.grown.shoots[child.index()].foresee(self.flutter.is_some()),
            SPUR if self.flutter.is_some() => simd::prefetch(&self.grown.spurs[child.index()]),
            SPUR => simd::prefetch(&self.grown.spurs[child.index()].rest),
            _ => {}
        }
    }
}
