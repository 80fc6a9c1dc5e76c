//! Grass: a turbid layer on the soil. Which stretches of a beam lie in it, exactly.
//!
//! Inside one triangle of the terrain the beam's clearance above the blades is linear, so the path through the layer is
//! exact. Most of a beam's way is far above: beams that travel together are moved on at once, from lid to lid, as long as
//! the lowest of them stays above. Only from there on are cells looked at one by one, and none beyond the point where
//! grass alone has stopped the beam.

mod abreast;

use super::Ray;
use super::cells::Cells;
use super::extent::Extent;
use super::lids::Lids;
use super::trace::{self, InstructionSet};
use super::turbid::{Medium, Span};
use abreast::Abreast;
use arborloop_base::Grid;
use arborloop_worlds::World;
use std::ops::ControlFlow;

/// Beams that are asked at once.
pub(super) const GROUP: usize = 16;

/// The layer's upper surface.
#[derive(Debug)]
pub(super) struct Grass {
    /// Heights of the blades' tips, world frame, on the terrain's own lattice.
    tips: Grid<f64>,
    cells: Cells,
    lids: Lids,
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
        Grass { cells: Cells::of(&tips, 1), lids: Lids::over(&tips), tips, extinction_per_m, bare }
    }

    pub(super) fn is_bare(&self) -> bool {
        self.bare
    }

    /// Memory, bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.tips.cells()) + self.lids.bytes()
    }

    /// From where on each of up to [`GROUP`] beams may be in the grass before its `end_m`; `None` for those that cannot.
    /// Beams that look alike are asked about much faster.
    pub(super) fn begins(
        &self,
        rays: &[Ray],
        extent: &Extent,
        ends_m: &[f64; GROUP],
    ) -> [Option<f64>; GROUP] {
        let mut begins = [None; GROUP];
        if self.bare {
            return begins;
        }
        let far_m = ends_m[..rays.len()].iter().copied().fold(0.0, f64::max);
        let mut clear_m = [0.0; GROUP];
        self.lids.clear_until(rays, extent, far_m, &mut clear_m[..rays.len()]);
        for (lane, ray) in rays.iter().enumerate() {
            let begin = clear_m[lane].max(ray.range_m_min);
            if begin < ends_m[lane] {
                begins[lane] = self.cells.within(ray, begin, ends_m[lane]).map(|(begin, _)| begin);
            }
        }
        begins
    }

    /// Where the grass stops each of these beams, which may be in it from their `begins` on, if it does so before its
    /// `end_m`.
    pub(super) fn stops(
        &self,
        rays: &[Ray],
        begins: &[Option<f64>; GROUP],
        ends_m: &[f64; GROUP],
        isa: InstructionSet,
    ) -> [Option<f64>; GROUP] {
        if begins.iter().all(Option::is_none) {
            return [None; GROUP];
        }
        trace::run(isa, Abreast { grass: self, rays, begins, ends_m })
    }

    /// Adds the stretches of a beam below the blades' tips up to `end_m`, which is not under the soil; it may be in the
    /// grass from `begin` on. The way beyond the stretch that uses the beam's depth up is not looked at.
    pub(super) fn spans(&self, ray: &Ray, begin: f64, end_m: f64, spans: &mut Vec<Span>) {
        let mut depth = ray.depth.get();
        self.pieces(ray, begin, end_m, |from_m, to_m| {
            self.add(from_m, to_m, spans);
            depth -= self.extinction_per_m * (to_m - from_m);
            if depth < 0.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
    }

    /// Visits the stretches of a beam below the tips, triangle by triangle.
    #[inline(always)]
    fn pieces(&self, ray: &Ray, begin: f64, end_m: f64, mut visit: impl FnMut(f64, f64) -> ControlFlow<()>) {
        let (tips, columns) = (self.tips.cells(), self.tips.columns());
        let (low, cells_per_m) = (self.cells.low, self.cells.cells_per_m);
        let from = [0, 1].map(|axis| (ray.origin[axis] - low[axis]) * cells_per_m);
        let along = [0, 1].map(|axis| ray.direction[axis] * cells_per_m);
        // Where the beam crosses the diagonal of a cell; of no use where it runs along it.
        let across = (along[0] - along[1]).recip();
        self.cells.pass(ray, begin, end_m, |[column, row], enter, leave| {
            let first = row * columns + column;
            let [h00, h10] = [tips[first], tips[first + 1]];
            let [h01, h11] = [tips[first + columns], tips[first + columns + 1]];
            let corner = [column as f64, row as f64];
            let local = |range_m: f64| [0, 1].map(|axis| from[axis] + along[axis] * range_m - corner[axis]);
            let height_m = |range_m: f64| ray.origin.z + ray.direction.z * range_m;
            // `f64::max` would also care for NaN.
            let higher = |a: f64, b: f64| if a > b { a } else { b };
            let top_m = higher(higher(h00, h10), higher(h01, h11));
            if height_m(enter) > top_m && height_m(leave) > top_m {
                return ControlFlow::Continue(());
            }
            // A cell is two triangles that share the diagonal from its lowest to its highest corner: u = v.
            let clearance_m = |range_m: f64, [u, v]: [f64; 2]| {
                let [along_u, along_v] = if u >= v { [h10 - h00, h11 - h10] } else { [h11 - h01, h01 - h00] };
                height_m(range_m) - (h00 + along_u * u + along_v * v)
            };
            let (at_enter, at_leave) = (local(enter), local(leave));
            let (a, b) = (clearance_m(enter, at_enter), clearance_m(leave, at_leave));
            let sides = [at_enter, at_leave].map(|[u, v]| u - v);
            if sides[0] * sides[1] >= 0.0 {
                return piece((enter, a), (leave, b), &mut visit);
            }
            let middle = ((corner[0] - corner[1] - (from[0] - from[1])) * across).clamp(enter, leave);
            let m = height_m(middle) - (h00 + (h11 - h00) * local(middle)[0]);
            piece((enter, a), (middle, m), &mut visit)?;
            piece((middle, m), (leave, b), &mut visit)
        });
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

/// Visits the part of a stretch, between two distances with their clearances, where the clearance is negative.
#[inline(always)]
fn piece(
    (from_m, a): (f64, f64),
    (to_m, b): (f64, f64),
    visit: &mut impl FnMut(f64, f64) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let surfacing = || from_m + (to_m - from_m) * (a / (a - b));
    let (from_m, to_m) = match (a < 0.0, b < 0.0) {
        (false, false) => return ControlFlow::Continue(()),
        (true, true) => (from_m, to_m),
        (true, false) => (from_m, surfacing()),
        (false, true) => (surfacing(), to_m),
    };
    if from_m < to_m { visit(from_m, to_m) } else { ControlFlow::Continue(()) }
}

#[cfg(test)]
mod tests {
    use super::super::{Depth, turbid};
    use super::*;
    use crate::Scenario;
    use arborloop_base::{Draws, Seed};
    use nalgebra::{Point3, Vector3};

    /// The slow twin: every cell on the beam's way is looked at.
    fn through_every_cell(grass: &Grass, ray: &Ray, end_m: f64) -> Vec<Span> {
        let mut spans = Vec::new();
        if let Some((begin, end)) = grass.cells.within(ray, ray.range_m_min, end_m) {
            grass.spans(ray, begin, end, &mut spans);
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
        for group in 0..400 {
            let mut draw = draws.at(group);
            let (x, y) = (draw.within(-20.0, 20.0), draw.within(-20.0, 20.0));
            let (bearing, rise): (f64, f64) = (draw.within(-3.1, 3.1), draw.within(-0.3, 0.05));
            let origin = Point3::new(x, y, world.terrain.height_m(x, y) + draw.within(0.02, 0.8));
            let ray = |draw: &mut Draws| {
                let bearing = bearing + draw.within(-0.03, 0.03);
                let shift = Vector3::from_fn(|_, _| draw.within(-1e-3, 1e-3));
                Ray {
                    origin: origin + shift,
                    direction: Vector3::new(bearing.cos(), bearing.sin(), rise).normalize(),
                    range_m_min: 0.3,
                    range_m_max: 40.0,
                    stamp: Default::default(),
                    depth: Depth::drawn(draw),
                }
            };
            let rays: [Ray; GROUP] = std::array::from_fn(|_| ray(&mut draw));
            let begins = grass.begins(&rays, &Extent::of(&rays), &[12.0; GROUP]);
            let all = [InstructionSet::Portable, InstructionSet::Avx2, InstructionSet::Avx512];
            let [stops, others @ ..] = all.map(|isa| grass.stops(&rays, &begins, &[12.0; GROUP], isa));
            others.iter().for_each(|other| assert_eq!(stops, *other, "group {group}"));
            for (lane, ray) in rays.iter().enumerate() {
                let (mut fast, slow) = (Vec::new(), through_every_cell(&grass, ray, 12.0));
                begins[lane].into_iter().for_each(|begin| grass.spans(ray, begin, 12.0, &mut fast));
                assert_eq!(fast, slow, "beam {lane} of {group}");
                met += usize::from(!slow.is_empty());
                // Where the grass is alone, it stops the beam where all that is turbid together would.
                let wanted = turbid::stop(&mut fast, ray.depth.get(), 12.0).map(|(stop_m, _)| stop_m);
                assert_eq!(stops[lane].is_some(), wanted.is_some(), "beam {lane} of {group}");
                let apart_m = stops[lane].unwrap_or(0.0) - wanted.unwrap_or(0.0);
                assert!(apart_m.abs() < 1e-9, "beam {lane} of {group}: {apart_m} m");
            }
        }
        assert!(met > 1000, "{met} beams came through grass");
    }
}
