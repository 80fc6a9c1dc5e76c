//! The state: pose at the middle of the sweep and the velocity within it.
//!
//! The middle is the instant that the points of a turning lidar determine best; the end is half a sweep of that
//! velocity away.

use arborloop_base::{Pose2, Time, pose2};
use nalgebra::{Rotation2, Vector2, Vector3};

/// How long a velocity is believed, seconds: after a pause the robot may have stopped or turned.
const MEMORY_S: f64 = 5.0;

/// No robot between trees is faster, m/s and rad/s: two stamps that nearly coincide must not throw it off the map.
const SPEED_MPS_MAX: f64 = 10.0;
const TURN_RADPS_MAX: f64 = 6.0;

/// Motion through one sweep, map frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Motion {
    /// The instant of the pose.
    pub(crate) stamp: Time,
    /// x, y (meters) and heading (radians) of the flat base frame at `stamp`; the heading is not wrapped.
    pub(crate) pose: Vector3<f64>,
    /// Their rates, per second, map frame.
    pub(crate) velocity: Vector3<f64>,
}

impl Motion {
    /// The pose `after_s` later, at constant velocity.
    pub(crate) fn after(&self, after_s: f64) -> Pose2 {
        let pose = self.pose + self.velocity * after_s;
        pose2(pose.x, pose.y, pose.z)
    }

    /// Places many points.
    pub(crate) fn placing(&self) -> Placing {
        let (sin, cos) = self.pose.z.sin_cos();
        Placing { motion: *self, sin, cos }
    }

    /// This motion as it would be had the robot stood at another pose: what carries `from` to `to` carries it too.
    pub(crate) fn carried(&self, from: &Motion, to: &Motion) -> Motion {
        let turn = Rotation2::new(to.pose.z - from.pose.z);
        let way = turn * (self.pose.xy() - from.pose.xy());
        let speed = turn * self.velocity.xy();
        Motion {
            stamp: self.stamp,
            pose: Vector3::new(to.pose.x + way.x, to.pose.y + way.y, self.pose.z + to.pose.z - from.pose.z),
            velocity: Vector3::new(speed.x, speed.y, self.velocity.z),
        }
    }

    /// The same with a velocity that a robot can have.
    pub(crate) fn sane(mut self) -> Motion {
        let speed_mps = self.velocity.xy().norm();
        let share = if speed_mps > SPEED_MPS_MAX { SPEED_MPS_MAX / speed_mps } else { 1.0 };
        self.velocity.x *= share;
        self.velocity.y *= share;
        self.velocity.z = self.velocity.z.clamp(-TURN_RADPS_MAX, TURN_RADPS_MAX);
        self
    }

    /// What is expected at a later instant: the velocity fades with the time since it was measured.
    pub(crate) fn predict(&self, stamp: Time) -> Motion {
        let elapsed_s = (stamp - self.stamp).seconds().max(0.0);
        let believed_s = MEMORY_S * (1.0 - (-elapsed_s / MEMORY_S).exp());
        Motion {
            stamp,
            pose: self.pose + self.velocity * believed_s,
            velocity: self.velocity * (-elapsed_s / MEMORY_S).exp(),
        }
    }
}

/// A motion that places points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placing {
    motion: Motion,
    sin: f64,
    cos: f64,
}

impl Placing {
    /// A point met `after_s` after the stamp, from the flat base frame of that instant into the map.
    pub(crate) fn place(&self, at: &Vector2<f64>, after_s: f64) -> Vector2<f64> {
        let Motion { pose, velocity, .. } = &self.motion;
        let (sin, cos) = sin_cos_of_small(velocity.z * after_s);
        let turned = Vector2::new(cos * at.x - sin * at.y, sin * at.x + cos * at.y);
        Vector2::new(
            pose.x + velocity.x * after_s + self.cos * turned.x - self.sin * turned.y,
            pose.y + velocity.y * after_s + self.sin * turned.x + self.cos * turned.y,
        )
    }
}

/// Sine and cosine; up to `TURN_RADPS_MAX` times half a sweep they are a few terms of their series, to 1e-9.
fn sin_cos_of_small(angle: f64) -> (f64, f64) {
    if angle.abs() > 0.3 {
        return angle.sin_cos();
    }
    let square = angle * angle;
    let sin = angle * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)));
    let cos = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)));
    (sin, cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Span;

    fn turning() -> Motion {
        let stamp = Time::from_nanos(5_000_000_000);
        Motion { stamp, pose: Vector3::new(1.0, -2.0, 3.0), velocity: Vector3::new(0.5, 0.1, -0.4) }
    }

    #[test]
    fn a_point_is_placed_by_the_pose_of_its_own_instant() {
        let at = Vector2::new(2.0, 0.7);
        for after_s in [-2.0, -0.74, -0.05, 0.0, 0.05, 0.74] {
            let by_pose = turning().after(after_s) * nalgebra::Point2::from(at);
            assert!((turning().placing().place(&at, after_s) - by_pose.coords).norm() < 1e-9);
        }
    }

    #[test]
    fn prediction_is_at_first_the_velocitys_and_then_comes_to_rest() {
        let motion = turning();
        let soon = motion.predict(motion.stamp + Span::from_millis(10));
        assert!((soon.pose - motion.pose - motion.velocity * 0.01).norm() < 1e-5);
        let late = motion.predict(motion.stamp + Span::from_seconds(600.0));
        assert!((late.pose - motion.pose - motion.velocity * MEMORY_S).norm() < 1e-9);
        assert!(late.velocity.norm() < 1e-9);
        // Two predictions in a row are one.
        let middle = motion.predict(motion.stamp + Span::from_seconds(2.0));
        let twice = middle.predict(motion.stamp + Span::from_seconds(3.0));
        let once = motion.predict(motion.stamp + Span::from_seconds(3.0));
        assert!((twice.pose - once.pose).norm() < 1e-12);
    }

    #[test]
    fn a_motion_carried_elsewhere_predicts_the_pose_carried_there() {
        let (before, stamp) = (turning(), turning().stamp + Span::from_millis(100));
        let predicted = before.predict(stamp);
        let elsewhere = Motion { pose: Vector3::new(-4.0, 2.0, 0.5), ..predicted };
        let carried = before.carried(&predicted, &elsewhere);
        assert!((carried.predict(stamp).pose - elsewhere.pose).norm() < 1e-12);
        assert!((carried.velocity.norm() - before.velocity.norm()).abs() < 1e-12);
    }

    #[test]
    fn no_velocity_stays_faster_than_a_robot() {
        let wild = Motion { velocity: Vector3::new(3e6, 4e6, -1e9), ..turning() }.sane();
        assert!((wild.velocity - Vector3::new(6.0, 8.0, -TURN_RADPS_MAX)).norm() < 1e-9);
        assert_eq!(turning().sane(), turning());
    }
}
