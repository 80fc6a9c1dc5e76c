//! Truth and map brought onto one raster: the map's own cells, extended until it also holds every true object.

use crate::score::ScoreError;
use arborloop_base::{Cell, Grid, Pose2};
use nalgebra::{Isometry2, Point2};

/// Largest raster: 300 m x 300 m at 3 cm; about 1.3 GB of memory.
const CELLS_MAX: u64 = 100_000_000;
/// Longest side: its diagonal, squared, still fits the distance transform's integers.
const SIDE_MAX: u64 = 40_000;

/// Truth and map, cell by cell on the map's raster.
pub(super) struct Lattice {
    /// Cells along x.
    pub(super) columns: usize,
    /// Where the map's cell (0, 0) lies: column and row.
    pub(super) map_at: (usize, usize),
    /// What the map says; `Unknown` outside it.
    pub(super) map: Vec<Cell>,
    /// What is true; `Unknown` outside the true map.
    pub(super) truth: Vec<Cell>,
}

impl Lattice {
    /// Lays the truth under the map. A cell is truly occupied when its center lies in an occupied true cell or an
    /// occupied true cell's center lies in it: nothing is lost whichever raster is the finer.
    pub(super) fn of(
        truth: &Grid<Cell>,
        map: &Grid<Cell>,
        truth_from_map: &Pose2,
    ) -> Result<Self, ScoreError> {
        let map_from_truth = truth_from_map.inverse();
        let occupied = occupied_centers(truth, &map_from_truth);
        let Extent { low, columns, rows } = Extent::of(map, &occupied)?;
        let map_at = (low.0.unsigned_abs() as usize, low.1.unsigned_abs() as usize);
        let mut lattice = Lattice {
            columns,
            map_at,
            map: vec![Cell::Unknown; columns * rows],
            truth: vec![Cell::Unknown; columns * rows],
        };
        for row in 0..map.rows() {
            let from = (row + map_at.1) * columns + map_at.0;
            lattice.map[from..from + map.columns()]
                .copy_from_slice(&map.cells()[row * map.columns()..][..map.columns()]);
        }
        for row in 0..rows {
            for column in 0..columns {
                let at = center(map, column as f64 + low.0 as f64, row as f64 + low.1 as f64);
                let found = truth.index_of(&(truth_from_map * at)).and_then(|(c, r)| truth.get(c, r));
                lattice.truth[row * columns + column] = found.copied().unwrap_or_default();
            }
        }
        for point in &occupied {
            let (column, row) = coordinates(map, point);
            let (column, row) = ((column - low.0) as usize, (row - low.1) as usize);
            lattice.truth[row * columns + column] = Cell::Occupied;
        }
        Ok(lattice)
    }

    /// Cells along y.
    pub(super) fn rows(&self) -> usize {
        self.map.len() / self.columns.max(1)
    }

    /// Whether a truly occupied cell has a neighbor, across an edge, that is not.
    pub(super) fn is_surface(&self, index: usize) -> bool {
        let (column, row) = (index % self.columns, index / self.columns);
        let solid = |column: Option<usize>, row: Option<usize>| match (column, row) {
            (Some(column), Some(row)) if column < self.columns && row < self.rows() => {
                self.truth[row * self.columns + column] == Cell::Occupied
            }
            _ => false,
        };
        self.truth[index] == Cell::Occupied
            && !(solid(column.checked_sub(1), Some(row))
                && solid(Some(column + 1), Some(row))
                && solid(Some(column), row.checked_sub(1))
                && solid(Some(column), Some(row + 1)))
    }
}

fn occupied_centers(truth: &Grid<Cell>, map_from_truth: &Isometry2<f64>) -> Vec<Point2<f64>> {
    let columns = truth.columns();
    let occupied = truth.cells().iter().enumerate().filter(|(_, cell)| **cell == Cell::Occupied);
    occupied.map(|(index, _)| map_from_truth * truth.center_of(index % columns, index / columns)).collect()
}

/// The part of the map's raster, prolonged in all directions, that holds the map and every true object.
struct Extent {
    /// Lowest column and row; never above the map's own zero.
    low: (i64, i64),
    columns: usize,
    rows: usize,
}

impl Extent {
    fn of(map: &Grid<Cell>, occupied: &[Point2<f64>]) -> Result<Self, ScoreError> {
        let (mut low, mut high) = ((0, 0), (map.columns() as i64 - 1, map.rows() as i64 - 1));
        for point in occupied {
            let (column, row) = coordinates(map, point);
            low = (low.0.min(column), low.1.min(row));
            high = (high.0.max(column), high.1.max(row));
        }
        // Far-off coordinates saturate at the ends of the integers: their difference is taken in a wider type.
        let across = |low: i64, high: i64| (i128::from(high) - i128::from(low) + 1).max(0) as u64;
        let (columns, rows) = (across(low.0, high.0), across(low.1, high.1));
        if columns.max(rows) > SIDE_MAX || columns * rows > CELLS_MAX {
            return Err(ScoreError::RasterTooLarge {
                columns,
                rows,
                side_max: SIDE_MAX,
                cells_max: CELLS_MAX,
            });
        }
        Ok(Extent { low, columns: columns as usize, rows: rows as usize })
    }
}

/// Column and row of the map's raster, also outside the map.
fn coordinates(map: &Grid<Cell>, point: &Point2<f64>) -> (i64, i64) {
    let cell = (point - map.origin()) / map.resolution_m();
    (cell.x.floor() as i64, cell.y.floor() as i64)
}

fn center(map: &Grid<Cell>, column: f64, row: f64) -> Point2<f64> {
    map.origin() + nalgebra::Vector2::new(column + 0.5, row + 0.5) * map.resolution_m()
}
