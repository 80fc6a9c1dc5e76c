//! What shakes the trunk of a kinematic gait: the trot's own sines and impacts, strides of the library, or nothing.

use super::planar::Planar;
use super::replay::Replay;
use super::settings::{GaitMode, TrotSettings};
use super::shake::{Shake, Shaken};
use super::strides::StrideLibrary;
use arborloop_base::{Seed, Stream};
use nalgebra::Point3;

/// A source of shaking.
#[derive(Debug, Clone)]
pub(crate) enum Shaker {
    Sines { shake: Box<Shake>, touchdowns: Stream, strengths: Stream },
    Strides(Box<Replay>),
    Nothing,
}

/// Where the stride is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Beat {
    /// Stride phase in [0, 1).
    pub(crate) phase: f64,
    /// Number of the stride.
    pub(crate) stride: u64,
    /// How fast the feet move, m/s; zero when standing.
    pub(crate) pace_mps: f64,
}

impl Shaker {
    /// What a mode asks for; physics shakes by itself and has no use for this.
    pub(crate) fn new(settings: &TrotSettings, seed: Seed, tick_s: f64) -> Self {
        match settings.mode {
            GaitMode::Kinematic | GaitMode::Physics => Shaker::Sines {
                shake: Box::new(Shake::still(settings, tick_s)),
                touchdowns: seed.stream("robot/trot/touchdown"),
                strengths: seed.stream("robot/trot/strength"),
            },
            GaitMode::Strides => {
                let stream = seed.stream("robot/trot/library");
                Shaker::Strides(Box::new(Replay::new(StrideLibrary::go1(), stream, tick_s)))
            }
            GaitMode::Smooth => Shaker::Nothing,
        }
    }

    /// Whether the gait may stop here.
    pub(crate) fn is_quiet(&self) -> bool {
        match self {
            Shaker::Sines { shake, .. } => shake.is_quiet(),
            Shaker::Strides(replay) => replay.is_quiet(),
            Shaker::Nothing => true,
        }
    }

    /// A foot lands.
    pub(crate) fn land(&mut self, leg: usize, settings: &TrotSettings, stride: u64) {
        if let Shaker::Sines { shake, touchdowns, .. } = self {
            shake.land(leg, settings, *touchdowns, stride);
        }
    }

    /// One tick; `feet` are in the base frame, `footholds` in the world.
    pub(crate) fn advance(
        &mut self,
        beat: &Beat,
        planar: &Planar,
        feet: &[Point3<f64>; 4],
        footholds: &[Point3<f64>; 4],
        settings: &TrotSettings,
    ) {
        match self {
            Shaker::Sines { shake, strengths, .. } => {
                shake.advance(beat.pace_mps, beat.stride, *strengths, feet, settings);
            }
            Shaker::Strides(replay) => {
                let [fr, fl, rr, rl] = footholds.map(|foot| foot.z);
                let crosswise_m = ((fr + rl - fl - rr) / 4.0).abs();
                replay.advance(beat.phase, beat.pace_mps, crosswise_m, planar, settings);
            }
            Shaker::Nothing => {}
        }
    }

    /// What to add to the trunk's smooth motion at a stride phase that grows by `phase_rate` per second.
    pub(crate) fn at(&self, phase: f64, phase_rate: f64, settings: &TrotSettings) -> Shaken {
        match self {
            Shaker::Sines { shake, .. } => shake.at(phase, phase_rate, settings),
            Shaker::Strides(replay) => replay.shaken(),
            Shaker::Nothing => Shaken::default(),
        }
    }
}
