//! Fields of a point by name, whatever their type, offset and byte order; every read is inside the point.

use crate::dataset::error::Refusal;
use crate::dataset::ros2::PointCloud2;

/// One named number of every point.
pub(super) struct Column {
    offset: usize,
    datatype: u8,
    big_endian: bool,
}

impl Column {
    /// The field, which must be there.
    pub(super) fn required(cloud: &PointCloud2, name: &str) -> Result<Self, Refusal> {
        Column::first_of(cloud, &[name])?
            .ok_or_else(|| Refusal::new(format!("the fields {}", names(cloud)), format!("a field `{name}`")))
    }

    /// The first of the named fields that is there.
    pub(super) fn first_of(cloud: &PointCloud2, wanted: &[&str]) -> Result<Option<Self>, Refusal> {
        let found = wanted.iter().find_map(|name| cloud.fields.iter().find(|field| field.name == *name));
        let Some(field) = found else { return Ok(None) };
        let Some(size) = bytes_of(field.datatype) else {
            return Err(Refusal::new(
                format!("field `{}` of datatype {}", field.name, field.datatype),
                "a datatype from 1 (INT8) to 8 (FLOAT64)",
            ));
        };
        if u64::from(field.offset) + size as u64 > u64::from(cloud.point_step) {
            return Err(Refusal::new(
                format!(
                    "field `{}` at byte {} of a {}-byte point",
                    field.name, field.offset, cloud.point_step
                ),
                "a field inside the point",
            ));
        }
        let big_endian = cloud.is_bigendian;
        Ok(Some(Column { offset: field.offset as usize, datatype: field.datatype, big_endian }))
    }

    /// The number of a point.
    pub(super) fn number(&self, point: &[u8]) -> f64 {
        macro_rules! read {
            ($number:ty) => {{
                let mut bytes = [0; size_of::<$number>()];
                bytes.copy_from_slice(&point[self.offset..][..size_of::<$number>()]);
                let number = if self.big_endian {
                    <$number>::from_be_bytes(bytes)
                } else {
                    <$number>::from_le_bytes(bytes)
                };
                f64::from(number)
            }};
        }
        match self.datatype {
            1 => read!(i8),
            2 => read!(u8),
            3 => read!(i16),
            4 => read!(u16),
            5 => read!(i32),
            6 => read!(u32),
            7 => read!(f32),
            _ => read!(f64),
        }
    }

    /// Seconds per count of a time field: floating point counts seconds, integers count nanoseconds.
    pub(super) fn seconds_per_count(&self) -> f64 {
        if self.datatype >= 7 { 1.0 } else { 1e-9 }
    }
}

fn bytes_of(datatype: u8) -> Option<usize> {
    match datatype {
        1 | 2 => Some(1),
        3 | 4 => Some(2),
        5..=7 => Some(4),
        8 => Some(8),
        _ => None,
    }
}

/// The names of a cloud's fields, for messages.
pub(super) fn names(cloud: &PointCloud2) -> String {
    let names: Vec<&str> = cloud.fields.iter().map(|field| field.name.as_str()).collect();
    if names.is_empty() { "(none)".to_owned() } else { names.join(", ") }
}

/// Row and bytes of every point, after checking that the data are as long as the header says.
pub(super) fn points(cloud: &PointCloud2) -> Result<impl Iterator<Item = (usize, &[u8])>, Refusal> {
    let (height, width) = (cloud.height as usize, cloud.width as usize);
    let (point_step, row_step) = (cloud.point_step as usize, cloud.row_step as usize);
    let row_bytes =
        width.checked_mul(point_step).filter(|bytes| point_step > 0 && *bytes <= row_step || height == 0);
    let total = row_bytes
        .and_then(|bytes| row_step.checked_mul(height.saturating_sub(1))?.checked_add(bytes))
        .filter(|total| *total <= cloud.data.len() && row_step > 0 || width == 0 || height == 0);
    if total.is_none() {
        return Err(Refusal::new(
            format!(
                "{} bytes for {width} x {height} points of {point_step} bytes in rows of {row_step}",
                cloud.data.len()
            ),
            "data as long as the header says",
        ));
    }
    let (width, height) = if width == 0 || height == 0 { (0, 0) } else { (width, height) };
    Ok((0..height).flat_map(move |row| {
        let line = &cloud.data[(row * row_step).min(cloud.data.len())..];
        line.chunks_exact(point_step.max(1)).take(width).map(move |point| (row, point))
    }))
}
