//! What each point of a cloud really met, as a cloud of its own with the points in the same order.

use super::{datatype, unorganized};
use crate::dataset::error::Refusal;
use crate::dataset::ros2::{Header, PointCloud2};
use arborloop_base::{Label, Return, Time};

/// Class (u8, the numbers of `Class`), number of the return within its firing (u8), whether several surfaces share it (u8, 0
/// or 1), instance (u32), true range in meters and incidence in radians (f32, NaN where nothing was met), displacement by
/// the wind in meters (f32).
const LAYOUT: [(&str, u32, u8); 7] = [
    ("class", 0, datatype::UINT8),
    ("number", 1, datatype::UINT8),
    ("mixed", 2, datatype::UINT8),
    ("instance", 4, datatype::UINT32),
    ("range", 8, datatype::FLOAT32),
    ("incidence", 12, datatype::FLOAT32),
    ("displaced", 16, datatype::FLOAT32),
];
const STEP: u32 = 20;

/// The labels of these returns, one point each.
pub(in super::super) fn labels_of<'a>(
    labeled: impl Iterator<Item = (&'a Return, &'a Label)>,
    stamp: Time,
    frame: &str,
) -> Result<PointCloud2, Refusal> {
    let mut data = Vec::with_capacity(labeled.size_hint().0 * STEP as usize);
    for (one, label) in labeled {
        data.extend_from_slice(&[label.class as u8, one.number, u8::from(label.mixed), 0]);
        data.extend_from_slice(&label.instance.to_le_bytes());
        data.extend_from_slice(&label.range_m.to_le_bytes());
        data.extend_from_slice(&label.incidence_rad.to_le_bytes());
        data.extend_from_slice(&label.displaced_m.to_le_bytes());
    }
    Ok(unorganized(Header::new(stamp, frame)?, &LAYOUT, STEP, data))
}
