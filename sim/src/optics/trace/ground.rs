//! The soil as tiles of two by two cells, eight triangles each, made from the heights when a packet comes by.

use super::super::boxes::Aabb;
use super::super::soil::Facet;
use super::lanes::{Isa, Lanes};
use super::node::Child;
use super::patch::{self, Outline};
use super::walk::{Beams, Met, Nearest};
use arborloop_worlds::Terrain;
use nalgebra::Point3;

/// Heights of the soil in single precision, seen from the scene's center.
#[derive(Debug)]
pub(super) struct Soil {
    heights: Vec<f32>,
    columns: usize,
    rows: usize,
    first: [f32; 2],
    step: f32,
}

/// Cells along a tile's side.
const SIDE: usize = 2;

/// Corner, first and second edge of a tile's eight triangles, in cells: each cell's lower right triangle, then its upper
/// left one; cells from the lowest, x first.
const CORNER: [[usize; 8]; 2] = [[0, 0, 1, 1, 0, 0, 1, 1], [0, 0, 0, 0, 1, 1, 1, 1]];
/// The node that a triangle's first edge leads to, from its corner; the second leads to (1, 1) or from it.
const LOWER: [[usize; 2]; 2] = [[1, 0], [1, 1]];
const UPPER: [[usize; 2]; 2] = [[1, 1], [0, 1]];

impl Soil {
    pub(super) fn new(terrain: &Terrain, center: &Point3<f64>) -> Self {
        let grid = terrain.grid();
        let first = grid.center_of(0, 0);
        Soil {
            heights: grid.cells().iter().map(|height| (height - center.z) as f32).collect(),
            columns: grid.columns(),
            rows: grid.rows(),
            first: [(first.x - center.x) as f32, (first.y - center.y) as f32],
            step: grid.resolution_m() as f32,
        }
    }

    /// The tiles' boxes, and each as a child of the kind.
    pub(super) fn tiles(&self, kind: u32) -> (Vec<Aabb>, Vec<Child>) {
        let (across, along) = ((self.columns - 1).div_ceil(SIDE), (self.rows - 1).div_ceil(SIDE));
        let tiles = (0..across * along).map(|tile| {
            let (column, row) = (tile % across * SIDE, tile / across * SIDE);
            let nodes = (0..=SIDE).flat_map(|y| (0..=SIDE).map(move |x| (column + x, row + y)));
            let inside = nodes.filter(|&(column, row)| column < self.columns && row < self.rows);
            let bounds = Aabb::around(inside.map(|(column, row)| {
                let place = [column, row].map(|n| n as f32 * self.step);
                let height = self.heights[row * self.columns + column];
                Point3::new(self.first[0] + place[0], self.first[1] + place[1], height).cast()
            }));
            (bounds, Child::new(kind, row * self.columns + column))
        });
        tiles.unzip()
    }

    /// Offers the crossings with a tile; `node` is its lowest node. Parts are eight times that node plus the triangle.
    #[inline(always)]
    pub(super) fn meet<I: Isa>(&self, node: usize, beams: &Beams<I>, mask: u32, nearest: &mut Nearest<I>) {
        let (column, row) = (node % self.columns, node / self.columns);
        let mut center = [[0.0_f32; 8]; 3];
        let mut u = [[0.0_f32; 8]; 3];
        let mut v = [[0.0_f32; 8]; 3];
        let mut slot = 0;
        while slot < 8 {
            let (x, y) = (CORNER[0][slot], CORNER[1][slot]);
            let edges = if slot & 1 == 0 { LOWER } else { UPPER };
            let corner = node + y * self.columns + x;
            // The last tile of a row may be one cell wide: the missing triangles stay points, which no beam meets.
            if column + x + 1 < self.columns && row + y + 1 < self.rows {
                let height = self.heights[corner];
                center[0][slot] = self.step.mul_add((column + x) as f32, self.first[0]) - beams.origin[0];
                center[1][slot] = self.step.mul_add((row + y) as f32, self.first[1]) - beams.origin[1];
                center[2][slot] = height - beams.origin[2];
                let [[ux, uy], [vx, vy]] = edges;
                u[0][slot] = self.step * ux as f32;
                u[1][slot] = self.step * uy as f32;
                u[2][slot] = self.heights[corner + uy * self.columns + ux] - height;
                v[0][slot] = self.step * vx as f32;
                v[1][slot] = self.step * vy as f32;
                v[2][slot] = self.heights[corner + vy * self.columns + vx] - height;
            }
            slot += 1;
        }
        let center = [I::Half::load(&center[0]), I::Half::load(&center[1]), I::Half::load(&center[2])];
        let u = [I::Half::load(&u[0]), I::Half::load(&u[1]), I::Half::load(&u[2])];
        let v = [I::Half::load(&v[0]), I::Half::load(&v[1]), I::Half::load(&v[2])];
        let met = Met { place: Met::GROUND, part: (node << 3) as u32 };
        let normal = patch::cross::<I>(&u, &v);
        patch::meet::<I>([&center, &u, &v, &normal], Outline::Triangle, beams, mask, met, nearest);
    }

    /// The triangle that a part is.
    #[inline(always)]
    pub(super) fn facet(&self, part: u32) -> Facet {
        let (node, slot) = ((part >> 3) as usize, (part & 7) as usize);
        let cell = [node % self.columns + CORNER[0][slot], node / self.columns + CORNER[1][slot]];
        Facet { cell, upper: slot & 1 == 1 }
    }

    /// Memory, bytes.
    pub(super) fn bytes(&self) -> usize {
        self.heights.capacity() * size_of::<f32>()
    }
}
