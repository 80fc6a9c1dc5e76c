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
        let mut cell = [0_usize; 2];
        let mut stride = [0_isize; 2];
        // In cells: the border ahead, and how it moves; then the distance at which it is crossed.
        let (mut border, mut onward) = ([0.0; 2], [0.0; 2]);
        let mut next = [f64::INFINITY; 2];
        let (mut from, mut inverse) = ([0.0; 2], [0.0; 2]);
        let mut enter = ray.range_m_min;
        for axis in 0..2 {
            let ahead = ray.direction[axis] * self.cells_per_m;
            from[axis] = (ray.origin[axis] - self.low[axis]) * self.cells_per_m;
            // The cast goes toward zero and saturates: what is outside is the outermost cell.
            cell[axis] = ((from[axis] + ahead * begin) as usize).min(self.count[axis] - 1);
            if ahead != 0.0 {
                (stride[axis], onward[axis]) = if ahead > 0.0 { (1, 1.0) } else { (-1, -1.0) };
                let behind = cell[axis] as f64 + if ahead > 0.0 { 0.0 } else { 1.0 };
                inverse[axis] = ahead.recip();
                border[axis] = behind + onward[axis];
                enter = enter.max((behind - from[axis]) * inverse[axis]);
                next[axis] = (border[axis] - from[axis]) * inverse[axis];
            }
        }
        while enter < end {
            let near = if next[0] < next[1] { next[0] } else { next[1] };
            let leave = if near < end { near } else { end };
            if enter < leave && visit(cell, enter, leave).is_break() {
                return;
            }
            let axis = usize::from(next[1] < next[0]);
            cell[axis] = cell[axis].wrapping_add_signed(stride[axis]);
            if stride[axis] == 0 || cell[axis] >= self.count[axis] {
                return;
            }
            enter = leave;
            border[axis] += onward[axis];
            next[axis] = (border[axis] - from[axis]) * inverse[axis];
        }
    }
}
