//! What a scenario may say about a citrus grove.

use super::SpecError;
use super::plants::{CrownSpec, LeavesSpec, RowsSpec, TrunkSpec};
use super::table::{read_over_defaults, table};
use crate::crown::CrownShape;
use crate::leaf_angle::LeafAngle;
use crate::season::{Foliage, Season};

table! {
/// Hedged citrus skirted to the ground, as in field 2 of CitrusFarm: foliage is the landmark, no trunk is seen.
pub struct CitrusSpec read as CitrusText {
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
read_over_defaults!(CitrusSpec, CitrusText);

impl Default for CitrusSpec {
    fn default() -> Self {
        CitrusSpec {
            season: Season::Full, // citrus is evergreen
            foliage: Foliage::Leaves,
            rows: RowsSpec {
                count: 9,             // assumed: eight alleys of 102.5 m make the paper's 865 m
                plants: 22,           // assumed: same
                spacing_m: 6.5,       // CitrusFarm field 2, measured from its trajectory figure, +-5 %
                plant_spacing_m: 4.5, // same
                jitter_m: 0.15,       // assumed: planted by machine, grown by hand
                missing_ratio: 0.02,  // assumed
                x_m: 4.0,             // assumed: a headland before the first trees
                y_m: -3.25,           // the first alley's middle is the x axis
                bearing_deg: 0.0,
            },
            trunk: TrunkSpec {
                radius_m: 0.09,              // assumed: grown orange trees, 15-20 cm through
                radius_variation_ratio: 0.2, // assumed
                height_m: 0.5,               // assumed: budded low
                lean_deg: 2.0,               // assumed
                reflectivity_ratio: 0.38,    // Helios spectral library: generic bark 0.316-0.45
            },
            crown: CrownSpec {
                shape: CrownShape::Box,     // hedged
                base_m: 0.0,                // photos of CitrusFarm: skirted to the ground
                height_m: 3.2,              // assumed: hedged for picking
                length_m: 4.2,              // assumed: nearly closed at a tree spacing of 4.5 m
                width_m: 3.4,               // assumed: leaves a 3 m alley
                size_variation_ratio: 0.1,  // assumed
                form_variation_ratio: 0.05, // assumed: hedged
                limbs: 6,                   // assumed
                clumps: 110,                // assumed: a bumpy wall, closed down to the ground
                clump_ratio: 0.26,          // assumed
                hollow_ratio: 0.8,          // dense outer shell (sensors, plants and sites facts, 7.6)
            },
            leaves: LeavesSpec {
                size_m: 0.07, // assumed: the area of a leaf of 10 cm x 5 cm
                // facts, 7.6: 3-6 m2/m3, from memory. Half the ground's LAI is then 2.7; Florida oranges have 1.6-2.1.
                area_per_m: 3.5,
                angle: LeafAngle::Spherical, // assumed
                reflectivity_ratio: 0.5, // no citrus spectrum found: grape and almond 0.48-0.52 (Helios library)
            },
        }
    }
}

impl CitrusSpec {
    /// Whether every value is finite and in its range.
    pub fn check(&self) -> Result<(), SpecError> {
        self.rows.check()?;
        self.crown.check("planting.crown")?;
        self.trunk.check(&self.crown.crown(self.season))?;
        self.leaves.check(&self.crown.crown(Season::Full))
    }
}
