//! What a scenario may say about an orchard of fruit trees.

use super::SpecError;
use super::plants::{CrownSpec, LeavesSpec, RowsSpec, TrunkSpec};
use super::table::{read_over_defaults, table};
use crate::crown::CrownShape;
use crate::leaf_angle::LeafAngle;
use crate::season::{Foliage, Season};

table! {
/// Vase-shaped fruit trees in rows, trunks in sight, as in Pullally.
pub struct OrchardSpec read as OrchardText {
    /// The time of the year.
    pub season: Season,
    /// Leaves or a turbid medium.
    pub foliage: Foliage,
    /// Where the trees stand.
    pub rows: RowsSpec,
    /// Their trunks.
    pub trunk: TrunkSpec,
    /// Their crowns.
    pub crown: CrownSpec,
    /// Their leaves.
    pub leaves: LeavesSpec,
}
}
read_over_defaults!(OrchardSpec, OrchardText);

impl Default for OrchardSpec {
    fn default() -> Self {
        OrchardSpec {
            season: Season::Full,
            foliage: Foliage::Leaves,
            rows: RowsSpec {
                count: 5,             // Pullally: the released scans span 16.2 m across, four alleys
                plants: 10,           // Pullally: and 32.7 m along
                spacing_m: 4.5,       // Pullally: peaks of the scans' map at 4.4 and 8.9 m
                plant_spacing_m: 3.2, // Pullally: peaks at 3.2, 6.4 and 9.8 m
                jitter_m: 0.15,       // assumed
                missing_ratio: 0.05,  // assumed
                x_m: 1.2,             // assumed: the walk begins at the rows' end
                y_m: -2.25,           // the first alley's middle is the x axis
                bearing_deg: 0.0,
            },
            trunk: TrunkSpec {
                radius_m: 0.06,              // assumed: a young walnut's is 0.15 m (Helios), an apple's 0.04 m
                radius_variation_ratio: 0.3, // assumed: mixed fruit
                height_m: 0.7,               // assumed: headed at knee to hip height
                lean_deg: 3.0,               // assumed
                reflectivity_ratio: 0.32,    // Helios spectral library: almond trunk 0.314
            },
            crown: CrownSpec {
                shape: CrownShape::Ellipsoid,
                base_m: 0.6,                // assumed: trunks in sight at lidar height
                height_m: 3.1,              // J. Imaging 2025, 11(1):5: apple 3.13 m
                length_m: 2.6,              // assumed: just apart at a tree spacing of 3.2 m
                width_m: 2.6,               // assumed: leaves a 2 m alley
                size_variation_ratio: 0.2,  // assumed: mixed fruit
                form_variation_ratio: 0.15, // assumed: mixed fruit
                limbs: 5,                   // assumed: a vase of five scaffolds
                clumps: 36,                 // assumed
                clump_ratio: 0.3,           // assumed
                hollow_ratio: 0.6,          // assumed: a vase is open in its middle
            },
            leaves: LeavesSpec {
                size_m: 0.06,                // assumed: apple, plum and peach leaves
                area_per_m: 1.5,             // J. Imaging 2025, 11(1):5: apple about 1.5 m2/m3
                angle: LeafAngle::Spherical, // assumed
                reflectivity_ratio: 0.5,     // Helios spectral library: almond 0.483-0.512
            },
        }
    }
}

impl OrchardSpec {
    /// Whether every value is finite and in its range.
    pub fn check(&self) -> Result<(), SpecError> {
        self.rows.check()?;
        self.crown.check("planting.crown")?;
        self.trunk.check(&self.crown.crown(self.season))?;
        self.leaves.check(&self.crown.crown(Season::Full))
    }
}
