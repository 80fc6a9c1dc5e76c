//! How one tree or bush is grown: branches and a crown of leaves, in its own frame.

use crate::crown::{Crown, CrownShape};
use crate::haze::Haze;
use crate::shape::{Frustum, Leaf};
use crate::wind::{LEAVES_PER_SHOOT, LEAVES_PER_SPUR};
use arborloop_base::{Draws, Stream};
use nalgebra::{Point3, Unit, Vector3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Branches and leaves in the plant frame: origin where the trunk leaves the ground, z up, meters.
#[derive(Debug, Clone, PartialEq)]
pub struct Prototype {
    /// Leaves; they stop a beam and no body. Each eight are neighbors, a shoot that moves as one in the wind.
    pub leaves: Vec<Leaf>,
    /// The same foliage as a turbid medium; a prototype has leaves or haze, not both.
    pub haze: Vec<Haze>,
    /// Branches; they stop a beam and no body. The trunk is none of them: it is a solid of the world.
    pub branches: Vec<Frustum>,
    /// Reflectance of a leaf near 905 nm.
    pub leaf_reflectivity_ratio: f64,
    /// Reflectance of bark near 905 nm.
    pub bark_reflectivity_ratio: f64,
}

impl Crown {
    /// The crown of a tree: the upper four fifths, as wide as in an apple's crown of 14 m3 (J. Imaging 2025, 11(1):5).
    pub(crate) fn of_tree(height_m: f64) -> Self {
        let width_m = 0.62 * height_m;
        Crown::standing(CrownShape::Ellipsoid, 0.2 * height_m, 0.8 * height_m, width_m, width_m)
    }

    /// The crown of a bush: from the ground up, almost as wide as high.
    pub(crate) fn of_bush(height_m: f64) -> Self {
        let width_m = 0.9 * height_m;
        Crown::standing(CrownShape::Ellipsoid, 0.0, height_m, width_m, width_m)
    }

    /// A point uniform in an ellipsoid, pulled inward by `margin_m`.
    fn point(&self, draws: &mut Draws, margin_m: f64) -> Point3<f64> {
        let direction = direction(draws);
        let share = draws.unit().cbrt();
        let across_m = (self.half_size.x - margin_m).max(0.0) * share;
        let up_m = (self.half_size.z - margin_m).max(0.0) * share;
        Point3::new(across_m * direction.x, across_m * direction.y, self.center.z + up_m * direction.z)
    }
}

/// What the leaves of a prototype are like.
pub(crate) struct TreeFoliage {
    /// Mean side, meters; each leaf differs by up to a ninth.
    pub(crate) leaf_size_m: f64,
    /// One-sided leaf area per crown volume, m2/m3.
    pub(crate) leaf_area_per_m: f64,
    /// Reflectance of a leaf near 905 nm.
    pub(crate) leaf_reflectivity_ratio: f64,
    /// Reflectance of bark near 905 nm.
    pub(crate) bark_reflectivity_ratio: f64,
}

/// A tree without its trunk: scaffold branches that leave a trunk of radius `trunk_radius_m`, and leaves.
pub(crate) fn tree(crown: &Crown, trunk_radius_m: f64, foliage: &TreeFoliage, stream: Stream) -> Prototype {
    let scaffold = stream.child(0);
    let top_m = crown.center.z + 0.2 * crown.half_size.z;
    let branches = (0..SCAFFOLD)
        .map(|index| {
            let mut draws = scaffold.at(index);
            let share = (index as f64 + draws.unit()) / SCAFFOLD as f64;
            let low_m = crown.center.z - 0.8 * crown.half_size.z;
            let base = Point3::new(0.0, 0.0, low_m + share * (top_m - low_m));
            let bearing_rad = index as f64 * GOLDEN_ANGLE + draws.within(-0.4, 0.4);
            let length_m = crown.half_size.x * draws.within(0.6, 0.95) / FORK.cos();
            branch(base, bearing_rad, FORK, length_m, trunk_radius_m * draws.within(0.25, 0.4))
        })
        .collect();
    prototype(branches, crown, foliage, stream)
}

/// A bush: stems that leave the ground together, and leaves.
pub(crate) fn bush(crown: &Crown, foliage: &TreeFoliage, stream: Stream) -> Prototype {
    let stems = stream.child(0);
    let branches = (0..STEMS)
        .map(|index| {
            let mut draws = stems.at(index);
            let bearing_rad = index as f64 * GOLDEN_ANGLE + draws.within(-0.4, 0.4);
            let base = Point3::new(0.05 * bearing_rad.cos(), 0.05 * bearing_rad.sin(), 0.0);
            let length_m = crown.half_size.z * draws.within(1.0, 1.5);
            branch(base, bearing_rad, draws.within(1.0, FRAC_PI_2), length_m, draws.within(0.008, 0.016))
        })
        .collect();
    prototype(branches, crown, foliage, stream)
}

/// Scaffold branches of a tree.
const SCAFFOLD: u64 = 9;
/// Stems of a bush.
const STEMS: u64 = 7;
/// Elevation of a scaffold branch, radians: between level and upright, as pruned for light.
const FORK: f64 = 0.7;
/// Successive branches turn by the golden angle, as in phyllotaxis, so that none hides another.
pub(crate) const GOLDEN_ANGLE: f64 = TAU * 0.381_966_011_250_105;

fn branch(base: Point3<f64>, bearing_rad: f64, elevation_rad: f64, length_m: f64, radius_m: f64) -> Frustum {
    let level = elevation_rad.cos();
    let axis = Vector3::new(level * bearing_rad.cos(), level * bearing_rad.sin(), elevation_rad.sin());
    Frustum {
        base,
        axis: Unit::new_normalize(axis),
        height_m: length_m,
        radius_base_m: radius_m,
        radius_top_m: 0.3 * radius_m,
    }
}

fn prototype(branches: Vec<Frustum>, crown: &Crown, foliage: &TreeFoliage, stream: Stream) -> Prototype {
    // A leaf's side is uniform within a ninth of its mean, so its mean square is 1 + 1/243 of the mean's square.
    let mean_area_m2 = foliage.leaf_size_m.powi(2) * (1.0 + 1.0 / 243.0);
    let count = (foliage.leaf_area_per_m * crown.volume_m3() / mean_area_m2).round() as u64;
    let stream = stream.child(1);
    let mut leaves: Vec<Leaf> =
        (0..count).map(|index| leaf(crown, foliage.leaf_size_m, &mut stream.at(index))).collect();
    gather_shoots(&mut leaves);
    Prototype {
        leaves,
        haze: Vec::new(),
        branches,
        leaf_reflectivity_ratio: foliage.leaf_reflectivity_ratio,
        bark_reflectivity_ratio: foliage.bark_reflectivity_ratio,
    }
}

/// Orders leaves so that each [`LEAVES_PER_SHOOT`] in a row are neighbors, and in them each [`LEAVES_PER_SPUR`]: halves
/// by the widest axis, down to a shoot and then to a spur.
pub(crate) fn gather_shoots(leaves: &mut [Leaf]) {
    if leaves.len() <= LEAVES_PER_SPUR {
        return;
    }
    let Some(first) = leaves.first().map(|leaf| leaf.center) else { return };
    let (low, high) = leaves
        .iter()
        .fold((first, first), |(low, high), leaf| (low.inf(&leaf.center), high.sup(&leaf.center)));
    let axis = (high - low).imax();
    let whole = if leaves.len() > LEAVES_PER_SHOOT { LEAVES_PER_SHOOT } else { LEAVES_PER_SPUR };
    let middle = (leaves.len() / 2).next_multiple_of(whole).min(leaves.len() - 1);
    leaves.select_nth_unstable_by(middle, |a, b| a.center[axis].total_cmp(&b.center[axis]));
    let (near, far) = leaves.split_at_mut(middle);
    gather_shoots(near);
    gather_shoots(far);
}

/// A square leaf; its normal is uniform on the sphere (the spherical leaf-angle law, whose projection factor is 1/2).
fn leaf(crown: &Crown, size_m: f64, draws: &mut Draws) -> Leaf {
    let half_m = size_m / 2.0 * draws.within(8.0 / 9.0, 10.0 / 9.0);
    // No corner leaves the crown, above all not into the ground.
    let center = crown.point(draws, half_m * std::f64::consts::SQRT_2);
    let normal = direction(draws);
    let other = if normal.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let across = normal.cross(&other).normalize();
    let along = normal.cross(&across);
    let (sin, cos) = draws.within(0.0, TAU).sin_cos();
    Leaf {
        center,
        half_u: half_m * (cos * across + sin * along),
        half_v: half_m * (cos * along - sin * across),
    }
}

/// Uniform on the sphere (Archimedes: the height is uniform).
pub(crate) fn direction(draws: &mut Draws) -> Vector3<f64> {
    let up = draws.within(-1.0, 1.0);
    let (sin, cos) = draws.within(0.0, TAU).sin_cos();
    let level = (1.0 - up * up).max(0.0).sqrt();
    Vector3::new(level * cos, level * sin, up)
}
