//! The one rigid motion, never a scale, that carries an estimate's frame into the reference's before they are compared.

use crate::associate::Pair;
use crate::score::ScoreError;
use arborloop_base::Pose;
use nalgebra::{Matrix3, Matrix4, Quaternion, SymmetricEigen, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::fmt;

/// How an estimate is laid over the reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Alignment {
    /// Not at all: both are already in one frame.
    None,
    /// First poses put together, all six degrees of freedom (evo's `--align_origin`).
    Origin,
    /// First positions put together and the heading about them fitted to all positions: for a reference without
    /// headings. The estimate keeps its own level.
    OriginYaw,
    /// Least squares over x, y and heading (Umeyama's in the plane); heights, roll and pitch are left alone.
    Se2,
    /// Least squares over all six degrees of freedom (Umeyama's without scale, evo's `--align`).
    Se3,
}

impl Alignment {
    /// What tells evo 1.38 to align the same way; `None` for the alignments that it does not have.
    pub fn evo_flag(self) -> Option<&'static str> {
        match self {
            Alignment::None => Some(""),
            Alignment::Origin => Some("--align_origin"),
            Alignment::Se3 => Some("--align"),
            Alignment::OriginYaw | Alignment::Se2 => None,
        }
    }
}

impl fmt::Display for Alignment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Alignment::None => "none",
            Alignment::Origin => "first pose",
            Alignment::OriginYaw => "first position, heading fitted",
            Alignment::Se2 => "SE(2) least squares",
            Alignment::Se3 => "SE(3) least squares",
        })
    }
}

/// The motion `reference_from_estimate` of an alignment; identity for no pairs.
///
/// # Errors
/// [`ScoreError::Degenerate`] when the positions leave the fitted rotation undetermined: all in one place, or, for
/// [`Alignment::Se3`], all on one line.
pub fn align(pairs: &[Pair], alignment: Alignment) -> Result<Pose, ScoreError> {
    let Some(first) = pairs.first() else { return Ok(Pose::identity()) };
    match alignment {
        Alignment::None => Ok(Pose::identity()),
        Alignment::Origin => Ok(first.reference * first.estimate.inverse()),
        Alignment::OriginYaw => {
            let reference_origin = first.reference.translation.vector;
            let estimate_origin = first.estimate.translation.vector;
            fitted_about_z(pairs, &reference_origin, &estimate_origin, reference_origin.z - estimate_origin.z)
        }
        Alignment::Se2 => {
            let (reference_mean, estimate_mean) = means(pairs);
            fitted_about_z(pairs, &reference_mean, &estimate_mean, 0.0)
        }
        Alignment::Se3 => fitted_in_space(pairs),
    }
}

/// Planar least squares about two given centers: the angle that maximizes the correlation of the centered positions.
fn fitted_about_z(
    pairs: &[Pair],
    reference_center: &Vector3<f64>,
    estimate_center: &Vector3<f64>,
    lift_m: f64,
) -> Result<Pose, ScoreError> {
    let (mut dot, mut cross, mut scale) = (0.0, 0.0, 0.0);
    for pair in pairs {
        let g = pair.reference.translation.vector - reference_center;
        let p = pair.estimate.translation.vector - estimate_center;
        dot += p.x * g.x + p.y * g.y;
        cross += p.x * g.y - p.y * g.x;
        scale += g.xy().norm_squared() + p.xy().norm_squared();
    }
    if cross.hypot(dot) <= 1e-12 * scale || scale == 0.0 {
        return Err(ScoreError::Degenerate { wanted: "positions in at least two places" });
    }
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), cross.atan2(dot));
    let mut translation = reference_center - rotation * estimate_center;
    translation.z = lift_m;
    Ok(Pose::from_parts(Translation3::from(translation), rotation))
}

/// Umeyama 1991 without scale, by Horn's quaternion (1987): the eigenvector of the largest eigenvalue of a symmetric
/// 4 x 4 matrix of the covariance. Both give the same proper rotation; Horn's needs no case for reflections.
fn fitted_in_space(pairs: &[Pair]) -> Result<Pose, ScoreError> {
    let (reference_mean, estimate_mean) = means(pairs);
    let mut s = Matrix3::zeros();
    for pair in pairs {
        let g = pair.reference.translation.vector - reference_mean;
        let p = pair.estimate.translation.vector - estimate_mean;
        s += p * g.transpose();
    }
    #[rustfmt::skip]
    let horn = Matrix4::new(
        s.trace(),         s.m23 - s.m32,          s.m31 - s.m13,          s.m12 - s.m21,
        s.m23 - s.m32,     s.m11 - s.m22 - s.m33,  s.m12 + s.m21,          s.m31 + s.m13,
        s.m31 - s.m13,     s.m12 + s.m21,          s.m22 - s.m11 - s.m33,  s.m23 + s.m32,
        s.m12 - s.m21,     s.m31 + s.m13,          s.m23 + s.m32,          s.m33 - s.m11 - s.m22,
    );
    let eigen = SymmetricEigen::new(horn);
    let mut order = [0, 1, 2, 3];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let (largest, second) = (eigen.eigenvalues[order[0]], eigen.eigenvalues[order[1]]);
    // The gap is twice the sum of the two smaller singular values (signed): zero for points on one line.
    if largest - second <= 1e-12 * s.norm() || s.norm() == 0.0 {
        return Err(ScoreError::Degenerate { wanted: "positions that are not all on one line" });
    }
    let q = eigen.eigenvectors.column(order[0]);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]));
    let translation = reference_mean - rotation * estimate_mean;
    Ok(Pose::from_parts(Translation3::from(translation), rotation))
}

fn means(pairs: &[Pair]) -> (Vector3<f64>, Vector3<f64>) {
    let sum = pairs.iter().fold((Vector3::zeros(), Vector3::zeros()), |(g, p), pair| {
        (g + pair.reference.translation.vector, p + pair.estimate.translation.vector)
    });
    (sum.0 / pairs.len() as f64, sum.1 / pairs.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Time, yaw_of};

    const ALL: [Alignment; 5] =
        [Alignment::None, Alignment::Origin, Alignment::OriginYaw, Alignment::Se2, Alignment::Se3];

    fn motion(x: f64, y: f64, z: f64, roll: f64, pitch: f64, yaw: f64) -> Pose {
        Pose::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
    }

    /// A curved path, and the same path seen from a frame that `reference_from_estimate` carries into the reference's.
    fn seen_from(reference_from_estimate: &Pose) -> Vec<Pair> {
        (0..50)
            .map(|n| {
                let t = f64::from(n) * 0.2;
                let reference = motion(t, (0.6 * t).sin() * 3.0, 0.2 * t.cos(), 0.02 * t, -0.01 * t, 0.3 * t);
                let estimate = reference_from_estimate.inverse() * reference;
                Pair { stamp: Time::from_nanos(i64::from(n)), reference, estimate }
            })
            .collect()
    }

    fn distance(a: &Pose, b: &Pose) -> f64 {
        (a.translation.vector - b.translation.vector).norm() + a.rotation.angle_to(&b.rotation)
    }

    #[test]
    fn a_rigid_motion_within_its_freedom_is_found_again_by_every_alignment() {
        for (alignment, truth) in [
            (Alignment::Origin, motion(3.0, -2.0, 0.5, 0.1, -0.2, 2.9)),
            (Alignment::OriginYaw, motion(3.0, -2.0, 0.5, 0.0, 0.0, 2.9)),
            (Alignment::Se2, motion(3.0, -2.0, 0.0, 0.0, 0.0, -3.1)),
            (Alignment::Se3, motion(3.0, -2.0, 0.5, 0.1, -0.2, 2.9)),
        ] {
            let found = align(&seen_from(&truth), alignment).unwrap();
            assert!(distance(&found, &truth) < 1e-10, "{alignment}: {found} for {truth}");
        }
        assert_eq!(
            align(&seen_from(&motion(1.0, 0.0, 0.0, 0.0, 0.0, 1.0)), Alignment::None).unwrap(),
            Pose::identity()
        );
    }

    #[test]
    fn the_fitted_motion_beats_its_neighbors() {
        let mut pairs = seen_from(&motion(1.0, 2.0, 0.1, 0.0, 0.0, 0.4));
        for (n, pair) in pairs.iter_mut().enumerate() {
            pair.estimate.translation.vector +=
                Vector3::new((n as f64).sin(), (2.0 * n as f64).cos(), 0.3) * 0.1;
        }
        let cost = |motion: &Pose| -> f64 {
            let off = |p: &Pair| {
                (p.reference.translation.vector - (motion * p.estimate).translation.vector).norm_squared()
            };
            pairs.iter().map(off).sum()
        };
        let best = align(&pairs, Alignment::Se3).unwrap();
        for axis in 0..6 {
            for step in [-1e-3, 1e-3] {
                let mut nudge = [0.0; 6];
                nudge[axis] = step;
                let nudged = motion(nudge[0], nudge[1], nudge[2], nudge[3], nudge[4], nudge[5]) * best;
                assert!(cost(&nudged) > cost(&best), "axis {axis}");
            }
        }
        let planar = align(&pairs, Alignment::Se2).unwrap();
        assert!(cost(&planar) >= cost(&best));
        assert!((yaw_of(&planar) - yaw_of(&best)).abs() < 0.1);
    }

    #[test]
    fn a_mirrored_path_is_turned_but_never_mirrored() {
        let mut pairs = seen_from(&Pose::identity());
        for pair in &mut pairs {
            pair.estimate.translation.vector.x *= -1.0;
        }
        let found = align(&pairs, Alignment::Se3).unwrap();
        assert!((found.rotation.to_rotation_matrix().matrix().determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn positions_that_leave_the_rotation_open_are_refused() {
        let still: Vec<Pair> = seen_from(&Pose::identity())
            .into_iter()
            .map(|pair| Pair { reference: Pose::identity(), estimate: Pose::identity(), ..pair })
            .collect();
        for alignment in [Alignment::OriginYaw, Alignment::Se2, Alignment::Se3] {
            assert!(matches!(align(&still, alignment), Err(ScoreError::Degenerate { .. })), "{alignment}");
        }
        let line: Vec<Pair> = (0..10)
            .map(|n| {
                let pose = Pose::translation(f64::from(n), 2.0 * f64::from(n), 0.0);
                Pair { stamp: Time::from_nanos(n.into()), reference: pose, estimate: pose }
            })
            .collect();
        assert!(matches!(align(&line, Alignment::Se3), Err(ScoreError::Degenerate { .. })));
        assert!(distance(&align(&line, Alignment::Se2).unwrap(), &Pose::identity()) < 1e-12);
    }

    #[test]
    fn no_pairs_need_no_motion() {
        for alignment in ALL {
            assert_eq!(align(&[], alignment).unwrap(), Pose::identity());
        }
    }
}
