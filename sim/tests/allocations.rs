//! Casting a sweep allocates nothing once the threads' scratch is warm, in still air and in the wind.

use arborloop_base::{Seed, Span, Time};
use arborloop_sim::optics::{Depth, Hit, Optics, Ray};
use arborloop_worlds::{TerrainSpec, WindSpec, WorldSpec, build};
use nalgebra::{Point3, Vector3};

/// A turn of sixteen lasers; `turn` says which.
fn sweep(turn: i64) -> Vec<Ray> {
    let columns = 320;
    let ray = |index: i64| {
        let (block, laser, column) = (index / 256, index / 16 % 16, index % 16);
        let column = block * 16 + column;
        let azimuth = std::f64::consts::TAU * column as f64 / columns as f64;
        let (sin, cos) = (-15.0 + 2.0 * laser as f64).to_radians().sin_cos();
        Ray {
            stamp: Time::SIMULATION_START
                + Span::from_millis(100 * turn)
                + Span::from_nanos(column * 300_000),
            origin: Point3::new(0.5, 0.5, 0.6),
            direction: Vector3::new(cos * azimuth.cos(), cos * azimuth.sin(), sin),
            range_m_min: 0.0,
            range_m_max: 100.0,
            depth: Depth::of(0.1 + (index % 7) as f64),
        }
    };
    (0..columns * 16).map(ray).collect()
}

#[test]
fn a_sweep_allocates_nothing_after_the_first() {
    for mean_mps in [0.0, 6.0] {
        let spec = WorldSpec {
            terrain: TerrainSpec { cell_m: 0.5, ..TerrainSpec::default() },
            wind: WindSpec { mean_mps, ..WindSpec::default() },
            ..WorldSpec::default()
        };
        let optics = Optics::new(&build(&spec, Seed(5)));
        // Allocations are counted per thread, and the pool's one thread is the one that counts.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        pool.install(|| {
            let mut hits: Vec<Option<Hit>> = Vec::new();
            let first = sweep(0);
            let made = allocation_counter::measure(|| optics.cast_all(&first, &mut hits));
            assert!(made.count_total > 0, "the first sweep makes the scratch");
            assert!(hits.iter().flatten().count() > 1000);
            for turn in 1..4 {
                let rays = sweep(turn);
                let made = allocation_counter::measure(|| optics.cast_all(&rays, &mut hits));
                assert_eq!(made.count_total, 0, "{mean_mps} m/s: {made:?}");
            }
        });
    }
}
