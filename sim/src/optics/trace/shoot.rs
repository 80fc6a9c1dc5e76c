//! Shoots: eight spurs in boxes of their own, which shift together in the wind while their leaves turn in step.
//!
//! A beam is shifted once for all of a shoot's leaves. Its spurs have boxes for each of a few stages of the leaves' turn;
//! those of the stage at that moment are looked at, so that finding them costs what it costs in still air.

use super::super::boxes::Aabb;
use super::super::surface;
use super::ease::{Boxes, Pose};
use super::lanes::{Bytes, Isa, Lanes};
use super::moment::Between;
use super::node::{Child, Node};
use super::spur::{self, Spur};
use super::walk::{self, Beams, Foresee, Met, Nearest, Pending};
use super::{MARGIN_M, SPUR, simd};
use arborloop_worlds::Leaf;
use arborloop_worlds::wind::{LEAVES_PER_SHOOT, LEAVES_PER_SPUR, own_turns, shoot_direction};
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// Spurs in a shoot.
const SPURS: usize = LEAVES_PER_SHOOT / LEAVES_PER_SPUR;
/// Sine of the farthest turn, rounded up.
pub(super) const LEAF_SIN_MAX: f64 = 0.51;

/// Up to 64 leaves, plant frame: what stands still of them in the first two lines of memory. Corners as in [`Node`].
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Shoot {
    low: [f32; 3],
    step: [f32; 3],
    /// The line along which the wind moves it.
    direction: [f32; 3],
    /// Sine and cosine of the turns by which it is ahead of its plant's phases.
    ahead: [f32; 2],
    /// One bit for each spur that is there, and [`SLANTED`].
    filled: u32,
    /// Where in its prototype's tree it hangs: eight times the node's index, and the slot.
    seat: u32,
    rest: Corners,
    stages: [Corners; STAGES],
}

/// Set where some leaf's half sides are not at right angles, as grown leaves' are.
const SLANTED: u32 = 1 << 8;
/// Stages of a turn, from the farthest backward to the farthest forward: equal steps of its sine.
const STAGES: usize = 8;

#[derive(Debug, Clone)]
#[repr(C)]
struct Corners {
    from: [[u8; 8]; 3],
    to: [[u8; 8]; 3],
}

/// A prototype's leaves as shoots, the box of each at rest, and their spurs, eight to a shoot.
pub(super) fn shoots(leaves: &[Leaf]) -> (Vec<Shoot>, Vec<Aabb>, Vec<Spur>) {
    let shoots = leaves.chunks(LEAVES_PER_SHOOT).enumerate().map(|(index, leaves)| Shoot::new(index, leaves));
    let (shoots, bounds) = shoots.unzip();
    (shoots, bounds, leaves.chunks(LEAVES_PER_SPUR).map(Spur::new).collect())
}

impl Shoot {
    /// With its box at rest.
    fn new(index: usize, leaves: &[Leaf]) -> (Self, Aabb) {
        let boxes = |of: &dyn Fn(&Leaf) -> Aabb| {
            let mut boxes = [Aabb::empty(); SPURS];
            for (bounds, leaves) in boxes.iter_mut().zip(leaves.chunks(LEAVES_PER_SPUR)) {
                let all = leaves.iter().fold(Aabb::empty(), |all, leaf| all.with(&of(leaf)));
                *bounds = if all.is_real() { all } else { Aabb::empty() };
            }
            boxes
        };
        let resting = boxes(&surface::leaf_bounds);
        let stages: [[Aabb; SPURS]; STAGES] = std::array::from_fn(|stage| {
            let sin = |stage: usize| LEAF_SIN_MAX * (2.0 * stage as f64 / STAGES as f64 - 1.0);
            boxes(&|leaf| turned_bounds(leaf, [sin(stage), sin(stage + 1)]))
        });
        let whole = stages.iter().flatten().chain(&resting).fold(Aabb::empty(), |all, one| all.with(one));
        let rest = Node::holding(&whole, &resting, SPUR);
        let corners = |node: &Node| Corners { from: node.from, to: node.to };
        let slanted = if leaves.iter().all(spur::is_square) { 0 } else { SLANTED };
        let angle = TAU * own_turns(index);
        let shoot = Shoot {
            low: rest.low,
            step: rest.step,
            direction: shoot_direction(index).map(|x| x as f32).into(),
            ahead: [angle.sin() as f32, angle.cos() as f32],
            filled: rest.filled & 0xff | slanted,
            seat: 0,
            rest: corners(&rest),
            stages: stages.map(|boxes| corners(&Node::holding(&whole, &boxes, SPUR))),
        };
        (shoot, resting.iter().fold(Aabb::empty(), |all, one| all.with(one)))
    }

    /// The line along which it moves, and sine and cosine of the turns by which it is ahead.
    pub(super) fn motion(&self) -> ([f32; 3], [f32; 2]) {
        (self.direction, self.ahead)
    }

    /// Where in its prototype's tree it hangs: eight times the node's index, and the slot.
    #[inline(always)]
    pub(super) fn seat(&self) -> usize {
        self.seat as usize
    }

    pub(super) fn sit(&mut self, seat: usize) {
        self.seat = seat as u32;
    }

    /// Asks the processor to fetch what a visit reads.
    #[inline(always)]
    pub(super) fn expect(&self, pose: Option<Pose>) {
        simd::prefetch(&self.low);
        match pose {
            Some(_) => simd::prefetch(self.corners(pose)),
            None => simd::prefetch(&self.rest.to),
        }
    }

    /// Corners of the spurs' boxes in a pose.
    #[inline(always)]
    fn corners(&self, pose: Option<Pose>) -> &Corners {
        match pose {
            Some(pose) => &self.stages[pose.stage.to_bits() as usize % STAGES],
            None => &self.rest,
        }
    }

    /// The spurs' boxes as seen from a point.
    #[inline(always)]
    fn boxes<I: Isa>(&self, corners: &Corners, from: &[f32; 3]) -> Boxes<I> {
        let mut boxes = [[I::Half::splat(0.0); 2]; 3];
        let mut axis = 0;
        while axis < 3 {
            let base = self.low[axis] - from[axis];
            let step = I::Half::splat(self.step[axis]);
            let (low, high) = (I::Half::splat(base - MARGIN_M), I::Half::splat(base + MARGIN_M));
            boxes[axis] = [
                I::Half::from_bytes(&corners.from[axis]).fma(step, low),
                I::Half::from_bytes(&corners.to[axis]).fma(step, high),
            ];
            axis += 1;
        }
        boxes
    }

    /// Where a point is seen from the shoot before it was shifted along its line.
    #[inline(always)]
    fn before(&self, shift_m: f32, mut point: [f32; 3]) -> [f32; 3] {
        let mut axis = 0;
        while axis < 3 {
            point[axis] -= shift_m * self.direction[axis];
            axis += 1;
        }
        point
    }

    /// Offers the leaves' crossings. `index` is the shoot's own, `spurs` are its prototype's.
    #[inline(always)]
    pub(super) fn meet<I: Isa>(
        &self,
        index: usize,
        spurs: &[Spur],
        pose: Option<Pose>,
        beams: &Beams<I>,
        mask: u32,
        place: u32,
        nearest: &mut Nearest<I>,
        stack: &mut Vec<Pending>,
    ) {
        let origin = pose.map_or(beams.origin, |pose| self.before(pose.shift_m, beams.origin));
        let turn = pose.map(|pose| pose.turn);
        let mut children = [Child::new(SPUR, 0); SPURS];
        let mut slot = 0;
        while slot < SPURS {
            children[slot] = Child::new(SPUR, index * SPURS + slot);
            slot += 1;
        }
        let floor = stack.len();
        let boxes = self.boxes::<I>(self.corners(pose), &origin);
        let slanted = self.filled & SLANTED != 0;
        let mut own = Spurs { spurs, turning: turn.is_some() };
        walk::open(&boxes, &children, self.filled, beams, mask, nearest, stack, &mut own);
        while stack.len() > floor {
            let Some((child, mask)) = walk::next(nearest, stack) else { return };
            if mask != 0 {
                let met = Met { place, part: (child.index() * LEAVES_PER_SPUR) as u32 };
                spurs[child.index()].meet(turn, slanted, origin, beams, mask, met, nearest);
            }
        }
    }

    /// Where a leaf of this shoot is at an instant; `shoot` is this one's index.
    #[inline(always)]
    pub(super) fn leaf_at(&self, shoot: usize, rest: &Leaf, moment: &Between) -> Leaf {
        let shift_m = moment.of(|flutter| flutter.shift_m(shoot, self.ahead));
        let sin = moment.of(|flutter| flutter.turn(shoot, self.ahead).sin);
        let cos = (1.0 - sin * sin).sqrt();
        let [x, y, z] = self.direction.map(f64::from);
        Leaf {
            center: rest.center + Vector3::new(x, y, z) * shift_m,
            half_u: rest.half_u,
            half_v: rest.half_v * cos + spur::quarter(rest) * sin,
        }
    }
}

/// A prototype's spurs.
struct Spurs<'a> {
    spurs: &'a [Spur],
    turning: bool,
}

impl Foresee for Spurs<'_> {
    #[inline(always)]
    fn foresee(&mut self, child: Child, _: usize) {
        let spur = &self.spurs[child.index()];
        if self.turning {
            simd::prefetch(spur);
        } else {
            simd::prefetch(&spur.rest);
        }
    }
}

/// The stage of leaves that have turned so far, in the lowest bits: added to 3 2^22, a number is rounded to a whole one.
/// Sines end short of the last stage's far side; one that rounding puts into the next stage is off by far less than the
/// boxes' margin.
#[inline(always)]
pub(super) fn stage<I: Isa>(sin: I::Half) -> I::Half {
    const WHOLE: f32 = 12_582_912.0;
    let stage = sin.fma(
        I::Half::splat(0.5 * STAGES as f32 / LEAF_SIN_MAX as f32),
        I::Half::splat(0.5 * STAGES as f32 - 0.5),
    );
    stage.add(I::Half::splat(WHOLE))
}

/// A box that holds a shoot's leaves, however far they turn: convex in the sine of the turn, from the box at rest on.
pub(super) fn turned(shoot: usize, leaves: &[Leaf]) -> Aabb {
    let leaves = leaves.iter().skip(shoot * LEAVES_PER_SHOOT).take(LEAVES_PER_SHOOT);
    leaves.fold(Aabb::empty(), |all, leaf| {
        let aside = spur::quarter(leaf).abs() * LEAF_SIN_MAX;
        all.with(&surface::leaf_bounds(leaf).grown(&aside))
    })
}

/// A box that holds a leaf after any turn between two: by interval arithmetic, sine and cosine each on its own.
fn turned_bounds(leaf: &Leaf, sin: [f64; 2]) -> Aabb {
    let quarter = spur::quarter(leaf);
    let [least, most] = sin.map(f64::abs);
    let (nearest, farthest) =
        (if sin[0] < 0.0 && sin[1] > 0.0 { 0.0 } else { least.min(most) }, least.max(most));
    let cos = [farthest, nearest].map(|sin| (1.0 - sin * sin).sqrt());
    let reach = Vector3::from_fn(|axis, _| {
        let (v, w) = (leaf.half_v[axis].abs(), leaf.half_v[axis].signum() * quarter[axis]);
        let outward = v * cos[1] + (w * sin[0]).max(w * sin[1]);
        let inward = -v * cos[0] - (w * sin[0]).min(w * sin[1]);
        leaf.half_u[axis].abs() + outward.max(inward)
    });
    Aabb { low: leaf.center - reach, high: leaf.center + reach }
}

#[cfg(test)]
mod tests {
    use super::super::flutter::{self, Flutter};
    use super::super::lanes::Portable;
    use super::*;
    use arborloop_base::Seed;
    use arborloop_worlds::{GrassSpec, Planting, SurroundingsSpec, TerrainSpec, WindSpec, WorldSpec, build};

    #[test]
    fn boxes_of_spurs_hold_their_leaves_however_far_they_turn() {
        let spec = WorldSpec {
            terrain: TerrainSpec { extent_m: 12.0, ..TerrainSpec::default() },
            grass: GrassSpec { height_m: 0.0, ..GrassSpec::default() },
            planting: Planting::None,
            surroundings: SurroundingsSpec { trees: 1, ..SurroundingsSpec::default() },
            wind: WindSpec { mean_mps: 9.0, ..WindSpec::default() },
        };
        let world = build(&spec, Seed(3));
        let plant = &world.plants[0];
        let leaves = &world.prototypes[plant.prototype].leaves;
        let (shoots, ..) = shoots(leaves);
        let mut tightest = f64::INFINITY;
        for step in 0..40 {
            let seconds = 1.0 + 0.73 * f64::from(step);
            let sway = world.wind.sway(0, plant, seconds);
            let stem = world.wind.stem(0).unwrap();
            let [sin, cos] = flutter::sin_cos::<Portable>(&stem.turns_at((1e3 * seconds).round() as i64));
            let flutter = Flutter::new(&world.wind.bend(0, seconds).unwrap(), &sin, &cos);
            for (index, shoot) in shoots.iter().enumerate() {
                let shift_m = flutter.shift_m(index, shoot.ahead);
                let turn = flutter.turn(index, shoot.ahead);
                let pose = Pose { shift_m, turn, stage: stage::<Portable>([turn.sin; 8])[0] };
                let boxes =
                    shoot.boxes::<Portable>(shoot.corners(Some(pose)), &shoot.before(shift_m, [0.0; 3]));
                let own = &leaves[index * LEAVES_PER_SHOOT..];
                for (slot, spur) in own.chunks(LEAVES_PER_SPUR).take(SPURS).enumerate() {
                    let first = index * LEAVES_PER_SHOOT + slot * LEAVES_PER_SPUR;
                    let now = spur.iter().enumerate().fold(Aabb::empty(), |all, (number, leaf)| {
                        all.with(&surface::leaf_bounds(&sway.leaf(first + number, leaf)))
                    });
                    for (axis, sides) in boxes.iter().enumerate() {
                        let [low, high] = sides.map(|sides| f64::from(sides[slot]));
                        assert!(low <= now.low[axis] && now.high[axis] <= high, "{index} {slot}");
                        tightest = tightest.min(now.low[axis] - low).min(high - now.high[axis]);
                    }
                }
            }
        }
        // Some box is hardly wider than it must be.
        assert!(tightest < 1e-3, "{tightest}");
    }
}
