//! Small plantings of every kind, cheap enough to be grown a hundred times.
#![allow(dead_code)] // each test binary uses its own part

use arborloop_worlds::{
    CitrusSpec, Foliage, ForestSpec, GrassSpec, OrchardSpec, Planting, RowsSpec, Season, SurroundingsSpec,
    TerrainSpec, VineyardSpec, WindSpec, WorldSpec,
};

/// A planting alone on uneven ground.
pub(crate) fn bare(planting: Planting) -> WorldSpec {
    WorldSpec {
        terrain: TerrainSpec { extent_m: 40.0, cell_m: 1.0, ..TerrainSpec::default() },
        grass: GrassSpec { height_m: 0.0, ..GrassSpec::default() },
        planting,
        surroundings: SurroundingsSpec { trees: 0, bushes: 0, ..SurroundingsSpec::default() },
        wind: WindSpec::default(),
    }
}

pub(crate) fn small_citrus() -> CitrusSpec {
    let mut spec = CitrusSpec::default();
    spec.rows = RowsSpec { count: 3, plants: 8, ..spec.rows };
    spec.leaves.size_m = 0.15;
    spec
}

pub(crate) fn small_orchard() -> OrchardSpec {
    let mut spec = OrchardSpec::default();
    spec.rows = RowsSpec { count: 3, plants: 8, ..spec.rows };
    spec.leaves.size_m = 0.1;
    spec
}

pub(crate) fn small_vineyard() -> VineyardSpec {
    let mut spec = VineyardSpec::default();
    spec.rows = RowsSpec { count: 3, plants: 9, ..spec.rows };
    spec.leaves.size_m = 0.1;
    spec
}

/// Without undergrowth, whose leaf area density is its own.
pub(crate) fn small_forest() -> ForestSpec {
    let mut spec = ForestSpec::default();
    spec.stand.trees = 40;
    spec.undergrowth.bushes = 0;
    spec.leaves.size_m = 0.2;
    spec
}

/// Every kind of planting with plants of its own.
pub(crate) fn each_small() -> Vec<(&'static str, Planting)> {
    vec![("citrus", Planting::Citrus(small_citrus())), ("orchard", Planting::Orchard(small_orchard()))]
}

/// The planting in another season, as leaves or as a turbid medium, and its leaf area density in full leaf.
pub(crate) fn with_season(planting: &Planting, season: Season, turbid: bool) -> (Planting, f64) {
    let foliage = if turbid { Foliage::Turbid } else { Foliage::Leaves };
    match planting.clone() {
        Planting::Citrus(spec) => {
            let asked_per_m = spec.leaves.area_per_m;
            (Planting::Citrus(CitrusSpec { season, foliage, ..spec }), asked_per_m)
        }
        Planting::Orchard(spec) => {
            let asked_per_m = spec.leaves.area_per_m;
            (Planting::Orchard(OrchardSpec { season, foliage, ..spec }), asked_per_m)
        }
        Planting::Vineyard(spec) => {
            let asked_per_m = spec.leaves.area_per_m;
            (Planting::Vineyard(VineyardSpec { season, foliage, ..spec }), asked_per_m)
        }
        Planting::Forest(spec) => {
            let asked_per_m = spec.leaves.area_per_m;
            (Planting::Forest(ForestSpec { season, foliage, ..spec }), asked_per_m)
        }
        other => (other, 0.0),
    }
}
