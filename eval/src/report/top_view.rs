//! The field from above: what stands there, where the robot was, and where a system believed it to be.

use super::number::{nice_at_least, short, text};
use super::{ReportInput, SystemReport};
use arborloop_base::{Class, Pose, Time};
use nalgebra::{Point2, Vector2};
use serde::Serialize;
use std::collections::BTreeMap;

/// Points to which a path is thinned, at most.
const POINTS_MAX: usize = 3000;
/// Samples of the time slider.
const TRACK_MAX: usize = 600;
/// Error colors, from small to large.
const BINS: usize = 4;

/// One top view, ready for the template. Coordinates are meters of the reference's frame, y turned downward.
#[derive(Debug, Clone, Serialize)]
pub(super) struct TopView {
    pub(super) name: String,
    pub(super) view_box: String,
    /// Width over height.
    pub(super) aspect: f64,
    pub(super) grid: String,
    pub(super) grid_m: String,
    pub(super) truth: String,
    pub(super) runs: Vec<Run>,
    pub(super) legend: Vec<(usize, String)>,
    pub(super) discs: Vec<Disc>,
    pub(super) classes: Vec<&'static str>,
    pub(super) contacts: Vec<Disc>,
    pub(super) start: Option<(f64, f64)>,
    /// Radius of marks, meters.
    pub(super) mark_m: f64,
    pub(super) bar_percent: f64,
    pub(super) bar_label: String,
    /// `time true_x true_y x y` for some instants, separated by `;`, for the slider.
    pub(super) track: String,
    pub(super) summary: String,
}

/// A piece of the estimated path whose error falls into one bin; the last bin is "not compared".
#[derive(Debug, Clone, Serialize)]
pub(super) struct Run {
    pub(super) bin: usize,
    pub(super) path: String,
}

/// Something round.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Disc {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) r: f64,
    pub(super) class: &'static str,
    pub(super) label: String,
}

/// A point of an estimated path.
struct Station {
    stamp: Time,
    at: Point2<f64>,
    error_m: Option<f64>,
}

impl TopView {
    /// One view for each system that said where it was, all of the same piece of ground; the true path alone when
    /// none did; nothing without any path.
    pub(super) fn all(input: &ReportInput) -> Vec<Self> {
        let truth: Vec<Point2<f64>> = input.reference.poses().iter().map(|(_, pose)| ground(pose)).collect();
        let drawn: Vec<(&SystemReport, Vec<Station>)> = input
            .systems
            .iter()
            .map(|system| (system, stations(system)))
            .filter(|(_, stations)| !stations.is_empty())
            .collect();
        let frame = Frame::around(&truth, drawn.iter().flat_map(|(_, stations)| stations));
        if drawn.is_empty() && !truth.is_empty() {
            return vec![TopView::of(input, "true path", &truth, &[], &frame)];
        }
        drawn
            .iter()
            .map(|(system, stations)| TopView::of(input, &system.name, &truth, stations, &frame))
            .collect()
    }

    fn of(
        input: &ReportInput,
        name: &str,
        truth: &[Point2<f64>],
        stations: &[Station],
        frame: &Frame,
    ) -> Self {
        let error_max_m = stations.iter().filter_map(|station| station.error_m).fold(0.0, f64::max);
        let bin_m = nice_at_least(error_max_m.max(1e-3) / BINS as f64);
        let discs = discs(input, frame);
        let mut classes: Vec<&'static str> = discs.iter().map(|disc| disc.class).collect();
        classes.sort_unstable();
        classes.dedup();
        let worst = if stations.is_empty() {
            String::new()
        } else {
            format!(", largest error {} m", text(error_max_m))
        };
        TopView {
            summary: format!(
                "Top view of {name}: true path of {} m, {} objects, {} contacts{worst}.",
                text(input.reference.length_m()),
                discs.len(),
                input.contacts.len(),
            ),
            name: name.to_owned(),
            view_box: frame.view_box(),
            aspect: frame.size.x / frame.size.y,
            grid: frame.grid(),
            grid_m: short(frame.grid_m),
            truth: frame.path(&thinned(truth)),
            runs: runs(stations, bin_m, frame),
            legend: if stations.is_empty() { Vec::new() } else { legend(bin_m) },
            contacts: contacts(input, frame),
            discs,
            classes,
            start: truth.first().map(|at| frame.place(at)),
            mark_m: frame.mark_m(),
            bar_percent: (1e4 * frame.grid_m / frame.size.x).round() / 100.0,
            bar_label: format!("{} m", short(frame.grid_m)),
            track: track(input, stations, frame),
        }
    }
}

fn stations(system: &SystemReport) -> Vec<Station> {
    let aligned = system.score.as_ref().map_or_else(Pose::identity, |score| score.reference_from_estimate);
    let errors: BTreeMap<Time, f64> = system
        .score
        .iter()
        .flat_map(|score| &score.errors)
        .map(|error| (error.stamp, error.position_m))
        .collect();
    let station = |(stamp, pose): &(Time, Pose)| Station {
        stamp: *stamp,
        at: ground(&(aligned * pose)),
        error_m: errors.get(stamp).copied(),
    };
    system.trajectory.poses().iter().map(station).collect()
}

fn ground(pose: &Pose) -> Point2<f64> {
    Point2::new(pose.translation.x, pose.translation.y)
}

/// What part of the ground is drawn: around the paths, with a margin; an estimate gone astray does not shrink the rest.
struct Frame {
    low: Point2<f64>,
    size: Vector2<f64>,
    grid_m: f64,
}

impl Frame {
    fn around<'a>(truth: &[Point2<f64>], stations: impl Iterator<Item = &'a Station>) -> Self {
        let inside = bounds(truth.iter().copied());
        let all = bounds(truth.iter().copied().chain(stations.map(|station| station.at)));
        let (low, high) = match (inside, all) {
            (Some((low, high)), Some((all_low, all_high))) => {
                let reach = Vector2::repeat((high - low).max().max(4.0) / 2.0);
                (all_low.sup(&(low - reach)), all_high.inf(&(high + reach)))
            }
            (None, Some((low, high))) => (low, high),
            _ => (Point2::new(-1.0, -1.0), Point2::new(1.0, 1.0)),
        };
        let margin = Vector2::repeat(((high - low).max() * 0.12).max(1.5));
        let (low, size) = (low - margin, high - low + 2.0 * margin);
        Frame { low, size, grid_m: nice_at_least(size.max() / 10.0) }
    }

    /// Coordinates in the drawing: meters, y downward, a two-thousandth of the view or finer.
    fn place(&self, at: &Point2<f64>) -> (f64, f64) {
        let unit = 10_f64.powf((self.size.max() / 2000.0).log10().floor());
        let round = |value: f64| ((value / unit).round() * unit * 1e6).round() / 1e6;
        (round(at.x - self.low.x), round(self.low.y + self.size.y - at.y))
    }

    fn holds(&self, at: &Point2<f64>) -> bool {
        let inside = at - self.low;
        inside.x >= 0.0 && inside.y >= 0.0 && inside.x <= self.size.x && inside.y <= self.size.y
    }

    fn mark_m(&self) -> f64 {
        self.size.max() * 0.008
    }

    fn view_box(&self) -> String {
        format!("0 0 {:.3} {:.3}", self.size.x, self.size.y)
    }

    fn path(&self, points: &[Point2<f64>]) -> String {
        let mut path = String::new();
        for (index, point) in points.iter().enumerate() {
            let (x, y) = self.place(point);
            path.push_str(&format!("{}{x} {y}", if index == 0 { 'M' } else { 'L' }));
        }
        path
    }

    fn grid(&self) -> String {
        let mut path = String::new();
        let lines = |low: f64, size: f64| {
            let first = (low / self.grid_m).ceil() as i64;
            (first..first + 200).map(move |n| n as f64 * self.grid_m - low).take_while(move |at| *at <= size)
        };
        for x in lines(self.low.x, self.size.x) {
            path.push_str(&format!("M{x:.3} 0V{:.3}", self.size.y));
        }
        for y in lines(self.low.y, self.size.y) {
            path.push_str(&format!("M0 {:.3}H{:.3}", self.size.y - y, self.size.x));
        }
        path
    }
}

fn bounds(points: impl Iterator<Item = Point2<f64>>) -> Option<(Point2<f64>, Point2<f64>)> {
    points.fold(None, |found, at| match found {
        Some((low, high)) => Some((at.inf(&low), at.sup(&high))),
        None => Some((at, at)),
    })
}

fn thinned(points: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let step = points.len().div_ceil(POINTS_MAX).max(1);
    points
        .iter()
        .enumerate()
        .filter(|(n, _)| n % step == 0 || n + 1 == points.len())
        .map(|(_, at)| *at)
        .collect()
}

fn runs(stations: &[Station], bin_m: f64, frame: &Frame) -> Vec<Run> {
    let step = stations.len().div_ceil(POINTS_MAX).max(1);
    let kept: Vec<&Station> = stations.iter().step_by(step).collect();
    let bin = |station: &Station| match station.error_m {
        Some(error_m) => ((error_m / bin_m).floor() as usize).min(BINS - 1),
        None => BINS,
    };
    let mut runs: Vec<(usize, Vec<Point2<f64>>)> = Vec::new();
    for station in kept {
        let (this, at) = (bin(station), station.at);
        match runs.last_mut() {
            Some((last, points)) if *last == this => points.push(at),
            Some((_, points)) => {
                // Pieces share a point, so that no gap shows.
                let joint = points.last().copied().unwrap_or(at);
                runs.push((this, vec![joint, at]));
            }
            None => runs.push((this, vec![at])),
        }
    }
    runs.into_iter().map(|(bin, points)| Run { bin, path: frame.path(&points) }).collect()
}

fn legend(bin_m: f64) -> Vec<(usize, String)> {
    let edge = |n: usize| short(bin_m * n as f64);
    (0..BINS)
        .map(|n| match n {
            0 => (0, format!("below {} m", edge(1))),
            n if n + 1 == BINS => (n, format!("{} m and more", edge(n))),
            n => (n, format!("to {} m", edge(n + 1))),
        })
        .collect()
}

fn discs(input: &ReportInput, frame: &Frame) -> Vec<Disc> {
    let least_m = frame.mark_m() * 0.5;
    input
        .landmarks
        .iter()
        .filter_map(|landmark| {
            let at = input.reference_from_truth * Point2::new(landmark.x_m, landmark.y_m);
            let (x, y) = frame.place(&at);
            let disc = Disc {
                x,
                y,
                r: (landmark.radius_m.max(least_m) * 1e3).round() / 1e3,
                class: class_name(landmark.class),
                label: landmark.label.clone(),
            };
            (frame.holds(&at) && landmark.radius_m.is_finite()).then_some(disc)
        })
        .collect()
}

fn class_name(class: Class) -> &'static str {
    match class {
        Class::Sky => "sky",
        Class::Ground => "ground",
        Class::Grass => "grass",
        Class::Trunk => "trunk",
        Class::Branch => "branch",
        Class::Leaf => "leaf",
        Class::Cone => "cone",
        Class::Post => "post",
        Class::Wire => "wire",
        Class::Robot => "robot",
        Class::Weather => "weather",
    }
}

fn contacts(input: &ReportInput, frame: &Frame) -> Vec<Disc> {
    let contact = |event: &super::Event| {
        let at = ground(&input.reference.at(event.stamp)?);
        let (x, y) = frame.place(&at);
        Some(Disc { x, y, r: frame.mark_m(), class: "contact", label: event.text.clone() })
    };
    input.contacts.iter().filter_map(contact).take(200).collect()
}

fn track(input: &ReportInput, stations: &[Station], frame: &Frame) -> String {
    let Some((zero, _)) = input.reference.poses().first() else { return String::new() };
    let step = stations.len().div_ceil(TRACK_MAX).max(1);
    let samples = stations.iter().step_by(step).filter_map(|station| {
        let truth = frame.place(&ground(&input.reference.at(station.stamp)?));
        let estimate = frame.place(&station.at);
        let time_s = (station.stamp - *zero).seconds();
        Some(format!("{time_s:.1} {} {} {} {}", truth.0, truth.1, estimate.0, estimate.1))
    });
    samples.collect::<Vec<_>>().join(";")
}
