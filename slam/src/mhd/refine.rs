//! Gauss-Newton on the distance field: from a hypothesis to the pose and velocity that the points support best.

use super::features::Feature;
use super::field::Field;
use super::motion::Motion;
use crate::kbest::{kept_of, mean_of_smallest};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

const STEPS_MAX: usize = 12;
/// Distances below this are noise: they all weigh the same, metres.
const NOISE_M: f64 = 0.03;
/// Levenberg-Marquardt damping, relative to the diagonal.
const DAMPING: f64 = 1e-3;
/// A step below this ends the refinement, metres and radians.
const STILL: f64 = 1e-5;
/// Weights of the velocity's ties, as shares of the data's weight: to the increment since the last sweep, and to the
/// last velocity. A trapezoidal tie (mean of both velocities = increment) rings with period two and diverges.
const TO_INCREMENT: f64 = 0.07;
const TO_PREVIOUS: f64 = 0.07;

/// A refined hypothesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Match {
    /// Pose and velocity.
    pub(crate) motion: Motion,
    /// k-best mean of the distances of all points, metres.
    pub(crate) cost_m: f64,
    /// Mean of the smaller half of the distances, metres: small at the right pose even where half of the view is new.
    pub(crate) half_m: f64,
    /// Information on x, y, heading from the points that count, per metre^2 of their noise.
    pub(crate) information: Matrix3<f64>,
    /// Mean square of the distances that count, metres^2.
    pub(crate) square_m2: f64,
}

/// Refines hypotheses; keeps its memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Refine {
    residuals: Vec<(f64, Vector6<f64>)>,
    distances: Vec<f32>,
    limit_m: f64,
}

impl Refine {
    /// Refines `start` over `duration_s`, the time that the sweep took; `before` is the motion of the last sweep.
    pub(crate) fn run(
        &mut self,
        field: &Field,
        features: &[Feature],
        start: Motion,
        before: &Motion,
        duration_s: f64,
        keep_ratio: f64,
    ) -> Match {
        let mut motion = start;
        let mut best = self.weigh(field, features, &motion, keep_ratio);
        for _ in 0..STEPS_MAX {
            let Some(step) = self.step(features.len(), &motion, before, duration_s) else {
                break;
            };
            motion.pose += step.fixed_rows::<3>(0);
            motion.velocity += step.fixed_rows::<3>(3);
            let found = self.weigh(field, features, &motion, keep_ratio);
            if found.cost_m < best.cost_m {
                best = found;
            }
            if step.fixed_rows::<3>(0).norm() < STILL {
                best = found;
                break;
            }
        }
        best
    }

    /// Distances and derivatives of all points at a motion.
    fn weigh(&mut self, field: &Field, features: &[Feature], motion: &Motion, keep_ratio: f64) -> Match {
        self.residuals.clear();
        self.distances.clear();
        for feature in features {
            let place = motion.place(&feature.at, feature.after_s);
            let slope = field.slope(feature.layer, place.x, place.y);
            let arm = place - (motion.pose.xy() + motion.velocity.xy() * feature.after_s);
            let (gx, gy) = slope.along;
            // d distance / d (x, y, heading); the velocity's derivatives are these times the point's time.
            let turn = gy * arm.x - gx * arm.y;
            let time = feature.after_s;
            let row = Vector6::new(gx, gy, turn, gx * time, gy * time, turn * time);
            self.residuals.push((slope.distance_m, row));
            self.distances.push(slope.distance_m as f32);
        }
        let cost_m = mean_of_smallest(&mut self.distances, keep_ratio).unwrap_or(field.cap_m());
        let limit_m = self.last_of(keep_ratio);
        self.limit_m = limit_m;
        let (mut information, mut square_m2, mut count) = (Matrix3::zeros(), 0.0, 0.0);
        for (distance_m, row) in self.residuals.iter().filter(|(distance_m, _)| *distance_m <= limit_m) {
            let row = row.fixed_rows::<3>(0);
            information += row * row.transpose();
            square_m2 += distance_m * distance_m;
            count += 1.0;
        }
        let half_m = mean_of_smallest(&mut self.distances, 0.5).unwrap_or(field.cap_m());
        Match { motion: *motion, cost_m, half_m, information, square_m2: square_m2 / f64::max(count, 1.0) }
    }

    /// The distance of the last point that counts; `distances` are partly sorted.
    fn last_of(&self, keep_ratio: f64) -> f64 {
        let kept = kept_of(self.distances.len(), keep_ratio).unwrap_or(0);
        self.distances[..kept].iter().copied().fold(0.0_f32, f32::max).into()
    }

    /// One damped step of iteratively reweighted least squares on (pose, velocity).
    fn step(&self, points: usize, motion: &Motion, before: &Motion, duration_s: f64) -> Option<Vector6<f64>> {
        let limit_m = self.limit_m;
        let (mut normal, mut right, mut total) = (Matrix6::zeros(), Vector6::zeros(), 0.0);
        for (distance_m, row) in self.residuals.iter().filter(|(distance_m, _)| *distance_m <= limit_m) {
            let weight = 1.0 / distance_m.max(NOISE_M);
            normal.ger(weight, row, row, 1.0);
            right -= row * (weight * distance_m);
            total += weight;
        }
        if points == 0 || total <= 0.0 {
            return None;
        }
        let elapsed_s = (motion.stamp - before.stamp).seconds();
        if duration_s > 0.0 && elapsed_s > 0.0 {
            // Both in way per sweep, so that the weights do not depend on the sweep's duration.
            let increment = (motion.pose - before.pose) / elapsed_s;
            for axis in 0..3 {
                let scale = duration_s;
                let (to_increment, to_previous) = (TO_INCREMENT * total, TO_PREVIOUS * total);
                let residual = (motion.velocity[axis] - increment[axis]) * scale;
                let (of_velocity, of_pose) = (scale, -scale / elapsed_s);
                normal[(axis + 3, axis + 3)] += to_increment * of_velocity * of_velocity;
                normal[(axis, axis)] += to_increment * of_pose * of_pose;
                normal[(axis, axis + 3)] += to_increment * of_velocity * of_pose;
                normal[(axis + 3, axis)] += to_increment * of_velocity * of_pose;
                right[axis + 3] -= to_increment * of_velocity * residual;
                right[axis] -= to_increment * of_pose * residual;
                let residual = (motion.velocity[axis] - before.velocity[axis]) * scale;
                normal[(axis + 3, axis + 3)] += to_previous * scale * scale;
                right[axis + 3] -= to_previous * scale * residual;
            }
        }
        for axis in 0..6 {
            normal[(axis, axis)] += DAMPING * normal[(axis, axis)] + 1e-9;
        }
        let step: Vector6<f64> = normal.cholesky()?.solve(&right);
        let sane = step.iter().all(|n| n.is_finite()) && Vector3::from(step.fixed_rows::<3>(0)).norm() < 2.0;
        sane.then_some(step)
    }
}
