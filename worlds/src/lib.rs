//! Procedural worlds as plain data: a cone field, citrus, an orchard, a vineyard, a forest, and their truth.
//!
//! A [`WorldSpec`] and a [`Seed`] become a [`World`]; no engine type and no file is known here. The frame is the
//! scenario's world: x east, y north, z up, meters; its origin is a point on the ground.
//!
//! A planting of plants is made in four steps. A [`Crown`] says which space leaves fill. A form spreads clumps of leaves
//! over it and grows the wood that bears them, limb by limb. Foliage fills the clumps with leaves, or with [`Haze`] of the
//! same density. Some shapes grown this way, the [`Prototype`]s, are put up at every place, turned, scaled and leaned.

mod crown;
mod foliage;
pub mod footprint;
mod form;
mod grass;
mod haze;
mod leaf_angle;
pub mod measure;
pub mod planting;
mod season;
mod shape;
mod spec;
mod stand;
mod surface;
mod terrain;
mod tree;
mod trunks;
mod waves;
pub mod wind;

pub use crown::{Crown, CrownShape};
pub use grass::Grass;
pub use haze::{Haze, Outline};
pub use leaf_angle::LeafAngle;
pub use planting::{cones, forest, rows, surroundings};
pub use season::{Foliage, Season, SeasonScales};
pub use shape::{Bounds, Frustum, Leaf};
pub use spec::{
    CitrusSpec, ConesSpec, CrownSpec, ForestSpec, GrassSpec, LeavesSpec, OrchardSpec, Planting, RowsSpec,
    SpecError, StandSpec, SurroundingsSpec, TerrainSpec, TrellisSpec, TrunkSpec, UndergrowthSpec,
    VineyardSpec, WorldSpec,
};
pub use stand::CrownTruth;
pub use terrain::Terrain;
pub use tree::Prototype;
pub use trunks::{TRUNK_HEIGHT_M, TrunkTruth, trunk_map};
pub use wind::{Hinge, Sway, Wind, WindSpec};

use crate::planting::{grove, vineyard};
use crate::stand::Stand;
use crate::surroundings::Around;
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
    /// What the leaves of each plant fill: one per instance, in the order of the plants.
    pub crowns: Vec<CrownTruth>,
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
    let (mut stand, around) = match &spec.planting {
        Planting::Cones(field) => {
            let solids = cones::solids(field, &terrain, seed);
            let center = Point2::new(field.length_m / 2.0, field.width_m / 2.0);
            (Stand { solids, ..Stand::default() }, Around::bare(center))
        }
        Planting::Citrus(spec) => {
            (grove::citrus(spec, &terrain, seed), Around::plants(rows::extent(&spec.rows)))
        }
        Planting::Orchard(spec) => {
            (grove::orchard(spec, &terrain, seed), Around::plants(rows::extent(&spec.rows)))
        }
        Planting::Vineyard(spec) => {
            (vineyard::grow(spec, &terrain, seed), Around::plants(rows::extent(&spec.rows)))
        }
        Planting::Forest(spec) => {
            (forest::grow(spec, &terrain, seed), Around::plants(forest::extent(&spec.stand)))
        }
        Planting::None => (Stand::default(), Around::bare(Point2::origin())),
    };
    stand.join(surroundings::grow(&spec.surroundings, &around, &terrain, seed));
    let wind = Wind::new(&spec.wind, &stand.plants, seed);
    let Stand { solids, prototypes, plants, crowns } = stand;
    World { terrain, grass, solids, prototypes, plants, crowns, wind }
}
