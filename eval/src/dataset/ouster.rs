//! An Ouster turn as ouster-ros records it: `/ouster/points` in its default layout and `/ouster/metadata` as JSON.
//!
//! The cloud is organized, a row a beam from the highest down, and keeps misses as points at the origin. Together with the
//! beams of the metadata its ranges and reflectivities are the whole turn: what comes back is the same to the bit.

use super::cloud::datatype;
use super::error::Refusal;
use super::ros2::{Header, PointCloud2, PointField};
use arborloop_base::os1::{Frame, Os1, Pixel};
use arborloop_base::{Span, Sweep};
use serde_json::{Value, json};

/// ouster-ros's `Point`: sixteen bytes of coordinates, then the channels.
const LAYOUT: [(&str, u32, u8); 9] = [
    ("x", 0, datatype::FLOAT32),
    ("y", 4, datatype::FLOAT32),
    ("z", 8, datatype::FLOAT32),
    ("intensity", 16, datatype::FLOAT32),
    ("t", 20, datatype::UINT32),
    ("reflectivity", 24, datatype::UINT16),
    ("ring", 26, datatype::UINT16),
    ("ambient", 28, datatype::UINT16),
    ("range", 32, datatype::UINT32),
];
const STEP: usize = 48;

/// The turn as a cloud, stamped with its first column.
pub(super) fn message_of(sensor: &Os1, sweep: &Sweep, frame: &str) -> Result<PointCloud2, Refusal> {
    let refused = |error: arborloop_base::os1::FrameError| {
        Refusal::new(error.to_string(), "a sweep of the sensor that the recording is set to")
    };
    let turn = sensor.encode(sweep).map_err(refused)?;
    let carried = sensor.decode(&turn).map_err(refused)?;
    let (rows, columns) = (sensor.rows(), sensor.columns as usize);
    let mut data = vec![0_u8; rows * columns * STEP];
    for (index, (pixel, one)) in turn.pixels.iter().zip(&carried.returns).enumerate() {
        let (row, column) = (index % rows, index / rows);
        let point = &mut data[(row * columns + column) * STEP..][..STEP];
        let at = one.point().unwrap_or_default();
        for (offset, number) in
            [(0, at.x as f32), (4, at.y as f32), (8, at.z as f32), (16, f32::from(pixel.reflectivity))]
        {
            point[offset..offset + 4].copy_from_slice(&number.to_le_bytes());
        }
        point[20..24].copy_from_slice(&(one.fired_after.nanos() as u32).to_le_bytes());
        point[24..26].copy_from_slice(&pixel.reflectivity.to_le_bytes());
        point[26..28].copy_from_slice(&(row as u16).to_le_bytes());
        point[32..36].copy_from_slice(&pixel.range_mm.to_le_bytes());
    }
    let fields =
        LAYOUT.map(|(name, offset, datatype)| PointField { name: name.into(), offset, datatype, count: 1 });
    Ok(PointCloud2 {
        header: Header::new(sweep.start, frame)?,
        height: rows as u32,
        width: columns as u32,
        fields: fields.into(),
        is_bigendian: false,
        point_step: STEP as u32,
        row_step: (columns * STEP) as u32,
        data,
        is_dense: true,
    })
}

/// The turn of a cloud that [`message_of`] made.
pub(super) fn sweep_of(sensor: &Os1, cloud: &PointCloud2) -> Result<Sweep, Refusal> {
    let (rows, columns) = (sensor.rows(), sensor.columns as usize);
    let size = (cloud.height as usize, cloud.width as usize, cloud.point_step as usize, cloud.data.len());
    if size != (rows, columns, STEP, rows * columns * STEP) {
        return Err(Refusal::new(
            format!("{} x {} points of {} bytes, {} bytes in all", size.0, size.1, size.2, size.3),
            format!("{rows} x {columns} points of {STEP} bytes, as the metadata says"),
        ));
    }
    let mut pixels = vec![Pixel::default(); rows * columns];
    for (place, point) in cloud.data.chunks_exact(STEP).enumerate() {
        let (row, column) = (place / columns, place % columns);
        pixels[column * rows + row] = Pixel {
            range_mm: u32::from_le_bytes([point[32], point[33], point[34], point[35]]),
            reflectivity: u16::from_le_bytes([point[24], point[25]]),
        };
    }
    let frame = Frame { start: cloud.header.stamp.time(), pixels };
    sensor.decode(&frame).map_err(|error| Refusal::new(error.to_string(), "a whole turn"))
}

/// Where each point of the cloud stands among the returns of its sweep.
pub(super) fn order(sensor: &Os1) -> impl Iterator<Item = usize> {
    let (rows, columns) = (sensor.rows(), sensor.columns as usize);
    (0..rows).flat_map(move |row| (0..columns).map(move |column| column * rows + row))
}

/// The sensor's metadata, with the keys of its own.
pub(super) fn metadata(sensor: &Os1) -> String {
    let rate_hz = 1.0 / sensor.turn.seconds();
    json!({
        "prod_line": "OS-1-16-A0",
        "lidar_mode": format!("{}x{}", sensor.columns, rate_hz.round()),
        "beam_altitude_angles": sensor.altitude_deg,
        "beam_azimuth_angles": sensor.azimuth_deg,
        "lidar_origin_to_beam_origin_mm": sensor.beam_radius_m * 1000.0,
        "data_format": {
            "columns_per_frame": sensor.columns,
            "columns_per_packet": 16,
            "pixel_shift_by_row": vec![0; sensor.rows()],
            "pixels_per_column": sensor.rows(),
        },
        "lidar_to_sensor_transform": [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
        "arborloop_turn_ns": sensor.turn.nanos(),
        "arborloop_beam_radius_m": sensor.beam_radius_m,
    })
    .to_string()
}

/// The sensor of metadata that [`metadata`] wrote; `None` for anyone else's.
pub(super) fn sensor_of(metadata: &str) -> Option<Os1> {
    let value: Value = serde_json::from_str(metadata).ok()?;
    let list = |key: &str| -> Option<Vec<f64>> { value[key].as_array()?.iter().map(Value::as_f64).collect() };
    let sensor = Os1 {
        altitude_deg: list("beam_altitude_angles")?,
        azimuth_deg: list("beam_azimuth_angles")?,
        beam_radius_m: value["arborloop_beam_radius_m"].as_f64()?,
        columns: u32::try_from(value["data_format"]["columns_per_frame"].as_u64()?).ok()?,
        turn: Span::from_nanos(value["arborloop_turn_ns"].as_i64()?),
    };
    let rows = sensor.rows();
    let whole = (1..=512).contains(&rows)
        && sensor.azimuth_deg.len() == rows
        && (1..=65_536).contains(&sensor.columns)
        && sensor.turn > Span::default();
    whole.then_some(sensor)
}
