//! Grass: a turbid layer on the soil. Which stretches of a beam lie in it, exactly.
//!
//! Inside one triangle of the terrain the beam's clearance above the blades is linear, so the path through the layer is
//! exact. Squares of cells are passed in one step where the beam stays above a plane that no blade in them pierces, and
//! nothing is looked at beyond the point where grass alone has stopped it.

use super::Ray;
use super::cells::Cells;
use super::soil;
use super::turbid::{Medium, Span};
use arborloop_base::Grid;
use arborloop_worlds::World;
use std::ops::ControlFlow;

/// Cells along a side of the squares that are looked at as one, from coarse to fine.
const SIDES: [usize; 3] = [16, 4, 1];

/// How many coarse squares around a beam's begin are asked for their highest tip at once.
const NEAR: usize = 5;

/// A plane above a square that no tip in it pierces. On a slope it lies much closer than the highest tip does.
#[derive(Debug, Clone, Copy)]
struct Lid {
    /// Above the square's lowest corner, world frame, meters.
    height_m: f64,
    /// Rise for each meter along x and y.
    rise: [f64; 2],
}

/// The layer's upper surface.
#[derive(Debug)]
pub(super) struct Grass {
    /// Heights of the blades' tips, world frame, on the terrain's own lattice.
    tips: Grid<f64>,
    /// Squares of [`SIDES`] cells, each with its lid.
    levels: [(Cells, Vec<Lid>); 3],
    /// The highest tip of all.
    top_m: f64,
    /// The highest tip from each of the coarse squares to those [`NEAR`] squares away.
    tops_near: Vec<f64>,
    extinction_per_m: f64,
    bare: bool,
}

impl Grass {
    pub(super) fn new(world: &World) -> Self {
        let mut tips = world.terrain.grid().clone();
        let blades = world.grass.grid().cells();
        tips.cells_mut().iter_mut().zip(blades).for_each(|(height, blade)| *height += blade);
        let extinction_per_m = world.grass.density_per_m;
        let bare = !(world.grass.height_m_max() > 0.0 && extinction_per_m > 0.0);
        let (low, step) = (tips.center_of(0, 0), tips.resolution_m());
        let levels = SIDES.map(|side| {
            let (columns, rows) = (tips.columns() - 1, tips.rows() - 1);
            let count = [columns.div_ceil(side), rows.div_ceil(side)];
            let lids = (0..count[0] * count[1]).map(|square| {
                let (left, low) = (square % count[0] * side, square / count[0] * side);
                Lid::over(&tips, [left, low], [(left + side).min(columns), (low + side).min(rows)])
            });
            let lids = lids.collect();
            let step = step * side as f64;
            (Cells { low: [low.x, low.y], step, cells_per_m: step.recip(), count }, lids)
        });
        let top_m = tips.cells().iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let tops = soil::highest(&tips, SIDES[0]);
        let tops_near = around(tops.cells(), levels[0].0.count, NEAR);
        Grass { tips, levels, top_m, tops_near, extinction_per_m, bare }
    }

    pub(super) fn is_bare(&self) -> bool {
        self.bare
    }

    /// Adds the stretches of the beam below the blades' tips, from its begin to `end_m`, which is not under the soil.
    /// The way beyond the stretch that uses the beam's depth up is not looked at.
    pub(super) fn spans(&self, ray: &Ray, end_m: f64, spans: &mut Vec<Span>) {
        if self.bare || self.rises_above(ray) {
            return;
        }
        let way = below(ray.origin.z - self.top_m, ray.direction.z, ray.range_m_min, end_m)
            .and_then(|(begin, end)| self.levels[2].0.within(ray, begin, end));
        if let Some((begin, end)) = way {
            let inverse = [ray.direction.x.recip(), ray.direction.y.recip()];
            let mut depth = ray.depth;
            let _ = self.over_squares::<0>(ray, &inverse, begin, end, &mut depth, spans);
        }
    }

    /// Whether a beam does not sink and has left the height of the tips nearby behind, and of all tips before it gets
    /// farther away: half of a lidar's beams.
    #[inline]
    fn rises_above(&self, ray: &Ray) -> bool {
        let rise = ray.direction.z;
        let coarse = &self.levels[0].0;
        let square = [0, 1].map(|axis| (ray.origin[axis] - coarse.low[axis]) / coarse.step);
        let inside = (0..2).all(|axis| square[axis] >= 0.0 && square[axis] < coarse.count[axis] as f64);
        // From wherever in its square, it is as far as this to squares that are not near.
        let near_m = NEAR as f64 * coarse.step;
        inside
            && rise >= 0.0
            && ray.origin.z + rise * near_m > self.top_m
            && ray.origin.z > self.tops_near[square[1] as usize * coarse.count[0] + square[0] as usize]
    }

    /// Squares of [`SIDES`] cells of a level, and what is below their highest tip on the next.
    fn over_squares<const LEVEL: usize>(
        &self,
        ray: &Ray,
        inverse: &[f64; 2],
        begin: f64,
        end: f64,
        depth: &mut f64,
        spans: &mut Vec<Span>,
    ) -> ControlFlow<()> {
        let (cells, lids) = &self.levels[LEVEL];
        cells.pass(ray, inverse, begin, end, |[column, row], enter, leave| {
            let lid = &lids[row * cells.count[0] + column];
            let corner = [cells.low[0] + column as f64 * cells.step, cells.low[1] + row as f64 * cells.step];
            let (above_m, climb) = lid.clearance(ray, corner);
            // Most squares are flown over: no division for them.
            if above_m + climb * enter > 0.0 && above_m + climb * leave > 0.0 {
                return ControlFlow::Continue(());
            }
            if LEVEL == SIDES.len() - 1 {
                return self.over_cell(ray, cells, [column, row], enter, leave, depth, spans);
            }
            let Some((from, to)) = below(above_m, climb, enter, leave) else {
                return ControlFlow::Continue(());
            };
            match LEVEL {
                0 => self.over_squares::<1>(ray, inverse, from, to, depth, spans),
                _ => self.over_squares::<2>(ray, inverse, from, to, depth, spans),
            }
        })
    }

    /// A cell is two triangles that share the diagonal from its lowest to its highest corner.
    fn over_cell(
        &self,
        ray: &Ray,
        cells: &Cells,
        [column, row]: [usize; 2],
        enter: f64,
        leave: f64,
        depth: &mut f64,
        spans: &mut Vec<Span>,
    ) -> ControlFlow<()> {
        let index = row * self.tips.columns() + column;
        let (tips, above) = (self.tips.cells(), index + self.tips.columns());
        let [h00, h10, h01, h11] = [tips[index], tips[index + 1], tips[above], tips[above + 1]];
        let corner = [cells.low[0] + column as f64 * cells.step, cells.low[1] + row as f64 * cells.step];
        let local = |range: f64| {
            let u = (ray.origin.x + ray.direction.x * range - corner[0]) * cells.cells_per_m;
            let v = (ray.origin.y + ray.direction.y * range - corner[1]) * cells.cells_per_m;
            (u, v)
        };
        // The diagonal is u = v; u - v is linear along the beam.
        let ((u0, v0), (u1, v1)) = (local(enter), local(leave));
        let (side0, side1) = (u0 - v0, u1 - v1);
        let crossing = (side0 * side1 < 0.0).then(|| enter + (leave - enter) * side0 / (side0 - side1));
        let pieces = match crossing {
            Some(middle) => [(enter, middle, side0), (middle, leave, side1)],
            None => [(enter, leave, side0 + side1), (leave, leave, 0.0)],
        };
        for (from, to, side) in pieces {
            let [along_u, along_v] =
                if side >= 0.0 { [h10 - h00, h11 - h10] } else { [h11 - h01, h01 - h00] };
            let clearance = |range: f64| {
                let (u, v) = local(range);
                ray.origin.z + ray.direction.z * range - (h00 + along_u * u + along_v * v)
            };
            let (a, b) = (clearance(from), clearance(to));
            let surfacing = from + (to - from) * a / (a - b);
            let (from_m, to_m) = match (a < 0.0, b < 0.0) {
                (false, false) => continue,
                (true, true) => (from, to),
                (true, false) => (from, surfacing),
                (false, true) => (surfacing, to),
            };
            if from_m < to_m {
                self.add(from_m, to_m, spans);
                *depth -= self.extinction_per_m * (to_m - from_m);
                if *depth < 0.0 {
                    return ControlFlow::Break(());
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Stretches that follow each other are one.
    fn add(&self, from_m: f64, to_m: f64, spans: &mut Vec<Span>) {
        match spans.last_mut() {
            Some(last) if last.to_m == from_m => last.to_m = to_m,
            _ => {
                let extinction_per_m = self.extinction_per_m;
                spans.push(Span { from_m, to_m, extinction_per_m, medium: Medium::Grass });
            }
        }
    }
}

/// The highest of the values that are no more than so many columns and rows away.
fn around(values: &[f64], [columns, rows]: [usize; 2], reach: usize) -> Vec<f64> {
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

impl Lid {
    /// Over the nodes from one column and row to another.
    fn over(tips: &Grid<f64>, [left, low]: [usize; 2], [right, high]: [usize; 2]) -> Self {
        let tip = |column: usize, row: usize| tips.cells()[row * tips.columns() + column];
        let step = tips.resolution_m();
        // The mean rises between opposite sides; whatever they are, the lid is put on top of the highest node.
        let [mut along_x, mut along_y] = [0.0, 0.0];
        (low..=high).for_each(|row| along_x += tip(right, row) - tip(left, row));
        (left..=right).for_each(|column| along_y += tip(column, high) - tip(column, low));
        let across = (((right - left) * (high - low + 1)) as f64 * step).recip();
        let upward = (((high - low) * (right - left + 1)) as f64 * step).recip();
        let rise = [along_x * across, along_y * upward];
        let mut height_m = f64::NEG_INFINITY;
        for row in low..=high {
            for column in left..=right {
                let away = [(column - left) as f64 * step, (row - low) as f64 * step];
                height_m = height_m.max(tip(column, row) - rise[0] * away[0] - rise[1] * away[1]);
            }
        }
        // A hair for rounding.
        Lid { height_m: height_m + 1e-9, rise }
    }

    /// How far the line of a beam is above the lid where it starts, and what it gains for each meter.
    #[inline(always)]
    fn clearance(&self, ray: &Ray, corner: [f64; 2]) -> (f64, f64) {
        let [x, y] = self.rise;
        let above_m =
            ray.origin.z - (self.height_m + x * (ray.origin.x - corner[0]) + y * (ray.origin.y - corner[1]));
        (above_m, ray.direction.z - (x * ray.direction.x + y * ray.direction.y))
    }
}

/// The part of a stretch of a beam where its clearance is not positive, if there is one: how much it has where the beam
/// starts, and what it gains for each meter.
fn below(above_m: f64, rise: f64, enter: f64, leave: f64) -> Option<(f64, f64)> {
    let (enter, leave) = match rise {
        _ if rise < 0.0 => (enter.max(-above_m / rise), leave),
        _ if rise > 0.0 => (enter, leave.min(-above_m / rise)),
        _ if above_m > 0.0 => return None,
        _ => (enter, leave),
    };
    (enter <= leave).then_some((enter, leave))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scenario;
    use arborloop_base::Seed;
    use nalgebra::{Point3, Vector3};

    /// The slow twin: every cell on the beam's way is looked at.
    fn through_every_cell(grass: &Grass, ray: &Ray, end_m: f64) -> Vec<Span> {
        let fine = &grass.levels[2].0;
        let (mut spans, mut depth) = (Vec::new(), ray.depth);
        if let Some((begin, end)) = fine.within(ray, ray.range_m_min, end_m) {
            let inverse = [ray.direction.x.recip(), ray.direction.y.recip()];
            let _ = fine.pass(ray, &inverse, begin, end, |cell, enter, leave| {
                grass.over_cell(ray, fine, cell, enter, leave, &mut depth, &mut spans)
            });
        }
        spans
    }

    #[test]
    fn cells_that_a_beam_passes_above_change_nothing_of_its_way_through_the_grass() {
        let scenario = Scenario::read(&Scenario::embedded("orchard-go1").unwrap()).unwrap();
        let world = arborloop_worlds::build(&scenario.world, Seed(7));
        let grass = Grass::new(&world);
        let draws = Seed(8).stream("beams");
        let mut met = 0;
        for index in 0..4000 {
            let mut draw = draws.at(index);
            let (x, y) = (draw.within(-20.0, 20.0), draw.within(-20.0, 20.0));
            let (bearing, rise): (f64, f64) = (draw.within(-3.1, 3.1), draw.within(-0.3, 0.05));
            let origin = Point3::new(x, y, world.terrain.height_m(x, y) + draw.within(0.02, 0.8));
            let direction = Vector3::new(bearing.cos(), bearing.sin(), rise).normalize();
            let ray = Ray {
                origin,
                direction,
                range_m_min: 0.3,
                range_m_max: 40.0,
                stamp: Default::default(),
                depth: 1.0,
            };
            let (mut fast, slow) = (Vec::new(), through_every_cell(&grass, &ray, 12.0));
            grass.spans(&ray, 12.0, &mut fast);
            assert_eq!(fast.len(), slow.len(), "beam {index}");
            met += usize::from(!slow.is_empty());
            for (a, b) in fast.iter().zip(&slow) {
                assert!((a.from_m - b.from_m).abs() < 1e-9 && (a.to_m - b.to_m).abs() < 1e-9, "beam {index}");
            }
        }
        assert!(met > 1000, "{met} beams came through grass");
    }
}
