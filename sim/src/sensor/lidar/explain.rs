//! The story of one firing: which surfaces its rays met, what came back of each, and what the sensor made of it.

use super::answer::Fate;
use super::{Lidar, Surroundings, echo};
use arborloop_base::{Class, Return, Time};
use nalgebra::Point3;
use std::fmt;

/// A surface that a ray of the footprint met.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceStory {
    /// Which ray of the footprint, 0 the middle one.
    pub sub_ray: u16,
    /// How many surfaces let the ray through before.
    pub layer: u16,
    /// Along the ray, meters.
    pub range_m: f64,
    /// What it is.
    pub class: Class,
    /// Which one.
    pub instance: u32,
    /// Angle between ray and normal, degrees.
    pub incidence_deg: f64,
    /// Share of what comes back of all surfaces.
    pub energy_ratio: f64,
    /// How far the wind has moved it, meters.
    pub displaced_m: f64,
}

/// An echo and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct EchoStory {
    /// Along the beam, meters.
    pub range_m: f64,
    /// What most of it is of.
    pub class: Class,
    /// Whether several surfaces share it.
    pub mixed: bool,
    /// What came of it, in words.
    pub fate: String,
}

/// The story of one firing.
#[derive(Debug, Clone, PartialEq)]
pub struct FiringStory {
    /// When it fired.
    pub stamp: Time,
    /// Which beam, in firing order.
    pub beam: usize,
    /// Its ring, counted from the lowest.
    pub ring: u16,
    /// Where it looked, degrees counter-clockwise from the lidar's x axis.
    pub azimuth_deg: f64,
    /// Elevation, degrees.
    pub elevation_deg: f64,
    /// Where it left the lidar, world frame, meters.
    pub origin: Point3<f64>,
    /// What its rays met, nearest first.
    pub surfaces: Vec<SurfaceStory>,
    /// The echoes, nearest first.
    pub echoes: Vec<EchoStory>,
    /// Names of the faults that were on.
    pub faults: Vec<&'static str>,
    /// What the sensor sent, before the wire rounded it; empty where the packet got lost.
    pub returns: Vec<Return>,
}

impl Lidar {
    /// Firings of the turn that is complete at `end`.
    pub(crate) fn firings(&self, end: Time) -> usize {
        let cycles = self.schedule.cycles(end);
        (cycles.end - cycles.start).max(0) as usize * self.beams.len()
    }

    /// The story of a firing of that turn, counted from its first; `None` beyond its last.
    pub(crate) fn explain(&self, end: Time, firing: usize, around: Surroundings<'_>) -> Option<FiringStory> {
        let cycles = self.schedule.cycles(end);
        if firing >= self.firings(end) {
            return None;
        }
        let (cycle, beam) = (cycles.start + (firing / self.beams.len()) as i64, firing % self.beams.len());
        // The whole block: a firing is traced with the neighbors that it had in the run.
        let block = self.schedule.together() as i64;
        let first = cycle.div_euclid(block) * block;
        let mut scratch = self.borrow_scratch();
        let mut answers = vec![super::Answer::NONE; block as usize * self.beams.len()];
        self.fire_block(first..first + block, around, |number, beam, answer| {
            answers[number * self.beams.len() + beam] = answer;
        });
        // The cycles of the turn alone: faults count from its first.
        let mine = (cycle - first) as usize * self.beams.len() + beam;
        let mut turn = vec![super::Answer::NONE; self.firings(end)];
        let beams = self.beams.len();
        turn[firing - beam..][..beams].copy_from_slice(&answers[mine - beam..][..beams]);
        self.spoil(&cycles, &mut turn);
        self.turn_head(&(first..first + block), &mut scratch);
        self.cast(&(first..first + block), beam, around, &mut around.optics.caster(), &mut scratch);
        let number = (cycle - first) as usize;
        let shot = scratch.shots[number].clone();
        let mut echoes = Vec::new();
        let length_m = self.spec.model.pulse.length_m;
        echo::form(&mut scratch.surfaces[number], length_m, self.width_rad, &mut echoes);
        let total: f64 = scratch.surfaces[number].iter().map(echo::energy).sum();
        let surfaces = scratch.surfaces[number].iter().map(|surface| SurfaceStory {
            sub_ray: surface.sub_ray,
            layer: surface.layer,
            range_m: surface.hit.range_m,
            class: surface.hit.class,
            instance: surface.hit.instance,
            incidence_deg: surface.hit.cos_incidence.acos().to_degrees(),
            energy_ratio: if total > 0.0 { echo::energy(surface) / total } else { 0.0 },
            displaced_m: surface.hit.displacement_m.norm(),
        });
        let chosen = self.choose(&echoes);
        let told = echoes.iter().enumerate().map(|(index, echo)| {
            let place = chosen.iter().flatten().position(|one| *one == index);
            EchoStory {
                range_m: echo.range_m,
                class: echo.label.class,
                mixed: echo.label.mixed,
                fate: match (self.sees(echo), place) {
                    (Err(fate), _) => self.refusal(fate, echo),
                    (Ok(()), None) => format!("not reported: the sensor reports its {} echo", self.choice()),
                    (Ok(()), Some(place)) => match self.measure(&shot, echo, place) {
                        Some(along_m) => format!("returned, measured at {along_m:.3} m along the beam"),
                        None => "lost by chance (dropout)".to_owned(),
                    },
                },
            }
        });
        let answer = &turn[firing];
        let kept = self.returns(&shot, answer).filter(|_| !answer.dropped || !self.leaves_gaps());
        let (moment, share) = around.motion.moment(shot.stamp);
        let world_from_lidar = moment.pose(share) * self.base_from_lidar;
        Some(FiringStory {
            stamp: shot.stamp,
            beam,
            ring: self.beams[beam].ring,
            azimuth_deg: arborloop_base::wrap_angle(self.azimuth_rad(&shot)).to_degrees(),
            elevation_deg: self.beams[beam].elevation_rad.to_degrees(),
            origin: world_from_lidar * self.exit(&shot),
            surfaces: surfaces.collect(),
            echoes: told.collect(),
            faults: self
                .faults
                .iter()
                .filter(|fault| fault.time().contains(&shot.stamp))
                .map(super::FaultSpec::kind)
                .collect(),
            returns: kept.map(|(one, _)| one).collect(),
        })
    }

    fn refusal(&self, fate: Fate, echo: &echo::Echo) -> String {
        match fate {
            Fate::TooNear => {
                format!("cut off: nearer than the sensor's {} m", self.spec.range_m_min)
            }
            Fate::TooWeak => {
                format!("too weak: {:.2e}, the sensor sees {:.2e}", echo.energy, self.threshold)
            }
        }
    }

    fn choice(&self) -> &'static str {
        super::spec::word(self.spec.returns)
    }
}

impl fmt::Display for FiringStory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "fired at {} by beam {} (ring {})", self.stamp, self.beam, self.ring)?;
        let Point3 { coords: at } = self.origin;
        writeln!(
            f,
            "toward azimuth {:.3} deg, elevation {:.3} deg, from ({:.3}, {:.3}, {:.3}) in the world",
            self.azimuth_deg, self.elevation_deg, at.x, at.y, at.z
        )?;
        if !self.faults.is_empty() {
            writeln!(f, "faults on: {}", self.faults.join(", "))?;
        }
        writeln!(f, "surfaces")?;
        if self.surfaces.is_empty() {
            writeln!(f, "  none within range")?;
        }
        for one in &self.surfaces {
            let what = format!("{:?} {}", one.class, one.instance).to_lowercase();
            write!(
                f,
                "  ray {:2} layer {}  {:9.3} m  {what:12}  incidence {:4.1} deg  energy {:5.1} %",
                one.sub_ray,
                one.layer,
                one.range_m,
                one.incidence_deg,
                100.0 * one.energy_ratio
            )?;
            if one.displaced_m > 0.0 {
                write!(f, "  moved {:.4} m by the wind", one.displaced_m)?;
            }
            writeln!(f)?;
        }
        writeln!(f, "echoes")?;
        if self.echoes.is_empty() {
            writeln!(f, "  none: a true miss")?;
        }
        for one in &self.echoes {
            let mixed = if one.mixed { ", mixed" } else { "" };
            let what = format!("{:?}", one.class).to_lowercase();
            writeln!(f, "  {:9.3} m  {what}{mixed}: {}", one.range_m, one.fate)?;
        }
        writeln!(f, "returns")?;
        if self.returns.is_empty() {
            writeln!(f, "  none: the packet got lost")?;
        }
        for one in &self.returns {
            match one.range_m {
                Some(range_m) => {
                    writeln!(f, "  {}: {range_m:.3} m, intensity {}", one.number, one.intensity)?
                }
                None => writeln!(f, "  {}: a miss", one.number)?,
            }
        }
        Ok(())
    }
}
