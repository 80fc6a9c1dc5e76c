//! What a scenario may say about the ground and the grass on it.

use super::{SpecError, error, within};
use serde::{Deserialize, Serialize};

/// Most nodes along one side of the height grid: 8 million nodes are 64 MB.
const NODES_MAX: f64 = 2800.0;

/// Ground relief: a slope, undulation, bumps, furrows and clods. The ground is at height 0 at the world's origin.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct TerrainSpec {
    /// Half the side of the square around the origin, meters; outside, the border's height goes on.
    pub extent_m: f64,
    /// Side of a cell of the height grid, meters.
    pub cell_m: f64,
    /// Standard deviation of the undulation's height, meters.
    pub relief_m: f64,
    /// Wavelength of the undulation, meters.
    pub relief_wavelength_m: f64,
    /// Standard deviation of the bumps' height, meters.
    pub bump_m: f64,
    /// Wavelength of the bumps, meters.
    pub bump_wavelength_m: f64,
    /// Standard deviation of clods and pebbles, each node's own, meters.
    pub roughness_m: f64,
    /// Depth of furrows from crest to trough, meters; 0 for none.
    pub furrow_depth_m: f64,
    /// From furrow to furrow, meters.
    pub furrow_spacing_m: f64,
    /// Bearing along which furrows run, degrees counter-clockwise from east.
    pub furrow_bearing_deg: f64,
    /// Steepness of the plane under it all, degrees.
    pub slope_deg: f64,
    /// Bearing in which that plane falls, degrees counter-clockwise from east.
    pub slope_toward_deg: f64,
    /// Reflectance of bare soil near 905 nm.
    pub soil_reflectivity_ratio: f64,
}

impl Default for TerrainSpec {
    fn default() -> Self {
        TerrainSpec {
            extent_m: 60.0,                // assumed: twice the far trees' distance
            cell_m: 0.25,                  // assumed: ten nodes on a bump
            relief_m: 0.08,                // assumed: mild form of +-0.2 m over 20-50 m
            relief_wavelength_m: 30.0,     // assumed: within the 20-50 m of an orchard floor
            bump_m: 0.012,                 // assumed: a few cm crest to trough; the paper says uneven
            bump_wavelength_m: 2.5,        // assumed: within 1-4 m
            roughness_m: 0.0,              // assumed: turf, not tilled soil
            furrow_depth_m: 0.0,           // assumed: not plowed
            furrow_spacing_m: 1.0,         // assumed: beds of a meter
            furrow_bearing_deg: 0.0,       // assumed: along rows that run east
            slope_deg: 0.0,                // assumed: a level field
            slope_toward_deg: 0.0,         // assumed: no meaning while level
            soil_reflectivity_ratio: 0.25, // Helios spectral library: soil 0.219-0.291
        }
    }
}

impl TerrainSpec {
    /// Whether every value is finite and in its range.
    pub fn check(&self) -> Result<(), SpecError> {
        let at = |key, value, low, high| within("terrain", key, value, low, high);
        at("extent_m", self.extent_m, 1.0, 1000.0)?;
        at("cell_m", self.cell_m, 0.02, 5.0)?;
        let nodes = 2.0 * self.extent_m / self.cell_m;
        let finest_m = 2.0 * self.extent_m / NODES_MAX;
        if nodes > NODES_MAX {
            return Err(error(
                "terrain",
                "cell_m",
                self.cell_m,
                format!("at least {finest_m:.3} for this extent_m"),
            ));
        }
        at("relief_m", self.relief_m, 0.0, 10.0)?;
        at("relief_wavelength_m", self.relief_wavelength_m, 2.0 * self.cell_m, 1000.0)?;
        at("bump_m", self.bump_m, 0.0, 1.0)?;
        at("bump_wavelength_m", self.bump_wavelength_m, 2.0 * self.cell_m, 1000.0)?;
        at("roughness_m", self.roughness_m, 0.0, 0.2)?;
        at("furrow_depth_m", self.furrow_depth_m, 0.0, 1.0)?;
        // A wave of fewer than four cells has lost its shape.
        let furrow_m_min = if self.furrow_depth_m > 0.0 { 4.0 * self.cell_m } else { 0.01 };
        at("furrow_spacing_m", self.furrow_spacing_m, furrow_m_min, 100.0)?;
        at("furrow_bearing_deg", self.furrow_bearing_deg, -360.0, 360.0)?;
        at("slope_deg", self.slope_deg, 0.0, 45.0)?;
        at("slope_toward_deg", self.slope_toward_deg, -360.0, 360.0)?;
        at("soil_reflectivity_ratio", self.soil_reflectivity_ratio, 0.0, 1.0)
    }
}

/// Grass as a turbid layer above the ground: a beam survives `d` meters of it with probability `exp(-density d)`.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct GrassSpec {
    /// Mean height, meters; 0 for no grass.
    pub height_m: f64,
    /// Extinction coefficient of the layer, 1/m.
    pub density_per_m: f64,
    /// Standard deviation of the local height as a share of the mean.
    pub height_variation_ratio: f64,
    /// Size of taller and lower patches, meters.
    pub patch_m: f64,
    /// Height of the tallest weeds, meters; 0 for none. They stand in patches, as a layer of the same density.
    pub weed_height_m: f64,
    /// Share of the ground that weeds cover.
    pub weed_cover_ratio: f64,
    /// Distance between patches of weeds, meters.
    pub weed_patch_m: f64,
    /// Reflectance near 905 nm.
    pub reflectivity_ratio: f64,
}

impl Default for GrassSpec {
    fn default() -> Self {
        GrassSpec {
            height_m: 0.05,              // assumed: a mown field; the paper says grassy
            density_per_m: 8.0,          // assumed: a grazing beam dies within a few decimeters
            height_variation_ratio: 0.3, // assumed: tufts
            patch_m: 0.8,                // assumed: tufts
            weed_height_m: 0.0,          // assumed: a tended field
            weed_cover_ratio: 0.15,      // assumed
            weed_patch_m: 2.5,           // assumed
            reflectivity_ratio: 0.508,   // HELIOS++ spectral library: green grass at 0.90 um
        }
    }
}

impl GrassSpec {
    /// Whether every value is finite and in its range.
    pub fn check(&self) -> Result<(), SpecError> {
        let at = |key, value, low, high| within("grass", key, value, low, high);
        at("height_m", self.height_m, 0.0, 3.0)?;
        at("density_per_m", self.density_per_m, 0.0, 1000.0)?;
        at("height_variation_ratio", self.height_variation_ratio, 0.0, 1.0)?;
        at("patch_m", self.patch_m, 0.1, 100.0)?;
        at("weed_height_m", self.weed_height_m, 0.0, 3.0)?;
        at("weed_cover_ratio", self.weed_cover_ratio, 0.0, 1.0)?;
        at("weed_patch_m", self.weed_patch_m, 0.1, 100.0)?;
        at("reflectivity_ratio", self.reflectivity_ratio, 0.0, 1.0)
    }
}
