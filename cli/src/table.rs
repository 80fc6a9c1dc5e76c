//! Results for a terminal: one table, systems as columns, the paper's row beside them.

use crate::page::{published_site, verdict_lines};
use crate::session::{Session, SystemResult};
use arborloop_eval::paper::{self, Published};
use arborloop_eval::{MapScore, Score};
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
    let score = |pick: fn(&Score) -> Option<f64>| move |s: &SystemResult| pick(s.score.as_ref().ok()?);
    let map = |pick: fn(&MapScore) -> Option<f64>| move |s: &SystemResult| pick(s.map_score.as_ref()?);
    let mut row = |name: &str, decimals: usize, of: Of<'_>, printed: &dyn Fn(usize) -> Option<Published>| {
        let show = |value: Option<f64>| value.map_or("n/a".to_owned(), |value| format!("{value:.decimals$}"));
        let ours = session.systems.iter().map(|system| show(of(system)));
        let theirs = (0..published.len()).map(|index| match printed(index) {
            Some(Published { value, half_width: Some(half) }) => format!("{value} +- {half}"),
            Some(Published { value, half_width: None }) => value.to_string(),
            None => String::new(),
        });
        table.add_row(std::iter::once(name.to_owned()).chain(ours).chain(theirs));
    };
    let none = |_: usize| None;
    row("position mean (m)", 4, &score(|s| Some(s.position_mean_m)), &|n| published[n].position_mean_m);
    row("position RMS (m)", 4, &score(|s| Some(s.position_rms_m)), &|n| published[n].position_rms_m);
    row("position max (m)", 4, &score(|s| Some(s.position_max_m)), &none);
    row("heading mean (deg)", 3, &score(|s| s.heading_mean_deg), &none);
    row("heading RMS (deg)", 3, &score(|s| s.heading_rms_deg), &none);
    row("motion direction mean (rad)", 3, &score(|s| s.motion_direction_mean_rad), &|n| {
        published[n].motion_direction_mean_rad
    });
    row("position increment mean (m)", 4, &score(|s| Some(s.position_increment_mean_m)), &|n| {
        published[n].position_increment_mean_m
    });
    row("position increment RMS (m)", 4, &score(|s| Some(s.position_increment_rms_m)), &|n| {
        published[n].position_increment_rms_m
    });
    row("heading increment mean (deg)", 3, &score(|s| s.heading_increment_mean_deg), &none);
    row("error of path length (%)", 4, &score(|s| s.error_ratio_percent), &|n| {
        published[n].error_ratio_percent
    });
    row("loop (m)", 4, &score(|s| Some(s.loop_m)), &|n| published[n].loop_m);
    row("APE RMSE (m)", 4, &score(|s| Some(s.ape.rmse)), &none);
    row("ATE RMSE, SE(2) (m)", 4, &score(|s| s.ape_se2.map(|stats| stats.rmse)), &none);
    row("RPE RMSE (m)", 4, &score(|s| s.rpe_translation.map(|stats| stats.rmse)), &none);
    if session.simulated.is_some() {
        let twin = |pick: fn(&paper::PublishedMapRow) -> Published| {
            let ours = site == Some("cone field");
            move |n: usize| (ours && n == 0).then(|| pick(&paper::CONE_FIELD_MAP))
        };
        row("map error (cells)", 2, &map(|m| m.mean_map_error_cells), &twin(|m| m.mean_map_error_cells));
        row("map accuracy", 3, &map(|m| m.accuracy_ratio), &twin(|m| m.accuracy_ratio));
        row("map F1", 3, &map(|m| m.f1_ratio), &twin(|m| m.f1_ratio));
        row("map PPV", 3, &map(|m| m.ppv_ratio), &twin(|m| m.ppv_ratio));
        row("map TPR", 3, &map(|m| m.tpr_ratio), &twin(|m| m.tpr_ratio));
        row("map TNR", 3, &map(|m| m.tnr_ratio), &twin(|m| m.tnr_ratio));
    }
    row("CPU per sweep, mean (ms)", 2, &|s| s.cpu_ms.map(|stats| stats.mean), &none);
    row("CPU per sweep, max (ms)", 2, &|s| s.cpu_ms.map(|stats| stats.max), &none);
    row("sweeps not tracking", 0, &|s| Some((s.health.degraded + s.health.lost) as f64), &none);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
