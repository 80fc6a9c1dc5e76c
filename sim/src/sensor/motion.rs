//! The body's true motion over the last moments, one pose a tick, for sensors that fire between ticks.

mod bundle;

use crate::sensor::lidar::Stance;
use arborloop_base::{Pose, Span, Time};
pub(crate) use bundle::{BEAMS, Bundle, Carry, rows_of, times};
use nalgebra::{Matrix3, Point3, Quaternion, UnitQuaternion, Vector3};
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

    /// Another pose at the last tick: the body is carried off at that instant, and beams that leave before know nothing of it.
    pub(crate) fn jump(&mut self, pose: Pose) {
        if let Some(last) = self.poses.back_mut() {
            *last = pose;
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
        let after = self.after(stamp);
        let index = (after / self.tick.nanos()) as usize;
        let share = (after % self.tick.nanos()) as f64 / self.tick.nanos() as f64;
        let before = &self.poses[index];
        let step = self.steps.get(index).copied().unwrap_or_default();
        (Moment { before, step }, share)
    }

    /// The tick that holds an instant; the nearest kept one outside.
    pub(crate) fn stretch(&self, stamp: Time) -> Stretch {
        let index = self.after(stamp) / self.tick.nanos();
        let before = &self.poses[index as usize];
        Stretch {
            from: self.first + self.tick * index,
            tick: self.tick,
            share_per_ns: (self.tick.nanos() as f64).recip(),
            origin: before.translation.vector,
            turned: before.rotation.to_rotation_matrix().into_inner(),
            step: self.steps.get(index as usize).copied().unwrap_or_default(),
        }
    }

    /// Nanoseconds from the first kept pose to an instant, which is moved to where poses are kept.
    fn after(&self, stamp: Time) -> i64 {
        (stamp - self.first).nanos().clamp(0, self.tick.nanos() * (self.poses.len() as i64 - 1))
    }
}

/// A tick of motion made ready to be asked many times.
#[derive(Debug)]
pub(crate) struct Stretch {
    from: Time,
    tick: Span,
    share_per_ns: f64,
    origin: Vector3<f64>,
    turned: Matrix3<f64>,
    step: Step,
}

/// The base at one instant of a stretch.
pub(crate) struct At<'a> {
    turned: &'a Matrix3<f64>,
    origin: Vector3<f64>,
    /// The turn since the stretch began, base frame.
    since: Quaternion<f64>,
}

impl Stretch {
    /// Whether an instant is in this tick.
    #[inline(always)]
    pub(crate) fn holds(&self, stamp: Time) -> bool {
        self.from <= stamp && stamp < self.from + self.tick
    }

    /// The base at an instant of this tick, at its nearer end outside.
    #[inline(always)]
    pub(crate) fn at(&self, stamp: Time) -> At<'_> {
        let after = (stamp - self.from).nanos().clamp(0, self.tick.nanos());
        let share = after as f64 * self.share_per_ns;
        At {
            turned: &self.turned,
            origin: self.origin + self.step.shift * share,
            since: rotation_by(self.step.turn * share).into_inner(),
        }
    }
}

impl At<'_> {
    /// A direction of the base frame, world frame.
    #[inline(always)]
    pub(crate) fn vector(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        let axis = self.since.imag();
        let across = axis.cross(vector) * 2.0;
        self.turned * (vector + across * self.since.w + axis.cross(&across))
    }

    /// A point of the base frame, world frame.
    #[inline(always)]
    pub(crate) fn point(&self, point: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.origin + self.vector(&point.coords))
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
#[inline(always)]
fn rotation_by(turn: Vector3<f64>) -> UnitQuaternion<f64> {
    let half = turn * 0.5;
    let square = half.norm_squared();
    if square > SMALL {
        return UnitQuaternion::from_scaled_axis(turn);
    }
    let (cos, sin_share) = turn_of(square);
    UnitQuaternion::new_unchecked(Quaternion::from_parts(cos, half * sin_share))
}

/// Cosine of a small half turn of this square, and its sine over it.
#[inline(always)]
fn turn_of(square: f64) -> (f64, f64) {
    let cos = 1.0 - square * 0.5 * (1.0 - square * (1.0 / 12.0) * (1.0 - square * (1.0 / 30.0)));
    let sin_share =
        1.0 - square * (1.0 / 6.0) * (1.0 - square * (1.0 / 20.0) * (1.0 - square * (1.0 / 42.0)));
    (cos, sin_share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{InstructionSet, spread};

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
    fn a_body_carried_off_is_where_it_was_until_that_instant_and_then_elsewhere() {
        let tick = Span::from_millis(1);
        let at = |x: f64| Pose::translation(x, 0.0, 0.0);
        let mut motion = Motion::new(Time::from_nanos(0), at(0.0), tick, Span::from_millis(10));
        motion.push(at(1.0));
        motion.jump(at(100.0));
        motion.push(at(101.0));
        for (nanos, wanted) in [(250_000, 0.25), (999_999, 0.999999), (1_000_000, 100.0), (1_500_000, 100.5)]
        {
            let stamp = Time::from_nanos(nanos);
            let (moment, share) = motion.moment(stamp);
            assert!((moment.pose(share).translation.x - wanted).abs() < 1e-9, "{nanos}");
            let point = motion.stretch(stamp).at(stamp).point(&Point3::origin());
            assert!((point.x - wanted).abs() < 1e-9, "{nanos}");
        }
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

    #[test]
    fn a_stretch_says_what_the_poses_say() {
        let tick = Span::from_millis(1);
        let mut draws = arborloop_base::Seed(4).stream("stretch").at(0);
        let mut pose = || {
            let turn = Vector3::from_fn(|_, _| 0.02 * draws.normal());
            Pose::from_parts(Vector3::from_fn(|_, _| draws.normal()).into(), UnitQuaternion::new(turn))
        };
        let mut motion = Motion::new(Time::from_nanos(0), pose(), tick, Span::from_millis(10));
        (1..10).for_each(|_| motion.push(pose()));
        let inside = nalgebra::Point3::new(0.3, -0.2, 0.5);
        for nanos in [-5, 0, 1, 999_999, 1_000_000, 4_300_000, 8_999_999, 9_000_000, 20_000_000] {
            let stamp = Time::from_nanos(nanos);
            let (moment, share) = motion.moment(stamp);
            let (stretch, pose) = (motion.stretch(stamp), moment.pose(share));
            assert!((stretch.at(stamp).point(&inside) - pose * inside).norm() < 1e-14, "{nanos}");
            assert!(
                (stretch.at(stamp).vector(&inside.coords) - pose * inside.coords).norm() < 1e-14,
                "{nanos}"
            );
        }
    }

    #[test]
    fn a_bundle_says_what_a_stretch_says_to_the_bit() {
        let tick = Span::from_millis(1);
        let mut draws = arborloop_base::Seed(6).stream("bundle").at(0);
        for turn_rad in [0.005, 0.2] {
            let mut motion = Motion::new(Time::from_nanos(0), Pose::identity(), tick, Span::from_millis(10));
            for _ in 0..10 {
                let turn = Vector3::from_fn(|_, _| turn_rad * draws.normal());
                let rotation = motion.poses.back().unwrap().rotation * UnitQuaternion::new(turn);
                motion.push(Pose::from_parts(Vector3::from_fn(|_, _| draws.normal()).into(), rotation));
            }
            let stretch = motion.stretch(Time::from_nanos(4_000_000));
            let mut bundle = Bundle::default();
            let flies = std::array::from_fn(|beam| beam % 5 != 3);
            for beam in 0..BEAMS {
                bundle.stamps_ns[beam] = 3_900_000 + 80_000 * beam as i64;
                for axis in 0..3 {
                    bundle.exit[axis][beam] = draws.normal();
                    bundle.along[axis][beam] = draws.normal();
                }
            }
            for isa in [InstructionSet::Portable, InstructionSet::Avx2, InstructionSet::Avx512] {
                spread(isa, Carry { stretch: &stretch, flies: &flies, bundle: &mut bundle });
                for (beam, flies) in flies.into_iter().enumerate() {
                    let at = stretch.at(Time::from_nanos(bundle.stamps_ns[beam]));
                    let (origin, direction) = match flies {
                        true => (at.point(&bundle.exit(beam)), at.vector(&bundle.along(beam))),
                        false => Default::default(),
                    };
                    assert_eq!((bundle.origin(beam), bundle.direction(beam)), (origin, direction), "{isa:?}");
                }
            }
        }
    }
}
