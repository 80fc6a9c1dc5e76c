//! How much wider than it is built a node's boxes are held, because of what moves in them.

use super::flutter::Flutter;
use super::lanes::{Bytes, Isa, Lanes};
use super::node::Node;
use super::shoot::Shoot;
use super::{SHOOT, simd};
use arborloop_worlds::Leaf;
use arborloop_worlds::wind::LEAVES_PER_SHOOT;

/// Low and high sides of eight boxes, axis by axis.
pub(super) type Boxes<I> = [[<I as Isa>::Half; 2]; 3];

/// How wide boxes are held.
pub(super) trait Ease<I: Isa> {
    /// The boxes of a node with room for all that moves in them.
    fn widened(&self, index: usize, node: &Node, boxes: Boxes<I>) -> Boxes<I>;

    /// The node is likely to be opened soon.
    fn foresee(&self, index: usize);
}

/// Nothing moves.
pub(super) struct AtRest;

impl<I: Isa> Ease<I> for AtRest {
    #[inline(always)]
    fn widened(&self, _: usize, _: &Node, boxes: Boxes<I>) -> Boxes<I> {
        boxes
    }

    #[inline(always)]
    fn foresee(&self, _: usize) {}
}

/// Shoots and leaves move: a shoot's box is moved with it and held wider by what its leaves do, a box around several
/// shoots is held wider by the farthest that any of them goes.
pub(super) struct Swaying<'a> {
    pub(super) mobility: &'a [Mobility],
    pub(super) flutter: &'a Flutter,
    /// No leaf reaches farther than this from its `half_u`, meters.
    pub(super) half_v_m_max: f32,
}

impl<I: Isa> Ease<I> for Swaying<'_> {
    #[inline(always)]
    fn widened(&self, index: usize, node: &Node, boxes: Boxes<I>) -> Boxes<I> {
        let flutter = self.flutter;
        let mut boxes = boxes;
        let leaf_m = flutter.leaf_sin * self.half_v_m_max;
        let mut axis = 0;
        if node.has_nodes() {
            let room_m = I::Half::splat(flutter.shoot_m + leaf_m);
            while axis < 3 {
                let [low, high] = boxes[axis];
                boxes[axis] = [low.sub(room_m), high.add(room_m)];
                axis += 1;
            }
            return boxes;
        }
        let mobility = &self.mobility[index];
        let [sin, cos] = flutter.shared();
        let sin = I::Half::load(sin).pick(&mobility.pitch);
        let cos = I::Half::load(cos).pick(&mobility.pitch);
        let leaf = I::Half::splat(leaf_m / 255.0);
        while axis < 3 {
            let [low, high] = boxes[axis];
            let room = I::Half::from_bytes(&mobility.leaf[axis]);
            let (with_sin, with_cos) =
                (I::Half::load(&mobility.with_sin[axis]), I::Half::load(&mobility.with_cos[axis]));
            let (low, high) = (room.nfma(leaf, low), room.fma(leaf, high));
            let (low, high) = (sin.fma(with_sin, low), sin.fma(with_sin, high));
            boxes[axis] = [cos.fma(with_cos, low), cos.fma(with_cos, high)];
            axis += 1;
        }
        boxes
    }

    #[inline(always)]
    fn foresee(&self, index: usize) {
        simd::prefetch(&self.mobility[index]);
    }
}

/// How the eight things in a node move, if none of them is a node.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Mobility {
    /// How far along each axis a shoot moves with the sine, and with the cosine, of the phase that it follows; other
    /// things do not move.
    with_sin: [[f32; 8]; 3],
    with_cos: [[f32; 8]; 3],
    /// Which phase it follows.
    pitch: [u8; 8],
    /// By how many 255ths of the leaves' farthest shift the box is wider.
    leaf: [[u8; 8]; 3],
}

/// Sine of the farthest turn, rounded up. A box's growth with the sine is convex, so that its chord from zero to here
/// bounds it.
const LEAF_SIN_MAX: f64 = 0.51;

impl Mobility {
    pub(super) fn new(node: &Node, shoots: &[Shoot], leaves: &[Leaf], half_v_m_max: f32) -> Self {
        let mut all =
            Mobility { with_sin: [[0.0; 8]; 3], with_cos: [[0.0; 8]; 3], pitch: [0; 8], leaf: [[0; 8]; 3] };
        // Branches do not move in their plant.
        for (slot, child) in node.things().filter(|(_, child)| child.kind() == SHOOT) {
            let (along, [sin, cos]) = shoots[child.index()].motion();
            for (axis, along) in along.into_iter().enumerate() {
                all.with_sin[axis][slot] = along * cos;
                all.with_cos[axis][slot] = along * sin;
            }
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
            let flutter = Flutter::new(&world.wind.bend(0, plant, seconds).unwrap());
            let ease =
                Swaying { mobility: &grown.mobility, flutter: &flutter, half_v_m_max: grown.half_v_m_max };
            for (index, node) in grown.nodes.iter().enumerate() {
                let steps = |bytes: &[[u8; 8]; 3], axis: usize| {
                    bytes[axis].map(|q| node.low[axis] + f32::from(q) * node.step[axis])
                };
                let boxes = std::array::from_fn(|axis| [steps(&node.from, axis), steps(&node.to, axis)]);
                let wider = Ease::<Portable>::widened(&ease, index, node, boxes);
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
