//! Grass and weeds: a turbid layer of uneven height on the ground.

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
    /// Patches from the streams `world/grass` and `world/weeds`, on the terrain's own lattice.
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
        if spec.weed_height_m > 0.0 && spec.weed_cover_ratio > 0.0 {
            let patch_m = spec.weed_patch_m.max(2.0 * terrain.cell_m);
            let field = waves::field(seed.stream("world/weeds"), 1.0, patch_m, &places, &places);
            for (height, weed_m) in heights.cells_mut().iter_mut().zip(weeds(spec, &field)) {
                *height = height.max(weed_m);
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

    /// Height of grass or weeds above the ground at a place, meters.
    pub fn height_m(&self, x: f64, y: f64) -> f64 {
        surface::height(&self.heights, x, y)
    }

    /// The tallest grass or weed anywhere, meters; 0 when there is none.
    pub fn height_m_max(&self) -> f64 {
        self.height_m_max
    }

    /// Heights above the ground at the nodes, meters; the same lattice as the terrain's.
    pub fn grid(&self) -> &Grid<f64> {
        &self.heights
    }
}

/// Heights of weeds, meters: the share of places where the field is highest is covered, tallest at the patches' middles.
fn weeds<'a>(spec: &'a GrassSpec, field: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    let mut order: Vec<f64> = field.to_vec();
    order.sort_unstable_by(f64::total_cmp);
    let bare = ((1.0 - spec.weed_cover_ratio) * order.len() as f64) as usize;
    let (low, high) = (order.get(bare).copied(), order.last().copied());
    field.iter().map(move |value| match (low, high) {
        // Weeds begin at a third of their height: a patch has an edge.
        (Some(low), Some(high)) if *value >= low && high > low => {
            spec.weed_height_m * (1.0 + 2.0 * (value - low) / (high - low)) / 3.0
        }
        _ => 0.0,
    })
}
