//! The pose graph: places joined by the steps between them and by returns, and the poses that agree with all of them best.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation2, Vector3};
use nalgebra_sparse::{CooMatrix, CscMatrix, factorization::CscCholesky};

/// Gauss-Newton steps at most, and the largest change that ends them, meters and radians.
const STEPS_MAX: usize = 10;
const SMALL: f64 = 1e-5;
/// A return that is off by so many of its own standard deviations counts a quarter (Geman and McClure): one that is false
/// must not bend the map.
const ODD: f64 = 6.0;

/// A planar pose `b`, given in the frame of `a`, in the frame that `a` is given in; headings are not wrapped.
pub(crate) fn onto(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    let along = Rotation2::new(a.z) * b.xy();
    Vector3::new(a.x + along.x, a.y + along.y, a.z + b.z)
}

/// A planar pose `b` as it is seen from `a`, both given in one frame.
pub(crate) fn seen_from(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    let along = Rotation2::new(-a.z) * (b.xy() - a.xy());
    Vector3::new(along.x, along.y, b.z - a.z)
}

/// Derivatives of `seen_from` along the pose of `a` and along that of `b`.
fn slopes(a: &Vector3<f64>, b: &Vector3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    let (sin, cos) = a.z.sin_cos();
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let along_a =
        Matrix3::new(-cos, -sin, -sin * dx + cos * dy, sin, -cos, -cos * dx - sin * dy, 0.0, 0.0, -1.0);
    let along_b = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
    (along_a, along_b)
}

/// Covariance of a pose that is `step` from another, of which and of the step the covariances are given.
pub(crate) fn carried(
    pose: &Vector3<f64>,
    covariance: &Matrix3<f64>,
    step: &Vector3<f64>,
    of_step: &Matrix3<f64>,
) -> Matrix3<f64> {
    let way = Rotation2::new(pose.z) * step.xy();
    let along_pose = Matrix3::new(1.0, 0.0, -way.y, 0.0, 1.0, way.x, 0.0, 0.0, 1.0);
    let (sin, cos) = pose.z.sin_cos();
    let along_step = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    along_pose * covariance * along_pose.transpose() + along_step * of_step * along_step.transpose()
}

/// What was measured of one place from another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edge {
    from: usize,
    to: usize,
    /// The pose of `to` in the frame of `from`.
    seen: Vector3<f64>,
    /// Inverse of its covariance.
    information: Matrix3<f64>,
    /// Whether it may be false: a return may, a step may not.
    is_return: bool,
}

impl Edge {
    /// One with the variances along x, y and of the heading that it has at `from`.
    pub(crate) fn new(
        from: usize,
        to: usize,
        seen: Vector3<f64>,
        variances: &Vector3<f64>,
        is_return: bool,
    ) -> Self {
        let information = Matrix3::from_diagonal(&variances.map(f64::recip));
        Edge { from, to, seen, information, is_return }
    }

    fn residual(&self, poses: &[Vector3<f64>]) -> Vector3<f64> {
        let mut off = seen_from(&poses[self.from], &poses[self.to]) - self.seen;
        off.z = arborloop_base::wrap_angle(off.z);
        off
    }

    /// How far it is off, in its own standard deviations, squared.
    fn odds(&self, poses: &[Vector3<f64>]) -> f64 {
        let off = self.residual(poses);
        off.dot(&(self.information * off))
    }
}

/// Moves all poses but the first to where they agree with the edges best. The covariance of the last one as seen from the
/// first; `None` where the edges do not hold all poses, which then stay.
pub(crate) fn relax(poses: &mut [Vector3<f64>], edges: &[Edge]) -> Option<Matrix3<f64>> {
    let free = poses.len().saturating_sub(1) * 3;
    let mut covariance = Matrix3::zeros();
    if free == 0 {
        return Some(covariance);
    }
    for _ in 0..STEPS_MAX {
        let mut normal = CooMatrix::new(free, free);
        let mut right = DVector::zeros(free);
        for edge in edges {
            let off = edge.residual(poses);
            let trust = if edge.is_return { (1.0 + edge.odds(poses) / (ODD * ODD)).powi(-2) } else { 1.0 };
            let weight = edge.information * trust;
            let (along_from, along_to) = slopes(&poses[edge.from], &poses[edge.to]);
            let ends = [(edge.from, along_from), (edge.to, along_to)];
            for (row, row_slopes) in ends.iter().filter(|(place, _)| *place > 0) {
                let start = (row - 1) * 3;
                let pull = row_slopes.transpose() * weight * off;
                for axis in 0..3 {
                    right[start + axis] -= pull[axis];
                }
                for (column, column_slopes) in ends.iter().filter(|(place, _)| *place > 0) {
                    let block = row_slopes.transpose() * weight * column_slopes;
                    normal.push_matrix(start, (column - 1) * 3, &block);
                }
            }
        }
        let factors = CscCholesky::factor(&CscMatrix::from(&normal)).ok()?;
        let step = factors.solve(&right);
        if !step.iter().all(|n| n.is_finite()) {
            return None;
        }
        for (pose, step) in poses[1..].iter_mut().zip(step.as_slice().chunks_exact(3)) {
            *pose += Vector3::from_column_slice(step);
        }
        let of_last = factors
            .solve(&DMatrix::from_fn(free, 3, |row, axis| if row == free - 3 + axis { 1.0 } else { 0.0 }));
        covariance = of_last.fixed_view::<3, 3>(free - 3, 0).into_owned();
        if step.amax() < SMALL {
            break;
        }
    }
    Some(covariance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A square of four sides of ten steps of a meter, each of which turns too far by a little.
    fn crooked(turn_off_rad: f64) -> (Vec<Vector3<f64>>, Vec<Edge>) {
        let (mut poses, mut edges) = (vec![Vector3::zeros()], Vec::new());
        for step in 0..40_usize {
            let turn = if step % 10 == 9 { 0.5 * PI } else { 0.0 };
            let seen = Vector3::new(1.0, 0.0, turn + turn_off_rad);
            poses.push(onto(&poses[step], &seen));
            let information = Matrix3::from_diagonal(&[1e4, 1e4, 1e5].into());
            edges.push(Edge { from: step, to: step + 1, seen, information, is_return: false });
        }
        (poses, edges)
    }

    fn home(seen: Vector3<f64>) -> Edge {
        let information = Matrix3::from_diagonal(&[1e4, 1e4, 1e6].into());
        Edge { from: 0, to: 40, seen, information, is_return: true }
    }

    #[test]
    fn a_pose_seen_from_another_lies_there_again() {
        let (a, b) = (Vector3::new(1.0, -2.0, 0.7), Vector3::new(-3.0, 0.5, -1.9));
        assert!((onto(&a, &seen_from(&a, &b)) - b).norm() < 1e-12);
        let (along_a, along_b) = slopes(&a, &b);
        for axis in 0..3 {
            let mut off = Vector3::zeros();
            off[axis] = 1e-6;
            let numeric = |moved: Vector3<f64>| (moved - seen_from(&a, &b)) / 1e-6;
            assert!((numeric(seen_from(&(a + off), &b)) - along_a.column(axis)).norm() < 1e-5);
            assert!((numeric(seen_from(&a, &(b + off))) - along_b.column(axis)).norm() < 1e-5);
        }
    }

    #[test]
    fn a_return_bends_a_crooked_square_back_into_shape() {
        let (mut poses, mut edges) = crooked(0.001);
        assert!(poses[40].xy().norm() > 0.2);
        edges.push(home(Vector3::new(0.0, 0.0, 2.0 * PI)));
        assert!(relax(&mut poses, &edges).is_some());
        assert_eq!(poses[0], Vector3::zeros());
        assert!(poses[40].xy().norm() < 0.02, "{}", poses[40]);
        assert!((poses[20].xy() - nalgebra::Vector2::new(10.0, 10.0)).norm() < 0.05, "{}", poses[20]);
    }

    #[test]
    fn the_covariance_of_the_last_pose_is_that_carried_along_the_steps_until_a_return_holds_it() {
        let (mut poses, mut edges) = crooked(0.0);
        let of_step = edges[0].information.try_inverse().unwrap();
        let slow = edges
            .iter()
            .zip(&poses)
            .fold(Matrix3::zeros(), |all, (edge, pose)| carried(pose, &all, &edge.seen, &of_step));
        let found = relax(&mut poses, &edges).unwrap();
        assert!((found - slow).norm() < 1e-6 * slow.norm(), "{found} {slow}");
        edges.push(home(Vector3::new(0.0, 0.0, 2.0 * PI)));
        let held = relax(&mut poses, &edges).unwrap();
        assert!(held[(0, 0)] < 1e-4 && held[(0, 0)] > 0.5e-4 && found[(0, 0)] > 1e-2, "{held} {found}");
    }

    #[test]
    fn a_false_return_does_not_bend_what_all_others_agree_on() {
        let (straight, mut edges) = crooked(0.0);
        edges.push(home(Vector3::new(0.0, 0.0, 2.0 * PI)));
        let from_20 = Edge { from: 20, to: 40, ..home(seen_from(&straight[20], &straight[40])) };
        edges.push(from_20);
        edges.push(Edge { from: 10, to: 35, ..home(Vector3::new(3.0, 1.0, 0.4)) });
        let mut poses = straight.clone();
        assert!(relax(&mut poses, &edges).is_some());
        let off = poses.iter().zip(&straight).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 0.02, "{off}");
    }

    #[test]
    fn what_is_carried_along_a_step_spreads_by_the_heading() {
        let heading_only = Matrix3::from_diagonal(&[0.0, 0.0, 1e-4].into());
        let (pose, step) = (Vector3::new(5.0, 2.0, 0.5 * PI), Vector3::new(10.0, 0.0, 0.0));
        let all = carried(&pose, &heading_only, &step, &Matrix3::zeros());
        assert!((all[(0, 0)] - 1e-2).abs() < 1e-9 && all[(1, 1)].abs() < 1e-9);
        assert!((all[(0, 2)] + 1e-3).abs() < 1e-9);
    }

    #[test]
    fn a_lone_place_and_a_graph_in_two_parts_are_no_error() {
        assert_eq!(relax(&mut [Vector3::zeros()], &[]), Some(Matrix3::zeros()));
        let (mut poses, edges) = crooked(0.0);
        poses.push(Vector3::new(9.0, 9.0, 0.0));
        let before = poses.clone();
        assert_eq!(relax(&mut poses, &edges), None);
        assert_eq!(poses, before);
    }
}
