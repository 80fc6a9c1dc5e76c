//! What a run or a replay leaves in memory for scoring: the true path, every answer, and a few quantities over time.

use arborloop_base::{Estimate, Observation, Pose, Record, Sink, SinkError, Time, Trajectory, Twist};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A sink that remembers, and hands every record on to a recorder where there is one.
#[derive(Default)]
pub(crate) struct Trace<'a> {
    /// The base in the frame of the start, every tick.
    pub(crate) path: Vec<(Time, Pose)>,
    /// Every answer of each system.
    pub(crate) estimates: BTreeMap<String, Vec<Estimate>>,
    /// Tilt in degrees and speed in m/s, at every sweep.
    pub(crate) tilt_deg: Vec<(f64, f64)>,
    pub(crate) speed_mps: Vec<(f64, f64)>,
    pub(crate) sweeps: u64,
    pub(crate) next: Option<&'a mut dyn Sink>,
    twist: Twist,
}

impl<'a> Trace<'a> {
    pub(crate) fn new(next: Option<&'a mut dyn Sink>) -> Self {
        Trace { next, ..Trace::default() }
    }

    /// What was seen, with nobody to hand it on to.
    pub(crate) fn ended(self) -> Trace<'static> {
        Trace {
            path: self.path,
            estimates: self.estimates,
            tilt_deg: self.tilt_deg,
            speed_mps: self.speed_mps,
            sweeps: self.sweeps,
            next: None,
            twist: self.twist,
        }
    }

    /// What a system said, as a trajectory; answers that repeat a stamp or hold no number are left out.
    pub(crate) fn trajectory(&self, system: &str) -> Trajectory {
        let mut trajectory = Trajectory::default();
        for estimate in self.estimates.get(system).into_iter().flatten() {
            // A pose that is refused stays missing: the score then counts what remains.
            let _ = trajectory.push(estimate.stamp, estimate.map_from_base);
        }
        trajectory
    }
}

impl Sink for Trace<'_> {
    fn write(&mut self, now: Time, record: &Record<'_>) -> Result<(), SinkError> {
        match record {
            Record::Truth(truth) => {
                self.path.push((truth.stamp, truth.world_from_start.inverse() * truth.world_from_base));
                self.twist = truth.twist;
            }
            Record::Estimate { system, estimate } => {
                self.estimates.entry((*system).to_owned()).or_default().push(**estimate);
            }
            Record::Labels { sweep, .. } => {
                self.sweeps += 1;
                if let (Some((first, _)), Some((_, pose))) = (self.path.first(), self.path.last()) {
                    let seconds = (sweep.end - *first).seconds();
                    let up = pose.rotation * nalgebra::Vector3::z();
                    self.tilt_deg.push((seconds, up.z.clamp(-1.0, 1.0).acos().to_degrees()));
                    self.speed_mps.push((seconds, self.twist.linear_mps.xy().norm()));
                }
            }
            _ => {}
        }
        match &mut self.next {
            Some(next) => next.write(now, record),
            None => Ok(()),
        }
    }

    fn write_observation(&mut self, now: Time, observation: &Arc<Observation>) -> Result<(), SinkError> {
        match &mut self.next {
            Some(next) => next.write_observation(now, observation),
            None => Ok(()),
        }
    }
}
