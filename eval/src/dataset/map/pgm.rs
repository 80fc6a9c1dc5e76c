//! Eight-bit binary gray images (PGM, P5).

use crate::dataset::error::{DatasetError, Refusal};
use arborloop_base::{Cell, Grid};
use std::path::Path;

const OCCUPIED: u8 = 0;
const FREE: u8 = 254;
const UNKNOWN: u8 = 205;

/// An image, row 0 on top.
pub(super) struct Pixels {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) bytes: Vec<u8>,
}

/// Draws a grid, its highest y on top.
pub(super) fn write(path: &Path, map: &Grid<Cell>) -> Result<(), DatasetError> {
    let mut image = format!("P5\n{} {}\n255\n", map.columns(), map.rows()).into_bytes();
    for row in map.cells().chunks(map.columns().max(1)).rev() {
        image.extend(row.iter().map(|cell| match cell {
            Cell::Occupied => OCCUPIED,
            Cell::Free => FREE,
            Cell::Unknown => UNKNOWN,
        }));
    }
    std::fs::write(path, image).map_err(DatasetError::io(path, "write"))
}

/// Reads an image.
pub(super) fn read(path: &Path) -> Result<Pixels, DatasetError> {
    let bytes = std::fs::read(path).map_err(DatasetError::io(path, "read"))?;
    parse(&bytes).map_err(|refusal| DatasetError::whole(path, refusal.found, refusal.wanted))
}

fn parse(bytes: &[u8]) -> Result<Pixels, Refusal> {
    const WANTED: &str = "an eight-bit binary PGM (P5)";
    let mut rest = bytes.strip_prefix(b"P5").ok_or_else(|| Refusal::new("no `P5` at the start", WANTED))?;
    let mut header = [0_usize; 3];
    for number in &mut header {
        *number = next_number(&mut rest).ok_or_else(|| Refusal::new("a header that ends early", WANTED))?;
    }
    let [columns, rows, white] = header;
    if white != 255 || columns == 0 || rows == 0 {
        return Err(Refusal::new(format!("{columns} x {rows} pixels up to {white}"), WANTED));
    }
    // One white space ends the header.
    let pixels = rest.get(1..).unwrap_or_default();
    let wanted = columns.checked_mul(rows).filter(|count| *count <= pixels.len());
    let Some(count) = wanted else {
        let found = format!("{} bytes of pixels", pixels.len());
        return Err(Refusal::new(found, format!("{columns} x {rows} pixels")));
    };
    Ok(Pixels { columns, rows, bytes: pixels[..count].to_vec() })
}

/// The next decimal number behind white space and remarks.
fn next_number(rest: &mut &[u8]) -> Option<usize> {
    loop {
        match rest.first()? {
            byte if byte.is_ascii_whitespace() => *rest = &rest[1..],
            b'#' => *rest = &rest[rest.iter().position(|byte| *byte == b'\n')?..],
            _ => break,
        }
    }
    let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let number = std::str::from_utf8(&rest[..digits]).ok()?.parse().ok()?;
    *rest = &rest[digits..];
    Some(number)
}
