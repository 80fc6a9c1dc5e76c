//! Where plants are at an instant, for as many beams as ask.
//!
//! A plant's sway is computed at knots two milliseconds apart. The tracer looks at the nearest knot, which at 1 m/s is
//! off by a millimeter at most; exact hits interpolate linearly between two, which at 3 Hz and 10 cm is off by 20
//! micrometers. Knots stand at fixed instants, so neither packets nor threads have a say in the result.

use super::flutter::{self, Flutter};
use super::lanes::Isa;
use super::{Scene, Standing, simd};
use arborloop_base::Time;
use arborloop_worlds::World;
use arborloop_worlds::wind::Bend;
use nalgebra::{Affine3, Point3, Vector3};

/// An affine map, row by row.
#[derive(Debug, Clone, Copy)]
pub(in crate::optics) struct Map(pub(super) [[f64; 4]; 3]);

impl Map {
    pub(in crate::optics) fn new(map: &Affine3<f64>) -> Self {
        Map(std::array::from_fn(|row| std::array::from_fn(|column| map.matrix()[(row, column)])))
    }

    /// This map after another.
    #[inline(always)]
    fn after(&self, first: &[[f64; 4]; 3]) -> Self {
        let mut map = *self;
        let mut row = 0;
        while row < 3 {
            let [a, b, c, d] = self.0[row];
            let mut column = 0;
            while column < 4 {
                map.0[row][column] = a * first[0][column] + b * first[1][column] + c * first[2][column];
                column += 1;
            }
            map.0[row][3] += d;
            row += 1;
        }
        map
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

/// One plant at one knot, in three lines of memory.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(in crate::optics) struct Moment {
    pub(in crate::optics) plant_from_world: Map,
    pub(super) flutter: Flutter,
    /// The plant's, as [`Standing`] says.
    pub(super) prototype: u32,
}

const KNOT_MS: i64 = 2;
const KNOT_NS: i64 = KNOT_MS * 1_000_000;
/// A knot that no instant is near.
const NEVER: i64 = i64::MIN;
/// Knots of a plant that are remembered: those before and after an instant.
const KEPT: usize = 2;

/// What was last asked for, per plant. One per thread.
#[derive(Debug)]
pub(in crate::optics) struct Knots {
    /// Which knots are remembered.
    known: Vec<[i64; KEPT]>,
    moments: Vec<[Moment; KEPT]>,
}

impl Knots {
    /// Nothing is remembered where nothing moves.
    pub(super) fn new(scene: &Scene, world: &World) -> Self {
        let count = if world.wind.blows() { scene.plants.len() } else { 0 };
        let rest = |plant: &Standing| {
            let moment = Moment {
                plant_from_world: plant.plant_from_world,
                flutter: Flutter::new(&Bend::default(), &[0.0; 16], &[1.0; 16]),
                prototype: plant.prototype,
            };
            [moment; KEPT]
        };
        let known = vec![[NEVER; KEPT]; count];
        Knots { known, moments: scene.plants.iter().take(count).map(rest).collect() }
    }

    /// The plant at the knot that is nearest to an instant.
    #[inline(always)]
    pub(super) fn near(&mut self, scene: &Scene, world: &World, index: usize, stamp: Time) -> &Moment {
        let knot = nearest(stamp);
        self.tie(scene, world, index, knot);
        &self.moments[index][slot(knot)]
    }

    /// Asks the processor to fetch what [`Self::near`] reads.
    #[inline(always)]
    pub(super) fn foresee(&self, scene: &Scene, world: &World, index: usize, stamp: Time) {
        let knot = nearest(stamp);
        simd::prefetch(&self.moments[index][slot(knot)]);
        if self.known[index][slot(knot)] != knot
            && let Some(stem) = world.wind.stem(index)
        {
            simd::prefetch(stem);
            simd::prefetch(&scene.plants[index].plant_from_world);
        }
    }

    /// The plant at an instant.
    #[inline(always)]
    pub(super) fn at(&mut self, scene: &Scene, world: &World, index: usize, stamp: Time) -> Between<'_> {
        let (knot, share) = (stamp.nanos().div_euclid(KNOT_NS), stamp.nanos().rem_euclid(KNOT_NS));
        self.tie(scene, world, index, knot);
        self.tie(scene, world, index, knot + 1);
        let known = &self.moments[index];
        Between { ends: [&known[slot(knot)], &known[slot(knot + 1)]], share: share as f64 / KNOT_NS as f64 }
    }

    #[inline(always)]
    fn tie(&mut self, scene: &Scene, world: &World, index: usize, knot: i64) {
        let known = &mut self.known[index][slot(knot)];
        if *known != knot {
            *known = knot;
            let moment = &mut self.moments[index][slot(knot)];
            simd::run(scene.isa, Tying { scene, world, index, knot, moment });
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

/// Working out where a plant is at a knot.
struct Tying<'a> {
    scene: &'a Scene,
    world: &'a World,
    index: usize,
    knot: i64,
    moment: &'a mut Moment,
}

impl simd::Job for Tying<'_> {
    type Out = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Tying { scene, world, index, knot, moment } = self;
        if let Some(stem) = world.wind.stem(index) {
            let [sin, cos] = flutter::sin_cos::<I>(&stem.turns_at(knot * KNOT_MS));
            let swings = [sin[0], sin[1], sin[2], sin[3], sin[4]].map(f64::from);
            let seconds = Time::from_nanos(knot * KNOT_NS).seconds();
            let bend = world.wind.bend_of(stem, seconds, swings);
            moment.plant_from_world = scene.plants[index].plant_from_world.after(&bend.rest_from_now());
            moment.flutter = Flutter::new(&bend, &sin, &cos);
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
