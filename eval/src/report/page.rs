//! The page as the template sees it: every number already text, every drawing already a path.

use super::chart::{Curve, Panel, Subject, YFrom};
use super::map_view::MapView;
use super::number::{text, text_or};
use super::table::{self, Table};
use super::top_view::TopView;
use super::{Expectation, ReportInput, SystemReport};
use crate::paper::CAUTION;
use arborloop_base::Time;
use serde::Serialize;

/// Everything that the template needs.
#[derive(Debug, Serialize)]
pub(super) struct Page<'a> {
    title: &'a str,
    passed: bool,
    verdict_lines: &'a [String],
    facts: Vec<(&'static str, String)>,
    hashes: &'a [(String, String)],
    reproduce: &'a [String],
    check: &'a [String],
    caution: &'static str,
    expectations: Vec<Asked<'a>>,
    scores: Table,
    no_scores: Vec<(&'a str, &'a str)>,
    top_views: Vec<TopView>,
    time_panels: Vec<Panel>,
    distance_panels: Vec<Panel>,
    contacts: Vec<(String, &'a str)>,
    contacts_more: usize,
    map_views: Vec<MapView>,
    map_scores: Table,
    costs: Vec<Cost<'a>>,
    realtime_factor: Option<String>,
    files: &'a [(String, String)],
}

/// One expectation.
#[derive(Debug, Serialize)]
struct Asked<'a> {
    system: &'a str,
    metric: &'a str,
    found: String,
    limit: &'a str,
    passed: bool,
}

/// What a system cost, and how sure it was.
#[derive(Debug, Serialize)]
struct Cost<'a> {
    name: &'a str,
    mean_ms: String,
    median_ms: String,
    max_ms: String,
    sweeps: String,
    tracking: u64,
    degraded: u64,
    lost: u64,
}

/// Contacts listed on the page; the rest is counted.
const CONTACTS_MAX: usize = 30;

impl<'a> Page<'a> {
    pub(super) fn of(input: &'a ReportInput) -> Self {
        let clock = Clock::of(input);
        Page {
            title: &input.title,
            passed: input.verdict.passed,
            verdict_lines: &input.verdict.lines,
            facts: facts(input),
            hashes: &input.hashes,
            reproduce: &input.reproduce,
            check: &input.check,
            caution: CAUTION,
            expectations: input.expectations.iter().map(Asked::of).collect(),
            scores: table::scores(input),
            no_scores: input
                .systems
                .iter()
                .filter_map(|system| Some((system.name.as_str(), system.no_score.as_deref()?)))
                .collect(),
            top_views: TopView::all(input),
            time_panels: time_panels(input, &clock),
            distance_panels: distance_panels(input),
            contacts: input
                .contacts
                .iter()
                .take(CONTACTS_MAX)
                .map(|event| (format!("{:.1} s", clock.seconds(event.stamp)), event.text.as_str()))
                .collect(),
            contacts_more: input.contacts.len().saturating_sub(CONTACTS_MAX),
            map_views: input.systems.iter().filter_map(|system| MapView::of(input, system)).collect(),
            map_scores: table::map_scores(input),
            costs: input.systems.iter().map(Cost::of).collect(),
            realtime_factor: input.realtime_factor.map(text),
            files: &input.files,
        }
    }
}

impl<'a> Asked<'a> {
    fn of(asked: &'a Expectation) -> Self {
        Asked {
            system: &asked.system,
            metric: &asked.metric,
            found: text_or(asked.found),
            limit: &asked.limit,
            passed: asked.passed,
        }
    }
}

impl<'a> Cost<'a> {
    fn of(system: &'a SystemReport) -> Self {
        let ms = system.cpu_ms_per_sweep;
        Cost {
            name: &system.name,
            mean_ms: text_or(ms.map(|ms| ms.mean)),
            median_ms: text_or(ms.map(|ms| ms.median)),
            max_ms: text_or(ms.map(|ms| ms.max)),
            sweeps: ms.map_or_else(|| "n/a".to_owned(), |ms| ms.count.to_string()),
            tracking: system.health.tracking,
            degraded: system.health.degraded,
            lost: system.health.lost,
        }
    }
}

/// Seconds since the run began.
struct Clock {
    zero: Time,
    end_s: f64,
}

impl Clock {
    fn of(input: &ReportInput) -> Self {
        let stamps = || {
            let paths = input.systems.iter().map(|system| &system.trajectory);
            std::iter::once(&input.reference).chain(paths).flat_map(|path| path.poses())
        };
        let reference = input.reference.poses().first().map(|(stamp, _)| *stamp);
        let zero = reference.or_else(|| stamps().map(|(stamp, _)| *stamp).min()).unwrap_or_default();
        let last = stamps().map(|(stamp, _)| *stamp).max().unwrap_or(zero);
        Clock { zero, end_s: (last - zero).seconds() }
    }

    fn seconds(&self, stamp: Time) -> f64 {
        (stamp - self.zero).seconds()
    }
}

fn facts(input: &ReportInput) -> Vec<(&'static str, String)> {
    let mut facts = vec![
        ("Scenario", input.scenario.clone()),
        ("Seed", input.seed.to_string()),
        ("Driver", input.driver.clone()),
        ("Version", input.version.clone()),
    ];
    if let [(first, _), .., (last, _)] = input.reference.poses() {
        facts.push(("Duration", format!("{} s", text((*last - *first).seconds()))));
        facts.push(("Path", format!("{} m", text(input.reference.length_m()))));
    }
    if let Some(factor) = input.realtime_factor {
        facts.push(("Real-time factor", text(factor)));
    }
    facts.retain(|(_, value)| !value.is_empty());
    facts
}

fn time_panels(input: &ReportInput, clock: &Clock) -> Vec<Panel> {
    let marks: Vec<(f64, String)> = input
        .contacts
        .iter()
        .map(|event| (clock.seconds(event.stamp), event.text.clone()))
        .take(200)
        .collect();
    let subject = |title, unit, y_from| Subject {
        title,
        unit,
        x_label: "",
        x: (0.0, clock.end_s),
        y_from,
        marks: &marks,
    };
    let mut panels = Vec::new();
    let scored = || {
        input
            .systems
            .iter()
            .enumerate()
            .filter_map(|(rank, system)| Some((rank, system, system.score.as_ref()?)))
    };
    if scored().any(|(_, _, score)| !score.errors.is_empty()) {
        let curves: Vec<Curve> = scored()
            .map(|(rank, system, score)| Curve {
                name: system.name.clone(),
                rank: Some(rank),
                points: score
                    .errors
                    .iter()
                    .map(|error| (clock.seconds(error.stamp), error.position_m))
                    .collect(),
            })
            .collect();
        panels.push(Panel::of(&subject("Position error", "m", YFrom::Zero), &curves));
        let curves: Vec<Curve> = scored()
            .map(|(rank, system, score)| Curve {
                name: system.name.clone(),
                rank: Some(rank),
                points: score
                    .errors
                    .iter()
                    .filter_map(|error| Some((clock.seconds(error.stamp), error.heading_deg?)))
                    .collect(),
            })
            .filter(|curve| !curve.points.is_empty())
            .collect();
        if !curves.is_empty() {
            panels.push(Panel::of(&subject("Heading error", "deg", YFrom::Data), &curves));
        }
    }
    for lane in &input.lanes {
        let curve = Curve { name: lane.name.clone(), rank: None, points: lane.points.clone() };
        panels.push(Panel::of(&subject(&lane.name, &lane.unit, YFrom::Data), &[curve]));
    }
    if let Some(last) = panels.last_mut() {
        last.x_label = "time, s".to_owned();
    }
    for panel in &mut panels {
        panel.time_end_s = clock.end_s;
    }
    panels
}

fn distance_panels(input: &ReportInput) -> Vec<Panel> {
    let curves: Vec<Curve> = input
        .systems
        .iter()
        .enumerate()
        .filter_map(|(rank, system)| Some((rank, system, system.score.as_ref()?)))
        .map(|(rank, system, score)| Curve {
            name: system.name.clone(),
            rank: Some(rank),
            points: score.errors.iter().map(|error| (error.distance_m, error.position_m)).collect(),
        })
        .filter(|curve| !curve.points.is_empty())
        .collect();
    let end_m =
        curves.iter().filter_map(|curve| curve.points.last()).map(|point| point.0).fold(0.0, f64::max);
    if curves.is_empty() {
        return Vec::new();
    }
    let subject = Subject {
        title: "Position error",
        unit: "m",
        x_label: "distance walked, m",
        x: (0.0, end_m),
        y_from: YFrom::Zero,
        marks: &[],
    };
    vec![Panel::of(&subject, &curves)]
}
