//! From the answers of a turn to the sweep that the wire delivers, with the truth of each return.

use super::answer::{Answer, Given};
use super::cast::Shot;
use super::{Beam, Lidar, Surroundings};
use arborloop_base::vlp16::{CYCLE_STEP, LASER_STEP, LASERS, ReturnMode, Turn, ring_of};
use arborloop_base::{Label, Return, Span, Sweep, Time, Wire, wrap_angle};
use rayon::prelude::*;
use std::ops::Range;

/// What a firing that has not answered yet says.
const NOTHING: Return = Return {
    azimuth_rad: 0.0,
    elevation_rad: 0.0,
    range_m: None,
    ring: 0,
    number: 0,
    fired_after: Span::from_nanos(0),
    intensity: 0.0,
};

/// So many behind the first ones, and the rest.
fn split<T>(all: &mut [T], before: usize, count: usize) -> (&mut [T], &mut [T]) {
    all.split_at_mut(before).1.split_at_mut(count)
}

/// Returns that one thread makes at a time, at least.
const TOGETHER: usize = 512;

/// A turn whose returns are made as the wire carries them as soon as they are measured.
#[derive(Default)]
pub(super) struct Direct {
    pub(super) returns: Vec<Return>,
    pub(super) labels: Vec<Label>,
    /// Memory of earlier turns.
    pub(super) spare: Vec<Vec<Return>>,
    pub(super) spare_labels: Vec<Label>,
    wire: Option<Turn>,
}

/// A block of cycles, and where what its firings say goes.
struct Block<'a> {
    cycles: Range<i64>,
    /// Its first cycle in the turn, and how many of the block come before.
    begin: usize,
    skipped: usize,
    returns: &'a mut [Return],
    labels: &'a mut [Label],
}

impl Block<'_> {
    /// The return of a firing as the wire carries it, unless it is another turn's.
    #[inline(always)]
    fn say(&mut self, wire: &Turn, number: usize, laser: usize, given: &Given) {
        let Some(number) = number.checked_sub(self.skipped) else { return };
        let place = number * LASERS + laser;
        if place < self.returns.len() && place < self.labels.len() {
            self.returns[place] = wire.carry(self.begin + number, laser, given.along_m, given.intensity);
            self.labels[place] = given.label;
        }
    }
}

impl Lidar {
    /// Whether a turn's returns can be made before the turn is complete: nothing spoils them later.
    pub(super) fn makes_directly(&self) -> bool {
        self.is_direct && self.faults.is_empty()
    }

    /// Makes the returns of these blocks of a turn, which follow each other; cycles of other turns are left out.
    pub(super) fn fire_directly(
        &mut self,
        turn: &Range<i64>,
        is_new: bool,
        blocks: impl Iterator<Item = Range<i64>>,
        around: Surroundings<'_>,
    ) {
        let mut direct = std::mem::take(&mut self.direct);
        if is_new {
            let bearing = |cycle: i64| self.said_azimuth_rad(&self.shot(cycle, 0));
            direct.wire = Some(Turn::new(turn.clone().step_by(2).map(bearing)));
            if direct.returns.is_empty() {
                direct.returns = direct.spare.pop().unwrap_or_default();
                direct.labels = std::mem::take(&mut direct.spare_labels);
            }
            // Every firing answers, so that what is left of the sweep before is overwritten.
            let firings = (turn.end - turn.start).max(0) as usize * LASERS;
            direct.returns.resize(firings, NOTHING);
            direct.labels.resize(firings, Label::MISS);
        }
        let Direct { returns, labels, wire: Some(wire), .. } = &mut direct else { return };
        let (mut returns, mut labels) = (returns.as_mut_slice(), labels.as_mut_slice());
        let mut at = turn.start;
        let mut all = Vec::new();
        for cycles in blocks {
            let own = cycles.start.max(turn.start)..cycles.end.min(turn.end);
            let count = (own.end - own.start).max(0) as usize * LASERS;
            let before = (own.start - at).max(0) as usize * LASERS;
            let (mine, named);
            (mine, returns) = split(returns, before, count);
            (named, labels) = split(labels, before, count);
            all.push(Block {
                begin: (own.start - turn.start) as usize,
                skipped: (own.start - cycles.start) as usize,
                cycles,
                returns: mine,
                labels: named,
            });
            at = own.end;
        }
        // One by one: a thread that has nothing else to do takes over the next block, not the rest of a half.
        all.into_par_iter().with_max_len(1).for_each(|mut block| {
            let cycles = block.cycles.clone();
            if self.is_lone() {
                self.fire_lone(cycles, around, |number, laser, given| block.say(wire, number, laser, given));
            } else {
                self.fire_several(cycles, around, |number, laser, answer| {
                    block.say(wire, number, laser, &answer.given[0].unwrap_or(Given::MISS));
                });
            }
        });
        self.direct = direct;
    }

    /// The turn of these cycles that is complete at `end`, from the answers of its firings.
    pub(super) fn deliver(&self, cycles: Range<i64>, end: Time, turn: &[Answer]) -> (Sweep, Vec<Label>) {
        let start = self.schedule.start(cycles.start);
        let (offset, gaps) = (self.clock_offset(end), self.leaves_gaps());
        let rings = self.beams.len() as u16;
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
        let (returns, labels): (Vec<_>, Vec<_>) = said.unzip();
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
