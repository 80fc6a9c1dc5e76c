//! The ring image and the rejection of ground by vertical consistency.
//!
//! A return stands on something upright when a neighboring ring met the same thing above or below it. A slice of
//! heights alone cannot tell: at 20 m one degree of slope moves the ground by 0.35 m, and arcs of ground that walk
//! along with the robot pull every matcher toward "no motion".

use super::hits::Hit;
use std::f64::consts::{PI, TAU};

/// Neighbors on one thing differ in level distance by less than this, metres.
const SAME_THING_M: f64 = 0.5;
/// Columns of the ring image: one firing cycle of a VLP-16 at 10 Hz is 0.2 degrees.
const COLUMNS: usize = 1800;
const EMPTY: u32 = u32::MAX;

/// The returns of one sweep by ring and bearing.
#[derive(Debug, Clone, Default)]
pub(crate) struct RingImage {
    cells: Vec<u32>,
    rings: usize,
}

impl RingImage {
    /// Sorts the hits, whose rings are all below `rings`, into rings and columns; of two in one place the nearer stays.
    pub(crate) fn fill(&mut self, hits: &[Hit], rings: u16) {
        self.rings = usize::from(rings);
        self.cells.clear();
        self.cells.resize(self.rings * COLUMNS, EMPTY);
        for (index, hit) in hits.iter().enumerate() {
            let cell = &mut self.cells[usize::from(hit.ring) * COLUMNS + column_of(hit.bearing_rad)];
            if *cell == EMPTY || hits[*cell as usize].level_m > hit.level_m {
                *cell = index as u32;
            }
        }
    }

    /// Whether a neighboring ring, in the same or the next column, met the same upright thing: less than half a
    /// metre apart in level distance, and steeper than 45 degrees.
    pub(crate) fn is_upright(&self, hits: &[Hit], hit: &Hit) -> bool {
        let (ring, column) = (usize::from(hit.ring), column_of(hit.bearing_rad));
        let columns = [(column + COLUMNS - 1) % COLUMNS, column, (column + 1) % COLUMNS];
        let rings = [ring.checked_sub(1), Some(ring + 1).filter(|above| *above < self.rings)];
        rings.into_iter().flatten().any(|ring| {
            columns.iter().any(|column| {
                let index = self.cells[ring * COLUMNS + column];
                index != EMPTY && {
                    let other = &hits[index as usize];
                    let level_m = (other.level_m - hit.level_m).abs();
                    level_m < SAME_THING_M && (other.at.z - hit.at.z).abs() > level_m
                }
            })
        })
    }
}

fn column_of(bearing_rad: f64) -> usize {
    // Bearings may come from -pi to pi or from 0 to two pi.
    (((bearing_rad + PI).rem_euclid(TAU) / TAU * COLUMNS as f64) as usize).min(COLUMNS - 1)
}
