//! A tree of boxes, eight children to a node, their corners in steps of a 255th of the node: 104 bytes for eight boxes.

use super::super::boxes::{self, Aabb};

/// What hangs where a child would: a kind and an index in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Child(u32);

impl Child {
    /// Kind of a child that is a node of the same tree.
    pub(super) const NODE: u32 = 0;

    /// An item; kinds are 1 to 7 and mean what the tree's owner says. Indices end at 2^29.
    pub(super) fn new(kind: u32, index: usize) -> Self {
        assert!(index < 1 << 29 && kind < 8, "a tree of boxes holds fewer than 2^29 items");
        Child(kind << 29 | index as u32)
    }

    #[inline(always)]
    pub(super) fn kind(self) -> u32 {
        self.0 >> 29
    }

    #[inline(always)]
    pub(super) fn index(self) -> usize {
        (self.0 & ((1 << 29) - 1)) as usize
    }
}

/// Eight boxes and what is in them. Corner `q` of an axis is at `low + q step`.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Node {
    pub(super) low: [f32; 3],
    pub(super) step: [f32; 3],
    pub(super) from: [[u8; 8]; 3],
    pub(super) to: [[u8; 8]; 3],
    pub(super) children: [Child; 8],
    /// One bit for each child that is there, [`NODES`] and [`THINGS`].
    pub(super) filled: u32,
}

/// Set where a child is a node, and where one is not.
const NODES: u32 = 1 << 8;
const THINGS: u32 = 1 << 9;

/// Splits by area at most this many levels deep, then by number, so that no arrangement of boxes makes a tree deep.
const LEVELS_BY_AREA: usize = 24;

/// A tree over the items in these boxes; its root is the first node. No node where there is no item; items whose box
/// is empty or not finite are left out.
pub(super) fn tree(bounds: &[Aabb], children: &[Child]) -> Vec<Node> {
    let mut items: Vec<usize> = (0..bounds.len()).filter(|&item| bounds[item].is_real()).collect();
    let mut nodes = Vec::new();
    if !items.is_empty() {
        grow(bounds, children, &mut items, 0, &mut nodes);
    }
    nodes.shrink_to_fit();
    nodes
}

fn around(bounds: &[Aabb], items: &[usize]) -> Aabb {
    items.iter().fold(Aabb::empty(), |all, &item| all.with(&bounds[item]))
}

/// Parts the items into at most eight. Parts of more than eight are split, the largest first; where places are left, the
/// smallest part gives each of its items one. So a small crowd is one full node, not a node of small nodes.
fn grow(
    bounds: &[Aabb],
    children: &[Child],
    items: &mut [usize],
    level: usize,
    nodes: &mut Vec<Node>,
) -> usize {
    let index = nodes.len();
    let mut parts = vec![(0, items.len(), around(bounds, items))];
    let whole = parts[0].2;
    while parts.len() < 8 {
        let count = |part: &(usize, usize, Aabb)| part.1 - part.0;
        let large = (0..parts.len()).filter(|&at| count(&parts[at]) > 8);
        if let Some(at) = large.max_by(|&a, &b| parts[a].2.half_area().total_cmp(&parts[b].2.half_area())) {
            let (begin, end, _) = parts[at];
            let here = &mut items[begin..end];
            let before = if level < LEVELS_BY_AREA { boxes::split(bounds, here) } else { here.len() / 2 };
            parts[at] = (begin, begin + before, around(bounds, &items[begin..begin + before]));
            parts.push((begin + before, end, around(bounds, &items[begin + before..end])));
            continue;
        }
        let several = (0..parts.len()).filter(|&at| count(&parts[at]) > 1);
        let Some(at) = several.min_by_key(|&at| count(&parts[at])) else { break };
        if parts.len() - 1 + count(&parts[at]) > 8 {
            break;
        }
        let (begin, end, _) = parts.swap_remove(at);
        parts.extend((begin..end).map(|item| (item, item + 1, bounds[items[item]])));
    }
    nodes.push(Node::around(&whole));
    for (slot, (begin, end, part)) in parts.into_iter().enumerate() {
        let child = match end - begin {
            1 => children[items[begin]],
            _ => Child::new(Child::NODE, grow(bounds, children, &mut items[begin..end], level + 1, nodes)),
        };
        nodes[index].hang(slot, &part, child);
    }
    index
}

impl Node {
    fn around(whole: &Aabb) -> Self {
        // A 255th more than needed, so that rounding to single precision leaves no corner outside.
        let step = (whole.high - whole.low) / 254.0;
        Node {
            low: std::array::from_fn(|axis| (whole.low[axis] - 0.25 * step[axis]) as f32),
            step: std::array::from_fn(|axis| (step[axis] as f32).max(1e-7)),
            from: [[0; 8]; 3],
            to: [[0; 8]; 3],
            children: [Child(0); 8],
            filled: 0,
        }
    }

    /// A node around these boxes, each with an item of a kind: the first item in the first box and so on. Boxes that hold
    /// nothing stay empty.
    pub(super) fn holding(whole: &Aabb, parts: &[Aabb], kind: u32) -> Self {
        let mut node = Node::around(whole);
        for (slot, part) in parts.iter().enumerate().filter(|(_, part)| part.is_real()) {
            node.hang(slot, part, Child::new(kind, slot));
        }
        node
    }

    fn hang(&mut self, slot: usize, part: &Aabb, child: Child) {
        self.hold(slot, part, &self.steps_per_m());
        self.children[slot] = child;
        self.filled |= 1 << slot | if child.kind() == Child::NODE { NODES } else { THINGS };
    }

    fn steps_per_m(&self) -> [f64; 3] {
        self.step.map(|step| 1.0 / f64::from(step))
    }

    /// Holds a child in a box inside the node's own.
    fn hold(&mut self, slot: usize, part: &Aabb, steps_per_m: &[f64; 3]) {
        for (axis, steps_per_m) in steps_per_m.iter().enumerate() {
            let steps = |place: f64| (place - f64::from(self.low[axis])) * steps_per_m;
            // Casts saturate.
            let (low, high) = (steps(part.low[axis]), steps(part.high[axis]));
            self.from[axis][slot] = low as u8;
            self.to[axis][slot] = (high as u8).saturating_add(u8::from(high > f64::from(high as u8)));
        }
    }

    /// Holds the children that are there in these boxes, `whole` around all of them.
    pub(super) fn fit(&mut self, whole: &Aabb, parts: &[Aabb; 8]) {
        let Node { low, step, .. } = Node::around(whole);
        (self.low, self.step) = (low, step);
        let steps_per_m = self.steps_per_m();
        for (slot, _) in self.things() {
            self.hold(slot, &parts[slot], &steps_per_m);
        }
    }

    /// Whether some child is a node.
    #[inline(always)]
    pub(super) fn has_nodes(&self) -> bool {
        self.filled & NODES != 0
    }

    /// Whether some child is none.
    #[inline(always)]
    pub(super) fn has_things(&self) -> bool {
        self.filled & THINGS != 0
    }

    /// The children that are there, with their places.
    pub(super) fn things(&self) -> impl Iterator<Item = (usize, Child)> + use<> {
        {
            let (filled, children) = (self.filled, self.children);
            (0..8).filter(move |slot| filled >> slot & 1 == 1).map(move |slot| (slot, children[slot]))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;
    use nalgebra::{Point3, Vector3};

    fn crowd(count: u64) -> Vec<Aabb> {
        let stream = Seed(4).stream("crowd");
        let each = |index| {
            let mut draws = stream.at(index);
            let mut point = |reach: f64| Vector3::from_fn(|_, _| draws.within(-reach, reach));
            let center = Point3::from(point(40.0));
            let reach = point(0.5).abs();
            Aabb { low: center - reach, high: center + reach }
        };
        (0..count).map(each).collect()
    }

    #[test]
    fn every_item_hangs_once_in_a_box_that_holds_it() {
        for count in [0, 1, 2, 8, 9, 1000] {
            let bounds = crowd(count);
            let children: Vec<Child> = (0..bounds.len()).map(|index| Child::new(1, index)).collect();
            let nodes = tree(&bounds, &children);
            let mut seen = vec![0; bounds.len()];
            for node in &nodes {
                for slot in (0..8).filter(|slot| node.filled >> slot & 1 == 1) {
                    let child = node.children[slot];
                    if child.kind() != 1 {
                        continue;
                    }
                    seen[child.index()] += 1;
                    for axis in 0..3 {
                        let place =
                            |q: u8| f64::from(node.low[axis]) + f64::from(q) * f64::from(node.step[axis]);
                        // A millionth of the crowd's size is for single precision; the tracer's margin is wider.
                        assert!(place(node.from[axis][slot]) <= bounds[child.index()].low[axis] + 1e-5);
                        assert!(place(node.to[axis][slot]) >= bounds[child.index()].high[axis] - 1e-5);
                    }
                }
            }
            assert_eq!(seen, vec![1; bounds.len()]);
        }
    }

    #[test]
    fn boxes_that_no_plane_divides_still_make_a_shallow_tree() {
        let bounds = vec![crowd(1)[0]; 5000];
        let children: Vec<Child> = (0..bounds.len()).map(|index| Child::new(1, index)).collect();
        let nodes = tree(&bounds, &children);
        assert!(nodes.len() < 5000);
    }
}
