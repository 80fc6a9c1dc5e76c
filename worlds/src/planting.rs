//! What stands in a world, one file per kind of planting.

pub mod cones;
pub mod forest;
pub(crate) mod grove;
pub mod rows;
pub mod surroundings;
pub(crate) mod vineyard;
