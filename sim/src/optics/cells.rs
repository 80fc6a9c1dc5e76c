//! Which cells of a lattice a beam passes over, one after the other (Amanatides and Woo 1987).

use super::Ray;
use arborloop_base::Grid;
use std::ops::ControlFlow;

/// Square cells side by side on the ground.
#[derive(Debug)]
pub(super) struct Cells {
    /// Lowest corner of cell (0, 0), world frame.
    pub(super) low: [f64; 2],
    /// Side of a cell, meters.
    pub(super) step: f64,
    /// One over it.
    pub(super) cells_per_m: f64,
    /// Columns and rows.
    pub(super) count: [usize; 2],
}

impl Cells {
    /// Squares of so many by so many cells of a lattice of nodes; the last ones may reach over its border.
    pub(super) fn of(nodes: &Grid<f64>, side: usize) -> Self {
        let (low, step) = (nodes.center_of(0, 0), nodes.resolution_m() * side as f64);
        let count = [nodes.columns() - 1, nodes.rows() - 1].map(|cells| cells.div_ceil(side));
        Cells { low: [low.x, low.y], step, cells_per_m: step.recip(), count }
    }

    /// Whether a beam is over the lattice at a distance.
    #[inline]
    fn is_over(&self, ray: &Ray, range_m: f64) -> bool {
        (0..2).all(|axis| {
            let off_m = ray.origin[axis] + ray.direction[axis] * range_m - self.low[axis];
            0.0 <= off_m && off_m <= self.step * self.count[axis] as f64
        })
    }

    /// The part of a beam's stretch that is over the lattice.
    pub(super) fn within(&self, ray: &Ray, mut begin: f64, mut end: f64) -> Option<(f64, f64)> {
        // Most stretches lie over it whole: no division for them.
        if begin < end && self.is_over(ray, begin) && self.is_over(ray, end) {
            return Some((begin, end));
        }
        for axis in 0..2 {
            let (low, high) = (self.low[axis], self.low[axis] + self.step * self.count[axis] as f64);
            let (from, along) = (ray.origin[axis], ray.direction[axis]);
            if along == 0.0 {
                if !(low..=high).contains(&from) {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - from) / along, (high - from) / along);
            begin = begin.max(a.min(b));
            end = end.min(a.max(b));
        }
        (begin < end && end.is_finite()).then_some((begin, end))
    }

    /// Visits column and row of each cell that the beam is over from somewhere in the first one on, and the stretch
    /// over it, until `end` or until told to stop. Where borders are crossed does not depend on where it begins, to the bit,
    /// but nothing before the beam's own stretch is visited.
    #[inline(always)]
    pub(super) fn pass(
        &self,
        ray: &Ray,
        begin: f64,
        end: f64,
        mut visit: impl FnMut([usize; 2], f64, f64) -> ControlFlow<()>,
    ) {
        let mut enter = ray.range_m_min;
        let mut first = [0_usize; 2];
        let [x, y] = [0, 1].map(|axis| {
            let from = (ray.origin[axis] - self.low[axis]) * self.cells_per_m;
            let ahead = ray.direction[axis] * self.cells_per_m;
            // The cast goes toward zero and saturates: what is outside is the outermost cell.
            first[axis] = ((from + ahead * begin) as usize).min(self.count[axis] - 1);
            let Some(stride) = [(1, ahead > 0.0), (-1, ahead < 0.0)].into_iter().find(|(_, this)| *this)
            else {
                return Borders { stride: 0, onward: 0.0, from: f64::NEG_INFINITY, inverse: 1.0, next: 0.0 };
            };
            let onward = if stride.0 > 0 { 1.0 } else { -1.0 };
            let behind = first[axis] as f64 + if stride.0 > 0 { 0.0 } else { 1.0 };
            let borders =
                Borders { stride: stride.0, onward, from, inverse: ahead.recip(), next: behind + onward };
            enter = enter.max((behind - from) * borders.inverse);
            borders
        });
        let [mut column, mut row] = first;
        let (mut border_x, mut border_y) = (x.next, y.next);
        // Both axes are worked out, and one of them counts: which one, no processor foresees.
        while enter < end {
            let next_x = (border_x - x.from) * x.inverse;
            let next_y = (border_y - y.from) * y.inverse;
            let is_x = next_x <= next_y;
            let near = if is_x { next_x } else { next_y };
            let leave = if near < end { near } else { end };
            if enter < leave && visit([column, row], enter, leave).is_break() {
                return;
            }
            column = column.wrapping_add_signed(if is_x { x.stride } else { 0 });
            row = row.wrapping_add_signed(if is_x { 0 } else { y.stride });
            if column >= self.count[0] || row >= self.count[1] {
                return;
            }
            border_x += if is_x { x.onward } else { 0.0 };
            border_y += if is_x { 0.0 } else { y.onward };
            enter = leave;
        }
    }
}

/// A beam and the borders that it crosses along one axis, in cells.
struct Borders {
    stride: isize,
    onward: f64,
    from: f64,
    inverse: f64,
    /// The first border ahead; a beam along the borders has none at any distance.
    next: f64,
}
