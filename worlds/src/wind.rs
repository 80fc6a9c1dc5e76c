//! Wind: gusts that travel over the world, and how trunks, limbs, shoots and leaves give way to them.
//!
//! Four scales, each with its own frequencies (sensors, plants and sites facts, 7.5; all assumed within those bands):
//!
//! | scale | moves | frequency | at 10 m/s |
//! |---|---|---|---|
//! | trunk | the whole plant leans, more with height; still at lidar height | 0.5-1.5 Hz | 2 cm at the top |
//! | limb | turns about its fork | 1-3 Hz | 10 cm at the tip |
//! | shoot | eight neighboring leaves shift together | 2-5 Hz | 8 cm |
//! | leaf | turns about its own `half_u` | 3-8 Hz | 30 deg |
//!
//! Trunk and limb are one affine map per plant, so a beam is turned into a moving plant's frame and nothing is built
//! anew. Everything is a pure function of place and time: any instant may be asked for, in any order.

use crate::Plant;
use crate::shape::Leaf;
use crate::spec::{SpecError, within};
use arborloop_base::{Seed, Stream};
use nalgebra::{Affine3, Matrix4, Point3, UnitQuaternion, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Leaves that move together: a prototype's leaves `8 k` to `8 k + 7` are its shoot `k`.
pub const LEAVES_PER_SHOOT: usize = 8;
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

/// Stronger gusts bend nothing further, m/s: leaves have reconfigured, and this is no place for a robot.
const SPEED_MPS_MAX: f64 = 15.0;
/// The speed at which the table above holds, m/s.
const SPEED_MPS_NAMED: f64 = 10.0;
/// Bending grows with this power of the speed: drag with the Vogel exponent -0.7 of reconfiguring foliage.
const BENDING_POWER: f64 = 1.3;
/// Flutter grows with this power only (Tadrist et al. 2018: weakly wind-dependent).
const FLUTTER_POWER: f64 = 0.5;
const TRUNK_M: f64 = 0.02;
const LIMB_M: f64 = 0.10;
const SHOOT_M: f64 = 0.08;
const LEAF_RAD: f64 = 30.0 * TAU / 360.0;
const TRUNK_HZ: [f64; 2] = [0.5, 1.5];
const LIMB_HZ: [f64; 2] = [1.0, 3.0];
const SHOOT_HZ: [f64; 2] = [2.0, 5.0];
const LEAF_HZ: [f64; 2] = [3.0, 8.0];
/// Share of a bend that is a steady lean before the wind; the rest swings about it.
const LEAN_RATIO: f64 = 0.4;
/// The gust record's spacing and length. It begins anew after 328 s.
const GUST_STEP_S: f64 = 0.04;
const GUST_STEPS: usize = 8192;
/// Sines in the record.
const GUSTS: u64 = 32;
/// Consecutive shoots, and consecutive leaves of a shoot, are this many turns apart: the golden ratio's fraction, so
/// that no two nearby move in step.
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
    /// Speeds at the origin, m/s, [`GUST_STEP_S`] apart; periodic.
    record: Vec<f64>,
    speed_mps_max: f64,
    modes: Vec<Modes>,
}

/// One plant's own frequencies, Hz, and phases, turns.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Modes {
    trunk: [Swing; 2],
    limb: [Swing; 3],
    shoots: [Swing; PITCHES],
    leaves: [Swing; PITCHES],
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Swing {
    frequency_hz: f64,
    phase_turns: f64,
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
    /// How far a leaf turns at most, radians.
    pub leaf_rad: f64,
    /// Phases of the leaves' frequencies, turns in [0, 1); leaf `j` follows entry `j % 4`.
    pub leaf_turns: [f64; PITCHES],
}

impl Wind {
    /// The wind of a world with these plants. The gusts come from the stream `world/wind`, the plants' frequencies and
    /// phases from `world/wind/tree` by instance and `world/wind/limb` by index.
    pub fn new(spec: &WindSpec, plants: &[Plant], seed: Seed) -> Self {
        let (sin, cos) = spec.toward_deg.to_radians().sin_cos();
        let record = if spec.mean_mps > 0.0 { gusts(spec, seed.stream("world/wind")) } else { vec![0.0] };
        let (trees, limbs) = (seed.stream("world/wind/tree"), seed.stream("world/wind/limb"));
        let modes = if spec.mean_mps > 0.0 {
            plants.iter().enumerate().map(|(index, plant)| Modes::new(plant, index, trees, limbs)).collect()
        } else {
            Vec::new()
        };
        let speed_mps_max = record.iter().copied().fold(0.0, f64::max);
        Wind { spec: spec.clone(), toward: Vector2::new(cos, sin), record, speed_mps_max, modes }
    }

    /// Whether anything moves at all.
    pub fn blows(&self) -> bool {
        self.spec.mean_mps > 0.0
    }

    /// Speed at a place and an instant, m/s. Gusts travel with the mean wind (Taylor's frozen turbulence).
    pub fn speed_mps(&self, x: f64, y: f64, seconds: f64) -> f64 {
        if !self.blows() {
            return 0.0;
        }
        let delay_s = (self.toward.x * x + self.toward.y * y) / self.spec.mean_mps;
        let at = ((seconds - delay_s) / GUST_STEP_S).rem_euclid(GUST_STEPS as f64);
        let (whole, share) = (at.floor(), at - at.floor());
        let (first, next) = (whole as usize % GUST_STEPS, (whole as usize + 1) % GUST_STEPS);
        self.record[first] + (self.record[next] - self.record[first]) * share
    }

    /// Where the plant with this index among the world's is at an instant, `seconds` on the simulation's clock.
    pub fn sway(&self, index: usize, plant: &Plant, seconds: f64) -> Sway {
        let Some(modes) = self.modes.get(index) else { return Sway::at_rest(plant) };
        let hinge = &plant.hinge;
        let speed_mps = self.speed_mps(hinge.foot.x, hinge.foot.y, seconds);
        let bend = bending(speed_mps);
        let [along, across] = modes.trunk.map(|swing| swing.at(seconds));
        let top = bend * TRUNK_M * (self.toward * (LEAN_RATIO + (1.0 - LEAN_RATIO) * along))
            + bend * TRUNK_M * 0.5 * across * Vector2::new(-self.toward.y, self.toward.x);
        let [pitch, yaw, roll] = modes.limb.map(|swing| swing.at(seconds));
        let tip_rad = bend * LIMB_M / hinge.reach_m;
        // Leaning before the wind is a turn about the level line across it.
        let lean = Vector3::new(-self.toward.y, self.toward.x, 0.0);
        let turn = tip_rad
            * (lean * (LEAN_RATIO + (1.0 - LEAN_RATIO) * pitch)
                + 0.4 * yaw * Vector3::z()
                + 0.3 * roll * Vector3::new(self.toward.x, self.toward.y, 0.0));
        let scale = plant.world_from_plant.scaling();
        Sway {
            world_from_plant: bent(hinge, top, turn) * plant.world_from_plant,
            shoot_m: bend * SHOOT_M / scale,
            shoot_turns: modes.shoots.map(|swing| swing.turns(seconds)),
            leaf_rad: flutter(speed_mps),
            leaf_turns: modes.leaves.map(|swing| swing.turns(seconds)),
        }
    }

    /// No point of the plant's frame is ever farther than this from where it rests, meters, leaves and shoots left out.
    pub fn drift_m_max(&self, plant: &Plant) -> f64 {
        let bend = bending(self.speed_mps_max);
        // Lean, yaw and roll together, on an arm of the limb's own reach; the trunk's top drifts along and across.
        let trunk_m = TRUNK_M * (1.0 + 0.5_f64.powi(2)).sqrt();
        let limb_m = LIMB_M * (1.0 + 0.4_f64.powi(2) + 0.3_f64.powi(2)).sqrt();
        // A tip that the limb lifts above the tree's height leans further than the top.
        let lift_ratio = 1.0 + bend * limb_m / plant.hinge.height_m.max(STILL_BELOW_M);
        bend * (trunk_m * lift_ratio + limb_m)
    }

    /// The farthest that any shoot ever shifts, world meters.
    pub fn shoot_m_max(&self) -> f64 {
        bending(self.speed_mps_max) * SHOOT_M
    }

    /// The farthest that any leaf ever turns, radians.
    pub fn leaf_rad_max(&self) -> f64 {
        flutter(self.speed_mps_max)
    }
}

impl Sway {
    /// A plant that nothing moves.
    pub fn at_rest(plant: &Plant) -> Self {
        Sway {
            world_from_plant: Affine3::from_matrix_unchecked(plant.world_from_plant.to_homogeneous()),
            shoot_m: 0.0,
            shoot_turns: [0.0; PITCHES],
            leaf_rad: 0.0,
            leaf_turns: [0.0; PITCHES],
        }
    }

    /// Where the prototype's leaf `index` is now, plant frame. Leaves turn about `half_u`; the turn is exact when the
    /// two half sides are at right angles, as grown leaves' are.
    pub fn leaf(&self, index: usize, rest: &Leaf) -> Leaf {
        let shoot = index / LEAVES_PER_SHOOT;
        let shift =
            self.shoot_m * swing_of(self.shoot_turns[shoot % PITCHES], shoot) * shoot_direction(shoot);
        let angle_rad = self.leaf_rad * swing_of(self.leaf_turns[index % PITCHES], index);
        let (sin, cos) = angle_rad.sin_cos();
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

/// Deflection of member `number` of a family that shares a phase, in [-1, 1].
pub fn swing_of(turns: f64, number: usize) -> f64 {
    (TAU * (turns + own_turns(number))).sin()
}

/// By how many turns member `number` of a family is ahead of the shared phase, in [0, 1).
pub fn own_turns(number: usize) -> f64 {
    (number as f64 * GOLDEN_TURNS).fract()
}

fn bending(speed_mps: f64) -> f64 {
    (speed_mps / SPEED_MPS_NAMED).powf(BENDING_POWER)
}

fn flutter(speed_mps: f64) -> f64 {
    LEAF_RAD * (speed_mps / SPEED_MPS_NAMED).powf(FLUTTER_POWER).min(1.0)
}

/// The trunk's lean after the limb's turn, world to world.
fn bent(hinge: &Hinge, top_m: Vector2<f64>, turn: Vector3<f64>) -> Affine3<f64> {
    let rotation = UnitQuaternion::from_scaled_axis(turn);
    let fork = hinge.fork;
    let mut matrix = rotation.to_homogeneous();
    let shift = fork.coords - rotation * fork.coords;
    matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&shift);
    let share = (hinge.height_m - STILL_BELOW_M).max(STILL_BELOW_M).recip();
    let mut lean = Matrix4::identity();
    for axis in 0..2 {
        lean[(axis, 2)] = top_m[axis] * share;
        lean[(axis, 3)] = -top_m[axis] * share * (hinge.foot.z + STILL_BELOW_M);
    }
    Affine3::from_matrix_unchecked(lean * matrix)
}

impl Modes {
    fn new(plant: &Plant, index: usize, trees: Stream, limbs: Stream) -> Self {
        let mut tree = trees.at(u64::from(plant.instance));
        let mut limb = limbs.at(index as u64);
        Modes {
            trunk: std::array::from_fn(|_| Swing::draw(TRUNK_HZ, &mut tree)),
            limb: std::array::from_fn(|_| Swing::draw(LIMB_HZ, &mut limb)),
            shoots: std::array::from_fn(|_| Swing::draw(SHOOT_HZ, &mut limb)),
            leaves: std::array::from_fn(|_| Swing::draw(LEAF_HZ, &mut limb)),
        }
    }
}

impl Swing {
    fn draw([low_hz, high_hz]: [f64; 2], draws: &mut arborloop_base::Draws) -> Self {
        Swing { frequency_hz: draws.within(low_hz, high_hz), phase_turns: draws.unit() }
    }

    fn turns(&self, seconds: f64) -> f64 {
        (self.frequency_hz * seconds + self.phase_turns).rem_euclid(1.0)
    }

    fn at(&self, seconds: f64) -> f64 {
        (TAU * self.turns(seconds)).sin()
    }
}

/// A periodic record of speeds whose fluctuation has Kaimal's spectrum, `S(n) ~ 1 / (1 + 10 n)^(5/3)` with
/// `n = f z / U`, between 0.01 and 1 Hz.
fn gusts(spec: &WindSpec, stream: Stream) -> Vec<f64> {
    let length_s = GUST_STEP_S * GUST_STEPS as f64;
    // Height over mean speed of the reduced frequency: 10 m eddies.
    let eddy_s = 10.0 / spec.mean_mps;
    let mut sines: Vec<(f64, f64, f64)> = (0..GUSTS)
        .map(|index| {
            let mut draws = stream.at(index);
            let frequency_hz = 0.01 * 100.0_f64.powf((index as f64 + draws.unit()) / GUSTS as f64);
            // A whole number of periods in the record, so that it closes on itself.
            let periods = (frequency_hz * length_s).round().max(1.0);
            let frequency_hz = periods / length_s;
            // On a logarithmic axis each sine stands for f S(f).
            let power = frequency_hz / (1.0 + 10.0 * frequency_hz * eddy_s).powf(5.0 / 3.0);
            (periods, power.sqrt(), draws.unit())
        })
        .collect();
    let variance: f64 = sines.iter().map(|(_, amplitude, _)| amplitude * amplitude / 2.0).sum();
    let scale = spec.gust_ratio / variance.sqrt();
    sines.iter_mut().for_each(|(_, amplitude, _)| *amplitude *= scale);
    (0..GUST_STEPS)
        .map(|step| {
            let share = step as f64 / GUST_STEPS as f64;
            let gust: f64 =
                sines.iter().map(|(n, amplitude, phase)| amplitude * (TAU * (n * share + phase)).sin()).sum();
            (spec.mean_mps * (1.0 + gust)).clamp(0.0, SPEED_MPS_MAX)
        })
        .collect()
}
