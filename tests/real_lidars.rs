//! The simulated lidars beside real ones: packets of a VLP-16 on a road, the beam table of an OS1-16.

use crate::check::cone_field;
use arborloop_base::vlp16::{CYCLE_STEP, LASER_STEP, LASERS, Packet, decode, encode, ring_of};
use arborloop_base::{Observation, Seed, Span, Sweep, Time};
use arborloop_sim::Simulator;
use arborloop_sim::sensor::LidarModel;
use std::path::{Path, PathBuf};

/// A file of the real data; `None`, and a word on standard error, where there is none.
fn real(file: &str) -> Option<Vec<u8>> {
    let data = std::env::var_os("ARBORLOOP_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let path = data.join(file);
    if !path.is_file() {
        eprintln!("skipped: {} is absent (set ARBORLOOP_DATA)", path.display());
        return None;
    }
    Some(std::fs::read(path).unwrap())
}

/// Data packets of a capture file: a header of 24 bytes, then records of 16 bytes of header and the frame, whose payload
/// stands behind 42 bytes of Ethernet, IP and UDP.
fn packets(capture: &[u8]) -> Vec<Packet> {
    let mut packets = Vec::new();
    let mut at = 24;
    while let Some(header) = capture.get(at..at + 16) {
        let number = |from: usize| u32::from_le_bytes([0, 1, 2, 3].map(|n| header[from + n]));
        let length = number(8) as usize;
        let frame = &capture[at + 16..at + 16 + length];
        at += 16 + length;
        if frame.len() != 42 + 1206 {
            continue;
        }
        // The sensor's own clock: microseconds past the hour.
        let past_hour = u32::from_le_bytes([0, 1, 2, 3].map(|n| frame[42 + 1200 + n]));
        packets
            .push(Packet::from_bytes(Time::from_nanos(i64::from(past_hour) * 1000), &frame[42..]).unwrap());
    }
    packets
}

/// Azimuths of the blocks, hundredths of a degree.
fn azimuths(packets: &[Packet]) -> Vec<i64> {
    let blocks = packets.iter().flat_map(|packet| packet.payload[..1200].chunks_exact(100));
    let flagged = blocks.filter(|block| block[..2] == [0xff, 0xee]);
    flagged.map(|block| i64::from(u16::from_le_bytes([block[2], block[3]]))).collect()
}

fn steps(azimuths: &[i64]) -> Vec<i64> {
    azimuths.windows(2).map(|pair| (pair[1] - pair[0]).rem_euclid(36_000)).collect()
}

fn simulated(changes: &[&str]) -> Sweep {
    let scenario = cone_field(changes);
    let mut sim = Simulator::new(&scenario, Seed(1));
    loop {
        for observation in sim.step() {
            if let Observation::Sweep(sweep) = observation {
                return sweep;
            }
        }
    }
}

#[test]
fn simulated_packets_have_the_structure_of_a_real_capture() {
    let Some(capture) = real("velodyne/velodyne_vlp16.pcap") else { return };
    let captured = packets(&capture);
    assert!(captured.len() > 50, "{} packets", captured.len());
    // As fast as the real head turned: degrees over the sensor's own clock.
    let real_steps = steps(&azimuths(&captured));
    let mean = real_steps.iter().sum::<i64>() as f64 / real_steps.len() as f64;
    let rate_hz = mean / 36_000.0 / (CYCLE_STEP * 2).seconds();
    let rate_hz = (rate_hz / 5.0).round() * 5.0;
    let sweep = simulated(&[&format!("lidar.rate_hz={rate_hz:.1}")]);
    let made = encode(&sweep).unwrap();
    let made_steps = steps(&azimuths(&made));
    let made_mean = made_steps.iter().sum::<i64>() as f64 / made_steps.len() as f64;
    println!("real head {rate_hz} Hz: {mean:.3} hundredths a block, simulated {made_mean:.3}");
    // A motor holds its pace to a percent; ours holds it exactly, and both move by whole hundredths.
    assert!(
        (mean / made_mean - 1.0).abs() < 0.01,
        "{mean} against {made_mean} hundredths of a degree a block"
    );
    assert!(real_steps.iter().all(|step| (*step as f64 - mean).abs() < 0.25 * mean));
    assert!(made_steps.iter().all(|step| (*step as f64 - made_mean).abs() <= 1.0));
    // 753.5 packets a second on the sensor's clock of whole microseconds.
    let period_ns = (CYCLE_STEP * 24).nanos();
    for (all, jitter_ns) in [(&captured, 2_000), (&made, 0)] {
        for pair in all.windows(2) {
            assert!(((pair[1].stamp - pair[0].stamp).nanos() - period_ns).abs() <= jitter_ns);
        }
    }
    // Mode and product (this early head says the HDL-32E's byte), and full packets but for the simulated turn's last.
    let factory = |packet: &Packet| [packet.payload[1204], packet.payload[1205]];
    assert!(captured.iter().all(|packet| factory(packet) == [0x37, 0x21]));
    assert!(made.iter().all(|packet| factory(packet) == [0x37, 0x22]));
    assert_eq!(azimuths(&made[..1]).len(), 12);
    assert_eq!(azimuths(&captured[..1]).len(), 12);
}

#[test]
fn a_real_capture_decodes_to_the_rings_and_times_of_a_simulated_sweep() {
    let Some(capture) = real("velodyne/velodyne_vlp16.pcap") else { return };
    let captured = packets(&capture);
    let end = captured.last().unwrap().stamp + CYCLE_STEP * 24;
    let read = decode(&captured, end).unwrap();
    assert_eq!(read.returns.len(), captured.len() * 24 * LASERS);
    let made = simulated(&[]);
    for (n, (one, ours)) in read.returns.iter().zip(&made.returns).enumerate() {
        assert_eq!((one.ring, ours.ring), (ring_of(n % LASERS), ring_of(n % LASERS)));
        assert_eq!(ours.fired_after, CYCLE_STEP * (n / LASERS) as i64 + LASER_STEP * (n % LASERS) as i64);
        // The real clock says whole microseconds at each packet.
        assert!((one.fired_after - ours.fired_after).abs() <= Span::from_nanos(2_000 + n as i64 / 8));
    }
    let hits = read.returns.iter().filter(|one| one.range_m.is_some()).count();
    assert!(hits > read.returns.len() / 4, "{hits} of {}", read.returns.len());
    assert!(read.returns.iter().all(|one| one.range_m.is_none_or(|range_m| (0.2..131.1).contains(&range_m))));
}

#[test]
fn the_os1_16s_beams_are_those_of_a_real_one() {
    let Some(metadata) = real("ouster/os1-16-A0_metadata.json") else { return };
    let text = String::from_utf8(metadata).unwrap();
    let list = |key: &str| -> Vec<f64> {
        let (_, rest) = text.split_once(&format!("\"{key}\": [")).unwrap();
        rest.split(']').next().unwrap().split(',').map(|number| number.trim().parse().unwrap()).collect()
    };
    let model = LidarModel::embedded("os1-16").unwrap();
    assert_eq!(model.beams.elevation_deg, list("beam_altitude_angles"));
    assert_eq!(model.beams.azimuth_deg, list("beam_azimuth_angles"));
    assert!(text.contains("\"pixel_shift_by_row\": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]"));
    let sweep = simulated(&["lidar.model=os1-16"]);
    assert_eq!((sweep.rings, sweep.returns.len()), (16, 16 * 1024));
}
