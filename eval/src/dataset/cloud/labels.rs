//! What each point of a cloud really met, as a cloud of its own with the points in the same order.

use super::{datatype, unorganized};
use crate::dataset::error::Refusal;
use crate::dataset::ros2::{Header, PointCloud2};
use arborloop_base::{Label, Sweep, Time};

/// Class (u8, the numbers of `Class`), instance (u32), true range in meters and incidence in radians (f32, NaN where
/// nothing was met).
const LAYOUT: [(&str, u32, u8); 4] = [
    ("class", 0, datatype::UINT8),
    ("instance", 4, datatype::UINT32),
    ("range", 8, datatype::FLOAT32),
    ("incidence", 12, datatype::FLOAT32),
];
const STEP: u32 = 16;

/// The labels of the hits of a sweep.
pub(in super::super) fn labels_of(
    sweep: &Sweep,
    labels: &[Label],
    stamp: Time,
    frame: &str,
) -> Result<PointCloud2, Refusal> {
    if labels.len() != sweep.returns.len() {
        return Err(Refusal::new(
            format!("{} labels for {} returns", labels.len(), sweep.returns.len()),
            "one label per return",
        ));
    }
    let mut data = Vec::with_capacity(labels.len() * STEP as usize);
    for (one, label) in sweep.returns.iter().zip(labels) {
        if one.range_m.is_none() {
            continue;
        }
        data.extend_from_slice(&[label.class as u8, 0, 0, 0]);
        data.extend_from_slice(&label.instance.to_le_bytes());
        data.extend_from_slice(&label.range_m.to_le_bytes());
        data.extend_from_slice(&label.incidence_rad.to_le_bytes());
    }
    Ok(unorganized(Header::new(stamp, frame)?, &LAYOUT, STEP, data))
}
