//! Plants put into the world: shared shapes, turned, scaled and leaned, each with its hinge, trunk and crown.

use crate::crown::{Crown, CrownShape};
use crate::foliage::{Dress, dress};
use crate::form::Form;
use crate::shape::Frustum;
use crate::spec::TrunkSpec;
use crate::tree::Prototype;
use crate::{Hinge, Plant, Solid};
use arborloop_base::{Class, Draws, Stream};
use nalgebra::{Point3, Similarity3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::{PI, TAU};

/// Plants grown apart; more plants repeat them turned and scaled.
pub(crate) const PROTOTYPES: u64 = 8;
/// How deep trunks and posts go into the ground, so that no slope shows their foot, meters.
pub(crate) const BURIED_M: f64 = 0.1;
/// Normal draws are cut off here, standard deviations: no trunk leans or thickens without bound.
const SIGMAS_MAX: f64 = 2.5;

/// The space that the leaves of one plant fill.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CrownTruth {
    /// Instance of the plant, as in [`Plant::instance`].
    pub instance: u32,
    /// Its outline, plant frame.
    pub crown: Crown,
    /// From the plant's frame to the world, at rest.
    pub world_from_plant: Similarity3<f64>,
}

impl CrownTruth {
    /// Volume in the world, m3.
    pub fn volume_m3(&self) -> f64 {
        self.crown.volume_m3() * self.world_from_plant.scaling().powi(3)
    }
}

/// What a planting puts into the world.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Stand {
    pub(crate) solids: Vec<Solid>,
    pub(crate) prototypes: Vec<Prototype>,
    pub(crate) plants: Vec<Plant>,
    pub(crate) crowns: Vec<CrownTruth>,
}

/// A plant grown once, to be put up many times.
pub(crate) struct Sort {
    crown: Crown,
    trunk_top_m: f64,
    trunk_taper_ratio: f64,
    limbs: Vec<SortLimb>,
}

impl Sort {
    /// The space that its leaves fill, plant frame.
    pub(crate) fn crown(&self) -> &Crown {
        &self.crown
    }
}

struct SortLimb {
    prototype: usize,
    fork: Point3<f64>,
    reach_m: f64,
}

/// Which way a plant may face.
#[derive(Clone, Copy)]
pub(crate) enum Facing {
    /// Any way: round plants.
    Any,
    /// Along a bearing in radians or against it: hedges and vines.
    Along(f64),
}

impl Facing {
    /// Round crowns face any way, crowns that are cut longer than wide lie along their row.
    pub(crate) fn of(crown: &Crown, bearing_rad: f64) -> Facing {
        let round = crown.shape != CrownShape::Box && crown.half_size.x == crown.half_size.y;
        if round { Facing::Any } else { Facing::Along(bearing_rad) }
    }
}

/// One place and what is particular to the plant there.
pub(crate) struct Site {
    pub(crate) instance: u32,
    /// Where the trunk leaves the ground, world frame.
    pub(crate) foot: Point3<f64>,
    /// About the vertical.
    pub(crate) turn: UnitQuaternion<f64>,
    /// Away from the vertical.
    pub(crate) lean: UnitQuaternion<f64>,
    pub(crate) scale: f64,
    pub(crate) trunk_radius_m: f64,
}

impl Site {
    /// Draws a plant's turn, size, lean and girth, always in this order.
    pub(crate) fn draw(
        instance: u32,
        foot: Point3<f64>,
        facing: Facing,
        size_variation_ratio: f64,
        trunk: &TrunkSpec,
        draws: &mut Draws,
    ) -> Site {
        let turn = draws.unit();
        let yaw_rad = match facing {
            Facing::Any => TAU * turn,
            Facing::Along(bearing_rad) if turn < 0.5 => bearing_rad,
            Facing::Along(bearing_rad) => bearing_rad + PI,
        };
        let scale = 1.0 + size_variation_ratio * draws.within(-1.0, 1.0);
        let lean_rad = trunk.lean_deg.to_radians();
        let [lean_x, lean_y] = [(); 2].map(|()| lean_rad * clipped_normal(draws));
        Site {
            instance,
            foot,
            turn: UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad),
            lean: UnitQuaternion::from_scaled_axis(Vector3::new(lean_x, lean_y, 0.0)),
            scale,
            trunk_radius_m: log_normal(trunk.radius_m, trunk.radius_variation_ratio, draws),
        }
    }

    /// Plant to world for a plant that leans as a whole.
    pub(crate) fn leaning(&self) -> Similarity3<f64> {
        Similarity3::from_parts(Translation3::from(self.foot), self.lean * self.turn, self.scale)
    }

    /// Plant to world for a plant that its trellis holds upright.
    pub(crate) fn upright(&self) -> Similarity3<f64> {
        Similarity3::from_parts(Translation3::from(self.foot), self.turn, self.scale)
    }
}

impl Stand {
    /// Adds what another planting put into the world.
    pub(crate) fn join(&mut self, other: Stand) {
        let known = self.prototypes.len();
        self.solids.extend(other.solids);
        self.prototypes.extend(other.prototypes);
        let renumbered = |plant: Plant| Plant { prototype: known + plant.prototype, ..plant };
        self.plants.extend(other.plants.into_iter().map(renumbered));
        self.crowns.extend(other.crowns);
    }

    /// Grows a form's foliage and keeps it for planting.
    pub(crate) fn keep(&mut self, form: &Form, wear: &Dress<'_>, stream: Stream) -> Sort {
        let prototypes = dress(form, wear, stream);
        let limbs = form.limbs.iter().zip(prototypes).map(|(limb, prototype)| {
            let reach_m = reach_m(&prototype, &limb.fork);
            self.prototypes.push(prototype);
            SortLimb { prototype: self.prototypes.len() - 1, fork: limb.fork, reach_m }
        });
        let limbs = limbs.collect();
        Sort {
            crown: form.crown,
            trunk_top_m: form.trunk_top_m,
            trunk_taper_ratio: form.trunk_taper_ratio,
            limbs,
        }
    }

    /// Puts up a plant that leans as a whole: trunk, limbs and crown.
    pub(crate) fn put(&mut self, sort: &Sort, site: &Site, trunk: &TrunkSpec) {
        let world_from_plant = site.leaning();
        if sort.trunk_top_m > 0.0 {
            let shape = Frustum {
                base: Point3::new(0.0, 0.0, -BURIED_M / site.scale),
                axis: Vector3::z_axis(),
                height_m: sort.trunk_top_m + BURIED_M / site.scale,
                radius_base_m: site.trunk_radius_m / site.scale,
                radius_top_m: sort.trunk_taper_ratio * site.trunk_radius_m / site.scale,
            };
            self.put_trunk(site.instance, shape.transformed(&world_from_plant), trunk);
        }
        self.put_crown(sort, site.instance, world_from_plant);
    }

    /// Puts up limbs and crown.
    pub(crate) fn put_crown(&mut self, sort: &Sort, instance: u32, world_from_plant: Similarity3<f64>) {
        let scale = world_from_plant.scaling();
        self.plants.extend(sort.limbs.iter().map(|limb| Plant {
            prototype: limb.prototype,
            world_from_plant,
            instance,
            hinge: Hinge {
                foot: world_from_plant * Point3::origin(),
                height_m: scale * sort.crown.top_m(),
                fork: world_from_plant * limb.fork,
                reach_m: scale * limb.reach_m,
            },
        }));
        self.crowns.push(CrownTruth { instance, crown: sort.crown, world_from_plant });
    }

    /// Puts up a trunk, world frame.
    pub(crate) fn put_trunk(&mut self, instance: u32, shape: Frustum, trunk: &TrunkSpec) {
        let reflectivity_ratio = trunk.reflectivity_ratio;
        self.solids.push(Solid { class: Class::Trunk, instance, shape, reflectivity_ratio });
    }
}

/// Distance from the fork to the farthest tip of a leaf, a branch or haze, meters; never 0, so that a turn has an arm.
fn reach_m(prototype: &Prototype, fork: &Point3<f64>) -> f64 {
    let leaves = prototype.leaves.iter().flat_map(|leaf| leaf.corners()).map(|corner| (corner - fork).norm());
    let haze = prototype.haze.iter().flat_map(|haze| haze.corners()).map(|corner| (corner - fork).norm());
    let branches = prototype.branches.iter().flat_map(|branch| {
        [(0.0, branch.radius_base_m), (branch.height_m, branch.radius_top_m)]
            .map(|(along_m, radius_m)| (branch.center(along_m) - fork).norm() + radius_m)
    });
    leaves.chain(haze).chain(branches).fold(0.05, f64::max)
}

/// Of this mean, and of a standard deviation that is this share of the mean.
fn log_normal(mean: f64, variation_ratio: f64, draws: &mut Draws) -> f64 {
    let variance = (1.0 + variation_ratio.powi(2)).ln();
    mean * (variance.sqrt() * clipped_normal(draws) - variance / 2.0).exp()
}

fn clipped_normal(draws: &mut Draws) -> f64 {
    draws.normal().clamp(-SIGMAS_MAX, SIGMAS_MAX)
}
