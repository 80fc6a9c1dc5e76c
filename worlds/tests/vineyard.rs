//! A vineyard's trellis: posts and wires stand where they are said to, and the curtain hangs where it belongs.

mod common;

use arborloop_base::{Cell, Class, Seed};
use arborloop_worlds::footprint::{HeightSlice, footprint};
use arborloop_worlds::{
    Bounds, CrownShape, CrownSpec, Planting, RowsSpec, Season, Solid, TerrainSpec, TrunkSpec, VineyardSpec,
    World, WorldSpec, build, trunk_map,
};
use common::{bare, small_vineyard};
use nalgebra::Point2;
use std::collections::BTreeMap;

fn of(world: &World, class: Class) -> Vec<Solid> {
    world.solids.iter().copied().filter(|solid| solid.class == class).collect()
}

fn grown(spec: VineyardSpec) -> World {
    build(&bare(Planting::Vineyard(spec)), Seed(1))
}

#[test]
fn each_row_has_posts_between_vines_and_at_both_ends() {
    let spec =
        VineyardSpec { rows: RowsSpec { count: 2, plants: 10, ..small_vineyard().rows }, ..small_vineyard() };
    let posts = of(&grown(spec.clone()), Class::Post);
    // Ten vines, four to a post: before vines 0, 4 and 8, and after the last.
    let wanted_m = [-0.5, 3.5, 7.5, 9.5].map(|vines: f64| spec.rows.x_m + vines * spec.rows.plant_spacing_m);
    assert_eq!(posts.len(), 8);
    for (index, post) in posts.iter().enumerate() {
        let base = post.shape.base;
        // A post that leans by two degrees is buried by a decimeter.
        assert!((base.x - wanted_m[index % 4]).abs() < 0.01, "post {index} at {base}");
        let row_m = spec.rows.y_m + (index / 4) as f64 * spec.rows.spacing_m;
        assert!((base.y - row_m).abs() < 0.01, "post {index} at {base}");
        let ends = matches!(index % 4, 0 | 3);
        let radius_m = if ends { spec.trellis.end_post_radius_m } else { spec.trellis.post_radius_m };
        assert_eq!(post.shape.radius_base_m, radius_m);
    }
}

#[test]
fn wires_go_from_post_to_post_at_their_heights() {
    let spec = small_vineyard();
    let world = grown(spec.clone());
    let wires = of(&world, Class::Wire);
    let mut rows: BTreeMap<u32, Vec<Solid>> = BTreeMap::new();
    wires.iter().for_each(|wire| rows.entry(wire.instance).or_default().push(*wire));
    assert_eq!(rows.len(), spec.rows.count * spec.trellis.wire_heights_m.len());
    for (instance, spans) in rows {
        let wanted_m = spec.trellis.wire_heights_m[(instance % 1000) as usize - 1];
        for pair in spans.windows(2) {
            let end = pair[0].shape.center(pair[0].shape.height_m);
            assert!((end - pair[1].shape.base).norm() < 1e-9, "wire {instance} is broken");
        }
        for span in &spans {
            let base = span.shape.base;
            let above_m = base.z - world.terrain.height_m(base.x, base.y);
            // Posts lean by two standard deviations of a degree at most, on ground that rises under them.
            assert!((above_m - wanted_m).abs() < 0.02, "wire {instance} at {above_m} m");
        }
    }
}

#[test]
fn stems_lean_but_their_heads_are_at_the_wire() {
    let spec = VineyardSpec {
        trunk: TrunkSpec { lean_deg: 10.0, ..small_vineyard().trunk },
        crown: CrownSpec { size_variation_ratio: 0.0, ..small_vineyard().crown },
        ..small_vineyard()
    };
    let world = grown(spec.clone());
    let mut tilted = 0;
    for (stem, crown) in of(&world, Class::Trunk).iter().zip(&world.crowns) {
        let head = stem.shape.center(stem.shape.height_m);
        let foot = crown.world_from_plant.isometry.translation.vector;
        assert!((head.coords - foot).xy().norm() < 1e-9 && (head.z - foot.z - 0.75).abs() < 1e-9);
        assert!(crown.world_from_plant.isometry.rotation * nalgebra::Vector3::z() == nalgebra::Vector3::z());
        tilted += usize::from(stem.shape.axis.z < 0.99);
    }
    assert!(tilted > 10, "{tilted} stems lean");
}

#[test]
fn posts_and_stems_are_in_the_trunk_map_and_wires_are_not() {
    let world = grown(small_vineyard());
    let count = |class| trunk_map(&world).iter().filter(|truth| truth.class == class).count();
    assert_eq!(count(Class::Trunk), world.crowns.len());
    assert_eq!(count(Class::Post), of(&world, Class::Post).len());
    assert_eq!(count(Class::Wire), 0);
}

#[test]
fn a_row_seen_from_above_is_a_thin_line_below_the_curtain_and_a_thick_one_in_it() {
    let spec = VineyardSpec {
        rows: RowsSpec {
            count: 1,
            plants: 8,
            missing_ratio: 0.0,
            x_m: 0.0,
            y_m: 0.0,
            ..small_vineyard().rows
        },
        ..small_vineyard()
    };
    let level =
        TerrainSpec { relief_m: 0.0, bump_m: 0.0, extent_m: 20.0, cell_m: 1.0, ..TerrainSpec::default() };
    let world = build(&WorldSpec { terrain: level, ..bare(Planting::Vineyard(spec)) }, Seed(2));
    let bounds = Bounds { low: Point2::new(-2.0, -1.0), high: Point2::new(13.0, 1.0) };
    let occupied = |low_m, high_m| {
        let grid = footprint(&world, HeightSlice { low_m, high_m }, 0.02, &bounds);
        grid.cells().iter().filter(|cell| **cell == Cell::Occupied).count() as f64 * 0.02 * 0.02
    };
    let (stems_m2, curtain_m2) = (occupied(0.2, 0.5), occupied(0.9, 1.6));
    // Eight leaning stems and three posts against 12 m of curtain half a meter thick.
    assert!(stems_m2 > 0.02 && stems_m2 < 0.2, "{stems_m2} m2");
    assert!(curtain_m2 > 2.0 && curtain_m2 < 7.5, "{curtain_m2} m2");
    // Wires alone, above the curtain of a bare vineyard: a line as thin as a cell.
    let mut bare_world = world.clone();
    bare_world.plants.clear();
    let grid = footprint(&bare_world, HeightSlice { low_m: 1.65, high_m: 1.75 }, 0.02, &bounds);
    let crossed = (0..grid.columns())
        .filter(|column| (0..grid.rows()).any(|row| grid.get(*column, row) == Some(&Cell::Occupied)))
        .count();
    assert!((crossed as f64 * 0.02 - 12.0).abs() < 0.3, "{} m of wire", crossed as f64 * 0.02);
}

#[test]
fn a_vineyard_without_vines_has_its_trellis_and_bad_trellises_are_refused() {
    let spec = small_vineyard();
    let missing = VineyardSpec { rows: RowsSpec { missing_ratio: 1.0, ..spec.rows.clone() }, ..spec.clone() };
    let world = grown(missing);
    assert!(world.plants.is_empty() && !of(&world, Class::Post).is_empty());
    let none = VineyardSpec { rows: RowsSpec { plants: 0, ..spec.rows.clone() }, ..spec.clone() };
    assert!(grown(none).solids.is_empty());
    let winter = grown(VineyardSpec { season: Season::Leafless, ..spec });
    assert!(winter.prototypes.iter().all(|vine| vine.leaves.is_empty() && vine.branches.len() > 10));

    let refused = |change: fn(&mut VineyardSpec)| {
        let mut spec = VineyardSpec::default();
        change(&mut spec);
        bare(Planting::Vineyard(spec)).check().unwrap_err().to_string()
    };
    assert_eq!(
        refused(|spec| spec.trellis.wire_heights_m = vec![0.7, 2.5]),
        "planting.trellis.wire_heights_m[1] is 2.5, wanted a number from 0 to 1.9"
    );
    assert_eq!(
        refused(|spec| spec.trellis.plants_per_post = 0),
        "planting.trellis.plants_per_post is 0, wanted 1 at least"
    );
    assert_eq!(
        refused(|spec| spec.crown.shape = CrownShape::Cone),
        "planting.crown.shape is cone, wanted box: a trellis holds a curtain"
    );
}
