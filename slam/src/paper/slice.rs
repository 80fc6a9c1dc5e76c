//! The paper's flat scan: a horizontal slice in the sensor's frame, minimum range per bearing bin.

use super::settings::MhdPaperSettings;
use arborloop_base::Sweep;
use nalgebra::Vector2;
use std::f64::consts::{PI, TAU};

/// One sweep, flattened.
#[derive(Debug, Clone, Default)]
pub(crate) struct Slice {
    /// Range of every bearing bin from -pi on, meters; infinite for a bin that met nothing.
    pub(crate) ranges_m: Vec<f64>,
    /// The points that are matched, lidar frame seen from above, meters.
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

    /// The range along a bearing for the map, meters: as in the authors' code every return is repeated in the two
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

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Return, Span, Time};

    fn one(azimuth_rad: f64, elevation_deg: f64, range_m: f64) -> Return {
        Return {
            azimuth_rad,
            elevation_rad: elevation_deg.to_radians(),
            range_m: Some(range_m),
            ring: 8,
            number: 0,
            fired_after: Span::ZERO,
            intensity: 0.0,
        }
    }

    fn cut(rings: u16, returns: Vec<Return>) -> Slice {
        let sweep = Sweep { start: Time::default(), end: Time::default(), rings, returns };
        let mut slice = Slice::default();
        slice.cut(&sweep, &MhdPaperSettings::default());
        slice
    }

    #[test]
    fn of_a_bin_the_nearest_return_within_the_slice_stays() {
        // One degree up: 0.07 m at 4 m, 0.14 m at 8 m; three degrees up: 0.26 m at 5 m, above the slice.
        let returns = vec![one(0.5, 1.0, 8.0), one(0.5, 1.0, 4.0), one(0.5, 3.0, 5.0), one(0.5, -1.0, 2.0)];
        let slice = cut(16, returns);
        assert_eq!(slice.points.len(), 1);
        assert!((slice.points[0].norm() - 4.0 * 1.0_f64.to_radians().cos()).abs() < 1e-9);
        assert!((slice.points[0].y.atan2(slice.points[0].x) - 0.5).abs() <= 0.0035 + 1e-9);
    }

    #[test]
    fn a_planar_sweep_is_its_own_slice_whatever_its_height() {
        assert_eq!(cut(1, vec![one(0.5, 20.0, 4.0)]).points.len(), 1);
        assert_eq!(cut(16, vec![one(0.5, 20.0, 4.0)]).points.len(), 0);
    }

    #[test]
    fn near_far_behind_and_broken_returns_do_not_match() {
        let broken = Return { range_m: Some(f64::NAN), ..one(0.0, 1.0, 1.0) };
        let slice = cut(16, vec![one(0.1, 1.0, 0.4), one(0.3, 0.5, 13.0), one(3.1, 1.0, 4.0), broken]);
        assert!(slice.points.is_empty());
    }

    #[test]
    fn for_the_map_a_return_is_as_wide_as_three_bins_and_nothing_is_seen_behind() {
        let slice = cut(16, vec![one(0.5, 1.0, 4.0)]);
        let at = |bins: f64| slice.widened_m(0.5 + bins * 0.007, 3.0);
        assert!(at(-1.0).is_some_and(f64::is_finite) && at(0.0) == at(1.0));
        assert_eq!(at(2.5), Some(f64::INFINITY));
        assert_eq!(slice.widened_m(3.1, 3.0), None);
        assert_eq!(Slice::default().widened_m(0.0, 3.0), None);
    }
}
