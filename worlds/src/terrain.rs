//! The ground: a height grid with two flat triangles per cell (see [`Terrain::grid`]), exact for a ray caster.

use crate::shape::Bounds;
use crate::spec::TerrainSpec;
use crate::{surface, waves};
use arborloop_base::{Grid, Seed, Stream};
use nalgebra::{Point2, Point3, Unit, Vector3};
use std::f64::consts::TAU;

/// The ground. Its height is 0 at the world's origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Terrain {
    nodes: Grid<f64>,
    /// Reflectance of bare soil near 905 nm.
    pub reflectivity_ratio: f64,
}

impl Terrain {
    /// Slope, undulation, bumps, furrows and clods, from the streams `world/terrain/relief`, `world/terrain/bumps` and
    /// `world/terrain/clods` (by node, counted from the origin).
    pub(crate) fn new(spec: &TerrainSpec, seed: Seed) -> Self {
        let (mut nodes, places) = surface::lattice(spec.extent_m, spec.cell_m);
        let streams = [
            (seed.stream("world/terrain/relief"), spec.relief_m, spec.relief_wavelength_m),
            (seed.stream("world/terrain/bumps"), spec.bump_m, spec.bump_wavelength_m),
        ];
        for (stream, deviation_m, wavelength_m) in streams {
            if deviation_m > 0.0 {
                let field = waves::field(stream, deviation_m, wavelength_m, &places, &places);
                nodes.cells_mut().iter_mut().zip(field).for_each(|(height, rise)| *height += rise);
            }
        }
        if spec.roughness_m > 0.0 {
            scatter_clods(&mut nodes, spec.roughness_m, seed.stream("world/terrain/clods"));
        }
        if spec.furrow_depth_m > 0.0 {
            plow(&mut nodes, &places, spec);
        }
        let (toward_y, toward_x) = spec.slope_toward_deg.to_radians().sin_cos();
        let fall = spec.slope_deg.to_radians().tan();
        let at_origin = surface::height(&nodes, 0.0, 0.0);
        let columns = nodes.columns();
        for (index, height) in nodes.cells_mut().iter_mut().enumerate() {
            let along = places[index % columns] * toward_x + places[index / columns] * toward_y;
            *height -= at_origin + fall * along;
        }
        Terrain { nodes, reflectivity_ratio: spec.soil_reflectivity_ratio }
    }

    /// Level ground at height 0 within `extent_m` of the origin, for tests and demonstrations.
    pub fn level(extent_m: f64, cell_m: f64) -> Self {
        let (nodes, _) = surface::lattice(extent_m, cell_m);
        Terrain { nodes, reflectivity_ratio: TerrainSpec::default().soil_reflectivity_ratio }
    }

    /// Height of the ground, meters: exactly the triangles of [`Terrain::grid`]; outside the grid the border's height.
    pub fn height_m(&self, x: f64, y: f64) -> f64 {
        surface::height(&self.nodes, x, y)
    }

    /// Upward normal of the triangle under a point; of the level continuation outside the grid.
    pub fn normal(&self, x: f64, y: f64) -> Unit<Vector3<f64>> {
        let slope = surface::gradient(&self.nodes, x, y);
        Unit::new_normalize(Vector3::new(-slope.x, -slope.y, 1.0))
    }

    /// Heights of the nodes, meters. Node (column, row) stands at the grid's `center_of(column, row)`; the square
    /// between four nodes is two triangles, cut along the diagonal from (column, row) to (column + 1, row + 1).
    pub fn grid(&self) -> &Grid<f64> {
        &self.nodes
    }

    /// One node as a point, world frame; `None` outside the grid.
    pub fn node(&self, column: usize, row: usize) -> Option<Point3<f64>> {
        let height = *self.nodes.get(column, row)?;
        let place = self.nodes.center_of(column, row);
        Some(Point3::new(place.x, place.y, height))
    }

    /// The rectangle that the nodes cover.
    pub fn bounds(&self) -> Bounds {
        let last = self.nodes.center_of(self.nodes.columns() - 1, self.nodes.rows() - 1);
        let first = self.nodes.center_of(0, 0);
        Bounds { low: Point2::new(first.x, first.y), high: Point2::new(last.x, last.y) }
    }

    /// Lowest and highest node, meters.
    pub fn height_range_m(&self) -> (f64, f64) {
        let start = (f64::INFINITY, f64::NEG_INFINITY);
        self.nodes.cells().iter().fold(start, |(low, high), h| (low.min(*h), high.max(*h)))
    }
}

/// Every node's own height, normal. A node's address is its distance from the origin in cells, so that a larger field
/// keeps the clods of a smaller one.
fn scatter_clods(nodes: &mut Grid<f64>, deviation_m: f64, stream: Stream) {
    let (columns, half) = (nodes.columns(), (nodes.columns() / 2) as i64);
    for (index, height) in nodes.cells_mut().iter_mut().enumerate() {
        let [column, row] = [index % columns, index / columns].map(|n| (n as i64 - half) as u64);
        *height += deviation_m * stream.child(column).at(row).normal();
    }
}

/// A cosine across the furrows.
fn plow(nodes: &mut Grid<f64>, places: &[f64], spec: &TerrainSpec) {
    let (along_y, along_x) = spec.furrow_bearing_deg.to_radians().sin_cos();
    let columns = nodes.columns();
    for (index, height) in nodes.cells_mut().iter_mut().enumerate() {
        let across_m = places[index / columns] * along_x - places[index % columns] * along_y;
        *height += 0.5 * spec.furrow_depth_m * (TAU * across_m / spec.furrow_spacing_m).cos();
    }
}
