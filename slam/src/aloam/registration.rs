//! Alignment of points with lines and planes: Levenberg-Marquardt with Huber's loss.

use arborloop_base::Pose;
use nalgebra::{Matrix3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};

/// Huber's width: residuals beyond it count linearly, meters.
const HUBER_M: f64 = 0.1;
/// Steps of one alignment.
const STEPS: usize = 4;
/// Damping relative to the diagonal: the reciprocal of the solver's initial trust region, and its changes.
const DAMPING: f64 = 1e-4;
const EASED: f64 = 1.0 / 3.0;
const STIFFENED: f64 = 2.0;
/// A step longer than this (meters and radians together) comes from a system that determines nothing.
const STEP_MAX: f64 = 10.0;

/// A point and what it lies on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pair {
    /// The point in the frame that is to be aligned, meters.
    point: Vector3<f64>,
    /// A place on the line or plane.
    place: Vector3<f64>,
    /// Projects on the directions in which the point must not move: across the line, or along the plane's normal.
    across: Matrix3<f64>,
}

impl Pair {
    /// A point that lies on a line through `place` along a unit vector.
    pub(crate) fn on_line(point: Vector3<f64>, place: Vector3<f64>, along: Vector3<f64>) -> Self {
        Pair { point, place, across: Matrix3::identity() - along * along.transpose() }
    }

    /// A point that lies on a plane through `place` with a unit normal.
    pub(crate) fn on_plane(point: Vector3<f64>, place: Vector3<f64>, normal: Vector3<f64>) -> Self {
        Pair { point, place, across: normal * normal.transpose() }
    }

    /// The point turned and its distance vector from line or plane.
    fn residual(&self, pose: &Pose) -> (Vector3<f64>, Vector3<f64>) {
        let turned = pose.rotation * self.point;
        let at = turned + pose.translation.vector;
        (turned, self.across * (at - self.place))
    }
}

/// The pose that brings the points nearest to their lines and planes, from a first guess.
///
/// The public program's solver corrects Huber's loss to second order (Triggs); weights reach the same minimum.
pub(crate) fn align(guess: &Pose, pairs: &[Pair]) -> Pose {
    let mut pose = *guess;
    let mut cost = cost_of(&pose, pairs);
    let mut damping = DAMPING;
    for _ in 0..STEPS {
        let Some(step) = step(&pose, pairs, damping) else { break };
        let moved = Pose::from_parts(
            Translation3::from(pose.translation.vector + step.fixed_rows::<3>(0)),
            UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(3).into_owned()) * pose.rotation,
        );
        let reached = cost_of(&moved, pairs);
        if reached < cost {
            (pose, cost) = (moved, reached);
            damping *= EASED;
        } else {
            damping *= STIFFENED;
        }
    }
    pose
}

fn step(pose: &Pose, pairs: &[Pair], damping: f64) -> Option<Vector6<f64>> {
    let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
    for pair in pairs {
        let (turned, residual) = pair.residual(pose);
        let weight = (HUBER_M / residual.norm()).min(1.0);
        // Moves of the point by (translation, small turn after the pose's own): [1, -turned x].
        let turn = -turned.cross_matrix();
        let across_turn = pair.across * turn;
        let mut add = |row: usize, column: usize, block: Matrix3<f64>| {
            let mut target = normal.fixed_view_mut::<3, 3>(row, column);
            target += block * weight;
        };
        add(0, 0, pair.across);
        add(0, 3, across_turn);
        add(3, 3, turn.transpose() * across_turn);
        let mut above = right.fixed_rows_mut::<3>(0);
        above -= residual * weight;
        let mut below = right.fixed_rows_mut::<3>(3);
        below -= turn.transpose() * residual * weight;
    }
    let corner = normal.fixed_view::<3, 3>(0, 3).transpose();
    normal.fixed_view_mut::<3, 3>(3, 0).copy_from(&corner);
    for axis in 0..6 {
        normal[(axis, axis)] += damping * normal[(axis, axis)] + 1e-9;
    }
    let step: Vector6<f64> = normal.cholesky()?.solve(&right);
    (step.iter().all(|n| n.is_finite()) && step.norm() < STEP_MAX).then_some(step)
}

fn cost_of(pose: &Pose, pairs: &[Pair]) -> f64 {
    let costs = pairs.iter().map(|pair| {
        let off_m = pair.residual(pose).1.norm();
        if off_m <= HUBER_M { 0.5 * off_m * off_m } else { HUBER_M * (off_m - 0.5 * HUBER_M) }
    });
    costs.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;

    /// Points on walls, a floor and poles, as seen from a pose.
    fn pairs(pose: &Pose) -> Vec<Pair> {
        let mut draws = Seed(8).stream("pairs").at(0);
        (0..120)
            .map(|n| {
                let place = Vector3::from_fn(|_, _| draws.within(-5.0, 5.0));
                let direction = [Vector3::x(), Vector3::y(), Vector3::z()][n % 3];
                let point = pose.inverse() * nalgebra::Point3::from(place);
                if n < 60 {
                    let on = place + direction * draws.within(-1.0, 1.0);
                    Pair::on_line(point.coords, on, direction)
                } else {
                    let on = place + direction.cross(&Vector3::new(0.3, 0.5, 0.7)) * draws.within(-1.0, 1.0);
                    Pair::on_plane(point.coords, on, direction)
                }
            })
            .collect()
    }

    #[test]
    fn the_pose_is_found_from_points_on_lines_and_planes() {
        let pose = Pose::new(Vector3::new(0.05, -0.03, 0.02), Vector3::new(0.01, -0.02, 0.05));
        let off = pose.inverse() * align(&Pose::identity(), &pairs(&pose));
        // Four quadratically converging steps from some centimeters away.
        assert!(off.translation.vector.norm() < 1e-4 && off.rotation.angle() < 1e-4, "{off}");
    }

    #[test]
    fn a_right_pose_stays_and_nothing_to_align_moves_nothing() {
        let pose = Pose::new(Vector3::new(0.5, 0.3, 0.2), Vector3::new(0.1, 0.2, 0.3));
        assert!((pose.inverse() * align(&pose, &pairs(&pose))).translation.vector.norm() < 1e-12);
        assert_eq!(align(&pose, &[]), pose);
    }
}
