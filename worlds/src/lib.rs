//! Procedural orchards as plain data: terrain, grass, traffic cones, far trees and bushes, and their footprint truth.
//!
//! A [`WorldSpec`] and a [`Seed`] become a [`World`]; no engine type and no file is known here. The frame is the
//! scenario's world: x east, y north, z up, meters; its origin is where the walked path begins, on the ground.

pub mod footprint;
mod grass;
mod haze;
pub mod planting;
mod shape;
mod spec;
mod surface;
mod terrain;
mod tree;
mod trunks;
mod waves;
pub mod wind;

pub use grass::Grass;
pub use haze::{Haze, LeafAngle, Outline};
pub use planting::{cones, surroundings};
pub use shape::{Bounds, Frustum, Leaf};
pub use spec::{ConesSpec, GrassSpec, Planting, SpecError, SurroundingsSpec, TerrainSpec, WorldSpec};
pub use terrain::Terrain;
pub use tree::{Crown, Prototype};
pub use trunks::{TRUNK_HEIGHT_M, TrunkTruth, trunk_map};
pub use wind::{Hinge, Sway, Wind, WindSpec};

use arborloop_base::{Class, Seed};
use nalgebra::{Point2, Similarity3};

/// An orchard as plain data, in the world frame.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    /// The ground.
    pub terrain: Terrain,
    /// The grass on it.
    pub grass: Grass,
    /// What a body can touch: cones and trunks.
    pub solids: Vec<Solid>,
    /// Branches and leaves, each shared by every plant that is grown from it.
    pub prototypes: Vec<Prototype>,
    /// Where prototypes stand. A tree may be several plants, one a limb, that share an instance.
    pub plants: Vec<Plant>,
    /// What moves the plants.
    pub wind: Wind,
}

/// A piece of something that a body can touch. A cone is several pieces that share one instance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// What it is.
    pub class: Class,
    /// Which object of that class, counted from 1.
    pub instance: u32,
    /// Its shape, world frame.
    pub shape: Frustum,
    /// Reflectance near 905 nm against a white diffuse target; above 1 for a retro-reflector.
    pub reflectivity_ratio: f64,
}

/// A prototype's branches and leaves standing in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plant {
    /// Which of [`World::prototypes`].
    pub prototype: usize,
    /// From the plant frame (origin where the trunk leaves the ground, z up) to the world.
    pub world_from_plant: Similarity3<f64>,
    /// Instance of its branches and leaves, and of its trunk if it has one; counted from 1.
    pub instance: u32,
    /// Where it gives way to the wind.
    pub hinge: Hinge,
}

/// Grows the world that a spec and a seed name. Every object has its own address of chance: one more tree moves no
/// cone, one more bush moves no tree.
///
/// # Panics
/// When the spec does not pass [`WorldSpec::check`].
pub fn build(spec: &WorldSpec, seed: Seed) -> World {
    if let Err(error) = spec.check() {
        panic!("a world is built from a checked spec, but {error}");
    }
    let terrain = Terrain::new(&spec.terrain, seed);
    let grass = Grass::new(&spec.grass, &spec.terrain, seed);
    let (mut solids, center) = match &spec.planting {
        Planting::Cones(field) => {
            (cones::solids(field, &terrain, seed), Point2::new(field.length_m / 2.0, field.width_m / 2.0))
        }
        Planting::None => (Vec::new(), Point2::origin()),
    };
    let ring = surroundings::grow(&spec.surroundings, center, &terrain, seed);
    solids.extend(ring.trunks);
    let wind = Wind::new(&spec.wind, &ring.plants, seed);
    World { terrain, grass, solids, prototypes: ring.prototypes, plants: ring.plants, wind }
}
