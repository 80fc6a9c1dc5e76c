//! The paper's tables made again: each twin of a published site, every system over the seeds, the published rows beside.

use crate::failure::Failure;
use crate::metric::{MAP, POSE, as_printed};
use crate::page::published_site;
use crate::session::{Session, SystemResult};
use crate::suite::Job;
use arborloop_eval::{OverSeeds, paper};
use comfy_table::{CellAlignment, Table, presets};
use std::collections::BTreeMap;

/// What stands in the page that holds the tables, before the first of them.
const PREFACE: &str = "Mean over the seeds +- 1.96 standard deviations over the root of their number, as the paper \
    prints its own. Alignment none: the first pose is given, every later error counts.\n\n\
    What compares and what does not:\n\n\
    - Positions, increments and loop compare in kind. The twins have the sites' measures, not their plants: they are \
    other fields of the same sort.\n\
    - Published angles are differences between directions of motion, in radians (the paper's tables say degrees). They \
    compare with *motion direction*, never with *heading*.\n\
    - A published error of path length averages the position's and the angle's share; ours is the position's alone.\n\
    - The published Pullally runs were given a motion input made from the RTK reference. No system here is.\n\
    - The published A-LOAM row of Pullally was compared with the reference index by index, not by time.\n\
    - The published map row does not say how near a cell must be to count; ours counts within 0.1 m.\n";

/// The tables of every case that is the twin of a published site, as a page of Markdown; `None` without a twin.
pub(crate) fn tables(jobs: &[Job], ended: &[Result<Session, Failure>]) -> Option<String> {
    let mut cases: BTreeMap<&str, Vec<(&Job, &Session)>> = BTreeMap::new();
    for (job, session) in jobs.iter().zip(ended) {
        if let Ok(session) = session {
            cases.entry(job.name.as_str()).or_default().push((job, session));
        }
    }
    let mut text = String::new();
    for members in cases.values() {
        let job = members[0].0;
        if let Some(site) = published_site(&job.scenario.name) {
            let driver = &job.case.driver;
            let set = if job.case.set.is_empty() {
                String::new()
            } else {
                format!(", {}", job.case.set.join(", "))
            };
            let seeds = members.len();
            text += &format!(
                "\n## {}, twin of {site}: {seeds} seeds, driven by {driver}{set}\n\n",
                job.scenario.name
            );
            let sessions: Vec<&Session> = members.iter().map(|(_, session)| *session).collect();
            text += &format!("{}\n", table(site, &job.case.systems, &sessions));
        }
    }
    (!text.is_empty()).then(|| format!("# Tables of the paper, made again\n\n{PREFACE}{text}"))
}

fn table(site: &str, systems: &[String], sessions: &[&Session]) -> Table {
    let published = paper::rows_of(site);
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN);
    let methods = published.iter().map(|row| format!("paper: {}", row.method));
    table.set_header(std::iter::once("metric".to_owned()).chain(systems.iter().cloned()).chain(methods));
    let over = |decimals: usize, of: &dyn Fn(&SystemResult) -> Option<f64>| -> Vec<String> {
        let cell = |system: usize| {
            let samples: Option<Vec<f64>> =
                sessions.iter().map(|session| of(&session.systems[system])).collect();
            show(samples.and_then(|samples| OverSeeds::of(&samples)), decimals)
        };
        (0..systems.len()).map(cell).collect()
    };
    let mut row = |name: &str, ours: Vec<String>, theirs: Vec<String>| {
        table.add_row(std::iter::once(name.to_owned()).chain(ours).chain(theirs));
    };
    let blank = || vec![String::new(); published.len()];
    for metric in POSE {
        let ours = over(metric.decimals, &|system| (metric.of)(system.score.as_ref().ok()?));
        let theirs = published.iter().map(|row| (metric.published)(row).map_or(String::new(), as_printed));
        row(metric.name, ours, theirs.collect());
    }
    for metric in MAP {
        let ours = over(metric.decimals, &|system| (metric.of)(system.map_score.as_ref()?));
        let mut theirs = blank();
        if site == paper::CONE_FIELD.site
            && let Some(value) = (metric.published)(&paper::CONE_FIELD_MAP)
        {
            theirs[0] = as_printed(value);
        }
        row(metric.name, ours, theirs);
    }
    row("CPU per sweep, mean (ms)", over(2, &|system| Some(system.cpu_ms?.mean)), blank());
    let blind = |system: &SystemResult| Some((system.health.degraded + system.health.lost) as f64);
    row("sweeps not tracking", over(0, &blind), blank());
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// A number that any seed lacks is not available: a mean over those that got through would flatter.
fn show(over: Option<OverSeeds>, decimals: usize) -> String {
    match over {
        Some(OverSeeds { mean, std: Some(std), seeds, .. }) => {
            format!("{mean:.decimals$} +- {:.decimals$}", 1.96 * std / (seeds as f64).sqrt())
        }
        Some(OverSeeds { mean, .. }) => format!("{mean:.decimals$}"),
        None => "n/a".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_printed_as_the_paper_prints_its_own() {
        // Standard deviation of 1, 2, 3 is 1; 1.96 / sqrt(3) = 1.13.
        assert_eq!(show(OverSeeds::of(&[1.0, 2.0, 3.0]), 2), "2.00 +- 1.13");
        assert_eq!(show(OverSeeds::of(&[2.0]), 1), "2.0");
        assert_eq!(show(None, 3), "n/a");
    }
}
