//! The distance field: how far every place is from the nearest point of the map.
//!
//! Every cell center knows the mean point, inside any cell of the map, that is nearest to it, so the field is finer than
//! its raster. Distances are capped. The field lies in tiles where the map has points, and a key frame costs only the
//! tiles near what it changed.

use super::chart::{Change, Chart};
use super::features::Feature;
use crate::raster::{CellIndex, Raster, cell_at};

/// Levels of the coarse copy that the search reads: one byte per cell keeps it in the cache.
pub(crate) const COARSE_LEVELS: usize = 64;

/// Cells along the side of a tile.
const SIDE: usize = 16;
/// Cell centers along the side of a tile: one more, so that no interpolation needs two tiles.
const NODES: usize = SIDE + 1;
/// The same in vectors of four.
const LANES: usize = 4;
const WORDS: usize = NODES.div_ceil(LANES);
/// Lower bits of a key, for the index of a point: more than there are cells within a meter of a tile of 0.1 m cells. Of
/// finer cells those beyond are left out.
const INDEX_MASK: i32 = 0x7ff;
const NO_TILE: u32 = u32::MAX;
/// Standard deviation of a lidar's range, meters (VLP-16: 2 to 3 cm).
const NOISE_M: f64 = 0.02;
/// Stands for no point within the cap.
const NOWHERE: (f32, f32) = (1e6, 1e6);

/// Distances in one tile.
#[derive(Debug, Clone)]
struct Tile {
    /// Nearest point of every cell center, meters from the tile's first cell center; far away for none.
    nearest: [(f32, f32); NODES * NODES],
    coarse: [u8; SIDE * SIDE],
    /// Whether it waits to be measured anew.
    is_outdated: bool,
}

/// Side of a cell and the cap, meters.
#[derive(Debug, Clone, Copy)]
struct Span {
    cell_m: f32,
    cap_m: f32,
}

impl Span {
    /// The nodes along an axis that a point there may be within the cap of; a hair more, for rounding.
    fn nodes(self, at_m: f32) -> std::ops::RangeInclusive<usize> {
        let node = |n: f32| (n as i32).clamp(0, NODES as i32 - 1) as usize;
        node((at_m - self.cap_m) / self.cell_m + 0.99)..=node((at_m + self.cap_m) / self.cell_m + 0.01)
    }

    /// The square of the distance from a node to a point, meters^2.
    fn square(self, (i, j): (usize, usize), (x, y): (f32, f32)) -> f32 {
        (i as f32 * self.cell_m - x).powi(2) + (j as f32 * self.cell_m - y).powi(2)
    }

    /// The level of the coarse copy.
    fn level(self, square_m2: f32) -> u8 {
        (square_m2.sqrt() * (COARSE_LEVELS as f32 / self.cap_m)).min((COARSE_LEVELS - 1) as f32) as u8
    }
}

/// The first cell center of a tile, meters.
fn corner_m((i, j): CellIndex, cell_m: f64) -> (f64, f64) {
    let along = |tile: i32| (f64::from(tile * SIDE as i32) + 0.5) * cell_m;
    (along(i), along(j))
}

/// The tiles of one layer.
#[derive(Debug, Clone)]
struct Sheet {
    index: Raster<u32>,
    tiles: Vec<Tile>,
}

/// Capped distance to the map, per layer.
#[derive(Debug, Clone)]
pub(crate) struct Field {
    cell_m: f64,
    cap_m: f64,
    sheets: Vec<Sheet>,
    /// Tiles to be measured anew: layer, place and slot.
    outdated: Vec<(usize, CellIndex, u32)>,
}

/// Distance and its gradient at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slope {
    /// Distance to the map, meters.
    pub(crate) distance_m: f64,
    /// Derivatives along x and y.
    pub(crate) along: (f64, f64),
}

impl Field {
    /// The field of an empty map.
    pub(crate) fn new(cell_m: f64, cap_m: f64, layers: usize) -> Self {
        let index = Raster::new(cell_m * SIDE as f64, 8.0, NO_TILE);
        Field {
            cell_m,
            cap_m,
            sheets: vec![Sheet { index, tiles: Vec::new() }; layers],
            outdated: Vec::new(),
        }
    }

    /// Largest distance that the field tells, meters.
    pub(crate) fn cap_m(&self) -> f64 {
        self.cap_m
    }

    /// Side of a cell, meters.
    pub(crate) fn cell_m(&self) -> f64 {
        self.cell_m
    }

    /// Follows the changes of the map since the last call. What a new point is nearest to is told at once; a tile in
    /// which a point that moved or went was the nearest of some center is measured anew.
    pub(crate) fn follow(&mut self, chart: &mut Chart) {
        for change in chart.take_changes() {
            self.change(&change);
        }
        let (cell_m, cap_m, reach) = (self.cell_m, self.cap_m, self.reach());
        for (layer, place, slot) in self.outdated.drain(..) {
            let tile = &mut self.sheets[layer].tiles[slot as usize];
            tile.measure(chart, layer, place, reach, cell_m, cap_m);
            tile.is_outdated = false;
        }
    }

    /// Takes in a point that no chart shows.
    pub(crate) fn show(&mut self, point: Feature) {
        let cell = self.cell_of(point.at.x, point.at.y);
        let from_center = |along_m: f64, cell: i32| (along_m - (f64::from(cell) + 0.5) * self.cell_m) as f32;
        let now = Some((from_center(point.at.x, cell.0), from_center(point.at.y, cell.1)));
        self.change(&Change { layer: point.layer, cell, before: None, now });
    }

    fn change(&mut self, change: &Change) {
        let (cell_m, cap_m, reach) = (self.cell_m, self.cap_m, self.reach());
        let Change { layer, cell: (column, row), before, now } = *change;
        let sheet = &mut self.sheets[layer];
        // The node beyond a tile's last cell belongs to it too, hence one more to the lower side.
        for j in tile_of(row - reach - 1)..=tile_of(row + reach) {
            for i in tile_of(column - reach - 1)..=tile_of(column + reach) {
                sheet.index.cover((i, j), (i, j));
                let Some(slot) = sheet.index.get_mut((i, j)) else { continue };
                if *slot == NO_TILE {
                    *slot = sheet.tiles.len() as u32;
                    sheet.tiles.push(Tile::EMPTY);
                }
                let tile = &mut sheet.tiles[*slot as usize];
                if tile.is_outdated {
                    continue;
                }
                let corner = corner_m((i, j), cell_m);
                let from_corner = |(x, y): (f32, f32)| {
                    let along = |cell: i32, off: f32, corner: f64| {
                        ((f64::from(cell) + 0.5) * cell_m + f64::from(off) - corner) as f32
                    };
                    (along(column, x, corner.0), along(row, y, corner.1))
                };
                let span = Span { cell_m: cell_m as f32, cap_m: cap_m as f32 };
                tile.is_outdated = before.is_some_and(|before| tile.leans_on(from_corner(before), span));
                if tile.is_outdated {
                    self.outdated.push((layer, (i, j), *slot));
                } else if let Some(now) = now {
                    tile.add(from_corner(now), span);
                }
            }
        }
    }

    /// Cells that a point's distance reaches over.
    fn reach(&self) -> i32 {
        (self.cap_m / self.cell_m).ceil() as i32 + 1
    }

    /// Smoothed distance r to the map and its gradient; capped and flat far from the map.
    ///
    /// The nearest point is the bilinear mean of those nearest to the four cell centers around. Beside a lone point
    /// that is the point itself, so that the distance is smallest there (interpolated distances are smallest at
    /// cell centers and draw every match to them); along a row of points it slides with the place, so that the raster
    /// holds nothing back. Then r = sqrt(d^2 + noise^2): within the noise of a range the direction of the nearest point
    /// is chance and must not pull.
    pub(crate) fn slope(&self, layer: usize, x_m: f64, y_m: f64) -> Slope {
        let (x, y) = (x_m / self.cell_m - 0.5, y_m / self.cell_m - 0.5);
        let cell = cell_at(x, y, 1.0);
        let none = Slope { distance_m: self.cap_m, along: (0.0, 0.0) };
        let Some((tile, (i, j))) = self.sheets[layer].find(cell) else { return none };
        let (u, v) = ((x - f64::from(cell.0)) as f32, (y - f64::from(cell.1)) as f32);
        let shares = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
        let start = j * NODES + i;
        let nodes = [start, start + 1, start + NODES, start + NODES + 1];
        let (mut total, mut mean) = (0.0, (0.0, 0.0));
        for (node, share) in nodes.into_iter().zip(shares) {
            let nearest = tile.nearest[node];
            if nearest != NOWHERE {
                total += share;
                mean = (mean.0 + share * nearest.0, mean.1 + share * nearest.1);
            }
        }
        // Where most of the four know no point, the place is farther than the cap.
        if total < 0.5 {
            return none;
        }
        // From the tile's first cell center, as the nearest points are.
        let from = |along: f32, inside: usize, sum: f32| {
            (f64::from(along) + inside as f64) * self.cell_m - f64::from(sum / total)
        };
        let (dx, dy) = (from(u, i, mean.0), from(v, j, mean.1));
        let distance_m = (dx * dx + dy * dy + NOISE_M * NOISE_M).sqrt();
        if distance_m >= self.cap_m {
            return none;
        }
        Slope { distance_m, along: (dx / distance_m, dy / distance_m) }
    }

    /// The cell of a place.
    pub(crate) fn cell_of(&self, x_m: f64, y_m: f64) -> CellIndex {
        cell_at(x_m, y_m, self.cell_m)
    }

    /// Calls `visit` with the levels of `count` cells of a row, `step` cells apart, from `first` on.
    pub(crate) fn coarse_row(
        &self,
        layer: usize,
        first: CellIndex,
        step: i32,
        count: usize,
        mut visit: impl FnMut(usize, u8),
    ) {
        let (sheet, inside_row) = (&self.sheets[layer], first.1.rem_euclid(SIDE as i32) as usize);
        let (mut tile, mut tile_column) = (None, i32::MIN);
        for n in 0..count {
            let column = first.0 + n as i32 * step;
            if tile_of(column) != tile_column {
                tile_column = tile_of(column);
                tile = sheet.find((column, first.1)).map(|(tile, _)| tile);
            }
            let inside = column.rem_euclid(SIDE as i32) as usize;
            visit(n, tile.map_or((COARSE_LEVELS - 1) as u8, |tile| tile.coarse[inside_row * SIDE + inside]));
        }
    }

    /// Level of the coarse copy in a cell: `COARSE_LEVELS` of them make the cap.
    pub(crate) fn coarse(&self, layer: usize, cell: CellIndex) -> u8 {
        match self.sheets[layer].find(cell) {
            Some((tile, (i, j))) => tile.coarse[j * SIDE + i],
            None => (COARSE_LEVELS - 1) as u8,
        }
    }
}

impl Sheet {
    /// The tile of a cell and the cell's place in it.
    fn find(&self, (column, row): CellIndex) -> Option<(&Tile, (usize, usize))> {
        let slot = self.index.get((tile_of(column), tile_of(row)));
        let inside = |n: i32| n.rem_euclid(SIDE as i32) as usize;
        (slot != NO_TILE).then(|| (&self.tiles[slot as usize], (inside(column), inside(row))))
    }
}

impl Tile {
    /// Nothing is near.
    const EMPTY: Tile = Tile {
        nearest: [NOWHERE; NODES * NODES],
        coarse: [(COARSE_LEVELS - 1) as u8; SIDE * SIDE],
        is_outdated: false,
    };

    /// Whether a point is the nearest of any cell center.
    fn leans_on(&self, point: (f32, f32), span: Span) -> bool {
        let (columns, mut rows) = (span.nodes(point.0), span.nodes(point.1));
        rows.any(|j| self.nearest[j * NODES..][columns.clone()].contains(&point))
    }

    /// Takes in a new point.
    fn add(&mut self, point: (f32, f32), span: Span) {
        for j in span.nodes(point.1) {
            for i in span.nodes(point.0) {
                let nearest = &mut self.nearest[j * NODES + i];
                let square = span.square((i, j), point);
                if square < span.cap_m * span.cap_m && square < span.square((i, j), *nearest) {
                    *nearest = point;
                    if i < SIDE && j < SIDE {
                        self.coarse[j * SIDE + i] = span.level(square);
                    }
                }
            }
        }
    }

    /// Finds the nearest point of every cell center among those of the chart within the cap.
    fn measure(
        &mut self,
        chart: &Chart,
        layer: usize,
        place: CellIndex,
        reach: i32,
        cell_m: f64,
        cap_m: f64,
    ) {
        let low = (place.0 * SIDE as i32, place.1 * SIDE as i32);
        let far = reach + SIDE as i32;
        // From the tile's first cell center: f32 is exact enough there, anywhere on the map.
        let corner = corner_m(place, cell_m);
        let (cell_m, cap_m) = (cell_m as f32, cap_m as f32);
        let span = Span { cell_m, cap_m };
        let mut points = vec![NOWHERE];
        // Squared distance in the upper bits and the point's index in the lower: positive floats rank as their bits do, so
        // one minimum keeps both, which the compiler turns into vectors. The distance loses 1e-4 of itself in the ranking.
        let key_of = |square: f32, index: i32| (square.to_bits() as i32 & !INDEX_MASK) | index;
        let mut keys = [[[key_of(cap_m * cap_m, 0); LANES]; WORDS]; NODES];
        let along: [[f32; LANES]; WORDS] =
            std::array::from_fn(|word| std::array::from_fn(|lane| (word * LANES + lane) as f32 * cell_m));
        let side = (NODES - 1) as f32 * cell_m;
        let outside = |n: f32| n - n.clamp(0.0, side);
        chart.points(layer, (low.0 - reach, low.1 - reach), (low.0 + far, low.1 + far), |x_m, y_m| {
            let (x, y) = ((x_m - corner.0) as f32, (y_m - corner.1) as f32);
            if outside(x).powi(2) + outside(y).powi(2) >= cap_m * cap_m {
                return;
            }
            let index = points.len() as i32;
            if index > INDEX_MASK {
                return;
            }
            points.push((x, y));
            let columns = span.nodes(x);
            let words = columns.start() / LANES..columns.end() / LANES + 1;
            for j in span.nodes(y) {
                let line = &mut keys[j];
                let dy = j as f32 * cell_m - y;
                let square = dy * dy;
                for (keys, along) in line[words.clone()].iter_mut().zip(&along[words.clone()]) {
                    let squares = along.map(|x_node| (x_node - x) * (x_node - x) + square);
                    *keys = std::array::from_fn(|lane| key_of(squares[lane], index).min(keys[lane]));
                }
            }
        });
        for (line, keys) in self.nearest.chunks_exact_mut(NODES).zip(&keys) {
            for (nearest, key) in line.iter_mut().zip(keys.as_flattened()) {
                *nearest = points[(key & INDEX_MASK) as usize];
            }
        }
        for (index, level) in self.coarse.iter_mut().enumerate() {
            let (i, j) = (index % SIDE, index / SIDE);
            *level = span.level(span.square((i, j), self.nearest[j * NODES + i]));
        }
    }
}

fn tile_of(cell: i32) -> i32 {
    cell.div_euclid(SIDE as i32)
}

#[cfg(test)]
mod tests {
    use super::super::chart::Rules;
    use super::super::features::{Clearing, Feature};
    use super::super::motion::Motion;
    use super::*;
    use arborloop_base::{Seed, Time};
    use nalgebra::{Vector2, Vector3};

    const STILL: Motion = Motion {
        stamp: Time::from_nanos(0),
        pose: Vector3::new(0.0, 0.0, 0.0),
        velocity: Vector3::new(0.0, 0.0, 0.0),
    };

    fn points(trial: u64) -> Vec<Vector2<f64>> {
        let mut draws = Seed(9).stream("field").at(trial);
        (0..30).map(|_| Vector2::new(draws.within(-4.0, 4.0), draws.within(-4.0, 4.0))).collect()
    }

    fn drawn(chart: &mut Chart, field: &mut Field, points: &[Vector2<f64>]) {
        let features: Vec<Feature> =
            points.iter().map(|at| Feature { at: *at, after_s: 0.0, layer: 0 }).collect();
        chart.draw(&STILL, &features, &[], 0);
        field.follow(chart);
    }

    fn shown(chart: &Chart) -> Vec<(f64, f64)> {
        let mut shown = Vec::new();
        chart.points(0, (-100, -100), (100, 100), |x_m, y_m| shown.push((x_m, y_m)));
        shown
    }

    #[test]
    fn every_cell_center_knows_the_distance_to_the_nearest_of_all_points_also_after_changes() {
        let (mut chart, mut field) = (Chart::new(0.1, 1, Rules::OF_PLANAR), Field::new(0.1, 1.0, 1));
        for trial in 0..5 {
            drawn(&mut chart, &mut field, &points(trial));
            let before = shown(&chart).len();
            // Beams along some rows take points away again.
            let rows = (0..40).map(|n| f64::from(n) * 0.2 - 3.95 + 0.1 * (trial % 2) as f64);
            let through: Vec<Clearing> = rows
                .map(|y| Clearing {
                    from: Vector2::new(-6.0, y),
                    to: Vector2::new(6.0, y),
                    after_s: 0.0,
                    layer: 0,
                })
                .collect();
            for _ in 0..3 {
                chart.draw(&STILL, &[], &through, 0);
                field.follow(&mut chart);
            }
            let all = shown(&chart);
            assert!(!all.is_empty() && all.len() < before);
            for row in -50..50 {
                for column in -50..50 {
                    let (x_m, y_m) = (f64::from(column) * 0.1 + 0.05, f64::from(row) * 0.1 + 0.05);
                    let slow = all.iter().map(|(x, y)| (x - x_m).hypot(y - y_m)).fold(1.0, f64::min);
                    let smoothed = slow.hypot(NOISE_M).min(1.0);
                    // At a center the other three corners have no share; a hair inside, so that the floor is its own.
                    let found = field.slope(0, x_m + 1e-9, y_m + 1e-9).distance_m;
                    assert!((found - smoothed).abs() < 1e-5, "{found} {smoothed} at {x_m} {y_m}");
                    let level = (slow * COARSE_LEVELS as f64).min((COARSE_LEVELS - 1) as f64);
                    assert!((f64::from(field.coarse(0, (column, row))) - level).abs() <= 1.0);
                }
            }
        }
    }

    #[test]
    fn the_distance_is_smallest_at_a_lone_point_and_grows_along_its_gradient() {
        let (mut chart, mut field) = (Chart::new(0.1, 1, Rules::OF_PLANAR), Field::new(0.1, 1.0, 1));
        drawn(&mut chart, &mut field, &[Vector2::new(0.537, -0.281)]);
        assert!((field.slope(0, 0.537, -0.281).distance_m - NOISE_M).abs() < 1e-5);
        for (dx, dy) in [(0.02, 0.0), (-0.3, 0.1), (0.0, -0.25), (0.4, 0.4)] {
            let at = |step: f64| field.slope(0, 0.537 + dx + step * dx, -0.281 + dy + step * dy).distance_m;
            let slope = field.slope(0, 0.537 + dx, -0.281 + dy);
            let numeric = (at(1e-3) - at(-1e-3)) / 2e-3;
            assert!((numeric - (slope.along.0 * dx + slope.along.1 * dy)).abs() < 1e-4);
        }
    }

    #[test]
    fn a_point_that_is_shown_alone_is_as_one_that_was_drawn() {
        let (mut chart, mut field) = (Chart::new(0.1, 1, Rules::OF_PLANAR), Field::new(0.1, 1.0, 1));
        let (at, mut shown) = (Vector2::new(-3.537, 0.281), Field::new(0.1, 1.0, 1));
        drawn(&mut chart, &mut field, &[at]);
        shown.show(Feature { at, after_s: 0.0, layer: 0 });
        for n in 0..100 {
            let (x, y) = (at.x + 0.013 * f64::from(n % 10), at.y - 0.017 * f64::from(n / 10));
            assert_eq!(field.slope(0, x, y), shown.slope(0, x, y));
        }
    }
}
