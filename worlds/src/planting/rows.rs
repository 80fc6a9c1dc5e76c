//! Places in rows: regular, jittered, some empty.

use crate::spec::RowsSpec;
use arborloop_base::Seed;
use nalgebra::{Point2, Rotation2, Vector2};

/// A place of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowPlace {
    /// Which row, counted from 0.
    pub row: usize,
    /// Which place of the row, counted from 0.
    pub plant: usize,
    /// Where the rule says, world frame, meters.
    pub nominal: Point2<f64>,
    /// Where the plant stands, world frame, meters.
    pub point: Point2<f64>,
    /// Whether no plant stands there.
    pub missing: bool,
}

impl RowPlace {
    /// The plant's number: `1000 row + plant`, both counted from 1. One more row or plant renumbers nobody.
    pub fn instance(&self) -> u32 {
        instance(self.row, self.plant)
    }
}

/// `1000 row + number`, both counted from 1.
pub(crate) fn instance(row: usize, number: usize) -> u32 {
    (1000 * (row + 1) + number + 1) as u32
}

/// All places, row by row, each from its own address of the stream `world/rows`.
pub fn places(rows: &RowsSpec, seed: Seed) -> Vec<RowPlace> {
    let stream = seed.stream("world/rows");
    let each = (0..rows.count).flat_map(|row| (0..rows.plants).map(move |plant| (row, plant)));
    each.map(|(row, plant)| {
        let mut draws = stream.child(row as u64).at(plant as u64);
        let [along_m, across_m] = [(); 2].map(|()| rows.jitter_m * draws.within(-1.0, 1.0));
        let nominal_m = Vector2::new(plant as f64 * rows.plant_spacing_m, row as f64 * rows.spacing_m);
        RowPlace {
            row,
            plant,
            nominal: at(rows, nominal_m),
            point: at(rows, nominal_m + Vector2::new(along_m, across_m)),
            missing: draws.chance(rows.missing_ratio),
        }
    })
    .collect()
}

/// The place so far along the rows and across them from the first plant, world frame.
pub(crate) fn at(rows: &RowsSpec, from_first_m: Vector2<f64>) -> Point2<f64> {
    Point2::new(rows.x_m, rows.y_m) + Rotation2::new(rows.bearing_deg.to_radians()) * from_first_m
}

/// The middle of the rows and the distance from there to the farthest place, meters.
pub(crate) fn extent(rows: &RowsSpec) -> (Point2<f64>, f64) {
    let gaps = |count: usize| count.saturating_sub(1) as f64;
    let size = Vector2::new(gaps(rows.plants) * rows.plant_spacing_m, gaps(rows.count) * rows.spacing_m);
    (at(rows, size / 2.0), size.norm() / 2.0)
}
