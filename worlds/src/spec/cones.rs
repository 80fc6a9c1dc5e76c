//! What a scenario may say about traffic cones.

use super::{COUNT_MAX, SpecError, at_most, within};
use serde::{Deserialize, Serialize};

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
