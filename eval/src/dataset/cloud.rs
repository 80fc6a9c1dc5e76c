//! A sweep as `sensor_msgs/PointCloud2`: written in the Velodyne driver's layout, read in any layout with named fields.
//!
//! A cloud holds hits only, so what comes back from one has lost its misses; `packets` loses nothing.

mod field;
mod labels;
mod plain;
mod rings;

pub(super) use labels::labels_of;
pub(super) use plain::message_of as plain_message_of;
pub(super) use rings::Rings;

use super::error::Refusal;
use super::ros2::{Header, PointCloud2, PointField};
use arborloop_base::{Return, Span, Sweep, Time};
use field::Column;
use nalgebra::Vector3;

/// `datatype` of a `PointField`.
pub(super) mod datatype {
    pub(in super::super) const UINT8: u8 = 2;
    pub(in super::super) const UINT16: u8 = 4;
    pub(in super::super) const INT32: u8 = 5;
    pub(in super::super) const UINT32: u8 = 6;
    pub(in super::super) const FLOAT32: u8 = 7;
    pub(in super::super) const FLOAT64: u8 = 8;
}

/// Point times that are later than this are no offsets but instants of their own, seconds.
const OFFSET_S_MAX: f64 = 1e6;

/// velodyne_pointcloud's layout: x, y, z, intensity (f32), ring (u16), time (f32, seconds after the stamp).
const VELODYNE: [(&str, u32, u8); 6] = [
    ("x", 0, datatype::FLOAT32),
    ("y", 4, datatype::FLOAT32),
    ("z", 8, datatype::FLOAT32),
    ("intensity", 12, datatype::FLOAT32),
    ("ring", 16, datatype::UINT16),
    ("time", 18, datatype::FLOAT32),
];
const VELODYNE_STEP: u32 = 22;

/// The hits of a sweep in the Velodyne driver's layout, stamped with `stamp`, in firing order.
pub(super) fn message_of(sweep: &Sweep, stamp: Time, frame: &str) -> Result<PointCloud2, Refusal> {
    let mut data = Vec::with_capacity(sweep.returns.len() * VELODYNE_STEP as usize);
    for one in &sweep.returns {
        let Some(point) = one.point() else { continue };
        let after_stamp = sweep.start + one.fired_after - stamp;
        for number in [point.x as f32, point.y as f32, point.z as f32, one.intensity] {
            data.extend_from_slice(&number.to_le_bytes());
        }
        data.extend_from_slice(&one.ring.to_le_bytes());
        data.extend_from_slice(&(after_stamp.seconds() as f32).to_le_bytes());
    }
    Ok(unorganized(Header::new(stamp, frame)?, &VELODYNE, VELODYNE_STEP, data))
}

/// A dense cloud of one row.
fn unorganized(header: Header, layout: &[(&str, u32, u8)], point_step: u32, data: Vec<u8>) -> PointCloud2 {
    let fields = layout
        .iter()
        .map(|&(name, offset, datatype)| PointField { name: name.to_owned(), offset, datatype, count: 1 })
        .collect();
    PointCloud2 {
        header,
        height: 1,
        width: data.len() as u32 / point_step,
        fields,
        is_bigendian: false,
        point_step,
        row_step: data.len() as u32,
        data,
        is_dense: true,
    }
}

/// The sweep of a cloud.
///
/// Needs `x`, `y`, `z` and, unless the cloud is organized, `ring`. Point times are read from `time`, `t`,
/// `timestamp`, `time_stamp` or `offset_time`: floating point in seconds, integers in nanoseconds, after the stamp or,
/// when they are large, on the stamp's own clock. The sweep lasts from the earliest to the latest of the points and, where
/// times are offsets, the stamp; where the recorder promises the end of the turn it is given as `end`. Points at the origin or not finite
/// are misses without a direction and left out; a cloud of [`plain`]'s layout loses nothing.
pub(super) fn sweep_of(cloud: &PointCloud2, end: Option<Time>, rings: &mut Rings) -> Result<Sweep, Refusal> {
    if plain::is_plain(cloud) {
        return plain::sweep_of(cloud);
    }
    let points = points_of(cloud)?;
    let stamp = cloud.header.stamp.time();
    let instants = points.iter().map(|point| stamp + point.after_stamp);
    let (mut start, mut last) = (instants.clone().min().unwrap_or(stamp), instants.max().unwrap_or(stamp));
    if points.iter().all(|point| !point.absolute) {
        (start, last) = (start.min(stamp), last.max(stamp));
    }
    let end = end.unwrap_or(last).max(start);
    let mut sweep = Sweep { start, end, rings: 0, returns: Vec::with_capacity(points.len()) };
    sweep.returns.extend(points.iter().map(|point| Return {
        azimuth_rad: point.position_m.y.atan2(point.position_m.x),
        elevation_rad: point.position_m.z.atan2(point.position_m.x.hypot(point.position_m.y)),
        range_m: Some(point.position_m.norm()),
        ring: point.ring,
        number: 0,
        fired_after: stamp + point.after_stamp - start,
        intensity: point.intensity,
    }));
    sweep.returns.sort_by_key(|one| one.fired_after);
    rings.rank(&mut sweep, if cloud.height > 1 { cloud.height } else { 0 });
    Ok(sweep)
}

struct Point {
    position_m: Vector3<f64>,
    ring: u16,
    after_stamp: Span,
    absolute: bool,
    intensity: f32,
}

fn points_of(cloud: &PointCloud2) -> Result<Vec<Point>, Refusal> {
    let [x, y, z] = ["x", "y", "z"].map(|name| Column::required(cloud, name));
    let (x, y, z) = (x?, y?, z?);
    let ring = Column::first_of(cloud, &["ring"])?;
    let time = Column::first_of(cloud, &["time", "t", "timestamp", "time_stamp", "offset_time"])?;
    let intensity = Column::first_of(cloud, &["intensity"])?;
    if ring.is_none() && cloud.height < 2 {
        return Err(Refusal::new(
            format!("an unorganized cloud with the fields {}", field::names(cloud)),
            "a field `ring` that says which beam saw the point",
        ));
    }
    let stamp_s = cloud.header.stamp.time().seconds();
    let mut points = Vec::with_capacity(cloud.data.len() / cloud.point_step.max(1) as usize);
    for (row, point) in field::points(cloud)? {
        let position_m = Vector3::new(x.number(point), y.number(point), z.number(point));
        if !position_m.iter().all(|n| n.is_finite()) || position_m == Vector3::zeros() {
            continue;
        }
        let seconds = time.as_ref().map_or(0.0, |time| time.number(point) * time.seconds_per_count());
        let absolute = seconds.abs() > OFFSET_S_MAX;
        let after_stamp = if absolute { seconds - stamp_s } else { seconds };
        if !after_stamp.is_finite() || after_stamp.abs() > OFFSET_S_MAX {
            return Err(Refusal::new(
                format!("a point time of {seconds} s"),
                "seconds or nanoseconds after the stamp, or on its clock",
            ));
        }
        points.push(Point {
            position_m,
            ring: ring.as_ref().map_or(row as u16, |ring| ring.number(point) as u16),
            after_stamp: Span::from_seconds(after_stamp),
            absolute,
            intensity: intensity.as_ref().map_or(0.0, |intensity| intensity.number(point) as f32),
        });
    }
    Ok(points)
}
