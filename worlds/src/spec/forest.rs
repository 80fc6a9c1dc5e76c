//! What a scenario may say about a forest.

use super::plants::{CrownSpec, LeavesSpec, PLANTS_MAX, TrunkSpec, numbered};
use super::table::{read_over_defaults, table};
use super::{SpecError, at_most, within};
use crate::crown::CrownShape;
use crate::leaf_angle::LeafAngle;
use crate::season::{Foliage, Season};

table! {
/// Scattered trees with high crowns, undergrowth between them, and a trail that is kept clear.
pub struct ForestSpec read as ForestText {
    /// The time of the year.
    pub season: Season,
    /// Leaves or a turbid medium.
    pub foliage: Foliage,
    /// Where trees and bushes stand, and where none does.
    pub stand: StandSpec,
    /// Trunks of broadleaf trees and conifers alike.
    pub trunk: TrunkSpec,
    /// Crowns of broadleaf trees.
    pub crown: CrownSpec,
    /// Crowns of conifers.
    pub conifer: CrownSpec,
    /// Bushes.
    pub undergrowth: UndergrowthSpec,
    /// Leaves, and clusters of needles.
    pub leaves: LeavesSpec,
}
}
read_over_defaults!(ForestSpec, ForestText);

table! {
/// A rectangle of forest and a trail through it.
pub struct StandSpec read as StandText {
    /// How many trees; those that find no room within their tries are left out.
    pub trees: usize,
    /// Share of conifers.
    pub conifer_ratio: f64,
    /// Least distance between two trunks, meters.
    pub spacing_m_min: f64,
    /// Side of the rectangle along x, meters.
    pub length_m: f64,
    /// Side of the rectangle along y, meters.
    pub width_m: f64,
    /// Middle of the rectangle, world frame, meters.
    pub x_m: f64,
    /// See `x_m`.
    pub y_m: f64,
    /// Corners of the trail, world frame, meters; repeat the first to close it.
    pub trail_m: Vec<[f64; 2]>,
    /// No trunk's middle and no bush's edge is nearer to the trail, meters.
    pub trail_clearance_m: f64,
}
}

table! {
/// Bushes under the trees.
pub struct UndergrowthSpec read as UndergrowthText {
    /// How many.
    pub bushes: usize,
    /// Mean height, and mean width, meters.
    pub height_m: f64,
    /// Every bush's size differs from the mean by up to this share.
    pub size_variation_ratio: f64,
    /// Mean side of a leaf, meters.
    pub leaf_size_m: f64,
    /// One-sided leaf area per volume of the outline, m2/m3.
    pub leaf_area_per_m: f64,
}
}

impl Default for ForestSpec {
    fn default() -> Self {
        ForestSpec {
            season: Season::Full,
            foliage: Foliage::Leaves,
            stand: StandSpec {
                trees: 150,         // assumed: 620 stems per hectare, a managed mixed stand
                conifer_ratio: 0.3, // assumed
                spacing_m_min: 1.8, // assumed
                length_m: 56.0,     // assumed
                width_m: 43.0,      // assumed
                x_m: 16.0,          // assumed: around the trail
                y_m: 11.0,          // assumed
                trail_m: TRAIL_M.to_vec(),
                trail_clearance_m: 1.0, // assumed: a footpath
            },
            trunk: TrunkSpec {
                radius_m: 0.14,              // assumed: 28 cm through
                radius_variation_ratio: 0.4, // assumed: uneven-aged
                height_m: 5.5,               // assumed: stems clean up to the crown
                lean_deg: 2.0,               // assumed
                reflectivity_ratio: 0.38,    // Helios spectral library: generic bark 0.316-0.45
            },
            crown: CrownSpec {
                shape: CrownShape::Ellipsoid,
                base_m: 4.5,                // assumed: high crowns, trunks are what a lidar sees
                height_m: 14.0,             // assumed
                length_m: 5.0,              // assumed
                width_m: 5.0,               // assumed
                size_variation_ratio: 0.2,  // assumed
                form_variation_ratio: 0.15, // assumed
                limbs: 6,                   // assumed
                clumps: 48,                 // assumed
                clump_ratio: 0.25,          // assumed
                hollow_ratio: 0.6,          // assumed: leaves are at the light
            },
            conifer: CrownSpec {
                shape: CrownShape::Cone,
                base_m: 2.5,                // assumed: dead lower branches have fallen
                height_m: 15.0,             // assumed
                length_m: 3.6,              // assumed
                width_m: 3.6,               // assumed
                size_variation_ratio: 0.2,  // assumed
                form_variation_ratio: 0.15, // assumed
                limbs: 1,                   // assumed: sways as one
                clumps: 70,                 // assumed
                clump_ratio: 0.12,          // assumed: flat whorls
                hollow_ratio: 0.3,          // assumed
            },
            undergrowth: UndergrowthSpec {
                bushes: 90,                // assumed
                height_m: 0.8,             // assumed
                size_variation_ratio: 0.4, // assumed
                leaf_size_m: 0.05,         // assumed
                leaf_area_per_m: 2.0,      // assumed
            },
            leaves: LeavesSpec {
                size_m: 0.09,                 // assumed: oak and beech leaves, clusters of needles
                area_per_m: 0.8,              // assumed: a leaf area index near 4 at full cover
                angle: LeafAngle::Planophile, // assumed: broad leaves lie toward the light
                reflectivity_ratio: 0.5,      // JHU library: deciduous canopy 0.554, conifer 0.515
            },
        }
    }
}

/// A loop of 89 m, assumed.
const TRAIL_M: [[f64; 2]; 9] = [
    [0.0, 0.0],
    [12.0, 0.0],
    [22.0, 3.0],
    [32.0, 8.0],
    [33.0, 16.0],
    [24.0, 22.0],
    [12.0, 20.0],
    [3.0, 10.0],
    [0.0, 0.0],
];

impl ForestSpec {
    /// Whether every value is finite and in its range.
    pub fn check(&self) -> Result<(), SpecError> {
        self.stand.check()?;
        self.crown.check("planting.crown")?;
        self.trunk.check(&self.crown.crown(self.season))?;
        self.conifer.check("planting.conifer")?;
        self.undergrowth.check()?;
        self.leaves.check(&self.crown.crown(Season::Full))?;
        self.leaves.check(&self.conifer.crown(Season::Full))
    }
}

impl StandSpec {
    fn check(&self) -> Result<(), SpecError> {
        let table = "planting.stand";
        let at = |key, value, low, high| within(table, key, value, low, high);
        at_most(table, "trees", self.trees, PLANTS_MAX)?;
        at("conifer_ratio", self.conifer_ratio, 0.0, 1.0)?;
        at("spacing_m_min", self.spacing_m_min, 0.0, 50.0)?;
        at("length_m", self.length_m, 1.0, 1000.0)?;
        at("width_m", self.width_m, 1.0, 1000.0)?;
        at("x_m", self.x_m, -1000.0, 1000.0)?;
        at("y_m", self.y_m, -1000.0, 1000.0)?;
        for (index, [x, y]) in self.trail_m.iter().enumerate() {
            within(table, &format!("trail_m[{index}].x"), *x, -1000.0, 1000.0)?;
            within(table, &format!("trail_m[{index}].y"), *y, -1000.0, 1000.0)?;
        }
        at("trail_clearance_m", self.trail_clearance_m, 0.0, 50.0)
    }
}

impl UndergrowthSpec {
    /// A bush's crown: from the ground up, as wide as high.
    pub(crate) fn crown(&self) -> CrownSpec {
        CrownSpec {
            shape: CrownShape::Ellipsoid,
            base_m: 0.0,
            height_m: self.height_m,
            length_m: self.height_m,
            width_m: self.height_m,
            size_variation_ratio: self.size_variation_ratio,
            form_variation_ratio: 0.2,
            limbs: 1,
            clumps: 8,
            clump_ratio: 0.45,
            hollow_ratio: 0.4,
        }
    }

    fn check(&self) -> Result<(), SpecError> {
        let table = "planting.undergrowth";
        let at = |key, value, low, high| within(table, key, value, low, high);
        at_most(table, "bushes", self.bushes, PLANTS_MAX)?;
        at("height_m", self.height_m, 0.1, 5.0)?;
        at("size_variation_ratio", self.size_variation_ratio, 0.0, 0.9)?;
        at("leaf_size_m", self.leaf_size_m, 0.01, 0.5)?;
        at("leaf_area_per_m", self.leaf_area_per_m, 0.0, 20.0)?;
        numbered(
            table,
            "leaf_size_m",
            self.leaf_size_m,
            self.leaf_area_per_m,
            &self.crown().crown(Season::Full),
        )
    }
}
