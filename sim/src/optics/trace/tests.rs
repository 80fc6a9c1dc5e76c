//! The tracer against slow twins, and against itself with other registers, threads and company.

mod grove;
mod registers;

use super::super::{Depth, Optics, Ray};
use super::moment::Knots;
use super::*;
use arborloop_base::{Class, Seed, Time};
use arborloop_worlds::{Frustum, Hinge, Wind, WindSpec};
use grove::{alike, cast_all, grove, is_silhouette, prototype, slow, soil, sweep};
use nalgebra::{Similarity3, UnitQuaternion};

#[test]
fn still_trees_are_met_as_a_search_through_every_surface_says() {
    let world = grove(0.0);
    let rays = sweep(Vector3::zeros(), 320);
    let hits = cast_all(&Optics::new(&world), &rays);
    let leaves = hits.iter().flatten().filter(|hit| hit.class == Class::Leaf).count();
    let branches = hits.iter().flatten().filter(|hit| hit.class == Class::Branch).count();
    assert!(leaves > 500 && branches > 20, "{leaves} leaves, {branches} branches");
    for (ray, hit) in rays.iter().zip(hits) {
        // Five thousand rays allow for no odd one at 50 ppm.
        assert!(alike(hit, slow(&world, ray), 1e-6), "{hit:?} {:?}", slow(&world, ray));
    }
}

#[test]
fn swaying_trees_are_met_where_the_wind_has_them_at_each_ray_s_own_instant() {
    let world = grove(6.0);
    let rays = sweep(Vector3::zeros(), 160);
    let optics = Optics::new(&world);
    let (mut moved, mut odd) = (0, 0);
    for (ray, hit) in rays.iter().zip(cast_all(&optics, &rays)) {
        moved += usize::from(hit.is_some_and(|hit| hit.displacement_m.norm() > 1e-3));
        // Placements between knots are interpolated, and a leaf that is met flat multiplies what they are off by.
        if !alike(hit, slow(&world, ray), 3e-4) {
            odd += 1;
            // Half a packet and half a knot, 1.2 ms, at 1 m/s.
            assert!(is_silhouette(&world, ray, hit, 1.2e-3), "{hit:?} {:?}", slow(&world, ray));
        }
    }
    assert!(moved > 200, "{moved} hits were moved by the wind");
    assert!(odd < rays.len() / 100, "{odd} of {} rays", rays.len());
}

#[test]
fn a_displacement_leads_back_to_the_surface_at_rest() {
    let (blown, mut still) = (grove(6.0), grove(0.0));
    still.solids.clear();
    let rays = sweep(Vector3::zeros(), 160);
    let mut leaves = 0;
    for (ray, hit) in rays.iter().zip(cast_all(&Optics::new(&blown), &rays)) {
        let Some(hit) = hit.filter(|hit| hit.class == Class::Leaf) else { continue };
        let rest = ray.origin + ray.direction * hit.range_m - hit.displacement_m;
        let plant = &still.plants[hit.instance as usize - 1];
        let in_plant = plant.world_from_plant.inverse() * rest;
        let on_leaf = |leaf: &Leaf| {
            let normal = leaf.half_u.cross(&leaf.half_v);
            let from = in_plant - leaf.center;
            let (a, b) = (from.dot(&leaf.half_u), from.dot(&leaf.half_v));
            from.dot(&normal).abs() / normal.norm() < 1e-5
                && a.abs() <= leaf.half_u.norm_squared() * 1.1
                && b.abs() <= leaf.half_v.norm_squared() * 1.1
        };
        leaves += 1;
        assert!(still.prototypes[plant.prototype].leaves.iter().any(on_leaf));
    }
    assert!(leaves > 100);
}

#[test]
fn a_walking_sensor_s_rays_are_met_as_each_alone_but_for_silhouettes() {
    let world = grove(0.0);
    let rays = sweep(Vector3::new(1.2, 0.9, 0.0), 320);
    let optics = Optics::new(&world);
    let mut odd = 0;
    for (ray, together) in rays.iter().zip(cast_all(&optics, &rays)) {
        let alone = optics.cast(ray);
        let same = match (together, alone) {
            (Some(a), Some(b)) => (a.range_m - b.range_m).abs() < 1e-9 && a.class == b.class,
            (None, None) => true,
            _ => false,
        };
        if !same {
            odd += 1;
            // 8 cycles of 55 us at 1.5 m/s.
            assert!(is_silhouette(&world, ray, together, 6.7e-4), "{together:?} {alone:?}");
        }
    }
    assert!(odd < rays.len() / 50, "{odd} of {}", rays.len());
}

#[test]
fn instruction_sets_and_threads_change_no_bit() {
    for mean_mps in [0.0, 7.0] {
        let world = grove(mean_mps);
        let mut rays = sweep(Vector3::new(1.0, 0.0, 0.0), 320);
        // Some that fit no packet, and some that look only at a part of their way.
        let stream = Seed(2).stream("odd");
        for (index, ray) in rays.iter_mut().enumerate().filter(|(index, _)| index % 37 == 0) {
            let mut draws = stream.at(index as u64);
            ray.direction = Vector3::from_fn(|_, _| draws.normal()).normalize();
            ray.range_m_min = draws.within(0.0, 4.0);
        }
        let isas = [InstructionSet::Portable, InstructionSet::Avx2, InstructionSet::Avx512];
        let hits: Vec<_> = isas
            .iter()
            .filter(|isa| isa.is_present())
            .map(|&isa| cast_all(&Optics::new(&world).with_instruction_set(isa), &rays))
            .collect();
        for other in &hits[1..] {
            assert!(hits[0] == *other);
        }
        let optics = Optics::new(&world);
        for threads in [1, 2, 8] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert!(pool.install(|| cast_all(&optics, &rays)) == hits[0]);
        }
    }
}

#[test]
fn company_decides_nothing_when_origin_and_instant_are_shared() {
    let world = grove(0.0);
    let rays = sweep(Vector3::zeros(), 160);
    let optics = Optics::new(&world);
    for (ray, together) in rays.iter().zip(cast_all(&optics, &rays)) {
        assert_eq!(optics.cast(ray), together);
    }
}

#[test]
fn a_ray_that_goes_on_behind_its_hit_meets_what_is_next() {
    let world = grove(0.0);
    let mut rays = sweep(Vector3::zeros(), 160);
    let optics = Optics::new(&world);
    let first = cast_all(&optics, &rays);
    for (ray, hit) in rays.iter_mut().zip(&first) {
        ray.range_m_min = hit.map_or(3.0, |hit| hit.range_m + 0.02);
    }
    let second = cast_all(&optics, &rays);
    let mut both = 0;
    for ((ray, first), second) in rays.iter().zip(first).zip(second) {
        if first.is_some_and(|hit| hit.class == Class::Ground) {
            continue;
        }
        both += usize::from(second.is_some());
        assert!(alike(second, slow(&world, ray), 1e-6), "{second:?} {:?}", slow(&world, ray));
    }
    assert!(both > 150, "{both}");
}

#[test]
fn empty_and_degenerate_things_are_met_by_nobody() {
    let mut world = soil();
    world.prototypes = vec![prototype(0, 1), prototype(1, 2)];
    world.prototypes[0].branches.clear();
    world.prototypes[1].branches = vec![Frustum {
        base: Point3::origin(),
        axis: Vector3::z_axis(),
        height_m: 0.0,
        radius_base_m: 0.0,
        radius_top_m: 0.0,
    }];
    let foot = Point3::new(1.5, 0.0, 0.0);
    for prototype in 0..2 {
        world.plants.push(Plant {
            prototype,
            world_from_plant: Similarity3::from_parts(foot.coords.into(), UnitQuaternion::identity(), 1.0),
            instance: 1,
            hinge: Hinge { foot, height_m: 2.0, fork: foot, reach_m: 1.0 },
        });
    }
    for mean_mps in [0.0, 5.0] {
        world.wind = Wind::new(&WindSpec { mean_mps, ..WindSpec::default() }, &world.plants, Seed(6));
        let optics = Optics::new(&world);
        let leaf = world.wind.sway(1, &world.plants[1], 1.0).leaf(0, &world.prototypes[1].leaves[0]);
        let target = world.wind.sway(1, &world.plants[1], 1.0).world_from_plant * leaf.center;
        let origin = Point3::new(0.0, 0.0, 1.0);
        let ray = Ray {
            stamp: Time::SIMULATION_START,
            origin,
            direction: (target - origin).normalize(),
            range_m_min: 0.0,
            range_m_max: 50.0,
            depth: Depth::ENDLESS,
        };
        let hit = optics.cast(&ray).unwrap();
        assert_eq!(
            hit.class,
            Class::Leaf,
            "{mean_mps} {hit:?} {leaf:?} {target} {}",
            (target - origin).norm()
        );
        assert!((hit.range_m - (target - origin).norm()).abs() < 1e-6);
        for direction in [Vector3::z(), Vector3::repeat(f64::NAN), Vector3::zeros()] {
            assert_eq!(optics.cast(&Ray { direction, ..ray }), None);
        }
        let nowhere = Point3::new(f64::NAN, 0.0, 1.0);
        assert_eq!(optics.cast(&Ray { origin: nowhere, ..ray }), None);
        assert_eq!(optics.cast(&Ray { range_m_max: 0.0, ..ray }), None);
    }
}

#[test]
fn a_beam_from_inside_a_trunk_meets_its_bark_and_one_from_under_the_soil_meets_it_at_once() {
    let mut world = grove(0.0);
    world.plants.clear();
    let optics = Optics::new(&world);
    let trunk = world.solids[0].shape;
    let inside = Ray {
        stamp: Time::SIMULATION_START,
        origin: trunk.center(0.4),
        direction: Vector3::x(),
        range_m_min: 0.0,
        range_m_max: 50.0,
        depth: Depth::of(1.0),
    };
    let hit = optics.cast(&inside).unwrap();
    assert_eq!((hit.class, hit.instance), (Class::Trunk, 1));
    assert!((hit.range_m - trunk.radius_m(0.4)).abs() < 1e-9);
    let buried = Ray { origin: Point3::new(0.1, 0.1, -3.0), ..inside };
    let hit = optics.cast(&buried).unwrap();
    assert_eq!((hit.class, hit.range_m), (Class::Ground, 0.0));
}

#[test]
fn placements_between_knots_are_the_wind_s_own_within_fifty_micrometers() {
    let world = grove(10.0);
    let scene = Scene::new(&world);
    let mut knots = Knots::new(&scene, &world);
    let mut worst = 0.0_f64;
    for step in 0..20_000 {
        let stamp = Time::from_nanos(1_000_000_000 + step * 437_123);
        for (index, plant) in world.plants.iter().enumerate() {
            let found = knots.at(&scene, &world, index, stamp);
            let wanted = world.wind.sway(index, plant, stamp.seconds());
            // The farthest tip.
            let tip = Point3::new(0.8, 0.8, 1.8);
            worst =
                worst.max((found.plant_from_world().point(&(wanted.world_from_plant * tip)) - tip).norm());
        }
    }
    assert!(worst < 50e-6, "{worst}");
}

/// Every leaf and the soil as triangles, world frame, for another library.
fn triangles(world: &World) -> Vec<[Point3<f64>; 3]> {
    let mut triangles = Vec::new();
    for plant in &world.plants {
        for leaf in &world.prototypes[plant.prototype].leaves {
            let [a, b, c, d] = leaf.transformed(&plant.world_from_plant).corners();
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let terrain = &world.terrain;
    let node = |column, row| terrain.node(column, row).unwrap();
    for row in 0..terrain.grid().rows() - 1 {
        for column in 0..terrain.grid().columns() - 1 {
            let (a, c) = (node(column, row), node(column + 1, row + 1));
            triangles.extend([[a, node(column + 1, row), c], [a, c, node(column, row + 1)]]);
        }
    }
    triangles
}

#[test]
fn parry_in_double_precision_meets_the_same_surfaces() {
    use rapier3d_f64::parry::query::RayCast;
    use rapier3d_f64::prelude as rapier;
    let mut world = grove(0.0);
    world.solids.clear();
    world.prototypes.iter_mut().for_each(|prototype| prototype.branches.clear());
    let corners: Vec<Point3<f64>> = triangles(&world).into_iter().flatten().collect();
    let vertices = corners.iter().map(|p| rapier::Vector::new(p.x, p.y, p.z)).collect();
    let faces = (0..corners.len() as u32 / 3).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    let mesh = rapier::TriMesh::new(vertices, faces).unwrap();
    let stream = Seed(5).stream("pose");
    let (mut odd, mut all) = (0, 0);
    for pose in 0..4 {
        let mut draws = stream.at(pose);
        let aside = Vector3::new(draws.within(-1.0, 1.0), draws.within(-1.0, 1.0), 0.0);
        let mut rays = sweep(Vector3::zeros(), 800);
        rays.iter_mut().for_each(|ray| ray.origin += aside);
        for (ray, hit) in rays.iter().zip(cast_all(&Optics::new(&world), &rays)) {
            let (o, d) = (ray.origin, ray.direction);
            let beam =
                rapier::Ray::new(rapier::Vector::new(o.x, o.y, o.z), rapier::Vector::new(d.x, d.y, d.z));
            let wanted = mesh.cast_local_ray(&beam, 100.0, true);
            let same = match (hit, wanted) {
                (Some(hit), Some(range_m)) => (hit.range_m - range_m).abs() <= 1e-3,
                (None, None) => true,
                _ => false,
            };
            all += 1;
            odd += usize::from(!same);
        }
    }
    // 50 ppm.
    assert!(odd * 20_000 <= all, "{odd} of {all} rays differ");
}
