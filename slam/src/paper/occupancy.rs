//! The Bayesian occupancy grid in log-odds, with the inverse sensor model of the authors' code.

use super::settings::MhdPaperSettings;
use super::slice::Slice;
use crate::raster::{CellIndex, Raster};
use arborloop_base::{Cell, Grid, wrap_angle};
use nalgebra::{Point2, Vector3};

/// A cell counts as occupied above a probability of 0.7, as log-odds: ln(0.7 / 0.3).
const OCCUPIED: f32 = 0.847_297_86;

/// Distance and bearing of a cell from the cell that the lidar is in.
#[derive(Debug, Clone, Copy)]
struct Sight {
    distance_m: f32,
    bearing_rad: f32,
}

/// The map; grows with the track where the paper's is a fixed 66 x 40 m.
#[derive(Debug, Clone)]
pub(crate) struct Occupancy {
    log_odds: Raster<f32>,
    cell_m: f64,
    sights: Vec<Sight>,
    reach: i32,
}

impl Occupancy {
    /// An unknown map.
    pub(crate) fn new(settings: &MhdPaperSettings) -> Self {
        let cell_m = settings.cell_m;
        let reach = (settings.range_m[1] / cell_m).ceil() as i32;
        let mut sights = Vec::with_capacity(((2 * reach + 1) * (2 * reach + 1)) as usize);
        for j in -reach..=reach {
            for i in -reach..=reach {
                let (x, y) = (f64::from(i) * cell_m, f64::from(j) * cell_m);
                sights.push(Sight { distance_m: x.hypot(y) as f32, bearing_rad: y.atan2(x) as f32 });
            }
        }
        Occupancy { log_odds: Raster::new(cell_m, 4.0, 0.0), cell_m, sights, reach }
    }

    /// Cells from the lidar to the end of the longest beam.
    pub(crate) fn reach(&self) -> i32 {
        self.reach
    }

    /// The cell of a place.
    pub(crate) fn cell_of(&self, x_m: f64, y_m: f64) -> CellIndex {
        self.log_odds.cell_of(x_m, y_m)
    }

    /// Whether a cell is occupied with probability above 0.7.
    pub(crate) fn is_occupied(&self, cell: CellIndex) -> bool {
        self.log_odds.get(cell) > OCCUPIED
    }

    /// Adds a slice seen from a pose of the lidar. The lidar is taken to be in the center of its cell.
    ///
    /// With r the range plus half the obstacle's thickness alpha: occupied where |d - r| < alpha, free where
    /// d <= r - alpha; beams without a return are free to the longest range.
    pub(crate) fn add(&mut self, pose: &Vector3<f64>, slice: &Slice, settings: &MhdPaperSettings) {
        let center = self.cell_of(pose.x, pose.y);
        let reach = self.reach;
        self.log_odds.cover((center.0 - reach, center.1 - reach), (center.0 + reach, center.1 + reach));
        let range_m_max = settings.range_m[1];
        let width = (2 * reach + 1) as usize;
        // One look-up per fine bearing instead of one search for the nearest beam per cell.
        let bins = (std::f64::consts::TAU / settings.beam_rad.max(1e-3) * 4.0).ceil();
        let per_rad = bins / std::f64::consts::TAU;
        let beams: Vec<f32> = (0..bins as usize)
            .map(|bin| {
                let bearing_rad = wrap_angle((bin as f64 + 0.5) / per_rad - std::f64::consts::PI - pose.z);
                // Shorter than any cell's distance where the slice does not look.
                slice.widened_m(bearing_rad, settings.bearing_rad_max).map_or(-1.0, |r| r as f32)
            })
            .collect();
        let alpha_m = settings.obstacle_m as f32;
        let (occupied, free) = (settings.occupied_log_odds as f32, settings.free_log_odds as f32);
        for (index, sight) in self.sights.iter().enumerate() {
            let distance_m = sight.distance_m;
            if distance_m > range_m_max as f32 {
                continue;
            }
            let bin = ((f64::from(sight.bearing_rad) + std::f64::consts::PI) * per_rad) as usize;
            let range_m = beams[bin.min(beams.len() - 1)];
            if range_m < 0.0 {
                continue;
            }
            let beam_m = range_m + alpha_m / 2.0;
            let change = if beam_m < range_m_max as f32 && (distance_m - beam_m).abs() < alpha_m {
                occupied
            } else if distance_m <= beam_m - alpha_m {
                free
            } else {
                continue;
            };
            let cell = (center.0 - reach + (index % width) as i32, center.1 - reach + (index / width) as i32);
            if let Some(log_odds) = self.log_odds.get_mut(cell) {
                *log_odds += change;
            }
        }
    }

    /// The map as a drawing; `None` before the first slice.
    pub(crate) fn drawing(&self) -> Option<Grid<Cell>> {
        let (columns, rows) = self.log_odds.size();
        if columns == 0 {
            return None;
        }
        let first = self.log_odds.first();
        let origin = Point2::new(f64::from(first.0) * self.cell_m, f64::from(first.1) * self.cell_m);
        let mut grid = Grid::filled(origin, self.cell_m, columns as usize, rows as usize, Cell::Unknown);
        for (index, drawn) in grid.cells_mut().iter_mut().enumerate() {
            let cell = (first.0 + (index as i32) % columns, first.1 + (index as i32) / columns);
            if self.is_occupied(cell) {
                *drawn = Cell::Occupied;
            } else if self.log_odds.get(cell) < 0.0 {
                *drawn = Cell::Free;
            }
        }
        Some(grid)
    }
}
