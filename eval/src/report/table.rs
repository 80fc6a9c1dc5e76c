//! The metric tables: what each system reached, what was wanted, what the paper printed.

use super::number::{short, text, text_or};
use super::{Expectation, ReportInput, SystemReport};
use crate::map::MapScore;
use crate::paper::{Published, PublishedMapRow, PublishedRow};
use crate::score::Score;
use serde::Serialize;

/// A table, ready for the template.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Table {
    pub(super) systems: Vec<String>,
    /// Method and site of each published row.
    pub(super) published: Vec<(&'static str, &'static str)>,
    pub(super) has_limits: bool,
    pub(super) rows: Vec<Row>,
}

/// One metric.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Row {
    pub(super) label: &'static str,
    pub(super) unit: &'static str,
    /// The metric's name in the written metrics.
    pub(super) key: &'static str,
    pub(super) cells: Vec<Entry>,
    pub(super) limit: String,
    pub(super) published: Vec<String>,
}

/// What one system reached.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Entry {
    pub(super) text: String,
    /// The best of several systems.
    pub(super) best: bool,
    /// `pass`, `fail` or empty where nothing was asked.
    pub(super) state: &'static str,
}

/// Which way is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Better {
    Lower,
    Higher,
    /// A number to be near, which no system is marked for.
    Neither,
}

type ScoreMetric = (
    &'static str,
    &'static str,
    &'static str,
    fn(&Score) -> Option<f64>,
    fn(&PublishedRow) -> Option<Published>,
    Better,
);

#[rustfmt::skip]
const SCORE_ROWS: [ScoreMetric; 27] = [
    ("Position, mean", "m", "position_mean_m", |s| Some(s.position_mean_m), |p| p.position_mean_m, Better::Lower),
    ("Position, RMS", "m", "position_rms_m", |s| Some(s.position_rms_m), |p| p.position_rms_m, Better::Lower),
    ("Position, largest", "m", "position_max_m", |s| Some(s.position_max_m), |_| None, Better::Lower),
    ("Heading, mean", "deg", "heading_mean_deg", |s| s.heading_mean_deg, |_| None, Better::Lower),
    ("Heading, RMS", "deg", "heading_rms_deg", |s| s.heading_rms_deg, |_| None, Better::Lower),
    ("Loop", "m", "loop_m", |s| Some(s.loop_m), |p| p.loop_m, Better::Lower),
    ("Loop, heading", "deg", "loop_heading_deg", |s| s.loop_heading_deg, |_| None, Better::Lower),
    ("Error over path", "%", "error_ratio_percent", |s| s.error_ratio_percent, |p| p.error_ratio_percent, Better::Lower),
    ("Position step, mean", "m", "position_increment_mean_m", |s| Some(s.position_increment_mean_m), |p| p.position_increment_mean_m, Better::Lower),
    ("Position step, RMS", "m", "position_increment_rms_m", |s| Some(s.position_increment_rms_m), |p| p.position_increment_rms_m, Better::Lower),
    ("Heading step, mean", "deg", "heading_increment_mean_deg", |s| s.heading_increment_mean_deg, |_| None, Better::Lower),
    ("Heading step, RMS", "deg", "heading_increment_rms_deg", |s| s.heading_increment_rms_deg, |_| None, Better::Lower),
    ("Motion direction, mean", "rad", "motion_direction_mean_rad", |s| s.motion_direction_mean_rad, |p| p.motion_direction_mean_rad, Better::Lower),
    ("Motion direction, RMS", "rad", "motion_direction_rms_rad", |s| s.motion_direction_rms_rad, |p| p.motion_direction_rms_rad, Better::Lower),
    ("Motion direction step, mean", "rad", "motion_direction_increment_mean_rad", |s| s.motion_direction_increment_mean_rad, |p| p.motion_direction_increment_mean_rad, Better::Lower),
    ("Motion direction step, RMS", "rad", "motion_direction_increment_rms_rad", |s| s.motion_direction_increment_rms_rad, |p| p.motion_direction_increment_rms_rad, Better::Lower),
    ("ATE, SE(2) fitted, RMSE", "m", "ape_se2.rmse", |s| s.ape_se2.map(|ape| ape.rmse), |_| None, Better::Lower),
    ("APE in space, RMSE", "m", "ape.rmse", |s| Some(s.ape.rmse), |_| None, Better::Lower),
    ("RPE per sample, RMSE", "m", "rpe_translation.rmse", |s| s.rpe_translation.map(|rpe| rpe.rmse), |_| None, Better::Lower),
    ("RPE per sample, RMSE", "deg", "rpe_rotation_deg.rmse", |s| s.rpe_rotation_deg.map(|rpe| rpe.rmse), |_| None, Better::Lower),
    ("Error over its covariance, ANEES (1 is honest)", "", "consistency.anees", |s| s.consistency.map(|c| c.anees), |_| None, Better::Neither),
    ("Errors outside of their 95 % ellipsoid", "%", "consistency.outside_95_percent", |s| s.consistency.map(|c| c.outside_95_percent), |_| None, Better::Neither),
    ("Poses confidently wrong", "", "consistency.confidently_wrong", |s| s.consistency.map(|c| c.confidently_wrong as f64), |_| None, Better::Lower),
    ("Path as finally believed: position, mean", "m", "revised.position_mean_m", |s| s.revised.map(|r| r.position_mean_m), |_| None, Better::Lower),
    ("Path as finally believed: position, largest", "m", "revised.position_max_m", |s| s.revised.map(|r| r.position_max_m), |_| None, Better::Lower),
    ("Path as finally believed: heading, mean", "deg", "revised.heading_mean_deg", |s| s.revised.and_then(|r| r.heading_mean_deg), |_| None, Better::Lower),
    ("Path as finally believed: loop", "m", "revised.loop_m", |s| s.revised.map(|r| r.loop_m), |_| None, Better::Lower),
];

type MapMetric = (
    &'static str,
    &'static str,
    &'static str,
    fn(&MapScore) -> Option<f64>,
    fn(&PublishedMapRow) -> Published,
    Better,
);

#[rustfmt::skip]
const MAP_ROWS: [MapMetric; 6] = [
    ("Mean map error", "cells", "mean_map_error_cells", |s| s.mean_map_error_cells, |p| p.mean_map_error_cells, Better::Lower),
    ("Accuracy", "", "accuracy_ratio", |s| s.accuracy_ratio, |p| p.accuracy_ratio, Better::Higher),
    ("F1", "", "f1_ratio", |s| s.f1_ratio, |p| p.f1_ratio, Better::Higher),
    ("Precision, PPV", "", "ppv_ratio", |s| s.ppv_ratio, |p| p.ppv_ratio, Better::Higher),
    ("Sensitivity, TPR", "", "tpr_ratio", |s| s.tpr_ratio, |p| p.tpr_ratio, Better::Higher),
    ("Specificity, TNR", "", "tnr_ratio", |s| s.tnr_ratio, |p| p.tnr_ratio, Better::Higher),
];

/// Every pose metric of every system, and how it was compared.
pub(super) fn scores(input: &ReportInput) -> Table {
    let systems: Vec<&SystemReport> = input.systems.iter().collect();
    let mut rows: Vec<Row> = SCORE_ROWS
        .iter()
        .map(|(label, unit, key, ours, theirs, better)| {
            let values =
                systems.iter().map(|system| system.score.as_ref().and_then(ours)).collect::<Vec<_>>();
            let published = input.published.iter().map(|row| printed(theirs(row))).collect();
            row((label, unit, key), &values, &systems, input, *better, published)
        })
        .collect();
    let stated = |label, unit, say: fn(&Score) -> String| Row {
        label,
        unit,
        key: "",
        cells: systems
            .iter()
            .map(|system| Entry {
                text: system.score.as_ref().map_or_else(|| "n/a".to_owned(), say),
                best: false,
                state: "",
            })
            .collect(),
        limit: String::new(),
        published: vec![String::new(); input.published.len()],
    };
    rows.push(stated("Path compared", "m", |s| text(s.path_length_m)));
    rows.push(stated("Samples", "", |s| s.samples.to_string()));
    rows.push(stated("Time covered", "%", |s| text(100.0 * s.coverage_ratio)));
    rows.push(stated("Alignment", "", |s| s.alignment.to_string()));
    rows.push(stated("Association", "", |s| format!("within {} ms", short(1e3 * s.association_max_s))));
    rows.push(stated("Poses hold at", "", |s| s.pose_time.to_string()));
    Table {
        systems: systems.iter().map(|system| system.name.clone()).collect(),
        published: input.published.iter().map(|row| (row.method, row.site)).collect(),
        has_limits: rows.iter().any(|row| !row.limit.is_empty()),
        rows,
    }
}

/// The paper's six map numbers of every system that drew a scored map.
pub(super) fn map_scores(input: &ReportInput) -> Table {
    let systems: Vec<&SystemReport> =
        input.systems.iter().filter(|system| system.map_score.is_some()).collect();
    let mut rows: Vec<Row> = MAP_ROWS
        .iter()
        .map(|(label, unit, key, ours, theirs, better)| {
            let values =
                systems.iter().map(|system| system.map_score.as_ref().and_then(ours)).collect::<Vec<_>>();
            let published = input.published_map.iter().map(|row| printed(Some(theirs(row)))).collect();
            row((label, unit, key), &values, &systems, input, *better, published)
        })
        .collect();
    let stated = |label, unit, say: fn(&MapScore) -> String, published: &str| Row {
        label,
        unit,
        key: "",
        cells: systems
            .iter()
            .filter_map(|system| system.map_score.as_ref())
            .map(|score| Entry { text: say(score), best: false, state: "" })
            .collect(),
        limit: String::new(),
        published: input.published_map.iter().map(|_| published.to_owned()).collect(),
    };
    rows.push(stated("Cell", "m", |s| short(s.resolution_m), "0.01"));
    rows.push(stated("Tolerance", "m", |s| short(s.tolerance_m), "not stated"));
    rows.push(stated(
        "True surface seen",
        "%",
        |s| {
            let seen = s.found_surface_cells + s.false_negative_cells;
            let all = seen + s.unseen_surface_cells;
            if all == 0 { "n/a".to_owned() } else { text(100.0 * seen as f64 / all as f64) }
        },
        "",
    ));
    Table {
        systems: systems.iter().map(|system| system.name.clone()).collect(),
        published: input.published_map.iter().map(|_| ("paper", "cone field")).collect(),
        has_limits: rows.iter().any(|row| !row.limit.is_empty()),
        rows,
    }
}

fn row(
    (label, unit, key): (&'static str, &'static str, &'static str),
    values: &[Option<f64>],
    systems: &[&SystemReport],
    input: &ReportInput,
    better: Better,
    published: Vec<String>,
) -> Row {
    let known = || values.iter().flatten().copied().filter(|value| value.is_finite());
    let best = match better {
        Better::Lower => known().reduce(f64::min),
        Better::Higher => known().reduce(f64::max),
        Better::Neither => None,
    };
    let several = known().count() > 1;
    let asked: Vec<&Expectation> = input.expectations.iter().filter(|asked| asked.metric == key).collect();
    let cells = values
        .iter()
        .zip(systems)
        .map(|(value, system)| {
            let mine = || asked.iter().filter(|asked| asked.system.is_empty() || asked.system == system.name);
            let state = match (mine().count(), mine().all(|asked| asked.passed)) {
                (0, _) => "",
                (_, true) => "pass",
                (_, false) => "fail",
            };
            Entry { text: text_or(*value), best: several && value.is_some() && *value == best, state }
        })
        .collect();
    let mut limits: Vec<&str> = asked.iter().map(|asked| asked.limit.as_str()).collect();
    limits.dedup();
    Row { label, unit, key, cells, limit: limits.join("; "), published }
}

fn printed(published: Option<Published>) -> String {
    // The paper prints two decimals or more.
    let two = |value: f64| {
        let shortest = value.to_string();
        let decimals = shortest.split_once('.').map_or(0, |(_, decimals)| decimals.len());
        if decimals < 2 { format!("{value:.2}") } else { shortest }
    };
    match published {
        Some(Published { value, half_width: Some(half_width) }) => {
            format!("{} \u{b1} {}", two(value), two(half_width))
        }
        Some(Published { value, half_width: None }) => two(value),
        None => String::new(),
    }
}
