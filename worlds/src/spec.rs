//! What a scenario may say about its world: plain values with units in their names, defaults with their source, limits.

use crate::wind::WindSpec;
use serde::{Deserialize, Serialize};

/// The world of a scenario.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq, Default)]
#[serde(deny_unknown_fields, default)]
pub struct WorldSpec {
    /// The ground.
    pub terrain: TerrainSpec,
    /// The grass on it.
    pub grass: GrassSpec,
    /// What the robot walks among.
    pub planting: Planting,
    /// The ring of trees and bushes far around.
    pub surroundings: SurroundingsSpec,
    /// What moves the leaves.
    pub wind: WindSpec,
}

/// Ground relief: a slope, undulation and bumps. The ground is at height 0 at the world's origin.
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
    /// Steepness of the plane under it all, degrees.
    pub slope_deg: f64,
    /// Bearing in which that plane falls, degrees counter-clockwise from east.
    pub slope_toward_deg: f64,
    /// Reflectance of bare soil near 905 nm.
    pub soil_reflectivity_ratio: f64,
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
    /// Reflectance near 905 nm.
    pub reflectivity_ratio: f64,
}

/// What the robot walks among.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(tag = "kind", rename_all = "snake_case", from = "PlantingText")]
pub enum Planting {
    /// Traffic cones around a walked rectangle, the paper's controlled experiment.
    Cones(ConesSpec),
    /// Nothing.
    None,
}

/// [`Planting`] as read: serde lets a unit variant pass with any keys beside its tag, an empty struct refuses them.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum PlantingText {
    Cones(ConesSpec),
    None {},
}

impl From<PlantingText> for Planting {
    fn from(text: PlantingText) -> Self {
        match text {
            PlantingText::Cones(field) => Planting::Cones(field),
            PlantingText::None {} => Planting::None,
        }
    }
}

/// Traffic cones around a walked rectangle that goes from (0, 0) to (length, width).
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct ConesSpec {
    /// Side of the walked rectangle along x, meters.
    pub length_m: f64,
    /// Side of the walked rectangle along y, meters.
    pub width_m: f64,
    /// Distance from the rectangle to the ring of cones outside it, meters.
    pub clearance_m: f64,
    /// How many cones; 0 for none.
    pub count: usize,
    /// Height of a cone over all, meters.
    pub height_m: f64,
    /// Radius of a cone's body above its plate, meters.
    pub base_radius_m: f64,
    /// Radius of a cone's tip, meters.
    pub top_radius_m: f64,
    /// Radius of the base plate, meters.
    pub plate_radius_m: f64,
    /// Thickness of the base plate, meters.
    pub plate_height_m: f64,
    /// Each cone stands up to this far from its place on the ring, along both axes, meters.
    pub jitter_m: f64,
    /// Unevenness of the spacing: each cone moves up to this share of the mean spacing along the ring.
    pub spacing_variation_ratio: f64,
    /// Reflectance of the body near 905 nm.
    pub reflectivity_ratio: f64,
    /// Reflectance of the collar band; above 1 is retro-reflective. 0 for a cone without a collar.
    pub collar_reflectivity_ratio: f64,
}

/// Trees and bushes in a ring around the planting.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct SurroundingsSpec {
    /// How many trees.
    pub trees: usize,
    /// How many bushes.
    pub bushes: usize,
    /// Least distance from the planting's center, meters.
    pub distance_m_min: f64,
    /// Greatest distance from the planting's center, meters.
    pub distance_m_max: f64,
    /// Mean height of a tree, meters.
    pub tree_height_m: f64,
    /// Mean height of a bush, meters.
    pub bush_height_m: f64,
    /// Radius of a tree's trunk at the ground, meters.
    pub trunk_radius_m: f64,
    /// Mean side of a leaf, meters.
    pub leaf_size_m: f64,
    /// One-sided leaf area per crown volume, m2/m3 (leaf area density).
    pub leaf_area_per_m: f64,
    /// Reflectance of a leaf near 905 nm.
    pub leaf_reflectivity_ratio: f64,
    /// Reflectance of bark near 905 nm.
    pub bark_reflectivity_ratio: f64,
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
            slope_deg: 0.0,                // assumed: a level field
            slope_toward_deg: 0.0,         // assumed: no meaning while level
            soil_reflectivity_ratio: 0.25, // Helios spectral library: soil 0.219-0.291
        }
    }
}

impl Default for GrassSpec {
    fn default() -> Self {
        GrassSpec {
            height_m: 0.05,              // assumed: a mown field; the paper says grassy
            density_per_m: 8.0,          // assumed: a grazing beam dies within a few decimeters
            height_variation_ratio: 0.3, // assumed: tufts
            patch_m: 0.8,                // assumed: tufts
            reflectivity_ratio: 0.508,   // HELIOS++ spectral library: green grass at 0.90 um
        }
    }
}

impl Default for Planting {
    fn default() -> Self {
        Planting::Cones(ConesSpec::default())
    }
}

impl Default for ConesSpec {
    fn default() -> Self {
        ConesSpec {
            length_m: 6.0,                  // paper: a 16 m closed path
            width_m: 2.0,                   // paper
            clearance_m: 0.9,               // assumed: room for the follower's cut corners
            count: 12,      // assumed: the SLAM study's twin of the field; the paper gives no number
            height_m: 0.72, // assumed: the SLAM study's twin of the field
            base_radius_m: 0.13, // assumed: usual for a cone of this height
            top_radius_m: 0.03, // assumed: usual for a cone of this height
            plate_radius_m: 0.19, // assumed: disc of the area of a 0.34 m square plate
            plate_height_m: 0.035, // assumed: usual for a cone of this height
            jitter_m: 0.12, // assumed: set down by hand
            spacing_variation_ratio: 0.3, // assumed: paced out, so that the ring has no symmetry
            reflectivity_ratio: 0.6, // assumed: orange plastic is bright in near infrared
            collar_reflectivity_ratio: 2.0, // assumed: retro-reflective, VLP-16 manual p. 32 bytes above 100
        }
    }
}

impl Default for SurroundingsSpec {
    fn default() -> Self {
        SurroundingsSpec {
            trees: 5,                      // assumed: facts of the cone field's twin, 9 far plants
            bushes: 4,                     // assumed: same
            distance_m_min: 12.0,          // assumed: beyond the field
            distance_m_max: 28.0,          // assumed: within the lidar's useful range
            tree_height_m: 4.5,            // assumed: between apple (3.1 m) and olive (4.9 m)
            bush_height_m: 1.6,            // assumed: garden shrubs
            trunk_radius_m: 0.12,          // assumed: between a young walnut's 0.15 m and an apple's
            leaf_size_m: 0.09,             // assumed: 8-10 cm leaves
            leaf_area_per_m: 1.5,          // J. Imaging 2025, 11(1):5: apple about 1.5 m2/m3
            leaf_reflectivity_ratio: 0.5,  // Helios spectral library: grape, almond, walnut 0.46-0.53
            bark_reflectivity_ratio: 0.38, // Helios spectral library: generic bark 0.316-0.45
        }
    }
}

/// A value that no world can be grown from.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{key} is {found}, wanted {wanted}")]
pub struct SpecError {
    /// Dotted path below `[world]`, for instance `terrain.slope_deg`.
    pub key: String,
    /// The value found.
    pub found: String,
    /// What would do.
    pub wanted: String,
}

/// Most nodes along one side of the height grid: 8 million nodes are 64 MB.
const NODES_MAX: f64 = 2800.0;
/// Most leaves that one prototype may have.
const LEAVES_MAX: f64 = 200_000.0;
/// Most objects of one kind.
const COUNT_MAX: usize = 10_000;

impl WorldSpec {
    /// Whether a world can be grown from these values; the first that is not finite or out of range otherwise.
    pub fn check(&self) -> Result<(), SpecError> {
        self.terrain.check()?;
        self.grass.check()?;
        self.planting.check()?;
        self.surroundings.check()?;
        self.wind.check()
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
        at("slope_deg", self.slope_deg, 0.0, 45.0)?;
        at("slope_toward_deg", self.slope_toward_deg, -360.0, 360.0)?;
        at("soil_reflectivity_ratio", self.soil_reflectivity_ratio, 0.0, 1.0)
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
        at("reflectivity_ratio", self.reflectivity_ratio, 0.0, 1.0)
    }
}

impl Planting {
    /// Whether every value is finite and in its range.
    pub fn check(&self) -> Result<(), SpecError> {
        match self {
            Planting::Cones(field) => field.check(),
            Planting::None => Ok(()),
        }
    }
}

impl ConesSpec {
    /// Whether every value is finite and in its range.
    pub fn check(&self) -> Result<(), SpecError> {
        let at = |key, value, low, high| within("planting", key, value, low, high);
        at("length_m", self.length_m, 0.1, 500.0)?;
        at("width_m", self.width_m, 0.1, 500.0)?;
        at("clearance_m", self.clearance_m, 0.0, 50.0)?;
        at_most("planting", "count", self.count, COUNT_MAX)?;
        at("height_m", self.height_m, 0.05, 3.0)?;
        at("base_radius_m", self.base_radius_m, 0.005, 1.0)?;
        at("top_radius_m", self.top_radius_m, 0.0, 1.0)?;
        at("plate_radius_m", self.plate_radius_m, 0.005, 2.0)?;
        at("plate_height_m", self.plate_height_m, 0.001, 0.9 * self.height_m)?;
        at("jitter_m", self.jitter_m, 0.0, 5.0)?;
        at("spacing_variation_ratio", self.spacing_variation_ratio, 0.0, 0.5)?;
        at("reflectivity_ratio", self.reflectivity_ratio, 0.0, 1.0)?;
        at("collar_reflectivity_ratio", self.collar_reflectivity_ratio, 0.0, 100.0)
    }
}

impl SurroundingsSpec {
    /// Whether every value is finite and in its range.
    pub fn check(&self) -> Result<(), SpecError> {
        let at = |key, value, low, high| within("surroundings", key, value, low, high);
        at_most("surroundings", "trees", self.trees, COUNT_MAX)?;
        at_most("surroundings", "bushes", self.bushes, COUNT_MAX)?;
        at("distance_m_min", self.distance_m_min, 0.0, 1000.0)?;
        at("distance_m_max", self.distance_m_max, self.distance_m_min, 1000.0)?;
        at("tree_height_m", self.tree_height_m, 0.5, 50.0)?;
        at("bush_height_m", self.bush_height_m, 0.2, 10.0)?;
        at("trunk_radius_m", self.trunk_radius_m, 0.005, 2.0)?;
        at("leaf_size_m", self.leaf_size_m, 0.01, 0.5)?;
        at("leaf_area_per_m", self.leaf_area_per_m, 0.0, 20.0)?;
        let crown_m3 = crate::tree::Crown::of_tree(self.tree_height_m).volume_m3();
        let leaves = self.leaf_area_per_m * crown_m3 / self.leaf_size_m.powi(2);
        if leaves > LEAVES_MAX {
            let wanted = format!(
                "at least {:.3}, so that a tree has {LEAVES_MAX} leaves or fewer",
                (self.leaf_area_per_m * crown_m3 / LEAVES_MAX).sqrt()
            );
            return Err(error("surroundings", "leaf_size_m", self.leaf_size_m, wanted));
        }
        at("leaf_reflectivity_ratio", self.leaf_reflectivity_ratio, 0.0, 1.0)?;
        at("bark_reflectivity_ratio", self.bark_reflectivity_ratio, 0.0, 1.0)
    }
}

fn error(table: &str, key: &str, found: impl ToString, wanted: String) -> SpecError {
    SpecError { key: format!("{table}.{key}"), found: found.to_string(), wanted }
}

/// A number that is not finite is in no range.
pub(crate) fn within(table: &str, key: &str, value: f64, low: f64, high: f64) -> Result<(), SpecError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(error(table, key, value, format!("a number from {low} to {high}")))
}

fn at_most(table: &str, key: &str, value: usize, most: usize) -> Result<(), SpecError> {
    if value <= most { Ok(()) } else { Err(error(table, key, value, format!("{most} at most"))) }
}
