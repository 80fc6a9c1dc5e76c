//! A drawn map against the true one: the paper's six numbers, with everything said that the paper leaves open.
//!
//! A lidar sees surfaces. Behind them, and where the robot never looked, the map is unknown, and unknown cells take no
//! part. What is asked: is what the map calls occupied really there, is what it calls free really free, and of the true
//! surfaces at which the map says anything, how many did it draw?

mod distance;
mod lattice;

use crate::score::ScoreError;
use arborloop_base::{Cell, Grid, Pose2};
use lattice::Lattice;
use serde::{Deserialize, Serialize};

/// How to compare two maps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MapScoreSettings {
    /// Largest distance between the centers of two cells that still count as the same place, meters.
    pub tolerance_m: f64,
}

impl Default for MapScoreSettings {
    /// 0.1 m: two of the 5 cm cells that maps of orchards commonly have.
    fn default() -> Self {
        MapScoreSettings { tolerance_m: 0.1 }
    }
}

/// What the comparison says of one cell of the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum CellVerdict {
    /// Takes no part: never seen, outside the true map, inside a true object, or free on a true surface drawn near by.
    #[default]
    Silent,
    /// Drawn free, truly not occupied.
    TrueFree,
    /// Drawn occupied, with a true object within the tolerance.
    TruePositive,
    /// Drawn occupied, with nothing true within the tolerance.
    FalsePositive,
    /// Drawn free on a true surface, with nothing drawn within the tolerance.
    FalseNegative,
    /// A true surface at which the drawn map says nothing; takes no part, shown for orientation.
    UnseenSurface,
}

/// The paper's map rows (its table 2) with the counts behind them. All counts are in cells of the drawn map.
///
/// The true map is laid on the drawn map's raster. A cell takes part when the drawn map calls it free or occupied and
/// the true map knows it. A true surface cell is an occupied one with a free neighbor: the inside of a trunk is hidden
/// from any lidar and asks nothing of the map. "Near" means within the tolerance, center to center, measured by an
/// exact Euclidean distance transform.
///
/// - `true_positive_cells`: drawn occupied, a true occupied cell near. `false_positive_cells`: drawn occupied, none near.
/// - `true_negative_cells`: drawn free, not truly occupied.
/// - `found_surface_cells`: true surface cells with a drawn occupied cell near. `false_negative_cells`: true surface
///   cells drawn free with none near. `unseen_surface_cells`: the rest, unknown to the drawn map, which take no part
///   (the far side of a trunk, a row never visited); read them beside TPR.
/// - PPV = TP / (TP + FP). TPR = found / (found + FN), counted on the true side, so that a thick wall is no more
///   sensitive than a thin one. TNR = TN / (TN + FP). Accuracy = (TP + TN) / (TP + TN + FP + FN).
///   F1 = 2 PPV TPR / (PPV + TPR).
///
/// With nearly all cells empty, accuracy and TNR are near 1 for any map; PPV, TPR and F1 tell maps apart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MapScore {
    /// Mean distance from each drawn occupied cell to the nearest true occupied cell, in cells of the drawn map
    /// (outliers included, not capped); `None` when nothing is drawn where the truth is known.
    pub mean_map_error_cells: Option<f64>,
    /// The same in meters.
    pub mean_map_error_m: Option<f64>,
    /// Share of right answers among all, in [0, 1].
    pub accuracy_ratio: Option<f64>,
    /// Harmonic mean of PPV and TPR, in [0, 1]; `None` when either is.
    pub f1_ratio: Option<f64>,
    /// Precision, in [0, 1]; `None` when nothing is drawn occupied.
    pub ppv_ratio: Option<f64>,
    /// Sensitivity, in [0, 1]; `None` when the map says nothing at any true surface.
    pub tpr_ratio: Option<f64>,
    /// Specificity, in [0, 1]; `None` when nothing empty was judged.
    pub tnr_ratio: Option<f64>,
    /// The tolerance of the comparison, meters.
    pub tolerance_m: f64,
    /// Side of a cell of the drawn map, meters.
    pub resolution_m: f64,
    /// Drawn occupied with a true object near.
    pub true_positive_cells: u64,
    /// Drawn occupied with nothing near.
    pub false_positive_cells: u64,
    /// Drawn free and truly so.
    pub true_negative_cells: u64,
    /// True surface drawn free with nothing drawn near.
    pub false_negative_cells: u64,
    /// True surface with something drawn near.
    pub found_surface_cells: u64,
    /// True surface at which the drawn map says nothing.
    pub unseen_surface_cells: u64,
    /// Drawn cells, free or occupied, where the true map knows nothing; they take no part.
    pub outside_cells: u64,
}

/// Scores a drawn map against the true one; see [`MapScore`] for what every number means.
///
/// # Errors
/// [`ScoreError::EmptyTruth`], [`ScoreError::NoSharedCell`], [`ScoreError::RasterTooLarge`], and
/// [`ScoreError::Setting`] for a tolerance that is negative or not finite or a transform that is not finite.
pub fn score_map(
    truth: &Grid<Cell>,
    map: &Grid<Cell>,
    truth_from_map: &Pose2,
    settings: MapScoreSettings,
) -> Result<MapScore, ScoreError> {
    compare_maps(truth, map, truth_from_map, settings).map(|(score, _)| score)
}

/// As [`score_map`], with the verdict on each cell of the drawn map's raster, for drawing.
///
/// # Errors
/// As [`score_map`].
pub fn compare_maps(
    truth: &Grid<Cell>,
    map: &Grid<Cell>,
    truth_from_map: &Pose2,
    settings: MapScoreSettings,
) -> Result<(MapScore, Grid<CellVerdict>), ScoreError> {
    check(truth, truth_from_map, settings)?;
    let lattice = Lattice::of(truth, map, truth_from_map)?;
    let seen = map.cells().iter().filter(|cell| **cell != Cell::Unknown).count();
    let shared = lattice.map.iter().zip(&lattice.truth);
    if shared.filter(|(map, truth)| **map != Cell::Unknown && **truth != Cell::Unknown).count() == 0 {
        return Err(ScoreError::NoSharedCell { seen });
    }
    let judged = Judged::of(&lattice, map.resolution_m(), settings.tolerance_m);
    let mut verdicts =
        Grid::filled(map.origin(), map.resolution_m(), map.columns(), map.rows(), CellVerdict::Silent);
    for row in 0..map.rows() {
        let from = (row + lattice.map_at.1) * lattice.columns + lattice.map_at.0;
        verdicts.cells_mut()[row * map.columns()..][..map.columns()]
            .copy_from_slice(&judged.verdicts[from..from + map.columns()]);
    }
    Ok((judged.score(map.resolution_m(), settings.tolerance_m), verdicts))
}

fn check(truth: &Grid<Cell>, truth_from_map: &Pose2, settings: MapScoreSettings) -> Result<(), ScoreError> {
    if !(settings.tolerance_m.is_finite() && settings.tolerance_m >= 0.0) {
        let (found, wanted) = (settings.tolerance_m, "zero or more meters");
        return Err(ScoreError::Setting { name: "tolerance_m", found, wanted });
    }
    let numbers =
        [truth_from_map.translation.x, truth_from_map.translation.y, truth_from_map.rotation.angle()];
    if let Some(found) = numbers.into_iter().find(|number| !number.is_finite()) {
        return Err(ScoreError::Setting { name: "truth_from_map", found, wanted: "finite numbers" });
    }
    if !truth.cells().contains(&Cell::Occupied) {
        return Err(ScoreError::EmptyTruth { cells: truth.cells().len() });
    }
    Ok(())
}

/// The verdicts on every cell of the lattice, and the sums that they do not hold.
struct Judged {
    verdicts: Vec<CellVerdict>,
    error_sum_cells: f64,
    found_surface_cells: u64,
    unseen_surface_cells: u64,
    outside_cells: u64,
}

impl Judged {
    fn of(lattice: &Lattice, resolution_m: f64, tolerance_m: f64) -> Self {
        let truth_marks: Vec<bool> = lattice.truth.iter().map(|cell| *cell == Cell::Occupied).collect();
        let map_marks: Vec<bool> = lattice.map.iter().map(|cell| *cell == Cell::Occupied).collect();
        let to_truth = distance::squared_distances(&truth_marks, lattice.columns);
        let to_map = distance::squared_distances(&map_marks, lattice.columns);
        let cells_to = |field: &Option<Vec<u32>>, index: usize| {
            field.as_ref().map(|field| f64::from(field[index]).sqrt())
        };
        // A hair of slack, so that a tolerance of two cells does not lose cells exactly two away to rounding.
        let tolerance_cells = tolerance_m / resolution_m + 1e-9;
        let near =
            |field: &Option<Vec<u32>>, index| cells_to(field, index).is_some_and(|d| d <= tolerance_cells);

        let mut judged = Judged {
            verdicts: vec![CellVerdict::Silent; lattice.map.len()],
            error_sum_cells: 0.0,
            found_surface_cells: 0,
            unseen_surface_cells: 0,
            outside_cells: 0,
        };
        for index in 0..lattice.map.len() {
            let surface = lattice.is_surface(index);
            let (found, drawn) = (surface && near(&to_map, index), lattice.map[index]);
            judged.found_surface_cells += u64::from(found);
            judged.verdicts[index] = match (drawn, lattice.truth[index]) {
                (Cell::Unknown, _) if surface && !found => {
                    judged.unseen_surface_cells += 1;
                    CellVerdict::UnseenSurface
                }
                (Cell::Unknown, _) => CellVerdict::Silent,
                (_, Cell::Unknown) => {
                    judged.outside_cells += 1;
                    CellVerdict::Silent
                }
                (Cell::Occupied, _) => {
                    judged.error_sum_cells += cells_to(&to_truth, index).unwrap_or_default();
                    if near(&to_truth, index) {
                        CellVerdict::TruePositive
                    } else {
                        CellVerdict::FalsePositive
                    }
                }
                (Cell::Free, Cell::Free) => CellVerdict::TrueFree,
                (Cell::Free, Cell::Occupied) if surface && !found => CellVerdict::FalseNegative,
                (Cell::Free, Cell::Occupied) => CellVerdict::Silent,
            };
        }
        judged
    }

    fn score(&self, resolution_m: f64, tolerance_m: f64) -> MapScore {
        let count = |wanted| self.verdicts.iter().filter(|verdict| **verdict == wanted).count() as u64;
        let tp = count(CellVerdict::TruePositive);
        let fp = count(CellVerdict::FalsePositive);
        let tn = count(CellVerdict::TrueFree);
        let fn_ = count(CellVerdict::FalseNegative);
        let ppv_ratio = ratio(tp, tp + fp);
        let tpr_ratio = ratio(self.found_surface_cells, self.found_surface_cells + fn_);
        let f1_ratio = ppv_ratio
            .zip(tpr_ratio)
            .map(|(ppv, tpr)| if ppv + tpr > 0.0 { 2.0 * ppv * tpr / (ppv + tpr) } else { 0.0 });
        let mean_map_error_cells = (tp + fp > 0).then(|| self.error_sum_cells / (tp + fp) as f64);
        MapScore {
            mean_map_error_cells,
            mean_map_error_m: mean_map_error_cells.map(|cells| cells * resolution_m),
            accuracy_ratio: ratio(tp + tn, tp + tn + fp + fn_),
            f1_ratio,
            ppv_ratio,
            tpr_ratio,
            tnr_ratio: ratio(tn, tn + fp),
            tolerance_m,
            resolution_m,
            true_positive_cells: tp,
            false_positive_cells: fp,
            true_negative_cells: tn,
            false_negative_cells: fn_,
            found_surface_cells: self.found_surface_cells,
            unseen_surface_cells: self.unseen_surface_cells,
            outside_cells: self.outside_cells,
        }
    }
}

fn ratio(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

#[cfg(test)]
mod tests;
