//! From the middle of a sweep to its end: what the gait does in the half sweep that no point of the middle tells.
//!
//! A trot shakes the body some 2.5 times a second and a sweep takes a tenth: at constant velocity the end of the sweep is
//! off by degrees per second. When the next sweep is matched, the way from the middle to the end is known, and it is
//! regressed, with forgetting, on the velocity and the last increments. Without a rhythm the regression leaves the
//! constant velocity as it is.

use super::motion::Motion;
use arborloop_base::{Pose2, pose2};
use nalgebra::{Rotation2, SMatrix, SVector, Vector3};
use std::collections::VecDeque;

/// Motions that a forecast looks back on, the current one included.
const BACK: usize = 6;
/// Terms of the regression: the last increments and the last velocity.
const TERMS: usize = BACK;
/// Share of a sweep's lesson that is left after the next.
const MEMORY: f64 = 0.995;
/// Departures from constant velocity below this are chance: meters and radians, and how many of them make a lesson.
const CHANCE: [f64; 3] = [0.002, 0.002, 0.001];
const LESSONS: f64 = 10.0;
/// Sweeps that follow each other at once differ in their distance by less than this share.
const UNEVEN: f64 = 0.1;

/// A larger departure from constant velocity in a whole sweep is no gait: who was carried off begins anew.
const JUMP_M: f64 = 0.15;
const JUMP_RAD: f64 = 0.15;

type Terms = SVector<f64, TERMS>;

/// Learns the rhythm of the motion.
#[derive(Debug, Clone, Default)]
pub(crate) struct Foresight {
    recent: VecDeque<Motion>,
    axes: [Regression; 3],
}

/// Recursive least squares with forgetting.
#[derive(Debug, Clone)]
struct Regression {
    normal: SMatrix<f64, TERMS, TERMS>,
    right: Terms,
}

impl Default for Regression {
    fn default() -> Self {
        Regression { normal: SMatrix::zeros(), right: Terms::zeros() }
    }
}

impl Foresight {
    /// Takes the motion of the sweep that was matched last.
    pub(crate) fn learn(&mut self, motion: &Motion) {
        if let Some(before) = self.recent.back() {
            let elapsed_s = (motion.stamp - before.stamp).seconds();
            let usual_s = self.recent.iter().rev().nth(1).map(|one| (before.stamp - one.stamp).seconds());
            let even = usual_s.is_none_or(|usual_s| (elapsed_s / usual_s - 1.0).abs() < UNEVEN);
            let jump = motion.pose - before.pose - before.velocity * elapsed_s;
            let is_jump = jump.xy().norm() > JUMP_M || jump.z.abs() > JUMP_RAD;
            if elapsed_s <= 0.0 || !even || is_jump {
                self.recent.clear();
            }
        }
        if let Some((terms, half_s)) = self.terms() {
            let before = self.recent[self.recent.len() - 1];
            let elapsed_s = (motion.stamp - before.stamp).seconds();
            // Hermite's cubic between the two middles, at the instant between the two sweeps.
            let way =
                (motion.pose - before.pose) * 0.5 + (before.velocity - motion.velocity) * (elapsed_s / 8.0);
            let departure = in_frame_of(&before, &(way - before.velocity * half_s));
            for (axis, regression) in self.axes.iter_mut().enumerate() {
                let terms = &terms[axis];
                regression.normal *= MEMORY;
                regression.right *= MEMORY;
                regression.normal += terms * terms.transpose();
                regression.right += terms * departure[axis];
            }
        }
        if self.recent.len() == BACK {
            self.recent.pop_front();
        }
        self.recent.push_back(*motion);
    }

    /// The pose `after_s` after the motion that was learned last, which is half a sweep.
    pub(crate) fn after(&self, motion: &Motion, after_s: f64) -> Pose2 {
        let fits = |half_s: f64| (after_s / half_s - 1.0).abs() < UNEVEN;
        let Some((terms, _)) = self.terms().filter(|(_, half_s)| fits(*half_s)) else {
            return motion.after(after_s);
        };
        let mut departure = Vector3::zeros();
        for (axis, regression) in self.axes.iter().enumerate() {
            let held = SMatrix::<f64, TERMS, TERMS>::identity() * (LESSONS * CHANCE[axis] * CHANCE[axis]);
            if let Some(solved) =
                (regression.normal + held).cholesky().map(|all| all.solve(&regression.right))
            {
                departure[axis] = solved.dot(&terms[axis]);
            }
        }
        if !departure.iter().all(|n| n.is_finite()) {
            return motion.after(after_s);
        }
        let turn = Rotation2::new(motion.pose.z) * departure.xy();
        let pose = motion.pose + motion.velocity * after_s + Vector3::new(turn.x, turn.y, departure.z);
        pose2(pose.x, pose.y, pose.z)
    }

    /// How the last increments and the last velocity depart from the velocity now, per axis of the body, as ways in half
    /// the time between two sweeps; and that time, seconds.
    fn terms(&self) -> Option<([Terms; 3], f64)> {
        if self.recent.len() < BACK {
            return None;
        }
        let now = self.recent[BACK - 1];
        let half_s = (now.stamp - self.recent[BACK - 2].stamp).seconds() / 2.0;
        let mut terms = [Terms::zeros(); 3];
        let increments = (1..BACK).map(|n| (self.recent[n].pose - self.recent[n - 1].pose) * 0.5);
        let velocity = self.recent[BACK - 2].velocity * half_s;
        for (term, way) in increments.chain([velocity]).enumerate() {
            let departure = in_frame_of(&now, &(way - now.velocity * half_s));
            for axis in 0..3 {
                terms[axis][term] = departure[axis];
            }
        }
        Some((terms, half_s))
    }
}

/// A way in the map, seen along the body's own axes.
fn in_frame_of(motion: &Motion, way: &Vector3<f64>) -> Vector3<f64> {
    let turned = Rotation2::new(-motion.pose.z) * way.xy();
    Vector3::new(turned.x, turned.y, way.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Span, Time};
    use nalgebra::Vector2;

    /// A robot that walks a circle and shakes `shake` (meters and radians) 2.3 times a second.
    fn at(time_s: f64, shake: f64) -> Vector3<f64> {
        let phase = std::f64::consts::TAU * 2.3 * time_s;
        let heading_rad = 0.3 * time_s + shake * phase.sin();
        let around = Vector2::new((0.3 * time_s).sin(), 1.0 - (0.3 * time_s).cos()) * 2.0;
        Vector3::new(around.x, around.y + shake * phase.cos(), heading_rad)
    }

    fn motion(sweep: i64, shake: f64) -> Motion {
        let time_s = 0.1 * sweep as f64;
        let velocity = (at(time_s + 0.03, shake) - at(time_s - 0.03, shake)) / 0.06;
        let stamp = Time::from_nanos(0) + Span::from_millis(100) * sweep;
        Motion { stamp, pose: at(time_s, shake), velocity }
    }

    /// Largest error of the heading half a sweep later, radians, of the last of 100 sweeps and at constant velocity.
    fn errors(shake: f64) -> (f64, f64) {
        let mut foresight = Foresight::default();
        let (mut learned, mut plain) = (0.0_f64, 0.0_f64);
        for sweep in 0..100 {
            let motion = motion(sweep, shake);
            foresight.learn(&motion);
            if sweep >= 50 {
                let end = at(0.1 * sweep as f64 + 0.05, shake);
                let heading = |pose: &Pose2| arborloop_base::wrap_angle(pose.rotation.angle() - end.z).abs();
                learned = learned.max(heading(&foresight.after(&motion, 0.05)));
                plain = plain.max(heading(&motion.after(0.05)));
            }
        }
        (learned, plain)
    }

    #[test]
    fn a_rhythm_is_learned() {
        let (learned, plain) = errors(0.01);
        // The cubic between two middles departs from a sine of 2.3 Hz by 2 % of its size.
        assert!(learned < 0.15 * plain, "{learned} {plain}");
    }

    #[test]
    fn without_a_rhythm_the_velocity_stays_constant() {
        let (learned, _) = errors(0.0);
        assert!(learned < 1e-4, "{learned}");
    }

    #[test]
    fn after_a_gap_the_past_is_no_guide() {
        let mut foresight = Foresight::default();
        for sweep in 0..20 {
            foresight.learn(&motion(sweep, 0.01));
        }
        let later = motion(40, 0.01);
        foresight.learn(&later);
        assert_eq!(foresight.after(&later, 0.05), later.after(0.05));
        foresight.learn(&later);
        assert_eq!(foresight.after(&later, 0.05), later.after(0.05));
    }
}
