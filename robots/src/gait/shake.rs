//! How the gait shakes the trunk: motion locked to the stride, and the ringing after each touchdown.

use super::TrotSettings;
use super::oscillator::Oscillator;
use super::planar::NOMINAL_MPS;
use crate::go1::{BRACKET_KG, INERTIA_KGM2, LIDAR_KG, MASS_KG};
use arborloop_base::Stream;
use nalgebra::Point3;
use std::f64::consts::{PI, TAU};

/// A value and its rate, per second.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Moving {
    /// The value.
    pub(crate) x: f64,
    /// Its rate.
    pub(crate) rate: f64,
}

/// What the gait adds to the trunk's motion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Shaken {
    /// Ahead, meters.
    pub(crate) ahead: Moving,
    /// Up, meters.
    pub(crate) up: Moving,
    /// To the left, meters.
    pub(crate) left: Moving,
    /// Roll, radians.
    pub(crate) roll: Moving,
    /// Pitch, radians.
    pub(crate) pitch: Moving,
    /// Yaw, radians.
    pub(crate) yaw: Moving,
}

/// The shaking and its memory.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shake {
    /// How strong, 1 at the nominal speed; a smooth follower, so that no amplitude ever jumps.
    strength: Oscillator,
    up: Oscillator,
    roll: Oscillator,
    pitch: Oscillator,
    impulses: [Impulse; 4],
    tick_s: f64,
}

/// A touchdown under way: the sole spreads it over [`CONTACT_S`] as half a sine.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Impulse {
    newton_s: f64,
    age_s: f64,
}

/// Duration of a touchdown, seconds; assumed: a rubber sole on soil.
const CONTACT_S: f64 = 0.006;
/// Deviation of the strength from stride to stride; assumed.
const STRENGTH_SCATTER_RATIO: f64 = 0.1;
/// How fast the strength follows, hertz, and its damping ratio; assumed: within a stride, without overshoot.
const STRENGTH_HZ: f64 = 2.0;
const STRENGTH_DAMPING_RATIO: f64 = 0.9;
/// The least strength that a walking trunk shows, and its growth with the speed (physics prototype at 0.25 to 1 m/s).
const STRENGTH_AT_REST: f64 = 0.4;
/// Below this pace the gait only treads, and its shaking fades, m/s; assumed.
const TREADING_MPS: f64 = 0.1;
/// Strength below which the gait may stop without a visible jerk.
const QUIET: f64 = 0.005;

impl Shake {
    /// Nothing moves.
    pub(crate) fn still(settings: &TrotSettings, tick_s: f64) -> Self {
        let mode = Oscillator::at_rest(0.0, settings.impact_hz, settings.impact_damping_ratio, tick_s);
        Shake {
            strength: Oscillator::at_rest(0.0, STRENGTH_HZ, STRENGTH_DAMPING_RATIO, tick_s),
            up: mode,
            roll: mode,
            pitch: mode,
            impulses: [Impulse { newton_s: 0.0, age_s: CONTACT_S }; 4],
            tick_s,
        }
    }

    /// Whether the gait may stop here.
    pub(crate) fn is_quiet(&self) -> bool {
        self.strength.x.abs() < QUIET
    }

    /// A foot lands: remembers its impulse, `m v` scattered from its own address.
    pub(crate) fn land(&mut self, leg: usize, settings: &TrotSettings, stream: Stream, stride: u64) {
        let scatter = 1.0 + settings.touchdown_scatter_ratio * stream.child(leg as u64).at(stride).normal();
        let speed_mps = settings.touchdown_mps * self.strength.x.max(0.0) * scatter.max(0.0);
        self.impulses[leg] = Impulse { newton_s: settings.touchdown_kg * speed_mps, age_s: 0.0 };
    }

    /// One tick: `pace_mps` is how fast the feet move (0 when standing), `feet` are in the base frame.
    pub(crate) fn advance(
        &mut self,
        pace_mps: f64,
        stride: u64,
        stream: Stream,
        feet: &[Point3<f64>; 4],
        settings: &TrotSettings,
    ) {
        let treading = (pace_mps / TREADING_MPS).min(1.0);
        let fade = treading * treading * (3.0 - 2.0 * treading);
        let growth = STRENGTH_AT_REST + (1.0 - STRENGTH_AT_REST) * (pace_mps / NOMINAL_MPS).min(3.0);
        let scatter = 1.0 + STRENGTH_SCATTER_RATIO * stream.at(stride).normal();
        self.strength.advance(settings.vibration_ratio * fade * growth * scatter);

        let (mut up_n, mut roll_nm, mut pitch_nm) = (0.0, 0.0, 0.0);
        for (impulse, foot) in self.impulses.iter_mut().zip(feet) {
            let force_n = impulse.mean_force_n(self.tick_s);
            impulse.age_s += self.tick_s;
            up_n += force_n;
            roll_nm += foot.y * force_n;
            pitch_nm -= foot.x * force_n;
        }
        self.up.push(up_n / (MASS_KG + LIDAR_KG + BRACKET_KG));
        self.roll.push(roll_nm / INERTIA_KGM2[0]);
        self.pitch.push(pitch_nm / INERTIA_KGM2[1]);
    }

    /// What to add to the trunk's motion at a stride phase that grows by `phase_rate` per second.
    pub(crate) fn at(&self, phase: f64, phase_rate: f64, settings: &TrotSettings) -> Shaken {
        let locked = |amplitude: f64, times: f64, ahead: f64| {
            let (sin, cos) = (TAU * times * phase + ahead).sin_cos();
            let (x, rate) = (self.strength.x * amplitude, self.strength.rate * amplitude);
            Moving { x: x * sin, rate: rate * sin + x * TAU * times * phase_rate * cos }
        };
        let plus = |one: Moving, mode: &Oscillator| Moving { x: one.x + mode.x, rate: one.rate + mode.rate };
        let half_turn = PI / 2.0;
        // The trunk is highest when the diagonals change over, and sways toward the pair that stands.
        let bob = locked(settings.bob_m, 2.0, half_turn);
        let ripple = locked(settings.ripple_m, 4.0, 0.0);
        Shaken {
            ahead: Moving::default(),
            up: plus(Moving { x: bob.x + ripple.x, rate: bob.rate + ripple.rate }, &self.up),
            left: locked(settings.sway_m, 1.0, 0.0),
            roll: plus(locked(settings.roll_deg.to_radians(), 1.0, 0.0), &self.roll),
            pitch: plus(locked(settings.pitch_deg.to_radians(), 2.0, 0.0), &self.pitch),
            yaw: locked(settings.yaw_deg.to_radians(), 1.0, half_turn),
        }
    }
}

impl Impulse {
    /// Mean of the half sine over the tick to come: the whole impulse arrives whatever the tick.
    fn mean_force_n(&self, tick_s: f64) -> f64 {
        let share = |age_s: f64| 0.5 * (1.0 - (PI * (age_s / CONTACT_S).min(1.0)).cos());
        self.newton_s * (share(self.age_s + tick_s) - share(self.age_s)) / tick_s
    }
}
