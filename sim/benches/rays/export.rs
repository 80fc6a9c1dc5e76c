//! A scene, its rays and our hits as plain little-endian arrays, for any other engine.

use super::scene::{Orchard, Size};
use arborloop_sim::optics::{Hit, Ray};
use std::io::{Result, Write};
use std::path::Path;

/// Vertices and triangles of a mesh.
pub(crate) type Mesh = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// The soil, world frame.
pub(crate) fn soil(orchard: &Orchard) -> Mesh {
    let grid = orchard.world.terrain.grid();
    let (columns, rows) = (grid.columns(), grid.rows());
    let vertices = (0..rows * columns).map(|index| {
        let place = grid.center_of(index % columns, index / columns);
        [place.x as f32, place.y as f32, grid.cells()[index] as f32]
    });
    let cells = (0..rows - 1).flat_map(|row| (0..columns - 1).map(move |column| row * columns + column));
    let triangles = cells.flat_map(|low| {
        let [a, b, c, d] = [low, low + 1, low + columns + 1, low + columns].map(|node| node as u32);
        [[a, b, c], [a, c, d]]
    });
    (vertices.collect(), triangles.collect())
}

/// A prototype, plant frame: four vertices and two triangles a leaf.
pub(crate) fn tree(orchard: &Orchard, prototype: usize) -> Mesh {
    let leaves = &orchard.world.prototypes[prototype].leaves;
    let vertices =
        leaves.iter().flat_map(|leaf| leaf.corners().map(|p| [p.x as f32, p.y as f32, p.z as f32]));
    let triangles = (0..leaves.len() as u32)
        .flat_map(|leaf| [[4 * leaf, 4 * leaf + 1, 4 * leaf + 2], [4 * leaf, 4 * leaf + 2, 4 * leaf + 3]]);
    (vertices.collect(), triangles.collect())
}

/// Writes the files that the README in the folder lists.
pub(crate) fn write(
    folder: &Path,
    size: Size,
    orchard: &Orchard,
    rays: &[Ray],
    hits: &[Option<Hit>],
) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    let floats = |name: &str, values: &mut dyn Iterator<Item = f32>| -> Result<()> {
        let mut file = std::io::BufWriter::new(std::fs::File::create(folder.join(name))?);
        for value in values {
            file.write_all(&value.to_le_bytes())?;
        }
        file.flush()
    };
    let numbers = |name: &str, values: &mut dyn Iterator<Item = u32>| -> Result<()> {
        let mut file = std::io::BufWriter::new(std::fs::File::create(folder.join(name))?);
        for value in values {
            file.write_all(&value.to_le_bytes())?;
        }
        file.flush()
    };
    let mesh = |name: &str, (vertices, triangles): Mesh| -> Result<()> {
        floats(&format!("{name}_vertices.f32"), &mut vertices.into_iter().flatten())?;
        numbers(&format!("{name}_triangles.u32"), &mut triangles.into_iter().flatten())
    };
    mesh("soil", soil(orchard))?;
    for prototype in 0..orchard.world.prototypes.len() {
        mesh(&format!("prototype{prototype}"), tree(orchard, prototype))?;
    }
    let plants = &orchard.world.plants;
    numbers("plant_prototype.u32", &mut plants.iter().map(|plant| plant.prototype as u32))?;
    let rows = plants.iter().flat_map(|plant| {
        let map = plant.world_from_plant.to_homogeneous();
        (0..12).map(move |n| map[(n / 4, n % 4)] as f32)
    });
    floats("plant_world_from_plant.f32", &mut rows.into_iter())?;
    let beams = rays.iter().flat_map(|ray| {
        let (o, d) = (ray.origin, ray.direction);
        [o.x, o.y, o.z, d.x, d.y, d.z, ray.range_m_max].map(|x| x as f32)
    });
    floats("rays.f32", &mut beams.into_iter())?;
    let ranges = hits.iter().map(|hit| hit.map_or(f32::INFINITY, |hit| hit.range_m as f32));
    floats("ranges.f32", &mut ranges.into_iter())?;
    std::fs::write(folder.join("README"), readme(size, orchard, rays.len()))
}

fn readme(size: Size, orchard: &Orchard, rays: usize) -> String {
    format!(
        "Scene {}: {} trees of {} leaves on soil, {} triangles; {rays} rays.\n\
         \n\
         Little-endian, no header. Meters; the world's z is up.\n\
         \n\
         soil_vertices.f32            n x 3, world frame\n\
         soil_triangles.u32           n x 3, indices of vertices\n\
         prototypeK_vertices.f32      n x 3, plant frame; K from 0 to {}\n\
         prototypeK_triangles.u32     n x 3; triangles 2 j and 2 j + 1 are leaf j\n\
         plant_prototype.u32          n, which prototype stands there\n\
         plant_world_from_plant.f32   n x 3 x 4, row by row: rotation, scale and place\n\
         rays.f32                     n x 7: origin, unit direction, greatest range. Each sixteen from a multiple of\n\
         \x20                            sixteen on are neighboring azimuths of one laser, with one origin\n\
         ranges.f32                   n, what arborloop finds; infinite where nothing is met\n",
        size.name,
        size.trees,
        size.leaves,
        orchard.triangles(),
        orchard.world.prototypes.len() - 1,
    )
}
