//! What is expected of a run, and whether it came true. A number without support cannot pass.

use crate::session::{Case, SystemResult};
use arborloop_sim::{End, Outcome};
use serde::{Deserialize, Serialize};

/// A bound on one number of one system.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Expect {
    /// Which system.
    pub system: String,
    /// Which number, as `metrics.json` names it, for instance `position_mean_m` or `ape.rmse`.
    pub metric: String,
    /// It must not be greater.
    #[serde(default)]
    pub max: Option<f64>,
    /// It must not be less.
    #[serde(default)]
    pub min: Option<f64>,
}

/// An expectation and what was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Of whom; empty for the run as a whole.
    pub system: String,
    /// Which number.
    pub metric: String,
    /// What was found; `None` is not available, and never passes.
    pub found: Option<f64>,
    /// What was wanted, in words.
    pub limit: String,
    /// Whether it was met.
    pub passed: bool,
}

impl Finding {
    /// The finding as one line.
    pub fn line(&self) -> String {
        let whose = if self.system.is_empty() { "run".to_owned() } else { self.system.clone() };
        let found = self.found.map_or("n/a".to_owned(), |found| format!("{found:.4}"));
        format!("{whose} {}: found {found}, wanted {}", self.metric, self.limit)
    }
}

impl Expect {
    /// Reads `system.metric<=0.05` or `system.metric>=0.9`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wanted = "wanted SYSTEM.METRIC<=NUMBER or >=, for instance mhd.position_mean_m<=0.05";
        let (left, bound, most) = match (text.split_once("<="), text.split_once(">=")) {
            (Some((left, bound)), _) => (left, bound, true),
            (None, Some((left, bound))) => (left, bound, false),
            (None, None) => return Err(format!("found `{text}`, {wanted}")),
        };
        let (system, metric) = left.trim().split_once('.').ok_or(format!("found `{text}`, {wanted}"))?;
        let bound: f64 = bound.trim().parse().map_err(|_| format!("found `{text}`, {wanted}"))?;
        let (max, min) = if most { (Some(bound), None) } else { (None, Some(bound)) };
        Ok(Expect { system: system.into(), metric: metric.into(), max, min })
    }

    fn judge(&self, results: &[SystemResult]) -> Finding {
        let found =
            results.iter().find(|result| result.name == self.system).and_then(|r| number(r, &self.metric));
        let below = |found: f64| self.max.is_none_or(|max| found <= max);
        let above = |found: f64| self.min.is_none_or(|min| found >= min);
        let limit = match (self.min, self.max) {
            (Some(min), Some(max)) => format!("{min} to {max}"),
            (Some(min), None) => format!(">= {min}"),
            (None, Some(max)) => format!("<= {max}"),
            (None, None) => "any number".into(),
        };
        let passed = found.is_some_and(|found| below(found) && above(found));
        Finding { system: self.system.clone(), metric: self.metric.clone(), found, limit, passed }
    }
}

/// A number of a system by the name that `metrics.json` gives it.
fn number(result: &SystemResult, metric: &str) -> Option<f64> {
    let score = result.score.as_ref().ok().and_then(|score| serde_json::to_value(score).ok());
    let map = result.map_score.as_ref().and_then(|score| serde_json::to_value(score).ok());
    let pointer = format!("/{}", metric.replace('.', "/"));
    [score, map].into_iter().flatten().find_map(|value| value.pointer(&pointer)?.as_f64())
}

/// Every simulated run is expected to finish its route and to touch nothing; then what the caller expects.
pub(crate) fn judge(case: &Case<'_>, outcome: &Outcome, results: &[SystemResult]) -> Vec<Finding> {
    let whole = |metric: &str, found: f64, limit: &str, passed| Finding {
        system: String::new(),
        metric: metric.into(),
        found: Some(found),
        limit: limit.into(),
        passed,
    };
    let share =
        outcome.progress.distance_m / (outcome.progress.distance_m + outcome.progress.remaining_m).max(1e-9);
    let touched = outcome.contacts.len() as f64;
    let mut findings = vec![
        whole("route_share", share, "the end of the route", outcome.end == End::Finished),
        whole("contacts", touched, "0", outcome.contacts.is_empty()),
    ];
    findings.extend(case.expectations.iter().map(|expect| expect.judge(results)));
    findings
}

/// A replay is expected what the caller expects.
pub(crate) fn judge_replay(expectations: &[Expect], results: &[SystemResult]) -> Vec<Finding> {
    expectations.iter().map(|expect| expect.judge(results)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_expectation_is_read_from_its_line_and_a_bad_one_is_named() {
        let expect = Expect::parse("mhd.ape.rmse <= 0.05").unwrap();
        assert_eq!(
            (expect.system.as_str(), expect.metric.as_str(), expect.max),
            ("mhd", "ape.rmse", Some(0.05))
        );
        assert_eq!(Expect::parse("mhd.f1_ratio>=0.8").unwrap().min, Some(0.8));
        for bad in ["mhd.position_mean_m", "position<=1", "mhd.x<=wide"] {
            assert!(Expect::parse(bad).unwrap_err().contains(bad));
        }
    }

    #[test]
    fn a_number_that_is_not_there_does_not_pass() {
        let expect =
            Expect { system: "mhd".into(), metric: "position_mean_m".into(), max: Some(1.0), min: None };
        let finding = expect.judge(&[]);
        assert!(!finding.passed);
        assert_eq!(finding.found, None);
    }
}
