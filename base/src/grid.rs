//! Rasters of the ground: drawn by a mapper, and from geometry for truth.

use nalgebra::Point2;

/// What a map says of one cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Cell {
    /// Never seen.
    #[default]
    Unknown,
    /// Seen empty.
    Free,
    /// Seen occupied.
    Occupied,
}

/// A raster aligned with its frame's axes; cell (column, row) covers
/// `origin + resolution * [column, column + 1) x [row, row + 1)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid<T> {
    origin: Point2<f64>,
    resolution_m: f64,
    columns: usize,
    rows: usize,
    cells: Vec<T>,
}

impl<T: Clone> Grid<T> {
    /// A raster filled with one value. `origin` is the outer corner of cell (0, 0).
    ///
    /// # Panics
    /// When the resolution is not a positive number.
    pub fn filled(origin: Point2<f64>, resolution_m: f64, columns: usize, rows: usize, value: T) -> Self {
        assert!(resolution_m > 0.0, "a grid's resolution is positive, not {resolution_m}");
        Grid { origin, resolution_m, columns, rows, cells: vec![value; columns * rows] }
    }
}

impl<T> Grid<T> {
    /// Outer corner of cell (0, 0), meters.
    pub fn origin(&self) -> Point2<f64> {
        self.origin
    }

    /// Side of a cell, meters.
    pub fn resolution_m(&self) -> f64 {
        self.resolution_m
    }

    /// Cells along x.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Cells along y.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// All cells, row by row from the lowest y.
    pub fn cells(&self) -> &[T] {
        &self.cells
    }

    /// All cells, to be changed in place; row by row from the lowest y.
    pub fn cells_mut(&mut self) -> &mut [T] {
        &mut self.cells
    }

    /// The cell that covers a point, or `None` outside.
    pub fn index_of(&self, point: &Point2<f64>) -> Option<(usize, usize)> {
        let column = ((point.x - self.origin.x) / self.resolution_m).floor();
        let row = ((point.y - self.origin.y) / self.resolution_m).floor();
        let inside = column >= 0.0 && row >= 0.0 && column < self.columns as f64 && row < self.rows as f64;
        inside.then_some((column as usize, row as usize))
    }

    /// Center of a cell, meters.
    pub fn center_of(&self, column: usize, row: usize) -> Point2<f64> {
        Point2::new(
            self.origin.x + (column as f64 + 0.5) * self.resolution_m,
            self.origin.y + (row as f64 + 0.5) * self.resolution_m,
        )
    }

    /// The value of a cell, or `None` outside.
    pub fn get(&self, column: usize, row: usize) -> Option<&T> {
        (column < self.columns && row < self.rows).then(|| &self.cells[row * self.columns + column])
    }

    /// The value of a cell, to be changed in place; `None` outside.
    pub fn get_mut(&mut self, column: usize, row: usize) -> Option<&mut T> {
        (column < self.columns && row < self.rows).then(|| &mut self.cells[row * self.columns + column])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_holds_its_own_center_and_the_grid_ends_where_it_says() {
        let grid = Grid::filled(Point2::new(-1.0, 2.0), 0.5, 4, 3, 0_u8);
        for row in 0..3 {
            for column in 0..4 {
                assert_eq!(grid.index_of(&grid.center_of(column, row)), Some((column, row)));
            }
        }
        assert_eq!(grid.index_of(&Point2::new(-1.0, 2.0)), Some((0, 0)));
        assert_eq!(grid.index_of(&Point2::new(1.0, 2.0)), None);
        assert_eq!(grid.index_of(&Point2::new(f64::NAN, 2.0)), None);
        assert_eq!(grid.get(4, 0), None);
    }
}
