//! Trajectories as TUM text: `stamp x y z qx qy qz qw` per line, meters, unit quaternion, lines with `#` are remarks.
//!
//! Stamps go through decimal digits, never through floating point: a nanosecond written is a nanosecond read.

mod decimal;

use super::error::{DatasetError, Place};
use arborloop_base::{Pose, Time, Trajectory};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use std::fmt::Write;
use std::path::Path;

const COLUMNS: &str = "8 numbers: stamp x y z qx qy qz qw";

/// Reads a trajectory.
///
/// # Errors
/// With file and line: another number of columns, text that is no number, numbers that are not finite, a quaternion
/// of no length, a stamp not after the one before; and a file without any pose.
pub fn read_tum(path: &Path) -> Result<Trajectory, DatasetError> {
    let bytes = std::fs::read(path).map_err(DatasetError::io(path, "read"))?;
    let text = String::from_utf8(bytes)
        .map_err(|_| DatasetError::whole(path, "bytes that are no text", "a TUM trajectory"))?;
    let mut trajectory = Trajectory::default();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let refuse =
            |found: String, wanted: &str| DatasetError::content(path, Place::Line(index + 1), found, wanted);
        let (stamp, pose) = stamped_pose(line).map_err(|(found, wanted)| refuse(found, wanted))?;
        trajectory.push(stamp, pose).map_err(|_| {
            let before = trajectory.poses().last().map_or(Time::default(), |last| last.0);
            refuse(format!("stamp {stamp} after {before}"), "stamps that strictly increase")
        })?;
    }
    if trajectory.is_empty() {
        return Err(DatasetError::whole(path, format!("{} bytes without a pose", text.len()), COLUMNS));
    }
    Ok(trajectory)
}

fn stamped_pose(line: &str) -> Result<(Time, Pose), (String, &'static str)> {
    let columns: Vec<&str> = line.split_whitespace().collect();
    if columns.len() != 8 {
        return Err((format!("{} columns", columns.len()), COLUMNS));
    }
    let stamp = decimal::nanos(columns[0])
        .ok_or_else(|| (format!("stamp `{}`", columns[0]), "seconds as a decimal number"))?;
    let mut numbers = [0.0_f64; 7];
    for (number, column) in numbers.iter_mut().zip(&columns[1..]) {
        *number = column
            .parse()
            .ok()
            .filter(|number: &f64| number.is_finite())
            .ok_or_else(|| (format!("`{column}`"), "a finite number"))?;
    }
    let [x, y, z, qx, qy, qz, qw] = numbers;
    let rotation = UnitQuaternion::try_new(Quaternion::new(qw, qx, qy, qz), 1e-9)
        .ok_or_else(|| (format!("quaternion {qx} {qy} {qz} {qw}"), "a quaternion with a length"))?;
    Ok((Time::from_nanos(stamp), Pose::from_parts(Translation3::new(x, y, z), rotation)))
}

/// Writes a trajectory with nine decimals, single spaces and no trailing one, as evo wants it.
pub fn write_tum(path: &Path, trajectory: &Trajectory) -> Result<(), DatasetError> {
    write(path, String::new(), trajectory)
}

/// The same below a remark that says what the poses are.
pub(super) fn write_with_header(
    path: &Path,
    remark: &str,
    trajectory: &Trajectory,
) -> Result<(), DatasetError> {
    write(path, format!("# {remark}\n"), trajectory)
}

fn write(path: &Path, mut text: String, trajectory: &Trajectory) -> Result<(), DatasetError> {
    for (stamp, pose) in trajectory.poses() {
        let (p, q) = (&pose.translation, &pose.rotation);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{stamp} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9} {:.9}",
            p.x, p.y, p.z, q.i, q.j, q.k, q.w
        );
    }
    std::fs::write(path, text).map_err(DatasetError::io(path, "write"))
}

#[cfg(test)]
mod tests;
