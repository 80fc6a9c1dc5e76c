//! Where a system breaks: the cases of a suite that turn a dial, value by value, and how far each system holds its bounds.

use crate::failure::Failure;
use crate::session::{Session, SystemResult};
use crate::suite::{Job, Vary};
use arborloop_eval::OverSeeds;
use comfy_table::{CellAlignment, Table, presets};
use std::collections::BTreeMap;

/// What stands in the page that holds the tables, before the first of them.
const PREFACE: &str = "Mean position error over the seeds in meters, the worst seed in brackets, and the share of sweeps after \
    which the system said that it was not tracking, where it said so. **Bold**: a bound of the suite was missed.\n";

/// The sessions of one value: which value, and how each seed ended.
type Turns<'a> = BTreeMap<usize, Vec<(&'a Job, Option<&'a Session>)>>;

/// The tables of every case that turns a dial, as Markdown; `None` without such a case.
pub(crate) fn tables(jobs: &[Job], ended: &[Result<Session, Failure>]) -> Option<String> {
    let mut cases: BTreeMap<usize, Turns<'_>> = BTreeMap::new();
    for (job, session) in jobs.iter().zip(ended) {
        if let (case, Some(turn)) = job.place {
            cases.entry(case).or_default().entry(turn).or_default().push((job, session.as_ref().ok()));
        }
    }
    let mut text = String::new();
    for turns in cases.values() {
        let Some(((job, _), vary)) =
            turns.values().flatten().next().and_then(|first| Some((*first, first.0.case.vary.as_ref()?)))
        else {
            continue;
        };
        let (name, driver, seeds) = (&job.scenario.name, &job.case.driver, job.case.seeds.len());
        text += &format!("\n## {} in {name}, driven by {driver}, {seeds} seeds\n\n", vary.key);
        text += &format!("{}\n\n", table(vary, &job.case.systems, turns));
        for (index, system) in job.case.systems.iter().enumerate() {
            if job.case.expect.iter().any(|expect| expect.system == *system) {
                text += &format!("{}\n", verdict(vary, system, index, turns));
            }
        }
    }
    (!text.is_empty()).then(|| format!("# Where it breaks\n\n{PREFACE}{text}"))
}

fn table(vary: &Vary, systems: &[String], turns: &Turns<'_>) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN);
    table.set_header(std::iter::once(vary.key.clone()).chain(systems.iter().cloned()));
    for (turn, members) in turns {
        let cells = (0..systems.len()).map(|index| {
            let cell = cell(members, index);
            if holds(&systems[index], members) { cell } else { format!("**{cell}**") }
        });
        table.add_row(std::iter::once(vary.label(*turn)).chain(cells));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn cell(members: &[(&Job, Option<&Session>)], index: usize) -> String {
    let systems: Vec<&SystemResult> =
        members.iter().filter_map(|(_, session)| session.map(|session| &session.systems[index])).collect();
    let errors: Vec<f64> =
        systems.iter().filter_map(|system| Some(system.score.as_ref().ok()?.position_mean_m)).collect();
    let Some(over) = OverSeeds::of(&errors).filter(|over| over.seeds == members.len()) else {
        return "no score".into();
    };
    let blind: u64 = systems.iter().map(|system| system.health.degraded + system.health.lost).sum();
    let all: u64 = blind + systems.iter().map(|system| system.health.tracking).sum::<u64>();
    let share =
        if blind > 0 { format!(", {:.0} % blind", 100.0 * blind as f64 / all as f64) } else { String::new() };
    format!("{:.3} ({:.3}){share}", over.mean, over.max)
}

/// Whether every seed met every bound on this system.
fn holds(system: &str, members: &[(&Job, Option<&Session>)]) -> bool {
    members.iter().all(|(_, session)| {
        session.is_some_and(|session| {
            session.findings.iter().filter(|finding| finding.system == system).all(|finding| finding.passed)
        })
    })
}

fn verdict(vary: &Vary, system: &str, index: usize, turns: &Turns<'_>) -> String {
    let failed = turns.iter().find(|(_, members)| !holds(system, members));
    let Some((turn, members)) = failed else {
        return format!("`{system}` holds its bounds at every value.");
    };
    let missed: Vec<String> = members
        .iter()
        .flat_map(|(job, session)| {
            let findings = session.iter().flat_map(|session| &session.findings);
            let lines = findings.filter(|finding| finding.system == system && !finding.passed);
            lines.map(|finding| format!("seed {}: {}", job.seed, finding.line())).collect::<Vec<_>>()
        })
        .collect();
    let why = missed.first().cloned().unwrap_or_else(|| cell(members, index));
    format!("`{system}` breaks at {}: {why}.", vary.label(*turn))
}
