//! The orchards that are timed: rows of trees 4 m apart, 3.5 m in the row, on a square of bumpy soil.
//!
//! Everything is a parallelogram or a triangle of the soil, so that any other engine traces the same surfaces: leaves of
//! 5 to 8 cm in an ellipsoid, and a trunk of 24 upright strips, which here count as leaves.

use arborloop_base::{Draws, Seed, Span, Time};
use arborloop_sim::optics::{Depth, Ray};
use arborloop_worlds::wind::{LEAVES_PER_SHOOT, LEAVES_PER_SPUR};
use arborloop_worlds::{
    GrassSpec, Hinge, Leaf, Plant, Planting, Prototype, SurroundingsSpec, TerrainSpec, Wind, WindSpec, World,
    WorldSpec, build,
};
use nalgebra::{Point3, Similarity3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// Different trees; more trees repeat them turned and scaled.
pub(crate) const PROTOTYPES: usize = 8;
/// Limbs of a tree that moves limb by limb.
const LIMBS: usize = 12;
const STRIPS: usize = 24;
const TRUNK_RADIUS_M: f64 = 0.08;
const TRUNK_HEIGHT_M: f64 = 1.2;
const CROWN_CENTER_M: f64 = 1.9;
const CROWN_HALF: [f64; 3] = [1.3, 1.3, 1.2];
const ROW_M: f64 = 4.0;
const TREE_M: f64 = 3.5;
const AZIMUTHS: usize = 1808;
/// Rays of a sweep.
pub(crate) const SWEEP: usize = 16 * AZIMUTHS;

/// How large an orchard is.
#[derive(Clone, Copy)]
pub(crate) struct Size {
    pub(crate) name: &'static str,
    pub(crate) trees: usize,
    pub(crate) leaves: usize,
}

impl Size {
    pub(crate) const SMALL: Size = Size { name: "S", trees: 50, leaves: 400 };
    pub(crate) const MEDIUM: Size = Size { name: "M", trees: 200, leaves: 2500 };
    pub(crate) const LARGE: Size = Size { name: "L", trees: 500, leaves: 10_000 };

    pub(crate) fn named(name: &str) -> Result<Self, String> {
        let all = [Size::SMALL, Size::MEDIUM, Size::LARGE];
        all.into_iter().find(|size| size.name == name).ok_or(format!("--scene is S, M or L, not {name}"))
    }
}

/// What the air does.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Air {
    Still,
    /// Each tree sways as one, its shoots and leaves flutter.
    Wind,
    /// Each tree is a trunk and twelve limbs, in still air.
    StillLimbs,
    /// Each tree is a trunk and twelve limbs that sway on their own.
    Limbs,
}

impl Air {
    pub(crate) fn named(name: &str) -> Result<Self, String> {
        match name {
            "off" => Ok(Air::Still),
            "on" => Ok(Air::Wind),
            "still-limbs" => Ok(Air::StillLimbs),
            "limbs" => Ok(Air::Limbs),
            other => Err(format!("--wind is off, on, still-limbs or limbs, not {other}")),
        }
    }

    fn has_limbs(self) -> bool {
        matches!(self, Air::StillLimbs | Air::Limbs)
    }

    fn is_still(self) -> bool {
        matches!(self, Air::Still | Air::StillLimbs)
    }

    pub(crate) fn named_as(self) -> &'static str {
        match self {
            Air::Still => "still air",
            Air::Wind => "wind of 4 m/s",
            Air::StillLimbs => "still air, twelve limbs a tree",
            Air::Limbs => "wind, twelve limbs a tree",
        }
    }
}

/// A world, and how many trees stand in it.
pub(crate) struct Orchard {
    pub(crate) world: World,
    pub(crate) rows: usize,
    pub(crate) in_row: usize,
}

impl Orchard {
    /// Triangles that the soil and all trees are.
    pub(crate) fn triangles(&self) -> usize {
        let grid = self.world.terrain.grid();
        let leaves = |plant: &Plant| self.world.prototypes[plant.prototype].leaves.len();
        let trees: usize = self.world.plants.iter().map(leaves).sum();
        2 * (trees + (grid.columns() - 1) * (grid.rows() - 1))
    }
}

pub(crate) fn orchard(size: Size, air: Air) -> Orchard {
    let seed = Seed(1);
    let spec = WorldSpec {
        terrain: TerrainSpec {
            extent_m: 50.0,
            cell_m: 0.5,
            bump_m: 0.02,
            bump_wavelength_m: 3.0,
            ..TerrainSpec::default()
        },
        grass: GrassSpec { height_m: 0.0, ..GrassSpec::default() },
        planting: Planting::None,
        surroundings: SurroundingsSpec { trees: 0, bushes: 0, ..SurroundingsSpec::default() },
        wind: WindSpec::default(),
    };
    let mut world = build(&spec, seed);
    let shapes = seed.stream("bench/prototype");
    let trees: Vec<Vec<Leaf>> = (0..PROTOTYPES as u64)
        .map(|kind| {
            let mut leaves: Vec<Leaf> =
                (0..size.leaves as u64).map(|index| leaf(&mut shapes.child(kind).at(index))).collect();
            gather(&mut leaves);
            leaves
        })
        .collect();
    let of = |leaves: Vec<Leaf>| Prototype {
        leaves,
        haze: Vec::new(),
        branches: Vec::new(),
        leaf_reflectivity_ratio: 0.5,
        bark_reflectivity_ratio: 0.3,
    };
    for leaves in &trees {
        if air.has_limbs() {
            world.prototypes.push(of(trunk()));
            world.prototypes.extend(limbs(leaves).into_iter().map(of));
        } else {
            let mut tree = [trunk(), leaves.clone()].concat();
            gather(&mut tree);
            world.prototypes.push(of(tree));
        }
    }
    let in_row = ((size.trees as f64 * ROW_M / TREE_M).sqrt().round() as usize).max(1);
    let rows = size.trees.div_ceil(in_row);
    let places = seed.stream("bench/place");
    for tree in 0..size.trees {
        let mut draws = places.at(tree as u64);
        let x =
            (tree % in_row) as f64 * TREE_M - (in_row - 1) as f64 * TREE_M / 2.0 + draws.within(-0.2, 0.2);
        let y = (tree / in_row) as f64 * ROW_M - (rows - 1) as f64 * ROW_M / 2.0 + draws.within(-0.2, 0.2);
        let foot = Point3::new(x, y, world.terrain.height_m(x, y));
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), draws.within(0.0, TAU));
        let scale = draws.within(0.9, 1.1);
        let world_from_plant = Similarity3::from_parts(foot.coords.into(), turn, scale);
        let parts = if air.has_limbs() { LIMBS + 1 } else { 1 };
        for part in 0..parts {
            world.plants.push(Plant {
                prototype: tree % PROTOTYPES * parts + part,
                world_from_plant,
                instance: tree as u32 + 1,
                hinge: Hinge {
                    foot,
                    height_m: scale * (CROWN_CENTER_M + CROWN_HALF[2]),
                    fork: world_from_plant * Point3::new(0.0, 0.0, 1.0),
                    reach_m: scale * 2.2,
                },
            });
        }
    }
    let mean_mps = if air.is_still() { 0.0 } else { 4.0 };
    world.wind = Wind::new(&WindSpec { mean_mps, ..WindSpec::default() }, &world.plants, seed);
    Orchard { world, rows, in_row }
}

fn leaf(draws: &mut Draws) -> Leaf {
    let mut direction = || Vector3::new(draws.normal(), draws.normal(), draws.normal()).normalize();
    let (out, half_u, other) = (direction(), direction(), direction());
    let share = draws.unit().cbrt();
    let center =
        Point3::new(0.0, 0.0, CROWN_CENTER_M) + share * out.component_mul(&Vector3::from(CROWN_HALF)) * 0.96;
    let across = half_u.cross(&other).normalize();
    Leaf { center, half_u: half_u * draws.within(0.025, 0.04), half_v: across * draws.within(0.025, 0.04) }
}

/// Upright strips around the trunk.
fn trunk() -> Vec<Leaf> {
    let strip = |index: usize| {
        let corner = |n: usize| {
            let (sin, cos) = (TAU * n as f64 / STRIPS as f64).sin_cos();
            Vector3::new(cos, sin, 0.0) * TRUNK_RADIUS_M
        };
        let (a, b) = (corner(index), corner(index + 1));
        let half = Vector3::z() * (TRUNK_HEIGHT_M / 2.0 + 0.1);
        Leaf {
            center: Point3::from((a + b) / 2.0 + Vector3::z() * (TRUNK_HEIGHT_M / 2.0 - 0.1)),
            half_u: half,
            half_v: (b - a) / 2.0,
        }
    };
    (0..STRIPS).map(strip).collect()
}

/// A crown parted into six sectors of two storeys.
fn limbs(leaves: &[Leaf]) -> Vec<Vec<Leaf>> {
    let mut limbs = vec![Vec::new(); LIMBS];
    for leaf in leaves {
        let sector = (leaf.center.y.atan2(leaf.center.x) / TAU + 0.5) * (LIMBS / 2) as f64;
        let storey = usize::from(leaf.center.z > CROWN_CENTER_M);
        limbs[(sector as usize).min(LIMBS / 2 - 1) * 2 + storey].push(*leaf);
    }
    limbs.iter_mut().for_each(|limb| gather(limb));
    limbs
}

/// Orders leaves so that each shoot's are neighbors, as a grown prototype's are: halves by the widest axis.
fn gather(leaves: &mut [Leaf]) {
    if leaves.len() <= LEAVES_PER_SPUR {
        return;
    }
    let start = leaves[0].center;
    let (low, high) = leaves
        .iter()
        .fold((start, start), |(low, high), leaf| (low.inf(&leaf.center), high.sup(&leaf.center)));
    let axis = (high - low).imax();
    leaves.sort_by(|a, b| a.center[axis].total_cmp(&b.center[axis]));
    let whole = if leaves.len() > LEAVES_PER_SHOOT { LEAVES_PER_SHOOT } else { LEAVES_PER_SPUR };
    let middle = (leaves.len() / 2).next_multiple_of(whole).min(leaves.len() - 1);
    let (near, far) = leaves.split_at_mut(middle);
    gather(near);
    gather(far);
}

/// Sweeps of a VLP-16 from poses between the rows, 0.5 m above the soil; sixteen azimuths of one laser side by side.
pub(crate) fn rays(orchard: &Orchard, poses: usize) -> Vec<Ray> {
    let stream = Seed(1).stream("bench/pose");
    let mut rays = Vec::with_capacity(poses * AZIMUTHS * 16);
    for pose in 0..poses {
        let mut draws = stream.at(pose as u64);
        let lanes = orchard.rows.saturating_sub(1).max(1);
        let lane = ((draws.unit() * lanes as f64) as usize).min(lanes - 1);
        let y = (lane as f64 + 0.5) * ROW_M - (orchard.rows - 1) as f64 * ROW_M / 2.0;
        let reach = 0.4 * orchard.in_row as f64 * TREE_M;
        let x = draws.within(-reach, reach);
        let heading = draws.within(0.0, TAU);
        let origin = Point3::new(x, y, orchard.world.terrain.height_m(x, y) + 0.5);
        for block in 0..AZIMUTHS / 16 {
            for laser in 0..16_i64 {
                for column in block * 16..block * 16 + 16 {
                    let azimuth = heading - TAU * column as f64 / AZIMUTHS as f64;
                    let elevation = (-15.0 + 2.0 * laser as f64).to_radians();
                    let level = elevation.cos();
                    rays.push(Ray {
                        stamp: Time::SIMULATION_START
                            + Span::from_nanos(
                                pose as i64 * 100_000_000 + column as i64 * 55_296 + laser * 2_304,
                            ),
                        origin,
                        direction: Vector3::new(
                            level * azimuth.cos(),
                            level * azimuth.sin(),
                            elevation.sin(),
                        ),
                        range_m_min: 0.0,
                        range_m_max: 100.0,
                        depth: Depth::ENDLESS,
                    });
                }
            }
        }
    }
    rays
}

/// Each beam as five: its axis and four at the edge of a spot that widens by 3 mrad.
pub(crate) fn footprints(rays: &[Ray]) -> Vec<Ray> {
    let mut five = Vec::with_capacity(rays.len() * 5);
    for sixteen in rays.chunks(16) {
        for (side, up) in [(0.0, 0.0), (1.5e-3, 0.0), (-1.5e-3, 0.0), (0.0, 0.75e-3), (0.0, -0.75e-3)] {
            five.extend(sixteen.iter().map(|ray| {
                let across = ray.direction.cross(&Vector3::z()).normalize();
                let upward = across.cross(&ray.direction);
                let direction = (ray.direction + across * side + upward * up).normalize();
                Ray { direction, ..*ray }
            }));
        }
    }
    five
}
