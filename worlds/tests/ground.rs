//! Furrows, clods and weeds held against the numbers that ask for them.

mod common;

use arborloop_base::Seed;
use arborloop_worlds::{GrassSpec, Planting, TerrainSpec, World, WorldSpec, build};
use common::bare;

fn flat() -> TerrainSpec {
    TerrainSpec { relief_m: 0.0, bump_m: 0.0, extent_m: 20.0, cell_m: 0.25, ..TerrainSpec::default() }
}

fn grown(terrain: TerrainSpec, grass: GrassSpec, seed: u64) -> World {
    build(&WorldSpec { terrain, grass, ..bare(Planting::None) }, Seed(seed))
}

#[test]
fn furrows_run_along_their_bearing_at_their_depth_and_spacing() {
    let spec = TerrainSpec { furrow_depth_m: 0.2, furrow_spacing_m: 2.0, furrow_bearing_deg: 90.0, ..flat() };
    let terrain = grown(spec, GrassSpec::default(), 1).terrain;
    // Along north nothing changes; a meter east of the crest at the origin is a trough.
    assert!((terrain.height_m(0.0, 7.25)).abs() < 1e-9);
    assert!((terrain.height_m(1.0, 3.0) + 0.2).abs() < 1e-9);
    assert!((terrain.height_m(2.0, -5.0)).abs() < 1e-9);
    let (low_m, high_m) = terrain.height_range_m();
    assert!((high_m - low_m - 0.2).abs() < 1e-9);
}

#[test]
fn clods_have_their_deviation_and_stay_when_the_field_grows() {
    let rough = TerrainSpec { roughness_m: 0.02, ..flat() };
    let small = grown(rough.clone(), GrassSpec::default(), 2).terrain;
    let heights = small.grid().cells();
    let n = heights.len() as f64;
    let mean = heights.iter().sum::<f64>() / n;
    let variance = heights.iter().map(|height| (height - mean).powi(2)).sum::<f64>() / n;
    assert!((variance / 0.0004 - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "variance {variance}");
    let large = grown(TerrainSpec { extent_m: 30.0, ..rough }, GrassSpec::default(), 2).terrain;
    assert_eq!(small.height_m(3.25, -4.5), large.height_m(3.25, -4.5));
}

#[test]
fn weeds_cover_their_share_of_the_ground_and_no_more_than_their_height() {
    let mown = GrassSpec { height_m: 0.0, ..GrassSpec::default() };
    let weedy = GrassSpec { weed_height_m: 0.4, weed_cover_ratio: 0.3, ..mown.clone() };
    let world = grown(flat(), weedy, 3);
    let heights = world.grass.grid().cells();
    let covered = heights.iter().filter(|height| **height > 0.0).count() as f64 / heights.len() as f64;
    assert!((covered - 0.3).abs() < 0.001, "{covered} covered");
    assert!((world.grass.height_m_max() - 0.4).abs() < 1e-9);
    assert!(heights.iter().all(|height| *height == 0.0 || *height > 0.13));
    assert_eq!(grown(flat(), mown, 3).grass.height_m_max(), 0.0);
}

#[test]
fn furrows_finer_than_the_height_grid_are_refused() {
    let spec = TerrainSpec { furrow_depth_m: 0.1, furrow_spacing_m: 0.5, ..flat() };
    let error = WorldSpec { terrain: spec, ..bare(Planting::None) }.check().unwrap_err();
    assert_eq!(error.to_string(), "terrain.furrow_spacing_m is 0.5, wanted a number from 1 to 100");
}
