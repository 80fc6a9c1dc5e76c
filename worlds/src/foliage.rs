//! From clumps to foliage: leaves as surfaces, or the same leaf area as haze.

use crate::form::Form;
use crate::haze::{Haze, Outline};
use crate::season::{Foliage, Season};
use crate::shape::Leaf;
use crate::spec::LeavesSpec;
use crate::tree::{Prototype, direction, gather_shoots};
use arborloop_base::{Draws, Stream};
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// What a planting's plants wear.
pub(crate) struct Dress<'a> {
    pub(crate) leaves: &'a LeavesSpec,
    pub(crate) season: Season,
    pub(crate) foliage: Foliage,
    /// A plant's size differs from the mean by up to this share.
    pub(crate) size_variation_ratio: f64,
    pub(crate) bark_reflectivity_ratio: f64,
}

/// A leaf's side is uniform within a ninth of its mean, so its mean square is 1 + 1/243 of the mean's square.
const MEAN_SQUARE: f64 = 1.0 + 1.0 / 243.0;

/// One prototype per limb. All clumps of a plant are equally dense, and together hold the leaf area density times the
/// volume of the crown's outline.
pub(crate) fn dress(form: &Form, wear: &Dress<'_>, stream: Stream) -> Vec<Prototype> {
    let scales = wear.season.scales();
    let clumps_m3: f64 = form.limbs.iter().flat_map(|limb| &limb.clumps).map(Haze::volume_m3).sum();
    // Over sizes 1 + v u, u uniform in [-1, 1], areas grow by 1 + v2/3 and volumes by 1 + v2 on average.
    let v2 = wear.size_variation_ratio.powi(2);
    let area_m2 =
        scales.area_ratio * wear.leaves.area_per_m * form.crown.volume_m3() * (1.0 + v2) / (1.0 + v2 / 3.0);
    let density_per_m = if clumps_m3 > 0.0 { area_m2 / clumps_m3 } else { 0.0 };
    let size_m = scales.leaf_ratio * wear.leaves.size_m;
    let mut count = Count { owed: 0.0, given: 0 };
    let mut number = 0;
    form.limbs
        .iter()
        .map(|limb| {
            let (mut leaves, mut haze) = (Vec::new(), Vec::new());
            for clump in &limb.clumps {
                let filled = Haze { leaf_area_per_m: density_per_m, leaf_angle: wear.leaves.angle, ..*clump };
                match wear.foliage {
                    Foliage::Turbid if density_per_m > 0.0 => haze.push(filled),
                    Foliage::Turbid => {}
                    Foliage::Leaves => {
                        let more = count.next(filled.leaf_area_m2() / (size_m * size_m * MEAN_SQUARE));
                        let draws = stream.child(number);
                        leaves.extend((0..more).map(|index| leaf(&filled, size_m, &mut draws.at(index))));
                    }
                }
                number += 1;
            }
            gather_shoots(&mut leaves);
            Prototype {
                leaves,
                haze,
                branches: limb.branches.clone(),
                leaf_reflectivity_ratio: wear.leaves.reflectivity_ratio,
                bark_reflectivity_ratio: wear.bark_reflectivity_ratio,
            }
        })
        .collect()
}

/// Whole leaves for fractions owed: what one clump loses by rounding the next one gets.
struct Count {
    owed: f64,
    given: u64,
}

impl Count {
    fn next(&mut self, more: f64) -> u64 {
        self.owed += more;
        let number = (self.owed.round() as u64).saturating_sub(self.given);
        self.given += number;
        number
    }
}

/// A square leaf with its middle uniform in the clump, inclined by the clump's law.
fn leaf(clump: &Haze, size_m: f64, draws: &mut Draws) -> Leaf {
    let half_m = size_m / 2.0 * draws.within(8.0 / 9.0, 10.0 / 9.0);
    let mut center = clump.center + place(clump.outline, draws).component_mul(&clump.half_size);
    let (sin_up, cos_up) = clump.leaf_angle.inclination_rad(draws.unit()).sin_cos();
    let (sin, cos) = draws.within(0.0, TAU).sin_cos();
    let normal = Vector3::new(sin_up * cos, sin_up * sin, cos_up);
    // Across the normal and level, whatever the inclination.
    let across = Vector3::new(-sin, cos, 0.0);
    let along = normal.cross(&across);
    let (sin, cos) = draws.within(0.0, TAU).sin_cos();
    let half_u = half_m * (cos * across + sin * along);
    let half_v = half_m * (cos * along - sin * across);
    // Leaves lie on the ground rather than reach into it.
    center.z = center.z.max(half_u.z.abs() + half_v.z.abs());
    Leaf { center, half_u, half_v }
}

/// Uniform in the unit ball or the cube of half side 1.
fn place(outline: Outline, draws: &mut Draws) -> Vector3<f64> {
    match outline {
        Outline::Ellipsoid => {
            let out = draws.unit().cbrt();
            direction(draws) * out
        }
        Outline::Box => Vector3::from([(); 3].map(|()| draws.within(-1.0, 1.0))),
    }
}
