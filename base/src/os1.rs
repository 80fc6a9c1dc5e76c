//! The wire form of Ouster's spinning lidars: columns of pixels, each a range in millimeters and a reflectivity.
//!
//! All beams of a column fire at one instant. A frame is a whole turn: `columns` columns from the encoder's zero on,
//! which looks straight back along the sensor's x axis (Ouster software manual, "sensor coordinate frame"). Misses
//! survive: a pixel of range zero. As the VLP-16's packets, this is what a system sees and what a recording keeps.

use crate::observation::{Return, Sweep};
use crate::pose::wrap_angle;
use crate::time::{Span, Time};
use std::f64::consts::{PI, TAU};

/// The beams of one sensor and how it turns.
#[derive(Debug, Clone, PartialEq)]
pub struct Os1 {
    /// Elevation of each beam, degrees, from the highest down.
    pub altitude_deg: Vec<f64>,
    /// How far each beam looks clockwise of the encoder's bearing, degrees.
    pub azimuth_deg: Vec<f64>,
    /// How far in front of the axis the beams leave the sensor, meters.
    pub beam_radius_m: f64,
    /// Columns of a turn.
    pub columns: u32,
    /// Time of a turn.
    pub turn: Span,
}

/// One firing of one beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pixel {
    /// From the axis along the beam, millimeters; 0 for a miss.
    pub range_mm: u32,
    /// Reflectivity as the sensor reports it.
    pub reflectivity: u16,
}

/// One turn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// When the first column fired.
    pub start: Time,
    /// Column by column, in each from the highest beam down.
    pub pixels: Vec<Pixel>,
}

/// Why a sweep is none of this sensor's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// A return that the sensor does not fire.
    #[error(
        "return {index} (ring {ring}, {fired_after_ns} ns after the start) is no firing of a turn of {columns} columns"
    )]
    Firing {
        /// Which return.
        index: usize,
        /// Its ring.
        ring: u16,
        /// Its firing time.
        fired_after_ns: i64,
        /// Columns of a turn.
        columns: u32,
    },
    /// A frame of another size.
    #[error("the frame has {found} pixels; wanted {wanted}")]
    Size {
        /// Pixels found.
        found: usize,
        /// Beams times columns.
        wanted: usize,
    },
}

impl Os1 {
    /// Beams.
    pub fn rows(&self) -> usize {
        self.altitude_deg.len()
    }

    /// When a column fires after its turn's start, whole nanoseconds.
    pub fn column_after(&self, column: u32) -> Span {
        Span::from_nanos(
            (i128::from(self.turn.nanos()) * i128::from(column) / i128::from(self.columns)) as i64,
        )
    }

    /// Bearing of the encoder at a column, radians in the lidar frame; the head turns clockwise from straight behind.
    pub fn encoder_rad(&self, column: u32) -> f64 {
        PI - TAU * f64::from(column) / f64::from(self.columns)
    }

    /// Packs a whole turn; a firing that the sweep does not hold is a miss.
    ///
    /// # Errors
    /// A return that is no firing of this sensor.
    pub fn encode(&self, sweep: &Sweep) -> Result<Frame, FrameError> {
        let rows = self.rows();
        let mut pixels = vec![Pixel::default(); rows * self.columns as usize];
        for (index, one) in sweep.returns.iter().enumerate() {
            let after = one.fired_after.nanos();
            let column = (i128::from(after.max(0)) * i128::from(self.columns)
                / i128::from(self.turn.nanos().max(1)))
            .clamp(0, i128::from(u32::MAX - 1)) as u32;
            // Whole nanoseconds round down, so that the column found may be the one before.
            let column = if self.column_after(column).nanos() == after { column } else { column + 1 };
            let known = (one.ring as usize) < rows && column < self.columns && one.number == 0;
            if !known || self.column_after(column).nanos() != after {
                return Err(FrameError::Firing {
                    index,
                    ring: one.ring,
                    fired_after_ns: after,
                    columns: self.columns,
                });
            }
            let row = rows - 1 - one.ring as usize;
            let Some(point) = one.point() else { continue };
            let (encoder, beam) = (self.encoder_rad(column), self.direction_of(row, column));
            let from_exit = [
                point.x - self.beam_radius_m * encoder.cos(),
                point.y - self.beam_radius_m * encoder.sin(),
                point.z,
            ];
            let along_m = from_exit[0] * beam[0] + from_exit[1] * beam[1] + from_exit[2] * beam[2];
            let range_mm = ((along_m + self.beam_radius_m) * 1000.0).round();
            pixels[column as usize * rows + row] = Pixel {
                range_mm: range_mm.clamp(1.0, f64::from(u32::MAX)) as u32,
                reflectivity: one.intensity.round().clamp(0.0, f32::from(u16::MAX)) as u16,
            };
        }
        Ok(Frame { start: sweep.start, pixels })
    }

    /// Unpacks a turn: one return per pixel, misses included; it ends one turn after its start.
    ///
    /// # Errors
    /// A frame that has not beams times columns pixels.
    pub fn decode(&self, frame: &Frame) -> Result<Sweep, FrameError> {
        let (rows, wanted) = (self.rows(), self.rows() * self.columns as usize);
        if frame.pixels.len() != wanted {
            return Err(FrameError::Size { found: frame.pixels.len(), wanted });
        }
        let returns = frame.pixels.iter().enumerate().map(|(index, pixel)| {
            let (row, column) = (index % rows, (index / rows) as u32);
            self.return_of(row, column, *pixel)
        });
        Ok(Sweep {
            start: frame.start,
            end: frame.start + self.turn,
            rings: rows as u16,
            returns: returns.collect(),
        })
    }

    fn return_of(&self, row: usize, column: u32, pixel: Pixel) -> Return {
        let encoder = self.encoder_rad(column);
        let bearing = encoder - self.azimuth_deg[row].to_radians();
        let met = (pixel.range_mm != 0).then(|| {
            let along_m = f64::from(pixel.range_mm) * 1e-3 - self.beam_radius_m;
            let beam = self.direction_of(row, column);
            let x = along_m * beam[0] + self.beam_radius_m * encoder.cos();
            let y = along_m * beam[1] + self.beam_radius_m * encoder.sin();
            (x, y, along_m * beam[2])
        });
        Return {
            azimuth_rad: met.map_or_else(|| wrap_angle(bearing), |(x, y, _)| y.atan2(x)),
            elevation_rad: met.map_or(self.altitude_deg[row].to_radians(), |(x, y, z)| z.atan2(x.hypot(y))),
            range_m: met.map(|(x, y, z)| x.hypot(y).hypot(z)),
            ring: (self.rows() - 1 - row) as u16,
            number: 0,
            fired_after: self.column_after(column),
            intensity: f32::from(pixel.reflectivity),
        }
    }

    fn direction_of(&self, row: usize, column: u32) -> [f64; 3] {
        let bearing = self.encoder_rad(column) - self.azimuth_deg[row].to_radians();
        let (up, flat) = self.altitude_deg[row].to_radians().sin_cos();
        [flat * bearing.cos(), flat * bearing.sin(), up]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(columns: u32, rate_hz: f64) -> Os1 {
        Os1 {
            altitude_deg: vec![14.8, 2.2, 0.1, -16.9],
            azimuth_deg: vec![-3.4, -3.2, -3.1, -3.0],
            beam_radius_m: 0.0158,
            columns,
            turn: Span::from_seconds(1.0 / rate_hz),
        }
    }

    fn frame(sensor: &Os1) -> Frame {
        let pixel = |n: usize| match n % 5 {
            0 => Pixel::default(),
            _ => Pixel { range_mm: 300 + 37 * n as u32 % 119_000, reflectivity: (n % 256) as u16 },
        };
        let count = sensor.rows() * sensor.columns as usize;
        Frame { start: Time::from_nanos(1_234_567_891), pixels: (0..count).map(pixel).collect() }
    }

    #[test]
    fn a_frame_survives_the_way_to_a_sweep_and_back_in_every_mode() {
        for (columns, rate_hz) in [(512, 10.0), (1024, 10.0), (2048, 10.0), (512, 20.0), (1024, 20.0)] {
            let sensor = sensor(columns, rate_hz);
            let frame = frame(&sensor);
            let sweep = sensor.decode(&frame).unwrap();
            assert_eq!(sensor.encode(&sweep).unwrap(), frame, "{columns}x{rate_hz}");
            assert_eq!(sensor.decode(&sensor.encode(&sweep).unwrap()).unwrap(), sweep);
        }
    }

    #[test]
    fn columns_share_the_turn_evenly_and_their_beams_one_instant() {
        let sensor = sensor(1024, 10.0);
        let sweep = sensor.decode(&frame(&sensor)).unwrap();
        for (n, one) in sweep.returns.iter().enumerate() {
            let column = (n / 4) as i64;
            // 97.65625 us a column, rounded down to nanoseconds.
            assert_eq!(one.fired_after.nanos(), column * 9_765_625 / 100);
            assert_eq!(one.ring, 3 - (n % 4) as u16);
        }
        assert_eq!((sweep.end - sweep.start).nanos(), 100_000_000);
    }

    #[test]
    fn a_pixel_lies_where_ousters_own_formula_puts_it() {
        // Software manual, "XYZ": theta = 2 pi (1 - m/W) - azimuth, x = (r - n) cos theta cos phi + n cos(2 pi (1 - m/W)),
        // in the lidar frame, whose x axis is ours turned by half a turn.
        let sensor = sensor(1024, 10.0);
        let sweep = sensor.decode(&frame(&sensor)).unwrap();
        for (n, one) in sweep.returns.iter().enumerate().filter(|(n, _)| n % 5 != 0) {
            let (row, column) = (n % 4, n / 4);
            let encoder = TAU * (1.0 - column as f64 / 1024.0);
            let theta = encoder - sensor.azimuth_deg[row].to_radians();
            let phi = sensor.altitude_deg[row].to_radians();
            let r = f64::from(300 + 37 * n as u32 % 119_000) / 1000.0 - 0.0158;
            let x = r * theta.cos() * phi.cos() + 0.0158 * encoder.cos();
            let y = r * theta.sin() * phi.cos() + 0.0158 * encoder.sin();
            let point = one.point().unwrap();
            assert!((point.x + x).hypot(point.y + y).hypot(point.z - r * phi.sin()) < 1e-9, "{one:?}");
        }
    }

    #[test]
    fn what_the_sensor_does_not_fire_is_refused() {
        let sensor = sensor(512, 10.0);
        let sweep = sensor.decode(&frame(&sensor)).unwrap();
        for change in [
            (|one: &mut Return| one.ring = 4) as fn(&mut Return),
            |one| one.number = 1,
            |one| one.fired_after = Span::from_nanos(one.fired_after.nanos() + 1),
            |one| one.fired_after = Span::from_nanos(-1),
            |one| one.fired_after = Span::from_millis(100),
        ] {
            let mut odd = sweep.clone();
            change(&mut odd.returns[7]);
            assert!(matches!(sensor.encode(&odd), Err(FrameError::Firing { index: 7, .. })));
        }
        let short = Frame { start: Time::default(), pixels: Vec::new() };
        assert_eq!(sensor.decode(&short).unwrap_err(), FrameError::Size { found: 0, wanted: 2048 });
    }
}
