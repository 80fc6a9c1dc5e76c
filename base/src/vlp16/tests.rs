use super::*;
use crate::observation::{Return, Sweep};
use crate::pose::wrap_angle;
use std::f64::consts::TAU;

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
    assert_eq!(Packet::from_bytes(Time::default(), &[0; 12]).unwrap_err(), WireError::Length { found: 12 });
    let blank = Packet::from_bytes(Time::default(), &[0; PACKET_BYTES]).unwrap();
    assert!(matches!(decode(&[blank], Time::default()), Err(WireError::Factory { .. })));
    let mut odd = turning_sweep(1);
    odd.returns[3].fired_after = Span::from_nanos(1);
    assert!(matches!(encode(&odd), Err(WireError::Firing { index: 3, .. })));
}

#[test]
fn an_early_head_with_the_hdl_32es_byte_is_read_and_an_hdl_32e_is_not() {
    let packets = encode(&turning_sweep(72)).unwrap();
    let end = packets[2].stamp + CYCLE_STEP * 24;
    let early: Vec<Packet> = packets
        .iter()
        .map(|packet| {
            let mut early = packet.clone();
            early.payload[1205] = 0x21;
            early
        })
        .collect();
    assert_eq!(decode(&early, end), decode(&packets, end));
    // An HDL-32E sends a packet every 0.553 ms.
    let hurried: Vec<Packet> = early
        .iter()
        .enumerate()
        .map(|(n, packet)| Packet {
            stamp: packets[0].stamp + Span::from_nanos(552_960 * n as i64),
            ..packet.clone()
        })
        .collect();
    assert_eq!(decode(&hurried, end), Err(WireError::Factory { mode: 0x37, product: 0x21 }));
}

/// A turn in which every third firing has a second echo behind its first.
fn dual_sweep(cycles: usize) -> Sweep {
    let mut sweep = turning_sweep(cycles);
    let returns = std::mem::take(&mut sweep.returns);
    for (n, one) in returns.into_iter().enumerate() {
        sweep.returns.push(one);
        if let (Some(range_m), 0) = (one.range_m, (n / 16 + n) % 3) {
            sweep.returns.push(Return { number: 1, range_m: Some(range_m + 3.0), intensity: 7.0, ..one });
        }
    }
    sweep
}

#[test]
fn dual_packets_hold_the_last_echo_in_even_blocks_and_the_strongest_in_odd_ones() {
    let sweep = dual_sweep(100);
    let packets = encode_as(&sweep, ReturnMode::Dual).unwrap();
    // Half as many firings a packet (manual p. 57).
    assert_eq!(packets.len(), 100_usize.div_ceil(12));
    assert_eq!((packets[1].stamp - packets[0].stamp).nanos(), 12 * 55_296);
    let range_m = |echo: &[u8]| f64::from(u16::from_le_bytes([echo[0], echo[1]])) * DISTANCE_STEP_M;
    let (mut same, mut apart) = (0, 0);
    for packet in &packets {
        assert_eq!(packet.payload[1204..], [0x39, 0x22]);
        let blocks: Vec<&[u8]> = packet.payload[..1200].chunks_exact(100).collect();
        for pair in blocks.chunks_exact(2) {
            let [last, strongest] = pair else { unreachable!("pairs have two blocks") };
            assert_eq!(last[..4], strongest[..4]);
            for (last, strongest) in last[4..].chunks_exact(3).zip(strongest[4..].chunks_exact(3)) {
                if last == strongest {
                    same += 1;
                } else {
                    assert!((range_m(last) - range_m(strongest) - 3.0).abs() <= 2.0 * DISTANCE_STEP_M);
                    assert_eq!(last[2], 7);
                    apart += 1;
                }
            }
        }
    }
    assert!(same > 500 && apart > 300, "{same} single, {apart} double");
    let once = decode(&packets, sweep.end).unwrap();
    assert_eq!(once.returns.len(), sweep.returns.len());
    assert_eq!(once, decode(&encode_as(&once, ReturnMode::Dual).unwrap(), once.end).unwrap());
    assert!(encode(&sweep).is_err(), "a single-return packet has no place for a second echo");
}

#[test]
fn a_lost_packet_leaves_a_gap_and_the_bearings_around_it_as_they_were() {
    let sweep = turning_sweep(240);
    let mut packets = encode(&sweep).unwrap();
    let whole = decode(&packets, sweep.end).unwrap();
    packets.remove(4);
    let gap = decode(&packets, sweep.end).unwrap();
    let kept = whole.returns.iter().enumerate().filter(|(n, _)| !(4 * 384..5 * 384).contains(n));
    assert_eq!(gap.returns.len(), 240 * 16 - 384);
    for (one, (_, before)) in gap.returns.iter().zip(kept) {
        assert_eq!(
            (one.fired_after, one.range_m, one.ring),
            (before.fired_after, before.range_m, before.ring)
        );
        // The last block before the gap goes on at the pace before: a step of 0.01 degree at most.
        assert!(wrap_angle(one.azimuth_rad - before.azimuth_rad).abs() <= 1.01 * TAU / 36_000.0);
    }
    // Written again, the gap is still a gap.
    assert_eq!(encode(&gap).unwrap().len(), packets.len());
    assert_eq!(decode(&encode(&gap).unwrap(), gap.end).unwrap(), gap);
}

#[test]
fn a_turn_without_packets_is_that_of_its_packets_to_the_bit() {
    for cycles in [1, 2, 23, 24, 25, 1808, 1809] {
        let raw = turning_sweep(cycles);
        let wired = decode(&encode(&raw).unwrap(), raw.end).unwrap();
        let firsts = raw.returns.iter().step_by(2 * LASERS).map(|one| one.azimuth_rad);
        let turn = Turn::new(firsts);
        for (number, (one, wired)) in raw.returns.iter().zip(&wired.returns).enumerate() {
            let (cycle, laser) = (number / LASERS, number % LASERS);
            let cos = ELEVATION_DEG[laser].to_radians().cos();
            let along_m = one.range_m.map(|range_m| range_m * one.elevation_rad.cos() / cos);
            assert_eq!(
                turn.carry(cycle, laser, along_m, one.intensity),
                *wired,
                "return {number} of {cycles} cycles"
            );
        }
    }
}
