//! What a box fills while the plant in it bends: interval arithmetic over all bends that a gust allows.

use super::bend::{LEAN_RATIO, Stem};
use super::{Drift, Wind};
use nalgebra::{Point3, Vector3};

/// The least and the greatest that a number may be.
#[derive(Debug, Clone, Copy)]
struct Between(f64, f64);

impl Between {
    fn around(reach: f64) -> Self {
        Between(-reach, reach)
    }

    fn plus(self, other: Between) -> Self {
        Between(self.0 + other.0, self.1 + other.1)
    }

    fn minus(self, other: Between) -> Self {
        Between(self.0 - other.1, self.1 - other.0)
    }

    fn times(self, factor: f64) -> Self {
        let (a, b) = (self.0 * factor, self.1 * factor);
        Between(a.min(b), a.max(b))
    }

    fn by(self, other: Between) -> Self {
        let (a, b) = (self.times(other.0), self.times(other.1));
        Between(a.0.min(b.0), a.1.max(b.1))
    }

    /// Nothing at all is possible too.
    fn or_nothing(self) -> Self {
        Between(self.0.min(0.0), self.1.max(0.0))
    }
}

impl Wind {
    /// The box, world frame, that holds whatever of the plant with this index rests in a box, lowest and highest corner,
    /// at any instant of a drift. Shoots and leaves do not move in it. In still air the box itself.
    pub fn swept(&self, index: usize, drift: &Drift, [low, high]: [Point3<f64>; 2]) -> [Point3<f64>; 2] {
        let Some(stem) = self.stem(index) else { return [low, high] };
        let turn = self.turns(stem, drift.bend_ratio);
        let arm: [Between; 3] =
            std::array::from_fn(|axis| Between(low[axis] - stem.fork[axis], high[axis] - stem.fork[axis]));
        // Cayley's map moves an arm by a share, at most one, of `t x r + t x (t x r) / 2`.
        let square = |all: &[Between; 3]| all.iter().map(|one| one.0.powi(2).max(one.1.powi(2))).sum::<f64>();
        let second_m = 0.5 * square(&turn) * square(&arm).sqrt();
        let aside: [Between; 3] = std::array::from_fn(|axis| {
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            let first = turn[next].by(arm[last]).minus(turn[last].by(arm[next]));
            first.or_nothing().plus(Between::around(second_m))
        });
        let above = Between(low.z - stem.still_m, high.z - stem.still_m).plus(aside[2]);
        let trunk = drift.bend_ratio * stem.lean_ratio;
        let (along, across) = (swung(trunk).by(above), Between::around(0.5 * trunk).by(above));
        let (x, y) = (self.toward.x, self.toward.y);
        let lean =
            [along.times(x).minus(across.times(y)), along.times(y).plus(across.times(x)), Between(0.0, 0.0)];
        let room = |axis: usize| aside[axis].plus(lean[axis]);
        [low + Vector3::from_fn(|axis, _| room(axis).0), high + Vector3::from_fn(|axis, _| room(axis).1)]
    }

    /// Every turn of a limb that bends at most this far.
    fn turns(&self, stem: &Stem, bend_ratio: f64) -> [Between; 3] {
        let tip_rad = bend_ratio * stem.turn_rad;
        let (lean, yaw, roll) =
            (swung(tip_rad), Between::around(0.4 * tip_rad), Between::around(0.3 * tip_rad));
        let (x, y) = (self.toward.x, self.toward.y);
        [roll.times(x).minus(lean.times(y)), roll.times(y).plus(lean.times(x)), yaw]
    }
}

/// A lean before the wind and what swings about it, however far up to the most.
fn swung(most: f64) -> Between {
    Between(most * (2.0 * LEAN_RATIO - 1.0).min(0.0), most)
}
