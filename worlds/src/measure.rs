//! Leaf area measured back from a grown world, as a surveyor with a perfect eye would: what came out, not what was asked.

use crate::World;
use crate::shape::Bounds;
use crate::stand::CrownTruth;
use nalgebra::Point3;
use std::collections::BTreeMap;

/// The foliage of one plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foliated {
    /// The plant, as in [`crate::Plant::instance`].
    pub instance: u32,
    /// Where it stands, world frame, meters.
    pub foot: Point3<f64>,
    /// One-sided area of all its leaves, m2.
    pub leaf_area_m2: f64,
    /// The part of that area whose leaves' middles lie inside the crown's outline, m2.
    pub inside_m2: f64,
    /// Volume of the crown's outline, m3.
    pub crown_m3: f64,
    /// Area of the crown seen from above, m2.
    pub cover_m2: f64,
}

/// The foliage of every plant with a crown, in the order of the plants; leaves and haze alike.
pub fn foliage(world: &World) -> Vec<Foliated> {
    let mut found: Vec<Foliated> = world.crowns.iter().map(bare).collect();
    let order: BTreeMap<u32, usize> =
        world.crowns.iter().enumerate().map(|(index, crown)| (crown.instance, index)).collect();
    for plant in &world.plants {
        let Some(&index) = order.get(&plant.instance) else { continue };
        let (prototype, crown) = (&world.prototypes[plant.prototype], &world.crowns[index].crown);
        // Limbs share their tree's frame, so what is inside there is inside in the world.
        let squared = plant.world_from_plant.scaling().powi(2);
        let leaves = prototype.leaves.iter().map(|leaf| (leaf.center, leaf.area_m2()));
        // Haze is even: what its middle says holds for all of it as long as outlines are convex and hold their clumps.
        let haze = prototype.haze.iter().map(|haze| (haze.center, haze.leaf_area_m2()));
        for (center, area_m2) in leaves.chain(haze) {
            found[index].leaf_area_m2 += squared * area_m2;
            if crown.contains(&center) {
                found[index].inside_m2 += squared * area_m2;
            }
        }
    }
    found
}

/// One-sided leaf area inside the crowns per volume of the crowns, m2/m3 (leaf area density); 0 without crowns.
pub fn leaf_area_density(plants: &[Foliated]) -> f64 {
    ratio(plants.iter().map(|plant| plant.inside_m2).sum(), plants.iter().map(|plant| plant.crown_m3).sum())
}

/// One-sided leaf area per ground area (leaf area index) of the plants whose feet are within `bounds`.
pub fn leaf_area_index(plants: &[Foliated], bounds: &Bounds) -> f64 {
    let within = plants.iter().filter(|plant| bounds.contains(&plant.foot.xy()));
    let size = bounds.high - bounds.low;
    ratio(within.map(|plant| plant.leaf_area_m2).sum(), size.x.max(0.0) * size.y.max(0.0))
}

fn bare(crown: &CrownTruth) -> Foliated {
    let scale = crown.world_from_plant.scaling();
    Foliated {
        instance: crown.instance,
        foot: crown.world_from_plant * Point3::origin(),
        leaf_area_m2: 0.0,
        inside_m2: 0.0,
        crown_m3: crown.volume_m3(),
        cover_m2: crown.crown.cover_m2() * scale * scale,
    }
}

fn ratio(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}
