//! Results for a terminal: one table, systems as columns, the paper's row beside them.

use crate::metric::{MAP, POSE, as_printed};
use crate::page::{published_site, verdict_lines};
use crate::session::{Session, SystemResult};
use arborloop_eval::paper::{self, Published};
use comfy_table::{CellAlignment, ContentArrangement, Table, TableComponent, presets};

type Of<'a> = &'a dyn Fn(&SystemResult) -> Option<f64>;

/// The whole answer of a run or replay as text.
pub(crate) fn render(session: &Session) -> String {
    let mut text = format!(
        "{} {}, seed {}, driven by {}\n",
        if session.passed() { "PASSED" } else { "FAILED" },
        session.name,
        session.seed,
        session.driver
    );
    for line in verdict_lines(session) {
        text += &format!("  {line}\n");
    }
    text += &format!("{}\n", metrics(session));
    let alignment = session.systems.iter().find_map(|system| system.score.as_ref().ok());
    if let Some(score) = alignment {
        text += &format!(
            "alignment {}, poses at {}, association within {} ms\n",
            score.alignment,
            score.pose_time,
            score.association_max_s * 1e3
        );
    }
    if published_site(&session.name).is_some() {
        text += &format!("paper: {}\n", paper::CAUTION);
    }
    for system in &session.systems {
        if let Err(reason) = &system.score {
            text += &format!("{} has no score: {reason}\n", system.name);
        }
    }
    text += &format!("{} sweeps, real-time factor {:.1}\n", session.sweeps, session.realtime_factor);
    if let Some(recorded) = &session.recorded {
        text += &format!("content hash {}\n", recorded.content_hash);
    }
    text
}

/// A table with a line under its head and none between its rows.
pub(crate) fn plain_table() -> Table {
    let mut table = Table::new();
    table.load_preset(presets::UTF8_HORIZONTAL_ONLY).set_content_arrangement(ContentArrangement::Disabled);
    table.remove_style(TableComponent::HorizontalLines).remove_style(TableComponent::MiddleIntersections);
    table
        .remove_style(TableComponent::LeftBorderIntersections)
        .remove_style(TableComponent::RightBorderIntersections);
    table
}

fn metrics(session: &Session) -> Table {
    let site = published_site(&session.name);
    let published = site.map_or(Vec::new(), paper::rows_of);
    let mut table = plain_table();
    let names = session.systems.iter().map(|system| system.name.clone());
    let methods = published.iter().map(|row| format!("paper: {}", row.method));
    table.set_header(std::iter::once("metric".to_owned()).chain(names).chain(methods));
    let mut row = |name: &str, decimals: usize, of: Of<'_>, printed: &dyn Fn(usize) -> Option<Published>| {
        let show = |value: Option<f64>| value.map_or("n/a".to_owned(), |value| format!("{value:.decimals$}"));
        let ours = session.systems.iter().map(|system| show(of(system)));
        let theirs = (0..published.len()).map(|index| printed(index).map_or(String::new(), as_printed));
        table.add_row(std::iter::once(name.to_owned()).chain(ours).chain(theirs));
    };
    for metric in POSE {
        let of = |system: &SystemResult| (metric.of)(system.score.as_ref().ok()?);
        row(metric.name, metric.decimals, &of, &|n| (metric.published)(&published[n]));
    }
    if session.simulated.is_some() {
        for metric in MAP {
            let of = |system: &SystemResult| (metric.of)(system.map_score.as_ref()?);
            let twin = |n: usize| (site == Some("cone field") && n == 0).then_some(paper::CONE_FIELD_MAP);
            row(metric.name, metric.decimals, &of, &|n| (metric.published)(&twin(n)?));
        }
    }
    let none = |_: usize| None;
    row("CPU per sweep, mean (ms)", 2, &|s| s.cpu_ms.map(|stats| stats.mean), &none);
    row("CPU per sweep, max (ms)", 2, &|s| s.cpu_ms.map(|stats| stats.max), &none);
    row("sweeps not tracking", 0, &|s| Some((s.health.degraded + s.health.lost) as f64), &none);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
