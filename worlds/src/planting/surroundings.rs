//! Trees and bushes far around a planting: what a lidar sees beyond the field.

use crate::crown::Crown;
use crate::shape::Frustum;
use crate::spec::SurroundingsSpec;
use crate::stand::{CrownTruth, Stand};
use crate::terrain::Terrain;
use crate::tree::{self, GOLDEN_ANGLE, Prototype, TreeFoliage};
use crate::{Hinge, Plant, Solid};
use arborloop_base::{Class, Seed, Stream};
use nalgebra::{Point2, Point3, Similarity3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// Trees grown apart; more trees repeat them turned and scaled.
const TREE_PROTOTYPES: usize = 3;
/// Bushes grown apart.
const BUSH_PROTOTYPES: usize = 2;
/// A plant's height differs from the mean by up to this share.
const HEIGHT_VARIATION_RATIO: f64 = 0.15;

/// Instances of far plants beside a planting that has plants of its own follow this number.
const INSTANCES_BESIDE_PLANTS: u32 = 1_000_000;

/// What the ring lies around.
pub(crate) struct Around {
    /// The planting's middle.
    pub(crate) center: Point2<f64>,
    /// How far its own plants reach from there, meters; distances count from here on.
    pub(crate) radius_m: f64,
    /// Instances that are taken.
    pub(crate) instances: u32,
}

impl Around {
    /// Around a planting without plants.
    pub(crate) fn bare(center: Point2<f64>) -> Self {
        Around { center, radius_m: 0.0, instances: 0 }
    }

    /// Around a planting of plants.
    pub(crate) fn plants((center, radius_m): (Point2<f64>, f64)) -> Self {
        Around { center, radius_m, instances: INSTANCES_BESIDE_PLANTS }
    }
}

/// Grows the ring, from the streams `world/surroundings/tree`, `world/surroundings/bush` (places) and
/// `world/surroundings/tree_prototype`, `world/surroundings/bush_prototype` (shapes). Trees carry the first free
/// instances, bushes those that follow.
pub(crate) fn grow(spec: &SurroundingsSpec, around: &Around, terrain: &Terrain, seed: Seed) -> Stand {
    let foliage = TreeFoliage {
        leaf_size_m: spec.leaf_size_m,
        leaf_area_per_m: spec.leaf_area_per_m,
        leaf_reflectivity_ratio: spec.leaf_reflectivity_ratio,
        bark_reflectivity_ratio: spec.bark_reflectivity_ratio,
    };
    let tree_crown = Crown::of_tree(spec.tree_height_m);
    let bush_crown = Crown::of_bush(spec.bush_height_m);
    let tree_shapes = seed.stream("world/surroundings/tree_prototype");
    let bush_shapes = seed.stream("world/surroundings/bush_prototype");
    let kinds = TREE_PROTOTYPES.min(spec.trees);
    let mut prototypes: Vec<Prototype> = (0..kinds)
        .map(|kind| tree::tree(&tree_crown, spec.trunk_radius_m, &foliage, tree_shapes.child(kind as u64)))
        .collect();
    prototypes.extend(
        (0..BUSH_PROTOTYPES.min(spec.bushes))
            .map(|kind| tree::bush(&bush_crown, &foliage, bush_shapes.child(kind as u64))),
    );

    let mut ring = Stand { prototypes, ..Stand::default() };
    let put = |ring: &mut Stand, prototype, crown: &Crown, instance, world_from_plant| {
        let hinge = hinge(crown, &world_from_plant);
        ring.plants.push(Plant { prototype, world_from_plant, instance, hinge });
        ring.crowns.push(CrownTruth { instance, crown: *crown, world_from_plant });
    };
    let tree_places = seed.stream("world/surroundings/tree");
    for index in 0..spec.trees {
        let world_from_plant = place(spec, around, terrain, tree_places, index);
        let instance = around.instances + index as u32 + 1;
        put(&mut ring, index % TREE_PROTOTYPES, &tree_crown, instance, world_from_plant);
        ring.solids.push(Solid {
            class: Class::Trunk,
            instance,
            shape: trunk(&tree_crown, spec.trunk_radius_m).transformed(&world_from_plant),
            reflectivity_ratio: spec.bark_reflectivity_ratio,
        });
    }
    let bush_places = seed.stream("world/surroundings/bush");
    for index in 0..spec.bushes {
        let world_from_plant = place(spec, around, terrain, bush_places, index);
        let instance = around.instances + (spec.trees + index) as u32 + 1;
        put(&mut ring, kinds + index % BUSH_PROTOTYPES, &bush_crown, instance, world_from_plant);
    }
    ring
}

/// A plant of one piece turns about the lower end of its crown.
fn hinge(crown: &Crown, world_from_plant: &Similarity3<f64>) -> Hinge {
    let scale = world_from_plant.scaling();
    let half_height_m = crown.half_size.z;
    Hinge {
        foot: world_from_plant * Point3::origin(),
        height_m: scale * (crown.center.z + half_height_m),
        fork: world_from_plant * Point3::new(0.0, 0.0, crown.center.z - half_height_m),
        // The farthest point of an ellipsoid from its lower end is at most this far.
        reach_m: scale * (2.0 * half_height_m).hypot(crown.half_size.x),
    }
}

/// From 10 cm under the ground, so that no slope shows its foot, into the crown; plant frame.
fn trunk(crown: &Crown, radius_m: f64) -> Frustum {
    let buried_m = 0.1;
    Frustum {
        base: Point3::new(0.0, 0.0, -buried_m),
        axis: Vector3::z_axis(),
        height_m: crown.center.z + 0.3 * crown.half_size.z + buried_m,
        radius_base_m: radius_m,
        radius_top_m: 0.4 * radius_m,
    }
}

/// Bearings follow the golden angle: any number of plants is spread well, and one more moves none.
fn place(
    spec: &SurroundingsSpec,
    around: &Around,
    terrain: &Terrain,
    stream: Stream,
    index: usize,
) -> Similarity3<f64> {
    // The whole ring is turned by the address after the last that any plant can have.
    let turned_rad = stream.at(u64::MAX).within(0.0, TAU);
    let mut draws = stream.at(index as u64);
    let bearing_rad = turned_rad + index as f64 * GOLDEN_ANGLE + draws.within(-0.3, 0.3);
    let distance_m = around.radius_m + draws.within(spec.distance_m_min, spec.distance_m_max);
    let x = around.center.x + distance_m * bearing_rad.cos();
    let y = around.center.y + distance_m * bearing_rad.sin();
    let scale = 1.0 + draws.within(-HEIGHT_VARIATION_RATIO, HEIGHT_VARIATION_RATIO);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), draws.within(0.0, TAU));
    Similarity3::from_parts(Translation3::new(x, y, terrain.height_m(x, y)), turn, scale)
}
