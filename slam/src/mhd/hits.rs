//! A sweep's returns as points in the base's axes; what is not finite stays outside.

use crate::rig::Rig;
use arborloop_base::{Return, Sweep};
use nalgebra::Vector3;

/// One beam's answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// From the lidar's center in the axes of the base, meters; for a miss, a unit vector.
    pub(crate) at: Vector3<f64>,
    /// Distance from the lidar along the xy plane of the base, meters; for a miss, the cosine of the elevation.
    pub(crate) level_m: f64,
    /// Bearing from the lidar's x axis, radians.
    pub(crate) bearing_rad: f64,
    /// When it was met, after the middle of the sweep, seconds.
    pub(crate) after_s: f64,
    /// Elevation rank of the beam.
    pub(crate) ring: u16,
}

/// The beams of one sweep, in firing order.
#[derive(Debug, Clone, Default)]
pub(crate) struct Hits {
    /// Beams that met something.
    pub(crate) met: Vec<Hit>,
    /// Beams that met nothing.
    pub(crate) missed: Vec<Hit>,
}

impl Hits {
    /// Takes the first echoes of a sweep from `range_m_min` on.
    pub(crate) fn read(&mut self, sweep: &Sweep, rig: &Rig, range_m_min: f64) {
        self.met.clear();
        self.missed.clear();
        let duration_s = (sweep.end - sweep.start).seconds().max(0.0);
        let rings = sweep.rings.max(1);
        for one in sweep.returns.iter().filter(|one| one.number == 0 && one.ring < rings) {
            let direction = Return { range_m: Some(1.0), ..*one }.point();
            let Some(direction) = direction.filter(|p| p.coords.iter().all(|n| n.is_finite())) else {
                continue;
            };
            let direction = rig.base_from_lidar.rotation * direction.coords;
            let cosine = direction.xy().norm();
            let hit = |range_m: f64| Hit {
                at: direction * range_m,
                level_m: cosine * range_m,
                bearing_rad: one.azimuth_rad,
                // A firing time outside of its own sweep is a fault of the recording; it is held inside.
                after_s: one.fired_after.seconds().clamp(0.0, duration_s) - 0.5 * duration_s,
                ring: one.ring,
            };
            match one.range_m {
                Some(range_m) if range_m.is_finite() && range_m >= range_m_min && range_m > 0.0 => {
                    self.met.push(hit(range_m));
                }
                // Too near says nothing of what lies behind; not finite says nothing at all.
                Some(_) => {}
                None => self.missed.push(hit(1.0)),
            }
        }
    }
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
        assert_eq!(read(vec![one(None)], &Rig::default()).missed.len(), 1);
    }

    #[test]
    fn a_firing_time_outside_of_its_sweep_is_held_inside() {
        for (late, after_s) in [(-500, -0.05), (5000, 0.05)] {
            let stray = Return { fired_after: Span::from_millis(late), ..one(Some(3.0)) };
            assert!((read(vec![stray], &Rig::default()).met[0].after_s - after_s).abs() < 1e-12);
        }
    }
}
