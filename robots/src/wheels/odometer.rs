//! What turning wheels tell of a body's motion, if none of them slips.

use super::Wheeled;
use arborloop_base::Twist;
use nalgebra::{Vector2, Vector3};

/// Velocity and turn rate of the base from the speeds of its wheels (rad/s) and their bearings (radians), as the wheels
/// believe: each rolls without slipping along its bearing. A skid-steered robot's turn is told by its wider track.
///
/// With steering, the rigid motion that fits the four rolling velocities best.
pub fn twist_of_wheels(
    robot: &Wheeled,
    track_ratio: f64,
    rates_radps: &[f64; 4],
    bearings_rad: &[f64; 4],
) -> Twist {
    let middle = robot.wheels.iter().map(|wheel| wheel.center.coords.xy()).sum::<Vector2<f64>>() / 4.0;
    let rolling = |n: usize| {
        let (sin, cos) = bearings_rad[n].sin_cos();
        Vector2::new(cos, sin) * (robot.wheels[n].radius_m * rates_radps[n])
    };
    let mean = (0..4).map(rolling).sum::<Vector2<f64>>() / 4.0;
    let turn_radps = if robot.steers() {
        let (mut moment, mut spread) = (0.0, 0.0);
        for (n, wheel) in robot.wheels.iter().enumerate() {
            let arm = wheel.center.coords.xy() - middle;
            moment += arm.perp(&(rolling(n) - mean));
            spread += arm.norm_squared();
        }
        moment / spread
    } else {
        let speed = |n: usize| rolling(n).x;
        (speed(0) + speed(2) - speed(1) - speed(3)) / (2.0 * track_ratio * robot.track_m())
    };
    // Of the base's origin, which need not be the middle between the wheels.
    Twist {
        linear_mps: Vector3::new(mean.x + turn_radps * middle.y, mean.y - turn_radps * middle.x, 0.0),
        angular_radps: Vector3::new(0.0, 0.0, turn_radps),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Command;
    use crate::wheels::{Drive, WheelSettings, jackal, thorvald};

    #[test]
    fn wheels_that_do_not_slip_tell_the_command_that_drives_them() {
        for robot in [jackal(), thorvald()] {
            let settings = WheelSettings::default();
            for (forward_mps, turn_radps) in [(0.5, 0.0), (0.4, 0.3), (-0.5, 0.1), (0.0, 0.4), (0.3, -0.5)] {
                let mut drive = Drive::new(&robot, &settings, 0.01);
                let command = Command { forward_mps, turn_radps };
                let mut bearings = [0.0; 4];
                let mut targets = drive.step(&command, &bearings);
                for _ in 0..500 {
                    // Steering that follows at once.
                    bearings = targets.bearings_rad;
                    targets = drive.step(&command, &bearings);
                }
                let told = twist_of_wheels(&robot, settings.track_ratio, &targets.rates_radps, &bearings);
                let wanted = Twist::planar(forward_mps, turn_radps);
                assert!((told.linear_mps - wanted.linear_mps).norm() < 1e-9, "{told:?} of {command:?}");
                assert!((told.angular_radps - wanted.angular_radps).norm() < 1e-9, "{told:?} of {command:?}");
            }
        }
    }
}
