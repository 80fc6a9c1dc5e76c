//! What one leg is about: carrying, swinging to its next foothold, or being lowered until it meets the ground.

use super::swing::{Aim, Swing};
use arborloop_base::Pose;
use nalgebra::{Point3, Vector3};

/// How fast the lowering of a late foot grows, m/s2, and its most, m/s; assumed: a hole of 3 cm is found in 60 ms.
const LOWERING_MPS2: f64 = 12.0;
const LOWERING_MPS_MAX: f64 = 0.8;
/// A foot that should carry and feels nothing for this long has lost the ground, seconds; assumed.
const SILENT_S: f64 = 0.015;
/// Share of a swing after which a touch counts as the touchdown, not as a stumble; assumed.
const EARLY: f64 = 0.5;
/// Share of a swing that a foot may begin late, waiting for the other diagonal; assumed: a quarter.
const WAITING: f64 = 0.25;

/// A leg's occupation, and where its foot stood last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stepping {
    pub(crate) duty: Duty,
    /// Where it stands or stood last, odometry frame.
    pub(crate) foothold: Point3<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Duty {
    /// On the ground: the share of its load that it may take, and since when it felt no ground.
    Carrying { load: f64, silent_s: f64 },
    /// In the air: where it left the ground, and at which share of its planned swing.
    Swinging { from: Point3<f64>, begun: f64 },
    /// Looking for the ground below a place.
    Lowering { from: Point3<f64>, since_s: f64 },
}

/// What the clock and the feet say about a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cue {
    /// Whether it is its time to stand.
    pub(crate) stands: bool,
    /// Share of its planned swing that is over; above one while it stands.
    pub(crate) share: f64,
    /// Time until it is to lift, seconds; none while it swings.
    pub(crate) left_s: f64,
    /// Whether the feet of the other diagonal carry.
    pub(crate) relieved: bool,
    /// Where its foot is, odometry frame.
    pub(crate) foot: Point3<f64>,
    /// Whether its foot feels the ground.
    pub(crate) touches: bool,
}

impl Stepping {
    /// A foot that has stood for long.
    pub(crate) fn standing(foot: Point3<f64>) -> Self {
        Stepping { duty: Duty::Carrying { load: 1.0, silent_s: 0.0 }, foothold: foot }
    }

    /// Whether it is on the ground.
    pub(crate) fn carries(&self) -> bool {
        matches!(self.duty, Duty::Carrying { .. })
    }

    /// Share of its greatest load that it may take, zero in the air.
    pub(crate) fn load(&self) -> f64 {
        match self.duty {
            Duty::Carrying { load, .. } => load,
            Duty::Swinging { .. } | Duty::Lowering { .. } => 0.0,
        }
    }

    /// One tick.
    pub(crate) fn advance(&mut self, cue: &Cue, ramp_s: f64, tick_s: f64) {
        let swing = Duty::Swinging { from: cue.foot, begun: cue.share };
        self.duty = match self.duty {
            Duty::Carrying { load, silent_s } => {
                // A leg gives its load back only when others are there to take it, or when it can wait no longer.
                let over = !cue.stands && cue.share < EARLY;
                let leaves = (over || cue.left_s < ramp_s) && (cue.relieved || (over && cue.share > WAITING));
                let step = if leaves { -tick_s / ramp_s } else { tick_s / ramp_s };
                let load = (load + step).clamp(0.02, 1.0);
                let silent_s = if cue.touches { 0.0 } else { silent_s + tick_s };
                if over && load <= 0.05 {
                    swing
                } else if silent_s > SILENT_S {
                    Duty::Lowering { from: cue.foot, since_s: 0.0 }
                } else {
                    Duty::Carrying { load, silent_s }
                }
            }
            Duty::Swinging { .. } | Duty::Lowering { .. }
                if cue.touches && (cue.stands || cue.share > EARLY) =>
            {
                self.foothold = cue.foot;
                Duty::Carrying { load: 0.02, silent_s: 0.0 }
            }
            Duty::Swinging { .. } if cue.stands => Duty::Lowering { from: cue.foot, since_s: 0.0 },
            Duty::Lowering { .. } if !cue.stands && cue.share < EARLY => swing,
            Duty::Lowering { from, since_s } => Duty::Lowering { from, since_s: since_s + tick_s },
            swinging @ Duty::Swinging { .. } => swinging,
        };
    }

    /// Moves the places that it remembers.
    pub(crate) fn carry(&mut self, moved: &Pose) {
        self.foothold = moved * self.foothold;
        match &mut self.duty {
            Duty::Carrying { .. } => {}
            Duty::Swinging { from, .. } | Duty::Lowering { from, .. } => *from = moved * *from,
        }
    }

    /// Where the foot is to be; `to` is its next foothold. `None` while it carries.
    pub(crate) fn aim(
        &self,
        share: f64,
        to: Point3<f64>,
        height_m: f64,
        touchdown_mps: f64,
        swing_s: f64,
    ) -> Option<Aim> {
        match self.duty {
            Duty::Carrying { .. } => None,
            Duty::Swinging { from, begun } => {
                let left = (1.0 - begun).max(0.1);
                let swing = Swing { from, to, height_m, touchdown_mps, duration_s: left * swing_s };
                Some(swing.at((share - begun) / left))
            }
            Duty::Lowering { from, since_s } => {
                let grown_s = ((LOWERING_MPS_MAX - touchdown_mps) / LOWERING_MPS2).max(0.0);
                let growing_s = since_s.min(grown_s);
                let down_mps = touchdown_mps + LOWERING_MPS2 * growing_s;
                let down_m = touchdown_mps * growing_s
                    + 0.5 * LOWERING_MPS2 * growing_s * growing_s
                    + down_mps * (since_s - growing_s);
                let change = if since_s < grown_s { -LOWERING_MPS2 } else { 0.0 };
                Some(Aim {
                    at: from - Vector3::z() * down_m,
                    velocity_mps: Vector3::new(0.0, 0.0, -down_mps),
                    acceleration_mps2: Vector3::new(0.0, 0.0, change),
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FOOT: Point3<f64> = Point3::new(0.2, -0.1, 0.02);

    fn cue(stands: bool, share: f64, touches: bool) -> Cue {
        Cue { stands, share, left_s: if stands { 0.1 } else { 0.0 }, relieved: true, foot: FOOT, touches }
    }

    #[test]
    fn a_leg_lifts_when_relieved_swings_and_carries_again_at_the_touch() {
        let mut leg = Stepping::standing(FOOT);
        (0..30).for_each(|_| leg.advance(&cue(false, 0.05, true), 0.02, 0.001));
        assert!(matches!(leg.duty, Duty::Swinging { .. }));
        leg.advance(&cue(false, 0.2, true), 0.02, 0.001);
        assert!(!leg.carries(), "a touch right after the lift-off is none");
        leg.advance(&cue(false, 0.8, true), 0.02, 0.001);
        assert!(leg.carries());
    }

    #[test]
    fn a_leg_that_nobody_relieves_waits_but_not_forever() {
        let mut leg = Stepping::standing(FOOT);
        let alone = |share| Cue { relieved: false, ..cue(false, share, true) };
        (0..50).for_each(|_| leg.advance(&alone(0.1), 0.02, 0.001));
        assert!(leg.carries());
        (0..50).for_each(|_| leg.advance(&alone(0.3), 0.02, 0.001));
        assert!(!leg.carries());
    }

    #[test]
    fn a_late_foot_goes_down_ever_faster_until_it_meets_the_ground() {
        let mut leg = Stepping::standing(FOOT);
        (0..20).for_each(|_| leg.advance(&cue(true, 1.1, false), 0.02, 0.001));
        assert!(matches!(leg.duty, Duty::Lowering { .. }));
        let height = |leg: &Stepping| leg.aim(1.1, FOOT, 0.08, 0.15, 0.2).unwrap();
        let before = height(&leg);
        (0..60).for_each(|_| leg.advance(&cue(true, 1.2, false), 0.02, 0.001));
        let after = height(&leg);
        assert!(before.at.z - after.at.z > 0.03 && after.velocity_mps.z < before.velocity_mps.z);
        leg.advance(&cue(true, 1.3, true), 0.02, 0.001);
        assert!(leg.carries());
    }
}
