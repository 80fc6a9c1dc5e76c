//! Trees and bushes far around a planting: what a lidar sees beyond the field.

use crate::shape::Frustum;
use crate::spec::SurroundingsSpec;
use crate::terrain::Terrain;
use crate::tree::{self, Crown, Foliage, GOLDEN_ANGLE, Prototype};
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

/// The ring of far plants. Trees carry the instances 1 to `trees`, bushes those that follow.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ring {
    /// One per tree, same instance as its plant.
    pub(crate) trunks: Vec<Solid>,
    /// Trees first, then bushes.
    pub(crate) prototypes: Vec<Prototype>,
    /// Trees first, then bushes.
    pub(crate) plants: Vec<Plant>,
}

/// Grows the ring around `center`, from the streams `world/surroundings/tree`, `world/surroundings/bush` (places) and
/// `world/surroundings/tree_prototype`, `world/surroundings/bush_prototype` (shapes).
pub(crate) fn grow(spec: &SurroundingsSpec, center: Point2<f64>, terrain: &Terrain, seed: Seed) -> Ring {
    let foliage = Foliage {
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

    let mut ring = Ring { trunks: Vec::new(), prototypes, plants: Vec::new() };
    let tree_places = seed.stream("world/surroundings/tree");
    for index in 0..spec.trees {
        let world_from_plant = place(spec, center, terrain, tree_places, index);
        let instance = index as u32 + 1;
        let hinge = hinge(&tree_crown, &world_from_plant);
        ring.plants.push(Plant { prototype: index % TREE_PROTOTYPES, world_from_plant, instance, hinge });
        ring.trunks.push(Solid {
            class: Class::Trunk,
            instance,
            shape: trunk(&tree_crown, spec.trunk_radius_m).transformed(&world_from_plant),
            reflectivity_ratio: spec.bark_reflectivity_ratio,
        });
    }
    let bush_places = seed.stream("world/surroundings/bush");
    for index in 0..spec.bushes {
        let world_from_plant = place(spec, center, terrain, bush_places, index);
        ring.plants.push(Plant {
            prototype: kinds + index % BUSH_PROTOTYPES,
            world_from_plant,
            instance: (spec.trees + index) as u32 + 1,
            hinge: hinge(&bush_crown, &world_from_plant),
        });
    }
    ring
}

/// A plant of one piece turns about the lower end of its crown.
fn hinge(crown: &Crown, world_from_plant: &Similarity3<f64>) -> Hinge {
    let scale = world_from_plant.scaling();
    let half_height_m = crown.half_height_m;
    Hinge {
        foot: world_from_plant * Point3::origin(),
        height_m: scale * (crown.center_m + half_height_m),
        fork: world_from_plant * Point3::new(0.0, 0.0, crown.center_m - half_height_m),
        // The farthest point of an ellipsoid from its lower end is at most this far.
        reach_m: scale * (2.0 * half_height_m).hypot(crown.radius_m),
    }
}

/// From 10 cm under the ground, so that no slope shows its foot, into the crown; plant frame.
fn trunk(crown: &Crown, radius_m: f64) -> Frustum {
    let buried_m = 0.1;
    Frustum {
        base: Point3::new(0.0, 0.0, -buried_m),
        axis: Vector3::z_axis(),
        height_m: crown.center_m + 0.3 * crown.half_height_m + buried_m,
        radius_base_m: radius_m,
        radius_top_m: 0.4 * radius_m,
    }
}

/// Bearings follow the golden angle: any number of plants is spread well, and one more moves none.
fn place(
    spec: &SurroundingsSpec,
    center: Point2<f64>,
    terrain: &Terrain,
    stream: Stream,
    index: usize,
) -> Similarity3<f64> {
    // The whole ring is turned by the address after the last that any plant can have.
    let turned_rad = stream.at(u64::MAX).within(0.0, TAU);
    let mut draws = stream.at(index as u64);
    let bearing_rad = turned_rad + index as f64 * GOLDEN_ANGLE + draws.within(-0.3, 0.3);
    let distance_m = draws.within(spec.distance_m_min, spec.distance_m_max);
    let x = center.x + distance_m * bearing_rad.cos();
    let y = center.y + distance_m * bearing_rad.sin();
    let scale = 1.0 + draws.within(-HEIGHT_VARIATION_RATIO, HEIGHT_VARIATION_RATIO);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), draws.within(0.0, TAU));
    Similarity3::from_parts(Translation3::new(x, y, terrain.height_m(x, y)), turn, scale)
}
