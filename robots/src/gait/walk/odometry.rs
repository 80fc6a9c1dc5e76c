//! How fast a body moves over its standing feet: what joints, gyroscope and foot sensors tell of the motion.

use super::body::Body;
use crate::go1::FOOT_RADIUS_M;
use nalgebra::Vector3;

impl Body {
    /// Velocity of the base over the ground, base axes, m/s: the mean over the feet that stand, each taken to roll
    /// without slipping; `None` when none stands. Joints leg by leg (radians, rad/s), turn rate (rad/s) and the way up in
    /// the base.
    ///
    /// Wrong by as much as feet slip or land: that is the error of leg odometry.
    pub fn velocity_over_feet_mps(
        &self,
        angles_rad: &[f64; 12],
        rates_radps: &[f64; 12],
        turn_radps: &Vector3<f64>,
        up: &Vector3<f64>,
        stance: &[bool; 4],
    ) -> Option<Vector3<f64>> {
        let mut sum = Vector3::zeros();
        let mut feet = 0.0;
        for leg in (0..4).filter(|leg| stance[*leg]) {
            let state = self.legs[leg].at(std::array::from_fn(|joint| angles_rad[3 * leg + joint]));
            let rates = Vector3::from_fn(|joint, _| rates_radps[3 * leg + joint]);
            // A round foot's center moves on while it rolls: 7 % of every step of the Go1.
            let rolling = (turn_radps + state.axes * rates).cross(&(up * FOOT_RADIUS_M));
            sum += rolling - turn_radps.cross(&state.foot.coords) - state.jacobian * rates;
            feet += 1.0;
        }
        (feet > 0.0).then(|| sum / feet)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::go1;
    use nalgebra::Point3;

    #[test]
    fn a_body_that_moves_over_rolling_feet_is_told_its_velocity() {
        let body = Body::go1();
        let (velocity, turn) = (Vector3::new(0.4, -0.1, 0.05), Vector3::new(0.2, -0.3, 0.5));
        let feet: [Point3<f64>; 4] = std::array::from_fn(|leg| go1::foot(leg, go1::STANDING_RAD));
        let up = Vector3::z();
        // The foot's lowest point stands still: its joints follow by the Jacobian of that point.
        let mut rates = [0.0; 12];
        for leg in 0..4 {
            let lowest = feet[leg].coords - up * FOOT_RADIUS_M;
            let against = -(velocity + turn.cross(&lowest));
            let state = body.legs[leg].at(go1::STANDING_RAD);
            let jacobian = state.jacobian - (up * FOOT_RADIUS_M).cross_matrix().transpose() * state.axes;
            let joints = jacobian.try_inverse().unwrap() * against;
            rates[3 * leg..3 * leg + 3].copy_from_slice(joints.as_slice());
        }
        let angles = std::array::from_fn(|joint| go1::STANDING_RAD[joint % 3]);
        let told = |stance| body.velocity_over_feet_mps(&angles, &rates, &turn, &up, &stance);
        assert!((told([true, false, false, true]).unwrap() - velocity).norm() < 1e-12);
        assert_eq!(told([false; 4]), None);
    }
}
