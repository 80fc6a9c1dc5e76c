//! A run inside a plain test: `arborloop::scenario("cone-field-go1").seed(7).slam("mine", MySlam::new()).run()`.

use crate::expect::{Expect, Finding};
use crate::failure::Failure;
use crate::load;
use crate::session::{Case, simulate};
use crate::systems::{Catalog, SystemSpec};
use arborloop_base::Slam;
use arborloop_eval::{MapScore, Score};
use arborloop_sim::Outcome;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// A run to be made.
pub struct Experiment {
    scenario: String,
    set: Vec<String>,
    seed: Option<u64>,
    catalog: Catalog,
    systems: Vec<String>,
    driver: Option<String>,
    expectations: Vec<Expect>,
}

/// What came of it.
#[derive(Debug, Clone)]
pub struct Summary {
    /// How the run ended and what was touched.
    pub outcome: Outcome,
    /// Score by system, or why there is none.
    pub scores: BTreeMap<String, Result<Score, String>>,
    /// Map score by system, where it draws a map.
    pub map_scores: BTreeMap<String, MapScore>,
    /// Every expectation: the end of the route, no contact, and those that were added.
    pub findings: Vec<Finding>,
}

/// Begins an experiment with a scenario: the name of an embedded one, or a path.
pub fn scenario(name: impl Into<String>) -> Experiment {
    Experiment {
        scenario: name.into(),
        set: Vec::new(),
        seed: None,
        catalog: Catalog::default(),
        systems: Vec::new(),
        driver: None,
        expectations: Vec::new(),
    }
}

impl Experiment {
    /// Uses this seed instead of the scenario's own.
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = Some(seed);
        self
    }

    /// Puts a value over the scenario's: `lidar.dropout_ratio=0.3`.
    pub fn set(mut self, assignment: impl Into<String>) -> Self {
        self.set.push(assignment.into());
        self
    }

    /// Adds a system of your own.
    pub fn slam(mut self, name: impl Into<String>, slam: impl Slam + 'static) -> Self {
        let name = name.into();
        // One run builds each system once; a second run of the same value cannot be asked for.
        let slot: Mutex<Option<Box<dyn Slam>>> = Mutex::new(Some(Box::new(slam)));
        self.catalog.add(
            name.clone(),
            Box::new(move |_| {
                let taken = slot.lock().unwrap_or_else(PoisonError::into_inner).take();
                taken.expect("an experiment is consumed by its only run")
            }),
        );
        self.systems.push(name);
        self
    }

    /// Adds a system that comes with the program.
    pub fn system(mut self, name: impl Into<String>) -> Self {
        self.systems.push(name.into());
        self
    }

    /// Who steers: `truth` or a system's name; the first system when never said, truth when there is none.
    pub fn driver(mut self, name: impl Into<String>) -> Self {
        self.driver = Some(name.into());
        self
    }

    /// Adds an expectation.
    pub fn expect(mut self, expect: Expect) -> Self {
        self.expectations.push(expect);
        self
    }

    /// Runs to the end.
    ///
    /// # Errors
    /// A scenario or a name that is refused.
    pub fn run(self) -> Result<Summary, Failure> {
        let scenario = load::checked(&self.scenario, Path::new(""), &self.set)?;
        let driver = self.driver.or_else(|| self.systems.first().cloned()).unwrap_or_else(|| "truth".into());
        let specs: BTreeMap<String, SystemSpec> = BTreeMap::new();
        let case = Case {
            scenario: &scenario,
            seed: self.seed.unwrap_or(scenario.seed),
            systems: &self.systems,
            specs: &specs,
            driver: &driver,
            expectations: &self.expectations,
        };
        let session = simulate(&self.catalog, &case, None, &mut |_| true)?;
        let simulated = session
            .simulated
            .ok_or_else(|| Failure::Internal("a simulated run came back without its simulator".into()))?;
        let maps = session.systems.iter().filter_map(|system| Some((system.name.clone(), system.map_score?)));
        Ok(Summary {
            outcome: simulated.outcome,
            map_scores: maps.collect(),
            findings: session.findings,
            scores: session.systems.into_iter().map(|system| (system.name, system.score)).collect(),
        })
    }
}

impl Summary {
    /// Whether everything expected came true.
    pub fn passed(&self) -> bool {
        self.findings.iter().all(|finding| finding.passed)
    }

    /// Fails the test with one line per unmet expectation.
    ///
    /// # Panics
    /// When an expectation was not met.
    pub fn assert_expectations(&self) {
        let failed: Vec<String> =
            self.findings.iter().filter(|finding| !finding.passed).map(Finding::line).collect();
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    }
}
