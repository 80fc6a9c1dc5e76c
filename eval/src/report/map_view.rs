//! A drawn map over the true one, colored by what the comparison says of each cell.

use super::number::{nice_at_least, short, text_or};
use super::{ReportInput, SystemReport};
use crate::map::{CellVerdict, MapScoreSettings, compare_maps};
use arborloop_base::{Cell, Grid};
use serde::Serialize;

/// Longest side of the drawing, in drawn cells: a finer map is drawn coarser, the more telling verdict kept.
const SIDE_MAX: usize = 420;

/// One map, ready for the template. Coordinates are drawn cells of the map's own raster, y turned downward.
#[derive(Debug, Clone, Serialize)]
pub(super) struct MapView {
    pub(super) name: String,
    pub(super) view_box: String,
    pub(super) aspect: f64,
    pub(super) layers: Vec<Layer>,
    pub(super) route: String,
    pub(super) bar_percent: f64,
    pub(super) bar_label: String,
    /// Why there is no comparison, if so.
    pub(super) note: Option<String>,
    pub(super) summary: String,
}

/// All cells of one verdict.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Layer {
    pub(super) class: &'static str,
    pub(super) label: &'static str,
    pub(super) path: String,
}

/// What a cell is drawn as, the more telling the larger: when cells are drawn together the largest wins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
enum Ink {
    #[default]
    Blank,
    Free,
    Unseen,
    Right,
    Drawn,
    Missed,
    Wrong,
}

impl MapView {
    /// The view of one system's map; `None` when it drew none.
    pub(super) fn of(input: &ReportInput, system: &SystemReport) -> Option<Self> {
        let map = system.map.as_ref()?;
        let (inks, note) = inks(input, system, map);
        let crop = Crop::around(&inks)?;
        let resolution_m = map.resolution_m();
        let width_m = crop.columns as f64 * crop.block as f64 * resolution_m;
        let bar_m = nice_at_least(width_m / 8.0);
        let numbers = system.map_score.map_or_else(String::new, |score| {
            let (f1, ppv, tpr) =
                (text_or(score.f1_ratio), text_or(score.ppv_ratio), text_or(score.tpr_ratio));
            format!(" F1 {f1}, precision {ppv}, sensitivity {tpr}.")
        });
        Some(MapView {
            name: system.name.clone(),
            view_box: format!("0 0 {} {}", crop.columns, crop.rows),
            aspect: crop.columns as f64 / crop.rows as f64,
            layers: layers(&inks, &crop, input.truth_map.is_some() && note.is_none()),
            route: route(system, map, &crop),
            bar_percent: (1e4 * bar_m / width_m).round() / 100.0,
            bar_label: format!("{} m", short(bar_m)),
            note,
            summary: format!("Map of {} over the true map.{numbers}", system.name),
        })
    }
}

fn inks(input: &ReportInput, system: &SystemReport, map: &Grid<Cell>) -> (Grid<Ink>, Option<String>) {
    let settings = system
        .map_score
        .map_or_else(MapScoreSettings::default, |score| MapScoreSettings { tolerance_m: score.tolerance_m });
    let compared =
        input.truth_map.as_ref().map(|truth| compare_maps(truth, map, &system.truth_from_map, settings));
    let mut inks = Grid::filled(map.origin(), map.resolution_m(), map.columns(), map.rows(), Ink::Blank);
    let note = match compared {
        Some(Ok((_, verdicts))) => {
            for (ink, (verdict, cell)) in
                inks.cells_mut().iter_mut().zip(verdicts.cells().iter().zip(map.cells()))
            {
                *ink = match (verdict, cell) {
                    (CellVerdict::TruePositive, _) => Ink::Right,
                    (CellVerdict::FalsePositive, _) => Ink::Wrong,
                    (CellVerdict::FalseNegative, _) => Ink::Missed,
                    (CellVerdict::UnseenSurface, _) => Ink::Unseen,
                    (_, Cell::Free) => Ink::Free,
                    _ => Ink::Blank,
                };
            }
            return (inks, None);
        }
        Some(Err(error)) => Some(error.to_string()),
        None => None,
    };
    for (ink, cell) in inks.cells_mut().iter_mut().zip(map.cells()) {
        *ink = match cell {
            Cell::Unknown => Ink::Blank,
            Cell::Free => Ink::Free,
            Cell::Occupied => Ink::Drawn,
        };
    }
    (inks, note)
}

/// The part of the raster that holds any ink, and how many cells a side are drawn as one.
struct Crop {
    column: usize,
    row: usize,
    columns: usize,
    rows: usize,
    block: usize,
}

impl Crop {
    fn around(inks: &Grid<Ink>) -> Option<Self> {
        let inked = inks.cells().iter().enumerate().filter(|(_, ink)| **ink != Ink::Blank);
        let places = inked.map(|(index, _)| (index % inks.columns(), index / inks.columns()));
        let (low, high) =
            places.fold(None, |found: Option<((usize, usize), (usize, usize))>, (column, row)| {
                let (low, high) = found.unwrap_or(((column, row), (column, row)));
                Some(((low.0.min(column), low.1.min(row)), (high.0.max(column), high.1.max(row))))
            })?;
        let (wide, high) = (high.0 - low.0 + 1, high.1 - low.1 + 1);
        let block = wide.max(high).div_ceil(SIDE_MAX);
        Some(Crop {
            column: low.0,
            row: low.1,
            columns: wide.div_ceil(block),
            rows: high.div_ceil(block),
            block,
        })
    }

    /// The most telling ink of a drawn cell; rows count from the top.
    fn ink(&self, inks: &Grid<Ink>, column: usize, row_from_top: usize) -> Ink {
        let row = self.rows - 1 - row_from_top;
        let within = |block: usize, low: usize| low + block * self.block..low + (block + 1) * self.block;
        within(row, self.row)
            .flat_map(|row| within(column, self.column).map(move |column| (column, row)))
            .filter_map(|(column, row)| inks.get(column, row))
            .copied()
            .max()
            .unwrap_or_default()
    }
}

fn layers(inks: &Grid<Ink>, crop: &Crop, compared: bool) -> Vec<Layer> {
    let kinds: &[(Ink, &str, &str)] = if compared {
        &[
            (Ink::Free, "free", "seen free"),
            (Ink::Unseen, "unseen", "true surface, unseen"),
            (Ink::Right, "right", "drawn and there"),
            (Ink::Wrong, "wrong", "drawn, not there"),
            (Ink::Missed, "missed", "there, drawn free"),
        ]
    } else {
        &[(Ink::Free, "free", "seen free"), (Ink::Drawn, "right", "drawn")]
    };
    let mut paths = vec![String::new(); kinds.len()];
    for row in 0..crop.rows {
        let line: Vec<Ink> = (0..crop.columns).map(|column| crop.ink(inks, column, row)).collect();
        let mut column = 0;
        for run in line.chunk_by(|a, b| a == b) {
            if let Some(kind) = kinds.iter().position(|(ink, ..)| *ink == run[0]) {
                paths[kind].push_str(&format!("M{column} {row}h{0}v1h-{0}z", run.len()));
            }
            column += run.len();
        }
    }
    kinds.iter().zip(paths).map(|((_, class, label), path)| Layer { class, label, path }).collect()
}

fn route(system: &SystemReport, map: &Grid<Cell>, crop: &Crop) -> String {
    let step = system.trajectory.len().div_ceil(1500).max(1);
    let cell_m = map.resolution_m() * crop.block as f64;
    let left_m = map.origin().x + crop.column as f64 * map.resolution_m();
    let bottom_m = map.origin().y + crop.row as f64 * map.resolution_m();
    let mut path = String::new();
    for (index, (_, pose)) in system.trajectory.poses().iter().step_by(step).enumerate() {
        let x = (pose.translation.x - left_m) / cell_m;
        let y = crop.rows as f64 - (pose.translation.y - bottom_m) / cell_m;
        path.push_str(&format!("{}{x:.1} {y:.1}", if index == 0 { 'M' } else { 'L' }));
    }
    path
}
