//! From the answers of a turn to the sweep that the wire delivers, with the truth of each return.

use super::answer::{Answer, Given};
use super::cast::Shot;
use super::{Beam, Lidar};
use arborloop_base::vlp16::{CYCLE_STEP, LASER_STEP, LASERS, ReturnMode, Turn, ring_of};
use arborloop_base::{Label, Return, Sweep, Time, Wire, wrap_angle};
use rayon::prelude::*;
use std::ops::Range;

/// Returns that one thread makes at a time, at least.
const TOGETHER: usize = 512;

impl Lidar {
    /// The turn of these cycles that is complete at `end`, from the answers of its firings.
    pub(super) fn deliver(&self, cycles: Range<i64>, end: Time, turn: &[Answer]) -> (Sweep, Vec<Label>) {
        let start = self.schedule.start(cycles.start);
        let (offset, gaps) = (self.clock_offset(end), self.leaves_gaps());
        let (mut returns, mut labels) = (Vec::new(), Vec::new());
        let rings = self.beams.len() as u16;
        if self.is_direct && self.faults.is_empty() && !turn.is_empty() {
            let bearings = cycles.clone().step_by(2).map(|cycle| self.said_azimuth_rad(&self.shot(cycle, 0)));
            let wire = Turn::new(bearings);
            let one = |number: usize| {
                let given = turn[number].given[0].unwrap_or(Given::MISS);
                let (cycle, laser) = (number / LASERS, number % LASERS);
                (wire.carry(cycle, laser, given.along_m, given.intensity), given.label)
            };
            let all = (0..turn.len()).into_par_iter().with_min_len(TOGETHER);
            all.map(one).unzip_into_vecs(&mut returns, &mut labels);
            return (Sweep { start: start + offset, end: end + offset, rings, returns }, labels);
        }
        let beams = self.beams.len();
        let said = turn.par_chunks(beams).with_min_len(TOGETHER / beams.min(TOGETHER)).enumerate();
        let said = said.flat_map_iter(|(number, answers)| {
            let cycle = cycles.start + number as i64;
            let kept = answers.iter().enumerate().filter(|(_, answer)| !(answer.dropped && gaps));
            kept.flat_map(move |(beam, answer)| {
                let shot = self.shot(cycle, beam);
                let fired_after = self.said_after(shot.stamp, shot.stamp - start);
                let returns = self.returns(&shot, answer);
                returns.map(move |(one, label)| (Return { fired_after, ..one }, label))
            })
        });
        (returns, labels) = said.unzip();
        let sweep = Sweep { start: start + offset, end: end + offset, rings, returns };
        let carried = self.wire.carry(&sweep).expect("these firings follow the lidar's own table");
        debug_assert_eq!(carried.returns.len(), labels.len());
        (carried, labels)
    }

    /// Whether returns can be rounded as the wire rounds them without packets in between: a VLP-16's own table, one
    /// return a firing.
    pub(super) fn is_direct(wire: &Wire, beams: &[Beam], cycle: Option<i64>) -> bool {
        let own = |(laser, beam): (usize, &Beam)| {
            beam.ring == ring_of(laser) && beam.fires_after == LASER_STEP * laser as i64
        };
        matches!(wire, Wire::Vlp16(ReturnMode::Strongest | ReturnMode::Last))
            && beams.len() == LASERS
            && cycle == Some(CYCLE_STEP.nanos())
            && beams.iter().enumerate().all(own)
    }

    /// Returns of a firing with what they met; `fired_after` is for the sweep to say.
    pub(super) fn returns<'a>(
        &'a self,
        shot: &Shot,
        answer: &'a Answer,
    ) -> impl Iterator<Item = (Return, Label)> + use<'a> {
        let shot = shot.clone();
        answer.given.iter().enumerate().filter_map(move |(number, given)| {
            let given = given.as_ref()?;
            let one = match given.along_m {
                Some(along_m) => self.point(&shot, along_m, given.intensity),
                None => self.miss(&shot),
            };
            Some((Return { number: number as u8, ..one }, given.label))
        })
    }

    /// The beam's bearing as the encoder says it.
    pub(super) fn said_azimuth_rad(&self, shot: &Shot) -> f64 {
        let azimuth_rad = self.azimuth_rad(shot);
        let step_rad = self.spec.model.turn.azimuth_step_deg.to_radians();
        if matches!(self.wire, Wire::Plain) && step_rad > 0.0 {
            return wrap_angle((azimuth_rad / step_rad).round() * step_rad);
        }
        wrap_angle(azimuth_rad)
    }
}
