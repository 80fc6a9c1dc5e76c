//! Shoots: eight spurs in boxes of their own, which shift together in the wind while their leaves turn in step.
//!
//! A beam is shifted once for all of a shoot's leaves, and the boxes of its spurs are those of the leaves' turn at that
//! moment: between the box at rest and the one after the farthest turn to that side, which bounds what is between.

use super::super::boxes::Aabb;
use super::super::surface;
use super::ease::Boxes;
use super::flutter::Flutter;
use super::lanes::{Bytes, Isa, Lanes};
use super::moment::Between;
use super::node::{Child, Node};
use super::spur::{self, Spur, Turn};
use super::walk::{self, Beams, Met, Nearest, Pending, Visit};
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
    filled: u32,
    rest: Corners,
    /// When leaves have turned as far as can be, backward and forward.
    turned: [Corners; 2],
}

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
        let turned = [-1.0, 0.0, 1.0].map(|turn| {
            let mut boxes = [Aabb::empty(); SPURS];
            for (bounds, leaves) in boxes.iter_mut().zip(leaves.chunks(LEAVES_PER_SPUR)) {
                let all = leaves.iter().fold(Aabb::empty(), |all, leaf| all.with(&turned_bounds(leaf, turn)));
                *bounds = if all.is_real() { all } else { Aabb::empty() };
            }
            boxes
        });
        let whole = turned.iter().flatten().fold(Aabb::empty(), |all, one| all.with(one));
        let [back, rest, forward] = turned.map(|boxes| Node::holding(&whole, &boxes, SPUR));
        let corners = |node: &Node| Corners { from: node.from, to: node.to };
        let angle = TAU * own_turns(index);
        let shoot = Shoot {
            low: rest.low,
            step: rest.step,
            direction: shoot_direction(index).map(|x| x as f32).into(),
            ahead: [angle.sin() as f32, angle.cos() as f32],
            filled: rest.filled,
            rest: corners(&rest),
            turned: [corners(&back), corners(&forward)],
        };
        (shoot, turned[1].iter().fold(Aabb::empty(), |all, one| all.with(one)))
    }

    /// The line along which it moves, and sine and cosine of the turns by which it is ahead.
    pub(super) fn motion(&self) -> ([f32; 3], [f32; 2]) {
        (self.direction, self.ahead)
    }

    /// Asks the processor to fetch what a visit reads.
    #[inline(always)]
    pub(super) fn foresee(&self, moves: bool) {
        simd::prefetch(&self.low);
        simd::prefetch(&self.rest.to);
        if moves {
            simd::prefetch(&self.turned[1]);
        }
    }

    /// The spurs' boxes as seen from a point that moves with the shoot.
    #[inline(always)]
    fn boxes<I: Isa>(&self, turn: Option<Turn>, from: &[f32; 3]) -> Boxes<I> {
        let mut boxes = [[I::Half::splat(0.0); 2]; 3];
        let mut axis = 0;
        if let Some(Turn { sin, .. }) = turn {
            let turned = &self.turned[usize::from(sin > 0.0)];
            let share = sin.abs() * (1.0 / LEAF_SIN_MAX) as f32;
            while axis < 3 {
                let base = self.low[axis] - from[axis];
                let rest = I::Half::splat(self.step[axis] * (1.0 - share));
                let away = I::Half::splat(self.step[axis] * share);
                let (low, high) = (I::Half::splat(base - MARGIN_M), I::Half::splat(base + MARGIN_M));
                let low = I::Half::from_bytes(&turned.from[axis]).fma(away, low);
                let high = I::Half::from_bytes(&turned.to[axis]).fma(away, high);
                boxes[axis] = [
                    I::Half::from_bytes(&self.rest.from[axis]).fma(rest, low),
                    I::Half::from_bytes(&self.rest.to[axis]).fma(rest, high),
                ];
                axis += 1;
            }
            return boxes;
        }
        while axis < 3 {
            let base = self.low[axis] - from[axis];
            let step = I::Half::splat(self.step[axis]);
            let (low, high) = (I::Half::splat(base - MARGIN_M), I::Half::splat(base + MARGIN_M));
            boxes[axis] = [
                I::Half::from_bytes(&self.rest.from[axis]).fma(step, low),
                I::Half::from_bytes(&self.rest.to[axis]).fma(step, high),
            ];
            axis += 1;
        }
        boxes
    }

    /// Offers the leaves' crossings. `index` is the shoot's own, `spurs` are its prototype's.
    #[inline(always)]
    pub(super) fn meet<I: Isa, V: Visit<I>>(
        &self,
        index: usize,
        spurs: &[Spur],
        flutter: Option<&Flutter>,
        beams: &Beams<I>,
        mask: u32,
        place: u32,
        nearest: &mut Nearest<I>,
        stack: &mut Vec<Pending>,
        visitor: &V,
    ) {
        let (mut origin, mut turn) = (beams.origin, None);
        if let Some(flutter) = flutter {
            let shift_m = flutter.shift_m(index, self.ahead);
            let mut axis = 0;
            while axis < 3 {
                origin[axis] -= shift_m * self.direction[axis];
                axis += 1;
            }
            turn = Some(flutter.turn(index, self.ahead));
        }
        let mut children = [Child::new(SPUR, 0); SPURS];
        let mut slot = 0;
        while slot < SPURS {
            children[slot] = Child::new(SPUR, index * SPURS + slot);
            slot += 1;
        }
        let floor = stack.len();
        let boxes = self.boxes::<I>(turn, &origin);
        walk::open(&boxes, &children, self.filled, beams, mask, nearest, stack, visitor);
        while stack.len() > floor {
            let Some((child, mask)) = walk::next(nearest, stack) else { return };
            if mask != 0 {
                let met = Met { place, part: (child.index() * LEAVES_PER_SPUR) as u32 };
                spurs[child.index()].meet(turn, origin, beams, mask, met, nearest);
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

/// A box that holds a leaf after a share of the farthest turn. Each side is convex in the share, so that at any turn
/// the box between those of no turn and of the farthest holds the leaf: cosines in front of what reaches outward count
/// as one, in front of what reaches inward as the least.
fn turned_bounds(leaf: &Leaf, share: f64) -> Aabb {
    if share == 0.0 {
        return surface::leaf_bounds(leaf);
    }
    let (quarter, sin) = (spur::quarter(leaf), share * LEAF_SIN_MAX);
    let cos = (1.0 - LEAF_SIN_MAX * LEAF_SIN_MAX).sqrt();
    let reach = Vector3::from_fn(|axis, _| {
        let (v, w) = (leaf.half_v[axis].abs(), leaf.half_v[axis].signum() * sin * quarter[axis]);
        leaf.half_u[axis].abs() + (v + w).max(-cos * v - w)
    });
    Aabb { low: leaf.center - reach, high: leaf.center + reach }
}

#[cfg(test)]
mod tests {
    use super::super::flutter;
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
                let moved: [f32; 3] = std::array::from_fn(|axis| -shift_m * shoot.direction[axis]);
                let boxes = shoot.boxes::<Portable>(Some(flutter.turn(index, shoot.ahead)), &moved);
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
