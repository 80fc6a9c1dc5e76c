//! The VLP-16's wire form (manual 63-9243 Rev D): what the sensor really says, to the bit.
//!
//! The simulator passes every sweep through this form before any system sees it, and recordings store it, so that
//! a run and the replay of its recording feed the same bits. Misses survive: a firing with distance zero.

use crate::observation::{Return, Sweep};
use crate::pose::wrap_angle;
use crate::time::{Span, Time};
use std::f64::consts::TAU;

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
/// Bytes of a data packet's payload.
pub const PACKET_BYTES: usize = 1206;

const BLOCKS: usize = 12;
const CYCLES: usize = 2 * BLOCKS;
const BLOCK_BYTES: usize = 100;
const BLOCK_FLAG: [u8; 2] = [0xff, 0xee];
const STRONGEST_RETURN: u8 = 0x37;
const PRODUCT_VLP16: u8 = 0x22;
const HUNDREDTHS: i64 = 36_000;

/// Ring (elevation rank, 0 lowest) of a laser, by firing order.
pub const fn ring_of(laser: usize) -> u16 {
    (if laser.is_multiple_of(2) { laser / 2 } else { 8 + laser / 2 }) as u16
}

/// Laser, by firing order, of a ring.
pub const fn laser_of(ring: u16) -> usize {
    let ring = ring as usize;
    if ring < 8 { 2 * ring } else { 2 * (ring - 8) + 1 }
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
        "packet factory bytes are 0x{mode:02x} 0x{product:02x}; wanted 0x37 or 0x38 (single return) and 0x22 (VLP-16)"
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

/// Packs a sweep of a VLP-16 in single-return mode. Azimuths are rounded to 0.01 degree, distances to 2 mm.
///
/// The last packet's unused blocks carry no block flag; a firing that the sweep does not hold is written as a miss.
pub fn encode(sweep: &Sweep) -> Result<Vec<Packet>, WireError> {
    let cycle_ns = CYCLE_STEP.nanos();
    let firing = |index: usize, one: &Return| {
        let after = one.fired_after.nanos();
        let laser = laser_of(one.ring.min(15));
        let exact = after >= 0 && after % cycle_ns == laser as i64 * LASER_STEP.nanos();
        (exact && one.ring < 16 && one.number == 0)
            .then_some(((after / cycle_ns) as usize, laser))
            .ok_or(WireError::Firing { index, ring: one.ring, fired_after_ns: after })
    };
    let last_cycle = match sweep.returns.last() {
        Some(last) => firing(sweep.returns.len() - 1, last)?.0,
        None => return Ok(Vec::new()),
    };
    let mut packets: Vec<Packet> = (0..=last_cycle / CYCLES)
        .map(|number| {
            let stamp = sweep.start + CYCLE_STEP * (number * CYCLES) as i64;
            let mut payload = [0_u8; PACKET_BYTES];
            // Microseconds past the hour, as the sensor counts them.
            let past_hour = (stamp.nanos() / 1000).rem_euclid(3_600_000_000) as u32;
            payload[1200..1204].copy_from_slice(&past_hour.to_le_bytes());
            payload[1204] = STRONGEST_RETURN;
            payload[1205] = PRODUCT_VLP16;
            Packet { stamp, payload }
        })
        .collect();
    for (index, one) in sweep.returns.iter().enumerate() {
        let (cycle, laser) = firing(index, one)?;
        let Some(packet) = packets.get_mut(cycle / CYCLES) else {
            return Err(WireError::Firing { index, ring: one.ring, fired_after_ns: one.fired_after.nanos() });
        };
        let block = &mut packet.payload[cycle % CYCLES / 2 * BLOCK_BYTES..][..BLOCK_BYTES];
        if laser == 0 && cycle % 2 == 0 {
            // The encoder counts clockwise from the connector's opposite: the negative of our bearing.
            let hundredths = (-one.azimuth_rad / TAU * HUNDREDTHS as f64).round() as i64;
            block[..2].copy_from_slice(&BLOCK_FLAG);
            block[2..4].copy_from_slice(&(hundredths.rem_euclid(HUNDREDTHS) as u16).to_le_bytes());
        }
        if let Some(range_m) = one.range_m {
            let along_beam_m = range_m * one.elevation_rad.cos() / ELEVATION_DEG[laser].to_radians().cos();
            let steps = (along_beam_m / DISTANCE_STEP_M).round().clamp(1.0, f64::from(u16::MAX)) as u16;
            let at = 4 + 3 * (cycle % 2 * LASERS + laser);
            block[at..at + 2].copy_from_slice(&steps.to_le_bytes());
            block[at + 2] = one.intensity.round().clamp(0.0, 255.0) as u8;
        }
    }
    Ok(packets)
}

/// Unpacks the packets of one turn that ends at `end`. A firing cycle belongs to the turn in which its last laser
/// fires: cycles that are not over by `end` are padding and left out.
///
/// As the ROS driver does, the azimuth of a firing inside a block is interpolated toward the next block's.
pub fn decode(packets: &[Packet], end: Time) -> Result<Sweep, WireError> {
    let start = packets.first().map_or(end, |packet| packet.stamp);
    let mut sweep =
        Sweep { start, end, rings: LASERS as u16, returns: Vec::with_capacity(packets.len() * 384) };
    let mut blocks: Vec<(Time, i64, &[u8])> = Vec::with_capacity(packets.len() * BLOCKS);
    for packet in packets {
        let (mode, product) = (packet.payload[1204], packet.payload[1205]);
        if !matches!(mode, 0x37 | 0x38) || product != PRODUCT_VLP16 {
            return Err(WireError::Factory { mode, product });
        }
        for (number, block) in packet.payload[..BLOCKS * BLOCK_BYTES].chunks_exact(BLOCK_BYTES).enumerate() {
            if block[..2] == BLOCK_FLAG {
                let azimuth = i64::from(u16::from_le_bytes([block[2], block[3]]));
                blocks.push((packet.stamp + CYCLE_STEP * (2 * number) as i64, azimuth, block));
            }
        }
    }
    let step_after =
        |index: usize| blocks.get(index + 1).map(|next| (next.1 - blocks[index].1).rem_euclid(HUNDREDTHS));
    let mut step = 0;
    for (index, &(block_time, azimuth, block)) in blocks.iter().enumerate() {
        step = step_after(index).unwrap_or(step);
        for (slot, echo) in block[4..].chunks_exact(3).enumerate() {
            let (cycle, laser) = (slot / LASERS, slot % LASERS);
            let after_block = CYCLE_STEP * cycle as i64 + LASER_STEP * laser as i64;
            let last_laser = block_time + CYCLE_STEP * cycle as i64 + LASER_STEP * (LASERS as i64 - 1);
            if last_laser >= end {
                continue;
            }
            let share = after_block.seconds() / (CYCLE_STEP * 2).seconds();
            let clockwise = (azimuth as f64 + share * step as f64) / HUNDREDTHS as f64 * TAU;
            let steps = u16::from_le_bytes([echo[0], echo[1]]);
            let elevation = ELEVATION_DEG[laser].to_radians();
            let along_beam_m = f64::from(steps) * DISTANCE_STEP_M;
            let (horizontal, up) =
                (along_beam_m * elevation.cos(), along_beam_m * elevation.sin() + OFFSET_M[laser]);
            sweep.returns.push(Return {
                azimuth_rad: wrap_angle(-clockwise),
                elevation_rad: if steps == 0 { elevation } else { up.atan2(horizontal) },
                range_m: (steps != 0).then(|| horizontal.hypot(up)),
                ring: ring_of(laser),
                number: 0,
                fired_after: block_time + after_block - start,
                intensity: f32::from(echo[2]),
            });
        }
    }
    Ok(sweep)
}

impl Packet {
    /// Takes a payload as received.
    pub fn from_bytes(stamp: Time, payload: &[u8]) -> Result<Self, WireError> {
        let payload = payload.try_into().map_err(|_| WireError::Length { found: payload.len() })?;
        Ok(Packet { stamp, payload })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turning_sweep(cycles: usize) -> Sweep {
        let start = Time::from_nanos(1_000_012_345);
        let returns = (0..cycles * LASERS)
            .map(|n| {
                let (cycle, laser) = (n / LASERS, n % LASERS);
                let fired_after = CYCLE_STEP * cycle as i64 + LASER_STEP * laser as i64;
                Return {
                    azimuth_rad: wrap_angle(2.9 - 10.0 * TAU * fired_after.seconds()),
                    elevation_rad: ELEVATION_DEG[laser].to_radians(),
                    range_m: (n % 3 != 0).then_some(0.5 + 0.0117 * (n % 5000) as f64),
                    ring: ring_of(laser),
                    number: 0,
                    fired_after,
                    intensity: (n % 256) as f32,
                }
            })
            .collect();
        let last_fired = CYCLE_STEP * (cycles as i64 - 1) + LASER_STEP * (LASERS as i64 - 1);
        Sweep { start, end: start + last_fired + Span::from_nanos(1), rings: 16, returns }
    }

    #[test]
    fn a_turn_may_end_anywhere_before_the_next_cycle_is_over() {
        for cycles in [1, 2, 1808, 1809] {
            let mut raw = turning_sweep(cycles);
            let earliest = raw.end;
            for late in [0, 20_000, 40_000, CYCLE_STEP.nanos() - 1] {
                raw.end = earliest + Span::from_nanos(late);
                let wired = decode(&encode(&raw).unwrap(), raw.end).unwrap();
                assert_eq!(wired.returns.len(), raw.returns.len(), "{cycles} cycles, {late} ns late");
            }
        }
    }

    #[test]
    fn a_sweep_that_went_over_the_wire_once_goes_over_it_unchanged() {
        for cycles in [1, 2, 23, 24, 25, 1808, 1809] {
            let raw = turning_sweep(cycles);
            let once = decode(&encode(&raw).unwrap(), raw.end).unwrap();
            let twice = decode(&encode(&once).unwrap(), raw.end).unwrap();
            assert_eq!(once.returns.len(), raw.returns.len(), "{cycles} cycles");
            assert_eq!(once, twice);
        }
    }

    #[test]
    fn the_wire_costs_no_more_than_its_steps() {
        let raw = turning_sweep(1809);
        let wired = decode(&encode(&raw).unwrap(), raw.end).unwrap();
        for (a, b) in raw.returns.iter().zip(&wired.returns) {
            assert_eq!(
                (a.ring, a.fired_after, a.range_m.is_some()),
                (b.ring, b.fired_after, b.range_m.is_some())
            );
            // Half a step of the block, plus a whole step of difference shared out over the block.
            assert!(wrap_angle(a.azimuth_rad - b.azimuth_rad).abs() <= 1.5 * TAU / 36_000.0);
            if let (Some(a), Some(b)) = (a.range_m, b.range_m) {
                assert!((a - b).abs() <= DISTANCE_STEP_M / 2.0 + OFFSET_M[0]);
            }
        }
    }

    #[test]
    fn rings_rank_the_elevations() {
        for (laser, elevation) in ELEVATION_DEG.into_iter().enumerate() {
            assert_eq!(laser_of(ring_of(laser)), laser);
            assert_eq!(elevation, -15.0 + 2.0 * f64::from(ring_of(laser)));
        }
    }

    #[test]
    fn bytes_of_another_sensor_are_refused() {
        assert_eq!(
            Packet::from_bytes(Time::default(), &[0; 12]).unwrap_err(),
            WireError::Length { found: 12 }
        );
        let blank = Packet::from_bytes(Time::default(), &[0; PACKET_BYTES]).unwrap();
        assert!(matches!(decode(&[blank], Time::default()), Err(WireError::Factory { .. })));
        let mut odd = turning_sweep(1);
        odd.returns[3].fired_after = Span::from_nanos(1);
        assert!(matches!(encode(&odd), Err(WireError::Firing { index: 3, .. })));
    }
}
