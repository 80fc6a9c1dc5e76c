//! Footprint truth: which cells of the ground something stands in, within a slice of heights above the ground.
//!
//! Every solid, branch and leaf is cut by the slice, seen from above, and every cell that its outline touches is
//! occupied. Outlines are exact up to two limits, both far below a cell: round sections are polygons of
//! [`SIDES`] corners drawn around the circle (at most 0.5 % too wide), and the ground is taken as flat under
//! each piece of at most [`PIECE_M`]. Haze fills its outline: a clump is as large as its leaves may be.

use crate::World;
use crate::haze::{Haze, Outline};
use crate::shape::{Bounds, Frustum, Leaf};
use crate::terrain::Terrain;
use arborloop_base::{Cell, Grid};
use nalgebra::{Point2, Point3, Similarity3, Vector3};
use std::f64::consts::{PI, TAU};

/// Heights above the local ground, meters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeightSlice {
    /// Lowest.
    pub low_m: f64,
    /// Highest.
    pub high_m: f64,
}

/// Corners of the polygon drawn around a round section.
pub const SIDES: usize = 32;
/// Longest piece under which the ground is taken as flat, meters.
pub const PIECE_M: f64 = 0.25;

/// Rings of the polyhedron drawn around an ellipsoid of haze, its two poles among them.
const RINGS: usize = 17;

/// Occupied where any solid (cone, trunk, post, wire), branch, leaf or haze is inside the slice; free elsewhere. The grid covers `bounds`,
/// rounded up to whole cells; bounds turned inside out give a grid without cells.
///
/// # Panics
/// When the resolution is not a positive number.
pub fn footprint(world: &World, slice: HeightSlice, resolution_m: f64, bounds: &Bounds) -> Grid<Cell> {
    let cells = |size_m: f64| (size_m / resolution_m).ceil().max(0.0) as usize;
    let size = bounds.high - bounds.low;
    let mut grid = Grid::filled(bounds.low, resolution_m, cells(size.x), cells(size.y), Cell::Free);
    let (ground_m_min, ground_m_max) = world.terrain.height_range_m();
    let heights_m = [ground_m_min + slice.low_m, ground_m_max + slice.high_m];
    let mut raster = Raster { grid: &mut grid, terrain: &world.terrain, slice, heights_m, bounds: *bounds };
    for solid in &world.solids {
        raster.draw_frustum(&solid.shape);
    }
    for plant in &world.plants {
        let prototype = &world.prototypes[plant.prototype];
        for branch in &prototype.branches {
            raster.draw_frustum(&branch.transformed(&plant.world_from_plant));
        }
        for leaf in &prototype.leaves {
            raster.draw_leaf(&leaf.transformed(&plant.world_from_plant));
        }
        for haze in &prototype.haze {
            raster.draw_haze(haze, &plant.world_from_plant);
        }
    }
    grid
}

struct Raster<'a> {
    grid: &'a mut Grid<Cell>,
    terrain: &'a Terrain,
    slice: HeightSlice,
    /// Nothing below or above is in the slice anywhere, world frame.
    heights_m: [f64; 2],
    bounds: Bounds,
}

impl Raster<'_> {
    fn draw_frustum(&mut self, frustum: &Frustum) {
        let pieces = (frustum.height_m / PIECE_M).ceil().max(1.0) as usize;
        let piece_m = frustum.height_m / pieces as f64;
        for index in 0..pieces {
            let piece = frustum.part(index as f64 * piece_m, (index + 1) as f64 * piece_m);
            let [low, high] = [ring(&piece, 0.0), ring(&piece, piece.height_m)];
            let next = |corner: usize| (corner + 1) % SIDES;
            self.draw_convex(
                (0..SIDES)
                    .flat_map(|c| [(low[c], low[next(c)]), (high[c], high[next(c)]), (low[c], high[c])]),
            );
        }
    }

    fn draw_leaf(&mut self, leaf: &Leaf) {
        // Most leaves of a world are above the slice: they need no outline.
        let reach = leaf.half_u.abs() + leaf.half_v.abs();
        let (low, high) = (leaf.center - reach, leaf.center + reach);
        let beside = high.x < self.bounds.low.x
            || low.x > self.bounds.high.x
            || high.y < self.bounds.low.y
            || low.y > self.bounds.high.y;
        if beside || high.z < self.heights_m[0] || low.z > self.heights_m[1] {
            return;
        }
        let corners = leaf.corners();
        self.draw_convex((0..4).map(|c| (corners[c], corners[(c + 1) % 4])));
    }

    fn draw_haze(&mut self, haze: &Haze, world_from_plant: &Similarity3<f64>) {
        let at = |unit: Vector3<f64>| world_from_plant * (haze.center + unit.component_mul(&haze.half_size));
        match haze.outline {
            Outline::Box => {
                let corner = |index: usize| at(CUBE[index].into());
                self.draw_convex(CUBE_EDGES.iter().map(|[a, b]| (corner(*a), corner(*b))));
            }
            Outline::Ellipsoid => {
                let rings: Vec<[Point3<f64>; SIDES]> =
                    (0..RINGS).map(|ring| parallel(ring).map(at)).collect();
                let next = |corner: usize| (corner + 1) % SIDES;
                for pair in rings.windows(2) {
                    let [low, high] = [&pair[0], &pair[1]];
                    self.draw_convex(
                        (0..SIDES).flat_map(|c| {
                            [(low[c], low[next(c)]), (high[c], high[next(c)]), (low[c], high[c])]
                        }),
                    );
                }
            }
        }
    }

    /// Marks the cells under the part of a convex body inside the slice. The corners of that part lie on the body's
    /// edges: their ends inside the slice, and where they cross its limits.
    fn draw_convex(&mut self, edges: impl Iterator<Item = (Point3<f64>, Point3<f64>)>) {
        let mut corners = Vec::new();
        for (a, b) in edges {
            let [above_a, above_b] = [a, b].map(|p| p.z - self.terrain.height_m(p.x, p.y));
            if let Some((from, to)) = clip(above_a, above_b, self.slice.low_m, self.slice.high_m) {
                corners.extend([from, to].map(|share| (a + (b - a) * share).xy()));
            }
        }
        self.mark(&hull(corners));
    }

    /// Marks every cell that a convex outline touches, row by row.
    fn mark(&mut self, outline: &[Point2<f64>]) {
        let Some(first) = outline.first() else { return };
        let (low, high) = outline.iter().fold((first.y, first.y), |(l, h), p| (l.min(p.y), h.max(p.y)));
        let (origin, resolution_m) = (self.grid.origin(), self.grid.resolution_m());
        let cell = |value: f64, start: f64| ((value - start) / resolution_m).floor();
        let [rows, columns] = [self.grid.rows(), self.grid.columns()].map(|count| count as f64 - 1.0);
        let (row_low, row_high) = (cell(low, origin.y).max(0.0), cell(high, origin.y).min(rows));
        let mut row = row_low;
        while row <= row_high {
            let band_low = origin.y + row * resolution_m;
            if let Some((left, right)) = extent(outline, band_low, band_low + resolution_m) {
                let mut column = cell(left, origin.x).max(0.0);
                while column <= cell(right, origin.x).min(columns) {
                    if let Some(found) = self.grid.get_mut(column as usize, row as usize) {
                        *found = Cell::Occupied;
                    }
                    column += 1.0;
                }
            }
            row += 1.0;
        }
    }
}

/// Corners of a cube of half side 1, and the pairs that are its edges.
const CUBE: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];
const CUBE_EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

/// One ring of a polyhedron drawn around the unit ball: at most 1 % too wide.
fn parallel(ring: usize) -> [Vector3<f64>; SIDES] {
    let step_rad = PI / (RINGS - 1) as f64;
    let (sin_polar, cos_polar) = (ring as f64 * step_rad).sin_cos();
    let wider = 1.0 / ((step_rad / 2.0).cos() * (PI / SIDES as f64).cos());
    std::array::from_fn(|corner| {
        let (sin, cos) = (corner as f64 / SIDES as f64 * TAU).sin_cos();
        Vector3::new(wider * sin_polar * cos, wider * sin_polar * sin, -cos_polar)
    })
}

/// Corners of the polygon around the section at `along_m` from the lower end; its sides touch the circle.
fn ring(frustum: &Frustum, along_m: f64) -> [Point3<f64>; SIDES] {
    let axis = frustum.axis.into_inner();
    let other = if axis.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let across = axis.cross(&other).normalize();
    let along = axis.cross(&across);
    let center = frustum.center(along_m);
    let radius_m = frustum.radius_m(along_m) / (PI / SIDES as f64).cos();
    std::array::from_fn(|corner| {
        let (sin, cos) = (corner as f64 / SIDES as f64 * TAU).sin_cos();
        center + radius_m * (cos * across + sin * along)
    })
}

/// Which share of a straight change from `a` to `b` lies within [low, high].
fn clip(a: f64, b: f64, low: f64, high: f64) -> Option<(f64, f64)> {
    let change = b - a;
    if change == 0.0 {
        return (low..=high).contains(&a).then_some((0.0, 1.0));
    }
    let (one, other) = ((low - a) / change, (high - a) / change);
    let (from, to) = (one.min(other).max(0.0), one.max(other).min(1.0));
    (from <= to).then_some((from, to))
}

/// Convex hull in order around (Andrew's monotone chain); one or two points for a degenerate outline.
fn hull(mut points: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |ordered: &mut dyn Iterator<Item = Point2<f64>>| {
        let mut chain: Vec<Point2<f64>> = Vec::new();
        for point in ordered {
            while let [.., before, last] = chain.as_slice()
                && (last - before).perp(&(point - last)) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut outline = half(&mut points.iter().copied());
    outline.extend(half(&mut points.iter().rev().copied()));
    outline
}

/// Least and greatest x of a convex outline within a band of y.
fn extent(outline: &[Point2<f64>], low: f64, high: f64) -> Option<(f64, f64)> {
    let mut found: Option<(f64, f64)> = None;
    for (index, a) in outline.iter().enumerate() {
        let b = &outline[(index + 1) % outline.len()];
        if let Some((from, to)) = clip(a.y, b.y, low, high) {
            for share in [from, to] {
                let x = a.x + (b.x - a.x) * share;
                let (left, right) = found.unwrap_or((x, x));
                found = Some((left.min(x), right.max(x)));
            }
        }
    }
    found
}
