//! Carrying a body off: lifted at one instant and put down elsewhere as it was, on the ground that is there.

use super::suspension::tilt;
use super::walk::FootPlane;
use super::{Ground, TrunkState};
use arborloop_base::{Pose, Pose2, planar, yaw_of};
use nalgebra::{Point2, Point3, Translation3, UnitQuaternion, Vector3};

/// Where a base stood and where it was put down, world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carry {
    /// Before.
    pub world_from_base_before: Pose,
    /// After.
    pub world_from_base: Pose,
}

impl Carry {
    /// A rigid body moved by `by`, as its base sees it: seen from above exactly so. Tilt and height change as the plane of
    /// the ground under its feet (or wheels) does, and no foot that stands is put deeper into the ground than one of them was.
    pub fn of(state: &TrunkState, by: &Pose2, ground: &dyn Ground) -> Carry {
        let before = state.world_from_base;
        let (from, to) = (planar(&before), planar(&before) * by);
        let moved = to * from.inverse();
        let soil = |place: Point2<f64>| Point3::new(place.x, place.y, ground.height_m(place.x, place.y));
        let plane = FootPlane::through(&state.feet_world.map(|foot| soil(foot.xy())));
        let new_plane = FootPlane::through(&state.feet_world.map(|foot| soil(moved * foot.xy())));
        let (from_yaw_rad, to_yaw_rad) = (from.rotation.angle(), to.rotation.angle());
        let (roll, pitch) = tilt(plane.slope, from_yaw_rad);
        let (new_roll, new_pitch) = tilt(new_plane.slope, to_yaw_rad);
        let euler = before.rotation.euler_angles();
        let turn = UnitQuaternion::from_euler_angles(
            euler.0 + new_roll - roll,
            euler.1 + new_pitch - pitch,
            to_yaw_rad,
        );
        let (old_m, new_m) =
            (plane.height_m(from.translation.vector), new_plane.height_m(to.translation.vector));
        let place =
            Translation3::new(to.translation.x, to.translation.y, before.translation.z + new_m - old_m);
        let mut carry =
            Carry { world_from_base_before: before, world_from_base: Pose::from_parts(place, turn) };
        carry.world_from_base.translation.z += carry.lift_m(state, ground);
        carry
    }

    /// How much higher to put the body down so that no foot that stands is deeper in the ground than it was.
    fn lift_m(&self, state: &TrunkState, ground: &dyn Ground) -> f64 {
        let clear_m = |foot: &Point3<f64>| foot.z - ground.height_m(foot.x, foot.y);
        let moved = self.world_from_world();
        (0..4)
            .filter(|foot| state.stance[*foot])
            .map(|foot| &state.feet_world[foot])
            .map(|foot| clear_m(foot) - clear_m(&(moved * foot)))
            .reduce(f64::max)
            .unwrap_or(0.0)
    }

    /// What moves everything that the body is or remembers.
    pub fn world_from_world(&self) -> Pose {
        self.world_from_base * self.world_from_base_before.inverse()
    }

    /// By how much the heading changed, radians.
    pub(crate) fn turned_rad(&self) -> f64 {
        yaw_of(&self.world_from_base) - yaw_of(&self.world_from_base_before)
    }
}

impl TrunkState {
    /// The body as it was, elsewhere.
    pub fn carried(&self, carry: &Carry) -> TrunkState {
        let moved = carry.world_from_world();
        let mut loads = self.loads;
        if let Some(loads) = loads.as_mut() {
            loads.foot_forces_n = loads.foot_forces_n.map(|force: Vector3<f64>| moved.rotation * force);
        }
        TrunkState {
            world_from_base: carry.world_from_base,
            linear_mps: moved.rotation * self.linear_mps,
            feet_world: self.feet_world.map(|foot| moved * foot),
            loads,
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::pose2;

    struct Slope;

    impl Ground for Slope {
        fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
            0.1 * x_m - 0.05 * y_m + if x_m > 3.0 { 0.4 } else { 0.0 }
        }
    }

    /// Parallel to a slope, all feet on it.
    fn standing(at: &Pose2) -> TrunkState {
        let foot = |x: f64, y: f64| {
            let place = at * Point2::new(x, y);
            Point3::new(place.x, place.y, Slope.height_m(place.x, place.y) + 0.02)
        };
        let feet_world = [foot(0.2, -0.1), foot(0.2, 0.1), foot(-0.2, -0.1), foot(-0.2, 0.1)];
        let plane = FootPlane::through(&feet_world);
        let yaw_rad = at.rotation.angle();
        let (roll, pitch) = tilt(plane.slope, yaw_rad);
        let place = at.translation.vector;
        TrunkState {
            world_from_base: Pose::from_parts(
                Translation3::new(place.x, place.y, plane.height_m(place) + 0.3),
                UnitQuaternion::from_euler_angles(roll, pitch, yaw_rad),
            ),
            linear_mps: Vector3::new(0.5, 0.0, 0.05),
            angular_radps: Vector3::zeros(),
            phase: 0.0,
            stance: [true; 4],
            feet_world,
            joint_angles_rad: [0.0; 12],
            loads: None,
            rolled: None,
        }
    }

    #[test]
    fn a_body_put_down_elsewhere_on_a_slope_stands_there_as_one_that_walked_there() {
        let from = pose2(-2.0, 1.0, 0.3);
        for by in [pose2(1.0, 0.0, 0.0), pose2(-0.4, 0.8, 2.0), pose2(7.0, 0.0, -3.0)] {
            let state = standing(&from);
            let carry = Carry::of(&state, &by, &Slope);
            let (found, wanted) = (state.carried(&carry), standing(&(from * by)));
            let seen = planar(&found.world_from_base).inverse() * (from * by);
            assert!(seen.translation.vector.norm() < 1e-12 && seen.rotation.angle().abs() < 1e-12);
            let off = found.world_from_base.inverse() * wanted.world_from_base;
            // A body parallel to the slope at one heading is put down a little beside its feet at another.
            assert!(off.translation.vector.norm() < 0.005 && off.rotation.angle() < 1e-9, "{off}");
            let clear_m = found.feet_world.map(|foot| foot.z - Slope.height_m(foot.x, foot.y));
            assert!(clear_m.iter().all(|clear_m| (0.02 - 1e-9..0.03).contains(clear_m)), "{clear_m:?}");
            let speed = |state: &TrunkState| state.world_from_base.rotation.inverse() * state.linear_mps;
            assert!((speed(&found) - speed(&state)).norm() < 1e-12);
        }
    }
}
