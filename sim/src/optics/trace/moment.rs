//! Where plants are at an instant, for as many beams as ask.
//!
//! A plant's sway is computed at knots one millisecond apart. The tracer looks at the nearest knot, which at 1 m/s is
//! off by half a millimeter at most; exact hits interpolate linearly between two, which at 3 Hz and 10 cm is off by 5
//! micrometers. Knots stand at fixed instants, so neither packets nor threads have a say in the result.

use super::super::boxes::Aabb;
use super::flutter::Flutter;
use super::{MARGIN_M, Scene};
use arborloop_base::Time;
use arborloop_worlds::{Plant, Sway, World};
use nalgebra::{Affine3, Point3, Vector3};

/// An affine map, row by row.
#[derive(Debug, Clone, Copy)]
pub(in crate::optics) struct Map(pub(super) [[f64; 4]; 3]);

impl Map {
    pub(in crate::optics) fn new(map: &Affine3<f64>) -> Self {
        Map(std::array::from_fn(|row| std::array::from_fn(|column| map.matrix()[(row, column)])))
    }

    /// The way back, by the adjugate. A map that flattens space leads nowhere: its way back is not a number.
    fn inverse_of(map: &Affine3<f64>) -> Self {
        let matrix = map.matrix();
        let column = |n: usize| Vector3::new(matrix[(0, n)], matrix[(1, n)], matrix[(2, n)]);
        let (a, b, c) = (column(0), column(1), column(2));
        let first = b.cross(&c);
        let scale = a.dot(&first).recip();
        let rows = [first * scale, c.cross(&a) * scale, a.cross(&b) * scale];
        Map(rows.map(|row| [row.x, row.y, row.z, -row.dot(&column(3))]))
    }

    #[inline(always)]
    pub(in crate::optics) fn point(&self, p: &Point3<f64>) -> Point3<f64> {
        let at = self.vector(&p.coords);
        Point3::new(at.x + self.0[0][3], at.y + self.0[1][3], at.z + self.0[2][3])
    }

    #[inline(always)]
    pub(in crate::optics) fn vector(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let [a, b, c] = &self.0;
        Vector3::new(
            a[0] * v.x + a[1] * v.y + a[2] * v.z,
            b[0] * v.x + b[1] * v.y + b[2] * v.z,
            c[0] * v.x + c[1] * v.y + c[2] * v.z,
        )
    }
}

/// One plant at one knot.
#[derive(Debug, Clone, Copy)]
pub(in crate::optics) struct Moment {
    pub(in crate::optics) plant_from_world: Map,
    pub(super) flutter: Flutter,
}

const KNOT_NS: i64 = 1_000_000;
/// A knot that no instant is near.
const NEVER: i64 = i64::MIN;
/// Knots of a plant that are remembered: rays of a packet may lie on both sides of one, and each needs two.
const KEPT: usize = 4;
/// What a plant may fill is bounded for as many knots at once; a gust takes seconds to grow.
const KNOTS_PER_ROOM: i64 = 400;

/// What was last asked for, per plant. One per thread.
#[derive(Debug)]
pub(in crate::optics) struct Knots {
    moments: Vec<[(i64, Moment); KEPT]>,
    rooms: Vec<Room>,
}

/// A box, seen from the scene's center, that a plant does not leave for a while.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    number: i64,
    pub(super) low: [f32; 3],
    pub(super) high: [f32; 3],
}

impl Knots {
    /// Nothing is remembered where nothing moves.
    pub(in crate::optics) fn new(world: &World) -> Self {
        let rest = |plant: &Plant| [(NEVER, Moment::new(&Sway::at_rest(plant))); KEPT];
        let room = Room { number: NEVER, low: [0.0; 3], high: [0.0; 3] };
        let count = if world.wind.blows() { world.plants.len() } else { 0 };
        Knots { moments: world.plants.iter().take(count).map(rest).collect(), rooms: vec![room; count] }
    }

    /// The plant at the knot that is nearest to an instant.
    #[inline(always)]
    pub(super) fn near(&mut self, world: &World, index: usize, stamp: Time) -> &Moment {
        let knot = nearest(stamp);
        self.tie(world, index, knot);
        &self.moments[index][slot(knot)].1
    }

    /// Asks the processor to fetch what [`Self::room`] reads.
    #[inline(always)]
    pub(super) fn foresee(&self, index: usize) {
        super::simd::prefetch(&self.rooms[index]);
    }

    /// What the plant fills at most at the knot that is nearest to an instant.
    #[inline(always)]
    pub(super) fn room(&mut self, scene: &Scene, world: &World, index: usize, stamp: Time) -> &Room {
        let number = nearest(stamp).div_euclid(KNOTS_PER_ROOM);
        if self.rooms[index].number != number {
            self.rooms[index] = Room::new(scene, world, index, number);
        }
        &self.rooms[index]
    }

    /// The plant at an instant.
    #[inline(always)]
    pub(in crate::optics) fn at(&mut self, world: &World, index: usize, stamp: Time) -> Between<'_> {
        let (knot, share) = (stamp.nanos().div_euclid(KNOT_NS), stamp.nanos().rem_euclid(KNOT_NS));
        self.tie(world, index, knot);
        self.tie(world, index, knot + 1);
        let known = &self.moments[index];
        Between {
            ends: [&known[slot(knot)].1, &known[slot(knot + 1)].1],
            share: share as f64 / KNOT_NS as f64,
        }
    }

    #[inline(always)]
    fn tie(&mut self, world: &World, index: usize, knot: i64) {
        let (known, moment) = &mut self.moments[index][slot(knot)];
        if *known != knot {
            *known = knot;
            remember(world, index, knot, moment);
        }
    }
}

#[inline(always)]
fn nearest(stamp: Time) -> i64 {
    (stamp.nanos() + KNOT_NS / 2).div_euclid(KNOT_NS)
}

#[inline(always)]
fn slot(knot: i64) -> usize {
    knot as usize % KEPT
}

#[inline(never)]
fn remember(world: &World, index: usize, knot: i64, moment: &mut Moment) {
    let seconds = Time::from_nanos(knot * KNOT_NS).seconds();
    *moment = Moment::new(&world.wind.sway(index, &world.plants[index], seconds));
}

impl Room {
    #[cold]
    #[inline(never)]
    fn new(scene: &Scene, world: &World, index: usize, number: i64) -> Self {
        let plant = &world.plants[index];
        let at = |knots: i64| Time::from_nanos(number * KNOTS_PER_ROOM * KNOT_NS + knots * KNOT_NS).seconds();
        let drift = world.wind.drift_between(plant, at(-1), at(KNOTS_PER_ROOM + 1));
        let bounds: Aabb = scene.filled(plant, index, &drift);
        let margin = f64::from(MARGIN_M);
        Room {
            number,
            low: (bounds.low.coords.add_scalar(-margin)).map(|x| x as f32).into(),
            high: (bounds.high.coords.add_scalar(margin)).map(|x| x as f32).into(),
        }
    }
}

/// An instant between two knots.
#[derive(Debug, Clone, Copy)]
pub(in crate::optics) struct Between<'a> {
    ends: [&'a Moment; 2],
    share: f64,
}

impl Between<'_> {
    #[inline(always)]
    fn mixed(&self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.share
    }

    /// From the world to the plant.
    #[inline(always)]
    pub(in crate::optics) fn plant_from_world(&self) -> Map {
        let [from, to] = self.ends;
        let mut map = from.plant_from_world;
        for row in 0..3 {
            for column in 0..4 {
                let next = to.plant_from_world.0[row][column];
                map.0[row][column] = self.mixed(map.0[row][column], next);
            }
        }
        map
    }

    /// A number of the flutter, interpolated.
    #[inline(always)]
    pub(super) fn of(&self, number: impl Fn(&Flutter) -> f32) -> f64 {
        let [from, to] = self.ends;
        self.mixed(f64::from(number(&from.flutter)), f64::from(number(&to.flutter)))
    }
}

impl Moment {
    fn new(sway: &Sway) -> Self {
        Moment { plant_from_world: Map::inverse_of(&sway.world_from_plant), flutter: Flutter::new(sway) }
    }
}
