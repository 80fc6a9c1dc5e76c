//! Which cells of a lattice a beam passes over, one after the other (Amanatides and Woo 1987).

use super::Ray;
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
    /// The part of a beam's stretch that is over the lattice.
    pub(super) fn within(&self, ray: &Ray, mut begin: f64, mut end: f64) -> Option<(f64, f64)> {
        // Most stretches lie over it whole: no division for them.
        let is_over = |axis: usize, range_m: f64| {
            let off_m = ray.origin[axis] + ray.direction[axis] * range_m - self.low[axis];
            0.0 <= off_m && off_m <= self.step * self.count[axis] as f64
        };
        if begin < end && (0..2).all(|axis| is_over(axis, begin) && is_over(axis, end)) {
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

    /// Visits column and row of each cell that the beam is over between two distances, and the stretch over it, until
    /// told to stop. `inverse` is one over the beam's direction along the lattice.
    #[inline(always)]
    pub(super) fn pass(
        &self,
        ray: &Ray,
        inverse: &[f64; 2],
        begin: f64,
        end: f64,
        mut visit: impl FnMut([usize; 2], f64, f64) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut cell = [0_i64; 2];
        let mut next = [f64::INFINITY; 2];
        let mut delta = [f64::INFINITY; 2];
        let mut stride = [0_i64; 2];
        for axis in 0..2 {
            let at_m = ray.origin[axis] + ray.direction[axis] * begin - self.low[axis];
            // Toward zero: what is outside is clamped anyway.
            cell[axis] = ((at_m * self.cells_per_m) as i64).clamp(0, self.count[axis] as i64 - 1);
            let ahead = ray.direction[axis];
            if ahead != 0.0 {
                stride[axis] = if ahead > 0.0 { 1 } else { -1 };
                delta[axis] = self.step * inverse[axis].abs();
                let border_m = (cell[axis] + i64::from(ahead > 0.0)) as f64 * self.step;
                next[axis] = begin + ((border_m - at_m) * inverse[axis]).max(0.0);
            }
        }
        let mut enter = begin;
        while enter < end {
            let leave = next[0].min(next[1]).min(end);
            visit([cell[0] as usize, cell[1] as usize], enter, leave)?;
            let axis = usize::from(next[1] < next[0]);
            cell[axis] += stride[axis];
            next[axis] += delta[axis];
            if stride[axis] == 0 || !(0..self.count[axis] as i64).contains(&cell[axis]) {
                break;
            }
            enter = leave;
        }
        ControlFlow::Continue(())
    }
}
