//! Grass: a turbid layer on the soil. Which stretches of a beam lie in it, exactly.
//!
//! Inside one triangle of the terrain the beam's clearance above the blades is linear, so the path through the layer is
//! exact. Squares of sixteen by sixteen cells over which the beam stays above every blade are passed in one step.

use super::Ray;
use super::cells::Cells;
use super::soil::{BLOCK, highest};
use super::turbid::{Medium, Span};
use arborloop_base::Grid;
use arborloop_worlds::World;

/// The layer's upper surface.
#[derive(Debug)]
pub(super) struct Grass {
    /// Heights of the blades' tips, world frame, on the terrain's own lattice.
    tips: Grid<f64>,
    /// The highest tip of each square of [`BLOCK`] cells.
    tops: Grid<f64>,
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
        Grass { tops: highest(&tips), tips, extinction_per_m, bare }
    }

    pub(super) fn is_bare(&self) -> bool {
        self.bare
    }

    /// Adds the stretches of the beam below the blades' tips, from its begin to `end_m`, which is not under the soil.
    pub(super) fn spans(&self, ray: &Ray, end_m: f64, spans: &mut Vec<Span>) {
        if self.bare {
            return;
        }
        let low = self.tips.center_of(0, 0);
        let (low, step) = ([low.x, low.y], self.tips.resolution_m());
        let fine = Cells { low, step, count: [self.tips.columns() - 1, self.tips.rows() - 1] };
        let count = [self.tops.columns(), self.tops.rows()];
        let coarse = Cells { low, step: step * BLOCK as f64, count };
        let Some((begin, end)) = fine.within(ray, ray.range_m_min, end_m) else { return };
        let height = |range: f64| ray.origin.z + ray.direction.z * range;
        coarse.pass(ray, begin, end, |[column, row], enter, leave| {
            if height(enter).min(height(leave)) <= self.tops.cells()[row * count[0] + column] {
                fine.pass(ray, enter, leave, |cell, enter, leave| {
                    self.over_cell(ray, &fine, cell, enter, leave, spans);
                });
            }
        });
    }

    /// A cell is two triangles that share the diagonal from its lowest to its highest corner.
    fn over_cell(
        &self,
        ray: &Ray,
        cells: &Cells,
        [column, row]: [usize; 2],
        enter: f64,
        leave: f64,
        spans: &mut Vec<Span>,
    ) {
        let index = row * self.tips.columns() + column;
        let (tips, above) = (self.tips.cells(), index + self.tips.columns());
        let [h00, h10, h01, h11] = [tips[index], tips[index + 1], tips[above], tips[above + 1]];
        let corner = [cells.low[0] + column as f64 * cells.step, cells.low[1] + row as f64 * cells.step];
        let local = |range: f64| {
            let u = (ray.origin.x + ray.direction.x * range - corner[0]) / cells.step;
            let v = (ray.origin.y + ray.direction.y * range - corner[1]) / cells.step;
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
            }
        }
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
