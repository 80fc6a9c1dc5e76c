//! Wind: gusts that travel over the world, and how trunks, limbs, shoots and leaves give way to them.
//!
//! Four scales, each with its own frequencies (sensors, plants and sites facts, 7.5; all assumed within those bands):
//!
//! | scale | moves | frequency | at 10 m/s |
//! |---|---|---|---|
//! | trunk | the whole plant leans, more with height; still at lidar height | 0.5-1.5 Hz | 2 cm at the top |
//! | limb | turns about its fork | 1-3 Hz | 10 cm at the tip |
//! | shoot | up to 64 neighboring leaves shift together | 2-5 Hz | 8 cm |
//! | leaf | turns about its own `half_u`, in step with its shoot's others | 3-8 Hz | 30 deg |
//!
//! Trunk and limb are one affine map per plant, so a beam is turned into a moving plant's frame and nothing is built
//! anew. Everything is a pure function of place and time: any instant may be asked for, in any order.

mod bend;
mod gust;
mod swept;
mod swing;

use crate::Plant;
use crate::shape::Leaf;
use crate::spec::{SpecError, within};
use arborloop_base::Seed;
pub use bend::{Bend, Stem};
use gust::{Gust, Record, SPEED_MPS_MAX};
use nalgebra::{Affine3, Point3, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use swing::{Modes, sine};

/// Leaves that move together: a prototype's leaves `64 k` to `64 k + 63` are its shoot `k`. Sixty-four leaves of a few
/// centimeters fill a few decimeters: a shoot with its side shoots.
pub const LEAVES_PER_SHOOT: usize = 64;
/// Leaves of a shoot that sit closest together: each eight in a row.
pub const LEAVES_PER_SPUR: usize = 8;
/// Frequencies that the shoots, and the leaves, of one plant share out among themselves.
pub const PITCHES: usize = 4;
/// Below this height above its foot a trunk stands still, meters: lidars of walking robots look at 0.2 to 0.5 m.
pub const STILL_BELOW_M: f64 = 0.6;

/// How the wind blows.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct WindSpec {
    /// Mean speed in the canopy, m/s; 0 for still air.
    pub mean_mps: f64,
    /// Standard deviation of the speed as a share of its mean (turbulence intensity).
    pub gust_ratio: f64,
    /// Bearing toward which it blows, degrees counter-clockwise from east.
    pub toward_deg: f64,
}

impl Default for WindSpec {
    fn default() -> Self {
        WindSpec {
            mean_mps: 0.0,    // assumed: still air unless a scenario turns the dial
            gust_ratio: 0.4,  // assumed: within canopies 0.3-0.6
            toward_deg: 70.0, // assumed: across most rows
        }
    }
}

impl WindSpec {
    /// Whether every value is finite and in its range.
    pub fn check(&self) -> Result<(), SpecError> {
        within("wind", "mean_mps", self.mean_mps, 0.0, SPEED_MPS_MAX)?;
        within("wind", "gust_ratio", self.gust_ratio, 0.0, 1.0)?;
        within("wind", "toward_deg", self.toward_deg, -360.0, 360.0)
    }
}

const TRUNK_M: f64 = 0.02;
const LIMB_M: f64 = 0.10;
const SHOOT_M: f64 = 0.08;
const LEAF_RAD: f64 = 30.0 * TAU / 360.0;
const TRUNK_HZ: [f64; 2] = [0.5, 1.5];
const LIMB_HZ: [f64; 2] = [1.0, 3.0];
const SHOOT_HZ: [f64; 2] = [2.0, 5.0];
const LEAF_HZ: [f64; 2] = [3.0, 8.0];
/// The gust record's spacing and length. It begins anew after 328 s.
const GUST_STEP_S: f64 = 0.04;
const GUST_STEPS: usize = 8192;
/// Consecutive shoots are this many turns apart: the golden ratio's fraction, so that no two nearby move in step.
const GOLDEN_TURNS: f64 = 0.618_033_988_749_895;

/// Where a plant, or one limb of a tree, bends. World frame, at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinge {
    /// Where the trunk leaves the ground.
    pub foot: Point3<f64>,
    /// Height of the whole tree, meters.
    pub height_m: f64,
    /// Where the limb leaves the trunk; for a plant that is one piece, where its crown begins.
    pub fork: Point3<f64>,
    /// From the fork to the farthest tip, meters.
    pub reach_m: f64,
}

/// The wind of one world and the way each of its plants answers.
#[derive(Debug, Clone, PartialEq)]
pub struct Wind {
    spec: WindSpec,
    toward: Vector2<f64>,
    /// How gusts are delayed by the way that they have to travel; not used in still air.
    delay_s_per_m: Vector2<f64>,
    /// The gusts at the origin.
    record: Record,
    /// The most that the record holds.
    most: Gust,
    stems: Vec<Stem>,
}

/// Where a plant is at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sway {
    /// From the plant's own frame to the world, bent.
    pub world_from_plant: Affine3<f64>,
    /// How far a shoot shifts at most, plant frame.
    pub shoot_m: f64,
    /// Phases of the shoots' frequencies, turns in [0, 1); shoot `k` follows entry `k % 4`.
    pub shoot_turns: [f64; PITCHES],
    /// Sine of a leaf's farthest turn. What swings is the sine.
    pub leaf_sin: f64,
    /// Phases of the leaves' frequencies, turns in [0, 1); the leaves of shoot `k` follow entry `k % 4`.
    pub leaf_turns: [f64; PITCHES],
}

/// Bounds of what the wind does to a plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// From where a point of the plant's frame rests, meters, leaves and shoots left out.
    pub plant_m: f64,
    /// How far a shoot shifts besides, world meters.
    pub shoot_m: f64,
    /// How far a leaf turns, radians.
    pub leaf_rad: f64,
    /// How far plants bend, as a share of their deflections at 10 m/s: what [`Wind::swept`] goes by.
    pub bend_ratio: f64,
}

impl Wind {
    /// The wind of a world with these plants. The gusts come from the stream `world/wind`, the plants' frequencies and
    /// phases from `world/wind/tree` by instance and `world/wind/limb` by index.
    pub fn new(spec: &WindSpec, plants: &[Plant], seed: Seed) -> Self {
        let (sin, cos) = spec.toward_deg.to_radians().sin_cos();
        let record = match spec.mean_mps > 0.0 {
            true => Record::new(spec, seed.stream("world/wind")),
            false => Record::still(),
        };
        let (trees, limbs) = (seed.stream("world/wind/tree"), seed.stream("world/wind/limb"));
        let toward = Vector2::new(cos, sin);
        let delay_s_per_m = toward / spec.mean_mps.max(f64::MIN_POSITIVE);
        let mut wind = Wind {
            spec: spec.clone(),
            toward,
            delay_s_per_m,
            most: record.most(),
            record,
            stems: Vec::new(),
        };
        if wind.blows() {
            let stem = |(index, plant): (usize, &Plant)| {
                let delay_s = wind.delay_s(plant.hinge.foot.x, plant.hinge.foot.y);
                Stem::new(plant, Modes::new(plant, index, trees, limbs), delay_s)
            };
            wind.stems = plants.iter().enumerate().map(stem).collect();
        }
        wind
    }

    /// Whether anything moves at all.
    pub fn blows(&self) -> bool {
        self.spec.mean_mps > 0.0
    }

    /// Speed at a place and an instant, m/s. Gusts travel with the mean wind (Taylor's frozen turbulence).
    pub fn speed_mps(&self, x: f64, y: f64, seconds: f64) -> f64 {
        match self.blows() {
            true => self.record.at(seconds - self.delay_s(x, y)).speed_mps,
            false => 0.0,
        }
    }

    /// How much later than at the origin a gust is at a place, in a wind that blows.
    #[inline(always)]
    fn delay_s(&self, x: f64, y: f64) -> f64 {
        self.delay_s_per_m.x * x + self.delay_s_per_m.y * y
    }

    /// Where the plant with this index among the world's is at an instant, `seconds` on the simulation's clock.
    pub fn sway(&self, index: usize, plant: &Plant, seconds: f64) -> Sway {
        let (Some(bend), Some(stem)) = (self.bend(index, seconds), self.stem(index)) else {
            return Sway::at_rest(plant);
        };
        let [.., s0, s1, s2, s3, l0, l1, l2, l3] = stem.turns(seconds);
        Sway {
            world_from_plant: bend.world_from_plant(plant),
            shoot_m: bend.shoot_m,
            shoot_turns: [s0, s1, s2, s3],
            leaf_sin: bend.leaf_sin,
            leaf_turns: [l0, l1, l2, l3],
        }
    }

    /// How far the parts of a plant are from where they rest at most, at any instant.
    pub fn drift_max(&self, plant: &Plant) -> Drift {
        drift(plant, &self.most)
    }

    /// The same between two instants at most a minute apart, `from_s` and `to_s` on the simulation's clock.
    pub fn drift_between(&self, plant: &Plant, from_s: f64, to_s: f64) -> Drift {
        if !self.blows() {
            return drift(plant, &Gust::default());
        }
        let delay_s = self.delay_s(plant.hinge.foot.x, plant.hinge.foot.y);
        drift(plant, &self.record.most_between(from_s - delay_s, to_s - delay_s))
    }
}

fn drift(plant: &Plant, gust: &Gust) -> Drift {
    let bend = gust.bending;
    // Lean, yaw and roll together, on an arm of the limb's own reach; the trunk's top drifts along and across.
    let trunk_m = TRUNK_M * (1.0 + 0.5_f64.powi(2)).sqrt();
    let limb_m = LIMB_M * (1.0 + 0.4_f64.powi(2) + 0.3_f64.powi(2)).sqrt();
    // A tip that the limb lifts above the tree's height leans further than the top.
    let lift_ratio = 1.0 + bend * limb_m / plant.hinge.height_m.max(STILL_BELOW_M);
    Drift {
        plant_m: bend * (trunk_m * lift_ratio + limb_m),
        shoot_m: bend * SHOOT_M,
        leaf_rad: gust.flutter * LEAF_RAD,
        bend_ratio: bend,
    }
}

impl Sway {
    /// A plant that nothing moves.
    pub fn at_rest(plant: &Plant) -> Self {
        Sway {
            world_from_plant: Affine3::from_matrix_unchecked(plant.world_from_plant.to_homogeneous()),
            shoot_m: 0.0,
            shoot_turns: [0.0; PITCHES],
            leaf_sin: 0.0,
            leaf_turns: [0.0; PITCHES],
        }
    }

    /// Where the prototype's leaf `index` is now, plant frame. Leaves turn about `half_u`; the turn is exact when the
    /// two half sides are at right angles, as grown leaves' are.
    pub fn leaf(&self, index: usize, rest: &Leaf) -> Leaf {
        let shoot = index / LEAVES_PER_SHOOT;
        let shift =
            self.shoot_m * swing_of(self.shoot_turns[shoot % PITCHES], shoot) * shoot_direction(shoot);
        let sin = self.leaf_sin * swing_of(self.leaf_turns[shoot % PITCHES], shoot);
        let cos = (1.0 - sin * sin).sqrt();
        let normal = rest.half_u.cross(&rest.half_v);
        Leaf {
            center: rest.center + shift,
            half_u: rest.half_u,
            half_v: rest.half_v * cos + normal * (sin / rest.half_u.norm().max(f64::MIN_POSITIVE)),
        }
    }
}

/// The line along which a prototype's shoot moves: a unit vector, spread evenly over the sphere (golden spiral).
pub fn shoot_direction(shoot: usize) -> Vector3<f64> {
    let up = 1.0 - 2.0 * (shoot as f64 * GOLDEN_TURNS).fract();
    let level = (1.0 - up * up).max(0.0).sqrt();
    // Another irrational step, so that direction and phase of a shoot are not tied to each other.
    let (sin, cos) = (TAU * (shoot as f64 * std::f64::consts::SQRT_2).fract()).sin_cos();
    Vector3::new(level * cos, level * sin, up)
}

/// Deflection of member `number` of a family that shares a phase in [0, 1): in [-1, 1].
pub fn swing_of(turns: f64, number: usize) -> f64 {
    sine(turns + own_turns(number))
}

/// By how many turns member `number` of a family is ahead of the shared phase, in [0, 1).
pub fn own_turns(number: usize) -> f64 {
    (number as f64 * GOLDEN_TURNS).fract()
}
