//! Every fault by its documented effect.

use super::super::*;
use super::scene::*;
use arborloop_base::{Class, Return, Seed};

fn wall() -> Optics {
    optics(vec![plate(10.0, 0.0, 60.0, 0.9, 0.0)], Vec::new())
}

fn vlp16(faults: &[FaultSpec]) -> Lidar {
    let spec = LidarSpec { dropout_ratio: 0.0, range_noise_m: 0.0, ..LidarSpec::default() };
    let mount = Pose::translation(0.0, 0.0, HEIGHT_M);
    Lidar::new(&spec, Span::from_millis(100), mount, Seed(3).stream("lidar"))
        .under(&WeatherSpec::default(), faults)
}

#[test]
fn a_blackout_turns_every_firing_into_a_miss_while_it_lasts() {
    let fault = FaultSpec::Blackout { from_s: 0.03, for_s: 0.03 };
    let well = first_sweep(&mut vlp16(&[]), &wall());
    let dark = first_sweep(&mut vlp16(&[fault]), &wall());
    assert_eq!(well.1.len(), dark.1.len());
    let mut struck = 0;
    for ((one, before), (label, truth)) in
        dark.0.returns.iter().zip(&well.0.returns).zip(dark.1.iter().zip(&well.1))
    {
        if (0.03..0.06).contains(&one.fired_after.seconds()) {
            assert_eq!(one.range_m, None);
            struck += usize::from(before.range_m.is_some());
        } else {
            assert_eq!(one, before);
        }
        assert_eq!(label.class, truth.class);
    }
    assert!(struck > 1000);
}

#[test]
fn frozen_stamps_claim_one_instant_and_say_the_same_points() {
    let fault = FaultSpec::FrozenStamps { from_s: 0.0, for_s: 1.0 };
    let mut lidar = vlp16(&[fault]);
    assert_eq!(lidar.wire, Wire::Plain);
    let (frozen, _) = first_sweep(&mut lidar, &wall());
    let (well, _) = first_sweep(&mut vlp16(&[]), &wall());
    assert_eq!(frozen.returns.len(), well.returns.len());
    assert!(frozen.returns.iter().all(|one| one.fired_after == Span::default()));
    for (one, before) in frozen.returns.iter().zip(&well.returns) {
        assert_eq!((one.ring, one.intensity), (before.ring, before.intensity));
        // The packets' bearings are interpolated over a block.
        assert!((one.range_m.unwrap_or(0.0) - before.range_m.unwrap_or(0.0)).abs() < 0.002);
    }
}

#[test]
fn skewed_stamps_move_the_whole_sweep_and_nothing_else() {
    let fault = FaultSpec::SkewedStamps { from_s: 0.0, for_s: 1.0, offset_s: -0.03 };
    let (skewed, _) = first_sweep(&mut vlp16(&[fault]), &wall());
    let (well, _) = first_sweep(&mut vlp16(&[]), &wall());
    let earlier = Span::from_millis(-30);
    assert_eq!((skewed.start, skewed.end), (well.start + earlier, well.end + earlier));
    assert_eq!(skewed.returns, well.returns);
}

#[test]
fn swapped_rings_report_each_others_ranges() {
    let fault = FaultSpec::SwappedRings { from_s: 0.0, for_s: 1.0, rings: [0, 15] };
    let (swapped, labels) = first_sweep(&mut vlp16(&[fault]), &wall());
    let (well, truth) = first_sweep(&mut vlp16(&[]), &wall());
    let of = |sweep: &Sweep, ring: u16| -> Vec<Option<f64>> {
        sweep.returns.iter().filter(|one| one.ring == ring).map(|one| one.range_m).collect()
    };
    let classes = |sweep: &Sweep, labels: &[Label], ring: u16| -> Vec<Class> {
        let all = sweep.returns.iter().zip(labels);
        all.filter(|(one, _)| one.ring == ring).map(|(_, label)| label.class).collect()
    };
    for (ring, other) in [(0, 15), (15, 0)] {
        for (a, b) in of(&swapped, ring).iter().zip(of(&well, other)) {
            // Two centimeters of height between the lasers, along a beam of fifteen degrees.
            assert_eq!(a.is_some(), b.is_some());
            assert!((a.unwrap_or(0.0) - b.unwrap_or(0.0)).abs() < 0.01);
        }
        assert_eq!(classes(&swapped, &labels, ring), classes(&well, &truth, other));
    }
    assert_eq!(of(&swapped, 7), of(&well, 7));
    let upper = swapped.returns.iter().filter(|one| one.ring == 15 && one.range_m.is_some());
    assert!(upper.clone().count() > 1000 && upper.map(|one| one.elevation_rad).all(|up| up > 0.25));
}

#[test]
fn lost_packets_are_whole_and_as_many_as_their_ratio_says() {
    let fault = FaultSpec::DroppedPackets { from_s: 0.0, for_s: 10.0, ratio: 0.3 };
    let mut lidar = vlp16(&[fault]);
    let (motion, scene) = (standing(), wall());
    let (mut lost, mut packets) = (0.0, 0.0);
    for turn in 1..=3 {
        let end = Time::SIMULATION_START + lidar.period() * turn;
        let cycles = lidar.schedule.cycles(end);
        let (sweep, labels) = lidar.sweep(end, Surroundings { motion: &motion, optics: &scene });
        assert_eq!(labels.len(), sweep.returns.len());
        let first = lidar.schedule.start(cycles.start);
        let packet = |one: &Return| (sweep.start + one.fired_after - first).nanos() / (24 * 55_296);
        let all = (cycles.end - cycles.start + 23) / 24;
        for number in 0..all {
            let held = sweep.returns.iter().filter(|one| packet(one) == number).count() as i64;
            let whole = 16 * (cycles.end - cycles.start - 24 * number).min(24);
            assert!(held == 0 || held == whole, "{held} of {whole}");
            (lost, packets) = (lost + f64::from(u8::from(held == 0)), packets + 1.0);
        }
    }
    assert!((lost - 0.3 * packets).abs() < 4.0 * f64::sqrt(0.21 * packets), "{lost} of {packets}");
    let all = FaultSpec::DroppedPackets { from_s: 0.0, for_s: 10.0, ratio: 1.0 };
    let (none, labels) = first_sweep(&mut vlp16(&[all]), &wall());
    assert!(none.returns.is_empty() && labels.is_empty() && none.start < none.end);
}

#[test]
fn dirt_hides_its_sector_and_weakens_it_where_light_gets_through() {
    let dirt = |transmittance_ratio| FaultSpec::DirtSector {
        from_s: 0.0,
        for_s: 1.0,
        azimuth_deg_min: -20.0,
        azimuth_deg_max: 10.0,
        transmittance_ratio,
    };
    let (well, _) = first_sweep(&mut vlp16(&[]), &wall());
    for transmittance_ratio in [0.0, 0.8] {
        let (dirty, _) = first_sweep(&mut vlp16(&[dirt(transmittance_ratio)]), &wall());
        let mut struck = 0;
        for (one, before) in dirty.returns.iter().zip(&well.returns) {
            let azimuth_deg = before.azimuth_rad.to_degrees();
            if (-19.9..9.9).contains(&azimuth_deg) && before.range_m.is_some() {
                let law = (f64::from(before.intensity) * transmittance_ratio * transmittance_ratio).round();
                let told = one.range_m.map_or(0.0, |_| f64::from(one.intensity));
                assert!((told - law).abs() <= 1.0 || one.range_m.is_none(), "{one:?}, before {before:?}");
                assert!(one.range_m.is_none() || transmittance_ratio > 0.0);
                struck += 1;
            } else if !(-20.1..10.1).contains(&azimuth_deg) {
                assert_eq!(one, before);
            }
        }
        assert!(struck > 1000);
    }
}
