//! Settings of `mhd-paper`: the values of the paper and of its authors' code.

use serde::{Deserialize, Serialize};

/// Settings of `mhd-paper`; every key has a default, unknown keys are refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MhdPaperSettings {
    /// Heights between which the slice is cut, in the frame of the sensor, meters (paper: "e.g. 0.0 to 0.2").
    pub slice_z_m: [f64; 2],
    /// Width of a bearing bin, radians (the authors' scans: 0.007).
    pub bin_rad: f64,
    /// Returns nearer than the first are the robot, returns from the second on are free beams, meters (0.5, 12).
    pub range_m: [f64; 2],
    /// Returns with a larger bearing are left out, radians (3.0).
    pub bearing_rad_max: f64,
    /// Side of a map cell, meters. The paper's is 0.01, which costs 69 s a scan in the published code; the search is as
    /// fine as the paper's, only the raster is coarser.
    pub cell_m: f64,
    /// Share of the points that counts in a match (0.7).
    pub keep_ratio: f64,
    /// Steps of the search in x and y, coarse to fine, meters (8, 4, 2, 1 cells of 1 cm); two to each side.
    pub search_steps_m: Vec<f64>,
    /// Step of the search in heading per step in position, radians per meter (0.03 per 1 cm); seven to each side.
    pub search_rad_per_m: f64,
    /// An innovation beyond this much position (meters) is doubted: outliers are dropped and the match repeated (0.4).
    pub gate_m: f64,
    /// Beyond this much heading (radians) the map is not updated (0.1).
    pub gate_rad: f64,
    /// After so many refusals in a row the map is updated anyway (3).
    pub refusals_max: usize,
    /// Log-odds that a beam adds to what it met (ln 4).
    pub occupied_log_odds: f64,
    /// Log-odds that a beam adds to what it crossed (ln 1/4).
    pub free_log_odds: f64,
    /// Thickness of an obstacle, meters (0.06).
    pub obstacle_m: f64,
    /// Width of a beam, radians (1 degree).
    pub beam_rad: f64,
    /// Standard deviations of the first state: x, y (meters), heading (radians).
    pub start_sigma: [f64; 3],
    /// Standard deviations of the motion model: x, y (m/s), heading (rad/s).
    pub motion_sigma: [f64; 3],
    /// Standard deviations of a match: x, y (meters), heading (radians).
    pub match_sigma: [f64; 3],
}

impl Default for MhdPaperSettings {
    fn default() -> Self {
        MhdPaperSettings {
            slice_z_m: [0.0, 0.2],
            bin_rad: 0.007,
            range_m: [0.5, 12.0],
            bearing_rad_max: 3.0,
            cell_m: 0.02,
            keep_ratio: 0.7,
            search_steps_m: vec![0.08, 0.04, 0.02, 0.01],
            search_rad_per_m: 3.0,
            gate_m: 0.4,
            gate_rad: 0.1,
            refusals_max: 3,
            occupied_log_odds: 4.0_f64.ln(),
            free_log_odds: 0.25_f64.ln(),
            obstacle_m: 0.06,
            beam_rad: 1.0_f64.to_radians(),
            start_sigma: [0.035, 0.035, 0.07],
            motion_sigma: [0.12, 0.37, 0.08],
            match_sigma: [0.07, 0.07, 0.1],
        }
    }
}

impl MhdPaperSettings {
    /// Whether every value can be worked with; the reason names key, value and what is wanted.
    pub(crate) fn check(&self) -> Result<(), String> {
        let within = |key: &str, value: f64, low: f64, high: f64| {
            if value >= low && value <= high {
                Ok(())
            } else {
                Err(format!("{key} = {value}: wanted a number from {low} to {high}"))
            }
        };
        within("slice_z_m[0]", self.slice_z_m[0], -10.0, 10.0)?;
        within("slice_z_m[1]", self.slice_z_m[1], self.slice_z_m[0], 10.0)?;
        within("bin_rad", self.bin_rad, 1e-3, 0.2)?;
        within("range_m[0]", self.range_m[0], 0.0, 10.0)?;
        within("range_m[1]", self.range_m[1], self.range_m[0] + 0.1, 50.0)?;
        within("bearing_rad_max", self.bearing_rad_max, 0.1, 4.0)?;
        within("cell_m", self.cell_m, 0.01, 1.0)?;
        within("keep_ratio", self.keep_ratio, 0.05, 1.0)?;
        within("search_rad_per_m", self.search_rad_per_m, 0.0, 100.0)?;
        within("gate_m", self.gate_m, 0.0, 100.0)?;
        within("gate_rad", self.gate_rad, 0.0, 4.0)?;
        within("occupied_log_odds", self.occupied_log_odds, 0.0, 100.0)?;
        within("free_log_odds", self.free_log_odds, -100.0, 0.0)?;
        within("obstacle_m", self.obstacle_m, 0.0, 2.0)?;
        within("beam_rad", self.beam_rad, 0.0, 1.0)?;
        for step_m in &self.search_steps_m {
            within("search_steps_m", *step_m, 1e-4, 1.0)?;
        }
        for sigma in self.start_sigma.iter().chain(&self.motion_sigma).chain(&self.match_sigma) {
            within("start_sigma, motion_sigma, match_sigma", *sigma, 1e-6, 100.0)?;
        }
        Ok(())
    }
}
