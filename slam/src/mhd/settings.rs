//! Settings of `mhd`. The defaults serve a walking robot's sixteen rings and a planar recording alike.

use serde::{Deserialize, Serialize};

/// Settings of `mhd`; every key has a default, unknown keys are refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MhdSettings {
    /// Nearer returns are the robot itself, meters.
    pub range_m_min: f64,
    /// Farther returns of a many-ring sweep are left out, meters.
    pub range_m_max: f64,
    /// Farther returns of a planar sweep are left out, meters: a lone ring cannot tell far ground from a hedge.
    pub planar_range_m_max: f64,
    /// Returns of a planar sweep with a larger bearing are left out, radians: who starts the robot walks behind it.
    pub planar_bearing_rad_max: f64,
    /// Longer unbroken segments of a planar sweep are left out, meters: arcs of ground, hedges and walls slide along
    /// themselves, trunks and bushes do not.
    pub segment_m_max: f64,
    /// Heights above ground where the layers of a many-ring sweep meet, meters, rising. Each layer has its own map,
    /// because a cone or a crown has another outline at another height: thin layers where cones and trunks stand. Crowns
    /// above them sway and show another face from everywhere.
    pub layer_edges_m: Vec<f64>,
    /// Heights above ground between which the drawn map shows what is occupied, meters.
    pub map_height_m: [f64; 2],
    /// Width of the bearing bins in which a layer keeps its nearest returns, radians.
    pub bin_rad: f64,
    /// Side of a map cell for sweeps of many rings, meters. Seen from another side the mean point of a cell is another
    /// one: the map of a trunk is as blurred as its cells are wide.
    pub cell_m: f64,
    /// Side of a map cell for planar sweeps, meters: their points lie as far apart at 15 m.
    pub planar_cell_m: f64,
    /// Distances to the map are capped here for sweeps of many rings, meters.
    pub distance_m_max: f64,
    /// Distances to the map are capped here for planar sweeps, meters.
    pub planar_distance_m_max: f64,
    /// Share of the points that counts in a match of many rings: the k of the k-best modified Hausdorff distance.
    pub keep_ratio: f64,
    /// Share of the points that counts in a match of planar sweeps. It is the paper's: no neighboring ring has told ground
    /// and grass from things that stay.
    pub planar_keep_ratio: f64,
    /// A point of a many-ring sweep at this distance counts half, one farther off less, meters: tilt and the spacing of the
    /// rings decide which height of a far crown is seen, and all its points err together.
    pub far_m: f64,
    /// A match whose k-best mean is larger is poor: the full circle is searched, meters.
    pub poor_match_m: f64,
    /// A match whose better half has a larger mean distance is refused and the prediction stands, meters.
    pub failed_match_m: f64,
    /// After a longer pause between sweeps the full circle is searched, seconds.
    pub pause_s: f64,
    /// A new key frame is drawn into the map after this way, meters.
    pub key_step_m: f64,
    /// A new key frame is drawn into the map after this turn, radians.
    pub key_turn_rad: f64,
}

impl Default for MhdSettings {
    fn default() -> Self {
        MhdSettings {
            range_m_min: 0.5,
            range_m_max: 30.0,
            planar_range_m_max: 20.0,
            planar_bearing_rad_max: 2.55,
            segment_m_max: 1.0,
            layer_edges_m: vec![0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75],
            map_height_m: [0.15, 0.75],
            bin_rad: 0.5_f64.to_radians(),
            cell_m: 0.07,
            planar_cell_m: 0.1,
            distance_m_max: 0.5,
            planar_distance_m_max: 1.0,
            keep_ratio: 0.8,
            planar_keep_ratio: 0.7,
            far_m: 15.0,
            poor_match_m: 0.08,
            failed_match_m: 0.06,
            pause_s: 8.0,
            key_step_m: 0.15,
            key_turn_rad: 0.1,
        }
    }
}

impl MhdSettings {
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
        within("range_m_max", self.range_m_max, self.range_m_min, 200.0)?;
        within("planar_range_m_max", self.planar_range_m_max, self.range_m_min, 200.0)?;
        within("planar_bearing_rad_max", self.planar_bearing_rad_max, 0.1, 4.0)?;
        within("segment_m_max", self.segment_m_max, 0.0, 1000.0)?;
        within("bin_rad", self.bin_rad, 1e-3, 0.2)?;
        within("cell_m", self.cell_m, 0.01, 1.0)?;
        within("planar_cell_m", self.planar_cell_m, 0.01, 1.0)?;
        within("distance_m_max", self.distance_m_max, self.cell_m, 5.0)?;
        within("planar_distance_m_max", self.planar_distance_m_max, self.planar_cell_m, 5.0)?;
        within("keep_ratio", self.keep_ratio, 0.05, 1.0)?;
        within("far_m", self.far_m, 0.1, 1e9)?;
        within("planar_keep_ratio", self.planar_keep_ratio, 0.05, 1.0)?;
        within("poor_match_m", self.poor_match_m, 0.0, 5.0)?;
        within("failed_match_m", self.failed_match_m, 0.0, 5.0)?;
        within("pause_s", self.pause_s, 0.0, 1e9)?;
        within("key_step_m", self.key_step_m, 0.0, 10.0)?;
        within("key_turn_rad", self.key_turn_rad, 0.0, 4.0)?;
        let edges = &self.layer_edges_m;
        let rising = edges.windows(2).all(|pair| pair[0] < pair[1]) && edges.iter().all(|e| e.is_finite());
        if !rising || !(2..=9).contains(&edges.len()) {
            return Err(format!("layer_edges_m = {edges:?}: wanted two to nine rising numbers"));
        }
        if !self.map_height_m.iter().all(|height| height.is_finite()) {
            return Err(format!("map_height_m = {:?}: wanted two numbers", self.map_height_m));
        }
        Ok(())
    }

    /// Number of layers.
    pub(crate) fn layers(&self) -> usize {
        self.layer_edges_m.len() - 1
    }
}
