//! The balancing walk's settings, each default with its source.

use crate::setting::{SettingError, within};
use serde::{Deserialize, Serialize};

/// How a legged body is balanced, pushed and disturbed when physics moves it.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct WalkSettings {
    /// Stiffness of the trunk's place over the ground, 1/s2.
    pub place_stiffness_per_s2: f64,
    /// Damping of the trunk's speed over the ground, 1/s.
    pub place_damping_per_s: f64,
    /// Stiffness of the trunk's height, 1/s2.
    pub height_stiffness_per_s2: f64,
    /// Damping of the trunk's height, 1/s.
    pub height_damping_per_s: f64,
    /// Stiffness of the trunk's attitude, 1/s2.
    pub attitude_stiffness_per_s2: f64,
    /// Damping of the trunk's attitude, 1/s.
    pub attitude_damping_per_s: f64,
    /// How far a step is put ahead per excess of speed, seconds.
    pub step_gain_s: f64,
    /// Natural frequency with which a swinging foot follows its path, rad/s.
    pub swing_radps: f64,
    /// Height of a swinging foot's arc above the higher of its footholds, meters.
    pub swing_height_m: f64,
    /// Speed with which a foot is lowered onto the ground at a walk of 0.5 m/s, m/s; it grows with the walk's speed.
    pub touchdown_mps: f64,
    /// Time over which a foot takes up its load and gives it back, seconds.
    pub load_ramp_s: f64,
    /// Friction that the controller counts on.
    pub friction_believed: f64,
    /// Friction between feet and ground.
    pub friction: f64,
    /// Force from which a foot counts as standing, N.
    pub contact_n: f64,
    /// From a measurement until the torque that answers it, seconds; a whole number of ticks is used.
    pub delay_s: f64,
    /// Standard deviation of each motor's constant torque error over runs, as a share of the torque.
    pub torque_error_ratio: f64,
    /// Standard deviation of each reading of a joint's angle, radians.
    pub joint_noise_rad: f64,
    /// Standard deviation of each reading of a joint's speed, rad/s.
    pub joint_rate_noise_radps: f64,
    /// Standard deviation of the believed velocity at each tick, m/s; the belief is exact at zero.
    pub velocity_noise_mps: f64,
    /// Standard deviation over runs of the constant error of the believed roll and pitch, degrees.
    pub tilt_error_deg: f64,
    /// Luggage on the trunk's back beside the lidar and its bracket, kg; the controller knows of it.
    pub luggage_kg: f64,
    /// Speed that a push gives to the trunk, m/s.
    pub push_mps: f64,
    /// Time between pushes, seconds.
    pub push_every_s: f64,
    /// Solver substeps in a tick.
    pub substeps: u32,
    /// Tilt of the trunk at which the robot has fallen, degrees.
    pub fallen_deg: f64,
}

impl Default for WalkSettings {
    fn default() -> Self {
        WalkSettings {
            place_stiffness_per_s2: 20.0,     // tuned: a meter of walk without offset
            place_damping_per_s: 8.0,         // unitree_guide kd_pos: 10
            height_stiffness_per_s2: 100.0,   // unitree_guide kp_pos: 70
            height_damping_per_s: 18.0,       // tuned: nearly critical
            attitude_stiffness_per_s2: 250.0, // tuned; unitree_guide kp_rot: 780
            attitude_damping_per_s: 28.0,     // tuned: nearly critical; unitree_guide kd_rot: 70
            step_gain_s: 0.08,                // tuned: half of sqrt(height / g), the capture point's
            swing_radps: 60.0,                // physics study
            swing_height_m: 0.065, // tuned: 5 cm bumps pass; the maker's default of 0.08 costs more power
            touchdown_mps: 0.45, // tuned: every band of shaking inside its bar; physics study: 0.2-0.6 m/s at the foot
            load_ramp_s: 0.02,   // tuned: the time in which both diagonals stand
            friction_believed: 0.5, // a margin below the friction
            friction: 0.6,       // go1.urdf, mjlab
            contact_n: 8.0,      // assumed: above a foot sensor's noise
            delay_s: 0.0,
            torque_error_ratio: 0.03, // physics study
            joint_noise_rad: 0.0,
            joint_rate_noise_radps: 0.0,
            velocity_noise_mps: 0.0,
            tilt_error_deg: 0.0,
            luggage_kg: 0.0,
            push_mps: 0.0,     // physics study: 0.15
            push_every_s: 7.0, // physics study
            substeps: 1,       // physics study: 4 change shaking below 100 Hz by 3 %
            fallen_deg: 60.0,  // assumed: no trot comes back from there
        }
    }
}

impl WalkSettings {
    /// Whether every value is finite and in its range; the first that is not otherwise.
    pub fn check(&self) -> Result<(), SettingError> {
        within("place_stiffness_per_s2", self.place_stiffness_per_s2, 0.0, 1e3)?;
        within("place_damping_per_s", self.place_damping_per_s, 0.0, 200.0)?;
        within("height_stiffness_per_s2", self.height_stiffness_per_s2, 0.0, 1e4)?;
        within("height_damping_per_s", self.height_damping_per_s, 0.0, 500.0)?;
        within("attitude_stiffness_per_s2", self.attitude_stiffness_per_s2, 0.0, 1e4)?;
        within("attitude_damping_per_s", self.attitude_damping_per_s, 0.0, 500.0)?;
        within("step_gain_s", self.step_gain_s, 0.0, 1.0)?;
        within("swing_radps", self.swing_radps, 1.0, 300.0)?;
        within("swing_height_m", self.swing_height_m, 0.0, 0.2)?;
        within("touchdown_mps", self.touchdown_mps, 0.0, 2.0)?;
        within("load_ramp_s", self.load_ramp_s, 0.001, 0.2)?;
        within("friction_believed", self.friction_believed, 0.05, 2.0)?;
        within("friction", self.friction, 0.0, 2.0)?;
        within("contact_n", self.contact_n, 0.1, 100.0)?;
        within("delay_s", self.delay_s, 0.0, 0.1)?;
        within("torque_error_ratio", self.torque_error_ratio, 0.0, 0.5)?;
        within("joint_noise_rad", self.joint_noise_rad, 0.0, 0.1)?;
        within("joint_rate_noise_radps", self.joint_rate_noise_radps, 0.0, 5.0)?;
        within("velocity_noise_mps", self.velocity_noise_mps, 0.0, 1.0)?;
        within("tilt_error_deg", self.tilt_error_deg, 0.0, 20.0)?;
        // Four times the robot: what it cannot carry it is to fall under, not to be spared.
        within("luggage_kg", self.luggage_kg, 0.0, 50.0)?;
        within("push_mps", self.push_mps, 0.0, 5.0)?;
        within("push_every_s", self.push_every_s, 0.1, 1e4)?;
        within("substeps", f64::from(self.substeps), 1.0, 16.0)?;
        within("fallen_deg", self.fallen_deg, 10.0, 170.0)
    }
}
