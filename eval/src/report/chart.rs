//! Line charts whose plot stretches with the page while their labels keep their size.
//!
//! The plot is a drawing of 1000 x 200 units stretched to its box; ticks are percentages that the page places as text.

use super::number::{Axis, text};
use serde::Serialize;

const WIDTH: f64 = 1000.0;
const HEIGHT: f64 = 200.0;
/// Columns to which a line is thinned; each keeps its lowest and its highest point.
const COLUMNS: usize = 600;

/// A chart, ready for the template.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Panel {
    pub(super) title: String,
    pub(super) unit: String,
    pub(super) lines: Vec<PanelLine>,
    pub(super) x_ticks: Vec<Tick>,
    pub(super) y_ticks: Vec<Tick>,
    /// Label of the x axis; empty for a chart that stands on another with the same axis.
    pub(super) x_label: String,
    pub(super) marks: Vec<Tick>,
    /// The chart in a sentence, for those who do not see it.
    pub(super) summary: String,
    /// Last value of the x axis, for the time slider; 0 when x is no time.
    pub(super) time_end_s: f64,
}

/// One line of a chart.
#[derive(Debug, Clone, Serialize)]
pub(super) struct PanelLine {
    pub(super) name: String,
    /// Color: `s0` to `s5` by the rank of the system, `lane` for what belongs to none.
    pub(super) class: String,
    pub(super) path: String,
}

/// A place along an axis, percent of its length, and what to write there.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Tick {
    pub(super) percent: f64,
    pub(super) label: String,
}

/// A named run of points, x increasing; values that are not finite leave a gap.
pub(super) struct Curve {
    pub(super) name: String,
    /// Place of the system in the report; `None` for what belongs to none.
    pub(super) rank: Option<usize>,
    pub(super) points: Vec<(f64, f64)>,
}

/// What a chart is about.
pub(super) struct Subject<'a> {
    pub(super) title: &'a str,
    pub(super) unit: &'a str,
    pub(super) x_label: &'a str,
    /// Both ends of the x axis.
    pub(super) x: (f64, f64),
    /// Whether y begins at zero: right for an error, wrong for a lane that swings.
    pub(super) y_from: YFrom,
    pub(super) marks: &'a [(f64, String)],
}

/// Where the y axis begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum YFrom {
    Zero,
    Data,
}

impl Panel {
    pub(super) fn of(subject: &Subject<'_>, curves: &[Curve]) -> Self {
        let values =
            || curves.iter().flat_map(|curve| &curve.points).map(|point| point.1).filter(|y| y.is_finite());
        let lowest = values().fold(f64::INFINITY, f64::min);
        let highest = values().fold(f64::NEG_INFINITY, f64::max);
        let low = if subject.y_from == YFrom::Zero { lowest.min(0.0) } else { lowest };
        let decades = if subject.y_from == YFrom::Zero { decades(curves) } else { None };
        let y = decades.unwrap_or_else(|| Axis::covering(low, highest, 3));
        let x = Axis::exactly(subject.x.0, subject.x.1, 8);
        let line = |curve: &Curve| PanelLine {
            name: curve.name.clone(),
            class: curve.rank.map_or_else(|| "lane".to_owned(), |rank| format!("s{}", rank % 6)),
            path: path(&thinned(&curve.points, &x), &x, &y),
        };
        Panel {
            title: subject.title.to_owned(),
            unit: format!("{}{}", subject.unit, if decades.is_some() { ", logarithmic" } else { "" }),
            lines: curves.iter().map(line).collect(),
            x_ticks: ticks(&x),
            y_ticks: ticks(&y),
            x_label: subject.x_label.to_owned(),
            marks: subject
                .marks
                .iter()
                .map(|(at, label)| Tick { percent: percent(x.share(*at)), label: label.clone() })
                .filter(|mark| (0.0..=100.0).contains(&mark.percent))
                .collect(),
            summary: summary(subject, curves),
            time_end_s: 0.0,
        }
    }
}

/// A logarithmic axis, when one system is so much better than another that a linear axis would flatten it: one decade
/// between their medians. It reaches down to a tenth of the smallest median.
fn decades(curves: &[Curve]) -> Option<Axis> {
    let medians = curves.iter().filter_map(|curve| {
        let mut values: Vec<f64> =
            curve.points.iter().map(|point| point.1).filter(|y| y.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    });
    let (low, high) = medians.fold((f64::INFINITY, 0.0), |(low, high), y| (y.min(low), y.max(high)));
    let points = curves.iter().flat_map(|curve| &curve.points);
    let top = points.map(|point| point.1).filter(|y| y.is_finite()).fold(high, f64::max);
    (low > 0.0 && high > 10.0 * low).then(|| Axis::decades((low / 10.0).max(top * 1e-6), top))
}

fn summary(subject: &Subject<'_>, curves: &[Curve]) -> String {
    let range = |curve: &Curve| {
        let values = || curve.points.iter().map(|point| point.1).filter(|y| y.is_finite());
        let (low, high) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        if low > high {
            return format!("{}: no values", curve.name);
        }
        format!("{}: {} to {} {}", curve.name, text(low), text(high), subject.unit)
    };
    let ranges: Vec<String> = curves.iter().map(range).collect();
    format!("{}. {}. {} marks.", subject.title, ranges.join("; "), subject.marks.len())
}

fn ticks(axis: &Axis) -> Vec<Tick> {
    axis.ticks().into_iter().map(|(share, label)| Tick { percent: percent(share), label }).collect()
}

fn percent(share: f64) -> f64 {
    (share * 1e4).round() / 1e2
}

/// The lowest and the highest point of each column, in order of x: peaks survive.
fn thinned(points: &[(f64, f64)], x: &Axis) -> Vec<(f64, f64)> {
    if points.len() <= 2 * COLUMNS {
        return points.to_vec();
    }
    let column = |point: &(f64, f64)| (x.share(point.0) * COLUMNS as f64).floor() as i64;
    let mut kept = Vec::with_capacity(2 * COLUMNS);
    for group in points.chunk_by(|a, b| column(a) == column(b) && a.1.is_finite() == b.1.is_finite()) {
        let lowest = group.iter().enumerate().min_by(|a, b| a.1.1.total_cmp(&b.1.1)).map(|(index, _)| index);
        let highest = group.iter().enumerate().max_by(|a, b| a.1.1.total_cmp(&b.1.1)).map(|(index, _)| index);
        if let (Some(lowest), Some(highest)) = (lowest, highest) {
            kept.push(group[lowest.min(highest)]);
            if lowest != highest {
                kept.push(group[lowest.max(highest)]);
            }
        }
    }
    kept
}

fn path(points: &[(f64, f64)], x: &Axis, y: &Axis) -> String {
    let mut path = String::new();
    let mut pen_down = false;
    for point in points {
        if !(point.0.is_finite() && point.1.is_finite()) {
            pen_down = false;
            continue;
        }
        let (right, down) = (WIDTH * x.share(point.0), HEIGHT * (1.0 - y.share(point.1)));
        path.push_str(&format!("{}{right:.1} {down:.1}", if pen_down { 'L' } else { 'M' }));
        pen_down = true;
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(points: Vec<(f64, f64)>) -> Panel {
        let subject =
            Subject { title: "t", unit: "m", x_label: "", x: (0.0, 100.0), y_from: YFrom::Zero, marks: &[] };
        Panel::of(&subject, &[Curve { name: "a".to_owned(), rank: None, points }])
    }

    #[test]
    fn thinning_keeps_the_peaks_and_bounds_the_size() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|n| (f64::from(n) * 1e-3, 1.0)).collect();
        points[77_777].1 = 10.0;
        let panel = panel(points);
        assert!(panel.lines[0].path.len() < 2 * 14 * (COLUMNS + 2));
        // The peak touches the top of the drawing.
        assert!(panel.lines[0].path.contains(" 0.0"));
        assert!(panel.summary.contains("1.00 to 10.0 m"), "{}", panel.summary);
    }

    #[test]
    fn a_value_that_is_not_finite_lifts_the_pen() {
        let path = &panel(vec![(0.0, 0.0), (1.0, 1.0), (2.0, f64::NAN), (3.0, 1.0)]).lines[0].path;
        assert_eq!(path.matches('M').count(), 2, "{path}");
        assert!(!path.contains("NaN"));
    }

    #[test]
    fn a_chart_without_points_is_an_empty_chart() {
        let panel = panel(Vec::new());
        assert_eq!(panel.lines[0].path, "");
        assert!(panel.summary.contains("no values"));
    }
}
