//! How the trunk follows the ground: a plane through the last four footholds, low-passed, followed by three oscillators.

use super::TrotSettings;
use super::legs::Legs;
use super::oscillator::Oscillator;
use super::planar::{Planar, rotated};
use crate::go1::FOOT_RADIUS_M;
use nalgebra::{Matrix2, Vector2};

/// Height, roll and pitch of the trunk over the ground plane.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Suspension {
    /// Height of the trunk origin, world frame, meters.
    pub(crate) height: Oscillator,
    /// Roll, radians.
    pub(crate) roll: Oscillator,
    /// Pitch, radians, positive nose down.
    pub(crate) pitch: Oscillator,
    plane_height_m: f64,
    plane_slope: Vector2<f64>,
}

impl Suspension {
    /// Settled over the feet.
    pub(crate) fn settled(legs: &Legs, planar: &Planar, settings: &TrotSettings, tick_s: f64) -> Self {
        let (plane_height_m, plane_slope) = plane(legs, planar.place);
        let (roll_rad, pitch_rad) = tilt(plane_slope, planar.yaw_rad);
        let rest =
            |x| Oscillator::at_rest(x, settings.suspension_hz, settings.suspension_damping_ratio, tick_s);
        Suspension {
            height: rest(plane_height_m + settings.stand_height_m),
            roll: rest(roll_rad),
            pitch: rest(pitch_rad),
            plane_height_m,
            plane_slope,
        }
    }

    /// One tick over the footholds.
    pub(crate) fn advance(&mut self, legs: &Legs, planar: &Planar, settings: &TrotSettings, tick_s: f64) {
        let (height_m, slope) = plane(legs, planar.place);
        let share = 1.0 - (-tick_s / settings.plane_lag_s).exp();
        self.plane_slope += (slope - self.plane_slope) * share;
        // The plane rises under a body that walks uphill: without this term the low-pass would lag behind a slope.
        self.plane_height_m += self.plane_slope.dot(&planar.velocity_mps()) * tick_s;
        self.plane_height_m += (height_m - self.plane_height_m) * share;
        let (roll_rad, pitch_rad) = tilt(self.plane_slope, planar.yaw_rad);
        self.height.advance(self.plane_height_m + settings.stand_height_m);
        self.roll.advance(roll_rad);
        self.pitch.advance(pitch_rad);
    }

    /// Puts the trunk over feet that were carried off, as it was over the ones `before`; `planar` is where it is now.
    pub(crate) fn carry(
        &mut self,
        before: &Legs,
        place: Vector2<f64>,
        legs: &Legs,
        planar: &Planar,
        turn_rad: f64,
    ) {
        let (height_m, slope) = plane(before, place);
        let (new_height_m, new_slope) = plane(legs, planar.place);
        let (roll_rad, pitch_rad) = tilt(self.plane_slope, planar.yaw_rad - turn_rad);
        self.plane_slope = rotated(self.plane_slope - slope, turn_rad) + new_slope;
        let (new_roll_rad, new_pitch_rad) = tilt(self.plane_slope, planar.yaw_rad);
        self.plane_height_m += new_height_m - height_m;
        self.height.x += new_height_m - height_m;
        self.roll.x += new_roll_rad - roll_rad;
        self.pitch.x += new_pitch_rad - pitch_rad;
    }
}

/// Least-squares plane through the footholds' ground: its height at a place and its slope, world frame.
fn plane(legs: &Legs, place: Vector2<f64>) -> (f64, Vector2<f64>) {
    let middle = legs.footholds.iter().map(|foot| foot.coords).sum::<nalgebra::Vector3<f64>>() / 4.0;
    let mut spread = Matrix2::zeros();
    let mut rise = Vector2::zeros();
    for foot in &legs.footholds {
        let offset = foot.coords - middle;
        spread += offset.xy() * offset.xy().transpose();
        rise += offset.xy() * offset.z;
    }
    // Four feet around the trunk always span the plane; level is the answer should they ever not.
    let slope = spread.try_inverse().map_or(Vector2::zeros(), |inverse| inverse * rise);
    (middle.z - FOOT_RADIUS_M + slope.dot(&(place - middle.xy())), slope)
}

/// Roll and pitch of a trunk parallel to a plane, radians.
pub(crate) fn tilt(slope: Vector2<f64>, yaw_rad: f64) -> (f64, f64) {
    let (sin, cos) = yaw_rad.sin_cos();
    let ahead = cos * slope.x + sin * slope.y;
    let left = cos * slope.y - sin * slope.x;
    let pitch_rad = -ahead.atan();
    // Rz(yaw) Ry(pitch) Rx(roll): the roll turns about the pitched axis.
    (left.atan2((1.0 + ahead * ahead).sqrt()), pitch_rad)
}
