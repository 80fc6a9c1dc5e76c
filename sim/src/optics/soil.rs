//! The soil in double precision: where exactly a beam crosses the triangles that the tracer found it to meet.

use super::Ray;
use super::extent::Extent;
use arborloop_base::Grid;
use arborloop_worlds::Terrain;
use nalgebra::{Point3, Vector3};

/// Exact heights of the soil.
#[derive(Debug)]
pub(super) struct Soil {
    nodes: Grid<f64>,
    first: [f64; 2],
    cells_per_m: f64,
    /// Highest soil of each square of [`BLOCK`] cells.
    tops: Grid<f64>,
}

/// One of a cell's two triangles: the one above the diagonal from its lowest node, or the one below.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Facet {
    /// Column and row.
    pub(super) cell: [usize; 2],
    pub(super) upper: bool,
}

/// Cells along a side of the squares that are looked at as one.
pub(super) const BLOCK: usize = 16;

/// The highest value of each square of `side` by `side` cells, its border included.
pub(super) fn highest(nodes: &Grid<f64>, side: usize) -> Grid<f64> {
    let (columns, rows) = (nodes.columns() - 1, nodes.rows() - 1);
    let step = nodes.resolution_m();
    let corner = nodes.center_of(0, 0);
    let (across, along) = (columns.div_ceil(side), rows.div_ceil(side));
    let mut tops = Grid::filled(corner, step * side as f64, across, along, f64::NEG_INFINITY);
    for block in 0..across * along {
        let (left, low) = (block % across * side, block / across * side);
        let mut top = f64::NEG_INFINITY;
        for row in low..=(low + side).min(rows) {
            for column in left..=(left + side).min(columns) {
                top = top.max(nodes.cells()[row * nodes.columns() + column]);
            }
        }
        tops.cells_mut()[block] = top;
    }
    tops
}

/// The highest of the values that are no more than so many columns and rows away.
pub(super) fn around(values: &[f64], [columns, rows]: [usize; 2], reach: usize) -> Vec<f64> {
    let top = |values: &[f64], places: &mut dyn Iterator<Item = usize>| {
        places.map(|place| values[place]).fold(f64::NEG_INFINITY, f64::max)
    };
    let near = |place: usize, count: usize| place.saturating_sub(reach)..(place + reach + 1).min(count);
    let along = |place: usize| {
        let (column, row) = (place % columns, place / columns);
        top(values, &mut near(column, columns).map(|column| row * columns + column))
    };
    let along: Vec<f64> = (0..values.len()).map(along).collect();
    let across = |place: usize| {
        let (column, row) = (place % columns, place / columns);
        top(&along, &mut near(row, rows).map(|row| row * columns + column))
    };
    (0..values.len()).map(across).collect()
}

impl Soil {
    pub(super) fn new(terrain: &Terrain) -> Self {
        let nodes = terrain.grid().clone();
        let first = nodes.center_of(0, 0);
        let cells_per_m = nodes.resolution_m().recip();
        Soil { tops: highest(&nodes, BLOCK), first: [first.x, first.y], cells_per_m, nodes }
    }

    /// Whether beams that start in one block of the soil certainly start above it.
    pub(super) fn covers_none(&self, rays: &[Ray], extent: &Extent) -> bool {
        let Some(first) = rays.first() else { return true };
        let block = self.cell_at(first.origin.x, first.origin.y).map(|cell| cell / BLOCK);
        let top_m = self.tops.cells()[block[1] * self.tops.columns() + block[0]];
        let Extent { low, high } = extent;
        // Inside the block, measured in its sides.
        let share = self.cells_per_m / BLOCK as f64;
        let inside = |axis: usize| {
            let begin = self.first[axis] * share + block[axis] as f64;
            low[axis] * share - begin >= 0.0 && high[axis] * share - begin <= 1.0
        };
        let from_begin = low[6] == 0.0 && high[6] == 0.0;
        from_begin && low[2] > top_m && inside(0) && inside(1)
    }

    /// Whether the beam's stretch begins under the soil: it is then met where it begins.
    #[inline]
    pub(super) fn covers_start(&self, ray: &Ray) -> bool {
        let start = ray.origin + ray.direction * ray.range_m_min;
        let cell = self.cell_at(start.x, start.y);
        if start.z > self.tops.cells()[cell[1] / BLOCK * self.tops.columns() + cell[0] / BLOCK] {
            return false;
        }
        let outside = |place: f64, first: f64, nodes: usize| {
            !(0.0..=(nodes - 1) as f64).contains(&((place - first) * self.cells_per_m))
        };
        if outside(start.x, self.first[0], self.nodes.columns())
            || outside(start.y, self.first[1], self.nodes.rows())
        {
            return false;
        }
        let facet = Facet { cell, upper: self.is_upper(cell, start.x, start.y) };
        self.clearance_m(facet, &start).0 <= 0.0
    }

    /// Distance to the soil and its upward normal, from the triangle that the tracer named: its own rounding may name
    /// the neighbor, so the crossing goes over to the triangle that it falls on.
    #[inline]
    pub(super) fn crossing(&self, ray: &Ray, named: Facet, about_m: f64) -> (f64, Vector3<f64>) {
        let (mut facet, mut range_m) = (named, about_m);
        let mut turns = 0;
        loop {
            let at = ray.origin + ray.direction * range_m;
            let (clearance_m, normal) = self.clearance_m(facet, &at);
            let step_m = clearance_m / normal.dot(&ray.direction);
            if !step_m.is_finite() {
                return (range_m, normal);
            }
            range_m -= step_m;
            let at = ray.origin + ray.direction * range_m;
            if self.holds(facet, at.x, at.y) {
                return (range_m, normal);
            }
            let cell = self.cell_at(at.x, at.y);
            let next = Facet { cell, upper: self.is_upper(cell, at.x, at.y) };
            // A grazing beam's plane leads far away; then the named triangle's plane goes on.
            let far = cell[0].abs_diff(facet.cell[0]).max(cell[1].abs_diff(facet.cell[1])) > 1;
            turns += 1;
            if next == facet || far || turns == 4 {
                return (range_m, normal);
            }
            facet = next;
        }
    }

    #[inline(always)]
    fn cell_at(&self, x: f64, y: f64) -> [usize; 2] {
        let cell = |place: f64, first: f64, nodes: usize| {
            // The cast saturates, also for NaN.
            (((place - first) * self.cells_per_m) as usize).min(nodes - 2)
        };
        [cell(x, self.first[0], self.nodes.columns()), cell(y, self.first[1], self.nodes.rows())]
    }

    #[inline(always)]
    fn holds(&self, facet: Facet, x: f64, y: f64) -> bool {
        let step = self.nodes.resolution_m();
        let u = x - (self.first[0] + facet.cell[0] as f64 * step);
        let v = y - (self.first[1] + facet.cell[1] as f64 * step);
        let (low, high) = if facet.upper { (u, v) } else { (v, u) };
        0.0 <= low && low <= high && high <= step
    }

    #[inline(always)]
    fn is_upper(&self, [column, row]: [usize; 2], x: f64, y: f64) -> bool {
        let step = self.nodes.resolution_m();
        x - (self.first[0] + column as f64 * step) < y - (self.first[1] + row as f64 * step)
    }

    /// How far a point is above the plane of a triangle, straight up, and the plane's normal, which rises by one.
    #[inline(always)]
    fn clearance_m(&self, facet: Facet, at: &Point3<f64>) -> (f64, Vector3<f64>) {
        let [column, row] = facet.cell;
        let (step, cells) = (self.nodes.resolution_m(), self.nodes.cells());
        let index = row * self.nodes.columns() + column;
        let above = index + self.nodes.columns();
        let (h00, h10, h01, h11) = (cells[index], cells[index + 1], cells[above], cells[above + 1]);
        let u = at.x - (self.first[0] + column as f64 * step);
        let v = at.y - (self.first[1] + row as f64 * step);
        let rises = if facet.upper { [h11 - h01, h01 - h00] } else { [h10 - h00, h11 - h10] };
        let slope = rises.map(|rise| rise * self.cells_per_m);
        (at.z - (h00 + slope[0] * u + slope[1] * v), Vector3::new(-slope[0], -slope[1], 1.0))
    }
}
