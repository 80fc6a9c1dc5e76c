//! Settings of `aloam`: those of the public A-LOAM for a VLP-16.

use serde::{Deserialize, Serialize};

/// Settings of `aloam`; every key has a default, unknown keys are refused.
///
/// The defaults are those that the public A-LOAM (HKUST-Aerial-Robotics, launch file for the VLP-16) is shipped with.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AloamSettings {
    /// Nearer returns are the robot itself, meters.
    pub range_m_min: f64,
    /// Side of the voxels in which edge points of sweep and map are averaged, meters.
    pub edge_voxel_m: f64,
    /// Side of the voxels in which planar points of sweep and map are averaged, meters.
    pub plane_voxel_m: f64,
}

impl Default for AloamSettings {
    fn default() -> Self {
        AloamSettings { range_m_min: 0.3, edge_voxel_m: 0.2, plane_voxel_m: 0.4 }
    }
}

impl AloamSettings {
    /// Whether every value can be worked with; the reason names key, value and what is wanted.
    pub(crate) fn check(&self) -> Result<(), String> {
        let within = |key: &str, value: f64, low: f64, high: f64| {
            if value >= low && value <= high {
                Ok(())
            } else {
                Err(format!("{key} = {value}: wanted a number from {low} to {high}"))
            }
        };
        within("range_m_min", self.range_m_min, 0.0, 10.0)?;
        within("edge_voxel_m", self.edge_voxel_m, 0.01, 10.0)?;
        within("plane_voxel_m", self.plane_voxel_m, 0.01, 10.0)
    }
}
