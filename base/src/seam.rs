//! The two places where a stranger plugs in: a system under test and a recorder.

use crate::estimate::Estimate;
use crate::grid::{Cell, Grid};
use crate::observation::{Observation, Sweep};
use crate::pose::{Trajectory, Twist};
use crate::time::Time;
use crate::truth::{Label, Truth};
use std::sync::Arc;

/// A SLAM system under test.
pub trait Slam: Send {
    /// Takes one observation; answers every sweep with the pose of the base at the sweep's end.
    ///
    /// Never fails: a system that cannot tell where it is says so in [`Estimate::health`].
    fn observe(&mut self, observation: &Observation) -> Option<Estimate>;

    /// Does what the next answer needs and the last one did not, such as drawing the sweep into the map.
    ///
    /// Whoever asks calls this once he has taken an answer, so that a robot does not wait for it. A system that is not
    /// told to does it before its next answer: the answers are the same.
    fn settle(&mut self) {}

    /// The map as believed when the system last settled, in the system's map frame; `None` for a system that draws none.
    fn map(&self) -> Option<Grid<Cell>> {
        None
    }

    /// The whole path as finally believed, for a system that revises its past.
    fn trajectory(&self) -> Option<Trajectory> {
        None
    }
}

/// One thing worth writing down.
#[derive(Debug, Clone, Copy)]
pub enum Record<'a> {
    /// What a sensor said.
    Observation(&'a Observation),
    /// What each return of a sweep really met; follows the sweep's own record.
    Labels {
        /// The sweep.
        sweep: &'a Sweep,
        /// One label per return, in the same order.
        labels: &'a [Label],
    },
    /// What a system answered.
    Estimate {
        /// The system's name.
        system: &'a str,
        /// Its answer.
        estimate: &'a Estimate,
    },
    /// What really happened.
    Truth(&'a Truth),
    /// Where the joints are: names and angles in radians.
    Joints {
        /// Joint names as in the URDF.
        names: &'a [String],
        /// Angles, radians, in the same order.
        angles_rad: &'a [f64],
    },
    /// What the robot was told to do, base frame.
    Command(&'a Twist),
    /// A system's map as now believed.
    Map {
        /// The system's name.
        system: &'a str,
        /// The map.
        map: &'a Grid<Cell>,
    },
}

/// Why a recorder could not write; names the file.
pub type SinkError = Box<dyn std::error::Error + Send + Sync>;

/// A recorder.
pub trait Sink {
    /// Writes one record that became known at `now`.
    fn write(&mut self, now: Time, record: &Record<'_>) -> Result<(), SinkError>;

    /// Writes an observation that it may keep without a copy.
    fn write_observation(&mut self, now: Time, observation: &Arc<Observation>) -> Result<(), SinkError> {
        self.write(now, &Record::Observation(observation))
    }
}
