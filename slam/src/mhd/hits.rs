//! A sweep's returns as points in the base's axes; what is not finite stays outside.

use crate::rig::Rig;
use arborloop_base::{Return, Sweep};
use nalgebra::{Rotation3, Vector3};

/// One beam's answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// From the lidar's center in the axes of the base, meters.
    pub(crate) at: Vector3<f64>,
    /// Distance from the lidar along the xy plane of the base, meters.
    pub(crate) level_m: f64,
    /// Bearing from the lidar's x axis, radians.
    pub(crate) bearing_rad: f64,
    /// When it was met, after the middle of the sweep, seconds.
    pub(crate) after_s: f64,
    /// Elevation rank of the beam.
    pub(crate) ring: u16,
}

/// One beam that met nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Miss {
    /// Bearing from the lidar's x axis, radians.
    pub(crate) azimuth_rad: f64,
    /// Elevation above the lidar's xy plane, radians.
    pub(crate) elevation_rad: f64,
    /// When it fired, after the middle of the sweep, seconds.
    pub(crate) after_s: f64,
    /// Elevation rank of the beam.
    pub(crate) ring: u16,
}

/// The beams of one sweep, in firing order.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hits {
    /// Beams that met something.
    pub(crate) met: Vec<Hit>,
    /// Beams that met nothing; their directions are only asked for when the map is drawn.
    pub(crate) missed: Vec<Miss>,
    /// How the lidar is turned on the base.
    pub(crate) base_from_lidar: Rotation3<f64>,
    /// The elevation of each ring that was last asked for, with its sine and cosine: most lidars have one for each.
    pub(crate) tilts: Vec<(f64, (f64, f64))>,
}

impl Hits {
    /// Takes the first echoes of a sweep from `range_m_min` on.
    pub(crate) fn read(&mut self, sweep: &Sweep, rig: &Rig, range_m_min: f64) {
        self.met.clear();
        self.missed.clear();
        let duration_s = (sweep.end - sweep.start).seconds().max(0.0);
        let rings = sweep.rings.max(1);
        self.base_from_lidar = rig.base_from_lidar.rotation.to_rotation_matrix();
        self.tilts.resize(usize::from(rings), (0.0, (0.0, 1.0)));
        for one in sweep.returns.iter().filter(|one| one.number == 0 && one.ring < rings) {
            // A firing time outside of its own sweep is a fault of the recording; it is held inside.
            let after_s = one.fired_after.seconds().clamp(0.0, duration_s) - 0.5 * duration_s;
            let Return { azimuth_rad, elevation_rad, ring, .. } = *one;
            let miss = Miss { azimuth_rad, elevation_rad, after_s, ring };
            match one.range_m {
                Some(range_m) if range_m.is_finite() && range_m >= range_m_min && range_m > 0.0 => {
                    let tilt = &mut self.tilts[usize::from(ring)];
                    if tilt.0 != elevation_rad {
                        *tilt = (elevation_rad, elevation_rad.sin_cos());
                    }
                    if let Some(hit) = hit(&self.base_from_lidar, &miss, tilt.1, range_m) {
                        self.met.push(hit);
                    }
                }
                // Too near says nothing of what lies behind; not finite says nothing at all.
                Some(_) => {}
                None => self.missed.push(miss),
            }
        }
    }

    /// A beam that met nothing, as if it had met something a meter away; `None` when its direction is not finite.
    pub(crate) fn beam(&self, miss: &Miss) -> Option<Hit> {
        hit(&self.base_from_lidar, miss, miss.elevation_rad.sin_cos(), 1.0)
    }
}

/// What a beam meets at a range, meters; `None` when its direction is not finite. The tilt is the sine and cosine of its
/// elevation.
#[inline(always)]
fn hit(
    base_from_lidar: &Rotation3<f64>,
    beam: &Miss,
    (sin_elevation, cos_elevation): (f64, f64),
    range_m: f64,
) -> Option<Hit> {
    let (sin_azimuth, cos_azimuth) = beam.azimuth_rad.sin_cos();
    let direction = Vector3::new(cos_elevation * cos_azimuth, cos_elevation * sin_azimuth, sin_elevation);
    let at = base_from_lidar * direction * range_m;
    at.iter().all(|n| n.is_finite()).then(|| Hit {
        at,
        level_m: at.xy().norm(),
        bearing_rad: beam.azimuth_rad,
        after_s: beam.after_s,
        ring: beam.ring,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Pose, Span, Time};

    fn one(range_m: Option<f64>) -> Return {
        Return {
            azimuth_rad: 0.5,
            elevation_rad: 0.1,
            range_m,
            ring: 2,
            number: 0,
            fired_after: Span::from_millis(20),
            intensity: 0.0,
        }
    }

    fn read(returns: Vec<Return>, rig: &Rig) -> Hits {
        let start = Time::from_nanos(1_000_000_000);
        let sweep = Sweep { start, end: start + Span::from_millis(100), rings: 16, returns };
        let mut hits = Hits::default();
        hits.read(&sweep, rig, 0.5);
        hits
    }

    #[test]
    fn a_hit_is_the_returns_point_in_the_axes_of_the_base() {
        let turned = Pose::rotation(Vector3::new(0.0, 0.0, 1.0));
        let hits = read(vec![one(Some(4.0))], &Rig { base_from_lidar: turned });
        let point = turned.rotation * one(Some(4.0)).point().unwrap().coords;
        assert!((hits.met[0].at - point).norm() < 1e-12);
        assert!((hits.met[0].level_m - 4.0 * 0.1_f64.cos()).abs() < 1e-12);
        assert!((hits.met[0].after_s + 0.03).abs() < 1e-12);
    }

    #[test]
    fn what_is_near_or_not_finite_or_a_later_echo_or_of_no_ring_is_neither_met_nor_missed() {
        let odd = [Some(0.3), Some(f64::NAN), Some(f64::INFINITY), Some(-2.0), Some(0.0)];
        let mut returns: Vec<Return> = odd.into_iter().map(one).collect();
        returns.push(Return { number: 1, ..one(Some(3.0)) });
        returns.push(Return { ring: 16, ..one(Some(3.0)) });
        returns.push(Return { azimuth_rad: f64::NAN, ..one(Some(3.0)) });
        let hits = read(returns, &Rig::default());
        assert!(hits.met.is_empty() && hits.missed.is_empty());
        let blind = read(vec![one(None), Return { elevation_rad: f64::NAN, ..one(None) }], &Rig::default());
        assert_eq!(blind.missed.iter().filter_map(|miss| blind.beam(miss)).count(), 1);
    }

    #[test]
    fn a_firing_time_outside_of_its_sweep_is_held_inside() {
        for (late, after_s) in [(-500, -0.05), (5000, 0.05)] {
            let stray = Return { fired_after: Span::from_millis(late), ..one(Some(3.0)) };
            assert!((read(vec![stray], &Rig::default()).met[0].after_s - after_s).abs() < 1e-12);
        }
    }
}
