//! The wrench that keeps the trunk over its feet: proportional-derivative control of place, height and attitude.

use super::body::Body;
use super::plane::FootPlane;
use super::settings::WalkSettings;
use super::{Sensed, Wanted};
use arborloop_base::{wrap_angle, yaw_of};
use nalgebra::{Rotation3, UnitQuaternion, Vector2, Vector3, Vector6};

/// Standard gravity, m/s2.
pub(crate) const GRAVITY_MPS2: f64 = 9.806_65;
/// Most acceleration asked for along the ground and turning, m/s2 and rad/s2 (unitree_guide clips at 3 and 40).
const SIDEWAYS_MPS2_MAX: f64 = 3.0;
const TURNING_RADPS2_MAX: f64 = 40.0;

/// Force and torque about the center of mass that the feet are to give, world axes, N and N m.
pub(crate) fn wanted_wrench(
    body: &Body,
    settings: &WalkSettings,
    stand_height_m: f64,
    sensed: &Sensed,
    plane: &FootPlane,
    wanted: &Wanted,
) -> Vector6<f64> {
    let pose = &sensed.odom_from_base;
    let yaw_rad = yaw_of(pose);
    let place = pose.translation.vector;

    let speed = heading(yaw_rad) * wanted.command.forward_mps;
    let pull = (wanted.place - place.xy()) * settings.place_stiffness_per_s2
        + (speed - sensed.linear_mps.xy()) * settings.place_damping_per_s;
    let pull = pull.cap_magnitude(SIDEWAYS_MPS2_MAX);
    // Feet's centers stand one radius above the ground; the height asked for is above the ground.
    let height_m = plane.height_m(place.xy()) + stand_height_m - crate::go1::FOOT_RADIUS_M;
    let climb_mps = plane.slope.dot(&sensed.linear_mps.xy());
    let lift_mps2 = settings.height_stiffness_per_s2 * (height_m - place.z)
        + settings.height_damping_per_s * (climb_mps - sensed.linear_mps.z);

    let turn = sensed.odom_from_base.rotation;
    let error = (attitude_on(plane, wanted.yaw_rad, yaw_rad) * turn.inverse()).scaled_axis();
    let spin = turn * sensed.angular_radps;
    let spin_wanted = Vector3::z() * wanted.command.turn_radps;
    let turning = (error * settings.attitude_stiffness_per_s2
        + (spin_wanted - spin) * settings.attitude_damping_per_s)
        .cap_magnitude(TURNING_RADPS2_MAX);

    let force = Vector3::new(pull.x, pull.y, lift_mps2 + GRAVITY_MPS2) * body.mass_kg;
    let axes = turn.to_rotation_matrix();
    let inertia = axes.matrix() * body.inertia_kgm2 * axes.matrix().transpose();
    let torque = inertia * turning + spin.cross(&(inertia * spin));
    Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
}

/// The direction of a heading along the ground.
pub(crate) fn heading(yaw_rad: f64) -> Vector2<f64> {
    Vector2::new(yaw_rad.cos(), yaw_rad.sin())
}

/// The attitude of a trunk parallel to the plane; the heading wanted is taken the short way from the present one.
fn attitude_on(plane: &FootPlane, yaw_wanted_rad: f64, yaw_rad: f64) -> UnitQuaternion<f64> {
    let yaw_rad = yaw_rad + wrap_angle(yaw_wanted_rad - yaw_rad);
    let ahead = heading(yaw_rad);
    let along = Vector3::new(ahead.x, ahead.y, plane.slope.dot(&ahead));
    let up = Vector3::new(-plane.slope.x, -plane.slope.y, 1.0);
    let left = up.cross(&along);
    let axes = Rotation3::from_basis_unchecked(&[
        along.normalize(),
        left.normalize(),
        along.cross(&left).normalize(),
    ]);
    UnitQuaternion::from_rotation_matrix(&axes)
}
