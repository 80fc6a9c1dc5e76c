//! Trees in rows: citrus groves and orchards differ in their numbers and in the way that their limbs part.

use super::rows;
use crate::foliage::Dress;
use crate::form::{Habit, grown};
use crate::season::{Foliage, Season};
use crate::spec::{CitrusSpec, CrownSpec, LeavesSpec, OrchardSpec, RowsSpec, TrunkSpec};
use crate::stand::{Facing, PROTOTYPES, Site, Sort, Stand};
use crate::terrain::Terrain;
use arborloop_base::Seed;
use nalgebra::Point3;

/// What is said of trees in rows.
struct Grove<'a> {
    season: Season,
    foliage: Foliage,
    rows: &'a RowsSpec,
    trunk: &'a TrunkSpec,
    crown: &'a CrownSpec,
    leaves: &'a LeavesSpec,
}

/// A citrus grove.
pub(crate) fn citrus(spec: &CitrusSpec, terrain: &Terrain, seed: Seed) -> Stand {
    let CitrusSpec { season, foliage, rows, trunk, crown, leaves } = spec;
    grow(&Grove { season: *season, foliage: *foliage, rows, trunk, crown, leaves }, terrain, seed)
}

/// An orchard.
pub(crate) fn orchard(spec: &OrchardSpec, terrain: &Terrain, seed: Seed) -> Stand {
    let OrchardSpec { season, foliage, rows, trunk, crown, leaves } = spec;
    grow(&Grove { season: *season, foliage: *foliage, rows, trunk, crown, leaves }, terrain, seed)
}

/// Shapes come from the stream `world/plant_shapes`, each plant's own from `world/plants` by row and place.
fn grow(grove: &Grove<'_>, terrain: &Terrain, seed: Seed) -> Stand {
    let mut stand = Stand::default();
    let places: Vec<_> = rows::places(grove.rows, seed).into_iter().filter(|place| !place.missing).collect();
    if places.is_empty() {
        return stand;
    }
    let wear = Dress {
        leaves: grove.leaves,
        season: grove.season,
        foliage: grove.foliage,
        size_variation_ratio: grove.crown.size_variation_ratio,
        bark_reflectivity_ratio: grove.trunk.reflectivity_ratio,
    };
    let shapes = seed.stream("world/plant_shapes");
    let crown = grove.crown.crown(grove.season);
    let facing = Facing::of(&crown, grove.rows.bearing_deg.to_radians());
    let habit = Habit::of(&crown, grove.trunk.height_m);
    let sorts: Vec<Sort> = (0..PROTOTYPES)
        .map(|kind| {
            let crown = grove.crown.crown_of_shape(grove.season, &mut shapes.at(kind));
            let form = grown(grove.crown, &crown, habit, grove.trunk.radius_m, kind, shapes.child(2 * kind));
            stand.keep(&form, &wear, shapes.child(2 * kind + 1))
        })
        .collect();
    let own = seed.stream("world/plants");
    for place in &places {
        let mut draws = own.child(place.row as u64).at(place.plant as u64);
        let sort = &sorts[(draws.unit() * sorts.len() as f64) as usize];
        let foot = Point3::new(place.point.x, place.point.y, terrain.height_m(place.point.x, place.point.y));
        let size_variation_ratio = grove.crown.size_variation_ratio;
        let site = Site::draw(place.instance(), foot, facing, size_variation_ratio, grove.trunk, &mut draws);
        stand.put(sort, &site, grove.trunk);
    }
    stand
}
