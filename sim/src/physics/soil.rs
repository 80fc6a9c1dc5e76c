//! The ground as the engine's height field: exactly the terrain's triangles.
//!
//! One collider holds all of it: the engine finds the cells under a foot by division, and in double precision a wide
//! ground loses nothing.

use crate::axes::to_engine;
use arborloop_base::Pose;
use arborloop_worlds::Terrain;
use nalgebra::{UnitQuaternion, Vector3};
use rapier3d_f64::parry::utils::Array2;
use rapier3d_f64::prelude::{ColliderBuilder, Vector};
use std::f64::consts::FRAC_PI_2;

/// A collider with the terrain's surface, in world coordinates.
pub(crate) fn collider(terrain: &Terrain) -> ColliderBuilder {
    let grid = terrain.grid();
    let (columns, rows) = (grid.columns(), grid.rows());
    // The engine's field lies in its own x-z plane, y up. Turned upright its z points along -y, so that its first row
    // is ours with the greatest y; its squares are then cut from (column, row) to (column + 1, row + 1), as ours are.
    let heights = Array2::from_fn(rows, columns, |row, column| {
        grid.get(column, rows - 1 - row).copied().unwrap_or_default()
    });
    let bounds = terrain.bounds();
    let size = bounds.high - bounds.low;
    let middle = nalgebra::center(&bounds.low, &bounds.high);
    let world_from_field = Pose::from_parts(
        Vector3::new(middle.x, middle.y, 0.0).into(),
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2),
    );
    ColliderBuilder::heightfield(heights, Vector::new(size.x, 1.0, size.y))
        .position(to_engine(&world_from_field))
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;
    use arborloop_worlds::{TerrainSpec, WorldSpec, build};

    #[test]
    fn the_engine_stands_on_exactly_the_terrain_s_triangles() {
        let terrain = TerrainSpec {
            extent_m: 3.0,
            bump_m: 0.05,
            relief_m: 0.2,
            slope_deg: 7.0,
            ..TerrainSpec::default()
        };
        let world = build(&WorldSpec { terrain, ..WorldSpec::default() }, Seed(3));
        let field = collider(&world.terrain).build();
        let shape = field.shape().as_heightfield().unwrap();
        for triangle in shape.triangles() {
            let corners = [triangle.a, triangle.b, triangle.c].map(|corner| *field.position() * corner);
            // Corners and the middle: were a square cut along its other diagonal, its middle would be off.
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            for point in corners.into_iter().chain([middle]) {
                let wanted = world.terrain.height_m(point.x, point.y);
                assert!((point.z - wanted).abs() < 1e-9, "{point:?} against {wanted}");
            }
        }
    }
}
