//! A forest: trees scattered at a least distance, bushes between them, a trail that stays clear.

use crate::foliage::Dress;
use crate::form::{Habit, grown};
use crate::spec::{CrownSpec, ForestSpec, LeavesSpec, StandSpec, TrunkSpec};
use crate::stand::{Facing, Site, Sort, Stand};
use crate::terrain::Terrain;
use arborloop_base::{Draws, Seed, Stream};
use nalgebra::{Point2, Point3};
use std::collections::BTreeMap;

/// Broadleaf trees grown apart; more trees repeat them turned and scaled.
const BROADLEAVES: u64 = 5;
/// Conifers grown apart.
const CONIFERS: u64 = 3;
/// Bushes grown apart.
const BUSHES: u64 = 3;
/// Places that a tree or bush tries before it is left out.
const TRIES: usize = 64;
/// Radius from which a bush's stems branch, meters; assumed.
const STEM_M: f64 = 0.02;
/// Bushes' instances follow this number.
const BUSH_INSTANCES: u32 = 100_000;

/// The middle of the stand and how far its plants reach from there, meters.
pub(crate) fn extent(stand: &StandSpec) -> (Point2<f64>, f64) {
    (Point2::new(stand.x_m, stand.y_m), stand.length_m.hypot(stand.width_m) / 2.0)
}

/// Where trees stand, by index; `None` where one found no room. Each tries places from its own address of the stream
/// `world/forest/tree` and yields to those before it only, so that one more tree moves none.
pub fn tree_places(stand: &StandSpec, seed: Seed) -> Vec<Option<Point2<f64>>> {
    let clear_m = stand.trail_clearance_m;
    scattered(stand, stand.trees, stand.spacing_m_min, clear_m, seed.stream("world/forest/tree"))
}

/// Where bushes stand, by index, from the stream `world/forest/bush`; as for trees, with whom they share the ground.
pub fn bush_places(spec: &ForestSpec, seed: Seed) -> Vec<Option<Point2<f64>>> {
    let crown = spec.undergrowth.crown();
    let widest_m = crown.width_m * (1.0 + crown.size_variation_ratio) * (1.0 + crown.form_variation_ratio);
    let clear_m = spec.stand.trail_clearance_m + widest_m / 2.0;
    let stream = seed.stream("world/forest/bush");
    scattered(&spec.stand, spec.undergrowth.bushes, 0.5 * spec.undergrowth.height_m, clear_m, stream)
}

/// A kind of plant that grows here.
struct Kind<'a> {
    crown: &'a CrownSpec,
    leaves: &'a LeavesSpec,
    habit: Habit,
    stem_m: f64,
    prototypes: u64,
}

/// Trees carry the instances 1 to their number, left-out ones too. Shapes come from the streams
/// `world/forest/broadleaf`, `world/forest/conifer` and `world/forest/bush_shapes`, each plant's own from
/// `world/plants` and `world/bushes` by index.
pub(crate) fn grow(spec: &ForestSpec, terrain: &Terrain, seed: Seed) -> Stand {
    let mut stand = Stand::default();
    let habit = |crown: &CrownSpec| Habit::of(&crown.crown(spec.season), spec.trunk.height_m);
    let kinds = [(&spec.crown, BROADLEAVES, "broadleaf"), (&spec.conifer, CONIFERS, "conifer")];
    let mut sorts = [Vec::new(), Vec::new()];
    let own = seed.stream("world/plants");
    for (index, place) in tree_places(&spec.stand, seed).into_iter().enumerate() {
        let Some(place) = place else { continue };
        let which = usize::from(own.child(1).at(index as u64).chance(spec.stand.conifer_ratio));
        let (crown, prototypes, name) = kinds[which];
        let stem_m = spec.trunk.radius_m;
        let kind = Kind { crown, leaves: &spec.leaves, habit: habit(crown), stem_m, prototypes };
        if sorts[which].is_empty() {
            sorts[which] = grow_kind(&mut stand, spec, &kind, seed.stream(&format!("world/forest/{name}")));
        }
        let draws = own.child(0).at(index as u64);
        put(&mut stand, &sorts[which], index as u32 + 1, upon(terrain, place), crown, &spec.trunk, draws);
    }
    undergrowth(&mut stand, spec, terrain, seed);
    stand
}

/// Bushes: several stems from the ground, no trunk.
fn undergrowth(stand: &mut Stand, spec: &ForestSpec, terrain: &Terrain, seed: Seed) {
    let under = &spec.undergrowth;
    let crown = under.crown();
    let leaves =
        LeavesSpec { size_m: under.leaf_size_m, area_per_m: under.leaf_area_per_m, ..spec.leaves.clone() };
    let stems = TrunkSpec { radius_m: STEM_M, lean_deg: 0.0, ..spec.trunk.clone() };
    let habit = Habit::Forked([0.0; 2]);
    let kind = Kind { crown: &crown, leaves: &leaves, habit, stem_m: STEM_M, prototypes: BUSHES };
    let mut sorts = Vec::new();
    for (index, place) in bush_places(spec, seed).into_iter().enumerate() {
        let Some(place) = place else { continue };
        if sorts.is_empty() {
            sorts = grow_kind(stand, spec, &kind, seed.stream("world/forest/bush_shapes"));
        }
        let draws = seed.stream("world/bushes").at(index as u64);
        let instance = BUSH_INSTANCES + index as u32 + 1;
        put(stand, &sorts, instance, upon(terrain, place), &crown, &stems, draws);
    }
}

fn grow_kind(stand: &mut Stand, spec: &ForestSpec, kind: &Kind<'_>, shapes: Stream) -> Vec<Sort> {
    let wear = Dress {
        leaves: kind.leaves,
        season: spec.season,
        foliage: spec.foliage,
        size_variation_ratio: kind.crown.size_variation_ratio,
        bark_reflectivity_ratio: spec.trunk.reflectivity_ratio,
    };
    (0..kind.prototypes)
        .map(|number| {
            let crown = kind.crown.crown_of_shape(spec.season, &mut shapes.at(number));
            let form = grown(kind.crown, &crown, kind.habit, kind.stem_m, number, shapes.child(2 * number));
            stand.keep(&form, &wear, shapes.child(2 * number + 1))
        })
        .collect()
}

fn put(
    stand: &mut Stand,
    sorts: &[Sort],
    instance: u32,
    foot: Point3<f64>,
    crown: &CrownSpec,
    trunk: &TrunkSpec,
    mut draws: Draws,
) {
    let sort = &sorts[(draws.unit() * sorts.len() as f64) as usize];
    let facing = Facing::of(sort.crown(), 0.0);
    let site = Site::draw(instance, foot, facing, crown.size_variation_ratio, trunk, &mut draws);
    stand.put(sort, &site, trunk);
}

fn upon(terrain: &Terrain, place: Point2<f64>) -> Point3<f64> {
    Point3::new(place.x, place.y, terrain.height_m(place.x, place.y))
}

/// Darts thrown one after the other; each yields to those that stick already and to the trail.
fn scattered(
    stand: &StandSpec,
    count: usize,
    spacing_m: f64,
    clear_m: f64,
    stream: Stream,
) -> Vec<Option<Point2<f64>>> {
    // Cells as wide as the spacing: whoever is too near is in one of nine.
    let side_m = spacing_m.max(0.1);
    let cell = |place: &Point2<f64>| ((place.x / side_m).floor() as i64, (place.y / side_m).floor() as i64);
    let mut taken: BTreeMap<(i64, i64), Vec<Point2<f64>>> = BTreeMap::new();
    let low = Point2::new(stand.x_m - stand.length_m / 2.0, stand.y_m - stand.width_m / 2.0);
    (0..count)
        .map(|index| {
            let mut draws = stream.at(index as u64);
            for _ in 0..TRIES {
                let [x, y] = [stand.length_m, stand.width_m].map(|side_m| side_m * draws.unit());
                let place = Point2::new(low.x + x, low.y + y);
                let (column, row) = cell(&place);
                let near = (column - 1..=column + 1)
                    .flat_map(|column| (row - 1..=row + 1).map(move |row| (column, row)))
                    .filter_map(|cell| taken.get(&cell))
                    .flatten()
                    .any(|other| (other - place).norm() < spacing_m);
                if !near && from_trail_m(&stand.trail_m, &place) >= clear_m {
                    taken.entry((column, row)).or_default().push(place);
                    return Some(place);
                }
            }
            None
        })
        .collect()
}

/// Distance to the trail, meters; infinite where there is none.
fn from_trail_m(trail_m: &[[f64; 2]], place: &Point2<f64>) -> f64 {
    let corner = |index: usize| Point2::from(trail_m[index]);
    let legs = (0..trail_m.len()).map(|index| {
        let (from, to) = (corner(index), corner((index + 1).min(trail_m.len() - 1)));
        let leg = to - from;
        let share = (place - from).dot(&leg) / leg.norm_squared().max(f64::MIN_POSITIVE);
        (place - (from + leg * share.clamp(0.0, 1.0))).norm()
    });
    legs.fold(f64::INFINITY, f64::min)
}
