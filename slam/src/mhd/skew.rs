//! What foliage pretends the robot to turn within a sweep.
//!
//! Ahead a hedge is met from afar and at a grazing angle, behind it was mapped from near by: the points there lie at
//! another depth than the map's, to the left the other way round than to the right. The left comes half a sweep before the
//! right, so that between hedges the points ask for a turn within every sweep, of some degrees per second and always the same
//! way, that the headings from sweep to sweep do not show. Headings cannot be off by the same in every sweep, so what they and
//! the turn within the sweep do not agree on over many sweeps is skew: the points may have it in a match, and it is taken off
//! the motion by which they are drawn and the next sweep is expected.

use super::motion::Motion;

/// The skew follows over about so many sweeps: a gait's turns to and fro average out, another block of trees shows.
const SWEEPS: f64 = 100.0;
/// A larger disagreement teaches no more than this, radians per sweep: that is a jump, not foliage.
const LESSON_RAD_MAX: f64 = 0.01;
/// Increments over more than so many sweeps say nothing of the turn within the last one.
const GAP_SWEEPS: f64 = 1.5;

/// The turn within a sweep that is none; learned sweep by sweep.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Skew {
    /// Radians per sweep.
    rad: f64,
}

impl Skew {
    /// What the points' turn within a sweep exceeds the headings' increment by, radians per sweep.
    pub(crate) fn over_increment_rad(&self) -> f64 {
        self.rad
    }

    /// Learns from a match, as the points have it, and the motion before it.
    pub(crate) fn learn(&mut self, before: &Motion, matched: &Motion, duration_s: f64) {
        let elapsed_s = (matched.stamp - before.stamp).seconds();
        if duration_s <= 0.0 || elapsed_s <= 0.0 || elapsed_s > GAP_SWEEPS * duration_s {
            return;
        }
        let increment_rad = (matched.pose.z - before.pose.z) * (duration_s / elapsed_s);
        let lesson_rad = matched.velocity.z * duration_s - increment_rad - self.rad;
        self.rad += lesson_rad.clamp(-LESSON_RAD_MAX, LESSON_RAD_MAX) / SWEEPS;
    }

    /// Takes the skew off a match.
    pub(crate) fn take_off(&self, matched: &mut Motion, duration_s: f64) {
        if duration_s > 0.0 {
            matched.velocity.z -= self.rad / duration_s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Span, Time};
    use nalgebra::Vector3;

    const SWEEP_S: f64 = 0.1;

    /// The match of a sweep of a robot that shakes and turns, with a turn within the sweep that is too large.
    fn matched(sweep: i64, skew_radps: f64) -> Motion {
        let heading_rad = |sweep: i64| 0.02 * sweep as f64 + 0.01 * (sweep as f64 * 1.7).sin();
        let turn_radps = (heading_rad(sweep + 1) - heading_rad(sweep - 1)) / (2.0 * SWEEP_S);
        Motion {
            stamp: Time::from_nanos(0) + Span::from_millis(100) * sweep,
            pose: Vector3::new(0.0, 0.0, heading_rad(sweep)),
            velocity: Vector3::new(0.5, 0.0, turn_radps + skew_radps),
        }
    }

    #[test]
    fn a_turn_that_headings_never_show_is_learned_whatever_the_robot_does() {
        let mut skew = Skew::default();
        for sweep in 0..1000 {
            skew.learn(&matched(sweep, 0.0), &matched(sweep + 1, 0.06), SWEEP_S);
        }
        assert!((skew.over_increment_rad() - 0.006).abs() < 2e-4, "{skew:?}");
        let mut motion = matched(5, 0.06);
        skew.take_off(&mut motion, SWEEP_S);
        assert!((motion.velocity.z - matched(5, 0.0).velocity.z).abs() < 2e-3);
    }

    #[test]
    fn gaps_jumps_and_instant_scans_teach_next_to_nothing() {
        let mut skew = Skew::default();
        skew.learn(&matched(0, 0.0), &matched(30, 0.5), SWEEP_S);
        skew.learn(&matched(0, 0.0), &matched(1, 0.5), 0.0);
        skew.learn(&matched(1, 0.0), &matched(1, 0.5), SWEEP_S);
        assert_eq!(skew, Skew::default());
        let carried_off = Motion { pose: Vector3::new(0.0, 0.0, 3.0), ..matched(1, 0.0) };
        skew.learn(&matched(0, 0.0), &carried_off, SWEEP_S);
        assert!(skew.over_increment_rad().abs() <= LESSON_RAD_MAX / SWEEPS);
        let mut still = matched(1, 0.0);
        skew.take_off(&mut still, 0.0);
        assert_eq!(still, matched(1, 0.0));
    }
}
