//! A raster that grows where something is written: cells are named by signed numbers from the map's origin.

/// A cell (column, row); it covers `cell_m * [column, column + 1) x [row, row + 1)`.
pub(crate) type CellIndex = (i32, i32);

/// Cells are counted this far to each side of the origin; what lies beyond is held at the border, so that no sum overflows.
const INDEX_MAX: f64 = 1e8;
/// A raster grows to this many bytes and no further: a lost track must not eat the machine.
const BYTES_MAX: i64 = 256 << 20;

/// Growing raster aligned with the map's axes.
#[derive(Debug, Clone)]
pub(crate) struct Raster<T> {
    cell_m: f64,
    margin: i32,
    first: CellIndex,
    columns: i32,
    rows: i32,
    cells: Vec<T>,
    blank: T,
}

impl<T: Copy> Raster<T> {
    /// An empty raster; it grows by `margin_m` and an eighth of its side more than it must, so that it grows seldom.
    pub(crate) fn new(cell_m: f64, margin_m: f64, blank: T) -> Self {
        let margin = (margin_m / cell_m).ceil() as i32;
        Raster { cell_m, margin, first: (0, 0), columns: 0, rows: 0, cells: Vec::new(), blank }
    }

    /// The cell that covers a point.
    pub(crate) fn cell_of(&self, x_m: f64, y_m: f64) -> CellIndex {
        cell_at(x_m, y_m, self.cell_m)
    }

    /// Lower left cell that is stored.
    pub(crate) fn first(&self) -> CellIndex {
        self.first
    }

    /// Stored columns and rows.
    pub(crate) fn size(&self) -> (i32, i32) {
        (self.columns, self.rows)
    }

    /// The value of a cell; blank where nothing was written.
    pub(crate) fn get(&self, cell: CellIndex) -> T {
        self.place_of(cell).map_or(self.blank, |place| self.cells[place])
    }

    /// A cell to be changed; `None` outside of what [`Raster::cover`] has made room for.
    pub(crate) fn get_mut(&mut self, cell: CellIndex) -> Option<&mut T> {
        self.place_of(cell).map(|place| &mut self.cells[place])
    }

    /// Where a cell lies among all that are stored, row after row.
    pub(crate) fn place_of(&self, (column, row): CellIndex) -> Option<usize> {
        let (i, j) = (column - self.first.0, row - self.first.1);
        let is_stored = i >= 0 && j >= 0 && i < self.columns && j < self.rows;
        is_stored.then(|| j as usize * self.columns as usize + i as usize)
    }

    /// All cells that are stored, row after row.
    pub(crate) fn cells_mut(&mut self) -> &mut [T] {
        &mut self.cells
    }

    /// All cells that are stored, with their names, row after row.
    pub(crate) fn stored(&self) -> impl Iterator<Item = (CellIndex, T)> + '_ {
        let (columns, first) = (self.columns.max(1), self.first);
        self.cells.iter().enumerate().map(move |(place, value)| {
            ((first.0 + place as i32 % columns, first.1 + place as i32 / columns), *value)
        })
    }

    /// The same, to be changed.
    pub(crate) fn stored_mut(&mut self) -> impl Iterator<Item = (CellIndex, &mut T)> + '_ {
        let (columns, first) = (self.columns.max(1), self.first);
        self.cells.iter_mut().enumerate().map(move |(place, value)| {
            ((first.0 + place as i32 % columns, first.1 + place as i32 / columns), value)
        })
    }

    /// The stored part of a row, columns `from..to`, and the column where that part begins.
    pub(crate) fn row(&self, row: i32, from: i32, to: i32) -> (i32, &[T]) {
        let j = row - self.first.1;
        let (from, to) = (from.max(self.first.0), to.min(self.first.0 + self.columns));
        if j < 0 || j >= self.rows || from >= to {
            return (from, &[]);
        }
        let start = j * self.columns - self.first.0;
        (from, &self.cells[(start + from) as usize..(start + to) as usize])
    }

    /// Makes room for all cells from `low` to `high`, both included, unless that is too much.
    pub(crate) fn cover(&mut self, low: CellIndex, high: CellIndex) {
        let end = (self.first.0 + self.columns, self.first.1 + self.rows);
        let empty = self.cells.is_empty();
        if !empty && low.0 >= self.first.0 && low.1 >= self.first.1 && high.0 < end.0 && high.1 < end.1 {
            return;
        }
        let reach = |old: i32, wanted: i32, by: i32, beyond: bool| {
            if empty || beyond { wanted + by } else { old }
        };
        let (by_x, by_y) = (self.margin + self.columns / 8, self.margin + self.rows / 8);
        let first = (
            reach(self.first.0, low.0, -by_x, low.0 < self.first.0),
            reach(self.first.1, low.1, -by_y, low.1 < self.first.1),
        );
        let end = (
            reach(end.0, high.0 + 1, by_x, high.0 >= end.0),
            reach(end.1, high.1 + 1, by_y, high.1 >= end.1),
        );
        let (columns, rows) = (end.0 - first.0, end.1 - first.1);
        if i64::from(columns) * i64::from(rows) * size_of::<T>() as i64 > BYTES_MAX {
            return;
        }
        let mut cells = vec![self.blank; columns as usize * rows as usize];
        for (j, old) in self.cells.chunks_exact(self.columns.max(1) as usize).enumerate() {
            let at = (j as i32 + self.first.1 - first.1) * columns + self.first.0 - first.0;
            cells[at as usize..at as usize + old.len()].copy_from_slice(old);
        }
        (self.first, self.columns, self.rows, self.cells) = (first, columns, rows, cells);
    }
}

/// The cell of a side of `cell_m` that covers a point.
pub(crate) fn cell_at(x_m: f64, y_m: f64, cell_m: f64) -> CellIndex {
    let index = |along_m: f64| (along_m / cell_m).floor().clamp(-INDEX_MAX, INDEX_MAX) as i32;
    (index(x_m), index(y_m))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_raster_keeps_what_was_written_when_it_grows_to_any_side() {
        let mut raster = Raster::new(0.1, 0.3, 0);
        let mut written = Vec::new();
        for (n, cell) in [(0, 0), (5, -7), (-40, 3), (2, 90), (-41, -8)].into_iter().enumerate() {
            raster.cover(cell, cell);
            *raster.get_mut(cell).unwrap() = n + 1;
            written.push((cell, n + 1));
            for (cell, value) in &written {
                assert_eq!(raster.get(*cell), *value);
            }
        }
        assert_eq!(raster.get((1000, 0)), 0);
        assert!(raster.get_mut((1000, 0)).is_none());
        assert_eq!(raster.cell_of(-0.01, 0.25), (-1, 2));
        let (from, row) = raster.row(0, -3, 3);
        assert_eq!((from, row.len(), row[3]), (-3, 6, 1));
    }

    #[test]
    fn a_raster_refuses_to_grow_without_bound_and_keeps_what_it_has() {
        let mut raster = Raster::new(0.1, 0.3, 0_u8);
        raster.cover((0, 0), (0, 0));
        *raster.get_mut((0, 0)).unwrap() = 7;
        let far = raster.cell_of(1e300, f64::MAX);
        raster.cover(far, far);
        assert!(raster.get_mut(far).is_none());
        assert_eq!((raster.get((0, 0)), raster.get(far)), (7, 0));
    }
}
