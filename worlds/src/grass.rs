//! Grass: a turbid layer of uneven height on the ground.

use crate::spec::{GrassSpec, TerrainSpec};
use crate::{surface, waves};
use arborloop_base::{Grid, Seed};

/// Grass standing on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Grass {
    heights: Grid<f64>,
    height_m_max: f64,
    /// Extinction coefficient of the layer, 1/m: `d` meters of it let `exp(-density_per_m d)` of the light pass.
    pub density_per_m: f64,
    /// Reflectance near 905 nm.
    pub reflectivity_ratio: f64,
}

impl Grass {
    /// Patches from the stream `world/grass`, on the terrain's own lattice.
    pub(crate) fn new(spec: &GrassSpec, terrain: &TerrainSpec, seed: Seed) -> Self {
        let (mut heights, places) = surface::lattice(terrain.extent_m, terrain.cell_m);
        if spec.height_m > 0.0 {
            // A patch narrower than two cells cannot be drawn on this lattice.
            let patch_m = spec.patch_m.max(2.0 * terrain.cell_m);
            let field = waves::field(
                seed.stream("world/grass"),
                spec.height_variation_ratio,
                patch_m,
                &places,
                &places,
            );
            for (height, share) in heights.cells_mut().iter_mut().zip(field) {
                *height = spec.height_m * (1.0 + share).clamp(0.0, 2.0);
            }
        }
        let height_m_max = heights.cells().iter().copied().fold(0.0, f64::max);
        Grass {
            heights,
            height_m_max,
            density_per_m: spec.density_per_m,
            reflectivity_ratio: spec.reflectivity_ratio,
        }
    }

    /// Height of the grass above the ground at a place, meters; between 0 and twice the mean.
    pub fn height_m(&self, x: f64, y: f64) -> f64 {
        surface::height(&self.heights, x, y)
    }

    /// The tallest grass anywhere, meters; 0 when there is none.
    pub fn height_m_max(&self) -> f64 {
        self.height_m_max
    }

    /// Heights above the ground at the nodes, meters; the same lattice as the terrain's.
    pub fn grid(&self) -> &Grid<f64> {
        &self.heights
    }
}
