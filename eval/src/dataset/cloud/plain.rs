//! A sweep of a lidar without a wire form of its own as a cloud that loses nothing, misses included.
//!
//! Beside coordinates for everyone's tools every point carries its polar numbers in double precision. A miss stands at
//! the origin with its beam's direction in the polar numbers. The stamp is the end of the sweep.

use super::{datatype, field, unorganized};
use crate::dataset::error::Refusal;
use crate::dataset::ros2::{Header, PointCloud2};
use arborloop_base::{Return, Span, Sweep};

const LAYOUT: [(&str, u32, u8); 11] = [
    ("x", 0, datatype::FLOAT32),
    ("y", 4, datatype::FLOAT32),
    ("z", 8, datatype::FLOAT32),
    ("intensity", 12, datatype::FLOAT32),
    ("ring", 16, datatype::UINT16),
    ("rings", 18, datatype::UINT16),
    ("t", 20, datatype::INT32),
    ("azimuth", 24, datatype::FLOAT64),
    ("elevation", 32, datatype::FLOAT64),
    ("range", 40, datatype::FLOAT64),
    ("number", 48, datatype::UINT8),
];
const STEP: usize = 52;
/// `number` of the one point of a sweep without returns: it keeps the start.
const NO_RETURN: u8 = 255;

/// The sweep as a cloud.
pub(in super::super) fn message_of(sweep: &Sweep, frame: &str) -> Result<PointCloud2, Refusal> {
    let mut data = Vec::with_capacity(sweep.returns.len().max(1) * STEP);
    let empty = Return {
        azimuth_rad: 0.0,
        elevation_rad: 0.0,
        range_m: None,
        ring: 0,
        number: NO_RETURN,
        fired_after: Span::default(),
        intensity: 0.0,
    };
    let none = if sweep.returns.is_empty() { std::slice::from_ref(&empty) } else { &[] };
    for one in sweep.returns.iter().chain(none) {
        let after_stamp = (sweep.start + one.fired_after - sweep.end).nanos();
        let after_stamp = i32::try_from(after_stamp).map_err(|_| {
            Refusal::new(format!("a firing {after_stamp} ns after the stamp"), "one within two seconds of it")
        })?;
        let at = one.point().unwrap_or_default();
        for number in [at.x as f32, at.y as f32, at.z as f32, one.intensity] {
            data.extend_from_slice(&number.to_le_bytes());
        }
        data.extend_from_slice(&one.ring.to_le_bytes());
        data.extend_from_slice(&sweep.rings.to_le_bytes());
        data.extend_from_slice(&after_stamp.to_le_bytes());
        for number in [one.azimuth_rad, one.elevation_rad, one.range_m.unwrap_or(0.0)] {
            data.extend_from_slice(&number.to_le_bytes());
        }
        data.extend_from_slice(&[one.number, 0, 0, 0]);
    }
    Ok(unorganized(Header::new(sweep.end, frame)?, &LAYOUT, STEP as u32, data))
}

/// Whether a cloud has this layout.
pub(super) fn is_plain(cloud: &PointCloud2) -> bool {
    let same = |(field, wanted): (&crate::dataset::ros2::PointField, &(&str, u32, u8))| {
        (field.name.as_str(), field.offset, field.datatype) == *wanted
    };
    cloud.point_step as usize == STEP
        && !cloud.is_bigendian
        && cloud.fields.len() == LAYOUT.len()
        && cloud.fields.iter().zip(&LAYOUT).all(same)
}

/// The sweep of a cloud of this layout.
pub(super) fn sweep_of(cloud: &PointCloud2) -> Result<Sweep, Refusal> {
    let end = cloud.header.stamp.time();
    let mut sweep = Sweep { start: end, end, rings: 0, returns: Vec::with_capacity(cloud.width as usize) };
    for (index, (_, point)) in field::points(cloud)?.enumerate() {
        let four = |at: usize| [point[at], point[at + 1], point[at + 2], point[at + 3]];
        let double = |at: usize| {
            let mut bytes = [0; 8];
            bytes.copy_from_slice(&point[at..at + 8]);
            f64::from_le_bytes(bytes)
        };
        let stamp = end + Span::from_nanos(i64::from(i32::from_le_bytes(four(20))));
        if index == 0 {
            sweep.start = stamp;
            sweep.rings = u16::from_le_bytes([point[18], point[19]]);
        }
        let numbers = [double(24), double(32), double(40)];
        if !numbers.iter().all(|number| number.is_finite()) {
            return Err(Refusal::new(
                format!("polar numbers {numbers:?} of point {index}"),
                "finite numbers",
            ));
        }
        if point[48] == NO_RETURN {
            continue;
        }
        let [azimuth_rad, elevation_rad, range_m] = numbers;
        sweep.returns.push(Return {
            azimuth_rad,
            elevation_rad,
            range_m: (range_m != 0.0).then_some(range_m),
            ring: u16::from_le_bytes([point[16], point[17]]),
            number: point[48],
            fired_after: stamp - sweep.start,
            intensity: f32::from_le_bytes(four(12)),
        });
    }
    Ok(sweep)
}
