//! The VLP-16's wire form (manual 63-9243 Rev D): what the sensor really says, to the bit.
//!
//! The simulator passes every sweep through this form before any system sees it, and recordings store it, so that
//! a run and the replay of its recording feed the same bits. Misses survive: a firing with distance zero.

mod wire;

pub use wire::{Turn, decode, encode, encode_as};

use crate::time::{Span, Time};

/// Elevation of each laser in firing order, degrees (manual p. 54).
pub const ELEVATION_DEG: [f64; LASERS] =
    [-15.0, 1.0, -13.0, 3.0, -11.0, 5.0, -9.0, 7.0, -7.0, 9.0, -5.0, 11.0, -3.0, 13.0, -1.0, 15.0];
/// Height of each laser's origin above the sensor's center, meters (manual p. 54).
pub const OFFSET_M: [f64; LASERS] = [
    0.0112, -0.0007, 0.0097, -0.0022, 0.0081, -0.0037, 0.0066, -0.0051, 0.0051, -0.0066, 0.0037, -0.0081,
    0.0022, -0.0097, 0.0007, -0.0112,
];
/// Lasers in one firing cycle.
pub const LASERS: usize = 16;
/// Time between two lasers of a cycle: 2.304 us.
pub const LASER_STEP: Span = Span::from_nanos(2_304);
/// Time between two cycles: 16 firings and 18.432 us of recharge, 55.296 us.
pub const CYCLE_STEP: Span = Span::from_nanos(55_296);
/// Distances are whole multiples of this, meters.
pub const DISTANCE_STEP_M: f64 = 0.002;
/// Azimuths are whole multiples of this, degrees.
pub const AZIMUTH_STEP_DEG: f64 = 0.01;
/// Bytes of a data packet's payload.
pub const PACKET_BYTES: usize = 1206;

/// Ring (elevation rank, 0 lowest) of a laser, by firing order.
pub const fn ring_of(laser: usize) -> u16 {
    (if laser.is_multiple_of(2) { laser / 2 } else { 8 + laser / 2 }) as u16
}

/// Laser, by firing order, of a ring.
pub const fn laser_of(ring: u16) -> usize {
    let ring = ring as usize;
    if ring < 8 { 2 * ring } else { 2 * (ring - 8) + 1 }
}

/// Which echoes of a firing the sensor reports (manual p. 32).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ReturnMode {
    /// The strongest one.
    #[default]
    Strongest,
    /// The farthest one.
    Last,
    /// The farthest and the strongest one; the second strongest where these two are one.
    Dual,
}

impl ReturnMode {
    /// The byte in a packet (manual p. 57).
    pub const fn byte(self) -> u8 {
        match self {
            ReturnMode::Strongest => 0x37,
            ReturnMode::Last => 0x38,
            ReturnMode::Dual => 0x39,
        }
    }

    /// The mode of a packet's byte.
    pub const fn of_byte(byte: u8) -> Option<Self> {
        match byte {
            0x37 => Some(ReturnMode::Strongest),
            0x38 => Some(ReturnMode::Last),
            0x39 => Some(ReturnMode::Dual),
            _ => None,
        }
    }

    /// Firing cycles in a packet: twelve blocks hold two cycles each, in dual mode every pair of cycles twice.
    pub const fn cycles_per_packet(self) -> usize {
        match self {
            ReturnMode::Strongest | ReturnMode::Last => 24,
            ReturnMode::Dual => 12,
        }
    }
}

/// One data packet: twelve blocks of two firing cycles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    /// When its first laser fired.
    pub stamp: Time,
    /// The payload behind the UDP header.
    pub payload: [u8; PACKET_BYTES],
}

/// Why bytes or a sweep are none of a VLP-16's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// The payload has another length.
    #[error("a VLP-16 data packet has {PACKET_BYTES} bytes, this one has {found}")]
    Length {
        /// Bytes found.
        found: usize,
    },
    /// The return mode or the product byte is another's.
    #[error(
        "packet factory bytes are 0x{mode:02x} 0x{product:02x}; wanted 0x37, 0x38 or 0x39 (return mode) and 0x22 (VLP-16; 0x21 of early heads at a VLP-16's pace)"
    )]
    Factory {
        /// Return mode byte.
        mode: u8,
        /// Product byte.
        product: u8,
    },
    /// A sweep has returns that a VLP-16 does not fire.
    #[error("return {index} (ring {ring}, {fired_after_ns} ns after the start) is no firing of a VLP-16")]
    Firing {
        /// Which return.
        index: usize,
        /// Its ring.
        ring: u16,
        /// Its firing time.
        fired_after_ns: i64,
    },
}

impl Packet {
    /// Takes a payload as received.
    pub fn from_bytes(stamp: Time, payload: &[u8]) -> Result<Self, WireError> {
        let payload = payload.try_into().map_err(|_| WireError::Length { found: payload.len() })?;
        Ok(Packet { stamp, payload })
    }
}

#[cfg(test)]
mod tests;
