//! The paper's flat scan: a horizontal slice in the sensor's frame, minimum range per bearing bin.

use super::settings::MhdPaperSettings;
use arborloop_base::Sweep;
use nalgebra::Vector2;
use std::f64::consts::{PI, TAU};

/// One sweep, flattened.
#[derive(Debug, Clone, Default)]
pub(crate) struct Slice {
    /// Range of every bearing bin from -pi on, metres; infinite for a bin that met nothing.
    pub(crate) ranges_m: Vec<f64>,
    /// The points that are matched, lidar frame seen from above, metres.
    pub(crate) points: Vec<Vector2<f64>>,
    bin_rad: f64,
}

impl Slice {
    /// Flattens a sweep. A planar sweep is its own slice.
    pub(crate) fn cut(&mut self, sweep: &Sweep, settings: &MhdPaperSettings) {
        let bins = (TAU / settings.bin_rad).ceil() as usize;
        self.bin_rad = TAU / bins as f64;
        self.ranges_m.clear();
        self.ranges_m.resize(bins, f64::INFINITY);
        self.points.clear();
        let [low_m, high_m] = settings.slice_z_m;
        let [range_m_min, range_m_max] = settings.range_m;
        for one in &sweep.returns {
            let Some(point) = one.point().filter(|p| p.coords.iter().all(|n| n.is_finite())) else {
                continue;
            };
            let range_m = point.coords.xy().norm();
            let bearing_rad = point.y.atan2(point.x);
            let in_slice = sweep.rings <= 1 || (low_m..=high_m).contains(&point.z);
            if in_slice && range_m >= range_m_min && bearing_rad.abs() <= settings.bearing_rad_max {
                let bin = &mut self.ranges_m[((bearing_rad + PI) / self.bin_rad) as usize % bins];
                *bin = bin.min(range_m);
            }
        }
        for (bin, range_m) in self.ranges_m.iter().enumerate().filter(|(_, range_m)| **range_m < range_m_max)
        {
            let bearing_rad = (bin as f64 + 0.5) * self.bin_rad - PI;
            self.points.push(Vector2::new(range_m * bearing_rad.cos(), range_m * bearing_rad.sin()));
        }
    }

    /// The range along a bearing for the map, metres: as in the authors' code every return is repeated in the two
    /// neighboring bins. `None` where the slice does not look.
    pub(crate) fn widened_m(&self, bearing_rad: f64, bearing_rad_max: f64) -> Option<f64> {
        if bearing_rad.abs() > bearing_rad_max || self.ranges_m.is_empty() {
            return None;
        }
        let bins = self.ranges_m.len();
        let bin = ((bearing_rad + PI) / self.bin_rad) as usize % bins;
        let near = [(bin + bins - 1) % bins, bin, (bin + 1) % bins];
        Some(near.into_iter().map(|bin| self.ranges_m[bin]).fold(f64::INFINITY, f64::min))
    }
}
