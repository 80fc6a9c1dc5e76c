//! A tire as a fan of radial springs over the ground: what holds a wheel up, and where.
//!
//! An engine's contact with a ground of triangles jumps from one to the next; many small springs, each of which begins at
//! nothing, do not. Radial springs are an old model of tires on uneven ground (Badalamenti and Doyle 1988).

use arborloop_worlds::Terrain;
use nalgebra::{Point3, Unit, Vector3};

/// Springs in a fan; odd, so that one points straight down.
const SPRINGS: usize = 41;
/// Half the fan's angle, radians: a wheel stands on its lower third.
const HALF_FAN_RAD: f64 = 1.0;

/// A tire's springs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tire {
    radius_m: f64,
    /// Force of one spring over its length, N/m.
    spring_npm: f64,
    /// How much harder the tire presses for each m/s at which it is pressed, s/m.
    damping_spm: f64,
    /// Sine and cosine of each spring's angle from straight down.
    fan: Vec<(f64, f64)>,
}

/// What a wheel stands on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Footing {
    /// Middle of the pressed springs' ends, weighted by their forces, world frame.
    pub(crate) at: Point3<f64>,
    /// Against the ground's force, unit length.
    pub(crate) normal: Unit<Vector3<f64>>,
    /// The force, N.
    pub(crate) load_n: f64,
}

/// Where a wheel is and how it moves, world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hub {
    pub(crate) center: Point3<f64>,
    pub(crate) velocity_mps: Vector3<f64>,
    /// Unit, along the axle, to the left.
    pub(crate) axle: Vector3<f64>,
}

impl Tire {
    /// Of a wheel that sinks by `give_m` under `load_n`. The damping is the share of the critical one at that load.
    pub(crate) fn new(radius_m: f64, load_n: f64, give_m: f64, damping_ratio: f64) -> Self {
        let fan: Vec<(f64, f64)> = (0..SPRINGS)
            .map(|n| HALF_FAN_RAD * (2.0 * n as f64 / (SPRINGS - 1) as f64 - 1.0))
            .map(f64::sin_cos)
            .collect();
        // Of a wheel on level ground, every spring ends where it meets the ground.
        let lengths = |(_, cos): &(f64, f64)| (radius_m - (radius_m - give_m) / cos).max(0.0) * cos;
        let pressed_m: f64 = fan.iter().map(lengths).sum();
        // The mass on the wheel swings at about sqrt(g / give); half of 2 damping_ratio over that speed per length.
        let natural_radps = (9.806_65 / give_m).sqrt();
        Tire {
            radius_m,
            spring_npm: load_n / pressed_m,
            damping_spm: 2.0 * damping_ratio / (natural_radps * give_m),
            fan,
        }
    }

    /// Radius that nothing presses, meters.
    pub(crate) fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// What the wheel stands on; `None` in the air.
    pub(crate) fn footing(&self, hub: &Hub, terrain: &Terrain) -> Option<Footing> {
        let lowest_m = hub.center.z - self.radius_m;
        let ahead = hub.axle.cross(&Vector3::z()).try_normalize(1e-6)?;
        let down = -ahead.cross(&hub.axle).try_normalize(1e-6)?;
        let down = if down.z > 0.0 { -down } else { down };
        let (mut force, mut moment, mut weight) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for (sin, cos) in &self.fan {
            let outward = ahead * *sin + down * *cos;
            let end = hub.center + outward * self.radius_m;
            let depth_m = terrain.height_m(end.x, end.y) - end.z;
            if depth_m <= 0.0 || end.z < lowest_m - self.radius_m {
                continue;
            }
            // Along the spring, and never longer than it.
            let pressed_m = (depth_m / -outward.z.min(-0.3)).min(self.radius_m);
            let push_n = self.spring_npm * pressed_m;
            force -= outward * push_n;
            moment += (end - outward * pressed_m).coords * push_n;
            weight += push_n;
        }
        let (normal, load_n) = Unit::try_new_and_get(force, 1e-9).filter(|_| weight > 0.0)?;
        let pressing_mps = -hub.velocity_mps.dot(&normal);
        let load_n = load_n * (1.0 + self.damping_spm * pressing_mps).max(0.0);
        Some(Footing { at: Point3::from(moment / weight), normal, load_n })
    }
}

/// Way per turn of a wheel that is pressed to a height above the ground, over two pi: two thirds of the way back to the
/// radius of the tire that nothing presses (Jazar, Vehicle Dynamics, 3.1).
pub(crate) fn rolling_radius_m(radius_m: f64, pressed_radius_m: f64) -> f64 {
    radius_m - (radius_m - pressed_radius_m) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hub(height_m: f64) -> Hub {
        Hub { center: Point3::new(0.3, 0.2, height_m), velocity_mps: Vector3::zeros(), axle: Vector3::y() }
    }

    #[test]
    fn a_tire_bears_its_load_at_its_give_and_nothing_above_the_ground() {
        let tire = Tire::new(0.1, 45.0, 0.003, 0.3);
        let terrain = Terrain::level(2.0, 0.05);
        let footing = tire.footing(&hub(0.097), &terrain).unwrap();
        assert!((footing.load_n - 45.0).abs() < 1e-9, "{footing:?}");
        assert!((footing.normal.into_inner() - Vector3::z()).norm() < 1e-12);
        assert!((footing.at - Point3::new(0.3, 0.2, 0.0)).norm() < 1e-12);
        assert_eq!(tire.footing(&hub(0.1001), &terrain), None);
    }

    #[test]
    fn a_tire_that_rolls_on_is_held_evenly() {
        let tire = Tire::new(0.1, 45.0, 0.003, 0.3);
        let terrain = Terrain::level(2.0, 0.05);
        for step in 0..200 {
            let mut hub = hub(0.097);
            hub.center.x = f64::from(step) * 0.0037;
            hub.velocity_mps = Vector3::x();
            let footing = tire.footing(&hub, &terrain).unwrap();
            assert!((footing.load_n - 45.0).abs() < 1e-6, "{footing:?}");
        }
    }

    #[test]
    fn a_tire_pressed_down_faster_presses_harder_and_never_pulls() {
        let tire = Tire::new(0.1, 45.0, 0.003, 0.3);
        let terrain = Terrain::level(2.0, 0.05);
        let load_n = |down_mps: f64| {
            let moving = Hub { velocity_mps: -Vector3::z() * down_mps, ..hub(0.097) };
            tire.footing(&moving, &terrain).map_or(0.0, |footing| footing.load_n)
        };
        assert!(load_n(0.1) > load_n(0.0) && load_n(0.0) > load_n(-0.1));
        assert!(load_n(-5.0) >= 0.0);
    }
}
