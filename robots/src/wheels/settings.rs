//! How a robot on wheels is driven and what it rolls on, each default with its source.

use crate::setting::{SettingError, within};
use serde::{Deserialize, Serialize};

/// Settings of a robot on wheels.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct WheelSettings {
    /// Greatest forward (and backward) speed, m/s; the wheels' motors may end it earlier.
    pub speed_mps_max: f64,
    /// Greatest turn rate, rad/s.
    pub turn_radps_max: f64,
    /// Greatest change of the forward speed, m/s2.
    pub acceleration_mps2_max: f64,
    /// Greatest change of the turn rate, rad/s2.
    pub turn_acceleration_radps2_max: f64,
    /// The track that a skid-steered robot is driven by and tells its turn by, as multiple of the true one: its wheels
    /// skid sideways in a turn, and those that skid push less.
    pub track_ratio: f64,
    /// Friction between wheels and ground.
    pub friction: f64,
    /// How far a tread gives along the ground before it slides, meters.
    pub tread_give_m: f64,
    /// Resistance of the ground to rolling, as a share of the weight.
    pub rolling_resistance_ratio: f64,
    /// How far a tire gives under its share of the robot, meters.
    pub tire_give_m: f64,
    /// Damping of a tire, as a share of the critical damping.
    pub tire_damping_ratio: f64,
    /// Frequency with which a wheel's speed follows its command, hertz.
    pub servo_hz: f64,
    /// Standard deviation over runs of the believed radius of all wheels, as a share of it.
    pub radius_error_ratio: f64,
    /// Solver substeps in a tick.
    pub substeps: u32,
    /// Tilt of the body at which the robot has tipped over, degrees.
    pub fallen_deg: f64,
}

impl Default for WheelSettings {
    fn default() -> Self {
        WheelSettings {
            speed_mps_max: 2.0,                // jackal control.yaml
            turn_radps_max: 1.5,               // assumed; jackal control.yaml allows 4
            acceleration_mps2_max: 1.0,        // assumed: gentle on plants; jackal control.yaml allows 20
            turn_acceleration_radps2_max: 3.0, // assumed: half a second to the greatest turn rate
            track_ratio: 1.5,                  // jackal control.yaml: wheel_separation_multiplier
            friction: 0.6,                     // as the Go1's feet; jackal.urdf.xacro: 0.5
            tread_give_m: 0.005,               // assumed: rubber blocks on grass
            rolling_resistance_ratio: 0.05,    // assumed: short grass on firm soil
            tire_give_m: 0.003,                // assumed: pneumatic tires at low pressure
            tire_damping_ratio: 0.2,           // assumed
            servo_hz: 6.0,                     // assumed
            radius_error_ratio: 0.01,          // assumed: a tire's pressure
            substeps: 1,
            fallen_deg: 60.0, // assumed: no wheels are on the ground by then
        }
    }
}

impl WheelSettings {
    /// Whether every value is finite and in its range; the first that is not otherwise.
    pub fn check(&self) -> Result<(), SettingError> {
        within("speed_mps_max", self.speed_mps_max, 0.0, 10.0)?;
        within("turn_radps_max", self.turn_radps_max, 0.0, 10.0)?;
        within("acceleration_mps2_max", self.acceleration_mps2_max, 0.01, 50.0)?;
        within("turn_acceleration_radps2_max", self.turn_acceleration_radps2_max, 0.01, 200.0)?;
        within("track_ratio", self.track_ratio, 0.5, 5.0)?;
        within("friction", self.friction, 0.0, 2.0)?;
        within("tread_give_m", self.tread_give_m, 0.001, 0.1)?;
        within("rolling_resistance_ratio", self.rolling_resistance_ratio, 0.0, 0.5)?;
        within("tire_give_m", self.tire_give_m, 0.001, 0.05)?;
        within("tire_damping_ratio", self.tire_damping_ratio, 0.05, 20.0)?;
        within("servo_hz", self.servo_hz, 0.5, 20.0)?;
        within("radius_error_ratio", self.radius_error_ratio, 0.0, 0.2)?;
        within("substeps", f64::from(self.substeps), 1.0, 16.0)?;
        within("fallen_deg", self.fallen_deg, 10.0, 170.0)
    }
}
