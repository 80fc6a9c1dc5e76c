//! Which foot pushes how hard: ground forces inside their friction cones that come nearest to a wanted wrench.
//!
//! The weighted least-squares problem of unitree_guide's balance controller, with exact cones in place of pyramids,
//! solved by a fixed number of steps of the alternating direction method of multipliers (Boyd et al. 2011): always the
//! same work, always the same answer.

use nalgebra::{Cholesky, Matrix3, SMatrix, SVector, UnitQuaternion, Vector3, Vector6};

type Forces = SVector<f64, 12>;

/// Weights of force (x, y, z) and torque errors (unitree_guide `BalanceCtrl`).
const WEIGHTS: [f64; 6] = [20.0, 20.0, 50.0, 450.0, 450.0, 450.0];
/// What the weights of force become when a foot stands alone: to hold the robot up with it would turn the robot over.
/// Assumed: the trunk may sink for as long as the other feet take to come down.
const ALONE: f64 = 0.15;
/// Weight of the forces' own squares and of their change (unitree_guide `BalanceCtrl`: 0.001 and 0.1).
const SIZE_WEIGHT: f64 = 0.001;
const CHANGE_WEIGHT: f64 = 0.1;
/// Penalty of the splitting; assumed: the geometric middle between the weakest and the strongest curvature.
const PENALTY: f64 = 2.0;
/// Steps of the splitting (physics study: 40).
const STEPS: usize = 40;

/// A foot that may push.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Footing {
    /// From the center of mass to the foot, world axes, meters.
    pub(crate) arm: Vector3<f64>,
    /// Most force along z, N; zero for a foot that does not stand.
    pub(crate) most_n: f64,
}

/// Distributes wrenches; keeps the last answer, near which the next one begins.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Distribution {
    friction: f64,
    last: Forces,
    multiplier: Forces,
}

impl Distribution {
    pub(crate) fn new(friction: f64) -> Self {
        Distribution { friction, last: Forces::zeros(), multiplier: Forces::zeros() }
    }

    /// Turns the axes in which the last answer is remembered.
    pub(crate) fn turn(&mut self, turn: &UnitQuaternion<f64>) {
        for forces in [&mut self.last, &mut self.multiplier] {
            for foot in 0..4 {
                let turned = turn * forces.fixed_rows::<3>(3 * foot).into_owned();
                forces.fixed_rows_mut::<3>(3 * foot).copy_from(&turned);
            }
        }
    }

    /// Forces of the ground on the feet, world axes, N, that together come nearest to a wrench about the center of mass.
    pub(crate) fn share(&mut self, wrench: &Vector6<f64>, footings: &[Footing; 4]) -> [Vector3<f64>; 4] {
        let mut map = SMatrix::<f64, 6, 12>::zeros();
        for (foot, footing) in footings.iter().enumerate().filter(|(_, footing)| footing.most_n > 0.0) {
            map.fixed_view_mut::<3, 3>(0, 3 * foot).copy_from(&Matrix3::identity());
            map.fixed_view_mut::<3, 3>(3, 3 * foot).copy_from(&footing.arm.cross_matrix());
        }
        let mut weights = Vector6::from(WEIGHTS);
        if footings.iter().filter(|footing| footing.most_n > 0.0).count() == 1 {
            weights.fixed_rows_mut::<3>(0).scale_mut(ALONE);
        }
        let weighted = SMatrix::<f64, 6, 6>::from_diagonal(&weights) * map;
        let ridge = SIZE_WEIGHT + CHANGE_WEIGHT + PENALTY;
        let curvature = map.transpose() * weighted + SMatrix::<f64, 12, 12>::identity() * ridge;
        // A sum of squares plus a positive diagonal has a factor.
        let Some(factor) = Cholesky::new(curvature) else {
            return [Vector3::zeros(); 4];
        };
        let pull = weighted.transpose() * wrench + self.last * CHANGE_WEIGHT;
        let mut inside = self.last;
        for _ in 0..STEPS {
            let mut free = pull + (inside - self.multiplier) * PENALTY;
            factor.solve_mut(&mut free);
            for (foot, footing) in footings.iter().enumerate() {
                let wanted = (free + self.multiplier).fixed_rows::<3>(3 * foot).into_owned();
                inside.fixed_rows_mut::<3>(3 * foot).copy_from(&self.in_cone(&wanted, footing.most_n));
            }
            self.multiplier += free - inside;
        }
        self.last = inside;
        std::array::from_fn(|foot| inside.fixed_rows::<3>(3 * foot).into_owned())
    }

    /// The nearest force in the friction cone below a greatest z: exact for both bounds.
    fn in_cone(&self, force: &Vector3<f64>, most_n: f64) -> Vector3<f64> {
        if most_n <= 0.0 {
            return Vector3::zeros();
        }
        let aside = force.xy().norm();
        let mu = self.friction;
        let (aside_new, up) = if aside <= mu * force.z {
            (aside, force.z)
        } else {
            // Onto the cone's side; behind the tip, where it is negative, onto the tip.
            let along = ((mu * aside + force.z) / (1.0 + mu * mu)).max(0.0);
            (mu * along, along)
        };
        let (aside_new, up) = if up > most_n { (aside.min(mu * most_n), most_n) } else { (aside_new, up) };
        let shrink = if aside > 0.0 { aside_new / aside } else { 0.0 };
        Vector3::new(force.x * shrink, force.y * shrink, up)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;

    fn four(most_n: [f64; 4]) -> [Footing; 4] {
        let places = [(0.19, -0.13), (0.19, 0.13), (-0.19, -0.13), (-0.19, 0.13)];
        std::array::from_fn(|foot| Footing {
            arm: Vector3::new(places[foot].0, places[foot].1, -0.27),
            most_n: most_n[foot],
        })
    }

    fn settled(wrench: Vector6<f64>, footings: &[Footing; 4], friction: f64) -> [Vector3<f64>; 4] {
        let mut distribution = Distribution::new(friction);
        (0..300).map(|_| distribution.share(&wrench, footings)).last().unwrap()
    }

    #[test]
    fn weight_on_four_feet_is_shared_evenly() {
        let weight = Vector6::new(0.0, 0.0, 129.4, 0.0, 0.0, 0.0);
        for force in settled(weight, &four([250.0; 4]), 0.5) {
            assert!((force.z - 129.4 / 4.0).abs() < 0.05, "{force:?}");
            assert!(force.xy().norm() < 0.05);
        }
    }

    #[test]
    fn no_force_leaves_its_cone_and_a_lifted_foot_pushes_nothing() {
        let stream = Seed(4).stream("test/forces");
        let mut distribution = Distribution::new(0.5);
        for index in 0..500 {
            let mut draws = stream.at(index);
            let wrench =
                Vector6::from_fn(|row, _| draws.within(-80.0, 80.0) + if row == 2 { 130.0 } else { 0.0 });
            let most = [250.0, 0.0, 60.0, 250.0];
            for (force, most_n) in distribution.share(&wrench, &four(most)).iter().zip(most) {
                assert!(force.xy().norm() <= 0.5 * force.z + 1e-9, "{force:?}");
                assert!((0.0..=most_n).contains(&force.z), "{force:?}");
            }
        }
    }

    #[test]
    fn the_projection_is_the_nearest_point_of_the_cone() {
        let distribution = Distribution::new(0.5);
        let stream = Seed(5).stream("test/cone");
        for index in 0..200 {
            let mut draws = stream.at(index);
            let force = Vector3::from_fn(|_, _| draws.within(-100.0, 100.0));
            let nearest = distribution.in_cone(&force, 60.0);
            let best = (nearest - force).norm();
            for _ in 0..200 {
                let up = draws.within(0.0, 60.0);
                let (aside, bearing) = (0.5 * up * draws.unit(), draws.within(0.0, std::f64::consts::TAU));
                let other = Vector3::new(aside * bearing.cos(), aside * bearing.sin(), up);
                assert!((other - force).norm() >= best - 1e-9);
            }
        }
    }

    #[test]
    fn a_wrench_that_two_feet_can_give_is_given() {
        // Made from forces inside the cones of one diagonal; the ridge leaves a small part out.
        let footings = four([250.0, 0.0, 0.0, 250.0]);
        let given = [Vector3::new(5.0, -3.0, 70.0), Vector3::new(2.0, 4.0, 55.0)];
        let mut wrench = Vector6::zeros();
        for (foot, force) in [0, 3].into_iter().zip(given) {
            let turn = footings[foot].arm.cross(&force);
            wrench += Vector6::new(force.x, force.y, force.z, turn.x, turn.y, turn.z);
        }
        // What the feet squeeze along their line is theirs to choose: only the sum is asked for.
        let mut left = wrench;
        for (footing, force) in footings.iter().zip(settled(wrench, &footings, 0.5)) {
            let turn = footing.arm.cross(&force);
            left -= Vector6::new(force.x, force.y, force.z, turn.x, turn.y, turn.z);
        }
        assert!(left.norm() < 0.1, "{left:?}");
    }
}
