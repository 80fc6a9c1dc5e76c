//! The tread of a tire between wheel and ground: it gives a little before it slides, alike in every direction.
//!
//! After Dahl (1968): the tread's displacement follows the slip and saturates where friction ends. An engine's contact
//! solver is no substitute: it limits friction by the load, too, but finds the direction of a sliding contact by the masses
//! on either side of it, and a wheel that spins easily then slides as if on ice along its way. Skid steering lives of that
//! direction.

use nalgebra::{UnitQuaternion, Vector3};

/// What a tread is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tread {
    /// Greatest force over the load.
    pub(crate) friction: f64,
    /// Displacement at which it slides, meters.
    pub(crate) give_m: f64,
    /// Damping of the displacement, N s/m.
    pub(crate) damping_nspm: f64,
}

/// Displacement of a tread from where it took hold, world axes, meters.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Grip(Vector3<f64>);

impl Grip {
    /// The same tread on a wheel that points elsewhere.
    pub(crate) fn turn(&mut self, turn: &UnitQuaternion<f64>) {
        self.0 = turn * self.0;
    }

    /// The ground's force on the tread along the ground, N, one tick on: under a load, square to a unit normal, at a
    /// velocity of the tread over the ground.
    pub(crate) fn pull(
        &mut self,
        tread: &Tread,
        normal: &Vector3<f64>,
        load_n: f64,
        velocity_mps: &Vector3<f64>,
        tick_s: f64,
    ) -> Vector3<f64> {
        if load_n <= 0.0 || tread.friction <= 0.0 {
            self.0 = Vector3::zeros();
            return Vector3::zeros();
        }
        let along = |vector: &Vector3<f64>| vector - normal * vector.dot(normal);
        let slip_mps = along(velocity_mps);
        // Backward Euler of z' = s - |s| z / give: never beyond where it slides, at any slip.
        let moved = along(&self.0) + slip_mps * tick_s;
        self.0 = moved / (1.0 + slip_mps.norm() * tick_s / tread.give_m);
        let most_n = tread.friction * load_n;
        let force_n = self.0 * (most_n / tread.give_m) + slip_mps * tread.damping_nspm;
        -force_n.cap_magnitude(most_n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TREAD: Tread = Tread { friction: 0.6, give_m: 0.005, damping_nspm: 200.0 };

    #[test]
    fn a_sliding_tread_pulls_with_friction_times_load_against_its_slip() {
        let slip = Vector3::new(0.3, -0.1, 0.0);
        let mut grip = Grip::default();
        let mut force = Vector3::zeros();
        for _ in 0..1000 {
            // Lifting is no slip.
            force = grip.pull(&TREAD, &Vector3::z(), 50.0, &(slip + Vector3::z()), 1e-3);
        }
        assert!((force + slip.normalize() * 30.0).norm() < 1e-6, "{force:?}");
    }

    #[test]
    fn a_mass_on_a_tread_stays_on_a_slope_below_its_friction_and_slides_above_it() {
        // Ten kilograms, pulled along the ground by less and by more than friction holds.
        let slid = |pull_n: f64| {
            let (mut grip, mut velocity, mut way) = (Grip::default(), Vector3::zeros(), 0.0);
            let mut late = 0.0;
            for tick in 1..=6000 {
                let force = grip.pull(&TREAD, &Vector3::z(), 98.0, &velocity, 1e-3);
                velocity += (force + Vector3::x() * pull_n) / 10.0 * 1e-3;
                way += velocity.x * 1e-3;
                if tick == 3000 {
                    late = way;
                }
            }
            (way, way - late)
        };
        let (way, late) = slid(50.0);
        assert!(
            way < TREAD.give_m * 10.0 && late.abs() < 1e-5,
            "{way} m, {late} m in the last three seconds"
        );
        let (_, late) = slid(70.0);
        // Constant acceleration by what friction leaves, 1.12 m/s2, over the seconds from 3 to 6. The first centimeters pass
        // at less than full friction, for about 0.1 s.
        assert!((late / (0.5 * 1.12 * (36.0 - 9.0)) - 1.0).abs() < 0.04, "{late} m");
    }

    #[test]
    fn a_wheel_in_the_air_pulls_at_nothing() {
        let mut grip = Grip::default();
        assert_eq!(grip.pull(&TREAD, &Vector3::z(), 0.0, &Vector3::x(), 1e-3), Vector3::zeros());
    }
}
