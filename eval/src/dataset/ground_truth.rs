//! The exact truth beside a recording: `gt/*.tum`, written when the run is over.
//!
//! Poses of the base and of the lidar in the frame of the start, at sweep ends, sweep starts and 200 Hz.

use super::error::DatasetError;
use super::tum;
use arborloop_base::{Pose, Span, Sweep, Time, Trajectory, Truth};
use std::path::Path;

/// Period of the dense truth: 200 Hz.
const DENSE_PERIOD: Span = Span::from_millis(5);
/// Truth farther away than this is not carried to a sweep's instant.
const CARRY_MAX: Span = Span::from_millis(10);

/// The folder below a recording.
pub(super) const FOLDER: &str = "gt";
/// The base at sweep ends: what estimates are scored against.
pub(super) const BASE_FILE: &str = "gt_base_link.tum";

/// Truth as it arrives, kept for the end.
#[derive(Default)]
pub(super) struct TruthLog {
    start_from_base: Trajectory,
    first: Option<Truth>,
    last: Option<Truth>,
    dense: Vec<Time>,
    sweeps: Vec<(Time, Time)>,
}

impl TruthLog {
    /// Remembers when a sweep was taken.
    pub(super) fn sweep(&mut self, sweep: &Sweep) {
        self.sweeps.push((sweep.start, sweep.end));
    }

    /// Takes the truth of an instant; says whether the recording shows it: at 200 Hz and at every sweep's end.
    /// A repeated instant, or one with numbers that are not finite, is left out.
    pub(super) fn truth(&mut self, truth: &Truth) -> bool {
        let before = self.last.as_ref().map(|last| last.stamp);
        if self.start_from_base.push(truth.stamp, start_from_base(truth)).is_err() {
            return false;
        }
        self.first.get_or_insert_with(|| truth.clone());
        self.last = Some(truth.clone());
        // The first record at or behind every multiple of the period.
        let slot = |stamp: Time| stamp.nanos().div_euclid(DENSE_PERIOD.nanos());
        let dense = match before {
            Some(before) => slot(before) != slot(truth.stamp),
            None => truth.stamp.nanos() % DENSE_PERIOD.nanos() == 0,
        };
        if dense {
            self.dense.push(truth.stamp);
        }
        dense || self.sweeps.last().is_some_and(|(_, end)| *end == truth.stamp)
    }

    /// The dense truth's share of the contact story: what the body touched at the last instant.
    pub(super) fn contacts_differ(&self, truth: &Truth) -> bool {
        match &self.last {
            Some(last) => last.contacts != truth.contacts,
            None => !truth.contacts.is_empty(),
        }
    }

    /// Writes the folder; nothing when no truth arrived.
    pub(super) fn write(&self, dir: &Path, base_from_lidar: &Pose) -> Result<(), DatasetError> {
        if self.start_from_base.is_empty() {
            return Ok(());
        }
        let folder = dir.join(FOLDER);
        std::fs::create_dir_all(&folder).map_err(DatasetError::io(&folder, "create"))?;
        let dense = self.dense.iter().filter_map(|stamp| Some((*stamp, self.at(*stamp)?)));
        let at = |instant: fn(&(Time, Time)) -> Time| {
            self.sweeps.iter().filter_map(move |sweep| Some((instant(sweep), self.at(instant(sweep))?)))
        };
        let lidar = |(stamp, start_from_base): (Time, Pose)| (stamp, start_from_base * base_from_lidar);
        write(&folder.join(BASE_FILE), "base_link at sweep end", at(|sweep| sweep.1))?;
        write(&folder.join("gt_lidar.tum"), "lidar at sweep end", at(|sweep| sweep.1).map(lidar))?;
        write(
            &folder.join("gt_lidar_scan_start.tum"),
            "lidar at sweep start",
            at(|sweep| sweep.0).map(lidar),
        )?;
        write(&folder.join("gt_lidar_scan_end.tum"), "lidar at sweep end", at(|sweep| sweep.1).map(lidar))?;
        write(&folder.join("gt_200hz.tum"), "base_link at 200 Hz", dense)
    }

    /// The pose at an instant: between ticks interpolated, just outside the run (the first sweep starts before the
    /// first tick ends) carried on with the twist that holds there.
    fn at(&self, stamp: Time) -> Option<Pose> {
        self.start_from_base.at(stamp).or_else(|| {
            let nearest = [self.first.as_ref()?, self.last.as_ref()?]
                .into_iter()
                .min_by_key(|truth| (truth.stamp - stamp).abs())?;
            let after = stamp - nearest.stamp;
            (after.abs() <= CARRY_MAX)
                .then(|| start_from_base(nearest) * super::recorder::moved(&nearest.twist, after))
        })
    }
}

fn start_from_base(truth: &Truth) -> Pose {
    truth.world_from_start.inverse() * truth.world_from_base
}

/// Sweeps that repeat an instant are written once.
fn write(path: &Path, what: &str, poses: impl Iterator<Item = (Time, Pose)>) -> Result<(), DatasetError> {
    let mut trajectory = Trajectory::default();
    for (stamp, pose) in poses {
        if trajectory.poses().last().is_none_or(|(last, _)| *last < stamp) {
            trajectory
                .push(stamp, pose)
                .map_err(|error| DatasetError::whole(path, error.to_string(), "finite truth"))?;
        }
    }
    tum::write_with_header(path, &format!("{what}, frame start; stamp x y z qx qy qz qw"), &trajectory)
}
