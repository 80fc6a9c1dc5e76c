//! What a scenario may say about the trees and bushes far around.

use super::{COUNT_MAX, LEAVES_MAX, SpecError, at_most, error, within};
use serde::{Deserialize, Serialize};

/// Trees and bushes in a ring around the planting.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct SurroundingsSpec {
    /// How many trees.
    pub trees: usize,
    /// How many bushes.
    pub bushes: usize,
    /// Least distance from the planting's center, or from its outermost plants where it has any, meters.
    pub distance_m_min: f64,
    /// Greatest distance, counted alike, meters.
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
        let crown_m3 = crate::crown::Crown::of_tree(self.tree_height_m).volume_m3();
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
