//! Beams that travel together go through the grass abreast: each in its own cell, all at the same step.
//!
//! What happens in a cell is worked out for all of them at once, without branches, and chosen afterwards: which triangles a
//! beam crosses and where it dips below the tips no processor foresees. [`super::Grass::spans`] is the slow twin.

use super::super::Ray;
use super::super::trace::{Isa, Job};
use super::{GROUP, Grass};

/// Where the grass stops each of up to [`GROUP`] beams.
pub(super) struct Abreast<'a> {
    pub(super) grass: &'a Grass,
    pub(super) rays: &'a [Ray],
    /// From where on each may be in the grass; `None` for one that cannot.
    pub(super) begins: &'a [Option<f64>; GROUP],
    pub(super) ends_m: &'a [f64; GROUP],
}

/// As many as a wide register holds: the others need not wait for the slowest of them.
const LANES: usize = 8;

type Numbers = [f64; LANES];

/// A beam that is over has no end ahead.
const OVER: f64 = f64::NEG_INFINITY;

/// The beams along one axis, in cells.
struct Axis {
    from: Numbers,
    along: Numbers,
    /// Where borders count from: a beam along the borders has none at any distance.
    border_from: Numbers,
    inverse: Numbers,
    onward: Numbers,
    stride: [i32; LANES],
    next: Numbers,
    cell: [i32; LANES],
    count: i32,
}

impl Axis {
    /// At the cells that the beams are over at `begin`; `enter` is moved to where they are entered.
    #[inline(always)]
    fn new(from: Numbers, along: Numbers, count: usize, begin: &Numbers, enter: &mut Numbers) -> Self {
        let none = [0.0; LANES];
        let mut axis = Axis {
            from,
            along,
            border_from: none,
            inverse: none,
            onward: none,
            stride: [0; LANES],
            next: none,
            cell: [0; LANES],
            count: count as i32,
        };
        let last = (count - 1) as f64;
        for lane in 0..LANES {
            let (from, along) = (from[lane], along[lane]);
            let at = from + along * begin[lane];
            // What is outside is the outermost cell.
            let at = if at > 0.0 { at } else { 0.0 };
            let cell = (if at < last { at } else { last }) as i32;
            let first = f64::from(cell);
            let (ahead, back) = (along > 0.0, along < 0.0);
            let moves = ahead | back;
            let onward = if ahead { 1.0 } else { -1.0 };
            let behind = if ahead { first } else { first + 1.0 };
            let inverse = 1.0 / along;
            let entered = (behind - from) * inverse;
            axis.cell[lane] = cell;
            axis.border_from[lane] = if moves { from } else { f64::NEG_INFINITY };
            axis.inverse[lane] = if moves { inverse } else { 1.0 };
            axis.onward[lane] = if moves { onward } else { 0.0 };
            axis.stride[lane] = i32::from(ahead) - i32::from(back);
            axis.next[lane] = if moves { behind + onward } else { 0.0 };
            enter[lane] = if moves & (entered > enter[lane]) { entered } else { enter[lane] };
        }
        axis
    }
}

/// The part of a stretch, between two distances with their clearances, where the clearance is negative; one without
/// length where there is none.
#[inline(always)]
fn below(from_m: f64, a: f64, to_m: f64, b: f64) -> (f64, f64) {
    let surfacing = from_m + (to_m - from_m) * (a / (a - b));
    let (sinks, stays) = (a < 0.0, b < 0.0);
    let begin = if sinks { from_m } else { surfacing };
    let end = if stays { to_m } else { surfacing };
    (begin, if sinks | stays { end } else { begin })
}

impl Job for Abreast<'_> {
    type Out = [Option<f64>; GROUP];

    #[inline(always)]
    fn run<I: Isa>(self) -> Self::Out {
        let mut stops = [None; GROUP];
        for first in (0..self.rays.len()).step_by(LANES) {
            let lanes = first..(first + LANES).min(self.rays.len());
            let (begins, ends_m) = (&self.begins[lanes.clone()], &self.ends_m[lanes.clone()]);
            stop(self.grass, &self.rays[lanes.clone()], begins, ends_m, &mut stops[lanes]);
        }
        stops
    }
}

#[expect(clippy::needless_range_loop, reason = "a lane is one place in many arrays")]
#[inline(always)]
fn stop(grass: &Grass, rays: &[Ray], begins: &[Option<f64>], ends_m: &[f64], stops: &mut [Option<f64>]) {
    let Grass { tips, cells, .. } = grass;
    let (tips, columns, extinction_per_m) = (tips.cells(), tips.columns(), grass.extinction_per_m);
    let none = [0.0; LANES];
    let (mut from, mut along) = ([none; 2], [none; 2]);
    let (mut origin_z, mut along_z, mut begin, mut enter) = (none, none, none, none);
    let (mut left, mut end) = (none, [OVER; LANES]);
    for (lane, ray) in rays.iter().enumerate() {
        let Some(begin_m) = begins[lane] else { continue };
        for axis in 0..2 {
            from[axis][lane] = (ray.origin[axis] - cells.low[axis]) * cells.cells_per_m;
            along[axis][lane] = ray.direction[axis] * cells.cells_per_m;
        }
        (origin_z[lane], along_z[lane]) = (ray.origin.z, ray.direction.z);
        (begin[lane], enter[lane]) = (begin_m, ray.range_m_min);
        (left[lane], end[lane]) = (ray.depth.get(), ends_m[lane]);
    }
    let mut x = Axis::new(from[0], along[0], cells.count[0], &begin, &mut enter);
    let mut y = Axis::new(from[1], along[1], cells.count[1], &begin, &mut enter);
    // Where a beam crosses the diagonal of a cell; of no use where it runs along it.
    let mut across = none;
    for lane in 0..LANES {
        across[lane] = 1.0 / (x.along[lane] - y.along[lane]);
    }
    // Where the stretch begins on which a beam ends.
    let mut last = [f64::NAN; LANES];
    let mut corners = [none; 4];
    loop {
        let mut ahead = 0_u32;
        for lane in 0..LANES {
            ahead |= u32::from(enter[lane] < end[lane]);
        }
        if ahead == 0 {
            break;
        }
        for lane in 0..LANES {
            let first = y.cell[lane] as usize * columns + x.cell[lane] as usize;
            let nodes = &tips[first..first + columns + 2];
            corners[0][lane] = nodes[0];
            corners[1][lane] = nodes[1];
            corners[2][lane] = nodes[columns];
            corners[3][lane] = nodes[columns + 1];
        }
        for lane in 0..LANES {
            let (enter_m, end_m) = (enter[lane], end[lane]);
            let next_x = (x.next[lane] - x.border_from[lane]) * x.inverse[lane];
            let next_y = (y.next[lane] - y.border_from[lane]) * y.inverse[lane];
            let is_x = next_x <= next_y;
            let near = if is_x { next_x } else { next_y };
            let leave_m = if near < end_m { near } else { end_m };

            let [h00, h10, h01, h11] =
                [corners[0][lane], corners[1][lane], corners[2][lane], corners[3][lane]];
            let (column, row) = (f64::from(x.cell[lane]), f64::from(y.cell[lane]));
            let (from_x, from_y) = (x.from[lane], y.from[lane]);
            let (along_x, along_y) = (x.along[lane], y.along[lane]);
            let enter_z = origin_z[lane] + along_z[lane] * enter_m;
            let leave_z = origin_z[lane] + along_z[lane] * leave_m;
            let low = if h00 > h10 { h00 } else { h10 };
            let high = if h01 > h11 { h01 } else { h11 };
            let top = if low > high { low } else { high };
            let counts = (enter_m < leave_m) & !((enter_z > top) & (leave_z > top));

            // A cell is two triangles that share the diagonal from its lowest to its highest corner: u = v.
            let (enter_u, enter_v) = (from_x + along_x * enter_m - column, from_y + along_y * enter_m - row);
            let (leave_u, leave_v) = (from_x + along_x * leave_m - column, from_y + along_y * leave_m - row);
            let lower = enter_u >= enter_v;
            let rise_u = if lower { h10 - h00 } else { h11 - h01 };
            let rise_v = if lower { h11 - h10 } else { h01 - h00 };
            let a = enter_z - (h00 + rise_u * enter_u + rise_v * enter_v);
            let lower = leave_u >= leave_v;
            let rise_u = if lower { h10 - h00 } else { h11 - h01 };
            let rise_v = if lower { h11 - h10 } else { h01 - h00 };
            let b = leave_z - (h00 + rise_u * leave_u + rise_v * leave_v);
            let crosses = (enter_u - enter_v) * (leave_u - leave_v) < 0.0;
            let middle = (column - row - (from_x - from_y)) * across[lane];
            let middle = if middle < enter_m { enter_m } else { middle };
            let middle = if middle > leave_m { leave_m } else { middle };
            let m = origin_z[lane] + along_z[lane] * middle
                - (h00 + (h11 - h00) * (from_x + along_x * middle - column));

            let (turn_m, c) = if crosses { (middle, m) } else { (leave_m, b) };
            let (begin_1, end_1) = below(enter_m, a, turn_m, c);
            let used = extinction_per_m * (end_1 - begin_1);
            let inside = counts & (begin_1 < end_1);
            let stops_1 = inside & (used >= left[lane]);
            let left_1 = if inside & !stops_1 { left[lane] - used } else { left[lane] };
            let (begin_2, end_2) = below(middle, m, leave_m, b);
            let used = extinction_per_m * (end_2 - begin_2);
            let inside = counts & crosses & !stops_1 & (begin_2 < end_2);
            let stops_2 = inside & (used >= left_1);
            left[lane] = if inside & !stops_2 { left_1 - used } else { left_1 };
            last[lane] = if stops_1 {
                begin_1
            } else if stops_2 {
                begin_2
            } else {
                last[lane]
            };

            let column = x.cell[lane] + if is_x { x.stride[lane] } else { 0 };
            let row = y.cell[lane] + if is_x { 0 } else { y.stride[lane] };
            let outside = (column < 0) | (column >= x.count) | (row < 0) | (row >= y.count);
            let over = stops_1 | stops_2 | outside;
            x.cell[lane] = if outside { x.cell[lane] } else { column };
            y.cell[lane] = if outside { y.cell[lane] } else { row };
            x.next[lane] += if is_x { x.onward[lane] } else { 0.0 };
            y.next[lane] += if is_x { 0.0 } else { y.onward[lane] };
            enter[lane] = leave_m;
            end[lane] = if over { OVER } else { end_m };
        }
    }
    for lane in 0..rays.len() {
        let stop_m = last[lane] + left[lane] / extinction_per_m;
        if stop_m < ends_m[lane] {
            stops[lane] = Some(stop_m);
        }
    }
}
