//! How far beams that travel together are above a surface of nodes for certain, found in a few steps.
//!
//! A lid is a plane above all nodes around a square. Around each square there are a narrow one and a wider one, and two
//! level ones that are wider still: far from the surface the steps are long.

use super::Ray;
use super::cells::Cells;
use super::extent::Extent;
use super::soil;
use arborloop_base::Grid;

/// Cells along a square's side.
const SIDE: usize = 2;
/// How many squares to each side a lid covers beside the one in its middle, from the narrowest to the widest.
const REACH: [usize; 4] = [1, 3, 8, 24];
/// Steps after which the rest is left to others.
const STEPS_MAX: usize = 48;
/// Steps shorter than this share of a square's side are not worth their while.
const SHORT: f64 = 0.1;

/// A plane that no node pierces. On a slope it lies much closer than the highest node does.
#[derive(Debug, Clone, Copy)]
struct Lid {
    /// Above the lowest corner of the square in its middle, world frame, meters.
    height_m: f64,
    /// Rise for each meter along x and y.
    rise: [f64; 2],
}

/// Lids over a surface.
#[derive(Debug)]
pub(super) struct Lids {
    squares: Cells,
    /// For each square those of [`REACH`].
    lids: Vec<[Lid; 4]>,
    /// The highest node of all.
    top_m: f64,
}

/// The beams of a group as one: from where, along which directions.
struct Sheaf {
    middle: [f64; 2],
    along: [f64; 2],
    /// Half of how far apart they are along x or y, at their begins and for each meter.
    half_m: f64,
    spread: f64,
    /// Height of the lowest begin, and what the steepest one sinks.
    height_m: f64,
    rise: f64,
    begin_m: f64,
}

impl Lids {
    pub(super) fn over(nodes: &Grid<f64>) -> Self {
        let (squares, columns, rows) = (Cells::of(nodes, SIDE), nodes.columns() - 1, nodes.rows() - 1);
        let places = 0..squares.count[0] * squares.count[1];
        let place = |index: usize| [index % squares.count[0], index / squares.count[0]];
        let own: Vec<Lid> = places
            .clone()
            .map(|index| {
                let [left, low] = place(index).map(|n| n * SIDE);
                Lid::over(nodes, [left, low], [(left + SIDE).min(columns), (low + SIDE).min(rows)])
            })
            .collect();
        let highest = soil::highest(nodes, SIDE);
        let [high, highest] = [2, 3].map(|width| soil::around(highest.cells(), squares.count, REACH[width]));
        let lids = places.map(|index| {
            let [narrow, wide] = [0, 1].map(|width| Lid::around(&own, &squares, place(index), REACH[width]));
            let level = |height_m: f64| Lid { height_m, rise: [0.0; 2] };
            [narrow, wide, level(high[index]), level(highest[index])]
        });
        let top_m = nodes.cells().iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Lids { lids: lids.collect(), squares, top_m }
    }

    /// Memory, bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.lids.as_slice())
    }

    /// Up to which distance each of these beams is above the surface for certain, or not over it; what lies beyond
    /// `far_m` is not asked.
    pub(super) fn clear_until(&self, rays: &[Ray], extent: &Extent, far_m: f64, clear_m: &mut [f64]) {
        let sheaf = Sheaf::of(extent);
        let Cells { low, step, cells_per_m, count } = self.squares;
        // How fast the farthest of them leaves a place.
        let pace = sheaf.along[0].abs().max(sheaf.along[1].abs()) + sheaf.spread;
        let mut at_m = sheaf.begin_m;
        for _ in 0..STEPS_MAX {
            if at_m >= far_m {
                break;
            }
            let height_m = sheaf.height_m + sheaf.rise * at_m;
            if sheaf.rise >= 0.0 && height_m > self.top_m {
                at_m = far_m;
                break;
            }
            let off = [0, 1].map(|axis| sheaf.middle[axis] + sheaf.along[axis] * at_m - low[axis]);
            let square = off.map(|off_m| off_m * cells_per_m);
            if !(0..2).all(|axis| square[axis] >= 0.0 && square[axis] < count[axis] as f64) {
                break;
            }
            let square = square.map(|place| place as usize);
            let half_m = sheaf.half_m + sheaf.spread * at_m;
            let lids = &self.lids[square[1] * count[0] + square[0]];
            let corner = [0, 1].map(|axis| low[axis] + square[axis] as f64 * step);
            let mut most_m = 0.0;
            for (lid, reach) in lids.iter().zip(REACH).rev() {
                let room_m = reach as f64 * step - half_m;
                if room_m <= 0.0 {
                    break;
                }
                let [x, y] = lid.rise;
                let steep = x.abs() + y.abs();
                let away = [0, 1].map(|axis| off[axis] + low[axis] - corner[axis]);
                let clearance_m = height_m - lid.height_m - x * away[0] - y * away[1] - steep * half_m;
                if clearance_m <= 0.0 {
                    continue;
                }
                let sinks = x * sheaf.along[0] + y * sheaf.along[1] + steep * sheaf.spread - sheaf.rise;
                if sinks * room_m <= clearance_m * pace {
                    // Narrower lids end sooner.
                    most_m = f64::max(most_m, room_m / pace);
                    break;
                }
                most_m = f64::max(most_m, clearance_m / sinks);
            }
            if most_m <= SHORT * step {
                // Each beam goes on alone until it meets the narrowest lid.
                let room_m = (REACH[0] as f64 * step - half_m) / pace;
                for (ray, clear_m) in rays.iter().zip(clear_m) {
                    *clear_m = at_m + lids[0].room_m(ray, corner, at_m).min(room_m).max(0.0);
                }
                return;
            }
            at_m += most_m;
        }
        clear_m.fill(at_m);
    }
}

impl Sheaf {
    fn of(Extent { low, high }: &Extent) -> Self {
        let middle = |number: usize| 0.5 * (low[number] + high[number]);
        let half = |number: usize| 0.5 * (high[number] - low[number]);
        Sheaf {
            middle: [middle(0), middle(1)],
            along: [middle(3), middle(4)],
            half_m: half(0).max(half(1)),
            spread: half(3).max(half(4)),
            height_m: low[2],
            rise: low[5],
            begin_m: low[6].max(0.0),
        }
    }
}

impl Lid {
    /// How much farther than `at_m` a beam goes before it meets the plane; the corner is that of the square.
    #[inline(always)]
    fn room_m(&self, ray: &Ray, corner: [f64; 2], at_m: f64) -> f64 {
        let ([x, y], along) = (self.rise, &ray.direction);
        let at = ray.origin + along * at_m;
        let clearance_m = at.z - self.height_m - x * (at.x - corner[0]) - y * (at.y - corner[1]);
        let sinks = x * along.x + y * along.y - along.z;
        if sinks > 0.0 && clearance_m > 0.0 {
            clearance_m / sinks
        } else if clearance_m > 0.0 {
            f64::INFINITY
        } else {
            0.0
        }
    }

    /// Over the nodes from one column and row to another.
    fn over(nodes: &Grid<f64>, [left, low]: [usize; 2], [right, high]: [usize; 2]) -> Self {
        let node = |column: usize, row: usize| nodes.cells()[row * nodes.columns() + column];
        let step = nodes.resolution_m();
        // The mean rises between opposite sides; whatever they are, the lid is put on top of the highest node.
        let [mut along_x, mut along_y] = [0.0, 0.0];
        (low..=high).for_each(|row| along_x += node(right, row) - node(left, row));
        (left..=right).for_each(|column| along_y += node(column, high) - node(column, low));
        let across = (((right - left) * (high - low + 1)) as f64 * step).recip();
        let upward = (((high - low) * (right - left + 1)) as f64 * step).recip();
        let rise = [along_x * across, along_y * upward];
        let mut height_m = f64::NEG_INFINITY;
        for row in low..=high {
            for column in left..=right {
                let away = [(column - left) as f64 * step, (row - low) as f64 * step];
                height_m = height_m.max(node(column, row) - rise[0] * away[0] - rise[1] * away[1]);
            }
        }
        // A hair for rounding.
        Lid { height_m: height_m + 1e-9, rise }
    }

    /// Over the lids of the squares up to so many away.
    fn around(own: &[Lid], squares: &Cells, [column, row]: [usize; 2], reach: usize) -> Self {
        let near = |place: usize, count: usize| place.saturating_sub(reach)..(place + reach + 1).min(count);
        let members = || {
            let rows = near(row, squares.count[1]);
            rows.flat_map(|row| near(column, squares.count[0]).map(move |column| [column, row]))
        };
        let lid_of = |[column, row]: [usize; 2]| &own[row * squares.count[0] + column];
        let (mut rise, mut count) = ([0.0; 2], 0.0);
        for lid in members().map(lid_of) {
            (rise, count) = ([rise[0] + lid.rise[0], rise[1] + lid.rise[1]], count + 1.0);
        }
        let rise = rise.map(|sum: f64| sum / count);
        let mut height_m = f64::NEG_INFINITY;
        for member in members() {
            let lid = lid_of(member);
            for corner in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
                let within = corner.map(|side: f64| side * squares.step);
                let away_x = (member[0] as f64 - column as f64) * squares.step + within[0];
                let away_y = (member[1] as f64 - row as f64) * squares.step + within[1];
                let at = lid.height_m + lid.rise[0] * within[0] + lid.rise[1] * within[1];
                height_m = height_m.max(at - rise[0] * away_x - rise[1] * away_y);
            }
        }
        Lid { height_m: height_m + 1e-9, rise }
    }
}
