//! Time and allocations per sweep of every system, against the size of the map that it has already drawn.

#[path = "../tests/grove/mod.rs"]
mod grove;

use arborloop_base::{Observation, Slam, Span, Sweep, Time, pose2};
use arborloop_slam::{Rig, build_default};
use grove::Grove;

#[global_allocator]
static ALLOCATOR: divan::AllocProfiler = divan::AllocProfiler::system();

fn main() {
    divan::main();
}

/// A system that has walked `way_m` through a grove, and its next sweep.
fn walked(name: &str, way_m: f64, sweep_at: impl Fn(f64, Time) -> Sweep) -> (Box<dyn Slam>, Observation) {
    let mut slam = build_default(name, &Rig::default()).expect("the names below are the crate's own");
    let steps = (way_m / 0.25) as i32;
    let observation = |step: i32| {
        let stamp = Time::SIMULATION_START + Span::from_millis(500) * i64::from(step);
        Observation::Sweep(sweep_at(0.25 * f64::from(step), stamp))
    };
    for step in 0..steps {
        slam.observe(&observation(step));
    }
    (slam, observation(steps))
}

#[divan::bench(args = [1.0, 5.0, 10.0])]
fn mhd_sixteen_rings(bencher: divan::Bencher<'_, '_>, way_m: f64) {
    let grove = Grove::new();
    bencher
        .with_inputs(|| walked("mhd", way_m, |x, stamp| grove.sweep(|_| pose2(x, 0.0, 0.0), stamp)))
        .bench_values(|(mut slam, sweep)| slam.observe(&sweep));
}

#[divan::bench(args = [1.0, 5.0, 10.0])]
fn mhd_planar(bencher: divan::Bencher<'_, '_>, way_m: f64) {
    let grove = Grove::new();
    bencher
        .with_inputs(|| walked("mhd", way_m, |x, stamp| grove.scan(&pose2(x, 0.0, 0.0), stamp, 0.0)))
        .bench_values(|(mut slam, sweep)| slam.observe(&sweep));
}

#[divan::bench(args = [1.0, 5.0], sample_count = 20)]
fn mhd_paper_planar(bencher: divan::Bencher<'_, '_>, way_m: f64) {
    let grove = Grove::new();
    bencher
        .with_inputs(|| walked("mhd-paper", way_m, |x, stamp| grove.scan(&pose2(x, 0.0, 0.0), stamp, 0.0)))
        .bench_values(|(mut slam, sweep)| slam.observe(&sweep));
}

#[divan::bench(args = [1.0, 5.0, 10.0], sample_count = 20)]
fn aloam_sixteen_rings(bencher: divan::Bencher<'_, '_>, way_m: f64) {
    let grove = Grove::new();
    bencher
        .with_inputs(|| walked("aloam", way_m, |x, stamp| grove.sweep(|_| pose2(x, 0.0, 0.0), stamp)))
        .bench_values(|(mut slam, sweep)| slam.observe(&sweep));
}

#[divan::bench(args = [1.0, 5.0, 10.0], sample_count = 20)]
fn icp2d_sixteen_rings(bencher: divan::Bencher<'_, '_>, way_m: f64) {
    let grove = Grove::new();
    bencher
        .with_inputs(|| walked("icp2d", way_m, |x, stamp| grove.sweep(|_| pose2(x, 0.0, 0.0), stamp)))
        .bench_values(|(mut slam, sweep)| slam.observe(&sweep));
}
