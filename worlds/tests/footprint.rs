//! The footprint held against a slow twin (points thrown into the shapes) and against shapes known by heart.

use arborloop_base::{Cell, Class, Grid, Seed};
use arborloop_worlds::footprint::{HeightSlice, footprint};
use arborloop_worlds::{
    Bounds, ConesSpec, Frustum, Leaf, Planting, Solid, SurroundingsSpec, WindSpec, World, WorldSpec, build,
};
use nalgebra::{Point2, Point3, Unit, Vector3};

const SLICE: HeightSlice = HeightSlice { low_m: 0.15, high_m: 0.75 };

fn around(x: f64, y: f64, half_m: f64) -> Bounds {
    Bounds { low: Point2::new(x - half_m, y - half_m), high: Point2::new(x + half_m, y + half_m) }
}

/// All frusta and leaves of a world, world frame.
fn shapes(world: &World) -> (Vec<Frustum>, Vec<Leaf>) {
    let mut frusta: Vec<Frustum> = world.solids.iter().map(|solid| solid.shape).collect();
    let mut leaves = Vec::new();
    for plant in &world.plants {
        let prototype = &world.prototypes[plant.prototype];
        frusta.extend(prototype.branches.iter().map(|branch| branch.transformed(&plant.world_from_plant)));
        leaves.extend(prototype.leaves.iter().map(|leaf| leaf.transformed(&plant.world_from_plant)));
    }
    (frusta, leaves)
}

/// Points thrown evenly into every shape, kept when inside the slice.
fn thrown(world: &World, per_shape: u64, slice: HeightSlice) -> Vec<Point2<f64>> {
    let stream = Seed(99).stream("test/thrown");
    let (frusta, leaves) = shapes(world);
    let mut points = Vec::new();
    for (index, frustum) in frusta.iter().enumerate() {
        let axis = frustum.axis.into_inner();
        let across = axis.cross(&if axis.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() }).normalize();
        let along = axis.cross(&across);
        for n in 0..per_shape {
            let mut draws = stream.child(index as u64).at(n);
            let height_m = draws.unit() * frustum.height_m;
            let radius_m = draws.unit().sqrt() * frustum.radius_m(height_m);
            let (sin, cos) = draws.within(0.0, std::f64::consts::TAU).sin_cos();
            points.push(frustum.center(height_m) + radius_m * (cos * across + sin * along));
        }
    }
    for (index, leaf) in leaves.iter().enumerate() {
        for n in 0..per_shape / 4 {
            let mut draws = stream.child(1_000_000 + index as u64).at(n);
            points.push(
                leaf.center + draws.within(-1.0, 1.0) * leaf.half_u + draws.within(-1.0, 1.0) * leaf.half_v,
            );
        }
    }
    let inside = |point: &Point3<f64>| {
        let above_m = point.z - world.terrain.height_m(point.x, point.y);
        (slice.low_m..=slice.high_m).contains(&above_m)
    };
    points.into_iter().filter(inside).map(|point| point.xy()).collect()
}

/// Every thrown point lies in an occupied cell, and hardly any occupied cell has no thrown point nearby.
fn agrees_with_thrown_points(world: &World, grid: &Grid<Cell>, points: &[Point2<f64>], near_m: f64) {
    let mut seen = Grid::filled(grid.origin(), grid.resolution_m(), grid.columns(), grid.rows(), false);
    let mut missed = 0;
    for point in points {
        if let Some((column, row)) = grid.index_of(point) {
            missed += usize::from(grid.get(column, row) != Some(&Cell::Occupied));
        }
        for (dx, dy) in [(0.0, 0.0), (near_m, 0.0), (-near_m, 0.0), (0.0, near_m), (0.0, -near_m)] {
            let Some((column, row)) = grid.index_of(&Point2::new(point.x + dx, point.y + dy)) else {
                continue;
            };
            if let Some(cell) = seen.get_mut(column, row) {
                *cell = true;
            }
        }
    }
    assert_eq!(missed, 0, "of {} points in {} solids", points.len(), world.solids.len());
    let occupied = grid.cells().iter().filter(|cell| **cell == Cell::Occupied).count();
    let unseen = grid
        .cells()
        .iter()
        .zip(seen.cells())
        .filter(|(cell, seen)| **cell == Cell::Occupied && !**seen)
        .count();
    assert!(occupied > 50, "only {occupied} cells are occupied");
    assert!(unseen * 100 <= occupied, "{unseen} of {occupied} occupied cells have nothing in them");
}

#[test]
fn cones_on_uneven_ground_fill_the_cells_that_thrown_points_hit() {
    let spec = WorldSpec {
        surroundings: SurroundingsSpec { trees: 0, bushes: 0, ..SurroundingsSpec::default() },
        wind: WindSpec::default(),
        ..WorldSpec::default()
    };
    let world = build(&spec, Seed(2));
    let grid = footprint(&world, SLICE, 0.02, &around(3.0, 1.0, 6.0));
    agrees_with_thrown_points(&world, &grid, &thrown(&world, 150_000, SLICE), 0.004);
    assert!(grid.cells().iter().all(|cell| *cell != Cell::Unknown));
}

#[test]
fn bushes_and_trees_fill_the_cells_that_thrown_points_hit() {
    let spec = WorldSpec {
        planting: Planting::None,
        surroundings: SurroundingsSpec {
            trees: 1,
            bushes: 1,
            distance_m_min: 2.0,
            distance_m_max: 6.0,
            leaf_area_per_m: 0.2,
            ..SurroundingsSpec::default()
        },
        ..WorldSpec::default()
    };
    let world = build(&spec, Seed(7));
    // High enough that the tree's branches and leaves are in the slice as well.
    let slice = HeightSlice { low_m: 0.3, high_m: 2.2 };
    let grid = footprint(&world, slice, 0.05, &around(0.0, 0.0, 9.0));
    agrees_with_thrown_points(&world, &grid, &thrown(&world, 40_000, slice), 0.004);
}

fn only(shape: Frustum) -> World {
    let spec = WorldSpec {
        planting: Planting::Cones(ConesSpec { count: 0, ..ConesSpec::default() }),
        surroundings: SurroundingsSpec { trees: 0, bushes: 0, ..SurroundingsSpec::default() },
        wind: WindSpec::default(),
        ..WorldSpec::default()
    };
    let mut world = build(&spec, Seed(1));
    world.terrain = arborloop_worlds::Terrain::level(20.0, 1.0);
    world.solids.push(Solid { class: Class::Post, instance: 1, shape, reflectivity_ratio: 0.5 });
    world
}

#[test]
fn a_post_covers_the_area_of_its_circle() {
    let post = Frustum {
        base: Point3::new(0.013, -0.007, 0.0),
        axis: Vector3::z_axis(),
        height_m: 1.0,
        radius_base_m: 0.5,
        radius_top_m: 0.5,
    };
    let grid = footprint(&only(post), SLICE, 0.01, &around(0.0, 0.0, 1.0));
    for row in 0..grid.rows() {
        for column in 0..grid.columns() {
            let center = grid.center_of(column, row);
            let from_axis_m = (center - post.base.xy()).norm();
            let occupied = grid.get(column, row) == Some(&Cell::Occupied);
            // A cell's corner is 7.1 mm from its center; the polygon is at most 0.5 % wider than the circle.
            assert!(occupied || from_axis_m > 0.5, "{center} is inside the post");
            assert!(!occupied || from_axis_m < 0.5 * 1.005 + 0.0071, "{center} is outside the post");
        }
    }
}

#[test]
fn a_leaning_pole_is_seen_only_between_the_limits_of_the_slice() {
    // At 45 degrees the height above the ground is the distance walked along x.
    let pole = Frustum {
        base: Point3::origin(),
        axis: Unit::new_normalize(Vector3::new(1.0, 0.0, 1.0)),
        height_m: 2.0,
        radius_base_m: 0.01,
        radius_top_m: 0.01,
    };
    let grid = footprint(&only(pole), SLICE, 0.01, &around(0.5, 0.0, 1.0));
    let occupied: Vec<f64> = (0..grid.rows())
        .flat_map(|row| (0..grid.columns()).map(move |column| (column, row)))
        .filter(|(column, row)| grid.get(*column, *row) == Some(&Cell::Occupied))
        .map(|(column, row)| grid.center_of(column, row).x)
        .collect();
    let (low, high) = occupied.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
    // Half the pole's width, seen at 45 degrees, reaches 1.41 radii beyond the axis' own crossing.
    assert!(
        (low - (0.15 - 0.0141)).abs() < 0.011 && (high - (0.75 + 0.0141)).abs() < 0.011,
        "{low} to {high}"
    );
}

#[test]
fn things_outside_the_slice_or_the_bounds_leave_the_grid_free() {
    let post = Frustum {
        base: Point3::origin(),
        axis: Vector3::z_axis(),
        height_m: 0.1,
        radius_base_m: 0.5,
        radius_top_m: 0.5,
    };
    let free =
        |bounds: &Bounds| footprint(&only(post), SLICE, 0.1, bounds).cells().iter().all(|c| *c == Cell::Free);
    assert!(free(&around(0.0, 0.0, 1.0)));
    let tall = Frustum { height_m: 1.0, ..post };
    let beside = footprint(&only(tall), SLICE, 0.1, &around(5.0, 5.0, 1.0));
    assert!(beside.cells().iter().all(|cell| *cell == Cell::Free));
    let inside_out = Bounds { low: Point2::new(1.0, 1.0), high: Point2::new(-1.0, -1.0) };
    assert!(footprint(&only(tall), SLICE, 0.1, &inside_out).cells().is_empty());
}
