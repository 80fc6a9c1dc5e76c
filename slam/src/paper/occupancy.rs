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

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Return, Span, Sweep, Time};

    /// A sweep that meets a wall 3 m ahead within half a radian, and nothing else.
    fn slice(settings: &MhdPaperSettings) -> Slice {
        let returns = (0..800).map(|n| {
            let azimuth_rad = -2.9 + 0.007 * f64::from(n) + 0.0035;
            let range_m = (azimuth_rad.abs() < 0.5).then(|| 3.0 / azimuth_rad.cos());
            Return {
                azimuth_rad,
                elevation_rad: 0.0,
                range_m,
                ring: 0,
                number: 0,
                fired_after: Span::ZERO,
                intensity: 0.0,
            }
        });
        let sweep =
            Sweep { start: Time::default(), end: Time::default(), rings: 1, returns: returns.collect() };
        let mut slice = Slice::default();
        slice.cut(&sweep, settings);
        slice
    }

    #[test]
    fn a_wall_is_occupied_the_way_to_it_is_free_and_what_lies_behind_stays_unknown() {
        let settings = MhdPaperSettings::default();
        let mut map = Occupancy::new(&settings);
        assert!(map.drawing().is_none());
        let pose = Vector3::new(1.0, 2.0, 0.7);
        (0..3).for_each(|_| map.add(&pose, &slice(&settings), &settings));
        let (sin, cos) = pose.z.sin_cos();
        let state = |x: f64, y: f64| {
            let cell = map.cell_of(pose.x + cos * x - sin * y, pose.y + sin * x + cos * y);
            let drawing = map.drawing().unwrap();
            let at = drawing.origin();
            let size = drawing.resolution_m();
            let column = cell.0 - (at.x / size).round() as i32;
            let row = cell.1 - (at.y / size).round() as i32;
            *drawing.get(column as usize, row as usize).unwrap()
        };
        for y in [-1.0, 0.0, 1.0] {
            // Half the obstacle's thickness is added to every range.
            assert_eq!(state(3.0 + settings.obstacle_m / 2.0, y), Cell::Occupied, "{y}");
            assert_eq!(state(2.5, y * 0.8), Cell::Free, "{y}");
            assert_eq!(state(3.6, y), Cell::Unknown, "{y}");
        }
        // Beams without a return are free to the longest range; behind 3 radians nothing looks.
        assert_eq!(state(0.0, 8.0), Cell::Free);
        assert_eq!(state(-8.0, 0.0), Cell::Unknown);
    }

    #[test]
    fn evidence_adds_up_in_log_odds() {
        let settings = MhdPaperSettings::default();
        let mut map = Occupancy::new(&settings);
        let pose = Vector3::new(0.0, 0.0, 0.0);
        let wall = map.cell_of(3.0 + settings.obstacle_m / 2.0, 0.01);
        map.add(&pose, &slice(&settings), &settings);
        let once = map.log_odds.get(wall);
        assert!((f64::from(once) - settings.occupied_log_odds).abs() < 1e-6);
        map.add(&pose, &slice(&settings), &settings);
        assert!((map.log_odds.get(wall) - 2.0 * once).abs() < 1e-6);
    }
}
