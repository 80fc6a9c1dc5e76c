//! What stands in a world, one file per kind of planting.

pub mod cones;
pub mod surroundings;
