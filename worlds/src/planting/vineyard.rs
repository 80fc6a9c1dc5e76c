//! Vines on a trellis. Posts and wires are solids: a robot that leaves its alley touches them.

use super::rows;
use crate::foliage::Dress;
use crate::form::{Form, Limb, between, clump};
use crate::haze::{Haze, Outline};
use crate::shape::Frustum;
use crate::spec::{CrownSpec, VineyardSpec};
use crate::stand::{BURIED_M, Facing, PROTOTYPES, Site, Sort, Stand};
use crate::terrain::Terrain;
use crate::{Crown, Solid};
use arborloop_base::{Class, Draws, Seed, Stream};
use nalgebra::{Point3, Unit, Vector2, Vector3};

/// Canes that rise from the cordon into each clump.
const CANES: usize = 3;
/// Radius of a cane at its lower end, meters; assumed: pencils.
const CANE_M: f64 = 0.004;
/// Standard deviation of a post's lean along each axis, radians; assumed: a degree.
const POST_LEAN_RAD: f64 = 0.0175;

/// Posts from the stream `world/posts`, shapes from `world/plant_shapes`, each vine's own from `world/plants`.
pub(crate) fn grow(spec: &VineyardSpec, terrain: &Terrain, seed: Seed) -> Stand {
    let mut stand = Stand { solids: trellis(spec, terrain, seed), ..Stand::default() };
    let places: Vec<_> = rows::places(&spec.rows, seed).into_iter().filter(|place| !place.missing).collect();
    if places.is_empty() {
        return stand;
    }
    let wear = Dress {
        leaves: &spec.leaves,
        season: spec.season,
        foliage: spec.foliage,
        size_variation_ratio: spec.crown.size_variation_ratio,
        bark_reflectivity_ratio: spec.trunk.reflectivity_ratio,
    };
    let shapes = seed.stream("world/plant_shapes");
    let sorts: Vec<Sort> = (0..PROTOTYPES)
        .map(|kind| {
            let crown = spec.crown.crown_of_shape(spec.season, &mut shapes.at(kind));
            let form = vine(spec, &crown, shapes.child(2 * kind));
            stand.keep(&form, &wear, shapes.child(2 * kind + 1))
        })
        .collect();
    let own = seed.stream("world/plants");
    let facing = Facing::Along(spec.rows.bearing_deg.to_radians());
    for place in &places {
        let mut draws = own.child(place.row as u64).at(place.plant as u64);
        let sort = &sorts[(draws.unit() * sorts.len() as f64) as usize];
        let foot = Point3::new(place.point.x, place.point.y, terrain.height_m(place.point.x, place.point.y));
        let variation_ratio = spec.crown.size_variation_ratio;
        let site = Site::draw(place.instance(), foot, facing, variation_ratio, &spec.trunk, &mut draws);
        let world_from_plant = site.upright();
        // The head is tied to the wire; the stem comes up to it from where it was planted.
        let head = world_from_plant * Point3::new(0.0, 0.0, spec.trunk.height_m);
        let up = site.lean * Vector3::z();
        let stem_m = (head.z - foot.z + BURIED_M) / up.z;
        let radius_m = site.trunk_radius_m;
        if let Some(stem) = between(head - up * stem_m, head, radius_m, 0.8 * radius_m) {
            stand.put_trunk(site.instance, stem, &spec.trunk);
        }
        stand.put_crown(sort, site.instance, world_from_plant);
    }
    stand
}

/// A head, two or more arms along the wire, and canes up into the clumps of the curtain.
fn vine(spec: &VineyardSpec, crown: &Crown, stream: Stream) -> Form {
    let head = Point3::new(0.0, 0.0, spec.trunk.height_m);
    let arms = spec.crown.limbs;
    let mut shares: Vec<Vec<Haze>> = vec![Vec::new(); arms];
    for index in 0..spec.crown.clumps {
        let share = (index as f64 + 0.5) / spec.crown.clumps as f64;
        let clump = shoot(&spec.crown, crown, share, &mut stream.child(0).at(index as u64));
        shares[((share * arms as f64) as usize).min(arms - 1)].push(clump);
    }
    let limbs = shares
        .into_iter()
        .enumerate()
        .filter(|(_, clumps)| !clumps.is_empty())
        .map(|(index, clumps)| arm(head, spec.trunk.radius_m, clumps, &mut stream.child(1).at(index as u64)))
        .collect();
    // The stem is put up by itself: it leans, the vine does not.
    Form { crown: *crown, trunk_top_m: 0.0, trunk_taper_ratio: 1.0, limbs }
}

/// One arm, from the head to its farthest clump.
fn arm(head: Point3<f64>, radius_m: f64, clumps: Vec<Haze>, draws: &mut Draws) -> Limb {
    let ends = clumps.iter().map(|clump| clump.center.x + clump.half_size.x.copysign(clump.center.x));
    let farthest = ends.fold(0.0, |far: f64, x| if x.abs() > far.abs() { x } else { far });
    let tip = head + Vector3::new(farthest, 0.0, 0.02);
    let mut branches: Vec<Frustum> = between(head, tip, 0.8 * radius_m, 0.4 * radius_m).into_iter().collect();
    for clump in &clumps {
        for _ in 0..CANES {
            let aside = |half_m: f64, draws: &mut Draws| half_m * draws.within(-0.7, 0.7);
            let foot = Point3::new(clump.center.x + aside(clump.half_size.x, draws), 0.0, head.z);
            let top_m = clump.center.z + clump.half_size.z * draws.within(0.5, 1.0);
            let top =
                Point3::new(foot.x + aside(clump.half_size.x, draws), aside(clump.half_size.y, draws), top_m);
            branches.extend(between(foot, top, CANE_M, 0.5 * CANE_M));
        }
    }
    Limb { fork: head, branches, clumps }
}

/// The foliage of a few shoots: a box within the curtain, ragged at its top, bottom and sides.
fn shoot(spec: &CrownSpec, crown: &Crown, share: f64, draws: &mut Draws) -> Haze {
    let half = crown.half_size;
    let ratio = Vector3::new(
        (spec.clump_ratio * draws.within(0.8, 1.2)).min(1.0),
        draws.within(0.6, 1.0),
        draws.within(0.7, 1.0),
    );
    let free = half - half.component_mul(&ratio);
    // Evenly along the row; anywhere across and up that keeps it within the curtain.
    let offset = Vector3::new(
        free.x * (2.0 * share - 1.0),
        free.y * draws.within(-1.0, 1.0),
        free.z * draws.within(-1.0, 1.0),
    );
    clump(Outline::Box, crown.center + offset, half.component_mul(&ratio))
}

/// Posts and wires of every row, row by row.
fn trellis(spec: &VineyardSpec, terrain: &Terrain, seed: Seed) -> Vec<Solid> {
    let stream = seed.stream("world/posts");
    let rows = if spec.rows.plants == 0 { 0 } else { spec.rows.count };
    let mut solids = Vec::new();
    for row in 0..rows {
        let posts = posts(spec, row, terrain, stream.child(row as u64));
        solids.extend(posts.iter().enumerate().map(|(index, post)| Solid {
            class: Class::Post,
            instance: rows::instance(row, index),
            shape: *post,
            reflectivity_ratio: spec.trellis.post_reflectivity_ratio,
        }));
        solids.extend(wires(spec, row, &posts));
    }
    solids
}

/// The posts of a row: midway between vines, and half a vine's spacing beyond both ends.
fn posts(spec: &VineyardSpec, row: usize, terrain: &Terrain, stream: Stream) -> Vec<Frustum> {
    let (rows, trellis) = (&spec.rows, &spec.trellis);
    let count = rows.plants.div_ceil(trellis.plants_per_post) + 1;
    (0..count)
        .map(|index| {
            let vines = (index * trellis.plants_per_post).min(rows.plants);
            let along_m = (vines as f64 - 0.5) * rows.plant_spacing_m;
            let place = rows::at(rows, Vector2::new(along_m, row as f64 * rows.spacing_m));
            let mut draws = stream.at(index as u64);
            let [lean_x, lean_y] = [(); 2].map(|()| POST_LEAN_RAD * draws.normal().clamp(-2.0, 2.0));
            let up = Unit::new_normalize(Vector3::new(lean_x, lean_y, 1.0));
            let ends = index == 0 || index + 1 == count;
            let radius_m = if ends { trellis.end_post_radius_m } else { trellis.post_radius_m };
            let ground = Point3::new(place.x, place.y, terrain.height_m(place.x, place.y));
            Frustum {
                base: ground - BURIED_M * up.into_inner(),
                axis: up,
                height_m: trellis.post_height_m + BURIED_M,
                radius_base_m: radius_m,
                radius_top_m: radius_m,
            }
        })
        .collect()
}

/// The wires of a row: one instance each, a span from post to post.
fn wires<'a>(
    spec: &'a VineyardSpec,
    row: usize,
    posts: &'a [Frustum],
) -> impl Iterator<Item = Solid> + use<'a> {
    let trellis = &spec.trellis;
    trellis.wire_heights_m.iter().enumerate().flat_map(move |(wire, height_m)| {
        let spans = posts.windows(2).filter_map(move |pair| {
            let [from, to] = [&pair[0], &pair[1]].map(|post| post.center(BURIED_M + height_m));
            between(from, to, trellis.wire_radius_m, trellis.wire_radius_m)
        });
        spans.map(move |shape| Solid {
            class: Class::Wire,
            instance: rows::instance(row, wire),
            shape,
            reflectivity_ratio: trellis.wire_reflectivity_ratio,
        })
    })
}
