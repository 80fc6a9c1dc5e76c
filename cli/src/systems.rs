//! Systems by name: those that come with the program and those that a stranger's binary adds.

use crate::failure::Failure;
use arborloop_base::{Estimate, Grid, Observation, ObservationKind, Pose, Slam, Trajectory};
use arborloop_sim::document::suggest;
use arborloop_sim::{Document, System};
use arborloop_slam::{BuildError, Rig};
use cpu_time::ThreadTime;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Builds a fresh system for a robot with this lidar mount.
pub type Builder = Box<dyn Fn(&Pose) -> Box<dyn Slam> + Send + Sync>;

/// What can be asked for by name.
#[derive(Default)]
pub struct Catalog {
    added: BTreeMap<String, Builder>,
}

/// Settings and inputs of one system, as a suite writes them.
#[derive(Debug, Clone, PartialEq, Default, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SystemSpec {
    /// What the system is fed; lidar alone when empty.
    pub inputs: Vec<ObservationKind>,
    /// The system's own keys.
    pub settings: toml::Table,
}

/// Computing time of each sweep, milliseconds of one thread.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stopwatch(Arc<Mutex<Vec<f64>>>);

/// Measures a system without changing it.
struct Timed {
    slam: Box<dyn Slam>,
    stopwatch: Stopwatch,
}

impl Catalog {
    /// Adds a stranger's system; it hides one of ours that has the same name.
    pub fn add(&mut self, name: impl Into<String>, builder: Builder) {
        self.added.insert(name.into(), builder);
    }

    /// Every name, the stranger's first.
    pub fn names(&self) -> Vec<&str> {
        self.added.keys().map(String::as_str).chain(arborloop_slam::NAMES.iter().copied()).collect()
    }

    /// Refuses a name that nothing has.
    pub(crate) fn check(&self, name: &str) -> Result<(), Failure> {
        let names = self.names();
        if names.contains(&name) {
            return Ok(());
        }
        Err(Failure::Usage(format!("no system is called `{name}`; {}", suggest(name, &names))))
    }

    /// A fresh system under a stopwatch.
    pub(crate) fn build(
        &self,
        name: &str,
        spec: &SystemSpec,
        base_from_lidar: &Pose,
    ) -> Result<(System, Stopwatch), Failure> {
        self.check(name)?;
        let slam = match self.added.get(name) {
            Some(builder) => builder(base_from_lidar),
            None => shipped(name, spec, base_from_lidar)?,
        };
        let stopwatch = Stopwatch::default();
        let inputs = if spec.inputs.is_empty() { vec![ObservationKind::Lidar] } else { spec.inputs.clone() };
        let slam = Box::new(Timed { slam, stopwatch: stopwatch.clone() });
        Ok((System { name: name.to_owned(), slam, inputs }, stopwatch))
    }
}

fn shipped(name: &str, spec: &SystemSpec, base_from_lidar: &Pose) -> Result<Box<dyn Slam>, Failure> {
    let rig = Rig { base_from_lidar: *base_from_lidar };
    arborloop_slam::build(name, spec.settings.clone(), &rig).map_err(|error| match error {
        BuildError::Unknown { .. } => Failure::Usage(error.to_string()),
        BuildError::Settings(reason) => {
            let text = toml::to_string(&spec.settings).unwrap_or_default();
            Failure::Document(Document::new(format!("settings of {name}"), text).refuse(
                "",
                reason.to_string(),
                None,
            ))
        }
    })
}

impl Stopwatch {
    pub(crate) fn milliseconds(&self) -> Vec<f64> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Slam for Timed {
    fn observe(&mut self, observation: &Observation) -> Option<Estimate> {
        let begin = ThreadTime::now();
        let estimate = self.slam.observe(observation);
        if matches!(observation, Observation::Sweep(_)) {
            let spent = begin.elapsed().as_secs_f64() * 1e3;
            self.stopwatch.0.lock().unwrap_or_else(PoisonError::into_inner).push(spent);
        }
        estimate
    }

    fn settle(&mut self) {
        let begin = ThreadTime::now();
        self.slam.settle();
        let spent = begin.elapsed().as_secs_f64() * 1e3;
        let mut sweeps = self.stopwatch.0.lock().unwrap_or_else(PoisonError::into_inner);
        // A sweep's time is all that it costs.
        if let Some(last) = sweeps.last_mut() {
            *last += spent;
        }
    }

    fn map(&self) -> Option<Grid<arborloop_base::Cell>> {
        self.slam.map()
    }

    fn trajectory(&self) -> Option<Trajectory> {
        self.slam.trajectory()
    }
}
