//! How a plant bends at an instant, in the few numbers that everything else follows from.

use super::gust::Gust;
use super::swing::sines;
use super::{Hinge, LEAF_RAD, LIMB_M, PITCHES, SHOOT_M, STILL_BELOW_M, TRUNK_M, Wind};
use crate::Plant;
use nalgebra::{Affine3, Matrix3, Quaternion, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// Share of a bend that is a steady lean before the wind; the rest swings about it.
const LEAN_RATIO: f64 = 0.4;

/// A plant at one instant: [`Wind::sway`] before its placement is worked out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bend {
    /// How far the trunk is aside, world x and y, for each meter above where it stands still.
    pub lean_ratio: [f64; 2],
    /// The limb's turn about its fork, world frame: by Cayley's map, a rotation by twice the arc tangent of half the
    /// vector's length.
    pub turn_rad: [f64; 3],
    /// How far a shoot shifts at most, plant frame, meters.
    pub shoot_m: f64,
    /// Phases of the shoots' frequencies: see [`super::Sway::shoot_turns`].
    pub shoot_turns: [f64; PITCHES],
    /// Sine of a leaf's farthest turn.
    pub leaf_sin: f64,
    /// Phases of the leaves' frequencies: see [`super::Sway::leaf_turns`].
    pub leaf_turns: [f64; PITCHES],
}

impl Wind {
    /// How the plant with this index among the world's bends at an instant, `seconds` on the simulation's clock; nothing
    /// in still air. Inlined, so that a caller with wide registers computes it in them; the bits are the same.
    #[inline(always)]
    pub fn bend(&self, index: usize, plant: &Plant, seconds: f64) -> Option<Bend> {
        let modes = self.modes.get(index)?;
        let hinge = &plant.hinge;
        let Gust { bending, flutter, .. } =
            self.record.at(seconds - self.delay_s(hinge.foot.x, hinge.foot.y));
        let turns = modes.turns(seconds);
        let [a, b, c, d, e, ..] = turns;
        let [along, across, pitch, yaw, roll, leaf_sin, ..] =
            sines(&[a, b, c, d, e, flutter * (LEAF_RAD / TAU), 0.0, 0.0]);
        let trunk_ratio = bending * TRUNK_M / above_m(hinge);
        let (along, across) = (trunk_ratio * swung(along), trunk_ratio * 0.5 * across);
        let tip_rad = bending * LIMB_M / hinge.reach_m;
        // Leaning before the wind is a turn about the level line across it.
        let (lean, yaw, roll) = (tip_rad * swung(pitch), tip_rad * 0.4 * yaw, tip_rad * 0.3 * roll);
        let (x, y) = (self.toward.x, self.toward.y);
        Some(Bend {
            lean_ratio: [along * x - across * y, along * y + across * x],
            turn_rad: [roll * x - lean * y, roll * y + lean * x, yaw],
            shoot_m: bending * SHOOT_M / plant.world_from_plant.scaling(),
            shoot_turns: [turns[8], turns[9], turns[10], turns[11]],
            leaf_sin,
            leaf_turns: [turns[12], turns[13], turns[14], turns[15]],
        })
    }
}

#[inline(always)]
fn swung(swing: f64) -> f64 {
    LEAN_RATIO + (1.0 - LEAN_RATIO) * swing
}

/// The height over which a trunk leans, meters.
#[inline(always)]
fn above_m(hinge: &Hinge) -> f64 {
    (hinge.height_m - STILL_BELOW_M).max(STILL_BELOW_M)
}

impl Bend {
    /// From the plant's frame to the world: the trunk's lean after the limb's turn about its fork.
    pub(super) fn world_from_plant(&self, plant: &Plant) -> Affine3<f64> {
        let hinge = &plant.hinge;
        let half_turn = 0.5 * Vector3::from(self.turn_rad);
        let rotation = UnitQuaternion::new_normalize(Quaternion::from_parts(1.0, half_turn));
        let rest = &plant.world_from_plant;
        let turned: Matrix3<f64> = (rotation * rest.isometry.rotation).to_rotation_matrix().into_inner();
        let place = hinge.fork.coords + rotation * (rest.isometry.translation.vector - hinge.fork.coords);
        let mut map = Affine3::identity();
        let above_m = place.z - hinge.foot.z - STILL_BELOW_M;
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
    pub fn rest_from_now(&self, hinge: &Hinge) -> [[f64; 4]; 3] {
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
        let still_m = hinge.foot.z + STILL_BELOW_M;
        let from_fork = [lean_x * still_m - hinge.fork.x, lean_y * still_m - hinge.fork.y, -hinge.fork.z];
        let mut map = [[0.0; 4]; 3];
        let mut row = 0;
        while row < 3 {
            let [a, b, c] = back[row];
            let there = a * from_fork[0] + b * from_fork[1] + c * from_fork[2];
            map[row] = [a, b, c - a * lean_x - b * lean_y, hinge.fork[row] + there];
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
                let bend = world.wind.bend(index, plant, 1.0 + 0.37 * f64::from(step)).unwrap();
                let part = Point3::new(0.4, -0.7, 1.9);
                let now = bend.world_from_plant(plant) * part;
                let back =
                    bend.rest_from_now(&plant.hinge).map(|row| Vector4::from(row).dot(&now.to_homogeneous()));
                assert!((Point3::from(back) - plant.world_from_plant * part).norm() < 1e-12);
            }
        }
    }
}
