//! Sweeps to packets and back.

use super::{
    CYCLE_STEP, DISTANCE_STEP_M, ELEVATION_DEG, LASER_STEP, LASERS, OFFSET_M, PACKET_BYTES, Packet,
    ReturnMode, WireError, laser_of, ring_of,
};
use crate::observation::{Return, Sweep};
use crate::pose::wrap_angle;
use crate::time::{Span, Time};
use std::f64::consts::TAU;
use std::sync::LazyLock;

const BLOCKS: usize = 12;
const BLOCK_BYTES: usize = 100;
const BLOCK_FLAG: [u8; 2] = [0xff, 0xee];
const PRODUCT_VLP16: u8 = 0x22;
/// The HDL-32E's byte. Early VLP-16s say it too: the real capture that the tests read does.
const PRODUCT_EARLY: u8 = 0x21;
/// A VLP-16's packets are 1.327 ms apart (half of that in dual mode), an HDL-32E's 0.553 ms.
const PACE: Span = Span::from_nanos(620_000);
const HUNDREDTHS: i64 = 36_000;

/// Sine and cosine of each laser's elevation, in firing order.
static LINES: LazyLock<[(f64, f64); LASERS]> =
    LazyLock::new(|| ELEVATION_DEG.map(|elevation_deg| elevation_deg.to_radians().sin_cos()));

/// Elevation of each laser in firing order.
const ELEVATION_RAD: [f64; LASERS] = {
    let mut radians = [0.0; LASERS];
    let mut laser = 0;
    while laser < LASERS {
        radians[laser] = ELEVATION_DEG[laser].to_radians();
        laser += 1;
    }
    radians
};

/// The nearest whole number, halves away from zero, as `round` says; that is a call where processors of the first
/// 64-bit generation are served too.
#[inline(always)]
fn nearest(x: f64) -> i64 {
    let toward_zero = x as i64;
    let rest = x - toward_zero as f64;
    toward_zero.saturating_add(i64::from(rest >= 0.5) - i64::from(rest <= -0.5))
}

/// Packs a sweep of a VLP-16 in strongest-return mode; see [`encode_as`].
pub fn encode(sweep: &Sweep) -> Result<Vec<Packet>, WireError> {
    encode_as(sweep, ReturnMode::Strongest)
}

/// Packs a sweep of a VLP-16. Azimuths are rounded to 0.01 degree, distances to 2 mm.
///
/// The last packet's unused blocks carry no block flag; a firing that the sweep does not hold is written as a miss,
/// and a packet of which it holds no firing at all is left out, as one that got lost.
/// In dual mode every pair of cycles has two blocks: the last echo, then the strongest (manual p. 57); a second return of
/// a firing (`number` 1) is its last echo.
pub fn encode_as(sweep: &Sweep, mode: ReturnMode) -> Result<Vec<Packet>, WireError> {
    let cycle_ns = CYCLE_STEP.nanos();
    let cycles = mode.cycles_per_packet();
    let numbers = if mode == ReturnMode::Dual { 2 } else { 1 };
    let firing = |index: usize, one: &Return| {
        let after = one.fired_after.nanos();
        let laser = laser_of(one.ring.min(15));
        let exact = after >= 0 && after % cycle_ns == laser as i64 * LASER_STEP.nanos();
        (exact && one.ring < 16 && one.number < numbers)
            .then_some(((after / cycle_ns) as usize, laser))
            .ok_or(WireError::Firing { index, ring: one.ring, fired_after_ns: after })
    };
    let mut packets: Vec<Packet> = Vec::with_capacity(76);
    // The last packet's number and its first cycle; and the firing that comes next where none is missing.
    let (mut last, mut begin, mut next) = (None, 0, (0, 0));
    for (index, one) in sweep.returns.iter().enumerate() {
        let (cycle, laser) = if is_firing(one, next) { next } else { firing(index, one)? };
        next = if laser + 1 < LASERS { (cycle, laser + 1) } else { (cycle + 1, 0) };
        if last.is_none() || cycle < begin || cycle >= begin + cycles {
            let number = cycle / cycles;
            if last.is_some_and(|last| last > number) {
                return Err(WireError::Firing {
                    index,
                    ring: one.ring,
                    fired_after_ns: one.fired_after.nanos(),
                });
            }
            packets.push(blank(sweep.start, number, mode));
            (last, begin) = (Some(number), number * cycles);
        }
        let Some(packet) = packets.last_mut() else { continue };
        let pair = (cycle - begin) / 2;
        // The blocks of this pair of cycles, and the one of them that a second return replaces.
        let (first, count) = if mode == ReturnMode::Dual { (2 * pair, 2) } else { (pair, 1) };
        let blocks = &mut packet.payload[first * BLOCK_BYTES..][..count * BLOCK_BYTES];
        for (place, block) in blocks.chunks_exact_mut(BLOCK_BYTES).enumerate() {
            if laser == 0 && cycle % 2 == 0 {
                block[..2].copy_from_slice(&BLOCK_FLAG);
                block[2..4].copy_from_slice(&(hundredths_of(one.azimuth_rad) as u16).to_le_bytes());
            }
            if let Some(range_m) = one.range_m
                && (one.number == 0 || place == 0)
            {
                let steps =
                    whole_steps(range_m * cosine_of(one.elevation_rad) / LINES[laser].1 / DISTANCE_STEP_M);
                let at = 4 + 3 * (cycle % 2 * LASERS + laser);
                block[at..at + 2].copy_from_slice(&steps.to_le_bytes());
                block[at + 2] = byte_of(one.intensity);
            }
        }
    }
    Ok(packets)
}

/// Whether a first return is of this firing: cycle and laser.
#[inline(always)]
fn is_firing(one: &Return, (cycle, laser): (usize, usize)) -> bool {
    one.fired_after == CYCLE_STEP * cycle as i64 + LASER_STEP * laser as i64
        && one.ring == ring_of(laser)
        && one.number == 0
}

/// A bearing as the encoder counts it: clockwise from the connector's opposite, the negative of ours.
fn hundredths_of(azimuth_rad: f64) -> i64 {
    nearest(-azimuth_rad / TAU * HUNDREDTHS as f64).rem_euclid(HUNDREDTHS)
}

/// The cosine; of what a laser sees, without a call: Taylor's series, as good as double precision up to half a radian.
#[inline(always)]
fn cosine_of(angle_rad: f64) -> f64 {
    if angle_rad.abs() > 0.5 {
        return angle_rad.cos();
    }
    let x = angle_rad * angle_rad;
    let tail = 1.0 - x * (1.0 / 90.0) * (1.0 - x * (1.0 / 132.0) * (1.0 - x * (1.0 / 182.0)));
    1.0 - x * 0.5 * (1.0 - x * (1.0 / 12.0) * (1.0 - x * (1.0 / 30.0) * (1.0 - x * (1.0 / 56.0) * tail)))
}

/// A distance that is no miss, counted in steps of 2 mm, as the nearest whole number of them.
#[inline(always)]
fn whole_steps(steps: f64) -> u16 {
    // From one on, half a step more is exact, so that this is [`nearest`].
    (steps.clamp(1.0, f64::from(u16::MAX)) + 0.5) as u32 as u16
}

#[inline(always)]
fn byte_of(intensity: f32) -> u8 {
    // A number of single precision below a half is below it by more than double precision loses.
    (f64::from(intensity).clamp(0.0, 255.0) + 0.5) as u32 as u8
}

/// Share of the way to the next block's azimuth at each firing of a block.
static SHARES: LazyLock<[f64; 2 * LASERS]> =
    LazyLock::new(|| std::array::from_fn(|slot| after_block(slot).seconds() / (CYCLE_STEP * 2).seconds()));

/// When a firing of a block fires, after the block's first.
fn after_block(slot: usize) -> Span {
    CYCLE_STEP * (slot / LASERS) as i64 + LASER_STEP * (slot % LASERS) as i64
}

/// Clockwise bearing of a firing of a block, radians; the next block is `step` hundredths of a degree ahead.
#[inline(always)]
fn clockwise_of(azimuth: i64, step: i64, slot: usize) -> f64 {
    (azimuth as f64 + SHARES[slot] * step as f64) / HUNDREDTHS as f64 * TAU
}

/// A whole turn with one return a firing, over the wire without packets in between: bit for bit what [`decode`] makes of
/// [`encode`]'s packets.
#[derive(Debug, Clone)]
pub struct Turn {
    /// Azimuth of each block, and how far it is to the next one's; hundredths of a degree.
    blocks: Vec<(i64, i64)>,
}

impl Turn {
    /// `bearings_rad` are those of the first laser in every second cycle, counter-clockwise.
    pub fn new(bearings_rad: impl Iterator<Item = f64>) -> Self {
        let mut blocks: Vec<(i64, i64)> =
            bearings_rad.map(|bearing_rad| (hundredths_of(bearing_rad), 0)).collect();
        let mut step = 0;
        for index in 0..blocks.len() {
            if let Some((next, _)) = blocks.get(index + 1) {
                step = (next - blocks[index].0).rem_euclid(HUNDREDTHS);
            }
            blocks[index].1 = step;
        }
        Turn { blocks }
    }

    /// The return of a firing: cycles count from the turn's first, lasers in firing order; `along_beam_m` is `None` for a
    /// miss. The cycle must be one of the turn's.
    #[inline(always)]
    pub fn carry(&self, cycle: usize, laser: usize, along_beam_m: Option<f64>, intensity: f32) -> Return {
        let (azimuth, step) = self.blocks[cycle / 2];
        let (steps, byte) = along_beam_m
            .map_or((0, 0), |along_m| (whole_steps(along_m / DISTANCE_STEP_M), byte_of(intensity)));
        let [low, high] = steps.to_le_bytes();
        let fired_after = CYCLE_STEP * cycle as i64 + LASER_STEP * laser as i64;
        let clockwise = clockwise_of(azimuth, step, cycle % 2 * LASERS + laser);
        return_of(laser, clockwise, &[low, high, byte], 0, fired_after)
    }
}

fn blank(start: Time, number: usize, mode: ReturnMode) -> Packet {
    let stamp = start + CYCLE_STEP * (number * mode.cycles_per_packet()) as i64;
    let mut payload = [0_u8; PACKET_BYTES];
    // Microseconds past the hour, as the sensor counts them.
    let past_hour = (stamp.nanos() / 1000).rem_euclid(3_600_000_000) as u32;
    payload[1200..1204].copy_from_slice(&past_hour.to_le_bytes());
    payload[1204] = mode.byte();
    payload[1205] = PRODUCT_VLP16;
    Packet { stamp, payload }
}

/// Two firing cycles of a packet: one block, or in dual mode the block of the strongest echoes and that of the last.
struct Pair<'a> {
    time: Time,
    azimuth: i64,
    block: &'a [u8],
    last: Option<&'a [u8]>,
}

/// Unpacks the packets of one turn that ends at `end`. A firing cycle belongs to the turn in which its last laser
/// fires: cycles that are not over by `end` are padding and left out.
///
/// As the ROS driver does, the azimuth of a firing inside a block is interpolated toward the next block's; before a
/// packet that got lost it goes on at the pace before. In dual mode a firing has two returns where its echoes differ:
/// number 0 is the strongest (or second strongest), number 1 the last.
pub fn decode(packets: &[Packet], end: Time) -> Result<Sweep, WireError> {
    let start = packets.first().map_or(end, |packet| packet.stamp);
    let mut sweep =
        Sweep { start, end, rings: LASERS as u16, returns: Vec::with_capacity(packets.len() * 384) };
    let mut pairs: Vec<Pair<'_>> = Vec::with_capacity(packets.len() * BLOCKS);
    let paced = packets.len() > 1 && packets.windows(2).all(|pair| pair[1].stamp - pair[0].stamp > PACE);
    for packet in packets {
        pairs_of(packet, paced, &mut pairs)?;
    }
    // A gap of a whole packet is one that got lost; the stamps of a real recording jitter by less.
    let lost = CYCLE_STEP * 24;
    let step_after = |index: usize| {
        let (pair, next) = (&pairs[index], pairs.get(index + 1)?);
        (next.time - pair.time < lost).then(|| (next.azimuth - pair.azimuth).rem_euclid(HUNDREDTHS))
    };
    let mut step = 0;
    for (index, pair) in pairs.iter().enumerate() {
        step = step_after(index).unwrap_or(step);
        for slot in 0..2 * LASERS {
            let (cycle, laser) = (slot / LASERS, slot % LASERS);
            let after_block = after_block(slot);
            let last_laser = pair.time + CYCLE_STEP * cycle as i64 + LASER_STEP * (LASERS as i64 - 1);
            if last_laser >= end {
                continue;
            }
            let clockwise = clockwise_of(pair.azimuth, step, slot);
            let echo = &pair.block[4 + 3 * slot..][..3];
            let fired_after = pair.time + after_block - start;
            sweep.returns.push(return_of(laser, clockwise, echo, 0, fired_after));
            if let Some(last) = pair.last
                && last[4 + 3 * slot..][..3] != *echo
            {
                sweep.returns.push(return_of(laser, clockwise, &last[4 + 3 * slot..][..3], 1, fired_after));
            }
        }
    }
    Ok(sweep)
}

/// `paced` says whether the packets come as slowly as a VLP-16's.
fn pairs_of<'a>(packet: &'a Packet, paced: bool, pairs: &mut Vec<Pair<'a>>) -> Result<(), WireError> {
    let (mode_byte, product) = (packet.payload[1204], packet.payload[1205]);
    let mode = ReturnMode::of_byte(mode_byte)
        .filter(|_| product == PRODUCT_VLP16 || (product == PRODUCT_EARLY && paced))
        .ok_or(WireError::Factory { mode: mode_byte, product })?;
    let mut add = |number: usize, block: &'a [u8], last: Option<&'a [u8]>| {
        if block[..2] == BLOCK_FLAG {
            let azimuth = i64::from(u16::from_le_bytes([block[2], block[3]]));
            pairs.push(Pair { time: packet.stamp + CYCLE_STEP * (2 * number) as i64, azimuth, block, last });
        }
    };
    let mut blocks = packet.payload[..BLOCKS * BLOCK_BYTES].chunks_exact(BLOCK_BYTES);
    if mode == ReturnMode::Dual {
        let mut number = 0;
        while let (Some(last), Some(strongest)) = (blocks.next(), blocks.next()) {
            add(number, strongest, Some(last));
            number += 1;
        }
    } else {
        blocks.enumerate().for_each(|(number, block)| add(number, block, None));
    }
    Ok(())
}

#[inline(always)]
fn return_of(laser: usize, clockwise: f64, echo: &[u8], number: u8, fired_after: Span) -> Return {
    let steps = u16::from_le_bytes([echo[0], echo[1]]);
    let (sin, cos) = LINES[laser];
    let along_beam_m = f64::from(steps) * DISTANCE_STEP_M;
    let (horizontal, up) = (along_beam_m * cos, along_beam_m * sin + OFFSET_M[laser]);
    Return {
        azimuth_rad: wrap_angle(-clockwise),
        elevation_rad: elevation_of(laser, along_beam_m, steps != 0),
        range_m: (steps != 0).then(|| (horizontal * horizontal + up * up).sqrt()),
        ring: ring_of(laser),
        number,
        fired_after,
        intensity: f32::from(echo[2]),
    }
}

/// Elevation of a laser's point, or of the laser itself for a miss. From half a meter on the laser's height over the
/// sensor's center turns the point by less than 0.025 rad, where the arc tangent is the first five terms of its series.
#[inline(always)]
fn elevation_of(laser: usize, along_beam_m: f64, met: bool) -> f64 {
    let ((sin, cos), own_rad) = (LINES[laser], ELEVATION_RAD[laser]);
    if !met {
        return own_rad;
    }
    let (across_m, along_m) = (OFFSET_M[laser] * cos, along_beam_m + OFFSET_M[laser] * sin);
    if along_beam_m < 0.5 {
        return own_rad + across_m.atan2(along_m);
    }
    let turn = across_m / along_m;
    let square = turn * turn;
    let series = 1.0 - square * (1.0 / 3.0 - square * (0.2 - square * (1.0 / 7.0 - square * (1.0 / 9.0))));
    own_rad + turn * series
}
