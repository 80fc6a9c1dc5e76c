//! Rain, fog and dust: they take light from every beam, and throw some of it back.
//!
//! Extinction of fog and dust is Koschmieder's law at the 5 % contrast of the meteorological optical range: ln(20) /
//! visibility. That of rain is Carbonneau's 1.076 R^0.67 dB/km, assumed: free-space optics quotes it from ITU-R P.1814 for
//! France, and the original was not at hand. Droplets and dust are larger than the light's wave, so that the visible
//! figures hold near 905 nm. What comes back of the air within a pulse's length is a soft target whose brightness is
//! pi x extinction / lidar ratio x length, with the exponential law of speckle. Rain is a continuum here: single drops,
//! of which a narrow beam holds few, are not drawn, and more beams return nearby than in real rain.

use super::cast::Surface;
use crate::optics::Hit;
use crate::scenario::{Wrong, within};
use arborloop_base::{Class, Draws};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// The air that beams fly through.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WeatherSpec {
    /// Rain, millimeters an hour; 4 is moderate, 50 violent.
    pub rain_mm_per_h: f64,
    /// How far one sees in the fog, meters; absent means no fog.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fog_visibility_m: Option<f64>,
    /// How far one sees in the dust, meters; absent means no dust.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dust_visibility_m: Option<f64>,
}

/// Extinction over backscatter of cloud droplets at 905 nm, 18.8 +- 0.8 sr (O'Connor et al. 2004); assumed for rain, whose
/// drops their law leaves out.
const WATER_RATIO_SR: f64 = 18.8;
/// The same of soil dust, sr; assumed: the middle of the 40 to 60 sr that aerosol lidars find.
const DUST_RATIO_SR: f64 = 50.0;
/// Nothing comes back from nearer, meters: sender and receiver do not see the same air. Assumed.
const OVERLAP_M: f64 = 0.3;

impl WeatherSpec {
    pub(crate) fn check(&self) -> Result<(), Wrong> {
        within("weather.rain_mm_per_h", self.rain_mm_per_h, 0.0, 500.0)?;
        within("weather.fog_visibility_m", self.fog_visibility_m.unwrap_or(1.0), 1.0, 1e5)?;
        within("weather.dust_visibility_m", self.dust_visibility_m.unwrap_or(1.0), 1.0, 1e5)
    }

    /// Share of light lost a meter, of rain, fog and dust, 1/m.
    pub fn extinction_per_m(&self) -> [f64; 3] {
        // A decibel is a factor of exp(ln(10) / 10).
        let rain = 1.076 * self.rain_mm_per_h.powf(0.67) * 10.0_f64.ln() / 10.0 / 1000.0;
        let seen =
            |visibility_m: Option<f64>| visibility_m.map_or(0.0, |visibility_m| 20.0_f64.ln() / visibility_m);
        [rain, seen(self.fog_visibility_m), seen(self.dust_visibility_m)]
    }
}

/// The air as a beam feels it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Air {
    extinction_per_m: f64,
    /// What a pulse's length of air throws back, where a white facing surface is 1.
    brightness: f64,
    nearest_m: f64,
}

impl Air {
    pub(super) fn new(weather: &WeatherSpec, length_m: f64) -> Self {
        let [rain, fog, dust] = weather.extinction_per_m();
        let backscatter = (rain + fog) / WATER_RATIO_SR + dust / DUST_RATIO_SR;
        Air {
            extinction_per_m: rain + fog + dust,
            brightness: PI * backscatter * length_m,
            nearest_m: OVERLAP_M,
        }
    }

    pub(super) fn is_clear(&self) -> bool {
        self.extinction_per_m == 0.0
    }

    /// Share of the light that is left on the way there and back.
    pub(super) fn left(&self, range_m: f64) -> f64 {
        if self.is_clear() { 1.0 } else { (-2.0 * self.extinction_per_m * range_m).exp() }
    }

    /// What comes back of the air before `far_m`: its place follows the falling of light with the square of the range.
    pub(super) fn soft_target(&self, far_m: f64, mut draws: Draws) -> Option<Surface> {
        if self.is_clear() || far_m <= self.nearest_m {
            return None;
        }
        let (near, far) = (1.0 / self.nearest_m, 1.0 / far_m);
        let range_m = 1.0 / (near - draws.unit() * (near - far));
        let hit = Hit {
            range_m,
            class: Class::Weather,
            instance: 0,
            cos_incidence: 1.0,
            reflectivity_ratio: (self.brightness * draws.exponential()).min(1.0),
            transmittance_ratio: 0.0,
            displacement_m: Vector3::zeros(),
        };
        Some(Surface { hit, sub_ray: 0, layer: 0, share: self.left(range_m) })
    }

    #[cfg(test)]
    pub(super) fn law(&self) -> (f64, f64, f64) {
        (self.extinction_per_m, self.brightness, self.nearest_m)
    }
}
