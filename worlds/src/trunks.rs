//! The trunk map: where every upright thing stands and how thick it is, the truth for maps of landmarks.

use crate::{Solid, World};
use arborloop_base::Class;
use std::collections::BTreeMap;

/// Height above the ground at which trunks are measured, meters: within a lidar's slice.
pub const TRUNK_HEIGHT_M: f64 = 0.3;

/// One cone, trunk or post.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrunkTruth {
    /// What it is.
    pub class: Class,
    /// Which object of that class.
    pub instance: u32,
    /// Center of its section at [`TRUNK_HEIGHT_M`] above the ground, world frame, meters.
    pub x_m: f64,
    /// See `x_m`.
    pub y_m: f64,
    /// Radius there, meters; at its nearest end for an object that does not reach that height.
    pub radius_m: f64,
}

/// All cones, trunks and posts, ordered by class and instance.
pub fn trunk_map(world: &World) -> Vec<TrunkTruth> {
    let mut objects: BTreeMap<(Class, u32), Vec<&Solid>> = BTreeMap::new();
    let upright = |solid: &&Solid| matches!(solid.class, Class::Cone | Class::Trunk | Class::Post);
    for solid in world.solids.iter().filter(upright) {
        objects.entry((solid.class, solid.instance)).or_default().push(solid);
    }
    objects
        .into_iter()
        .filter_map(|((class, instance), pieces)| {
            let section = |solid: &&Solid| {
                let shape = &solid.shape;
                let ground_m = world.terrain.height_m(shape.base.x, shape.base.y);
                let wanted_m = (ground_m + TRUNK_HEIGHT_M - shape.base.z) / shape.axis.z;
                let along_m = wanted_m.clamp(0.0, shape.height_m);
                (wanted_m - along_m, along_m, **solid)
            };
            // The piece that reaches nearest to the wanted height: the one that contains it, if any does.
            let (_, along_m, solid) =
                pieces.iter().map(section).min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
            let center = solid.shape.center(along_m);
            let radius_m = solid.shape.radius_m(along_m);
            Some(TrunkTruth { class, instance, x_m: center.x, y_m: center.y, radius_m })
        })
        .collect()
}
