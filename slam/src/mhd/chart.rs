//! The map: one raster per layer whose cells hold the mean of the points that fell into them, and never forget a
//! place for its age. The return to an old place re-locks on it: at the size of an orchard block that closes the loop. Where a
//! long way has gone astray (`places.rs`), what was drawn too far off is hidden from the matching.

use super::compact::CLEARING_M_MAX;
use super::features::{Clearing, Feature};
use super::motion::Motion;
use crate::raster::{CellIndex, Raster, cell_at};
use arborloop_base::{Cell, Grid};
use nalgebra::{Point2, Vector2};

/// A cell counts as occupied from this evidence on.
const OCCUPIED: u8 = 2;

/// How a map takes in what was met. One empty crossing takes away one of a cell's evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rules {
    /// Evidence that one point adds to its cell, and its limit.
    hit: u8,
    hit_max: u8,
    /// What was met from farther away is not drawn, meters.
    reach_m: f64,
}

impl Rules {
    /// For sweeps of many rings. Most key frames see through a cell of foliage, and it must stay if one in sixteen meets a leaf
    /// there: else what a hedge shows from aside is worn away while one passes, and what it shows from behind finds no map.
    /// From beyond the reach of clearings a hedge shows another face than from near by, and no beam would ever take it away.
    pub(crate) const OF_RINGS: Rules = Rules { hit: 16, hit_max: 96, reach_m: CLEARING_M_MAX };
    /// For planar sweeps, of which every point is dear.
    pub(crate) const OF_PLANAR: Rules = Rules { hit: 4, hit_max: 48, reach_m: f64::INFINITY };
}

/// A cell whose shown point came, moved or went: where it was and where it is, meters from the cell's center.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Change {
    pub(crate) layer: usize,
    pub(crate) cell: CellIndex,
    pub(crate) before: Option<(f32, f32)>,
    pub(crate) now: Option<(f32, f32)>,
}

/// What beams say of one cell of a layer: four bytes, because a key frame asks for tens of thousands of cells that lie
/// all over the memory.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Seen {
    /// The key frame that it last learned from; 0 if none.
    frame: u16,
    /// Evidence that it is occupied.
    evidence: u8,
    /// Whether it was met from within the reach of clearings.
    is_near: bool,
}

/// What was met in one cell of a layer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Spot {
    /// Mean of its points from the cell's center, meters.
    mean: (f32, f32),
    /// The mean that the distance field knows, if the cell is shown.
    shown: (f32, f32),
    /// Number of points in the mean.
    count: u16,
    /// The place from which its last point was met.
    place: u16,
}

/// One layer of heights. Beams cross many times more cells than they meet something in, so the two are kept apart.
#[derive(Debug, Clone)]
struct Layer {
    seen: Raster<Seen>,
    spots: Raster<Spot>,
    /// Which cells the distance field knows: one bit for each, and a word for as many neighbors along a row as it has bits.
    shown: Raster<u64>,
}

/// The map of `mhd`.
#[derive(Debug, Clone)]
pub(crate) struct Chart {
    cell_m: f64,
    rules: Rules,
    layers: Vec<Layer>,
    changes: Vec<Change>,
    /// Layer and cell of what the key frame that is being drawn met.
    touched: Vec<(usize, CellIndex)>,
    frame: u16,
    /// The place that each key frame was drawn from.
    places: Vec<u16>,
}

impl Chart {
    /// An empty map.
    pub(crate) fn new(cell_m: f64, layers: usize, rules: Rules) -> Self {
        let layer = Layer {
            seen: Raster::new(cell_m, 8.0, Seen::default()),
            spots: Raster::new(cell_m, 8.0, Spot::default()),
            // Its cells along a row are words: a margin of 16 is wide enough.
            shown: Raster::new(cell_m, 16.0 * cell_m, 0),
        };
        Chart {
            cell_m,
            rules,
            layers: vec![layer; layers],
            changes: Vec::new(),
            touched: Vec::new(),
            frame: 0,
            places: Vec::new(),
        }
    }

    /// Draws a key frame: first what was met, then what was seen empty. A cell learns once per key frame, and a point
    /// outweighs the beams beside it: else the near faces of trunks are worn away, the map recedes from the robot and
    /// every way comes out too long.
    /// `place` names the part of the way that the key frame belongs to.
    pub(crate) fn draw(&mut self, motion: &Motion, features: &[Feature], clearings: &[Clearing], place: u16) {
        // After 65535 key frames the count begins anew; what was last seen exactly so long ago learns one frame later.
        self.frame = self.frame.checked_add(1).unwrap_or(1);
        let frames = self.places.len().max(usize::from(self.frame) + 1);
        self.places.resize(frames, place);
        self.places[usize::from(self.frame)] = place;
        let (Rules { hit, hit_max, reach_m }, placing) = (self.rules, motion.placing());
        for feature in features.iter().filter(|feature| feature.at.norm() <= reach_m) {
            let at = placing.place(&feature.at, feature.after_s);
            let layer = &mut self.layers[feature.layer];
            let cell = layer.seen.cell_of(at.x, at.y);
            layer.seen.cover(cell, cell);
            layer.spots.cover(cell, cell);
            let (Some(seen), Some(spot)) = (layer.seen.get_mut(cell), layer.spots.get_mut(cell)) else {
                continue;
            };
            seen.is_near |= feature.at.norm() < CLEARING_M_MAX;
            if seen.frame != self.frame {
                seen.frame = self.frame;
                seen.evidence = seen.evidence.saturating_add(hit).min(hit_max);
                self.touched.push((feature.layer, cell));
            }
            spot.place = place;
            spot.count = spot.count.saturating_add(1);
            let share = 1.0 / f32::from(spot.count);
            let from_center =
                |along_m: f64, cell: i32| (along_m - (f64::from(cell) + 0.5) * self.cell_m) as f32;
            spot.mean.0 += (from_center(at.x, cell.0) - spot.mean.0) * share;
            spot.mean.1 += (from_center(at.y, cell.1) - spot.mean.1) * share;
        }
        self.show_touched();
        for clearing in clearings {
            let (from, to) = (
                placing.place(&clearing.from, clearing.after_s),
                placing.place(&clearing.to, clearing.after_s),
            );
            let Layer { seen, spots, shown } = &mut self.layers[clearing.layer];
            seen.cover(lower(seen, &from, &to), upper(seen, &from, &to));
            let row = seen.size().0 as isize;
            let (first, (start, end)) =
                (seen.first(), (seen.cell_of(from.x, from.y), seen.cell_of(to.x, to.y)));
            let (Some(start), Some(_)) = (seen.place_of(start), seen.place_of(end)) else { continue };
            let cells = seen.cells_mut();
            cross(&from, &to, self.cell_m, start, row, |place| {
                let seen = &mut cells[place];
                if seen.frame == self.frame {
                    return;
                }
                seen.frame = self.frame;
                if seen.evidence == 0 {
                    return;
                }
                seen.evidence -= 1;
                if seen.evidence >= OCCUPIED {
                    return;
                }
                let cell = (first.0 + (place as isize % row) as i32, first.1 + (place as isize / row) as i32);
                let (word, bit) = bit_of(cell);
                if let (Some(spot), Some(shown)) = (spots.get_mut(cell), shown.get_mut(word)) {
                    spot.count = 0;
                    if *shown & bit != 0 {
                        *shown &= !bit;
                        let before = Some(spot.shown);
                        self.changes.push(Change { layer: clearing.layer, cell, before, now: None });
                    }
                }
            });
        }
    }

    /// Tells the distance field of the cells that a key frame met something in, when all of its points are in: told point
    /// by point they would show the means of the points on the side from which a sweep is drawn, and turn every match.
    fn show_touched(&mut self) {
        for (index, cell) in self.touched.drain(..) {
            let layer = &mut self.layers[index];
            let (word, bit) = bit_of(cell);
            layer.shown.cover(word, word);
            let (evidence, spot) = (layer.seen.get(cell).evidence, layer.spots.get_mut(cell));
            let (Some(spot), Some(shown)) = (spot, layer.shown.get_mut(word)) else { continue };
            if evidence >= OCCUPIED && (*shown & bit == 0 || spot.mean != spot.shown) {
                let before = (*shown & bit != 0).then_some(spot.shown);
                self.changes.push(Change { layer: index, cell, before, now: Some(spot.mean) });
                *shown |= bit;
                spot.shown = spot.mean;
            }
        }
    }

    /// Hides what was met last from a place that has left the rest of the map: the distance field forgets it, and what is
    /// met there again is met for the first time.
    pub(crate) fn hide(&mut self, has_left: impl Fn(u16) -> bool) {
        for (index, layer) in self.layers.iter_mut().enumerate() {
            let Layer { spots, shown, .. } = layer;
            for ((word, row), bits) in shown.stored_mut() {
                let mut left = *bits;
                while left != 0 {
                    let bit = left & left.wrapping_neg();
                    left ^= bit;
                    let cell = (word * WORD + bit.trailing_zeros() as i32, row);
                    let Some(spot) = spots.get_mut(cell).filter(|spot| has_left(spot.place)) else {
                        continue;
                    };
                    *bits &= !bit;
                    spot.count = 0;
                    self.changes.push(Change { layer: index, cell, before: Some(spot.shown), now: None });
                }
            }
        }
    }

    /// What changed since the last call, in order.
    pub(crate) fn take_changes(&mut self) -> Vec<Change> {
        std::mem::take(&mut self.changes)
    }

    /// Calls `visit` with the shown point of every occupied cell of a layer from `low` to `high`, both included.
    pub(crate) fn points(
        &self,
        layer: usize,
        low: CellIndex,
        high: CellIndex,
        mut visit: impl FnMut(f64, f64),
    ) {
        let Layer { spots, shown, .. } = &self.layers[layer];
        let center = |cell: i32| (f64::from(cell) + 0.5) * self.cell_m;
        for row in low.1..=high.1 {
            let (first_word, words) = shown.row(row, word_of(low.0), word_of(high.0) + 1);
            for (word, bits) in (first_word..).zip(words) {
                let mut bits = *bits;
                while bits != 0 {
                    let column = word * WORD + bits.trailing_zeros() as i32;
                    bits &= bits - 1;
                    if column >= low.0 && column <= high.0 {
                        let spot = spots.get((column, row));
                        visit(
                            center(column) + f64::from(spot.shown.0),
                            center(row) + f64::from(spot.shown.1),
                        );
                    }
                }
            }
        }
    }

    /// The layers `from..to` as one drawing: occupied where any is, else free where any was seen. What was only met from so
    /// far that no beam that crosses it clears it again serves the matching, but is not drawn. `moved` says where what was
    /// drawn from a place is believed to be by now.
    pub(crate) fn drawing(
        &self,
        from: usize,
        to: usize,
        moved: impl Fn(u16, Vector2<f64>) -> Vector2<f64>,
    ) -> Option<Grid<Cell>> {
        let seen = || self.layers[from..to].iter().map(|layer| &layer.seen).filter(|seen| seen.size().0 > 0);
        let mut low = (seen().map(|seen| seen.first().0).min()?, seen().map(|seen| seen.first().1).min()?);
        let mut end = (
            seen().map(|seen| seen.first().0 + seen.size().0).max()?,
            seen().map(|seen| seen.first().1 + seen.size().1).max()?,
        );
        self.each_drawn(from, to, &moved, |cell, _| {
            low = (low.0.min(cell.0), low.1.min(cell.1));
            end = (end.0.max(cell.0 + 1), end.1.max(cell.1 + 1));
        });
        let origin = Point2::new(f64::from(low.0) * self.cell_m, f64::from(low.1) * self.cell_m);
        let (columns, rows) = ((end.0 - low.0) as usize, (end.1 - low.1) as usize);
        let mut grid = Grid::filled(origin, self.cell_m, columns, rows, Cell::Unknown);
        self.each_drawn(from, to, &moved, |cell, value| {
            let there =
                &mut grid.cells_mut()[(cell.1 - low.1) as usize * columns + (cell.0 - low.0) as usize];
            if *there != Cell::Occupied {
                *there = value;
            }
        });
        Some(grid)
    }

    /// Calls `draw` with the cells of a drawing, some of them several times.
    fn each_drawn(
        &self,
        from: usize,
        to: usize,
        moved: &impl Fn(u16, Vector2<f64>) -> Vector2<f64>,
        mut draw: impl FnMut(CellIndex, Cell),
    ) {
        for Layer { seen, spots, .. } in &self.layers[from..to] {
            for (cell, seen) in seen.stored().filter(|(_, seen)| seen.frame > 0) {
                let (place, value) = match seen.evidence >= OCCUPIED {
                    true if seen.is_near => (spots.get(cell).place, Cell::Occupied),
                    true => continue,
                    false => (self.places[usize::from(seen.frame)], Cell::Free),
                };
                let center = |cell: i32| (f64::from(cell) + 0.5) * self.cell_m;
                let at = Vector2::new(center(cell.0), center(cell.1));
                let to = moved(place, at);
                if to == at {
                    draw(cell, value);
                    continue;
                }
                // Four parts of the cell: turned cells leave no holes.
                for (u, v) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                    let part = to + Vector2::new(u, v) * (0.25 * self.cell_m);
                    draw(cell_at(part.x, part.y, self.cell_m), value);
                }
            }
        }
    }
}

/// Columns in a word.
const WORD: i32 = u64::BITS as i32;

/// The word of a column.
fn word_of(column: i32) -> i32 {
    column.div_euclid(WORD)
}

/// The word of a cell, and the cell's bit in it.
fn bit_of((column, row): CellIndex) -> (CellIndex, u64) {
    ((word_of(column), row), 1 << column.rem_euclid(WORD))
}

fn lower(layer: &Raster<Seen>, a: &Vector2<f64>, b: &Vector2<f64>) -> CellIndex {
    layer.cell_of(a.x.min(b.x), a.y.min(b.y))
}

fn upper(layer: &Raster<Seen>, a: &Vector2<f64>, b: &Vector2<f64>) -> CellIndex {
    layer.cell_of(a.x.max(b.x), a.y.max(b.y))
}

/// Visits the place of every cell that the stretch from `a` to `b` crosses (Amanatides and Woo 1987): `place` is that of
/// the first, and `row` how much farther the cell above a cell is.
fn cross(
    a: &Vector2<f64>,
    b: &Vector2<f64>,
    cell_m: f64,
    mut place: usize,
    row: isize,
    mut visit: impl FnMut(usize),
) {
    let (start, end) = (a / cell_m, b / cell_m);
    let along = end - start;
    let (first, last) = (cell_at(start.x, start.y, 1.0), cell_at(end.x, end.y, 1.0));
    let axis = |from: f64, along: f64| {
        let step = if along > 0.0 { 1 } else { -1 };
        let border = if along > 0.0 { from.floor() + 1.0 } else { from.floor() };
        let (first, every) = if along == 0.0 {
            (f64::INFINITY, f64::INFINITY)
        } else {
            ((border - from) / along, 1.0 / along.abs())
        };
        (step, first, every)
    };
    let (step_x, mut next_x, every_x) = axis(start.x, along.x);
    let (step_y, mut next_y, every_y) = axis(start.y, along.y);
    // Whatever the rounding, no more cells along either axis than there are.
    let (mut left_x, mut left_y) = ((last.0 - first.0).abs(), (last.1 - first.1).abs());
    visit(place);
    while left_x + left_y > 0 {
        if left_y == 0 || (left_x > 0 && next_x < next_y) {
            place = place.wrapping_add_signed(step_x);
            next_x += every_x;
            left_x -= 1;
        } else {
            place = place.wrapping_add_signed(step_y * row);
            next_y += every_y;
            left_y -= 1;
        }
        visit(place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Time;
    use nalgebra::Vector3;

    const STILL: Motion = Motion {
        stamp: Time::from_nanos(0),
        pose: Vector3::new(0.0, 0.0, 0.0),
        velocity: Vector3::new(0.0, 0.0, 0.0),
    };

    fn at(x: f64, y: f64) -> Feature {
        Feature { at: Vector2::new(x, y), after_s: 0.0, layer: 0 }
    }

    #[test]
    fn a_stretch_crosses_the_cells_that_fine_steps_along_it_meet() {
        for (a, b) in
            [((0.03, 0.04), (1.96, 0.77)), ((-0.5, 0.31), (0.42, -1.9)), ((0.05, 0.05), (0.05, -0.95))]
        {
            let first = cell_at(a.0, a.1, 0.1);
            let (a, b) = (Vector2::new(a.0, a.1), Vector2::new(b.0, b.1));
            let mut cells = Vec::new();
            let (width, middle) = (100, 50);
            let place_of = |cell: CellIndex| ((cell.1 + middle) * width + cell.0 + middle) as usize;
            cross(&a, &b, 0.1, place_of(first), width as isize, |place| {
                cells.push((place as i32 % width - middle, place as i32 / width - middle));
            });
            let mut slow: Vec<CellIndex> = (0..=200_000)
                .map(|n| a + (b - a) * (f64::from(n) / 200_000.0))
                .map(|p| ((p.x / 0.1).floor() as i32, (p.y / 0.1).floor() as i32))
                .collect();
            slow.dedup();
            assert_eq!(cells, slow);
        }
    }

    #[test]
    fn a_thing_that_went_away_is_forgotten_and_one_that_is_met_again_is_not() {
        let mut chart = Chart::new(0.1, 1, Rules::OF_RINGS);
        chart.draw(&STILL, &[at(2.0, 0.05), at(3.0, 0.05)], &[], 0);
        let through = Clearing { from: Vector2::zeros(), to: Vector2::new(5.0, 0.0), after_s: 0.0, layer: 0 };
        for _ in 0..20 {
            chart.draw(&STILL, &[at(3.0, 0.05)], &[Clearing { to: Vector2::new(5.0, 0.09), ..through }], 0);
        }
        let grid = chart.drawing(0, 1, |_, at| at).unwrap();
        let cell = |x: f64, y: f64| {
            let (column, row) = grid.index_of(&Point2::new(x, y)).unwrap();
            *grid.get(column, row).unwrap()
        };
        assert_eq!(cell(2.05, 0.05), Cell::Free);
        assert_eq!(cell(3.05, 0.05), Cell::Occupied);
        assert_eq!(cell(2.05, 1.05), Cell::Unknown);
        assert_eq!(Chart::new(0.1, 1, Rules::OF_RINGS).drawing(0, 1, |_, at| at), None);
    }

    #[test]
    fn rings_draw_nothing_from_afar_and_keep_what_one_beam_in_twelve_meets() {
        let mut chart = Chart::new(0.1, 1, Rules::OF_RINGS);
        chart.draw(&STILL, &[at(CLEARING_M_MAX + 0.1, 0.05), at(2.0, 0.05)], &[], 0);
        assert_eq!(chart.take_changes().iter().map(|change| change.cell).collect::<Vec<_>>(), [(20, 0)]);
        let through =
            Clearing { from: Vector2::zeros(), to: Vector2::new(5.0, 0.09), after_s: 0.0, layer: 0 };
        for _ in 0..20 {
            for _ in 0..11 {
                chart.draw(&STILL, &[], &[through], 0);
            }
            chart.draw(&STILL, &[at(2.0, 0.05)], &[], 0);
        }
        assert_eq!(chart.take_changes(), []);
    }

    #[test]
    fn a_key_frame_shows_each_cell_once_whatever_the_order_of_its_points() {
        let mut points: Vec<Feature> =
            (0..20).map(|n| at(2.0 + 0.009 * f64::from(n % 10), 0.004 * f64::from(n))).collect();
        let shown = |points: &[Feature]| {
            let mut chart = Chart::new(0.1, 1, Rules::OF_RINGS);
            chart.draw(&STILL, points, &[], 0);
            chart.take_changes()
        };
        let forward = shown(&points);
        points.reverse();
        let backward = shown(&points);
        assert_eq!((forward.len(), backward.len()), (1, 1));
        let (a, b) = (forward[0].now.unwrap(), backward[0].now.unwrap());
        assert!((a.0 - b.0).abs() < 1e-6 && (a.1 - b.1).abs() < 1e-6, "{a:?} {b:?}");
    }

    #[test]
    fn what_is_met_from_afar_is_matched_with_and_drawn_once_it_is_met_from_near_by() {
        let mut chart = Chart::new(0.1, 1, Rules::OF_PLANAR);
        let far = CLEARING_M_MAX + 3.0;
        let drawn = |chart: &Chart| {
            let grid = chart.drawing(0, 1, |_, at| at).unwrap();
            let (column, row) = grid.index_of(&Point2::new(far, 0.05)).unwrap();
            *grid.get(column, row).unwrap()
        };
        chart.draw(&STILL, &[at(far, 0.05), at(2.0, 0.05)], &[], 0);
        assert_eq!(drawn(&chart), Cell::Unknown);
        assert!(chart.take_changes().iter().any(|change| change.cell.0 == (far / 0.1) as i32));
        let beside = Motion { pose: Vector3::new(10.0, 0.0, 0.0), ..STILL };
        chart.draw(&beside, &[at(far - 10.0, 0.05)], &[], 0);
        assert_eq!(drawn(&chart), Cell::Occupied);
    }

    #[test]
    fn what_was_hidden_is_shown_again_where_it_is_met_again() {
        let mut chart = Chart::new(0.1, 1, Rules::OF_RINGS);
        chart.draw(&STILL, &[at(2.01, 0.05), at(3.01, 0.05)], &[], 0);
        chart.draw(&STILL, &[at(3.01, 0.05), at(4.01, 0.05)], &[], 1);
        chart.take_changes();
        chart.hide(|place| place == 0);
        let gone = chart.take_changes();
        assert_eq!(gone.len(), 1);
        assert_eq!((gone[0].cell, gone[0].now), ((20, 0), None));
        chart.draw(&STILL, &[at(2.07, 0.05)], &[], 1);
        let back = chart.take_changes();
        assert_eq!((back.len(), back[0].before), (1, None));
        assert!((back[0].now.unwrap().0 - 0.02).abs() < 1e-6, "{:?}", back[0]);
    }

    #[test]
    fn a_drawing_shows_what_was_drawn_from_a_place_where_that_is_believed_to_be() {
        let mut chart = Chart::new(0.1, 1, Rules::OF_RINGS);
        let through = Clearing { from: Vector2::zeros(), to: Vector2::new(1.5, 0.0), after_s: 0.0, layer: 0 };
        chart.draw(&STILL, &[at(2.05, 0.05)], &[through], 0);
        chart.draw(&STILL, &[at(3.05, 0.05)], &[], 1);
        let moved = |place: u16, at: Vector2<f64>| at + Vector2::new(0.0, if place == 1 { 0.3 } else { 0.0 });
        let grid = chart.drawing(0, 1, moved).unwrap();
        let cell = |x: f64, y: f64| {
            let (column, row) = grid.index_of(&Point2::new(x, y)).unwrap();
            *grid.get(column, row).unwrap()
        };
        assert_eq!(cell(2.05, 0.05), Cell::Occupied);
        assert_eq!((cell(3.05, 0.05), cell(3.05, 0.35)), (Cell::Unknown, Cell::Occupied));
        assert_eq!(cell(1.05, 0.05), Cell::Free);
    }
}
