//! How sixteen beams that start together walk a tree of boxes.
//!
//! A node's eight boxes are first held against the whole packet at once, by interval arithmetic; only the boxes that
//! some beam might enter are held against each beam. Both tests use the same rounded products, and rounding is monotone,
//! so the first never drops what the second would keep. Boxes have a margin wider than all rounding, so a box test
//! never decides what a beam meets, only what it costs to find out.

use super::ease::{Boxes, Ease, Prepare};
use super::lanes::{Isa, Lanes};
use super::node::{Child, Node};
use super::simd;

/// Up to sixteen beams with one origin, seen from one frame.
pub(super) struct Beams<I: Isa> {
    pub(super) origin: [f32; 3],
    pub(super) direction: [I::Wide; 3],
    inverse: [I::Wide; 3],
    inverse_low: [f32; 3],
    inverse_high: [f32; 3],
    /// Whether no two directions point to different sides along any axis; then, per axis, whether they point backward.
    one_way: bool,
    backward: [bool; 3],
    /// Middle and half size of the box around all directions; the half has a margin for rounding.
    pub(super) middle: [f32; 3],
    pub(super) half: [f32; 3],
}

/// What beams have met so far. Beams that take no part have no stretch between `begin` and `range`.
pub(super) struct Nearest<I: Isa> {
    /// Nothing at or before this counts, in lengths of the direction.
    pub(super) begin: I::Wide,
    pub(super) range: I::Wide,
    /// The greatest `range`.
    pub(super) far: f32,
    /// The least `begin`.
    pub(super) near: f32,
    pub(super) met: [Met; 16],
}

/// A surface's address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Met {
    /// A plant's index, or one of the constants.
    pub(super) place: u32,
    pub(super) part: u32,
}

impl Met {
    pub(super) const NOTHING: Met = Met { place: u32::MAX, part: 0 };
    pub(super) const GROUND: u32 = u32::MAX - 1;
    pub(super) const SOLID: u32 = u32::MAX - 2;
    /// Parts of a plant from here on are branches.
    pub(super) const BRANCH: u32 = 1 << 31;
}

/// A subtree that some of the beams enter, no nearer than `range`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pending {
    range: f32,
    child: Child,
    mask: u32,
}

/// Who knows what a node's children are.
pub(super) trait Foresee {
    /// The child in this slot is likely to be visited soon.
    fn foresee(&mut self, child: Child, slot: usize);
}

/// Who knows what hangs in a tree whose boxes are held by an `E`.
pub(super) trait Expect<E> {
    /// The item is likely to be visited soon. `seat` is eight times its node's index and its slot.
    fn expect(&mut self, ease: &E, child: Child, seat: usize);
}

/// What hangs in a tree.
pub(super) trait Visit<I: Isa, E>: Expect<E> {
    /// The beams in the mask enter the item's box.
    fn visit(
        &mut self,
        ease: &E,
        child: Child,
        mask: u32,
        nearest: &mut Nearest<I>,
        stack: &mut Vec<Pending>,
    );
}

/// Children of a tree's node: nodes and what hangs in the tree.
struct InTree<'a, E, V> {
    nodes: &'a [Node],
    /// Which node's.
    index: usize,
    ease: &'a E,
    visitor: &'a mut V,
}

/// Flatter directions count as this flat: a product with the inverse is then never infinite times zero.
const FLAT: f32 = 1e-20;

impl<I: Isa> Beams<I> {
    /// The lanes in the mask must hold a beam; others may hold anything.
    #[inline(always)]
    pub(super) fn new(origin: [f32; 3], direction: [I::Wide; 3], mask: u32) -> Self {
        let zero = [0.0_f32; 3];
        let mut beams = Beams {
            origin,
            direction,
            inverse: direction,
            inverse_low: zero,
            inverse_high: zero,
            one_way: true,
            backward: [false; 3],
            middle: zero,
            half: zero,
        };
        let mut steepest = 0.0_f32;
        let mut axis = 0;
        while axis < 3 {
            let flat = direction[axis].abs().lt(I::Wide::splat(FLAT));
            let safe = I::Wide::splat(FLAT).keep(flat, direction[axis]);
            beams.inverse[axis] = I::Wide::splat(1.0).div(safe);
            let low = safe.keep(mask, I::Wide::splat(f32::INFINITY)).least();
            let high = safe.keep(mask, I::Wide::splat(f32::NEG_INFINITY)).greatest();
            let one_way = low > 0.0 || high < 0.0;
            beams.inverse_low[axis] = if one_way { 1.0 / high } else { -1.0 / FLAT };
            beams.inverse_high[axis] = if one_way { 1.0 / low } else { 1.0 / FLAT };
            beams.one_way &= one_way;
            beams.backward[axis] = high < 0.0;
            beams.middle[axis] = 0.5 * (low + high);
            beams.half[axis] = 0.5 * (high - low);
            let steep = if -low > high { -low } else { high };
            steepest = if steep > steepest { steep } else { steepest };
            axis += 1;
        }
        let mut axis = 0;
        while axis < 3 {
            beams.half[axis] += 1e-6 * steepest;
            axis += 1;
        }
        beams
    }
}

impl<I: Isa> Nearest<I> {
    #[inline(always)]
    pub(super) fn new(begin: I::Wide, range: I::Wide) -> Self {
        Nearest { begin, range, far: range.greatest(), near: begin.least(), met: [Met::NOTHING; 16] }
    }

    /// The beams in the mask cross a surface at these distances. Of surfaces at one distance the lesser address is met,
    /// so the order of visits decides nothing.
    #[inline(always)]
    pub(super) fn offer(&mut self, range: I::Wide, mask: u32, met: Met) {
        let mask = mask & self.begin.lt(range) & range.le(self.range);
        if mask == 0 {
            return;
        }
        let mut taken = range.lt(self.range) & mask;
        let mut alike = mask & !taken;
        while alike != 0 {
            let lane = alike.trailing_zeros() as usize & 15;
            taken |= u32::from(met < self.met[lane]) << lane;
            alike &= alike - 1;
        }
        self.range = range.keep(taken, self.range);
        self.far = self.range.greatest();
        while taken != 0 {
            self.met[taken.trailing_zeros() as usize & 15] = met;
            taken &= taken - 1;
        }
    }
}

/// Walks from the root, nearest boxes first. `ease` says how wide the boxes are held.
#[inline(always)]
pub(super) fn walk<I: Isa, V: Visit<I, E>, E: Ease<I>>(
    nodes: &[Node],
    beams: &Beams<I>,
    mask: u32,
    ease: &mut E,
    nearest: &mut Nearest<I>,
    stack: &mut Vec<Pending>,
    visitor: &mut V,
) {
    if nodes.is_empty() {
        return;
    }
    let floor = stack.len();
    stack.push(Pending { range: nearest.near, child: Child::new(Child::NODE, 0), mask });
    while stack.len() > floor {
        let Some((child, mask)) = next(nearest, stack) else { return };
        if mask == 0 {
            continue;
        }
        if child.kind() == Child::NODE {
            let node = &nodes[child.index()];
            let boxes = ease.boxes(child.index(), node, &beams.origin);
            let mut tree = InTree { nodes, index: child.index(), ease: &*ease, visitor };
            open(&boxes, &node.children, node.filled, beams, mask, nearest, stack, &mut tree);
        } else {
            visitor.visit(ease, child, mask, nearest, stack);
        }
    }
}

impl<E: Prepare, V: Expect<E>> Foresee for InTree<'_, E, V> {
    #[inline(always)]
    fn foresee(&mut self, child: Child, slot: usize) {
        if child.kind() == Child::NODE {
            simd::prefetch(&self.nodes[child.index()]);
            self.ease.foresee(child.index());
        } else {
            self.visitor.expect(self.ease, child, 8 * self.index + slot);
        }
    }
}

/// Puts the children whose boxes some beam of the mask enters on the stack, the nearest on top.
#[inline(always)]
pub(super) fn open<I: Isa, F: Foresee>(
    boxes: &Boxes<I>,
    children: &[Child; 8],
    filled: u32,
    beams: &Beams<I>,
    mask: u32,
    nearest: &Nearest<I>,
    stack: &mut Vec<Pending>,
    foresight: &mut F,
) {
    if beams.one_way {
        open_with::<I, F, true>(boxes, children, filled, beams, mask, nearest, stack, foresight);
    } else {
        open_with::<I, F, false>(boxes, children, filled, beams, mask, nearest, stack, foresight);
    }
}

/// The child on top of the stack, and the beams that have not met something nearer since its box was put there.
#[inline(always)]
pub(super) fn next<I: Isa>(nearest: &Nearest<I>, stack: &mut Vec<Pending>) -> Option<(Child, u32)> {
    let Pending { range, child, mask } = stack.pop()?;
    Some((child, mask & I::Wide::splat(range).le(nearest.range)))
}

/// Where all beams go one way the near and the far side of each box are known beforehand.
#[inline(always)]
fn open_with<I: Isa, F: Foresee, const ONE_WAY: bool>(
    boxes: &Boxes<I>,
    children: &[Child; 8],
    filled: u32,
    beams: &Beams<I>,
    mask: u32,
    nearest: &Nearest<I>,
    stack: &mut Vec<Pending>,
    foresight: &mut F,
) {
    let mut enter = I::Half::splat(nearest.near);
    let mut leave = I::Half::splat(nearest.far);
    let mut from = [[0.0_f32; 8]; 3];
    let mut to = [[0.0_f32; 8]; 3];
    let mut axis = 0;
    while axis < 3 {
        let [low, high] = boxes[axis];
        let (least, most) =
            (I::Half::splat(beams.inverse_low[axis]), I::Half::splat(beams.inverse_high[axis]));
        if ONE_WAY {
            let (near, far) = if beams.backward[axis] { (high, low) } else { (low, high) };
            enter = near.mul(least).min(near.mul(most)).max(enter);
            leave = far.mul(least).max(far.mul(most)).min(leave);
            near.store(&mut from[axis]);
            far.store(&mut to[axis]);
        } else {
            let (a, b, c, d) = (low.mul(least), low.mul(most), high.mul(least), high.mul(most));
            enter = a.min(b).min(c.min(d)).max(enter);
            leave = a.max(b).max(c.max(d)).min(leave);
            low.store(&mut from[axis]);
            high.store(&mut to[axis]);
        }
        axis += 1;
    }
    let mut maybe = enter.le(leave) & filled & 0xff;
    if maybe == 0 {
        return;
    }
    let mut entries = [0.0_f32; 8];
    enter.store(&mut entries);
    let floor = stack.len();
    while maybe != 0 {
        let slot = maybe.trailing_zeros() as usize & 7;
        maybe &= maybe - 1;
        let mut enter = nearest.begin;
        let mut leave = nearest.range;
        let mut axis = 0;
        while axis < 3 {
            let a = I::Wide::splat(from[axis][slot]).mul(beams.inverse[axis]);
            let b = I::Wide::splat(to[axis][slot]).mul(beams.inverse[axis]);
            if ONE_WAY {
                enter = a.max(enter);
                leave = b.min(leave);
            } else {
                enter = a.min(b).max(enter);
                leave = a.max(b).min(leave);
            }
            axis += 1;
        }
        let entering = enter.le(leave) & mask;
        if entering == 0 {
            continue;
        }
        let pending = Pending { range: entries[slot], child: children[slot], mask: entering };
        foresight.foresee(pending.child, slot);
        // Sorted in: few children survive, and the nearest is popped first.
        stack.push(pending);
        let mut at = stack.len() - 1;
        while at > floor && stack[at - 1].range < pending.range {
            stack[at] = stack[at - 1];
            at -= 1;
        }
        stack[at] = pending;
    }
}
