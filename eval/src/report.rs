//! One run as one page: a self-contained HTML file that needs no network, for a desk, a phone and a screen reader.
//!
//! Numbers and paths are made here and in `report/`; all markup stands in `assets/report.html.j2`, where the template
//! engine escapes every text.

mod chart;
mod map_view;
mod number;
mod page;
mod table;
mod top_view;

use crate::map::MapScore;
use crate::paper::{PublishedMapRow, PublishedRow};
use crate::score::Score;
use crate::stats::Stats;
use arborloop_base::{Cell, Class, Grid, Pose2, Time, Trajectory};
use minijinja::{AutoEscape, Environment, value::Serde};

/// Everything that a page says. [`Default`] is an empty run, and every part may stay empty.
///
/// Frames: `reference` and `contacts` are in the reference's frame; `truth_map` and `landmarks` in the frame of the
/// truth, which `reference_from_truth` carries into the reference's; each system's map and trajectory in its own.
#[derive(Debug, Clone, Default)]
pub struct ReportInput {
    /// Heading of the page.
    pub title: String,
    /// Whether the run met what was expected of it.
    pub verdict: Verdict,
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of the run.
    pub seed: u64,
    /// Who drove: `truth`, a system's name or `replay`.
    pub driver: String,
    /// Version of the program.
    pub version: String,
    /// Name and value of each hash, for instance of the scenario and of the content.
    pub hashes: Vec<(String, String)>,
    /// Commands that make this run again, one line each.
    pub reproduce: Vec<String>,
    /// Commands that check the numbers with other tools (evo, kiss-icp), one line each.
    pub check: Vec<String>,
    /// The systems under test, in the order in which they are to be shown.
    pub systems: Vec<SystemReport>,
    /// The true path.
    pub reference: Trajectory,
    /// What is really there.
    pub truth_map: Option<Grid<Cell>>,
    /// Carries the frame of `truth_map` and `landmarks` into the reference's.
    pub reference_from_truth: Pose2,
    /// Objects to draw in the top view.
    pub landmarks: Vec<Landmark>,
    /// Moments at which the robot touched something.
    pub contacts: Vec<Event>,
    /// Other quantities over time, drawn below the errors.
    pub lanes: Vec<Lane>,
    /// What was asked and what was found.
    pub expectations: Vec<Expectation>,
    /// Rows of the paper to print beside ours.
    pub published: Vec<PublishedRow>,
    /// Map row of the paper to print beside ours.
    pub published_map: Option<PublishedMapRow>,
    /// Simulated seconds per second of computing; `None` when it was not measured.
    pub realtime_factor: Option<f64>,
    /// Path and purpose of each file of the run.
    pub files: Vec<(String, String)>,
}

/// The answer that stands first.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Verdict {
    /// Whether everything expected was met.
    pub passed: bool,
    /// Why, one sentence each.
    pub lines: Vec<String>,
}

/// What one system did.
#[derive(Debug, Clone, Default)]
pub struct SystemReport {
    /// Its name.
    pub name: String,
    /// Its score; `None` when there is none, for the reason in `no_score`.
    pub score: Option<Score>,
    /// Why there is no score.
    pub no_score: Option<String>,
    /// The score of its map.
    pub map_score: Option<MapScore>,
    /// Its map, in its own map frame.
    pub map: Option<Grid<Cell>>,
    /// Carries its map frame into the frame of the true map.
    pub truth_from_map: Pose2,
    /// Its estimates as said at the time, in its own map frame; drawn through the score's alignment.
    pub trajectory: Trajectory,
    /// Computing time per sweep, milliseconds.
    pub cpu_ms_per_sweep: Option<Stats>,
    /// How often it said that it knew where it was.
    pub health: HealthCounts,
}

/// Number of estimates by the health that came with them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct HealthCounts {
    /// The match was good.
    pub tracking: u64,
    /// The pose leaned on prediction.
    pub degraded: u64,
    /// The pose was not to be used.
    pub lost: u64,
}

/// Something round that stands in the field.
#[derive(Debug, Clone, PartialEq)]
pub struct Landmark {
    /// What it is.
    pub class: Class,
    /// Its name, for the pointer's tip.
    pub label: String,
    /// East of the truth's origin, meters.
    pub x_m: f64,
    /// North of the truth's origin, meters.
    pub y_m: f64,
    /// Radius, meters.
    pub radius_m: f64,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// When.
    pub stamp: Time,
    /// What.
    pub text: String,
}

/// A quantity over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Lane {
    /// What it is.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Seconds since the first reference pose, and value; values that are not finite leave a gap.
    pub points: Vec<(f64, f64)>,
}

/// Something asked of a system.
#[derive(Debug, Clone, PartialEq)]
pub struct Expectation {
    /// Of whom; empty for the run as a whole.
    pub system: String,
    /// Which number, as the written metrics name it, for instance `position_mean_m`.
    pub metric: String,
    /// What was found; `None` is not available, and never passes.
    pub found: Option<f64>,
    /// What was wanted, for instance `<= 0.05`.
    pub limit: String,
    /// Whether it was met.
    pub passed: bool,
}

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The template and the values do not go together: a mistake of ours, or text that cannot be written.
    #[error("the report's template could not be filled: {0}")]
    Template(#[from] minijinja::Error),
}

const TEMPLATE: &str = include_str!("../assets/report.html.j2");

/// Makes the page. The same input gives the same bytes.
///
/// # Errors
/// [`ReportError::Template`] when the template cannot be filled.
pub fn render(input: &ReportInput) -> Result<String, ReportError> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_template("report.html", TEMPLATE)?;
    Ok(environment.get_template("report.html")?.render(Serde(page::Page::of(input)))?)
}

#[cfg(test)]
mod tests;
