//! The one way in which this suite makes a run: a scenario with changes, systems, a driver; then what came of it.

use arborloop_base::{
    Estimate, Health, Observation, ObservationKind, Pose, Record, Seed, Sink, SinkError, Time, Trajectory,
};
use arborloop_eval::dataset::{Recorder, RecorderSettings};
use arborloop_eval::{Alignment, PoseTime, Score, ScoreSettings, score};
use arborloop_robots::go1;
use arborloop_sim::{Driver, Outcome, Scenario, Simulator, System, run};
use arborloop_slam::{Rig, build_default};
use std::collections::BTreeMap;
use std::path::Path;

/// What came of a run.
pub(crate) struct Run {
    /// How it ended.
    pub(crate) outcome: Outcome,
    /// `start_from_base` at the end of each sweep.
    pub(crate) truth: Trajectory,
    /// Every answer of every system, in order.
    pub(crate) estimates: BTreeMap<String, Vec<Estimate>>,
}

impl Run {
    /// One system against the truth, nothing aligned: `map` and `start` are one frame, because the robot stands at
    /// first.
    pub(crate) fn score(&self, system: &str) -> Score {
        let said = &self.estimates[system];
        let (path, settings) = (trajectory(said), ScoreSettings::new(Alignment::None, PoseTime::SweepEnd));
        let score = score(&self.truth, &path, &settings).unwrap();
        score.with_covariances(&self.truth, &path, said, &settings).unwrap()
    }
}

/// One lap of the cone field with `key=value` changes, read as a user's file is.
pub(crate) fn cone_field(changes: &[&str]) -> Scenario {
    let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
    let document = Scenario::embedded("cone-field-go1-short").unwrap().overridden(&changes).unwrap();
    Scenario::read(&document).unwrap_or_else(|refusal| panic!("{refusal}"))
}

/// Runs the cone field with the scenario's own seed; nothing is written to disk.
pub(crate) fn check(changes: &[&str], systems: &[&str], driver: Driver) -> Run {
    check_into(&cone_field(changes), systems, driver, &mut Nowhere)
}

/// Runs a scenario with its own seed; `sink` gets every record too.
pub(crate) fn check_into(scenario: &Scenario, systems: &[&str], driver: Driver, sink: &mut dyn Sink) -> Run {
    let mut sim = Simulator::new(scenario, Seed(scenario.seed));
    let rig = Rig { base_from_lidar: sim.base_from_lidar() };
    let mut systems: Vec<System> = systems.iter().map(|name| system(name, &rig)).collect();
    let mut collector =
        Collector { inner: sink, present: None, truth: Vec::new(), estimates: BTreeMap::new() };
    let outcome = run(&mut sim, &mut systems, driver, &mut collector, &mut |_, _| true).unwrap();
    Run { outcome, truth: Trajectory::new(collector.truth).unwrap(), estimates: collector.estimates }
}

/// A shipped system, fed by the lidar alone.
pub(crate) fn system(name: &str, rig: &Rig) -> System {
    let slam = build_default(name, rig).unwrap();
    System { name: name.to_owned(), slam, inputs: vec![ObservationKind::Lidar] }
}

/// The lidar on the Go1's back.
pub(crate) fn rig() -> Rig {
    Rig { base_from_lidar: go1().frame("velodyne").unwrap() }
}

/// A recorder for runs of the cone field. Runs keep packets, data sets clouds as well.
pub(crate) fn recorder(dir: &Path, clouds: bool) -> Recorder {
    let settings = RecorderSettings {
        name: "run".into(),
        clouds,
        packets: !clouds,
        base_from_lidar: rig().base_from_lidar,
        ..RecorderSettings::default()
    };
    Recorder::create(dir, settings).unwrap()
}

/// Estimates as a path.
pub(crate) fn trajectory(estimates: &[Estimate]) -> Trajectory {
    Trajectory::new(estimates.iter().map(|one| (one.stamp, one.map_from_base)).collect()).unwrap()
}

/// Every bit of an estimate that a comparison of floating-point numbers could overlook.
pub(crate) fn bits(estimate: &Estimate) -> (Time, Vec<u64>, Health) {
    let position = estimate.map_from_base.translation.vector;
    let attitude = estimate.map_from_base.rotation.coords;
    let covariance = estimate.covariance.iter().flat_map(|matrix| matrix.iter());
    let numbers = position.iter().chain(attitude.iter()).chain(covariance).map(|number| number.to_bits());
    (estimate.stamp, numbers.collect(), estimate.health)
}

/// A recorder that keeps nothing.
pub(crate) struct Nowhere;

impl Sink for Nowhere {
    fn write(&mut self, _now: Time, _record: &Record<'_>) -> Result<(), SinkError> {
        Ok(())
    }
}

/// Keeps answers, and the truth of the instants that are answered.
struct Collector<'a> {
    inner: &'a mut dyn Sink,
    present: Option<(Time, Pose)>,
    truth: Vec<(Time, Pose)>,
    estimates: BTreeMap<String, Vec<Estimate>>,
}

impl Sink for Collector<'_> {
    fn write(&mut self, now: Time, record: &Record<'_>) -> Result<(), SinkError> {
        match record {
            Record::Truth(truth) => {
                self.present = Some((truth.stamp, truth.world_from_start.inverse() * truth.world_from_base));
            }
            // The truth of an instant is written before what is observed at it.
            Record::Observation(Observation::Sweep(_)) => self.truth.extend(self.present),
            Record::Estimate { system, estimate } => {
                self.estimates.entry((*system).to_owned()).or_default().push(**estimate);
            }
            _ => {}
        }
        self.inner.write(now, record)
    }
}
