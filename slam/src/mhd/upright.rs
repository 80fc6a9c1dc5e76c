//! The ring image and the rejection of ground by vertical consistency.
//!
//! A return stands on something upright when a neighboring ring met the same thing above or below it. A slice of
//! heights alone cannot tell: at 20 m one degree of slope moves the ground by 0.35 m, and arcs of ground that walk
//! along with the robot pull every matcher toward "no motion".

use super::hits::Hit;
use std::f64::consts::{PI, TAU};

/// Neighbors on one thing differ in level distance by less than this, meters.
const SAME_THING_M: f64 = 0.5;
/// Columns of the ring image: one firing cycle of a VLP-16 at 10 Hz is 0.2 degrees.
const COLUMNS: usize = 1800;
const EMPTY: u32 = u32::MAX;

/// The returns of one sweep by ring and bearing.
#[derive(Debug, Clone, Default)]
pub(crate) struct RingImage {
    cells: Vec<u32>,
    /// The column of every hit.
    columns: Vec<u16>,
    rings: usize,
}

impl RingImage {
    /// Sorts the hits, whose rings are all below `rings`, into rings and columns; of two in one place the nearer stays.
    pub(crate) fn fill(&mut self, hits: &[Hit], rings: u16) {
        self.rings = usize::from(rings);
        self.cells.clear();
        self.cells.resize(self.rings * COLUMNS, EMPTY);
        self.columns.clear();
        self.columns.extend(hits.iter().map(|hit| column_of(hit.bearing_rad) as u16));
        for (index, (hit, column)) in hits.iter().zip(&self.columns).enumerate() {
            let cell = &mut self.cells[usize::from(hit.ring) * COLUMNS + usize::from(*column)];
            if *cell == EMPTY || hits[*cell as usize].level_m > hit.level_m {
                *cell = index as u32;
            }
        }
    }

    /// A hit and the three above it, if all are of the same upright thing.
    pub(crate) fn chain(&self, hits: &[Hit], index: usize) -> Option<[Hit; 4]> {
        let first = self.above(hits, index)?;
        let second = self.above(hits, first)?;
        let third = self.above(hits, second)?;
        Some([hits[index], hits[first], hits[second], hits[third]])
    }

    /// The return right above a hit, of the next ring and the same column, if it met the same upright thing.
    fn above(&self, hits: &[Hit], index: usize) -> Option<usize> {
        let ring = usize::from(hits[index].ring) + 1;
        if ring >= self.rings {
            return None;
        }
        let other = self.cells[ring * COLUMNS + usize::from(self.columns[index])];
        let is_same = |other: &usize| is_same_upright(&hits[index], &hits[*other]);
        (other != EMPTY).then_some(other as usize).filter(is_same)
    }

    /// Whether a neighboring ring, in the same or the next column, met the same upright thing: less than half a
    /// meter apart in level distance, and steeper than 45 degrees.
    pub(crate) fn is_upright(&self, hits: &[Hit], index: usize) -> bool {
        let hit = &hits[index];
        let (ring, column) = (usize::from(hit.ring), usize::from(self.columns[index]));
        let columns = [(column + COLUMNS - 1) % COLUMNS, column, (column + 1) % COLUMNS];
        let rings = [ring.checked_sub(1), Some(ring + 1).filter(|above| *above < self.rings)];
        rings.into_iter().flatten().any(|ring| {
            columns.iter().any(|column| {
                let index = self.cells[ring * COLUMNS + column];
                index != EMPTY && is_same_upright(hit, &hits[index as usize])
            })
        })
    }
}

fn is_same_upright(hit: &Hit, other: &Hit) -> bool {
    let level_m = (other.level_m - hit.level_m).abs();
    level_m < SAME_THING_M && (other.at.z - hit.at.z).abs() > level_m
}

fn column_of(bearing_rad: f64) -> usize {
    // Bearings may come from -pi to pi or from 0 to two pi.
    let from_back_rad = bearing_rad + PI;
    let is_in_turn = (0.0..TAU).contains(&from_back_rad);
    let in_turn_rad = if is_in_turn { from_back_rad } else { from_back_rad.rem_euclid(TAU) };
    ((in_turn_rad / TAU * COLUMNS as f64) as usize).min(COLUMNS - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn hit(bearing_rad: f64, level_m: f64, height_m: f64, ring: u16) -> Hit {
        let at = Vector3::new(level_m * bearing_rad.cos(), level_m * bearing_rad.sin(), height_m);
        Hit { at, level_m, bearing_rad, after_s: 0.0, ring }
    }

    fn upright(hits: &[Hit]) -> Vec<bool> {
        let mut image = RingImage::default();
        image.fill(hits, 16);
        (0..hits.len()).map(|index| image.is_upright(hits, index)).collect()
    }

    #[test]
    fn a_trunk_is_upright_and_the_ground_around_it_is_not() {
        // Rings 7 and 8 meet a trunk at 3 m, rings 5 and 6 the ground at 4.3 and 7.2 m.
        let trunk = [hit(0.1, 3.0, -0.05, 7), hit(0.1, 3.0, 0.05, 8)];
        let ground = [hit(1.0, 4.3, -0.5, 5), hit(1.0, 7.2, -0.5, 6)];
        assert_eq!(upright(&[trunk, ground].concat()), [true, true, false, false]);
    }

    #[test]
    fn ground_near_the_robot_is_not_upright_where_rings_come_close() {
        // Rings at -15 and -13 degrees from half a meter: 0.3 m apart, as far as nothing upright is.
        let rings = [0_u16, 1].map(|ring| {
            let down = (15.0 - 2.0 * f64::from(ring)).to_radians().tan();
            hit(2.0, 0.5 / down, -0.5, ring)
        });
        assert_eq!(upright(&rings), [false, false]);
    }

    #[test]
    fn bearings_meet_across_the_seam_and_in_either_convention() {
        let across = [hit(PI - 1e-3, 3.0, 0.0, 7), hit(-PI + 1e-3, 3.0, 0.2, 8)];
        assert_eq!(upright(&across), [true, true]);
        let conventions = [hit(-0.5, 3.0, 0.0, 7), hit(TAU - 0.5, 3.0, 0.2, 8)];
        assert_eq!(upright(&conventions), [true, true]);
    }

    #[test]
    fn of_two_in_one_place_the_nearer_counts() {
        let hits = [hit(0.0, 3.0, 0.0, 7), hit(0.0, 9.0, 0.2, 8), hit(0.0, 3.1, 0.2, 8)];
        assert!(upright(&hits)[0]);
    }
}
