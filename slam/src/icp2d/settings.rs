//! Settings of `icp2d`.

use serde::{Deserialize, Serialize};

/// Settings of `icp2d`; every key has a default, unknown keys are refused. Slices are those of `mhd` by default.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Icp2dSettings {
    /// Side of the cells in which points of the map are averaged, meters.
    pub cell_m: f64,
    /// Map points farther from a point than this are no neighbors, meters.
    pub reach_m: f64,
    /// Steps of one match at most.
    pub steps_max: u32,
    /// A sweep is drawn into the map after this way, meters.
    pub key_step_m: f64,
    /// A sweep is drawn into the map after this turn, radians.
    pub key_turn_rad: f64,
}

impl Default for Icp2dSettings {
    fn default() -> Self {
        Icp2dSettings { cell_m: 0.1, reach_m: 0.5, steps_max: 30, key_step_m: 0.15, key_turn_rad: 0.1 }
    }
}

impl Icp2dSettings {
    /// Whether every value can be worked with; the reason names key, value and what is wanted.
    pub(crate) fn check(&self) -> Result<(), String> {
        let within = |key: &str, value: f64, low: f64, high: f64| {
            if value >= low && value <= high {
                Ok(())
            } else {
                Err(format!("{key} = {value}: wanted a number from {low} to {high}"))
            }
        };
        within("cell_m", self.cell_m, 0.01, 1.0)?;
        within("reach_m", self.reach_m, self.cell_m, 10.0)?;
        within("steps_max", self.steps_max.into(), 1.0, 1000.0)?;
        within("key_step_m", self.key_step_m, 0.0, 10.0)?;
        within("key_turn_rad", self.key_turn_rad, 0.0, 4.0)
    }
}
