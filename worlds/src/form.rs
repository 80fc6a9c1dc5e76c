//! The forms that plants grow into: clumps of leaves within a crown, and limbs that carry them.
//!
//! A clump is where leaves are, whether they are drawn as surfaces or as haze. Branch radii follow Leonardo's rule: the
//! sections of the branches of one level add up to the section of what bears them.

use crate::crown::{Crown, CrownShape};
use crate::haze::{Haze, Outline};
use crate::leaf_angle::LeafAngle;
use crate::shape::Frustum;
use crate::spec::CrownSpec;
use crate::tree::{GOLDEN_ANGLE, direction};
use arborloop_base::{Draws, Stream};
use nalgebra::{Point3, Unit, Vector3};
use std::f64::consts::TAU;

/// A plant without its trunk and without leaves, plant frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Form {
    /// The space that holds every clump.
    pub(crate) crown: Crown,
    /// How high the trunk goes, meters; 0 for a plant without one.
    pub(crate) trunk_top_m: f64,
    /// Radius of the trunk's upper end as a share of the lower.
    pub(crate) trunk_taper_ratio: f64,
    /// Parts that move in the wind each for itself.
    pub(crate) limbs: Vec<Limb>,
}

/// A part that moves in the wind as one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Limb {
    /// Where it leaves the trunk.
    pub(crate) fork: Point3<f64>,
    /// Its wood.
    pub(crate) branches: Vec<Frustum>,
    /// Where its leaves are; how densely is not said yet.
    pub(crate) clumps: Vec<Haze>,
}

/// How limbs leave the trunk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Habit {
    /// The trunk ends where its limbs part, between these heights in meters: fruit trees, broadleaf trees, bushes.
    Forked([f64; 2]),
    /// The trunk goes up to the tip, and every branch leaves it level: conifers, spindle-trained fruit trees.
    Leader,
}

impl Habit {
    /// Pointed crowns have a leader; others fork over the upper third of the bare stem.
    pub(crate) fn of(crown: &Crown, stem_m: f64) -> Habit {
        match crown.shape {
            CrownShape::Cone => Habit::Leader,
            CrownShape::Ellipsoid | CrownShape::Box => Habit::Forked([0.67 * stem_m, stem_m]),
        }
    }
}

/// Share of a hedge's clumps on its top; a cube's is a fifth of top and sides.
const TOP_SHARE: f64 = 0.2;
/// Share of a hedge's clumps around its lower rim.
const RIM_SHARE: f64 = 0.25;
/// Twigs that spread from the middle of a clump.
const TWIGS: usize = 5;
/// Bark and pith leave this share of the trunk's section to the limbs.
const SECTION_RATIO: f64 = 0.9;
/// No branch is thinner than this, meters.
const BRANCH_M_MIN: f64 = 0.004;
/// No twig is thinner than this, meters.
const TWIG_M_MIN: f64 = 0.002;

/// A plant whose limbs share out a crown's clumps by their bearing, around a trunk of radius `trunk_radius_m`. Of two that
/// are grown after each other (`number`) one spirals to the left and one to the right.
pub(crate) fn grown(
    spec: &CrownSpec,
    crown: &Crown,
    habit: Habit,
    trunk_radius_m: f64,
    number: u64,
    stream: Stream,
) -> Form {
    let clumps = clumps(spec, crown, hand(number), stream.child(0));
    let limb_stream = stream.child(1);
    let turned = limb_stream.at(u64::MAX).unit();
    let sector = |clump: &Haze| {
        let turns = clump.center.y.atan2(clump.center.x) / TAU + turned;
        (turns.rem_euclid(1.0) * spec.limbs as f64) as usize % spec.limbs
    };
    let mut shares = vec![Vec::new(); spec.limbs];
    clumps.iter().for_each(|clump| shares[sector(clump)].push(*clump));
    let (trunk_top_m, trunk_taper_ratio) = match habit {
        Habit::Forked([_, high_m]) => (high_m, 0.7),
        Habit::Leader => (crown.top_m() - 0.02 * crown.half_size.z, 0.1),
    };
    let wood = Wood {
        limb_m: trunk_radius_m * (SECTION_RATIO / spec.limbs as f64).sqrt(),
        branch_m: (trunk_radius_m * (SECTION_RATIO / spec.clumps as f64).sqrt()).max(BRANCH_M_MIN),
    };
    let limbs = shares
        .into_iter()
        .enumerate()
        .filter(|(_, share)| !share.is_empty())
        .map(|(index, share)| {
            let mut draws = limb_stream.at(index as u64);
            let place = (index as f64 + draws.unit()) / spec.limbs as f64;
            match habit {
                Habit::Forked([low_m, high_m]) => {
                    let fork = Point3::new(0.0, 0.0, low_m + place * (high_m - low_m));
                    forked_limb(fork, share, &wood, &mut draws)
                }
                Habit::Leader => level_limb(crown, share, &wood, &mut draws),
            }
        })
        .collect();
    Form { crown: *crown, trunk_top_m, trunk_taper_ratio, limbs }
}

/// Which way round the clumps of a plant follow each other.
fn hand(number: u64) -> f64 {
    if number.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// Radii of a plant's wood at its lower ends, meters.
struct Wood {
    limb_m: f64,
    branch_m: f64,
}

/// A scaffold that rises steeply, bends outward to the middle of its clumps, and bears a branch for each.
fn forked_limb(fork: Point3<f64>, clumps: Vec<Haze>, wood: &Wood, draws: &mut Draws) -> Limb {
    let sum: Vector3<f64> = clumps.iter().map(|clump| clump.center.coords).sum();
    let middle = Point3::from(sum / clumps.len() as f64);
    let out = middle - fork;
    let knee = fork
        + Vector3::new(0.35 * out.x, 0.35 * out.y, 0.6 * out.z)
        + out.norm() * 0.08 * direction(draws).component_mul(&Vector3::new(1.0, 1.0, 0.3));
    let mut branches = Vec::new();
    branches.extend(between(fork, knee, wood.limb_m, 0.8 * wood.limb_m));
    branches.extend(between(knee, middle, 0.8 * wood.limb_m, 0.5 * wood.limb_m));
    for clump in &clumps {
        let start = nearest(&[fork, knee, middle], &clump.center);
        branches.extend(between(start, clump.center, wood.branch_m, 0.6 * wood.branch_m));
        branches.extend(twigs(clump, wood, draws));
    }
    Limb { fork, branches, clumps }
}

/// Branches that leave the trunk a little above their clumps, as a conifer's hang.
fn level_limb(crown: &Crown, clumps: Vec<Haze>, wood: &Wood, draws: &mut Draws) -> Limb {
    let mut branches = Vec::new();
    for clump in &clumps {
        let drop_m = 0.15 * clump.center.coords.xy().norm();
        let height_m = (clump.center.z + drop_m).min(crown.top_m() - 0.05 * crown.half_size.z);
        let start = Point3::new(0.0, 0.0, height_m);
        branches.extend(between(start, clump.center, wood.branch_m, 0.5 * wood.branch_m));
        branches.extend(twigs(clump, wood, draws));
    }
    Limb { fork: Point3::new(0.0, 0.0, crown.base_m()), branches, clumps }
}

/// From the middle of a clump almost to its outline.
fn twigs(clump: &Haze, wood: &Wood, draws: &mut Draws) -> Vec<Frustum> {
    let radius_m = (0.5 * wood.branch_m).max(TWIG_M_MIN);
    (0..TWIGS)
        .filter_map(|_| {
            let out = direction(draws).component_mul(&clump.half_size) * draws.within(0.6, 0.95);
            // Twigs grow outward and up: never back toward the trunk's foot.
            let out = Vector3::new(out.x, out.y, out.z.abs());
            between(clump.center, clump.center + out, radius_m, 0.5 * radius_m)
        })
        .collect()
}

/// Clumps spread evenly over a crown, each within it. Their spiral begins anywhere and goes round either way (`hand` is 1 or
/// -1): were it the same in all plants, a grove would look other to its left than to its right.
fn clumps(spec: &CrownSpec, crown: &Crown, hand: f64, stream: Stream) -> Vec<Haze> {
    let count = spec.clumps as f64;
    // The address after the last that any clump can have.
    let turned_rad = stream.at(u64::MAX).within(0.0, TAU);
    (0..spec.clumps)
        .map(|index| {
            let mut draws = stream.at(index as u64);
            let share = (index as f64 + draws.unit()) / count;
            let bearing_rad = turned_rad + hand * index as f64 * GOLDEN_ANGLE + draws.within(-0.3, 0.3);
            let (sin, cos) = bearing_rad.sin_cos();
            let hollow = spec.hollow_ratio.powi(3);
            let out_ratio = (hollow + (1.0 - hollow) * draws.unit()).cbrt();
            let size_ratio = (spec.clump_ratio * draws.within(0.8, 1.2)).min(1.0);
            if crown.shape == CrownShape::Cone {
                return whorl(crown, share, out_ratio, size_ratio, [cos, sin]);
            }
            let unit = match crown.shape {
                CrownShape::Box => hedge_point(share, out_ratio, [cos, sin]),
                _ => ball_point(share, [cos, sin]) * out_ratio,
            };
            // A convex body's scaled copies, one shrunk by what the other keeps, add up to the body: no clump leaves it.
            let offset = unit.component_mul(&crown.half_size) * (1.0 - size_ratio);
            clump(Outline::Ellipsoid, crown.center + offset, crown.half_size * size_ratio)
        })
        .collect()
}

/// Evenly over the unit sphere, in bands of equal area.
fn ball_point(share: f64, [cos, sin]: [f64; 2]) -> Vector3<f64> {
    let up = 1.0 - 2.0 * share;
    let level = (1.0 - up * up).max(0.0).sqrt();
    Vector3::new(level * cos, level * sin, up)
}

/// Over a hedge's top and sides, and once more around its lower rim: the cube of half side 1, pulled inward by
/// `out_ratio`. Without a rim of their own the lowest clumps would leave light under their round bellies.
fn hedge_point(share: f64, out_ratio: f64, [cos, sin]: [f64; 2]) -> Vector3<f64> {
    let level = Vector3::new(cos, sin, 0.0) / cos.abs().max(sin.abs());
    if share < TOP_SHARE {
        return level * (share / TOP_SHARE).sqrt() + Vector3::z() * out_ratio;
    }
    let down = ((share - TOP_SHARE) / (1.0 - TOP_SHARE - RIM_SHARE)).min(1.0);
    level * out_ratio + Vector3::z() * (1.0 - 2.0 * down)
}

/// A flat clump of a cone, as far up as holds `share` of its outline seen from the side.
fn whorl(crown: &Crown, share: f64, out_ratio: f64, size_ratio: f64, [cos, sin]: [f64; 2]) -> Haze {
    let height_m = 2.0 * crown.half_size.z;
    let up = 1.0 - (1.0 - share).sqrt();
    let half_m = 0.25 * size_ratio * height_m * (1.0 - 0.8 * up);
    let center_m = crown.base_m() + half_m + up * (height_m - 2.0 * half_m);
    // The cone is narrowest at the clump's upper end; half of that radius is the clump's own, half is its way out.
    let free = (crown.top_m() - center_m - half_m) / height_m;
    let across = 0.5 * free * Vector3::new(crown.half_size.x, crown.half_size.y, 0.0);
    let center = Point3::new(out_ratio * across.x * cos, out_ratio * across.y * sin, center_m);
    clump(Outline::Ellipsoid, center, Vector3::new(across.x, across.y, half_m))
}

/// A clump whose leaves are not counted yet.
pub(crate) fn clump(outline: Outline, center: Point3<f64>, half_size: Vector3<f64>) -> Haze {
    Haze { outline, center, half_size, leaf_area_per_m: 0.0, leaf_angle: LeafAngle::Spherical }
}

/// A frustum between two points; `None` between two that are one.
pub(crate) fn between(from: Point3<f64>, to: Point3<f64>, from_m: f64, to_m: f64) -> Option<Frustum> {
    let (axis, height_m) = Unit::try_new_and_get(to - from, 1e-9)?;
    Some(Frustum { base: from, axis, height_m, radius_base_m: from_m, radius_top_m: to_m })
}

/// The point of a polyline from which a branch goes to `target`: behind the nearest, since branches rise forward.
fn nearest(line: &[Point3<f64>], target: &Point3<f64>) -> Point3<f64> {
    const PARTS: usize = 8;
    let points = line.windows(2).flat_map(|pair| {
        (0..=PARTS).map(move |part| pair[0] + (pair[1] - pair[0]) * (part as f64 / PARTS as f64))
    });
    let cost = |point: &Point3<f64>| (target - point).norm() - 0.5 * (target.z - point.z).max(0.0);
    points.min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(*target)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::season::Season;
    use crate::spec::OrchardSpec;
    use arborloop_base::Seed;

    #[test]
    fn clumps_spiral_from_any_bearing_on_and_in_every_other_plant_the_other_way_round() {
        let spec = OrchardSpec::default().crown;
        let crown = spec.crown(Season::Full);
        let bearings_rad = |number: u64| -> Vec<f64> {
            let hand = hand(number);
            let clumps = clumps(&spec, &crown, hand, Seed(1).stream("forms").child(number));
            clumps.iter().map(|clump| clump.center.y.atan2(clump.center.x)).collect()
        };
        let mut first_rad = Vec::new();
        for number in 0..8 {
            let bearings_rad = bearings_rad(number);
            let turns = bearings_rad.windows(2).map(|pair| (pair[1] - pair[0]).sin());
            let mean = turns.sum::<f64>() / (bearings_rad.len() - 1) as f64;
            assert!(if number.is_multiple_of(2) { mean > 0.5 } else { mean < -0.5 }, "{number}: {mean}");
            first_rad.push(bearings_rad[0]);
        }
        assert!(first_rad.iter().any(|bearing| bearing.cos() > 0.3));
        assert!(first_rad.iter().any(|bearing| bearing.cos() < -0.3));
    }
}
