//! Gauss-Newton (Levenberg-Marquardt) on the distance field: from a hypothesis to the pose and velocity that the points support best.

use super::features::Feature;
use super::field::Field;
use super::motion::Motion;
use super::skew::Skew;
use crate::kbest::{kept_of, mean_of_smallest};
use nalgebra::{Matrix6, Vector3, Vector6};

const STEPS_MAX: usize = 20;
/// Levenberg-Marquardt damping relative to the diagonal: at the start, its bounds, and its change by a step that succeeds
/// or fails.
const DAMPING: f64 = 1e-3;
const DAMPING_MIN: f64 = 1e-6;
const DAMPING_MAX: f64 = 1e3;
const EASED: f64 = 0.3;
const STIFFENED: f64 = 8.0;
/// A gain below this share of what is left ends the refinement.
const GAIN_MIN: f64 = 1e-4;
/// Weights of the velocity's ties per point, in 1/m (1/rad for the heading): to the increment since the last sweep, and
/// to the last velocity. A trapezoidal tie (mean of both velocities = increment) rings with period two and diverges.
/// The turn rate follows the heading, never the heading the turn rate: what foliage pretends the robot to turn within a
/// sweep (`skew.rs`) would be handed on, 0.3 degrees in 100 m of hedges.
const TO_INCREMENT: f64 = 30.0;
const TO_PREVIOUS: f64 = 1.0;

/// A refined hypothesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Match {
    /// Pose and velocity.
    pub(crate) motion: Motion,
    /// k-best mean of the distances of all points, meters.
    pub(crate) cost_m: f64,
    /// Mean of the smaller half of the distances, meters: small at the right pose even where half of the view is new.
    pub(crate) half_m: f64,
    /// Information on x, y, heading and their rates from the points that count, per meter^2 of their noise.
    pub(crate) information: Matrix6<f64>,
    /// Mean square of the distances that count, meters^2.
    pub(crate) square_m2: f64,
}

/// Refines hypotheses; keeps its memory.
#[derive(Debug, Clone)]
pub(crate) struct Refine {
    /// A point at this distance counts half, meters; infinite when all count the same.
    pub(crate) far_m: f64,
    /// What the points' turn within a sweep is off by.
    pub(crate) skew: Skew,
    residuals: Vec<Residual>,
    before_step: Vec<Residual>,
    distances: Vec<f32>,
    limit_m: f64,
}

/// One point at one motion.
#[derive(Debug, Clone, Copy)]
struct Residual {
    distance_m: f64,
    /// Derivatives of the distance along pose and velocity.
    row: Vector6<f64>,
    /// How much it counts.
    share: f64,
}

impl Default for Refine {
    fn default() -> Self {
        Refine {
            far_m: f64::INFINITY,
            skew: Skew::default(),
            residuals: Vec::new(),
            before_step: Vec::new(),
            distances: Vec::new(),
            limit_m: 0.0,
        }
    }
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
        let mut tie = Tie { before, duration_s, skew: self.skew, heading_rad: start.pose.z };
        let mut best = self.weigh(field, features, &start, keep_ratio);
        let mut objective = self.objective(&best.motion, &tie);
        let mut damping = DAMPING;
        for _ in 0..STEPS_MAX {
            let Some(step) = self.step(&best.motion, &tie, damping) else { break };
            let mut motion = best.motion;
            motion.pose += step.fixed_rows::<3>(0);
            motion.velocity += step.fixed_rows::<3>(3);
            std::mem::swap(&mut self.residuals, &mut self.before_step);
            let limit_m = self.limit_m;
            let found = self.weigh(field, features, &motion, keep_ratio);
            let reached = self.objective(&motion, &tie);
            if reached < objective {
                let gained = objective - reached;
                best = found;
                tie.heading_rad = motion.pose.z;
                objective = self.objective(&motion, &tie);
                damping = (damping * EASED).max(DAMPING_MIN);
                if gained < GAIN_MIN * objective {
                    break;
                }
            } else {
                // The step went too far: back, and a shorter one.
                std::mem::swap(&mut self.residuals, &mut self.before_step);
                self.limit_m = limit_m;
                damping *= STIFFENED;
                if damping > DAMPING_MAX {
                    break;
                }
            }
        }
        self.inform(&mut best);
        best
    }

    /// What is minimized: the sum of the distances, those beyond the trimmed rank counting as the last that is kept, and
    /// the ties.
    fn objective(&self, motion: &Motion, tie: &Tie<'_>) -> f64 {
        let sum: f64 = self.residuals.iter().map(|one| one.share * one.distance_m.min(self.limit_m)).sum();
        let (increment, previous) = tie.residuals(motion);
        let ties = TO_INCREMENT * increment.norm_squared() + TO_PREVIOUS * previous.norm_squared();
        sum + 0.5 * self.residuals.len() as f64 * ties
    }

    /// Distances and derivatives of all points at a motion.
    fn weigh(&mut self, field: &Field, features: &[Feature], motion: &Motion, keep_ratio: f64) -> Match {
        self.residuals.clear();
        self.distances.clear();
        let placing = motion.placing();
        for feature in features {
            let place = placing.place(&feature.at, feature.after_s);
            let slope = field.slope(feature.layer, place.x, place.y);
            let arm = place - (motion.pose.xy() + motion.velocity.xy() * feature.after_s);
            let (gx, gy) = slope.along;
            // d distance / d (x, y, heading); the velocity's derivatives are these times the point's time.
            let turn = gy * arm.x - gx * arm.y;
            let time = feature.after_s;
            let row = Vector6::new(gx, gy, turn, gx * time, gy * time, turn * time);
            let share = 1.0 / (1.0 + feature.at.norm_squared() / (self.far_m * self.far_m));
            self.residuals.push(Residual { distance_m: slope.distance_m, row, share });
            self.distances.push(slope.distance_m as f32);
        }
        let cost_m = mean_of_smallest(&mut self.distances, keep_ratio).unwrap_or(field.cap_m());
        let limit_m = self.last_of(keep_ratio);
        self.limit_m = limit_m;
        let half_m = mean_of_smallest(&mut self.distances, 0.5).unwrap_or(field.cap_m());
        Match { motion: *motion, cost_m, half_m, information: Matrix6::zeros(), square_m2: 0.0 }
    }

    /// Share of the points of the last run that lie nearer to the map than this, meters.
    pub(crate) fn share_within(&self, distance_m: f64) -> f64 {
        let near = self.residuals.iter().filter(|one| one.distance_m < distance_m).count();
        near as f64 / self.residuals.len().max(1) as f64
    }

    /// Adds what the points say of the motion to the match that was weighed last.
    fn inform(&self, best: &mut Match) {
        let (mut square_m2, mut count) = (0.0, 0.0);
        for one in self.residuals.iter().filter(|one| one.distance_m <= self.limit_m) {
            best.information.ger(one.share, &one.row, &one.row, 1.0);
            square_m2 += one.share * one.distance_m * one.distance_m;
            count += one.share;
        }
        best.square_m2 = square_m2 / f64::max(count, 1.0);
    }

    /// The distance of the last point that counts; `distances` are partly sorted.
    fn last_of(&self, keep_ratio: f64) -> f64 {
        let kept = kept_of(self.distances.len(), keep_ratio).unwrap_or(0);
        self.distances[..kept].iter().copied().fold(0.0_f32, f32::max).into()
    }

    /// One damped Gauss-Newton step of iteratively reweighted least squares on (pose, velocity).
    fn step(&self, motion: &Motion, tie: &Tie<'_>, damping: f64) -> Option<Vector6<f64>> {
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for one in self.residuals.iter().filter(|one| one.distance_m <= self.limit_m) {
            // Weight 1 / distance on the squares of the distances: their sum is minimized.
            normal.ger(one.share / one.distance_m, &one.row, &one.row, 1.0);
            right -= one.row * one.share;
        }
        if let Some((to_velocity, to_pose)) = tie.slopes(motion) {
            let scale = self.residuals.len() as f64;
            let (to_increment, to_previous) = (TO_INCREMENT * scale, TO_PREVIOUS * scale);
            let (increment, previous) = tie.residuals(motion);
            for (axis, to_pose) in [to_pose, to_pose, 0.0].into_iter().enumerate() {
                normal[(axis + 3, axis + 3)] += (to_increment + to_previous) * to_velocity * to_velocity;
                normal[(axis, axis)] += to_increment * to_pose * to_pose;
                normal[(axis, axis + 3)] += to_increment * to_velocity * to_pose;
                normal[(axis + 3, axis)] += to_increment * to_velocity * to_pose;
                right[axis + 3] -=
                    to_velocity * (to_increment * increment[axis] + to_previous * previous[axis]);
                right[axis] -= to_increment * to_pose * increment[axis];
            }
        }
        for axis in 0..6 {
            normal[(axis, axis)] += damping * normal[(axis, axis)] + 1e-9;
        }
        let step: Vector6<f64> = normal.cholesky()?.solve(&right);
        let sane = step.iter().all(|n| n.is_finite()) && Vector3::from(step.fixed_rows::<3>(0)).norm() < 2.0;
        sane.then_some(step)
    }
}

/// What ties the velocity within the sweep to the motion before, both as way per sweep, so that the weights do not
/// depend on the sweep's duration.
struct Tie<'a> {
    before: &'a Motion,
    duration_s: f64,
    skew: Skew,
    /// The heading that the turn rate follows: that of the last step, which the tie does not move.
    heading_rad: f64,
}

impl Tie<'_> {
    /// Derivatives of the first residual along velocity and pose; the second has only the first. `None` for an instant
    /// scan, whose velocity shows in nothing.
    fn slopes(&self, motion: &Motion) -> Option<(f64, f64)> {
        let elapsed_s = (motion.stamp - self.before.stamp).seconds();
        (self.duration_s > 0.0 && elapsed_s > 0.0).then(|| (self.duration_s, -self.duration_s / elapsed_s))
    }

    /// Velocity minus the increment since the last sweep, and minus the last velocity, both but for the skew.
    fn residuals(&self, motion: &Motion) -> (Vector3<f64>, Vector3<f64>) {
        let Some((to_velocity, to_pose)) = self.slopes(motion) else { return Default::default() };
        let pose = Vector3::new(motion.pose.x, motion.pose.y, self.heading_rad);
        let mut increment = motion.velocity * to_velocity + (pose - self.before.pose) * to_pose;
        let mut previous = (motion.velocity - self.before.velocity) * to_velocity;
        increment.z -= self.skew.over_increment_rad();
        previous.z -= self.skew.over_increment_rad();
        (increment, previous)
    }
}

#[cfg(test)]
mod tests {
    use super::super::chart::{Chart, Rules};
    use super::*;
    use arborloop_base::{Seed, Span, Time};
    use nalgebra::Vector2;

    const SWEEP_S: f64 = 0.1;

    fn motion(stamp_s: f64, pose: [f64; 3], velocity: [f64; 3]) -> Motion {
        let stamp = Time::from_nanos(0) + Span::from_seconds(stamp_s);
        Motion { stamp, pose: Vector3::from(pose), velocity: Vector3::from(velocity) }
    }

    /// Lone points seen at times spread over a sweep from a moving robot, and their map.
    fn seen_from(robot: &Motion) -> (Vec<Feature>, Field) {
        let mut draws = Seed(11).stream("refine").at(0);
        let (mut chart, mut field) = (Chart::new(0.1, 1, Rules::OF_RINGS), Field::new(0.1, 1.0, 1));
        let (mut features, mut places) = (Vec::new(), Vec::new());
        for n in 0..80 {
            let place =
                Vector2::new(f64::from(n % 9) - 4.0 + draws.within(-0.3, 0.3), f64::from(n / 9) - 4.0);
            let after_s = (f64::from(n * 37 % 80) / 80.0 - 0.5) * SWEEP_S;
            let at = robot.after(after_s).inverse() * nalgebra::Point2::from(place);
            features.push(Feature { at: at.coords, after_s, layer: 0 });
            places.push(Feature { at: place, after_s: 0.0, layer: 0 });
        }
        chart.draw(&motion(0.0, [0.0; 3], [0.0; 3]), &places, &[], 0);
        field.follow(&mut chart);
        (features, field)
    }

    #[test]
    fn pose_and_velocity_within_the_sweep_are_found_from_the_points_alone() {
        let robot = motion(0.1, [0.05, 0.02, 0.03], [0.5, 0.2, 0.3]);
        let before = motion(0.0, [0.0; 3], [0.5, 0.2, 0.3]);
        let (features, field) = seen_from(&robot);
        let found =
            Refine::default().run(&field, &features, before.predict(robot.stamp), &before, SWEEP_S, 0.8);
        // Points are exact and alone in their cells. The iteration ends at a gain of 1e-4, which is d^2 / (2 noise^2):
        // some 0.3 mm per point, and the velocity is half as well determined as the pose.
        assert!((found.motion.pose - robot.pose).norm() < 1e-3, "{:?}", found.motion);
        assert!((found.motion.velocity - robot.velocity).norm() * SWEEP_S < 2e-3, "{:?}", found.motion);
    }

    #[test]
    fn a_slice_matched_with_itself_stays_put() {
        let robot = motion(0.1, [0.0; 3], [0.0; 3]);
        let (features, field) = seen_from(&robot);
        let before = motion(0.0, [0.0; 3], [0.0; 3]);
        let found = Refine::default().run(&field, &features, robot, &before, SWEEP_S, 0.8);
        assert!(found.motion.pose.norm() < 1e-4, "{:?}", found.motion);
    }

    #[test]
    fn a_turn_within_the_sweep_that_no_heading_shows_does_not_turn_the_heading() {
        let before = motion(0.0, [0.0; 3], [0.0; 3]);
        // Points are off by centimeters, else they would hold any heading against any tie.
        let heading_rad = |turn_radps: f64| {
            let pretended = motion(0.1, [0.0; 3], [0.0, 0.0, turn_radps]);
            let (mut features, field) = seen_from(&pretended);
            let mut draws = Seed(12).stream("refine").at(0);
            for feature in &mut features {
                feature.at += Vector2::new(draws.within(-0.05, 0.05), draws.within(-0.05, 0.05));
            }
            let start = before.predict(pretended.stamp);
            let found = Refine::default().run(&field, &features, start, &before, SWEEP_S, 0.8).motion;
            assert!(found.velocity.z * turn_radps > 0.0, "{found:?}");
            found.pose.z
        };
        let turned_rad = (heading_rad(0.3) - heading_rad(-0.3)) / 2.0;
        println!("turned by {turned_rad} rad");
        assert!(turned_rad.abs() < 5e-4, "{turned_rad}");
    }

    #[test]
    fn outliers_below_the_trimmed_share_do_not_move_the_match() {
        let robot = motion(0.1, [0.03, -0.02, 0.02], [0.0; 3]);
        let before = motion(0.0, [0.0; 3], [0.0; 3]);
        let (mut features, field) = seen_from(&robot);
        for feature in features.iter_mut().step_by(6) {
            feature.at += Vector2::new(0.4, 0.3);
        }
        let found = Refine::default().run(&field, &features, before.predict(robot.stamp), &before, 0.0, 0.8);
        assert!((found.motion.pose - robot.pose).norm() < 2e-3, "{:?}", found.motion);
    }
}
