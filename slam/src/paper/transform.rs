//! The distance transform of the map: two passes, city-block distance in cells, as in the authors' code.
//!
//! Their code first dilates by a 2 x 2 block and then reads one cell off; both slips bias every match by about a
//! centimeter (the 1.6 to 2 % error of scale in the published tracks) and are left out.

use crate::raster::CellIndex;

/// City-block distances in a window of the map.
#[derive(Debug, Clone, Default)]
pub(crate) struct Transform {
    first: CellIndex,
    columns: i32,
    rows: i32,
    cells: Vec<u16>,
}

/// Farther than any window is wide.
const FAR: u16 = u16::MAX / 2;

impl Transform {
    /// Transforms the window from `low` to `high`, both included.
    pub(crate) fn rebuild(
        &mut self,
        low: CellIndex,
        high: CellIndex,
        is_occupied: impl Fn(CellIndex) -> bool,
    ) {
        (self.first, self.columns, self.rows) = (low, high.0 - low.0 + 1, high.1 - low.1 + 1);
        let columns = self.columns as usize;
        self.cells.clear();
        for row in low.1..=high.1 {
            self.cells
                .extend((low.0..=high.0).map(|column| if is_occupied((column, row)) { 0 } else { FAR }));
        }
        for row in 0..self.rows as usize {
            self.pass(row, row.checked_sub(1));
            let line = &mut self.cells[row * columns..][..columns];
            let mut left = FAR;
            for cell in line {
                *cell = (*cell).min(left + 1);
                left = *cell;
            }
        }
        for row in (0..self.rows as usize).rev() {
            self.pass(row, Some(row + 1).filter(|above| *above < self.rows as usize));
            let line = &mut self.cells[row * columns..][..columns];
            let mut right = FAR;
            for cell in line.iter_mut().rev() {
                *cell = (*cell).min(right + 1);
                right = *cell;
            }
        }
    }

    /// Lets the distances of the row `from` reach the row beside it.
    fn pass(&mut self, row: usize, from: Option<usize>) {
        let Some(from) = from else { return };
        let columns = self.columns as usize;
        let (lower, upper) = self.cells.split_at_mut(row.max(from) * columns);
        let lower = &mut lower[row.min(from) * columns..];
        let (to, from) = if row > from { (upper, lower) } else { (lower, upper) };
        for (cell, beside) in to.iter_mut().zip(&from[..columns]) {
            *cell = (*cell).min(*beside + 1);
        }
    }

    /// Distance of a cell, in cells. Outside of the window, as in the authors' code: that of the nearest cell on its
    /// border plus the way to it.
    pub(crate) fn distance(&self, (column, row): CellIndex) -> f32 {
        if self.cells.is_empty() {
            return f32::from(FAR);
        }
        let (i, j) = (column - self.first.0, row - self.first.1);
        let (inner_i, inner_j) = (i.clamp(0, self.columns - 1), j.clamp(0, self.rows - 1));
        let beyond = (i - inner_i).abs() + (j - inner_j).abs();
        f32::from(self.cells[(inner_j * self.columns + inner_i) as usize]) + beyond as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;

    #[test]
    fn the_transform_equals_the_smallest_of_all_city_block_distances() {
        for trial in 0..20 {
            let mut draws = Seed(1).stream("transform").at(trial);
            let (low, high) = ((-7, 3), (23, 19));
            let mut cell =
                || (draws.within(-7.0, 24.0).floor() as i32, draws.within(3.0, 20.0).floor() as i32);
            let occupied: Vec<CellIndex> = (0..=trial).map(|_| cell()).collect();
            let mut transform = Transform::default();
            transform.rebuild(low, high, |cell| occupied.contains(&cell));
            for row in low.1..=high.1 {
                for column in low.0..=high.0 {
                    let slow =
                        occupied.iter().map(|o| (o.0 - column).abs() + (o.1 - row).abs()).min().unwrap();
                    assert_eq!(transform.distance((column, row)), slow as f32);
                }
            }
            assert_eq!(transform.distance((-9, 3)), transform.distance((-7, 3)) + 2.0);
        }
    }
}
