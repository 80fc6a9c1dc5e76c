//! How far an estimate may be off: what the points leave open, and what the map itself is wrong by.

use super::refine::Match;
use nalgebra::{Matrix3, Matrix6, Vector3};

/// Neighboring points share their errors: about so many make one independent measurement.
const POINTS_PER_MEASUREMENT: f64 = 4.0;
/// Smallest mean square of a point's distance from its map that is believed, meters^2.
const SQUARE_M2_MIN: f64 = 1e-4;
/// A gait changes the velocity within a sweep by about this, unseen by straight motion: m/s and rad/s.
const RATES: [f64; 3] = [0.1, 0.1, 0.17];
/// What the map is off by everywhere: it is drawn from estimates, and what the first ones err stays in it. Meters and, for
/// the heading, radians.
const MAP_M: f64 = 0.01;
const MAP_RAD: f64 = 0.003;
/// How far a way goes astray per meter of distance from where it began.
const ASTRAY_RATIO: f64 = 0.002;
/// Height, roll and pitch are taken as those of the first sweep: meters and radians.
const HEIGHT_M: f64 = 0.05;
const TILT_RAD: f64 = 0.052;

/// What a way may have gone astray by of which no more is known than where it leads, x, y and heading.
pub(crate) fn astray_by_distance(pose: &Vector3<f64>) -> Matrix3<f64> {
    let astray_m = ASTRAY_RATIO * pose.xy().norm();
    Matrix3::from_diagonal(&[astray_m * astray_m, astray_m * astray_m, 0.0].into())
}

/// Covariance of the pose `after_s` after the instant of the match, map frame, in the order of `Estimate::covariance`;
/// `None` when the points determine no pose. `astray` is what the way up to here may have gone astray by.
pub(crate) fn covariance(found: &Match, after_s: f64, astray: &Matrix3<f64>) -> Option<Matrix6<f64>> {
    let noise_m2 = POINTS_PER_MEASUREMENT * found.square_m2.max(SQUARE_M2_MIN);
    let mut information = found.information / noise_m2;
    for (axis, rate) in RATES.into_iter().enumerate() {
        information[(axis + 3, axis + 3)] += 1.0 / (rate * rate);
    }
    let open = information.try_inverse()?;
    // The pose then is the pose now and the rates times the way in time: [1, after_s].
    let part = |row, column| open.fixed_view::<3, 3>(row, column).into_owned();
    let mixed = part(0, 3) * after_s;
    let mut planar: Matrix3<f64> = part(0, 0) + mixed + mixed.transpose() + part(3, 3) * (after_s * after_s);
    planar += astray + Matrix3::from_diagonal(&[MAP_M, MAP_M, MAP_RAD].map(|sd| sd * sd).into());
    let mut all = Matrix6::zeros();
    for (row, i) in [0, 1, 5].into_iter().enumerate() {
        for (column, j) in [0, 1, 5].into_iter().enumerate() {
            all[(i, j)] = planar[(row, column)];
        }
    }
    all[(2, 2)] = HEIGHT_M * HEIGHT_M;
    all[(3, 3)] = TILT_RAD * TILT_RAD;
    all[(4, 4)] = TILT_RAD * TILT_RAD;
    all.iter().all(|n| n.is_finite()).then_some(all)
}

#[cfg(test)]
mod tests {
    use super::super::motion::Motion;
    use super::*;
    use arborloop_base::Time;

    fn found(information: Matrix6<f64>) -> Match {
        let motion = Motion { stamp: Time::default(), pose: Vector3::zeros(), velocity: Vector3::zeros() };
        Match { motion, cost_m: 0.02, half_m: 0.02, information, square_m2: 0.02 * 0.02 }
    }

    #[test]
    fn more_points_say_more_and_the_future_is_less_certain() {
        let few = covariance(&found(Matrix6::identity() * 10.0), 0.0, &Matrix3::zeros()).unwrap();
        let many = covariance(&found(Matrix6::identity() * 100.0), 0.0, &Matrix3::zeros()).unwrap();
        let later = covariance(&found(Matrix6::identity() * 100.0), 0.05, &Matrix3::zeros()).unwrap();
        for axis in [0, 1, 5] {
            assert!(many[(axis, axis)] < few[(axis, axis)] && many[(axis, axis)] < later[(axis, axis)]);
        }
        // One hundred points of 2 cm, four to a measurement, and the map's own centimeter.
        assert!((many[(0, 0)] - (4.0 * 0.02_f64.powi(2) / 100.0 + MAP_M * MAP_M)).abs() < 1e-9);
        assert!(many.symmetric_eigenvalues().min() > 0.0);
    }

    #[test]
    fn a_direction_that_no_point_speaks_of_has_no_covariance() {
        let mut along_x = Matrix6::identity() * 100.0;
        along_x[(0, 0)] = 0.0;
        assert_eq!(covariance(&found(along_x), 0.0, &Matrix3::zeros()), None);
    }
}
