//! Which way is up, from upright things alone: trunks and posts stand plumb also where the ground does not lie level.
//!
//! Where neighboring beams meet a straight thing one above the other, its level distance changes by the rise times the
//! lean towards that bearing. Hundreds of such stretches all around tell how the ground under the robot slopes, which
//! changes slowly along the way; the sway from sweep to sweep is seen by the ground's plane. On a slope of 14 degrees a map
//! that is level with the ground where it begins is too short by 3 % and turns headings by up to a degree.

use nalgebra::{Matrix2, Matrix3, Rotation2, Rotation3, Vector2, Vector3};

/// Share of what was known that is still believed a sweep later: the slope changes within some meters.
const MEMORY: f64 = 0.85;
/// Slope of ground of which nothing is known: one standard deviation, as a tangent.
const SLOPE: f64 = 0.07;
/// Standard deviation of the difference of two level distances, meters: two ranges of 2 cm, and bark or leaves.
const NOISE_M: f64 = 0.05;
/// Neighboring pairs are on the same leaf or stem: about so many make one independent measurement.
const PAIRS_PER_MEASUREMENT: f64 = 8.0;
/// Share of the taper that may be a lean: cones and crowns that stand on one side only.
const LOPSIDED: f64 = 0.5;
/// Widths of the weights, meters, from the first look to the last.
const WIDTHS_M: [f64; 4] = [0.3, 0.2, 0.15, 0.15];
/// Fewer pairs say nothing.
const PAIRS_MIN: usize = 30;

/// A stretch of an upright thing between two beams, one above the other, seen from the leveled lidar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pair {
    /// Unit vector towards it.
    pub(crate) towards: Vector2<f64>,
    /// How much higher the upper return lies, meters.
    pub(crate) rise_m: f64,
    /// How much farther it lies, meters.
    pub(crate) away_m: f64,
}

/// The lean of plumb things against the ground's normal; remembers it.
#[derive(Debug, Clone)]
pub(crate) struct Plumb {
    /// Information on the lean along x and y, axes of the map.
    information: Matrix2<f64>,
    /// Information times the lean.
    vector: Vector2<f64>,
}

impl Default for Plumb {
    fn default() -> Self {
        Plumb { information: Matrix2::zeros(), vector: Vector2::zeros() }
    }
}

impl Plumb {
    /// Takes the pairs of a sweep; `heading_rad` is that of the leveled frame in the map.
    pub(crate) fn learn(&mut self, pairs: &[Pair], heading_rad: f64) {
        self.information *= MEMORY;
        self.vector *= MEMORY;
        let map_from_flat = Rotation2::new(heading_rad);
        let flat_from_map = map_from_flat.inverse();
        let mut lean = flat_from_map * self.lean();
        let mut taper = 0.0;
        let mut found = None;
        for width_m in WIDTHS_M {
            let (mut normal, mut right, mut counted) = (Matrix3::zeros(), Vector3::zeros(), 0);
            for pair in pairs {
                // Cones and crowns narrow upwards on all sides alike: that is the third unknown.
                let row = Vector3::new(pair.towards.x, pair.towards.y, 1.0) * pair.rise_m;
                let share = (pair.away_m - row.dot(&Vector3::new(lean.x, lean.y, taper))) / width_m;
                if share.abs() < 1.0 {
                    let weight = (1.0 - share * share).powi(2);
                    normal.ger(weight, &row, &row, 1.0);
                    right += row * (weight * pair.away_m);
                    counted += 1;
                }
            }
            let prior = (NOISE_M / SLOPE).powi(2) * PAIRS_PER_MEASUREMENT;
            let held = normal + Matrix3::identity() * prior;
            let Some(solved) = held.cholesky().map(|held| held.solve(&right)) else { return };
            if counted < PAIRS_MIN || !solved.iter().all(|n| n.is_finite()) {
                return;
            }
            (lean, taper) = (solved.xy(), solved.z);
            found = Some((normal, right, taper));
        }
        let Some((normal, right, taper)) = found else { return };
        // Without the taper: what is left of the lean's information.
        let mixed: Vector2<f64> = normal.fixed_view::<2, 1>(0, 2).into_owned();
        let taper_information = normal[(2, 2)].max(1e-9);
        let scale = 1.0 / (NOISE_M * NOISE_M * PAIRS_PER_MEASUREMENT);
        let open: Matrix2<f64> =
            normal.fixed_view::<2, 2>(0, 0).into_owned() - mixed * mixed.transpose() / taper_information;
        let vector: Vector2<f64> = right.xy() - mixed * (right.z / taper_information);
        // What the taper pretends is the same in every sweep: it must not average out over the sweeps remembered.
        let pretended = (LOPSIDED * taper).powi(2) / (1.0 - MEMORY);
        let trust = (Matrix2::identity() + open * (scale * pretended)).try_inverse();
        let Some(trust) = trust.filter(|trust| trust.iter().all(|n| n.is_finite())) else { return };
        let turn = map_from_flat.matrix();
        self.information += turn * trust * open * turn.transpose() * scale;
        self.vector += turn * trust * vector * scale;
    }

    /// The lean as tangents along the axes of the map.
    fn lean(&self) -> Vector2<f64> {
        let prior = Matrix2::identity() / (SLOPE * SLOPE);
        let lean = (self.information + prior).cholesky().map(|held| held.solve(&self.vector));
        lean.filter(|lean| lean.iter().all(|n| n.is_finite())).unwrap_or_else(Vector2::zeros)
    }

    /// Turns the axes of the base plumb, keeping its heading. The base's own heading: that of the frame level with the
    /// ground is another wherever the ground slopes and the base stands askew on it.
    pub(crate) fn plumb_from_base(
        &self,
        level_from_base: &Rotation3<f64>,
        heading_rad: f64,
    ) -> Rotation3<f64> {
        let lean = Rotation2::new(heading_rad).inverse() * self.lean();
        upright(&(level_from_base.inverse() * Vector3::new(lean.x, lean.y, 1.0)))
    }
}

/// Turns `up` to the z axis and leaves the x axis in its vertical plane.
pub(crate) fn upright(up: &Vector3<f64>) -> Rotation3<f64> {
    let tilt =
        Rotation3::rotation_between(&up.normalize(), &Vector3::z()).unwrap_or_else(Rotation3::identity);
    let forward = tilt * Vector3::x();
    Rotation3::from_axis_angle(&Vector3::z_axis(), -forward.y.atan2(forward.x)) * tilt
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;
    use std::f64::consts::TAU;

    /// Stretches of trunks that lean by `lean` and taper all around, seen with 2 cm of noise.
    fn grove(lean: Vector2<f64>, taper: f64) -> Vec<Pair> {
        let mut draws = Seed(3).stream("plumb").at(0);
        (0..400)
            .map(|n| {
                let bearing_rad = f64::from(n) / 400.0 * TAU;
                let towards = Vector2::new(bearing_rad.cos(), bearing_rad.sin());
                let rise_m = draws.within(0.3, 1.0);
                let noise_m = draws.within(-0.05, 0.05);
                Pair { towards, rise_m, away_m: (lean.dot(&towards) + taper) * rise_m + noise_m }
            })
            .collect()
    }

    #[test]
    fn the_lean_of_a_grove_is_found_whatever_the_heading_and_a_taper_is_none() {
        let lean = Vector2::new(0.16, -0.09);
        for (taper, heading_rad) in [(0.0, 0.0), (0.05, 0.0), (0.0, 2.0)] {
            let mut plumb = Plumb::default();
            for _ in 0..10 {
                plumb.learn(&grove(lean, taper), heading_rad);
            }
            let found = Rotation2::new(heading_rad).inverse() * plumb.lean();
            // 400 ranges with 3 cm of noise leave 0.003; the prior holds back as much, and more where things taper.
            assert!((found - lean).norm() < 0.01 + taper, "{found:?} with {taper}");
            let up = plumb.plumb_from_base(&Rotation3::identity(), heading_rad)
                * Vector3::new(found.x, found.y, 1.0);
            assert!(up.xy().norm() < 1e-9);
        }
    }

    #[test]
    fn without_upright_things_up_is_the_grounds_normal() {
        let mut plumb = Plumb::default();
        plumb.learn(&[], 0.3);
        plumb.learn(&grove(Vector2::new(0.2, 0.0), 0.0)[..PAIRS_MIN - 1], 0.3);
        assert_eq!(plumb.lean(), Vector2::zeros());
    }

    #[test]
    fn turning_upright_leaves_the_x_axis_in_its_vertical_plane() {
        let up = Vector3::new(0.3, -0.2, 1.0);
        let turned = upright(&up) * Vector3::x();
        assert!(turned.y.abs() < 1e-12 && turned.x > 0.0);
        assert!((upright(&up) * up).xy().norm() < 1e-12);
    }
}
