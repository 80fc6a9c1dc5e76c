//! The study of the physics gait: every acceptance bar with its figure.
//!
//! `cargo bench -p arborloop-sim --bench gait` prints all; words after `--` choose among `stand`, `flat`, `uneven`,
//! `hard`, `trend`, `steps`, `strides`, `controller`, `spectrum`, `digest` and, only when asked for, `long` (30 simulated minutes),
//! `library` (records `robots/assets/go1.strides` anew) and `serve` (the controller for `tools/compare_mujoco.py`). Times are processor time of this thread.

#![allow(clippy::unwrap_used)] // A development tool.

#[path = "../tests/walked/mod.rs"]
mod walked;

#[path = "gait/serve.rs"]
mod serve;

use arborloop_robots::{Command, GaitMode, Sensed, TrotSettings, TrunkState, Walker};
use cpu_time::ThreadTime;
use walked::bars::{between_ticks, distortion, stepped};
use walked::{Guide, Measured, STRIDE_HZ, Walk, band, ground, imu_az, numbers, walk};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    if words.first().is_some_and(|word| word == "serve") {
        return serve::serve(&words[1..]);
    }
    let always: [(&str, fn()); 10] = [
        ("stand", stand),
        ("flat", flat),
        ("uneven", uneven),
        ("hard", hard),
        ("trend", trend),
        ("steps", steps),
        ("strides", strides),
        ("controller", controller),
        ("spectrum", spectrum),
        ("digest", digest),
    ];
    let asked: [(&str, fn()); 2] = [("long", long), ("library", library)];
    for (word, study) in always {
        if words.is_empty() || words.iter().any(|one| one == word) {
            study();
        }
    }
    for (word, study) in asked {
        if words.iter().any(|one| one == word) {
            study();
        }
    }
}

fn ahead(forward_mps: f64) -> Guide {
    Guide::Always(Command { forward_mps, turn_radps: 0.0 })
}

fn pushed() -> TrotSettings {
    let mut settings = TrotSettings::default();
    settings.physics.push_mps = 0.15;
    settings
}

/// A walk and how many times faster than real time it was made.
fn timed(make: impl FnOnce() -> Walk) -> (Walk, f64) {
    let from = ThreadTime::now();
    let made = make();
    let seconds = made.states.len() as f64 * walked::TICK_S;
    let factor = seconds / from.elapsed().as_secs_f64();
    (made, factor)
}

fn stand() {
    let (walk, factor) = timed(|| walk(&ground(0.0, 0.0, 1), &TrotSettings::default(), &ahead(0.0), 11.0, 1));
    let (Some(from), Some(last)) = (walk.states.get(999), walk.states.last()) else {
        println!("stand: fell, {:?}", walk.fall);
        return;
    };
    let force: nalgebra::Vector3<f64> =
        last.loads.map(|loads| loads.foot_forces_n.iter().sum()).unwrap_or_default();
    let weight_n = 9.806_65 * arborloop_robots::Body::go1().mass_kg;
    let moved = last.world_from_base.translation.vector - from.world_from_base.translation.vector;
    let turned = from.world_from_base.rotation.angle_to(&last.world_from_base.rotation).to_degrees();
    println!(
        "stand: force {:.2} N of {weight_n:.2} N weight; drift {:.3} mm/s, {:.4} deg/s; {factor:.1} x real time",
        force.z,
        moved.norm() * 1e3 / 10.0,
        turned / 10.0
    );
}

fn line(name: &str, walk: &Walk, factor: f64) {
    let Some(found) = measured(walk) else {
        println!("{name}: {}", verdict(walk));
        return;
    };
    println!(
        "{name}: {}; speed {:.3} m/s, beside the path {:.1} / {:.1} cm rms / max; torque {:.1} / {:.1} / {:.1} N m, knee \
         {:.1} rms; rate {:.1} / {:.1} / {:.1} rad/s; saturated {:.0e}; duty {:.2?}; cost of transport {:.2} abs, {:.2} \
         positive; az {:.2} / {:.2} / {:.2} m/s2 in 1-20 / 20-100 / 100-400 Hz, peak {:.0}, 99th percentile below 100 Hz {:.1}; f 2f 4f 6f 8f {:.2?} m/s2, peaks \
         at {:.2?} Hz; roll {:.2} deg, pitch {:.2} deg, bob {:.1} mm; {factor:.1} x real time",
        verdict(walk),
        found.speed_mps,
        found.cross_rms_m * 100.0,
        found.cross_max_m * 100.0,
        found.torque_max_nm[0],
        found.torque_max_nm[1],
        found.torque_max_nm[2],
        found.knee_rms_nm,
        found.rate_max_radps[0],
        found.rate_max_radps[1],
        found.rate_max_radps[2],
        found.saturated,
        found.duty,
        found.cost_abs,
        found.cost_positive,
        found.az_mps2[0],
        found.az_mps2[1],
        found.az_mps2[2],
        found.az_peak_mps2,
        found.az_percentile_mps2,
        found.harmonics_mps2,
        found.peaks_hz,
        found.roll_deg,
        found.pitch_deg,
        found.bob_m * 1e3
    );
}

fn measured(walk: &Walk) -> Option<Measured> {
    (walk.states.len() > 7000).then(|| walk.measured())
}

fn verdict(walk: &Walk) -> String {
    walk.fall.map_or("no fall".to_owned(), |fall| {
        format!("fell after {:.3} s: {}", fall.after.seconds(), fall.cause)
    })
}

fn flat() {
    let (straight, factor) =
        timed(|| walk(&ground(0.0, 0.0, 1), &TrotSettings::default(), &ahead(0.5), 20.0, 1));
    line("flat, straight on, seed 1", &straight, factor);
    for seed in 1..=5 {
        let (one, factor) =
            timed(|| walk(&ground(0.0, 0.0, seed), &pushed(), &Guide::Rectangle(0.5), 60.0, seed));
        line(&format!("flat rectangle, pushes, seed {seed}"), &one, factor);
    }
}

fn uneven() {
    for seed in 1..=5 {
        let (one, factor) =
            timed(|| walk(&ground(0.03, 5.0, seed), &pushed(), &Guide::Rectangle(0.5), 60.0, seed));
        line(&format!("3 cm, 5 deg rectangle, pushes, seed {seed}"), &one, factor);
    }
}

fn hard() {
    for (bump_m, slope_deg) in [(0.0, 10.0), (0.05, 0.0), (0.05, 10.0), (0.08, 15.0)] {
        for seed in 1..=5 {
            let world = ground(bump_m, slope_deg, seed);
            let one = walk(&world, &TrotSettings::default(), &Guide::Rectangle(0.5), 30.0, seed);
            println!("{} cm, {slope_deg} deg, 30 s, seed {seed}: {}", bump_m * 100.0, verdict(&one));
        }
    }
}

fn trend() {
    for touchdown_mps in [0.0, 0.1, 0.2, 0.3, 0.4] {
        let mut settings = TrotSettings::default();
        settings.physics.touchdown_mps = touchdown_mps;
        let found = walk(&ground(0.0, 0.0, 1), &settings, &ahead(0.5), 11.0, 1).measured();
        println!("touchdown {touchdown_mps} m/s: az 20-100 Hz {:.2} m/s2", found.az_mps2[1]);
    }
    for speed_mps in [0.25, 0.5, 0.75, 1.0] {
        let (one, factor) =
            timed(|| walk(&ground(0.0, 0.0, 1), &TrotSettings::default(), &ahead(speed_mps), 11.0, 1));
        line(&format!("{speed_mps} m/s"), &one, factor);
    }
}

fn steps() {
    let shaking = |world_bump_m: f64, substeps: u32| {
        let mut settings = TrotSettings::default();
        settings.physics.substeps = substeps;
        let found = walk(&ground(world_bump_m, 0.0, 1), &settings, &ahead(0.5), 20.0, 1).measured();
        found.az_mps2[0].hypot(found.az_mps2[1])
    };
    for bump_m in [0.0, 0.03] {
        let (one, four) = (shaking(bump_m, 1), shaking(bump_m, 4));
        println!(
            "{bump_m} m bumps: az below 100 Hz {one:.3} m/s2 with 1 substep, {four:.3} with 4: {:+.1} %",
            (one / four - 1.0) * 100.0
        );
    }
}

/// Ticks of other lengths, poses between ticks, and what the controller costs.
fn controller() {
    let at = |tick_s: f64| {
        let states = stepped(&ground(0.0, 0.0, 1), 0.5, tick_s, 11.0);
        let az = walked::imu_az_at(&states[(2.0 / tick_s) as usize..], tick_s);
        let held = (tick_s / walked::TICK_S).round() as usize;
        let az: Vec<f64> = az.iter().flat_map(|one| std::iter::repeat_n(*one, held)).collect();
        band(&az, 1.0, 100.0)
    };
    let (one, two) = (at(0.001), at(0.002));
    println!("az below 100 Hz {one:.3} m/s2 at 1 ms, {two:.3} at 2 ms: {:+.1} %", (two / one - 1.0) * 100.0);
    let fine = stepped(&ground(0.03, 5.0, 1), 0.5, 0.00025, 6.0);
    let (off_m, off_deg) = between_ticks(&fine[4000..], 4);
    println!(
        "poses between ticks of 1 ms against 4 kHz: {:.4} mm, {off_deg:.5} deg at the most",
        off_m * 1e3
    );
    let one = walk(&ground(0.03, 5.0, 1), &TrotSettings::default(), &ahead(0.5), 10.0, 1);
    let sensed: Vec<Sensed> = one.states.iter().filter_map(sensed).collect();
    let body = arborloop_robots::Body::go1();
    let mut walker = Walker::new(body, TrotSettings::default(), &sensed[0], walked::TICK_S);
    let mut blocks: Vec<f64> = sensed
        .chunks_exact(100)
        .map(|block| {
            let from = ThreadTime::now();
            for one in block {
                std::hint::black_box(walker.step(&Command { forward_mps: 0.5, turn_radps: 0.0 }, one));
            }
            from.elapsed().as_secs_f64() * 1e6 / 100.0
        })
        .collect();
    blocks.sort_by(f64::total_cmp);
    println!("controller: {:.1} us a tick, median of blocks of 100", blocks[blocks.len() / 2]);
}

fn sensed(state: &TrunkState) -> Option<Sensed> {
    let loads = state.loads?;
    Some(Sensed {
        odom_from_base: state.world_from_base,
        linear_mps: state.linear_mps,
        angular_radps: state.angular_radps,
        joint_angles_rad: state.joint_angles_rad,
        joint_rates_radps: loads.joint_rates_radps,
        foot_forces_n: loads.foot_forces_n.map(|force| force.norm()),
    })
}

fn strides() {
    for (bump_m, speed_mps) in [(0.0, 0.25), (0.0, 0.5), (0.0, 0.8), (0.03, 0.5)] {
        for mode in [GaitMode::Physics, GaitMode::Strides, GaitMode::Smooth] {
            let settings = TrotSettings { mode, ..TrotSettings::default() };
            let (one, factor) =
                timed(|| walk(&ground(bump_m, 0.0, 1), &settings, &ahead(speed_mps), 15.0, 1));
            let found = one.measured();
            println!(
                "{} cm, {speed_mps} m/s, {mode:?}: az {:.2} / {:.2} / {:.2} m/s2, roll {:.2} deg, pitch {:.2} deg, bob {:.1} mm, a sweep bent by {:.3} deg; {factor:.0} x real time",
                bump_m * 100.0,
                found.az_mps2[0],
                found.az_mps2[1],
                found.az_mps2[2],
                found.roll_deg,
                found.pitch_deg,
                found.bob_m * 1e3,
                distortion(&one.states[2000..]).1
            );
        }
    }
}

/// The spectrum of the vertical acceleration as bars of text, in bands of half the stride's frequency.
fn spectrum() {
    let one = walk(&ground(0.0, 0.0, 1), &TrotSettings::default(), &ahead(0.5), 20.0, 1);
    let az = imu_az(&one.states[2000..]);
    println!("vertical acceleration at the IMU, flat, 0.5 m/s; rms per band, one # is 0.02 m/s2");
    for n in 1..60 {
        let (low_hz, high_hz) =
            ((f64::from(n) - 0.5) * STRIDE_HZ / 2.0, (f64::from(n) + 0.5) * STRIDE_HZ / 2.0);
        let rms = band(&az, low_hz, high_hz);
        println!("{:6.2} Hz {rms:5.3} {}", f64::from(n) * STRIDE_HZ / 2.0, "#".repeat((rms / 0.02) as usize));
    }
    let strides = TrotSettings { mode: GaitMode::Strides, ..TrotSettings::default() };
    let replayed = walk(&ground(0.0, 0.0, 1), &strides, &ahead(0.5), 20.0, 1);
    let path = std::env::temp_dir().join("arborloop-gait-spectrum.svg");
    match std::fs::write(&path, plot(&[&az, &imu_az(&replayed.states[2000..])])) {
        Ok(()) => println!("spectrum drawn in {}", path.display()),
        Err(error) => println!("{}: {error}", path.display()),
    }
}

/// Spectra of physics and of its replay, 0 to 100 Hz in bands of 1 Hz, as a drawing; each grid line is a factor of ten.
fn plot(signals: &[&[f64]; 2]) -> String {
    let (width, height) = (900.0, 420.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-70 -30 {} {}\" font-family=\"sans-serif\" font-size=\"14\">\
         <title>Vertical acceleration at the IMU, flat ground, 0.5 m/s: m/s2 rms per band of 1 Hz</title>\
         <rect x=\"-70\" y=\"-30\" width=\"100%\" height=\"100%\" fill=\"white\"/>\
         <text x=\"0\" y=\"-10\">az at the IMU, m/s2 rms per 1 Hz: physics (solid), replayed strides (dashed)</text>",
        width + 90.0,
        height + 80.0
    );
    let place = |hz: f64, rms: f64| (hz / 100.0 * width, (0.5 - rms.max(1e-4).log10()) / 4.5 * height);
    for power in -4..=0 {
        let (_, y) = place(0.0, 10_f64.powi(power));
        svg += &format!("<line x1=\"0\" x2=\"{width}\" y1=\"{y}\" y2=\"{y}\" stroke=\"#ccc\"/>");
        svg += &format!("<text x=\"-60\" y=\"{}\">1e{power}</text>", y + 5.0);
    }
    for hz in (0..=100).step_by(10) {
        let (x, _) = place(f64::from(hz), 1.0);
        svg += &format!("<text x=\"{}\" y=\"{}\">{hz} Hz</text>", x - 12.0, height + 25.0);
    }
    for (signal, style) in
        signals.iter().zip(["stroke=\"#0072b2\"", "stroke=\"#d55e00\" stroke-dasharray=\"5 3\""])
    {
        let points = (1..100).map(|n| {
            let (x, y) = place(f64::from(n), band(signal, f64::from(n) - 0.5, f64::from(n) + 0.5));
            format!("{x:.1},{y:.1}")
        });
        let points = points.collect::<Vec<_>>().join(" ");
        svg += &format!("<polyline fill=\"none\" stroke-width=\"2\" {style} points=\"{points}\"/>");
    }
    svg + "</svg>\n"
}

/// A number that two processes must agree on (FNV-1a over every bit of a walk).
fn digest() {
    let one = walk(&ground(0.03, 5.0, 1), &pushed(), &Guide::Rectangle(0.5), 60.0, 1);
    let bytes = one.states.iter().flat_map(numbers).flat_map(|number| number.to_bits().to_le_bytes());
    let hash = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    println!("digest of 60 s of all states: {hash:016x}");
}

fn long() {
    let one = walk(&ground(0.0, 0.0, 1), &TrotSettings::default(), &Guide::Rectangle(0.5), 1800.0, 1);
    let norm =
        one.states.iter().map(|s| (s.world_from_base.rotation.coords.norm() - 1.0).abs()).fold(0.0, f64::max);
    let mean = |part: &[arborloop_robots::TrunkState]| {
        part.iter().map(|s| s.world_from_base.translation.z).sum::<f64>() / part.len().max(1) as f64
    };
    let minutes: Vec<f64> = one.states.chunks(60_000).map(mean).collect();
    let low = minutes.iter().copied().fold(f64::INFINITY, f64::min);
    let high = minutes.iter().copied().fold(0.0, f64::max);
    println!(
        "30 min: {}; quaternion off by {norm:.1e}; mean height of each minute {:.2} to {:.2} mm",
        verdict(&one),
        low * 1e3,
        high * 1e3
    );
}

fn library() {
    let Some(library) = walked::strides::library() else {
        println!("library: a walk fell, nothing is written");
        return;
    };
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots/assets/go1.strides");
    match std::fs::write(path, library.encode()) {
        Ok(()) => println!("library: {} kinds of strides written to {path}", library.bins().len()),
        Err(error) => println!("library: {path}: {error}"),
    }
}
