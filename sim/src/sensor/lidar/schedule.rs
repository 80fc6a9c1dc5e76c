//! When and where to a lidar fires: cycles counted from the beginning of the run, and the turn each belongs to.

use super::model::LidarModel;
use arborloop_base::{Span, Time};
use std::f64::consts::{PI, TAU};

/// The firing times of a lidar.
#[derive(Debug, Clone, Copy)]
pub(super) struct Schedule {
    turn: Span,
    pace: Pace,
}

#[derive(Debug, Clone, Copy)]
enum Pace {
    /// Cycles follow each other whatever the turn does; the last beam fires some time into its cycle.
    Free { cycle: Span, last: Span },
    /// A turn has a whole number of columns.
    Columns(i64),
}

/// The longest time between the first and the last cycle that are traced together: a packet of rays shares an origin.
const TOGETHER: Span = Span::from_millis(1);

impl Schedule {
    pub(super) fn new(model: &LidarModel, columns: Option<u32>, turn: Span) -> Self {
        let pace = match (model.turn.cycle_ns, columns) {
            (Some(cycle_ns), _) => Pace::Free {
                cycle: Span::from_nanos(cycle_ns),
                last: Span::from_nanos(model.beams.fires_after_ns.iter().copied().max().unwrap_or(0)),
            },
            (None, columns) => Pace::Columns(i64::from(columns.unwrap_or(1))),
        };
        Schedule { turn, pace }
    }

    /// The cycles of the turn that is complete at `end`. A cycle belongs to the turn in which its last beam fires, so
    /// that no cycle is split and no firing lost or doubled.
    pub(super) fn cycles(&self, end: Time) -> std::ops::Range<i64> {
        let since_spin = |time: Time| (time - Time::SIMULATION_START).nanos();
        match self.pace {
            Pace::Free { cycle, last } => {
                // The first cycle whose last beam fires at or after an instant.
                let first_after = |time: Time| {
                    let nanos = (since_spin(time) - last.nanos()).max(0);
                    nanos.div_euclid(cycle.nanos()) + i64::from(nanos % cycle.nanos() != 0)
                };
                first_after(end - self.turn)..first_after(end)
            }
            Pace::Columns(columns) => {
                let turns = since_spin(end) / self.turn.nanos();
                (turns - 1) * columns..turns * columns
            }
        }
    }

    /// When a cycle begins.
    pub(super) fn start(&self, cycle: i64) -> Time {
        match self.pace {
            Pace::Free { cycle: step, .. } => Time::SIMULATION_START + step * cycle,
            Pace::Columns(columns) => {
                let within = i128::from(self.turn.nanos()) * i128::from(cycle.rem_euclid(columns));
                Time::SIMULATION_START
                    + self.turn * cycle.div_euclid(columns)
                    + Span::from_nanos((within / i128::from(columns)) as i64)
            }
        }
    }

    /// The head's bearing at a firing of a cycle, radians, not wrapped: clockwise from straight behind.
    pub(super) fn bearing_rad(&self, cycle: i64, stamp: Time) -> f64 {
        match self.pace {
            Pace::Free { .. } => {
                let turned = (stamp - Time::SIMULATION_START).nanos() % self.turn.nanos();
                PI - TAU * turned as f64 / self.turn.nanos() as f64
            }
            Pace::Columns(columns) => PI - TAU * cycle.rem_euclid(columns) as f64 / columns as f64,
        }
    }

    /// How far the head turns between the begin of a cycle and a firing so long after it, radians, clockwise.
    pub(super) fn lag_rad(&self, after: Span) -> f64 {
        match self.pace {
            Pace::Free { .. } => TAU * after.nanos() as f64 / self.turn.nanos() as f64,
            Pace::Columns(_) => 0.0,
        }
    }

    /// How many cycles are traced together: at most sixteen, and no longer than a millisecond.
    pub(super) fn together(&self) -> usize {
        let step = match self.pace {
            Pace::Free { cycle, .. } => cycle.nanos(),
            Pace::Columns(columns) => self.turn.nanos() / columns,
        };
        [16, 8, 4, 2].into_iter().find(|count| (count - 1) * step <= TOGETHER.nanos()).unwrap_or(1) as usize
    }
}
