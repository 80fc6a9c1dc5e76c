//! The soil in double precision: where exactly a beam crosses the triangles that the tracer found it to meet.

use super::Ray;
use arborloop_base::Grid;
use arborloop_worlds::Terrain;
use nalgebra::Vector3;

/// Exact heights of the soil.
#[derive(Debug)]
pub(super) struct Soil {
    nodes: Grid<f64>,
    first: [f64; 2],
    /// Highest soil of each square of [`BLOCK`] cells.
    tops: Grid<f64>,
}

/// Cells along a side of the squares that are looked at as one.
pub(super) const BLOCK: usize = 16;

/// The highest value of each square of [`BLOCK`] by [`BLOCK`] cells, its border included.
pub(super) fn highest(nodes: &Grid<f64>) -> Grid<f64> {
    let (columns, rows) = (nodes.columns() - 1, nodes.rows() - 1);
    let step = nodes.resolution_m();
    let corner = nodes.center_of(0, 0);
    let (across, along) = (columns.div_ceil(BLOCK), rows.div_ceil(BLOCK));
    let mut tops = Grid::filled(corner, step * BLOCK as f64, across, along, f64::NEG_INFINITY);
    for block in 0..across * along {
        let (left, low) = (block % across * BLOCK, block / across * BLOCK);
        let mut top = f64::NEG_INFINITY;
        for row in low..=(low + BLOCK).min(rows) {
            for column in left..=(left + BLOCK).min(columns) {
                top = top.max(nodes.cells()[row * nodes.columns() + column]);
            }
        }
        tops.cells_mut()[block] = top;
    }
    tops
}

impl Soil {
    pub(super) fn new(terrain: &Terrain) -> Self {
        let nodes = terrain.grid().clone();
        let first = nodes.center_of(0, 0);
        Soil { tops: highest(&nodes), first: [first.x, first.y], nodes }
    }

    /// Whether the beam's stretch begins under the soil: it is then met where it begins.
    pub(super) fn covers_start(&self, ray: &Ray) -> bool {
        let start = ray.origin + ray.direction * ray.range_m_min;
        let Some((column, row)) = self.tops.index_of(&start.xy()) else { return false };
        if start.z > self.tops.cells()[row * self.tops.columns() + column] {
            return false;
        }
        let cell = self.cell_at(start.x, start.y);
        let (height, slope, [u, v]) = self.plane(cell, [start.x, start.y]);
        start.z <= height + slope[0] * u + slope[1] * v
    }

    /// Distance to the soil and its upward normal, from the cell that the tracer named: its own rounding may name the
    /// neighbor, so the crossing goes over to the triangle that it falls on.
    pub(super) fn crossing(&self, ray: &Ray, cell: [usize; 2], about_m: f64) -> (f64, Vector3<f64>) {
        let (mut cell, mut range_m) = (cell, about_m);
        let mut normal = Vector3::z();
        for turn in 0..4 {
            let at = ray.origin + ray.direction * range_m;
            if turn > 0 {
                let next = self.cell_at(at.x, at.y);
                let steps = next[0].abs_diff(cell[0]).max(next[1].abs_diff(cell[1]));
                // A grazing beam's plane leads far away; then the first triangle's plane goes on.
                cell = if steps <= 1 { next } else { cell };
            }
            let (height, slope, [u, v]) = self.plane(cell, [at.x, at.y]);
            normal = Vector3::new(-slope[0], -slope[1], 1.0);
            let above_m = at.z - (height + slope[0] * u + slope[1] * v);
            let step_m = -above_m / normal.dot(&ray.direction);
            if !step_m.is_finite() || step_m == 0.0 {
                break;
            }
            range_m += step_m;
            if step_m.abs() < 1e-9 {
                break;
            }
        }
        (range_m, normal)
    }

    fn cell_at(&self, x: f64, y: f64) -> [usize; 2] {
        let cell = |place: f64, first: f64, nodes: usize| {
            // The cast saturates, also for NaN.
            (((place - first) / self.nodes.resolution_m()) as usize).min(nodes - 2)
        };
        [cell(x, self.first[0], self.nodes.columns()), cell(y, self.first[1], self.nodes.rows())]
    }

    /// The plane over a place in a cell: height of the cell's lowest node, slopes, and the place from that node.
    fn plane(&self, [column, row]: [usize; 2], [x, y]: [f64; 2]) -> (f64, [f64; 2], [f64; 2]) {
        let (step, cells) = (self.nodes.resolution_m(), self.nodes.cells());
        let index = row * self.nodes.columns() + column;
        let above = index + self.nodes.columns();
        let (h00, h10, h01, h11) = (cells[index], cells[index + 1], cells[above], cells[above + 1]);
        let u = x - (self.first[0] + column as f64 * step);
        let v = y - (self.first[1] + row as f64 * step);
        let rises = if u >= v { [h10 - h00, h11 - h10] } else { [h11 - h01, h01 - h00] };
        (h00, rises.map(|rise| rise / step), [u, v])
    }
}
