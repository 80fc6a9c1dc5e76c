//! Beams side by side: what takes the beams of one laser from the base into the world is worked out for all of them at once.

use super::{SMALL, Step, Stretch};
use crate::optics::Loops;
use arborloop_base::Time;
use nalgebra::{Matrix3, Point3, Vector3};

/// Beams of a bundle.
pub(crate) const BEAMS: usize = 16;

type Numbers = [f64; BEAMS];

/// Beams that fly one after the other.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bundle {
    /// When, nanoseconds on the run's clock.
    pub(crate) stamps_ns: [i64; BEAMS],
    /// Where each begins and where it goes, base frame.
    pub(crate) exit: [Numbers; 3],
    pub(crate) along: [Numbers; 3],
    /// The same in the world.
    origin: [Numbers; 3],
    direction: [Numbers; 3],
}

impl Bundle {
    pub(crate) fn along(&self, beam: usize) -> Vector3<f64> {
        Vector3::new(self.along[0][beam], self.along[1][beam], self.along[2][beam])
    }

    pub(crate) fn exit(&self, beam: usize) -> Point3<f64> {
        Point3::new(self.exit[0][beam], self.exit[1][beam], self.exit[2][beam])
    }

    /// Where a beam begins in the world.
    pub(crate) fn origin(&self, beam: usize) -> Point3<f64> {
        Point3::new(self.origin[0][beam], self.origin[1][beam], self.origin[2][beam])
    }

    /// Where a beam goes in the world.
    pub(crate) fn direction(&self, beam: usize) -> Vector3<f64> {
        Vector3::new(self.direction[0][beam], self.direction[1][beam], self.direction[2][beam])
    }
}

/// Takes some beams of a bundle into the world: those that fly in one stretch. The bits are those of [`Stretch::at`].
pub(crate) struct Carry<'a> {
    pub(crate) stretch: &'a Stretch,
    /// Which beams.
    pub(crate) flies: &'a [bool; BEAMS],
    pub(crate) bundle: &'a mut Bundle,
}

impl Loops for Carry<'_> {
    // Closures and arrays' own methods would be calls.
    #[inline(always)]
    fn run(self) {
        let Carry { stretch, flies, bundle } = self;
        if !stretch.step.is_slow() {
            return one_by_one(stretch, flies, bundle);
        }
        let (from_ns, tick_ns) = (stretch.from.nanos(), stretch.tick.nanos());
        let Step { shift, turn } = stretch.step;
        let (shift_x, shift_y, shift_z) = (shift.x, shift.y, shift.z);
        let (turn_x, turn_y, turn_z) = (turn.x, turn.y, turn.z);
        let (begin_x, begin_y, begin_z) = (stretch.origin.x, stretch.origin.y, stretch.origin.z);
        let (rows, share_per_ns) = (rows_of(&stretch.turned), stretch.share_per_ns);
        for beam in 0..BEAMS {
            let after_ns = bundle.stamps_ns[beam] - from_ns;
            let after_ns = if after_ns > 0 { after_ns } else { 0 };
            let after_ns = if after_ns < tick_ns { after_ns } else { tick_ns };
            let share = after_ns as f64 * share_per_ns;
            let (x, y, z) = (turn_x * share * 0.5, turn_y * share * 0.5, turn_z * share * 0.5);
            let (cos, sin_share) = super::turn_of(x * x + y * y + z * z);
            let axis = (x * sin_share, y * sin_share, z * sin_share);
            let along = (bundle.along[0][beam], bundle.along[1][beam], bundle.along[2][beam]);
            let along = times(&rows, turned_by(axis, cos, along));
            let exit = (bundle.exit[0][beam], bundle.exit[1][beam], bundle.exit[2][beam]);
            let exit = times(&rows, turned_by(axis, cos, exit));
            let origin_x = begin_x + shift_x * share + exit.0;
            let origin_y = begin_y + shift_y * share + exit.1;
            let origin_z = begin_z + shift_z * share + exit.2;
            let flies = flies[beam];
            bundle.origin[0][beam] = if flies { origin_x } else { bundle.origin[0][beam] };
            bundle.origin[1][beam] = if flies { origin_y } else { bundle.origin[1][beam] };
            bundle.origin[2][beam] = if flies { origin_z } else { bundle.origin[2][beam] };
            bundle.direction[0][beam] = if flies { along.0 } else { bundle.direction[0][beam] };
            bundle.direction[1][beam] = if flies { along.1 } else { bundle.direction[1][beam] };
            bundle.direction[2][beam] = if flies { along.2 } else { bundle.direction[2][beam] };
        }
    }
}

type Three = (f64, f64, f64);

/// A vector turned by the quaternion of these parts.
#[inline(always)]
fn turned_by((i, j, k): Three, cos: f64, (x, y, z): Three) -> Three {
    let across_x = (j * z - k * y) * 2.0;
    let across_y = (k * x - i * z) * 2.0;
    let across_z = (i * y - j * x) * 2.0;
    (
        x + across_x * cos + (j * across_z - k * across_y),
        y + across_y * cos + (k * across_x - i * across_z),
        z + across_z * cos + (i * across_y - j * across_x),
    )
}

/// A matrix times a vector, in the order in which `nalgebra` adds.
#[inline(always)]
pub(crate) fn times([a, b, c]: &[[f64; 3]; 3], (x, y, z): Three) -> Three {
    (a[0] * x + a[1] * y + a[2] * z, b[0] * x + b[1] * y + b[2] * z, c[0] * x + c[1] * y + c[2] * z)
}

/// The rows of a matrix.
#[inline(always)]
pub(crate) fn rows_of(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    [[m.m11, m.m12, m.m13], [m.m21, m.m22, m.m23], [m.m31, m.m32, m.m33]]
}

/// Where the body turns so fast that a turn needs sine and cosine.
#[cold]
fn one_by_one(stretch: &Stretch, flies: &[bool; BEAMS], bundle: &mut Bundle) {
    for beam in (0..BEAMS).filter(|beam| flies[*beam]) {
        let at = stretch.at(Time::from_nanos(bundle.stamps_ns[beam]));
        let (origin, direction) = (at.point(&bundle.exit(beam)), at.vector(&bundle.along(beam)));
        for axis in 0..3 {
            bundle.origin[axis][beam] = origin[axis];
            bundle.direction[axis][beam] = direction[axis];
        }
    }
}

impl Step {
    /// Whether every turn within the step is small for certain; with a hair for rounding.
    fn is_slow(&self) -> bool {
        (self.turn * 0.5).norm_squared() < 0.99 * SMALL
    }
}
