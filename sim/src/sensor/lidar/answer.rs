//! What the sensor reports of a firing: which echoes it sees and chooses, with noise, dropout and the intensity byte.

use super::cast::{Scratch, Shot, Surface};
use super::echo::{self, Echo};
use super::model::EchoChoice;
use super::{Beam, Lidar};
use crate::optics::Hit;
use arborloop_base::{Draws, Label, Return, Span, Wire};

/// What is reported of one firing, a miss included.
#[derive(Debug, Clone, Copy)]
pub(super) struct Answer {
    /// Its packet got lost.
    pub(super) dropped: bool,
    /// Nearest first.
    pub(super) given: [Option<Given>; 2],
}

/// One return as measured.
#[derive(Debug, Clone, Copy)]
pub(super) struct Given {
    /// Range along the beam, meters; of a miss `None`.
    pub(super) along_m: Option<f64>,
    pub(super) intensity: f32,
    pub(super) label: Label,
}

/// Why the sensor does not see an echo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fate {
    /// It is nearer than the sensor reports.
    TooNear,
    /// Its energy is below what the sensor sees.
    TooWeak,
}

impl Answer {
    pub(super) const NONE: Answer = Answer { dropped: false, given: [None; 2] };
}

impl Given {
    pub(super) const MISS: Given = Given::miss(Label::MISS);

    /// Nothing is reported of what the label says was met.
    pub(super) const fn miss(label: Label) -> Self {
        Given { along_m: None, intensity: 0.0, label }
    }
}

/// Address of chance of the second return of a firing.
const SECOND: u64 = 3000;

impl Lidar {
    /// Joins what a shot met to echoes and reports them.
    #[inline(always)]
    pub(super) fn answer(&self, number: usize, scratch: &mut Scratch) -> Answer {
        let Scratch { shots, surfaces, echoes, .. } = scratch;
        let (shot, surfaces) = (&shots[number], &mut surfaces[number]);
        let given = match surfaces.as_mut_slice() {
            [] => [Some(Given::MISS), None],
            // Whichever echoes are chosen, a lone one is.
            [only] => [Some(self.given_alone(shot, only)), None],
            several => {
                echo::form(several, self.spec.model.pulse.length_m, self.width_rad, echoes);
                let given = self.choice_of(shot, echoes);
                [given[0].or(Some(Given::MISS)), given[1]]
            }
        };
        Answer { dropped: false, given }
    }

    /// What is reported of a lone shot.
    #[inline(always)]
    pub(super) fn given_lone(&self, shot: &Shot, met: Option<&Hit>) -> Given {
        let share = self.footprint[0].share;
        let only = |hit: &Hit| Surface { hit: *hit, sub_ray: 0, layer: 0, share };
        met.map_or(Given::MISS, |hit| self.given_alone(shot, &only(hit)))
    }

    /// What is reported of a surface that is all that a shot met.
    #[inline(always)]
    fn given_alone(&self, shot: &Shot, only: &Surface) -> Given {
        let echo = echo::alone(only);
        let along_m = if self.sees(&echo).is_ok() { self.measure(shot, &echo, 0) } else { None };
        let intensity = if along_m.is_some() { byte(echo.brightness) } else { 0.0 };
        Given { along_m, intensity, label: echo.label }
    }

    /// What is reported of several echoes.
    fn choice_of(&self, shot: &Shot, echoes: &[Echo]) -> [Option<Given>; 2] {
        let mut given = [None; 2];
        for (number, index) in self.choose(echoes).into_iter().flatten().enumerate() {
            given[number] = self.given(shot, &echoes[index], number);
        }
        // Noise may change places; two ranges that the wire cannot tell apart are one return.
        if let [Some(near), Some(far)] = &given {
            let range_m =
                |one: &Given| one.along_m.and_then(|along_m| self.point(shot, along_m, 0.0).range_m);
            let step_m = self.spec.model.range.range_step_m.max(0.002);
            let gap_m = range_m(far).unwrap_or(0.0) - range_m(near).unwrap_or(0.0);
            if gap_m.abs() <= 2.0 * step_m {
                given[1] = None;
            } else if gap_m < 0.0 {
                given.swap(0, 1);
            }
        }
        if given[0].is_none() {
            given.swap(0, 1);
        }
        if given[0].is_none() {
            given[0] = strongest(echoes).map(|index| Given::miss(echoes[index].label));
        }
        given
    }

    /// An echo as measured; `None` where it gets lost. `number` counts the returns of the firing.
    fn given(&self, shot: &Shot, echo: &Echo, number: usize) -> Option<Given> {
        let along_m = self.measure(shot, echo, number)?;
        Some(Given { along_m: Some(along_m), intensity: byte(echo.brightness), label: echo.label })
    }

    /// Whether the sensor sees an echo at all.
    #[inline(always)]
    pub(super) fn sees(&self, echo: &Echo) -> Result<(), Fate> {
        if echo.range_m < self.spec.range_m_min {
            return Err(Fate::TooNear);
        }
        if echo.energy < self.threshold {
            return Err(Fate::TooWeak);
        }
        Ok(())
    }

    /// The echoes that are reported, nearest first.
    pub(super) fn choose(&self, echoes: &[Echo]) -> [Option<usize>; 2] {
        let seen = |index: &usize| self.sees(&echoes[*index]).is_ok();
        let first = (0..echoes.len()).find(seen);
        let last = (0..echoes.len()).rev().find(seen);
        // Of equals the nearer one.
        let strongest_but = |but: Option<usize>| {
            let others = (0..echoes.len()).filter(|index| seen(index) && Some(*index) != but);
            others.reduce(|best, index| if echoes[index].energy > echoes[best].energy { index } else { best })
        };
        match self.spec.returns {
            EchoChoice::First => [first, None],
            EchoChoice::Last => [last, None],
            EchoChoice::Strongest => [strongest_but(None), None],
            // The strongest beside the last is the strongest of all, unless the last itself is.
            EchoChoice::Dual => match strongest_but(last) {
                Some(other) => [Some(other), last],
                None => [last, None],
            },
        }
    }

    /// The range along the beam as the sensor measures it, meters; `None` where it gets lost. `number` counts the
    /// returns of the firing.
    #[inline(always)]
    pub(super) fn measure(&self, shot: &Shot, echo: &Echo, number: usize) -> Option<f64> {
        let mut draws: Draws =
            if number == 0 { shot.draws.clone() } else { self.noise.child(SECOND).at(shot.index) };
        let noise_m = draws.normal() * self.noise_m(echo);
        let kept = !draws.chance(self.spec.dropout_ratio);
        let along_beam_m = (echo.range_m + noise_m).max(SHORTEST_M);
        let step_m = self.spec.model.range.range_step_m;
        let rounded = matches!(self.wire, Wire::Plain) && step_m > 0.0;
        kept.then(|| if rounded { (along_beam_m / step_m).round().max(1.0) * step_m } else { along_beam_m })
    }

    /// Standard deviation of an echo's range, meters: its square grows with the inverse of the energy, as photons count,
    /// up to the weak noise where the echo is just seen.
    #[inline(always)]
    pub(super) fn noise_m(&self, echo: &Echo) -> f64 {
        let weak = self.spec.weak_noise_ratio;
        if weak == 1.0 {
            return self.spec.range_noise_m;
        }
        let growth = (weak * weak - 1.0) * (self.threshold / echo.energy).min(1.0);
        self.spec.range_noise_m * (1.0 + growth).sqrt()
    }

    /// The point of an echo, in polar coordinates of the lidar's center.
    pub(super) fn point(&self, shot: &Shot, along_beam_m: f64, intensity: f32) -> Return {
        let beam = &self.beams[shot.beam];
        let azimuth_rad = self.said_azimuth_rad(shot);
        let (horizontal, up) = (along_beam_m * beam.cos, along_beam_m * beam.sin + beam.height_m);
        let exit = self.exit(shot);
        // Without a radius the beam starts on the axis, and its bearing is the point's.
        let (azimuth_rad, horizontal) = if (exit.x, exit.y) == (0.0, 0.0) {
            (azimuth_rad, horizontal)
        } else {
            let (x, y) = (exit.x + horizontal * azimuth_rad.cos(), exit.y + horizontal * azimuth_rad.sin());
            (y.atan2(x), x.hypot(y))
        };
        Return {
            azimuth_rad,
            elevation_rad: up.atan2(horizontal),
            range_m: Some(horizontal.hypot(up)),
            ring: beam.ring,
            number: 0,
            fired_after: Span::default(),
            intensity,
        }
    }

    pub(super) fn miss(&self, shot: &Shot) -> Return {
        let Beam { elevation_rad, ring, .. } = self.beams[shot.beam];
        Return {
            azimuth_rad: self.said_azimuth_rad(shot),
            elevation_rad,
            range_m: None,
            ring,
            number: 0,
            fired_after: Span::default(),
            intensity: 0.0,
        }
    }
}

/// No echo is reported at zero, which means a miss on every wire; meters.
const SHORTEST_M: f64 = 0.002;

/// The strongest of all echoes, seen or not.
fn strongest(echoes: &[Echo]) -> Option<usize> {
    (0..echoes.len())
        .reduce(|best, index| if echoes[index].energy > echoes[best].energy { index } else { best })
}

/// The sensor's calibrated byte (VLP-16 manual p. 32): 0-100 for diffuse reflectors, 101-255 for retro-reflectors.
fn byte(brightness: f64) -> f32 {
    let wanted = (100.0 * brightness).clamp(1.0, 255.0);
    // Halves away from zero, as `round` says, which is a call where old processors are served too.
    let whole = wanted as u8;
    f32::from(whole) + if wanted - f64::from(whole) >= 0.5 { 1.0 } else { 0.0 }
}
