//! Occupancy maps as `map_server` keeps them: a PGM image and a YAML beside it.
//!
//! Image row 0 is the highest y. Written values: 0 occupied, 254 free, 205 unknown.

mod pgm;

use super::error::{DatasetError, Place};
use arborloop_base::{Cell, Grid};
use nalgebra::Point2;
use std::collections::BTreeMap;
use std::path::Path;

const OCCUPIED_MIN: f64 = 0.65;
const FREE_MAX: f64 = 0.196;

/// Writes `<base>.pgm` and `<base>.yaml`, frame of the grid.
pub fn write_map(base: &Path, map: &Grid<Cell>) -> Result<(), DatasetError> {
    let name = base.file_name().map_or("map".to_owned(), |name| name.to_string_lossy().into_owned());
    let (image, yaml) = (format!("{name}.pgm"), base.with_file_name(format!("{name}.yaml")));
    pgm::write(&base.with_file_name(&image), map)?;
    let text = format!(
        "image: {image}\nmode: trinary\nresolution: {}\norigin: [{}, {}, 0.0]\nnegate: 0\n\
         occupied_thresh: {OCCUPIED_MIN}\nfree_thresh: {FREE_MAX}\n",
        map.resolution_m(),
        map.origin().x,
        map.origin().y,
    );
    std::fs::write(&yaml, text).map_err(DatasetError::io(&yaml, "write"))
}

/// Reads a map by its YAML.
///
/// # Errors
/// A missing key, a value that is no number, a rotated origin, a mode other than `trinary`; an image that is no
/// eight-bit binary PGM (P5) or is shorter than its header says.
pub fn read_map(yaml: &Path) -> Result<Grid<Cell>, DatasetError> {
    let settings = Settings::read(yaml)?;
    let image = yaml.with_file_name(&settings.image);
    let pixels = pgm::read(&image)?;
    let (columns, rows) = (pixels.columns, pixels.rows);
    let mut map = Grid::filled(settings.origin, settings.resolution_m, columns, rows, Cell::Unknown);
    for (line, row) in pixels.bytes.chunks_exact(columns).zip((0..rows).rev()) {
        let cells = &mut map.cells_mut()[row * columns..][..columns];
        for (cell, pixel) in cells.iter_mut().zip(line) {
            *cell = settings.cell(*pixel);
        }
    }
    Ok(map)
}

/// The keys of the YAML.
struct Settings {
    image: String,
    resolution_m: f64,
    origin: Point2<f64>,
    negate: f64,
    occupied_min: f64,
    free_max: f64,
}

impl Settings {
    /// Reads the few lines of `key: value` that map_server knows.
    fn read(path: &Path) -> Result<Self, DatasetError> {
        let text = std::fs::read_to_string(path).map_err(DatasetError::io(path, "read"))?;
        let values: BTreeMap<&str, &str> = text
            .lines()
            .map(|line| line.split_once(" #").map_or(line, |(value, _)| value))
            .filter_map(|line| line.split_once(':'))
            .map(|(key, value)| (key.trim(), value.trim().trim_matches(['"', '\''])))
            .collect();
        let refuse = |key: &str, wanted: &str| {
            let found = values.get(key).map_or("nothing".to_owned(), |found| format!("`{found}`"));
            DatasetError::content(path, Place::Field(key.to_owned()), found, wanted)
        };
        let number = |key: &str, fallback: Option<f64>| {
            let given = values.get(key).map(|value| value.parse().ok().filter(|n: &f64| n.is_finite()));
            given.unwrap_or(fallback).ok_or_else(|| refuse(key, "a number"))
        };
        let mode = values.get("mode").copied().unwrap_or("trinary");
        if mode != "trinary" {
            return Err(refuse("mode", "`trinary`"));
        }
        let resolution_m = number("resolution", None)?;
        if resolution_m <= 0.0 {
            return Err(refuse("resolution", "a positive number of meters"));
        }
        let image = values.get("image").filter(|image| !image.is_empty());
        let image = image.ok_or_else(|| refuse("image", "the name of a PGM file"))?.to_string();
        let origin: Vec<f64> = values.get("origin").map_or(Vec::new(), |list| {
            list.trim_matches(['[', ']']).split(',').filter_map(|n| n.trim().parse().ok()).collect()
        });
        let [x, y, yaw] = origin[..] else { return Err(refuse("origin", "[x, y, yaw]")) };
        if yaw != 0.0 || !x.is_finite() || !y.is_finite() {
            return Err(refuse("origin", "a finite corner and no rotation: [x, y, 0.0]"));
        }
        Ok(Settings {
            image,
            resolution_m,
            origin: Point2::new(x, y),
            negate: number("negate", Some(0.0))?,
            occupied_min: number("occupied_thresh", Some(OCCUPIED_MIN))?,
            free_max: number("free_thresh", Some(FREE_MAX))?,
        })
    }

    /// map_server's rule: darkness is occupancy, unless negated.
    fn cell(&self, pixel: u8) -> Cell {
        let light = f64::from(pixel) / 255.0;
        let occupancy = if self.negate != 0.0 { light } else { 1.0 - light };
        if occupancy > self.occupied_min {
            Cell::Occupied
        } else if occupancy < self.free_max {
            Cell::Free
        } else {
            Cell::Unknown
        }
    }
}

#[cfg(test)]
mod tests;
