//! The feet of a trot: two diagonals in turn; a foot stands fixed in the world or swings to its next foothold.

use super::planar::Planar;
use super::{Ground, TrotSettings};
use crate::go1::{FOOT_RADIUS_M, FOOT_Y_M, HIP_X_M};
use arborloop_base::Pose2;
use nalgebra::{Point2, Point3};

/// Phase by which each leg (FR, FL, RR, RL) is ahead: diagonals together (unitree_guide).
const PHASE_AHEAD: [f64; 4] = [0.0, 0.5, 0.5, 0.0];

/// Where the feet are, world frame; centers of their spheres.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Legs {
    /// Now.
    pub(crate) feet: [Point3<f64>; 4],
    /// Where each foot stood last, and stands while it does.
    pub(crate) footholds: [Point3<f64>; 4],
    /// Which stand.
    pub(crate) stance: [bool; 4],
}

/// Where a foot stands under a body at rest, base frame, meters.
fn neutral(leg: usize) -> Point2<f64> {
    let (ahead, left) = (if leg < 2 { 1.0 } else { -1.0 }, if leg.is_multiple_of(2) { -1.0 } else { 1.0 });
    Point2::new(ahead * HIP_X_M, left * FOOT_Y_M)
}

/// A foot's center when it stands at a place.
fn standing(place: Point2<f64>, ground: &dyn Ground) -> Point3<f64> {
    Point3::new(place.x, place.y, ground.height_m(place.x, place.y) + FOOT_RADIUS_M)
}

impl Legs {
    /// All four standing under a body at rest.
    pub(crate) fn standing(planar: &Planar, ground: &dyn Ground) -> Self {
        let feet = std::array::from_fn(|leg| standing(planar.after(0.0) * neutral(leg), ground));
        Legs { feet, footholds: feet, stance: [true; 4] }
    }

    /// Moves the feet to a stride phase; tells which touched down.
    pub(crate) fn advance(
        &mut self,
        phase: f64,
        planar: &Planar,
        settings: &TrotSettings,
        ground: &dyn Ground,
    ) -> [bool; 4] {
        std::array::from_fn(|leg| {
            let leg_phase = (phase + PHASE_AHEAD[leg]).fract();
            let stands = leg_phase < settings.duty_ratio;
            let touched_down = stands && !self.stance[leg];
            self.stance[leg] = stands;
            if stands {
                if touched_down {
                    let foot = self.feet[leg];
                    self.footholds[leg] = standing(foot.xy(), ground);
                }
                self.feet[leg] = self.footholds[leg];
            } else {
                let share = (leg_phase - settings.duty_ratio) / (1.0 - settings.duty_ratio);
                self.feet[leg] = self.swinging(leg, share, planar, settings, ground);
            }
            touched_down
        })
    }

    /// Puts the feet down elsewhere: each stands, or swings, as high over the ground as it did.
    pub(crate) fn carry(&mut self, moved: &Pose2, ground: &dyn Ground) {
        let carried = |foot: &Point3<f64>| {
            let place = moved * foot.xy();
            Point3::new(
                place.x,
                place.y,
                foot.z + ground.height_m(place.x, place.y) - ground.height_m(foot.x, foot.y),
            )
        };
        self.feet = self.feet.each_ref().map(carried);
        self.footholds = self.footholds.each_ref().map(carried);
    }

    /// A foot on its way: minimum jerk along the ground, a smooth arc above it.
    fn swinging(
        &self,
        leg: usize,
        share: f64,
        planar: &Planar,
        settings: &TrotSettings,
        ground: &dyn Ground,
    ) -> Point3<f64> {
        // Raibert: the foothold is the neutral place under the body in the middle of the stance to come.
        let until_landing_s = (1.0 - share) * (1.0 - settings.duty_ratio) * settings.period_s;
        let middle_of_stance_s = until_landing_s + 0.5 * settings.duty_ratio * settings.period_s;
        let to = standing(planar.after(middle_of_stance_s) * neutral(leg), ground);
        let from = self.footholds[leg];
        let along = share.powi(3) * (10.0 - 15.0 * share + 6.0 * share * share);
        let arc_m = settings.swing_height_m * 64.0 * (share * (1.0 - share)).powi(3);
        let mut foot = from + (to - from) * along;
        foot.z = (foot.z + arc_m).max(standing(foot.xy(), ground).z);
        foot
    }
}
