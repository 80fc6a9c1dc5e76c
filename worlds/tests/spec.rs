//! What a world's spec accepts and how it refuses.

use arborloop_worlds::{
    CitrusSpec, ConesSpec, ForestSpec, GrassSpec, OrchardSpec, Planting, Season, SurroundingsSpec,
    TerrainSpec, VineyardSpec, WorldSpec,
};

#[test]
fn defaults_are_valid_and_survive_being_written_and_read() {
    let spec = WorldSpec::default();
    spec.check().unwrap();
    let written = toml::to_string(&spec).unwrap();
    assert_eq!(toml::from_str::<WorldSpec>(&written).unwrap(), spec, "{written}");
    assert_eq!(toml::from_str::<WorldSpec>("").unwrap(), spec);
    let empty = WorldSpec { planting: Planting::None, ..spec };
    assert_eq!(toml::from_str::<WorldSpec>(&toml::to_string(&empty).unwrap()).unwrap(), empty);
}

#[test]
fn every_planting_survives_being_written_and_read_and_keeps_what_a_file_does_not_say() {
    let plantings = [
        Planting::Citrus(CitrusSpec::default()),
        Planting::Orchard(OrchardSpec::default()),
        Planting::Vineyard(VineyardSpec::default()),
        Planting::Forest(ForestSpec::default()),
    ];
    for planting in plantings {
        let spec = WorldSpec { planting, ..WorldSpec::default() };
        spec.check().unwrap();
        let written = toml::to_string(&spec).unwrap();
        assert_eq!(toml::from_str::<WorldSpec>(&written).unwrap(), spec, "{written}");
    }
    let read = |text: &str| toml::from_str::<WorldSpec>(text).unwrap().planting;
    assert_eq!(read("[planting]\nkind = \"vineyard\""), Planting::Vineyard(VineyardSpec::default()));
    let mut wider = CitrusSpec::default();
    (wider.rows.spacing_m, wider.season) = (7.0, Season::Flush);
    let text = "[planting]\nkind = \"citrus\"\nseason = \"flush\"\n[planting.rows]\nspacing_m = 7.0";
    assert_eq!(read(text), Planting::Citrus(wider));
}

#[test]
fn a_mistyped_key_or_kind_is_refused_everywhere() {
    for text in [
        "[terain]",
        "[terrain]\nslope = 3.0",
        "[grass]\nheight = 0.1",
        "[planting]\nkind = \"cones\"\nheigth_m = 0.7",
        "[planting]\nkind = \"cone\"",
        "[planting]\ncount = 3",
        "[planting]\nkind = \"none\"\ncount = 3",
        "[planting]\nkind = \"orchard\"\ncount = 3",
        "[planting]\nkind = \"orchard\"\n[planting.rows]\nplant_spacing = 3.0",
        "[planting]\nkind = \"orchard\"\n[planting.trellis]\npost_height_m = 2.0",
        "[planting]\nkind = \"vineyard\"\nseason = \"winter\"",
        "[planting]\nkind = \"forest\"\n[planting.leaves]\nangle = \"flat\"",
        "[planting]\nkind = \"citrus\"\n[planting.crown]\nshape = \"sphere\"",
        "[surroundings]\ntrees = -1",
        "[terrain]\nslope_deg = \"steep\"",
    ] {
        assert!(toml::from_str::<WorldSpec>(text).is_err(), "{text}");
    }
}

#[test]
fn a_value_out_of_range_is_refused_with_its_key_and_what_would_do() {
    let refused = |spec: WorldSpec| spec.check().unwrap_err().to_string();
    let terrain = |terrain: TerrainSpec| WorldSpec { terrain, ..WorldSpec::default() };
    let planting = |field: ConesSpec| WorldSpec { planting: Planting::Cones(field), ..WorldSpec::default() };
    assert_eq!(
        refused(terrain(TerrainSpec { slope_deg: f64::NAN, ..TerrainSpec::default() })),
        "terrain.slope_deg is NaN, wanted a number from 0 to 45"
    );
    assert_eq!(
        refused(terrain(TerrainSpec { cell_m: 0.02, ..TerrainSpec::default() })),
        "terrain.cell_m is 0.02, wanted at least 0.043 for this extent_m"
    );
    assert_eq!(
        refused(planting(ConesSpec { height_m: -0.7, ..ConesSpec::default() })),
        "planting.height_m is -0.7, wanted a number from 0.05 to 3"
    );
    assert_eq!(
        refused(planting(ConesSpec { count: 1_000_000, ..ConesSpec::default() })),
        "planting.count is 1000000, wanted 10000 at most"
    );
    let leafy = SurroundingsSpec { leaf_size_m: 0.01, ..SurroundingsSpec::default() };
    let error = WorldSpec { surroundings: leafy, ..WorldSpec::default() }.check().unwrap_err();
    assert_eq!((error.key.as_str(), error.found.as_str()), ("surroundings.leaf_size_m", "0.01"));
    let ring = SurroundingsSpec { distance_m_min: 30.0, ..SurroundingsSpec::default() };
    let error = WorldSpec { surroundings: ring, ..WorldSpec::default() }.check().unwrap_err();
    assert_eq!(error.key, "surroundings.distance_m_max");
    let grass = GrassSpec { height_m: f64::INFINITY, ..GrassSpec::default() };
    assert_eq!(WorldSpec { grass, ..WorldSpec::default() }.check().unwrap_err().key, "grass.height_m");
}
