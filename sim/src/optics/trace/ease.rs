//! How much wider than it is built a node's boxes are held, because of what moves in them.

use super::flutter::Flutter;
use super::lanes::{Bytes, Isa, Lanes};
use super::node::Node;
use super::shoot::{self, LEAF_SIN_MAX, Shoot};
use super::spur::Turn;
use super::{MARGIN_M, SHOOT, simd};
use arborloop_worlds::Leaf;
use arborloop_worlds::wind::LEAVES_PER_SHOOT;

/// Low and high sides of eight boxes, axis by axis.
pub(super) type Boxes<I> = [[<I as Isa>::Half; 2]; 3];

/// How wide boxes are held.
pub(super) trait Ease<I: Isa>: Prepare {
    /// The boxes of a node as seen from a point of its frame, with room for rounding and for all that moves in them.
    fn boxes(&mut self, index: usize, node: &Node, from: &[f32; 3]) -> Boxes<I>;
}

/// Where the things in eight seats are that swing by themselves.
#[derive(Debug, Clone, Default)]
#[repr(C, align(64))]
pub(super) struct Poses {
    shift_m: [f32; 8],
    sin: [f32; 8],
    cos: [f32; 8],
    /// See [`shoot::stage`].
    stage: [f32; 8],
}

/// Where one of them is: how far along its line it is, meters, and how far its leaves have turned.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pose {
    pub(super) shift_m: f32,
    pub(super) turn: Turn,
    pub(super) stage: f32,
}

/// Knows when boxes will be asked for.
pub(super) trait Prepare {
    /// The node is likely to be opened soon.
    fn foresee(&self, index: usize);

    /// Where the shoot in a seat is whose node was opened; nothing if it rests.
    fn pose(&self, seat: usize) -> Option<Pose>;
}

/// The boxes of a node as the tree has them, wider by `room_m` on every side.
#[inline(always)]
fn around<I: Isa>(node: &Node, from: &[f32; 3], room_m: f32) -> Boxes<I> {
    let mut boxes = [[I::Half::splat(0.0); 2]; 3];
    let mut axis = 0;
    while axis < 3 {
        let step = I::Half::splat(node.step[axis]);
        let base = node.low[axis] - from[axis];
        boxes[axis] = [
            I::Half::from_bytes(&node.from[axis]).fma(step, I::Half::splat(base - room_m)),
            I::Half::from_bytes(&node.to[axis]).fma(step, I::Half::splat(base + room_m)),
        ];
        axis += 1;
    }
    boxes
}

/// Nothing moves.
pub(super) struct AtRest;

impl<I: Isa> Ease<I> for AtRest {
    #[inline(always)]
    fn boxes(&mut self, _: usize, node: &Node, from: &[f32; 3]) -> Boxes<I> {
        around::<I>(node, from, MARGIN_M)
    }
}

impl Prepare for AtRest {
    #[inline(always)]
    fn foresee(&self, _: usize) {}

    #[inline(always)]
    fn pose(&self, _: usize) -> Option<Pose> {
        None
    }
}

/// Shoots and leaves move: a shoot's box is moved with it and held wider by what its leaves do, a box around several
/// shoots is held wider by the farthest that any of them goes.
pub(super) struct Swaying<'a> {
    mobility: &'a [Mobility],
    flutter: &'a Flutter,
    poses: &'a mut [Poses],
    /// No leaf reaches farther than this from where it rests, meters, its shoot's shift left out; a 255th of it.
    leaf_m: f32,
    /// The shoot's shift included, and room for rounding.
    room_m: f32,
}

impl<'a> Swaying<'a> {
    /// `half_v_m_max` is as far as any leaf reaches from its `half_u`, meters.
    #[inline(always)]
    pub(super) fn new(
        mobility: &'a [Mobility],
        flutter: &'a Flutter,
        half_v_m_max: f32,
        poses: &'a mut [Poses],
    ) -> Self {
        let leaf_m = flutter.leaf_sin() * half_v_m_max;
        Swaying {
            mobility,
            flutter,
            poses,
            leaf_m: leaf_m * (1.0 / 255.0),
            room_m: flutter.shoot_m() + leaf_m + MARGIN_M,
        }
    }
}

impl<I: Isa> Ease<I> for Swaying<'_> {
    #[inline(always)]
    fn boxes(&mut self, index: usize, node: &Node, from: &[f32; 3]) -> Boxes<I> {
        let has_nodes = node.has_nodes();
        if has_nodes && !node.has_things() {
            return around::<I>(node, from, self.room_m);
        }
        let mobility = &self.mobility[index];
        // As `Flutter` says for one shoot, to the bit.
        let ahead = [I::Half::load(&mobility.ahead[0]), I::Half::load(&mobility.ahead[1])];
        let [sin, cos] = self.flutter.shoots();
        let (sin, cos) = (I::Half::load(sin).pick(&mobility.pitch), I::Half::load(cos).pick(&mobility.pitch));
        let shift = sin.mul(ahead[1]).add(cos.mul(ahead[0]));
        let [sin, cos] = self.flutter.leaves();
        let (sin, cos) = (I::Half::load(sin).pick(&mobility.pitch), I::Half::load(cos).pick(&mobility.pitch));
        let sin = sin.mul(ahead[1]).add(cos.mul(ahead[0]));
        let poses = &mut self.poses[index];
        shift.store(&mut poses.shift_m);
        sin.store(&mut poses.sin);
        shoot::stage::<I>(sin).store(&mut poses.stage);
        I::Half::splat(1.0).sub(sin.mul(sin)).sqrt().store(&mut poses.cos);
        if has_nodes {
            return around::<I>(node, from, self.room_m);
        }
        let (leaf, margin) = (I::Half::splat(self.leaf_m), I::Half::splat(MARGIN_M));
        let mut boxes = [[I::Half::splat(0.0); 2]; 3];
        let mut axis = 0;
        while axis < 3 {
            let step = I::Half::splat(node.step[axis]);
            let base = I::Half::splat(node.low[axis] - from[axis]);
            let along = I::Half::load(&mobility.along[axis]);
            let room = I::Half::from_bytes(&mobility.leaf[axis]).fma(leaf, margin);
            let low = I::Half::from_bytes(&node.from[axis]).fma(step, base.sub(room));
            let high = I::Half::from_bytes(&node.to[axis]).fma(step, base.add(room));
            // The shift takes longest to know.
            boxes[axis] = [shift.fma(along, low), shift.fma(along, high)];
            axis += 1;
        }
        boxes
    }
}

impl Prepare for Swaying<'_> {
    #[inline(always)]
    fn foresee(&self, index: usize) {
        simd::prefetch(&self.mobility[index]);
    }

    #[inline(always)]
    fn pose(&self, seat: usize) -> Option<Pose> {
        let (poses, slot) = (&self.poses[seat / 8], seat % 8);
        let turn = Turn { sin: poses.sin[slot], cos: poses.cos[slot] };
        Some(Pose { shift_m: poses.shift_m[slot], turn, stage: poses.stage[slot] })
    }
}

/// How the eight things in a node move, if none of them is a node.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Mobility {
    /// The line along which a shoot moves; zero for other things, which do not move.
    along: [[f32; 8]; 3],
    /// Sine and cosine of the turns by which it is ahead of the phase that it follows.
    ahead: [[f32; 8]; 2],
    /// Which phase it follows.
    pitch: [u8; 8],
    /// By how many 255ths of the leaves' farthest shift the box is wider.
    leaf: [[u8; 8]; 3],
}

impl Mobility {
    pub(super) fn new(node: &Node, shoots: &[Shoot], leaves: &[Leaf], half_v_m_max: f32) -> Self {
        let mut all =
            Mobility { along: [[0.0; 8]; 3], ahead: [[0.0; 8]; 2], pitch: [0; 8], leaf: [[0; 8]; 3] };
        // Branches do not move in their plant.
        for (slot, child) in node.things().filter(|(_, child)| child.kind() == SHOOT) {
            let (along, [sin, cos]) = shoots[child.index()].motion();
            for (axis, along) in along.into_iter().enumerate() {
                all.along[axis][slot] = along;
            }
            (all.ahead[0][slot], all.ahead[1][slot]) = (sin, cos);
            all.pitch[slot] = (child.index() % 4) as u8;
            let first = child.index() * LEAVES_PER_SHOOT;
            let leaves = &leaves[first..leaves.len().min(first + LEAVES_PER_SHOOT)];
            for axis in 0..3 {
                let share = growth_m(leaves, axis) / (LEAF_SIN_MAX * f64::from(half_v_m_max));
                all.leaf[axis][slot] = (255.0 * share).ceil() as u8;
            }
        }
        all
    }
}

/// How much a box around the leaves grows along an axis, on the side that grows more, when they turn as far as can be.
/// The growth is convex in the sine, so that its chord bounds it.
fn growth_m(leaves: &[Leaf], axis: usize) -> f64 {
    let far = |sign: f64, sin: f64| {
        let reach = |leaf: &Leaf| {
            let normal = leaf.half_u.cross(&leaf.half_v) / leaf.half_u.norm().max(f64::MIN_POSITIVE);
            let half = leaf.half_u[axis].abs() + leaf.half_v[axis].abs() + sin * normal[axis].abs();
            sign * leaf.center[axis] + half
        };
        leaves.iter().map(reach).fold(f64::NEG_INFINITY, f64::max)
    };
    [1.0, -1.0].map(|sign| far(sign, LEAF_SIN_MAX) - far(sign, 0.0)).into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::super::boxes::Aabb;
    use super::super::flutter;
    use super::super::lanes::Portable;
    use super::super::{Grown, MARGIN_M, surface};
    use super::*;
    use arborloop_base::Seed;
    use arborloop_worlds::{GrassSpec, Planting, SurroundingsSpec, TerrainSpec, WindSpec, WorldSpec, build};

    #[test]
    fn boxes_hold_what_is_in_them_however_it_blows() {
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
        let grown = Grown::new(&world.prototypes[plant.prototype]).0;
        let mut tightest = f64::INFINITY;
        for step in 0..40 {
            let seconds = 1.0 + 0.73 * f64::from(step);
            let sway = world.wind.sway(0, plant, seconds);
            let stem = world.wind.stem(0).unwrap();
            let [sin, cos] = flutter::sin_cos::<Portable>(&stem.turns_at((1e3 * seconds).round() as i64));
            let flutter = Flutter::new(&world.wind.bend(0, seconds).unwrap(), &sin, &cos);
            let mut poses = vec![Poses::default(); grown.nodes.len()];
            let mut ease = Swaying::new(&grown.mobility, &flutter, grown.half_v_m_max, &mut poses);
            for (index, node) in grown.nodes.iter().enumerate() {
                let wider = Ease::<Portable>::boxes(&mut ease, index, node, &[0.0; 3]);
                for (slot, child) in node.things().filter(|(_, child)| child.kind() == SHOOT) {
                    let first = child.index() * LEAVES_PER_SHOOT;
                    let now = (first..leaves.len().min(first + LEAVES_PER_SHOOT))
                        .map(|leaf| surface::leaf_bounds(&sway.leaf(leaf, &leaves[leaf])))
                        .fold(Aabb::empty(), |all, one| all.with(&one));
                    for (axis, wider) in wider.iter().enumerate() {
                        let [low, high] = wider.map(|sides| f64::from(sides[slot]));
                        let margin_m = f64::from(MARGIN_M);
                        assert!(low - margin_m <= now.low[axis] && now.high[axis] <= high + margin_m);
                        tightest = tightest.min(now.low[axis] - low).min(high - now.high[axis]);
                    }
                }
            }
        }
        // Some box is hardly wider than it must be.
        assert!(tightest < 1e-3, "{tightest}");
    }
}
