//! How a plant bends at an instant, in the few numbers that everything else follows from.

use super::gust::Gust;
use super::swing::{MODES, Modes, sine};
use super::{LIMB_M, SHOOT_M, STILL_BELOW_M, TRUNK_M, Wind};
use crate::Plant;
use nalgebra::{Affine3, Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Share of a bend that is a steady lean before the wind; the rest swings about it.
pub(super) const LEAN_RATIO: f64 = 0.4;

/// A plant at one instant: [`Wind::sway`] before its placement is worked out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bend {
    /// How far the trunk is aside, world x and y, for each meter above where it stands still.
    pub lean_ratio: [f64; 2],
    /// The height where it stands still, world z, meters.
    pub still_m: f64,
    /// The limb's turn about its fork, world frame: by Cayley's map, a rotation by twice the arc tangent of half the
    /// vector's length.
    pub turn_rad: [f64; 3],
    /// The fork, world frame.
    pub fork: [f64; 3],
    /// How far a shoot shifts at most, plant frame, meters.
    pub shoot_m: f64,
    /// Sine of a leaf's farthest turn.
    pub leaf_sin: f64,
}

/// What the wind knows of a plant, in three lines of memory: it is read anew for each plant and instant. Opaque; who
/// knows that [`Wind::bend`] comes may ask the processor to fetch it.
#[derive(Debug, Clone, PartialEq)]
#[repr(C, align(64))]
pub struct Stem {
    modes: Modes,
    /// How much later than at the origin gusts are here.
    delay_s: f64,
    /// At a bending of one: how far aside the trunk is for each meter, the limb's turn, how far a shoot shifts.
    pub(super) lean_ratio: f64,
    pub(super) turn_rad: f64,
    shoot_m: f64,
    pub(super) fork: [f64; 3],
    pub(super) still_m: f64,
}

impl Stem {
    pub(super) fn new(plant: &Plant, modes: Modes, delay_s: f64) -> Self {
        let hinge = &plant.hinge;
        Stem {
            modes,
            delay_s,
            lean_ratio: TRUNK_M / (hinge.height_m - STILL_BELOW_M).max(STILL_BELOW_M),
            turn_rad: LIMB_M / hinge.reach_m,
            shoot_m: SHOOT_M / plant.world_from_plant.scaling(),
            fork: hinge.fork.into(),
            still_m: hinge.foot.z + STILL_BELOW_M,
        }
    }

    /// The phases at an instant, turns in [0, 1): see [`Self::turns_at`].
    pub(super) fn turns(&self, seconds: f64) -> [f64; MODES] {
        self.modes.turns(seconds)
    }

    /// Phases, turns in [-1/2, 1/2], so many milliseconds after the simulation's clock was at zero: two of the trunk, three
    /// of the limb, three that nothing follows, four of the shoots, four of the leaves. To 1e-7 what
    /// [`super::Sway`] says, and reckoned in whole numbers: a few instructions for all sixteen.
    #[inline(always)]
    pub fn turns_at(&self, millis: i64) -> [f32; MODES] {
        self.modes.turns_at(millis)
    }
}

impl Wind {
    /// What [`Self::bend`] reads of the plant with this index; nothing in still air.
    #[inline(always)]
    pub fn stem(&self, index: usize) -> Option<&Stem> {
        self.stems.get(index)
    }

    /// How the plant with this index among the world's bends at an instant, `seconds` on the simulation's clock; nothing
    /// in still air.
    pub fn bend(&self, index: usize, seconds: f64) -> Option<Bend> {
        let stem = self.stems.get(index)?;
        let turns = stem.modes.turns(seconds);
        Some(self.bend_of(stem, seconds, std::array::from_fn(|mode| sine(turns[mode]))))
    }

    /// The same from the phases and from the sines of the first five, trunk and limb. Inlined, so that a caller with wide
    /// registers computes it in them; the bits are the same.
    #[inline(always)]
    pub fn bend_of(&self, stem: &Stem, seconds: f64, swings: [f64; 5]) -> Bend {
        let Gust { bending, leaf_sin, .. } = self.record.at(seconds - stem.delay_s);
        let [along, across, pitch, yaw, roll] = swings;
        let trunk_ratio = bending * stem.lean_ratio;
        let (along, across) = (trunk_ratio * swung(along), trunk_ratio * 0.5 * across);
        let tip_rad = bending * stem.turn_rad;
        // Leaning before the wind is a turn about the level line across it.
        let (lean, yaw, roll) = (tip_rad * swung(pitch), tip_rad * 0.4 * yaw, tip_rad * 0.3 * roll);
        let (x, y) = (self.toward.x, self.toward.y);
        Bend {
            lean_ratio: [along * x - across * y, along * y + across * x],
            still_m: stem.still_m,
            turn_rad: [roll * x - lean * y, roll * y + lean * x, yaw],
            fork: stem.fork,
            shoot_m: bending * stem.shoot_m,
            leaf_sin,
        }
    }
}

#[inline(always)]
fn swung(swing: f64) -> f64 {
    LEAN_RATIO + (1.0 - LEAN_RATIO) * swing
}

impl Bend {
    /// From the plant's frame to the world: the trunk's lean after the limb's turn about its fork.
    pub(super) fn world_from_plant(&self, plant: &Plant) -> Affine3<f64> {
        let (half_turn, fork) = (0.5 * Vector3::from(self.turn_rad), Vector3::from(self.fork));
        let rotation = UnitQuaternion::new_normalize(Quaternion::from_parts(1.0, half_turn));
        let rest = &plant.world_from_plant;
        let turned: Matrix3<f64> = (rotation * rest.isometry.rotation).to_rotation_matrix().into_inner();
        let place = fork + rotation * (rest.isometry.translation.vector - fork);
        let mut map = Affine3::identity();
        let above_m = place.z - self.still_m;
        for row in 0..3 {
            let lean = if row < 2 { self.lean_ratio[row] } else { 0.0 };
            for column in 0..3 {
                map.matrix_mut_unchecked()[(row, column)] =
                    rest.scaling() * (turned[(row, column)] + lean * turned[(2, column)]);
            }
            map.matrix_mut_unchecked()[(row, 3)] = place[row] + lean * above_m;
        }
        map
    }

    /// From where a point of the plant is to where it rests, world frame, row by row: the way back, without an inverse.
    #[inline(always)]
    pub fn rest_from_now(&self) -> [[f64; 4]; 3] {
        let [x, y, z] = self.turn_rad.map(|turn| 0.5 * turn);
        let square = x * x + y * y + z * z;
        let share = 2.0 / (1.0 + square);
        let same = 1.0 - share * square;
        // The transpose of the rotation by the unit quaternion along (1, x, y, z).
        let back = [
            [same + share * x * x, share * (x * y + z), share * (x * z - y)],
            [share * (x * y - z), same + share * y * y, share * (y * z + x)],
            [share * (x * z + y), share * (y * z - x), same + share * z * z],
        ];
        let [lean_x, lean_y] = self.lean_ratio;
        let from_fork =
            [lean_x * self.still_m - self.fork[0], lean_y * self.still_m - self.fork[1], -self.fork[2]];
        let mut map = [[0.0; 4]; 3];
        let mut row = 0;
        while row < 3 {
            let [a, b, c] = back[row];
            let there = a * from_fork[0] + b * from_fork[1] + c * from_fork[2];
            map[row] = [a, b, c - a * lean_x - b * lean_y, self.fork[row] + there];
            row += 1;
        }
        map
    }
}

#[cfg(test)]
mod tests {
    use crate::{TerrainSpec, WindSpec, WorldSpec, build};
    use arborloop_base::Seed;
    use nalgebra::{Point3, Vector4};

    #[test]
    fn the_way_back_leads_from_a_bent_plant_to_where_it_rests() {
        let spec = WorldSpec {
            terrain: TerrainSpec { cell_m: 2.0, bump_wavelength_m: 4.0, ..TerrainSpec::default() },
            wind: WindSpec { mean_mps: 9.0, ..WindSpec::default() },
            ..WorldSpec::default()
        };
        let world = build(&spec, Seed(5));
        for (index, plant) in world.plants.iter().enumerate() {
            for step in 0..20 {
                let bend = world.wind.bend(index, 1.0 + 0.37 * f64::from(step)).unwrap();
                let part = Point3::new(0.4, -0.7, 1.9);
                let now = bend.world_from_plant(plant) * part;
                let back = bend.rest_from_now().map(|row| Vector4::from(row).dot(&now.to_homogeneous()));
                assert!((Point3::from(back) - plant.world_from_plant * part).norm() < 1e-12);
            }
        }
    }
}
