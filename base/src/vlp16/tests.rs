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
