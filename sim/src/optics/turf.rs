//! The ground and the grass on it, marched together cell by cell.
//!
//! Inside one triangle of the terrain the beam's clearance above ground is linear, so both the crossing with the
//! soil and the path through the layer of grass are exact.

use super::{Hit, Ray};
use arborloop_base::{Class, Grid};
use arborloop_worlds::{Grass, Terrain};
use nalgebra::Vector3;

#[derive(Debug)]
pub(super) struct Turf {
    /// Heights of the soil.
    nodes: Grid<f64>,
    /// Heights of the grass above the soil, on the same lattice.
    blades: Grid<f64>,
    height_m_min: f64,
    height_m_max: f64,
    blade_m_max: f64,
    extinction_per_m: f64,
    soil_reflectivity_ratio: f64,
    grass_reflectivity_ratio: f64,
}

/// A stretch of the beam over one triangle: from, to, clearance above soil and above blades at both, and the slopes.
struct Stretch {
    enter: f64,
    leave: f64,
    above_soil: [f64; 2],
    above_grass: [f64; 2],
    slope: [f64; 2],
}

impl Turf {
    pub(super) fn new(terrain: &Terrain, grass: &Grass) -> Self {
        let (height_m_min, height_m_max) = terrain.height_range_m();
        Turf {
            nodes: terrain.grid().clone(),
            blades: grass.grid().clone(),
            height_m_min,
            height_m_max,
            blade_m_max: grass.height_m_max(),
            extinction_per_m: grass.density_per_m,
            soil_reflectivity_ratio: terrain.reflectivity_ratio,
            grass_reflectivity_ratio: grass.reflectivity_ratio,
        }
    }

    pub(super) fn cast(&self, ray: &Ray, depth: f64) -> Option<Hit> {
        let (begin, end) = self.stretch_near_ground(ray)?;
        let mut left = depth;
        let mut found = None;
        self.march(ray, begin, end, |stretch| {
            let grass = self.grass_within(&stretch, &mut left);
            let soil = soil_within(&stretch);
            found = match (grass, soil) {
                (Some(range_m), soil) if soil.is_none_or(|at| range_m < at) => Some(Hit {
                    range_m,
                    class: Class::Grass,
                    instance: 0,
                    // Blades stand at every angle: the mean cosine of a random one.
                    cos_incidence: 0.5,
                    reflectivity_ratio: self.grass_reflectivity_ratio,
                    transmittance_ratio: 0.0,
                    displacement_m: Vector3::zeros(),
                }),
                (_, Some(range_m)) => {
                    let normal = Vector3::new(-stretch.slope[0], -stretch.slope[1], 1.0).normalize();
                    Some(Hit {
                        range_m,
                        class: Class::Ground,
                        instance: 0,
                        cos_incidence: (normal.dot(&ray.direction).abs() / ray.direction.norm()).min(1.0),
                        reflectivity_ratio: self.soil_reflectivity_ratio,
                        transmittance_ratio: 0.0,
                        displacement_m: Vector3::zeros(),
                    })
                }
                _ => None,
            };
            found.is_none()
        });
        found
    }

    /// Where the beam is inside the terrain's square and below the highest blade.
    fn stretch_near_ground(&self, ray: &Ray) -> Option<(f64, f64)> {
        let step = self.nodes.resolution_m();
        let (mut begin, mut end) = (0.0_f64, ray.range_m_max);
        let low = self.first_node();
        let mut clip = |origin: f64, direction: f64, low: f64, high: f64| {
            if direction == 0.0 {
                if origin < low || origin > high {
                    end = -1.0;
                }
                return;
            }
            let (a, b) = ((low - origin) / direction, (high - origin) / direction);
            begin = begin.max(a.min(b));
            end = end.min(a.max(b));
        };
        clip(ray.origin.x, ray.direction.x, low[0], low[0] + step * (self.nodes.columns() - 1) as f64);
        clip(ray.origin.y, ray.direction.y, low[1], low[1] + step * (self.nodes.rows() - 1) as f64);
        let margin = 1.0;
        clip(ray.origin.z, ray.direction.z, self.height_m_min - margin, self.height_m_max + self.blade_m_max);
        (begin < end).then_some((begin, end))
    }

    /// Heights belong to the centers of the grid's cells.
    fn first_node(&self) -> [f64; 2] {
        let first = self.nodes.center_of(0, 0);
        [first.x, first.y]
    }

    /// Visits the stretches of the beam over one triangle after another, until the visitor has enough.
    fn march(&self, ray: &Ray, begin: f64, end: f64, mut visit: impl FnMut(Stretch) -> bool) {
        let step = self.nodes.resolution_m();
        let low = self.first_node();
        let (last_column, last_row) = (self.nodes.columns() as i64 - 2, self.nodes.rows() as i64 - 2);
        let at =
            |axis: usize, range: f64| (ray.origin[axis] + ray.direction[axis] * range - low[axis]) / step;
        let mut cell = [0_i64; 2];
        let mut next = [f64::INFINITY; 2];
        let mut delta = [f64::INFINITY; 2];
        let mut stride = [0_i64; 2];
        for axis in 0..2 {
            let last = if axis == 0 { last_column } else { last_row };
            cell[axis] = (at(axis, begin).floor() as i64).clamp(0, last);
            let speed = ray.direction[axis] / step;
            if speed != 0.0 {
                stride[axis] = if speed > 0.0 { 1 } else { -1 };
                delta[axis] = speed.abs().recip();
                let border = cell[axis] + i64::from(speed > 0.0);
                next[axis] = begin + ((border as f64 - at(axis, begin)) / speed).max(0.0);
            }
        }
        let mut enter = begin;
        while enter < end {
            let leave = next[0].min(next[1]).min(end);
            if !self.visit_cell(ray, cell, enter, leave, &mut visit) {
                return;
            }
            let axis = usize::from(next[1] < next[0]);
            cell[axis] += stride[axis];
            next[axis] += delta[axis];
            let inside = (0..=last_column).contains(&cell[0]) && (0..=last_row).contains(&cell[1]);
            if !inside || stride == [0, 0] {
                return;
            }
            enter = leave;
        }
    }

    /// A cell is two triangles that share the diagonal from its lowest to its highest corner.
    fn visit_cell(
        &self,
        ray: &Ray,
        cell: [i64; 2],
        enter: f64,
        leave: f64,
        visit: &mut impl FnMut(Stretch) -> bool,
    ) -> bool {
        let step = self.nodes.resolution_m();
        let low = self.first_node();
        let index = cell[1] as usize * self.nodes.columns() + cell[0] as usize;
        let corners = |grid: &Grid<f64>| {
            let cells = grid.cells();
            let above = index + grid.columns();
            [cells[index], cells[index + 1], cells[above], cells[above + 1]]
        };
        let (soil, blades) = (corners(&self.nodes), corners(&self.blades));
        let corner = [low[0] + cell[0] as f64 * step, low[1] + cell[1] as f64 * step];
        let local = |range: f64| {
            let u = (ray.origin.x + ray.direction.x * range - corner[0]) / step;
            let v = (ray.origin.y + ray.direction.y * range - corner[1]) / step;
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
            if to <= from {
                continue;
            }
            let slopes = |[h00, h10, h01, h11]: [f64; 4]| match side >= 0.0 {
                true => [h10 - h00, h11 - h10],
                false => [h11 - h01, h01 - h00],
            };
            let height = |corners: [f64; 4], range: f64| {
                let ([du, dv], (u, v)) = (slopes(corners), local(range));
                corners[0] + du * u + dv * v
            };
            let above_soil = |range: f64| ray.origin.z + ray.direction.z * range - height(soil, range);
            let above_soil = [above_soil(from), above_soil(to)];
            let stretch = Stretch {
                enter: from,
                leave: to,
                above_soil,
                above_grass: [above_soil[0] - height(blades, from), above_soil[1] - height(blades, to)],
                slope: slopes(soil).map(|rise| rise / step),
            };
            if !visit(stretch) {
                return false;
            }
        }
        true
    }

    /// Beer-Lambert: a blade stops the beam where the depth drawn for it is used up.
    fn grass_within(&self, stretch: &Stretch, left: &mut f64) -> Option<f64> {
        if self.blade_m_max <= 0.0 || self.extinction_per_m <= 0.0 {
            return None;
        }
        let [a, b] = stretch.above_grass;
        let crossing = a / (a - b);
        let (from, to) = match (a < 0.0, b < 0.0) {
            (false, false) => return None,
            (true, true) => (0.0, 1.0),
            (true, false) => (0.0, crossing),
            (false, true) => (crossing, 1.0),
        };
        let length = stretch.leave - stretch.enter;
        let depth = (to - from) * length * self.extinction_per_m;
        if depth < *left {
            *left -= depth;
            return None;
        }
        Some(stretch.enter + from * length + *left / self.extinction_per_m)
    }
}

fn soil_within(stretch: &Stretch) -> Option<f64> {
    let [c0, c1] = stretch.above_soil;
    if c0 > 0.0 && c1 > 0.0 {
        return None;
    }
    // A beam that starts under the soil meets it where it starts.
    let share = if c0 <= 0.0 { 0.0 } else { c0 / (c0 - c1) };
    Some(stretch.enter + share * (stretch.leave - stretch.enter))
}
