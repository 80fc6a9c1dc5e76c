//! A surface over the plane: a grid of nodes, two flat triangles per cell. The one place that says how.
//!
//! Node (column, row) stands at the grid's `center_of(column, row)`. The square between four nodes is cut along the
//! diagonal from (column, row) to (column + 1, row + 1). Outside the nodes the border's value goes on level.

use arborloop_base::Grid;
use nalgebra::{Point2, Vector2};

/// Where a point falls: the square's lowest node, the place inside the square in [0, 1], and whether each axis is inside.
struct Place {
    column: usize,
    row: usize,
    u: f64,
    v: f64,
    inside: [bool; 2],
}

/// An empty grid whose nodes cover `[-extent, extent]` squared, with a node exactly at the origin, and their places.
pub(crate) fn lattice(extent_m: f64, cell_m: f64) -> (Grid<f64>, Vec<f64>) {
    let half = (extent_m / cell_m).ceil().max(1.0);
    let corner = -half * cell_m - cell_m / 2.0;
    let side = 2 * half as usize + 1;
    let places = (0..side).map(|n| (n as f64 - half) * cell_m).collect();
    (Grid::filled(Point2::new(corner, corner), cell_m, side, side, 0.0), places)
}

/// Height of the surface; NaN where x or y is.
pub(crate) fn height(grid: &Grid<f64>, x: f64, y: f64) -> f64 {
    let place = place(grid, x, y);
    let [h00, h10, h01, h11] = corners(grid, &place);
    if place.u >= place.v {
        h00 + place.u * (h10 - h00) + place.v * (h11 - h10)
    } else {
        h00 + place.v * (h01 - h00) + place.u * (h11 - h01)
    }
}

/// Slope of the triangle under a point, height per meter along x and y; level along an axis that the point is outside of.
pub(crate) fn gradient(grid: &Grid<f64>, x: f64, y: f64) -> Vector2<f64> {
    let place = place(grid, x, y);
    let [h00, h10, h01, h11] = corners(grid, &place);
    let (along_x, along_y) = if place.u >= place.v { (h10 - h00, h11 - h10) } else { (h11 - h01, h01 - h00) };
    let kept = |rise: f64, inside: bool| if inside { rise / grid.resolution_m() } else { 0.0 };
    Vector2::new(kept(along_x, place.inside[0]), kept(along_y, place.inside[1]))
}

fn place(grid: &Grid<f64>, x: f64, y: f64) -> Place {
    let axis = |value: f64, origin: f64, nodes: usize| {
        let last = nodes as f64 - 1.0;
        let along = (value - origin) / grid.resolution_m() - 0.5;
        let clamped = along.clamp(0.0, last);
        let cell = clamped.floor().min(last - 1.0);
        (cell as usize, clamped - cell, along == clamped)
    };
    let (column, u, inside_x) = axis(x, grid.origin().x, grid.columns());
    let (row, v, inside_y) = axis(y, grid.origin().y, grid.rows());
    Place { column, row, u, v, inside: [inside_x, inside_y] }
}

fn corners(grid: &Grid<f64>, place: &Place) -> [f64; 4] {
    let columns = grid.columns();
    let first = place.row * columns + place.column;
    let cells = grid.cells();
    [cells[first], cells[first + 1], cells[first + columns], cells[first + columns + 1]]
}
