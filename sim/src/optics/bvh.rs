//! A binary bounding-volume hierarchy over boxes, built by the surface-area heuristic in sixteen bins.

use nalgebra::{Point3, Vector3};

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Aabb {
    pub(super) low: Point3<f64>,
    pub(super) high: Point3<f64>,
}

/// Nodes in depth-first order: a node's left child follows it.
#[derive(Debug)]
pub(super) struct Bvh {
    nodes: Vec<Node>,
    /// Items in leaf order.
    items: Vec<usize>,
}

#[derive(Debug)]
struct Node {
    bounds: Aabb,
    /// For an inner node the index of its right child; for a leaf where its items begin.
    next: usize,
    /// Number of items; 0 for an inner node.
    count: usize,
}

const BINS: usize = 16;
const LEAF_ITEMS: usize = 4;

impl Aabb {
    /// Holds nothing; grows with the first point.
    pub(super) fn empty() -> Self {
        Aabb {
            low: Point3::from(Vector3::repeat(f64::INFINITY)),
            high: Point3::from(Vector3::repeat(f64::NEG_INFINITY)),
        }
    }

    pub(super) fn around(points: impl IntoIterator<Item = Point3<f64>>) -> Self {
        points.into_iter().fold(Aabb::empty(), |bounds, point| bounds.with(&Aabb { low: point, high: point }))
    }

    fn with(&self, other: &Aabb) -> Self {
        Aabb { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    fn half_area(&self) -> f64 {
        let side = self.high - self.low;
        if side.x < 0.0 { 0.0 } else { side.x * side.y + side.y * side.z + side.z * side.x }
    }

    fn center(&self) -> Point3<f64> {
        nalgebra::center(&self.low, &self.high)
    }

    /// The box around this box's corners after a map; nothing stays nothing.
    pub(super) fn transformed(&self, map: impl Fn(Point3<f64>) -> Point3<f64>) -> Self {
        if self.low.x > self.high.x {
            return Aabb::empty();
        }
        Aabb::around((0..8).map(|corner| {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { self.low[axis] } else { self.high[axis] };
            map(Point3::new(pick(0), pick(1), pick(2)))
        }))
    }

    /// Where a ray enters the box, if it does so before `nearest`.
    fn entry(&self, origin: &Point3<f64>, inverse: &Vector3<f64>, nearest: f64) -> Option<f64> {
        let (mut enter, mut leave) = (0.0_f64, nearest);
        for axis in 0..3 {
            let a = (self.low[axis] - origin[axis]) * inverse[axis];
            let b = (self.high[axis] - origin[axis]) * inverse[axis];
            // `max` and `min` drop the NaN of a ray that lies in a box's face: the face then bounds nothing.
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some(enter)
    }
}

impl Bvh {
    pub(super) fn new(bounds: &[Aabb]) -> Self {
        let mut bvh = Bvh { nodes: Vec::new(), items: (0..bounds.len()).collect() };
        if !bounds.is_empty() {
            bvh.build(bounds, 0, bounds.len());
        }
        bvh
    }

    /// The box around everything.
    pub(super) fn bounds(&self) -> Aabb {
        self.nodes.first().map_or_else(Aabb::empty, |root| root.bounds)
    }

    fn build(&mut self, bounds: &[Aabb], begin: usize, end: usize) {
        let own = self.items[begin..end].iter().fold(Aabb::empty(), |all, &item| all.with(&bounds[item]));
        let index = self.nodes.len();
        self.nodes.push(Node { bounds: own, next: begin, count: end - begin });
        if end - begin <= LEAF_ITEMS {
            return;
        }
        let middle = self.split(bounds, begin, end);
        self.build(bounds, begin, middle);
        self.nodes[index].next = self.nodes.len();
        self.nodes[index].count = 0;
        self.build(bounds, middle, end);
    }

    /// Sorts the items to both sides of the cheapest plane; half and half where no plane divides them.
    fn split(&mut self, bounds: &[Aabb], begin: usize, end: usize) -> usize {
        let items = &mut self.items[begin..end];
        let centers = Aabb::around(items.iter().map(|&item| bounds[item].center()));
        let mut best = (f64::INFINITY, 0, 0);
        for axis in 0..3 {
            let extent = centers.high[axis] - centers.low[axis];
            if extent <= 0.0 {
                continue;
            }
            let mut bins = [(Aabb::empty(), 0_usize); BINS];
            for &item in items.iter() {
                let bin = &mut bins[bin_of(&bounds[item], &centers, axis)];
                *bin = (bin.0.with(&bounds[item]), bin.1 + 1);
            }
            let mut right = [0.0; BINS];
            let mut swept = (Aabb::empty(), 0);
            for plane in (1..BINS).rev() {
                swept = (swept.0.with(&bins[plane].0), swept.1 + bins[plane].1);
                right[plane] = swept.0.half_area() * swept.1 as f64;
            }
            swept = (Aabb::empty(), 0);
            for plane in 1..BINS {
                swept = (swept.0.with(&bins[plane - 1].0), swept.1 + bins[plane - 1].1);
                let cost = swept.0.half_area() * swept.1 as f64 + right[plane];
                if swept.1 > 0 && swept.1 < items.len() && cost < best.0 {
                    best = (cost, axis, plane);
                }
            }
        }
        let (cost, axis, plane) = best;
        if cost.is_infinite() {
            return begin + (end - begin) / 2;
        }
        items.sort_by_key(|&item| (bin_of(&bounds[item], &centers, axis) >= plane, item));
        begin + items.partition_point(|&item| bin_of(&bounds[item], &centers, axis) < plane)
    }

    /// Visits the items whose leaf the ray enters before `nearest`, which the visitor may bring closer.
    pub(super) fn traverse(
        &self,
        origin: &Point3<f64>,
        direction: &Vector3<f64>,
        nearest: &mut f64,
        mut visit: impl FnMut(usize, &mut f64),
    ) {
        let inverse = direction.map(|d| 1.0 / d);
        // Depth is at most the number of halvings plus uneven splits; a vector grows where an array would overflow.
        let mut stack: Vec<(usize, f64)> = Vec::with_capacity(64);
        if let Some(root) = self.nodes.first()
            && let Some(entry) = root.bounds.entry(origin, &inverse, *nearest)
        {
            stack.push((0, entry));
        }
        while let Some((index, entry)) = stack.pop() {
            if entry > *nearest {
                continue;
            }
            let node = &self.nodes[index];
            if node.count > 0 {
                for &item in &self.items[node.next..node.next + node.count] {
                    visit(item, nearest);
                }
                continue;
            }
            let left = self.nodes[index + 1].bounds.entry(origin, &inverse, *nearest);
            let right = self.nodes[node.next].bounds.entry(origin, &inverse, *nearest);
            let mut push = |child: usize, entry: Option<f64>| stack.extend(entry.map(|entry| (child, entry)));
            if left.unwrap_or(f64::INFINITY) <= right.unwrap_or(f64::INFINITY) {
                push(node.next, right);
                push(index + 1, left);
            } else {
                push(index + 1, left);
                push(node.next, right);
            }
        }
    }
}

fn bin_of(bounds: &Aabb, centers: &Aabb, axis: usize) -> usize {
    let share = (bounds.center()[axis] - centers.low[axis]) / (centers.high[axis] - centers.low[axis]);
    ((share * BINS as f64) as usize).min(BINS - 1)
}
