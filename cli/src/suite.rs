//! A suite says what is asked: scenarios, systems, seeds, who drives, what is expected. It names no world of its own.

use crate::expect::Expect;
use crate::failure::Failure;
use crate::systems::SystemSpec;
use arborloop_sim::document::suggest;
use arborloop_sim::{Document, Refusal, Scenario};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The suites that come with the program: name and text.
pub(crate) const EMBEDDED: &[(&str, &str)] = &[
    ("smoke", include_str!("../suites/smoke.toml")),
    ("cone-field", include_str!("../suites/cone-field.toml")),
    ("closed-loop", include_str!("../suites/closed-loop.toml")),
    ("paper", include_str!("../suites/paper.toml")),
    ("stress", include_str!("../suites/stress.toml")),
    ("degraded", include_str!("../suites/degraded.toml")),
];

/// A suite as written.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Suite {
    /// Version of these keys, 1.
    pub schema: u32,
    /// Names the suite's folder.
    pub name: String,
    /// What is run.
    #[serde(rename = "case")]
    pub cases: Vec<SuiteCase>,
    /// Settings by system name.
    #[serde(default, rename = "system")]
    pub systems: BTreeMap<String, SystemSpec>,
}

/// One scenario with its systems and seeds.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SuiteCase {
    /// Name of an embedded scenario, or a file beside the suite.
    pub scenario: String,
    /// Assignments put over the scenario, as `--set` takes them.
    #[serde(default)]
    pub set: Vec<String>,
    /// A dial that is turned: one group of runs for each of its values.
    #[serde(default)]
    pub vary: Option<Vary>,
    /// One run each.
    pub seeds: Vec<u64>,
    /// `truth` or one of `systems`.
    pub driver: String,
    /// Names of systems.
    pub systems: Vec<String>,
    /// What must hold in every run.
    #[serde(default)]
    pub expect: Vec<Expect>,
}

/// A value of the scenario that takes several values, one after the other.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vary {
    /// Which, as `--set` names it.
    pub key: String,
    /// From harmless to hard.
    pub values: Vec<toml::Value>,
    /// What the table calls the values; the values themselves when absent.
    #[serde(default)]
    pub labels: Vec<String>,
}

impl Vary {
    /// What the table calls a value.
    pub(crate) fn label(&self, index: usize) -> String {
        self.labels.get(index).cloned().unwrap_or_else(|| self.values[index].to_string())
    }

    fn check(&self) -> Result<(), (&'static str, String)> {
        if self.values.is_empty() {
            return Err(("values", "found no value, wanted at least one".into()));
        }
        if !self.labels.is_empty() && self.labels.len() != self.values.len() {
            let (labels, values) = (self.labels.len(), self.values.len());
            return Err((
                "labels",
                format!("found {labels} labels of {values} values, wanted one each or none"),
            ));
        }
        Ok(())
    }
}

/// One run of a suite, ready.
#[derive(Debug, Clone)]
pub(crate) struct Job {
    pub(crate) name: String,
    pub(crate) scenario: Scenario,
    pub(crate) seed: u64,
    pub(crate) case: SuiteCase,
    /// Which case of the suite, and which value of its dial.
    pub(crate) place: (usize, Option<usize>),
}

/// Reads a suite by the name of an embedded one or by its path.
pub(crate) fn read(name: &str) -> Result<(Suite, Vec<Job>), Failure> {
    let document = match EMBEDDED.iter().find(|(known, _)| *known == name) {
        Some((name, text)) => Document::new(format!("{name}.toml"), *text),
        None if Path::new(name).exists() => crate::load::file(Path::new(name))?,
        None => {
            let known: Vec<&str> = EMBEDDED.iter().map(|(name, _)| *name).collect();
            return Err(Failure::Document(Refusal {
                document: Document::new(name, ""),
                span: None,
                message: "neither a suite file nor a suite that comes with the program".into(),
                help: Some(suggest(name, &known)),
            }));
        }
    };
    let suite: Suite = document.read()?;
    if suite.schema != 1 {
        return Err(document.refuse("schema", format!("found {}, wanted 1", suite.schema), None).into());
    }
    let beside = Path::new(name).parent().unwrap_or(Path::new("")).to_owned();
    let mut jobs = Vec::new();
    for (index, case) in suite.cases.iter().enumerate() {
        let at = |key: &str, message: String| document.refuse(&format!("case[{index}].{key}"), message, None);
        if case.seeds.is_empty() {
            return Err(at("seeds", "found no seed, wanted at least one".into()).into());
        }
        if case.driver != "truth" && !case.systems.contains(&case.driver) {
            let wanted = format!("found `{}`, wanted `truth` or one of {:?}", case.driver, case.systems);
            return Err(at("driver", wanted).into());
        }
        if let Some(expect) = case.expect.iter().find(|expect| !case.systems.contains(&expect.system)) {
            let message =
                format!("found `{}`, which is not among the systems {:?}", expect.system, case.systems);
            return Err(at("expect", message).into());
        }
        if let Some(Err((key, message))) = case.vary.as_ref().map(Vary::check) {
            return Err(at(&format!("vary.{key}"), message).into());
        }
        let turns: Vec<Option<usize>> = match &case.vary {
            Some(vary) => (0..vary.values.len()).map(Some).collect(),
            None => vec![None],
        };
        for turn in turns {
            let (mut set, mut suffix) = (case.set.clone(), String::new());
            if let (Some(vary), Some(turn)) = (&case.vary, turn) {
                set.push(format!("{}={}", vary.key, vary.values[turn]));
                suffix = format!("-{}-{}", vary.key, turn + 1);
            }
            let scenario = crate::load::checked(&case.scenario, &beside, &set)?;
            let name = format!("{}/{index}-{}-{}{suffix}", suite.name, scenario.name, case.driver);
            let case = SuiteCase { set, ..case.clone() };
            jobs.extend(case.seeds.iter().map(|&seed| Job {
                name: name.clone(),
                scenario: scenario.clone(),
                seed,
                case: case.clone(),
                place: (index, turn),
            }));
        }
    }
    Ok((suite, jobs))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_embedded_suite_reads_and_names_scenarios_that_exist() {
        for (name, text) in EMBEDDED {
            assert!(text.starts_with("# "), "{name}: the first line says why it exists");
            let (suite, jobs) = read(name).unwrap();
            assert_eq!(suite.name, *name);
            assert!(!jobs.is_empty());
        }
    }

    #[test]
    fn an_unknown_suite_is_answered_with_the_nearest_name() {
        assert!(
            matches!(read("smok"), Err(Failure::Document(refusal)) if refusal.help.clone().unwrap().contains("`smoke`"))
        );
    }
}
