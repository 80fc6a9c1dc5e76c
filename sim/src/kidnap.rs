//! Somebody carries the robot off: lifted at one instant and put down elsewhere, as it was.

use crate::scenario::{Wrong, within};
use arborloop_base::{Pose2, Span, Time, pose2};
use serde::{Deserialize, Serialize};

/// One time that the robot is carried off.
///
/// It takes no time. The body goes on from the new place with its joints, its velocity and its controller as they were,
/// seen from itself, and stands on the ground that is there; truth jumps by exactly this much, seen from above. The inertial
/// sensor and the odometry of legs or wheels feel nothing of it, but for another slope under the feet. A carry that lasts and
/// blinds the lidar is this and a `blackout` around it. Nobody looks where the robot is put: what stands there is touched.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KidnapSpec {
    /// When, counted from the beginning of the run, seconds: the robot is still in its old place then, and in the new one at
    /// the end of the tick that begins then. So a sweep that ends at this instant knows nothing of it, nor does its truth.
    pub at_s: f64,
    /// How far forward and to the left, as the base sees it, meters.
    #[serde(default)]
    pub by_m: [f64; 2],
    /// How far it is turned on the way, counter-clockwise, degrees.
    #[serde(default)]
    pub turned_deg: f64,
}

impl KidnapSpec {
    /// When.
    pub fn at(&self) -> Time {
        Time::SIMULATION_START + Span::from_seconds(self.at_s)
    }

    /// The base after, seen from the base before.
    pub fn by(&self) -> Pose2 {
        pose2(self.by_m[0], self.by_m[1], self.turned_deg.to_radians())
    }

    /// `number` is its place in the scenario.
    pub(crate) fn check(&self, number: usize) -> Result<(), Wrong> {
        let at = |key: &str| format!("kidnap[{number}].{key}");
        within(&at("at_s"), self.at_s, 0.0, 1e6)?;
        self.by_m.iter().try_for_each(|by_m| within(&at("by_m"), *by_m, -1e3, 1e3))?;
        within(&at("turned_deg"), self.turned_deg, -360.0, 360.0)
    }
}
