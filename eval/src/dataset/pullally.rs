//! The paper's own orchard as its authors published it: NumPy scans of one ring, one every 4.5 s.
//!
//! Only `scan0` and `time` are read, and `gnss_rotated_c` when the reference is asked for. Every other field is made
//! from the RTK receiver and must never reach a method that claims to need none.

use super::error::{DatasetError, Place};
use arborloop_base::{Pose, Return, Span, Sweep, Time, Trajectory, wrap_angle};
use npyz::NpyFile;
use std::f64::consts::PI;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use zip::ZipArchive;

/// Bins of a scan.
const BINS: usize = 897;
/// Bearing from one bin to the next, radians; the first points backward.
const BIN_STEP_RAD: f64 = 0.007;
/// More numbers than any of the files has: a damaged shape must not ask for all memory.
const NUMBERS_MAX: u64 = 1 << 27;

/// Scans with their times.
#[derive(Debug)]
pub(super) struct Pullally {
    path: PathBuf,
    times: Vec<Time>,
    ranges_m: Vec<f64>,
}

impl Pullally {
    /// Reads and checks scans and times.
    pub(super) fn read(path: &Path) -> Result<Self, DatasetError> {
        let mut archive = archive(path)?;
        let (shape, ranges_m) = array(path, &mut archive, "scan0")?;
        let [scans, bins] = shape[..] else {
            return Err(refuse(path, "scan0", shape_text(&shape), format!("shape (N, {BINS})")));
        };
        if bins != BINS as u64 || scans == 0 {
            return Err(refuse(
                path,
                "scan0",
                shape_text(&shape),
                format!("shape (N, {BINS}), N at least 1"),
            ));
        }
        let (shape, seconds) = array(path, &mut archive, "time")?;
        if shape != [scans] && shape != [scans, 1] {
            let wanted = format!("shape ({scans},) or ({scans}, 1), one per scan");
            return Err(refuse(path, "time", shape_text(&shape), wanted));
        }
        let mut times: Vec<Time> = Vec::with_capacity(seconds.len());
        for (index, seconds) in seconds.iter().enumerate() {
            // Beyond this a time in nanoseconds leaves 64 bits.
            if !seconds.is_finite() || seconds.abs() > 9e9 {
                let found = format!("{seconds} at index {index}");
                return Err(refuse(path, "time", found, "finite seconds".to_owned()));
            }
            // Whole and broken seconds apart: Unix time in nanoseconds is more than 64-bit floating point holds.
            let whole = seconds.floor();
            let time = Time::from_nanos(whole as i64 * 1_000_000_000) + Span::from_seconds(seconds - whole);
            if let Some(before) = times.last()
                && time <= *before
            {
                let found = format!("{time} after {before} at index {index}");
                return Err(refuse(path, "time", found, "times that strictly increase".to_owned()));
            }
            times.push(time);
        }
        Ok(Pullally { path: path.to_owned(), times, ranges_m })
    }

    /// Number of scans.
    pub(super) fn len(&self) -> usize {
        self.times.len()
    }

    /// Every scan as a planar, instant sweep; `inf`, NaN and ranges that are not positive are misses.
    pub(super) fn sweeps(&self) -> impl Iterator<Item = Sweep> + '_ {
        self.times.iter().zip(self.ranges_m.chunks_exact(BINS)).map(|(&time, ranges_m)| Sweep {
            start: time,
            end: time,
            rings: 1,
            returns: ranges_m
                .iter()
                .enumerate()
                .map(|(bin, &range_m)| Return {
                    azimuth_rad: wrap_angle(-PI + BIN_STEP_RAD * bin as f64),
                    elevation_rad: 0.0,
                    range_m: (range_m.is_finite() && range_m > 0.0).then_some(range_m),
                    ring: 0,
                    number: 0,
                    fired_after: Span::ZERO,
                    intensity: 0.0,
                })
                .collect(),
        })
    }

    /// RTK positions at the scans, east and north as the authors turned them, without attitude; scans without a
    /// position are left out. `None` when the file has no such field.
    pub(super) fn reference(&self) -> Result<Option<Trajectory>, DatasetError> {
        const FIELD: &str = "gnss_rotated_c";
        let mut archive = archive(&self.path)?;
        if archive.index_for_name(&entry(FIELD)).is_none() {
            return Ok(None);
        }
        let (shape, numbers) = array(&self.path, &mut archive, FIELD)?;
        if shape != [self.times.len() as u64, 2] {
            let wanted = format!("shape ({}, 2), one per scan", self.times.len());
            return Err(refuse(&self.path, FIELD, shape_text(&shape), wanted));
        }
        let poses = self.times.iter().zip(numbers.chunks_exact(2)).filter_map(|(time, position)| {
            let finite = position.iter().all(|number| number.is_finite());
            finite.then(|| (*time, Pose::translation(position[0], position[1], 0.0)))
        });
        let trajectory = Trajectory::new(poses.collect())
            .map_err(|error| refuse(&self.path, FIELD, error.to_string(), "finite positions".to_owned()))?;
        Ok((!trajectory.is_empty()).then_some(trajectory))
    }
}

fn archive(path: &Path) -> Result<ZipArchive<BufReader<File>>, DatasetError> {
    let file = File::open(path).map_err(DatasetError::io(path, "open"))?;
    ZipArchive::new(BufReader::new(file)).map_err(|error| {
        DatasetError::whole(path, format!("a zip that does not open ({error})"), "a whole NumPy .npz")
    })
}

fn entry(field: &str) -> String {
    format!("{field}.npy")
}

/// Shape and numbers of one field, row by row.
fn array(
    path: &Path,
    archive: &mut ZipArchive<BufReader<File>>,
    field: &str,
) -> Result<(Vec<u64>, Vec<f64>), DatasetError> {
    let names: Vec<String> =
        archive.file_names().filter_map(Result::ok).map(|name| name.into_owned()).collect();
    let member = archive.by_name(&entry(field)).map_err(|error| {
        let found = format!("no readable `{field}` ({error}); the file has {}", names.join(", "));
        refuse(path, field, found, "scans and times of a Pullally run".to_owned())
    })?;
    let broken = |error: std::io::Error| refuse(path, field, error.to_string(), "a NumPy array".to_owned());
    let numbers = NpyFile::new(member).map_err(broken)?;
    let shape = numbers.shape().to_vec();
    let total = shape.iter().try_fold(1_u64, |total, side| total.checked_mul(*side));
    if total.is_none_or(|total| total > NUMBERS_MAX) {
        return Err(refuse(path, field, shape_text(&shape), format!("at most {NUMBERS_MAX} numbers")));
    }
    // Column by column is the same as row by row for anything with a single column.
    let one_column = shape.iter().filter(|side| **side != 1).count() <= 1;
    if numbers.order() != npyz::Order::C && !one_column {
        return Err(refuse(path, field, "columns first".to_owned(), "rows first (C order)".to_owned()));
    }
    let dtype = numbers.dtype().descr();
    let numbers = numbers.data::<f64>().map_err(|_| {
        refuse(path, field, format!("numbers of type {dtype}"), "64-bit floating point".to_owned())
    })?;
    let numbers = numbers.collect::<std::io::Result<Vec<f64>>>().map_err(broken)?;
    Ok((shape, numbers))
}

fn shape_text(shape: &[u64]) -> String {
    let sides: Vec<String> = shape.iter().map(u64::to_string).collect();
    format!("shape ({})", sides.join(", "))
}

fn refuse(path: &Path, field: &str, found: String, wanted: String) -> DatasetError {
    DatasetError::content(path, Place::Field(field.to_owned()), found, wanted)
}
