//! What a scenario may say about a vineyard.

use super::plants::{CrownSpec, LeavesSpec, RowsSpec, TrunkSpec};
use super::table::{read_over_defaults, table};
use super::{SpecError, at_most, error, within};
use crate::crown::CrownShape;
use crate::leaf_angle::LeafAngle;
use crate::season::{Foliage, Season};

table! {
/// Vines on a trellis with vertical shoot positioning, as in Bacchus: posts, wires, thin trunks, a curtain of leaves.
pub struct VineyardSpec read as VineyardText {
    /// The time of the year.
    pub season: Season,
    /// Leaves or a turbid medium.
    pub foliage: Foliage,
    /// Where the vines stand.
    pub rows: RowsSpec,
    /// What holds them.
    pub trellis: TrellisSpec,
    /// Their trunks. They lean, their heads are tied to the wire.
    pub trunk: TrunkSpec,
    /// The curtain: a box along the row. Limbs are the cordon's arms, clumps its shoots' foliage.
    pub crown: CrownSpec,
    /// Their leaves.
    pub leaves: LeavesSpec,
}
}
read_over_defaults!(VineyardSpec, VineyardText);

table! {
/// Posts between the vines, and wires from post to post.
pub struct TrellisSpec read as TrellisText {
    /// Height of the posts above the ground, meters.
    pub post_height_m: f64,
    /// Radius of a post within the row, meters.
    pub post_radius_m: f64,
    /// Radius of the posts at both ends of a row, meters.
    pub end_post_radius_m: f64,
    /// Vines from post to post.
    pub plants_per_post: usize,
    /// Heights of the wires above the ground, meters; a wire holds the cordon, the others the shoots.
    pub wire_heights_m: Vec<f64>,
    /// Radius of a wire, meters.
    pub wire_radius_m: f64,
    /// Reflectance of a post near 905 nm.
    pub post_reflectivity_ratio: f64,
    /// Reflectance of a wire near 905 nm.
    pub wire_reflectivity_ratio: f64,
}
}

impl Default for VineyardSpec {
    fn default() -> Self {
        VineyardSpec {
            season: Season::Full,
            foliage: Foliage::Leaves,
            rows: RowsSpec {
                count: 6,             // assumed: a row beyond those beside the walk on both sides
                plants: 20,           // assumed: three alleys make the paper's 102 m
                spacing_m: 2.5,       // 2-3 m (sensors, plants and sites facts, 7.7; Helios' default 2 m)
                plant_spacing_m: 1.5, // 1-2 m (same)
                jitter_m: 0.04,       // assumed: planted along the wire
                missing_ratio: 0.03,  // assumed
                x_m: 1.95,            // assumed: room to turn before the rows
                y_m: -3.75,           // the second alley's middle is the x axis
                bearing_deg: 0.0,
            },
            trellis: TrellisSpec {
                post_height_m: 1.9,                        // assumed: 2.4 m posts, a fifth in the ground
                post_radius_m: 0.04,                       // assumed: 8 cm round posts
                end_post_radius_m: 0.06,                   // assumed: stouter, they bear the wires' pull
                plants_per_post: 4,                        // assumed: 6 m apart
                wire_heights_m: vec![0.75, 1.1, 1.4, 1.7], // assumed: a cordon wire and three catch wires
                wire_radius_m: 0.00125,                    // assumed: 2.5 mm wire
                post_reflectivity_ratio: 0.6, // Helios spectral library: bare wood 0.673; weathered
                wire_reflectivity_ratio: 0.5, // assumed: galvanized steel
            },
            trunk: TrunkSpec {
                radius_m: 0.025,              // Helios' VSP has 0.05 m; the SLAM study's twin 2.5 cm
                radius_variation_ratio: 0.25, // assumed
                height_m: 0.75,               // Helios' VSP: trunk 0.7 m, cordon 0.9 m
                lean_deg: 4.0,                // assumed
                reflectivity_ratio: 0.38,     // Helios spectral library: generic bark 0.316-0.45
            },
            crown: CrownSpec {
                shape: CrownShape::Box,     // shoots are held between wires
                base_m: 0.72,               // SLAM study's twin: curtain from 0.75 m to 1.8 m
                height_m: 1.85,             // same, and trimmed above the last wire
                length_m: 1.5,              // the vines' spacing: the curtain is closed
                width_m: 0.5,               // 0.4-0.6 m
                size_variation_ratio: 0.04, // assumed: trimmed by machine
                form_variation_ratio: 0.0,  // trimmed
                limbs: 2,                   // two arms of a cordon
                clumps: 12,                 // assumed: a shoot in every 12 cm
                clump_ratio: 0.2,           // assumed
                hollow_ratio: 0.0,          // assumed: no meaning for a curtain
            },
            leaves: LeavesSpec {
                size_m: 0.09,                // SLAM study's twin: leaves of 8-10 cm
                area_per_m: 4.0, // LAI 0.9 at 2.5 m rows, within 0.13-1.41 (Sensors 2016, 16:2004)
                angle: LeafAngle::Spherical, // assumed
                reflectivity_ratio: 0.5, // Helios spectral library: grape leaf 0.494-0.516
            },
        }
    }
}

impl VineyardSpec {
    /// Whether every value is finite and in its range.
    pub fn check(&self) -> Result<(), SpecError> {
        self.rows.check()?;
        self.trellis.check()?;
        self.crown.check("planting.crown")?;
        self.trunk.check(&self.crown.crown(self.season))?;
        if self.crown.shape != CrownShape::Box {
            let found = format!("{:?}", self.crown.shape).to_lowercase();
            return Err(error("planting.crown", "shape", found, "box: a trellis holds a curtain".into()));
        }
        self.leaves.check(&self.crown.crown(Season::Full))
    }
}

impl TrellisSpec {
    fn check(&self) -> Result<(), SpecError> {
        let table = "planting.trellis";
        let at = |key, value, low, high| within(table, key, value, low, high);
        at("post_height_m", self.post_height_m, 0.1, 10.0)?;
        at("post_radius_m", self.post_radius_m, 0.005, 0.5)?;
        at("end_post_radius_m", self.end_post_radius_m, 0.005, 0.5)?;
        if self.plants_per_post == 0 {
            return Err(error(table, "plants_per_post", 0, "1 at least".into()));
        }
        at_most(table, "wire_heights_m", self.wire_heights_m.len(), 20)?;
        for (index, height_m) in self.wire_heights_m.iter().enumerate() {
            within(table, &format!("wire_heights_m[{index}]"), *height_m, 0.0, self.post_height_m)?;
        }
        at("wire_radius_m", self.wire_radius_m, 0.0001, 0.1)?;
        at("post_reflectivity_ratio", self.post_reflectivity_ratio, 0.0, 1.0)?;
        at("wire_reflectivity_ratio", self.wire_reflectivity_ratio, 0.0, 1.0)
    }
}
