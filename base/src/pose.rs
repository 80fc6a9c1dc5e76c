//! Poses in space and in the plane, and stamped sequences of them.

use crate::time::Time;
use nalgebra::{Isometry2, Isometry3, Translation3, UnitQuaternion, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// A rigid transform in space, named `to_from_from` by its holder; meters.
pub type Pose = Isometry3<f64>;

/// A rigid transform in the plane: x, y in meters, heading in radians counter-clockwise.
pub type Pose2 = Isometry2<f64>;

/// Velocity of a body: linear in m/s, angular in rad/s, both in the frame that the holder names.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Twist {
    /// Linear velocity, m/s.
    pub linear_mps: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular_radps: Vector3<f64>,
}

impl Twist {
    /// Forward speed and turn rate of a body that drives in the plane.
    pub fn planar(forward_mps: f64, turn_radps: f64) -> Self {
        Twist {
            linear_mps: Vector3::new(forward_mps, 0.0, 0.0),
            angular_radps: Vector3::new(0.0, 0.0, turn_radps),
        }
    }
}

/// The angle brought into (-pi, pi].
#[inline]
pub fn wrap_angle(angle_rad: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    // Most angles are in the turn already.
    if angle_rad.abs() < std::f64::consts::PI {
        return angle_rad;
    }
    let wrapped = angle_rad - turn * (angle_rad / turn).round();
    if wrapped <= -std::f64::consts::PI { wrapped + turn } else { wrapped }
}

/// Heading of a pose: the bearing of its x axis projected on the ground, radians in (-pi, pi].
pub fn yaw_of(pose: &Pose) -> f64 {
    let forward = pose.rotation * Vector3::x();
    forward.y.atan2(forward.x)
}

/// A planar pose from its three numbers.
pub fn pose2(x_m: f64, y_m: f64, yaw_rad: f64) -> Pose2 {
    Pose2::new(Vector2::new(x_m, y_m), yaw_rad)
}

/// The pose seen from above: x, y and heading.
pub fn planar(pose: &Pose) -> Pose2 {
    pose2(pose.translation.x, pose.translation.y, yaw_of(pose))
}

/// The planar pose lifted to height zero, level.
pub fn spatial(pose: &Pose2) -> Pose {
    Pose::from_parts(
        Translation3::new(pose.translation.x, pose.translation.y, 0.0),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.rotation.angle()),
    )
}

/// Between two poses: straight in position, constant rate in attitude; `share` 0 gives `a`, 1 gives `b`.
pub fn interpolate(a: &Pose, b: &Pose, share: f64) -> Pose {
    let translation = a.translation.vector.lerp(&b.translation.vector, share);
    let turn = (a.rotation.inverse() * b.rotation).scaled_axis() * share;
    Pose::from_parts(translation.into(), a.rotation * UnitQuaternion::from_scaled_axis(turn))
}

/// Why a sequence of stamped poses is no trajectory.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrajectoryError {
    /// Stamps must strictly increase.
    #[error("pose {index} has stamp {found}, not after the stamp {previous} before it")]
    NotIncreasing {
        /// Which pose, counted from zero.
        index: usize,
        /// Its stamp.
        found: Time,
        /// The stamp before.
        previous: Time,
    },
    /// Every number must be finite.
    #[error("pose {index} at {stamp} has a number that is not finite")]
    NotFinite {
        /// Which pose, counted from zero.
        index: usize,
        /// Its stamp.
        stamp: Time,
    },
}

/// Stamped poses, stamps strictly increasing, every number finite.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    poses: Vec<(Time, Pose)>,
}

impl Trajectory {
    /// Checks and takes the poses.
    pub fn new(poses: Vec<(Time, Pose)>) -> Result<Self, TrajectoryError> {
        let mut trajectory = Trajectory { poses: Vec::with_capacity(poses.len()) };
        for (stamp, pose) in poses {
            trajectory.push(stamp, pose)?;
        }
        Ok(trajectory)
    }

    /// Appends a pose later than all before.
    pub fn push(&mut self, stamp: Time, pose: Pose) -> Result<(), TrajectoryError> {
        let index = self.poses.len();
        if let Some((previous, _)) = self.poses.last()
            && stamp <= *previous
        {
            return Err(TrajectoryError::NotIncreasing { index, found: stamp, previous: *previous });
        }
        let finite = pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|n| n.is_finite());
        if !finite {
            return Err(TrajectoryError::NotFinite { index, stamp });
        }
        self.poses.push((stamp, pose));
        Ok(())
    }

    /// Number of poses.
    pub fn len(&self) -> usize {
        self.poses.len()
    }

    /// Whether there is no pose at all.
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// The stamped poses in order.
    pub fn poses(&self) -> &[(Time, Pose)] {
        &self.poses
    }

    /// The pose at an instant inside the trajectory's span, interpolated; `None` outside.
    pub fn at(&self, stamp: Time) -> Option<Pose> {
        let after = self.poses.partition_point(|(t, _)| *t < stamp);
        let (t1, p1) = self.poses.get(after)?;
        if *t1 == stamp {
            return Some(*p1);
        }
        let (t0, p0) = self.poses.get(after.checked_sub(1)?)?;
        Some(interpolate(p0, p1, (stamp - *t0).seconds() / (*t1 - *t0).seconds()))
    }

    /// Length of the path through the positions, meters.
    pub fn length_m(&self) -> f64 {
        self.poses.windows(2).map(|w| (w[1].1.translation.vector - w[0].1.translation.vector).norm()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn at(nanos: i64, x: f64) -> (Time, Pose) {
        (Time::from_nanos(nanos), Pose::translation(x, 0.0, 0.0))
    }

    #[test]
    fn angles_wrap_into_the_half_open_turn() {
        assert_eq!(wrap_angle(PI), PI);
        assert_eq!(wrap_angle(-PI), PI);
        assert!((wrap_angle(3.0 * PI + 0.1) - (-PI + 0.1)).abs() < 1e-12);
    }

    #[test]
    fn a_trajectory_refuses_repeated_stamps_and_numbers_that_are_not_finite() {
        assert!(matches!(
            Trajectory::new(vec![at(1, 0.0), at(1, 1.0)]),
            Err(TrajectoryError::NotIncreasing { index: 1, .. })
        ));
        assert!(matches!(
            Trajectory::new(vec![at(1, f64::NAN)]),
            Err(TrajectoryError::NotFinite { index: 0, .. })
        ));
    }

    #[test]
    fn a_trajectory_interpolates_inside_and_is_silent_outside() {
        let trajectory = Trajectory::new(vec![at(0, 0.0), at(10, 1.0)]).unwrap();
        assert!((trajectory.at(Time::from_nanos(5)).unwrap().translation.x - 0.5).abs() < 1e-12);
        assert_eq!(trajectory.at(Time::from_nanos(10)).unwrap().translation.x, 1.0);
        assert_eq!(trajectory.at(Time::from_nanos(11)), None);
        assert_eq!(trajectory.at(Time::from_nanos(-1)), None);
        assert_eq!(Trajectory::default().at(Time::from_nanos(0)), None);
    }

    #[test]
    fn a_planar_pose_survives_the_lift_and_the_projection() {
        let pose = pose2(1.0, -2.0, 3.0);
        let back = planar(&spatial(&pose));
        assert!((back.translation.vector - pose.translation.vector).norm() < 1e-12);
        assert!((back.rotation.angle() - 3.0).abs() < 1e-12);
    }
}
