//! A sweep's returns as points in the base's axes; what is not finite stays outside.

use crate::rig::Rig;
use arborloop_base::{Return, Sweep};
use nalgebra::Vector3;

/// One beam's answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// From the lidar's center in the axes of the base, metres; for a miss, a unit vector.
    pub(crate) at: Vector3<f64>,
    /// Distance from the lidar along the xy plane of the base, metres; for a miss, the cosine of the elevation.
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
