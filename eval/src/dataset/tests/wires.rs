//! Every lidar's recording gives its sweeps back to the bit, misses and second returns included.

use crate::dataset::*;
use arborloop_base::os1::Os1;
use arborloop_base::vlp16::{CYCLE_STEP, LASER_STEP, ReturnMode, ring_of};
use arborloop_base::{Class, Label, Observation, Record, Return, Sink, Span, Sweep, Time, Wire, wrap_angle};
use std::path::Path;

const TURN: Span = Span::from_millis(100);

fn ouster() -> Os1 {
    Os1 {
        altitude_deg: vec![14.799, 2.183, 0.1, -16.858],
        azimuth_deg: vec![-3.387, -3.159, -3.129, -3.041],
        beam_radius_m: 0.015806,
        columns: 512,
        turn: TURN,
    }
}

fn return_of(n: usize, azimuth_rad: f64, ring: u16, fired_after: Span) -> Return {
    Return {
        azimuth_rad: wrap_angle(azimuth_rad),
        elevation_rad: 0.1 * f64::from(ring) - 0.2,
        range_m: (n % 4 != 1).then_some(1.0 + 0.013 * n as f64),
        ring,
        number: 0,
        fired_after,
        intensity: (n % 256) as f32,
    }
}

/// Sweeps as a lidar of this kind makes them.
fn sweeps(wire: &Wire) -> Vec<Sweep> {
    let mut sweeps = Vec::new();
    for turn in 0..3 {
        let start = Time::SIMULATION_START + TURN * turn;
        let mut sweep = Sweep { start, end: start + TURN, rings: 0, returns: Vec::new() };
        match wire {
            Wire::Ouster(sensor) => {
                sweep.rings = sensor.rows() as u16;
                for n in 0..sensor.rows() * sensor.columns as usize {
                    let (row, column) = (n % sensor.rows(), (n / sensor.rows()) as u32);
                    let bearing = sensor.encoder_rad(column) - sensor.azimuth_deg[row].to_radians();
                    let ring = (sensor.rows() - 1 - row) as u16;
                    sweep.returns.push(return_of(n, bearing, ring, sensor.column_after(column)));
                }
            }
            Wire::Plain => {
                sweep.rings = 3;
                for n in 0..900_usize {
                    let after = Span::from_nanos(1_234 + 100_001 * n as i64);
                    sweep.returns.push(return_of(n, 3.0 - 0.00697 * n as f64, (n % 3) as u16, after));
                }
            }
            Wire::Vlp16(mode) => {
                sweep.rings = 16;
                for n in 0..16 * 500_usize {
                    let (cycle, laser) = (n / 16, n % 16);
                    let after = CYCLE_STEP * cycle as i64 + LASER_STEP * laser as i64;
                    let one = return_of(n, 3.0 - 63.0 * after.seconds(), ring_of(laser), after);
                    sweep.returns.push(one);
                    if *mode == ReturnMode::Dual && n % 3 == 0 && one.range_m.is_some() {
                        let range_m = one.range_m.map(|range_m| range_m + 2.5);
                        sweep.returns.push(Return { number: 1, range_m, ..one });
                    }
                }
                sweep.end = sweep.start + CYCLE_STEP * 500;
            }
        }
        sweeps.push(wire.carry(&sweep).unwrap());
    }
    sweeps
}

fn record(dir: &Path, wire: &Wire, clouds: bool, sweeps: &[Sweep]) {
    let settings =
        RecorderSettings { name: "wire".into(), clouds, wire: wire.clone(), ..RecorderSettings::default() };
    let mut recorder = Recorder::create(dir, settings).unwrap();
    for sweep in sweeps {
        let now = sweep.end;
        recorder.write(now, &Record::Observation(&Observation::Sweep(sweep.clone()))).unwrap();
        let labels: Vec<Label> = (0..sweep.returns.len() as u32)
            .map(|instance| Label { class: Class::Leaf, instance, mixed: instance % 2 == 0, ..Label::MISS })
            .collect();
        recorder.write(now, &Record::Labels { sweep, labels: &labels }).unwrap();
    }
    recorder.finish().unwrap();
}

#[test]
fn every_lidars_sweeps_come_back_from_its_recording_to_the_bit() {
    let wires = [
        Wire::Vlp16(ReturnMode::Strongest),
        Wire::Vlp16(ReturnMode::Last),
        Wire::Vlp16(ReturnMode::Dual),
        Wire::Ouster(ouster()),
        Wire::Plain,
    ];
    for wire in wires {
        let given = sweeps(&wire);
        assert!(
            given.iter().all(|sweep| wire.carry(sweep).unwrap() == *sweep),
            "{wire:?} changes what it carried"
        );
        for clouds in [false, true] {
            let dir = tempfile::tempdir().unwrap();
            record(dir.path(), &wire, clouds, &given);
            let read: Vec<Observation> =
                open(dir.path()).unwrap().observations().unwrap().map(Result::unwrap).collect();
            let given: Vec<Observation> = given.iter().cloned().map(Observation::Sweep).collect();
            assert!(read == given, "{wire:?}, clouds {clouds}");
        }
    }
}

#[test]
fn a_plain_sweep_without_returns_keeps_its_times_and_rings() {
    let dir = tempfile::tempdir().unwrap();
    let start = Time::SIMULATION_START;
    let empty = Sweep { start, end: start + TURN, rings: 5, returns: Vec::new() };
    record(dir.path(), &Wire::Plain, false, std::slice::from_ref(&empty));
    let read: Vec<Observation> =
        open(dir.path()).unwrap().observations().unwrap().map(Result::unwrap).collect();
    assert_eq!(read, [Observation::Sweep(empty)]);
}
