//! The body's true motion over the last moments, one pose a tick, for sensors that fire between ticks.

use crate::sensor::lidar::Stance;
use arborloop_base::{Pose, Span, Time};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::VecDeque;

/// Poses of the base at consecutive ticks.
pub(crate) struct Motion {
    tick: Span,
    first: Time,
    poses: VecDeque<Pose>,
    /// From each pose to the next one: a sweep asks for each some three hundred times.
    steps: VecDeque<Step>,
    stances: VecDeque<Stance>,
    kept: usize,
}

/// Motion between two ticks at constant velocity and constant turn rate (go1 facts 3.3: below 0.05 mm and 0.01 deg
/// at 1 kHz).
pub(crate) struct Moment<'a> {
    before: &'a Pose,
    step: Step,
}

/// From one pose to the next: the shift, world frame, and the turn, body frame, radians.
#[derive(Debug, Clone, Copy, Default)]
struct Step {
    shift: Vector3<f64>,
    turn: Vector3<f64>,
}

impl Motion {
    /// Begins with the pose at `now` and keeps `kept` of time.
    pub(crate) fn new(now: Time, pose: Pose, tick: Span, kept: Span) -> Self {
        let kept = (kept.nanos() / tick.nanos()) as usize + 2;
        Motion {
            tick,
            first: now,
            poses: VecDeque::from([pose]),
            steps: VecDeque::new(),
            stances: VecDeque::from([Stance::of(&[0.0; 12])]),
            kept,
        }
    }

    /// The pose and the joints' angles one tick later.
    pub(crate) fn push_body(&mut self, pose: Pose, joint_angles_rad: [f64; 12]) {
        if let Some(before) = self.poses.back() {
            self.steps.push_back(Step::between(before, &pose));
        }
        self.poses.push_back(pose);
        self.stances.push_back(Stance::of(&joint_angles_rad));
        if self.poses.len() > self.kept {
            self.poses.pop_front();
            self.steps.pop_front();
            self.stances.pop_front();
            self.first += self.tick;
        }
    }

    /// A pose of a body without legs.
    #[cfg(test)]
    pub(crate) fn push(&mut self, pose: Pose) {
        self.push_body(pose, [0.0; 12]);
    }

    /// Where the legs were at the tick before an instant; at the nearest kept one outside.
    pub(crate) fn stance(&self, stamp: Time) -> &Stance {
        let after = (stamp - self.first).nanos().max(0) / self.tick.nanos();
        &self.stances[(after as usize).min(self.stances.len() - 1)]
    }

    /// The tick that holds an instant, and how far into it the instant is, in [0, 1]; the nearest kept one outside.
    pub(crate) fn moment(&self, stamp: Time) -> (Moment<'_>, f64) {
        let after = (stamp - self.first).nanos().clamp(0, self.tick.nanos() * (self.poses.len() as i64 - 1));
        let index = (after / self.tick.nanos()) as usize;
        let share = (after % self.tick.nanos()) as f64 / self.tick.nanos() as f64;
        let before = &self.poses[index];
        let step = self.steps.get(index).copied().unwrap_or_default();
        (Moment { before, step }, share)
    }
}

impl Step {
    fn between(from: &Pose, to: &Pose) -> Self {
        Step {
            shift: to.translation.vector - from.translation.vector,
            turn: (from.rotation.inverse() * to.rotation).scaled_axis(),
        }
    }
}

impl Moment<'_> {
    pub(crate) fn pose(&self, share: f64) -> Pose {
        let Step { shift, turn } = self.step;
        Pose::from_parts(
            (self.before.translation.vector + shift * share).into(),
            self.before.rotation * rotation_by(turn * share),
        )
    }
}

/// Half turns below this are small, radians squared: Taylor's series up to the sixth power is then exact in double
/// precision. A tick's turn is: a millisecond at 20 rad/s.
const SMALL: f64 = 1e-4;

/// `UnitQuaternion::from_scaled_axis`, for small turns without root, sine and cosine.
fn rotation_by(turn: Vector3<f64>) -> UnitQuaternion<f64> {
    let half = turn / 2.0;
    let square = half.norm_squared();
    if square > SMALL {
        return UnitQuaternion::from_scaled_axis(turn);
    }
    let cos = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0));
    let sin_share = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0));
    UnitQuaternion::new_unchecked(Quaternion::from_parts(cos, half * sin_share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motion_is_read_between_ticks_and_never_outside_what_is_kept() {
        let tick = Span::from_millis(1);
        let at = |n: i64| Pose::translation(n as f64, 0.0, 0.0);
        let mut motion = Motion::new(Time::from_nanos(0), at(0), tick, Span::from_millis(10));
        (1..100).for_each(|n| motion.push(at(n)));
        let x = |nanos: i64| {
            let (moment, share) = motion.moment(Time::from_nanos(nanos));
            moment.pose(share).translation.x
        };
        assert!((x(95_250_000) - 95.25).abs() < 1e-12);
        assert_eq!(x(99_000_000), 99.0);
        assert_eq!(x(200_000_000), 99.0);
        assert_eq!(x(0), 88.0);
    }

    #[test]
    fn a_turn_is_the_library_s_to_the_last_bits() {
        let mut draws = arborloop_base::Seed(3).stream("turns").at(0);
        for power in 0..20 {
            let turn = Vector3::from_fn(|_, _| draws.normal()) * 0.1_f64.powi(power);
            let wanted = UnitQuaternion::from_scaled_axis(turn);
            assert!((rotation_by(turn).coords - wanted.coords).norm() < 4.0 * f64::EPSILON);
        }
    }
}
