//! The trot's settings, each default with its source.

use super::WalkSettings;
use crate::setting::{SettingError, within};
use serde::{Deserialize, Serialize};

/// What moves the robot.
#[derive(Serialize, Deserialize, Debug, Clone, Copy, PartialEq, Eq, Default)]
#[serde(rename_all = "kebab-case")]
pub enum GaitMode {
    /// A trot by kinematics: exact and fast, no forces.
    #[default]
    Kinematic,
    /// Torques and contacts in the physics engine, kept upright by a controller.
    Physics,
    /// The kinematic trot's path with strides of the physics gait, replayed from a library.
    Strides,
    /// The kinematic trot's path without any shaking, as on wheels: the control experiment.
    Smooth,
}

/// How a robot walks, and how the kinematic trot shakes. Amplitudes are those at 0.5 m/s; they follow the speed.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct TrotSettings {
    /// What moves the robot.
    pub mode: GaitMode,
    /// Time of one stride, seconds.
    pub period_s: f64,
    /// Share of the stride that a foot stands.
    pub duty_ratio: f64,
    /// Height of a swinging foot's arc, meters.
    pub swing_height_m: f64,
    /// Height of the trunk origin above the ground plane through the feet, meters.
    pub stand_height_m: f64,
    /// Greatest forward (and backward) speed, m/s.
    pub speed_mps_max: f64,
    /// Greatest turn rate, rad/s.
    pub turn_radps_max: f64,
    /// Greatest change of the forward speed, m/s2.
    pub acceleration_mps2_max: f64,
    /// Greatest change of the turn rate, rad/s2.
    pub turn_acceleration_radps2_max: f64,
    /// Time constant with which speed and turn rate follow, seconds.
    pub lag_s: f64,
    /// Standard deviation of speed and turn rate from stride to stride, as a share of what is commanded.
    pub scatter_ratio: f64,
    /// Standard deviation of the sideways drift from stride to stride at 0.5 m/s, m/s.
    pub drift_mps: f64,
    /// Standard deviation of the turning drift from stride to stride at 0.5 m/s, degrees per second.
    pub drift_degps: f64,
    /// Scales all shaking: bob, attitude, sway and impacts; 0 is a smooth ride, 1 is nominal.
    pub vibration_ratio: f64,
    /// Amplitude of the trunk's bob at twice the stride frequency, meters.
    pub bob_m: f64,
    /// Amplitude of the bob at four times the stride frequency, meters.
    pub ripple_m: f64,
    /// Amplitude of the roll at the stride frequency, degrees.
    pub roll_deg: f64,
    /// Amplitude of the pitch at twice the stride frequency, degrees.
    pub pitch_deg: f64,
    /// Amplitude of the yaw at the stride frequency, degrees.
    pub yaw_deg: f64,
    /// Amplitude of the sideways sway at the stride frequency, meters.
    pub sway_m: f64,
    /// Mean vertical speed of a foot that touches down, m/s.
    pub touchdown_mps: f64,
    /// Standard deviation of that speed from step to step, as a share of it.
    pub touchdown_scatter_ratio: f64,
    /// Mass that a touchdown stops, kg.
    pub touchdown_kg: f64,
    /// Frequency at which the trunk rings after a touchdown, hertz.
    pub impact_hz: f64,
    /// Damping ratio of that ringing.
    pub impact_damping_ratio: f64,
    /// Frequency with which the trunk follows the ground plane, hertz.
    pub suspension_hz: f64,
    /// Damping ratio of that following.
    pub suspension_damping_ratio: f64,
    /// Time constant of the low-pass on the plane through the footholds, seconds.
    pub plane_lag_s: f64,
    /// How the robot balances where physics moves it.
    pub physics: WalkSettings,
}

impl Default for TrotSettings {
    fn default() -> Self {
        TrotSettings {
            mode: GaitMode::Kinematic,
            period_s: 0.45,                    // unitree_guide State_Trotting: 2.22 Hz
            duty_ratio: 0.55,                  // physics prototype; unitree_guide 0.50
            swing_height_m: 0.08,              // Unitree HighState.footRaiseHeight
            stand_height_m: 0.28,              // Unitree HighState.bodyHeight
            speed_mps_max: 1.0,                // assumed: a brisk trot, well below the 3.7 m/s class
            turn_radps_max: 0.9,               // physics prototype's follower
            acceleration_mps2_max: 1.0,        // assumed: half a second to walking speed
            turn_acceleration_radps2_max: 4.0, // assumed: a quarter second to the greatest turn rate
            lag_s: 0.2,                        // assumed: half a stride
            scatter_ratio: 0.03,               // physics prototype: 0.50 +- 0.015 m/s on a straight line
            drift_mps: 0.01,                   // assumed: 2 % of the speed
            drift_degps: 0.6, // assumed: with the drift, the prototype's 3-4 cm beside the path
            vibration_ratio: 1.0, // nominal
            bob_m: 0.001,     // physics prototype: 1.3-6 mm peak to peak
            ripple_m: 0.0003, // physics prototype: 4f acceleration 0.7-0.8 m/s2 rms
            roll_deg: 0.42,   // physics prototype: 0.28 degrees rms on flat ground
            pitch_deg: 0.45,  // physics prototype: 0.33 degrees rms on flat ground
            yaw_deg: 0.5,     // assumed: SLAM study's 0.6 degrees at its stiffer gait
            sway_m: 0.005,    // assumed: SLAM study's 8 mm at its stiffer gait
            touchdown_mps: 0.4, // physics prototype: 0.2-0.6 m/s
            touchdown_scatter_ratio: 0.25, // assumed: covers 0.2-0.6 m/s at two deviations
            touchdown_kg: 0.5, // engineering guess of the physics study
            impact_hz: 35.0,  // engineering guess of the physics study: 30-40 Hz
            impact_damping_ratio: 0.2, // engineering guess of the physics study
            suspension_hz: 4.0, // engineering guess of the physics study
            suspension_damping_ratio: 0.6, // engineering guess of the physics study
            plane_lag_s: 0.25, // physics prototype's ground plane low-pass
            physics: WalkSettings::default(),
        }
    }
}

impl TrotSettings {
    /// Whether every value is finite and in its range; the first that is not otherwise.
    pub fn check(&self) -> Result<(), SettingError> {
        within("period_s", self.period_s, 0.1, 3.0)?;
        // Below one half no foot might stand; at one no foot would ever swing.
        within("duty_ratio", self.duty_ratio, 0.5, 0.9)?;
        within("swing_height_m", self.swing_height_m, 0.0, 0.2)?;
        within("stand_height_m", self.stand_height_m, 0.15, 0.38)?;
        within("speed_mps_max", self.speed_mps_max, 0.0, 3.7)?;
        within("turn_radps_max", self.turn_radps_max, 0.0, 5.0)?;
        within("acceleration_mps2_max", self.acceleration_mps2_max, 0.01, 50.0)?;
        within("turn_acceleration_radps2_max", self.turn_acceleration_radps2_max, 0.01, 200.0)?;
        within("lag_s", self.lag_s, 0.01, 5.0)?;
        within("scatter_ratio", self.scatter_ratio, 0.0, 0.5)?;
        within("drift_mps", self.drift_mps, 0.0, 0.5)?;
        within("drift_degps", self.drift_degps, 0.0, 45.0)?;
        within("vibration_ratio", self.vibration_ratio, 0.0, 10.0)?;
        within("bob_m", self.bob_m, 0.0, 0.05)?;
        within("ripple_m", self.ripple_m, 0.0, 0.05)?;
        within("roll_deg", self.roll_deg, 0.0, 10.0)?;
        within("pitch_deg", self.pitch_deg, 0.0, 10.0)?;
        within("yaw_deg", self.yaw_deg, 0.0, 10.0)?;
        within("sway_m", self.sway_m, 0.0, 0.1)?;
        within("touchdown_mps", self.touchdown_mps, 0.0, 3.0)?;
        within("touchdown_scatter_ratio", self.touchdown_scatter_ratio, 0.0, 1.0)?;
        within("touchdown_kg", self.touchdown_kg, 0.0, 5.0)?;
        within("impact_hz", self.impact_hz, 5.0, 200.0)?;
        within("impact_damping_ratio", self.impact_damping_ratio, 0.01, 0.95)?;
        within("suspension_hz", self.suspension_hz, 0.5, 20.0)?;
        within("suspension_damping_ratio", self.suspension_damping_ratio, 0.05, 0.95)?;
        within("plane_lag_s", self.plane_lag_s, 0.01, 5.0)?;
        self.physics.check().map_err(|e| SettingError { key: format!("physics.{}", e.key), ..e })
    }
}
