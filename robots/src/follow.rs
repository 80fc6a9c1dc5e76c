//! Steering along a route by pure pursuit: whose estimate of the pose it is, is the caller's business.

use crate::gait::Command;
use crate::setting::{SettingError, within};
use arborloop_base::Pose2;
use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

/// Waypoints to walk along, in the frame of the start.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Route {
    /// Corners, x and y in meters, in order.
    pub waypoints_m: Vec<[f64; 2]>,
    /// Whether the last corner leads back to the first.
    #[serde(default)]
    pub closed: bool,
    /// How often a closed route is walked; an open one is walked once whatever this says.
    #[serde(default = "once")]
    pub laps: u32,
}

fn once() -> u32 {
    1
}

/// How a route is followed.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct FollowerSettings {
    /// Walking speed, m/s.
    pub speed_mps: f64,
    /// Distance along the route from the robot to the point that it heads for, meters.
    pub look_ahead_m: f64,
    /// Turn rate per bearing of that point, 1/s.
    pub turn_gain_per_s: f64,
    /// Greatest turn rate, rad/s.
    pub turn_radps_max: f64,
    /// Bearing at which the robot turns on the spot, degrees; the speed falls linearly up to it.
    pub turn_in_place_deg: f64,
    /// How far ahead along the route the nearest point is looked for, meters.
    pub window_m: f64,
    /// Deceleration toward the end of the route, m/s2.
    pub braking_mps2: f64,
    /// Distance from the end of the route at which it is finished, meters.
    pub arrival_m: f64,
}

impl Default for FollowerSettings {
    fn default() -> Self {
        FollowerSettings {
            speed_mps: 0.5,       // physics prototype: 0.5 m/s on the rectangle
            look_ahead_m: 0.6,    // physics prototype
            turn_gain_per_s: 2.0, // physics prototype
            turn_radps_max: 0.9,  // physics prototype
            turn_in_place_deg: 0.9 * 180.0 / std::f64::consts::PI, // physics prototype: 0.9 rad
            window_m: 1.0,        // assumed: above the look-ahead, below half of the narrowest route
            braking_mps2: 0.3,    // assumed: gentle against the gait's 1 m/s2
            arrival_m: 0.03,      // assumed: below the paper's 0.08 m mean error
        }
    }
}

impl Route {
    /// Whether every number is finite and no leg is absurdly long.
    pub fn check(&self) -> Result<(), SettingError> {
        for (index, [x, y]) in self.waypoints_m.iter().enumerate() {
            within(&format!("waypoints_m[{index}].x"), *x, -1e5, 1e5)?;
            within(&format!("waypoints_m[{index}].y"), *y, -1e5, 1e5)?;
        }
        within("laps", f64::from(self.laps), 1.0, 1e5)
    }

    /// Length of all laps, meters.
    pub fn length_m(&self) -> f64 {
        self.lap_m() * f64::from(self.rounds())
    }

    fn rounds(&self) -> u32 {
        if self.closed { self.laps } else { 1 }
    }

    fn lap_m(&self) -> f64 {
        legs(self).iter().map(|leg| leg.length_m).sum()
    }
}

impl FollowerSettings {
    /// Whether every value is finite and in its range.
    pub fn check(&self) -> Result<(), SettingError> {
        within("speed_mps", self.speed_mps, 0.01, 5.0)?;
        within("look_ahead_m", self.look_ahead_m, 0.05, 20.0)?;
        within("turn_gain_per_s", self.turn_gain_per_s, 0.01, 50.0)?;
        within("turn_radps_max", self.turn_radps_max, 0.01, 10.0)?;
        within("turn_in_place_deg", self.turn_in_place_deg, 1.0, 180.0)?;
        within("window_m", self.window_m, 0.05, 20.0)?;
        within("braking_mps2", self.braking_mps2, 0.01, 50.0)?;
        within("arrival_m", self.arrival_m, 0.001, 5.0)
    }
}

/// How far along its route a robot believes to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Whole laps behind.
    pub lap: u32,
    /// Distance along the route, all laps, meters.
    pub distance_m: f64,
    /// Distance to go, meters.
    pub remaining_m: f64,
    /// Whether the end is reached; stays so.
    pub finished: bool,
}

/// Steers along one route, once.
#[derive(Debug, Clone, PartialEq)]
pub struct Follower {
    legs: Vec<Leg>,
    lap_m: f64,
    length_m: f64,
    settings: FollowerSettings,
    along_m: f64,
    finished: bool,
}

/// A straight piece of the route.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Leg {
    from: Point2<f64>,
    toward: Vector2<f64>,
    begins_m: f64,
    length_m: f64,
}

/// Slowest approach to the end, m/s: below it a legged robot would tread on the spot.
const CREEP_MPS: f64 = 0.08;
/// Distance between the places tried for the nearest point, meters.
const SEARCH_STEP_M: f64 = 0.01;

impl Follower {
    /// Stands at the beginning of a route.
    ///
    /// # Panics
    /// When the route or the settings do not pass their `check`.
    pub fn new(route: Route, settings: FollowerSettings) -> Self {
        if let Err(error) = route.check().and_then(|()| settings.check()) {
            panic!("a follower is built from a checked route and settings, but {error}");
        }
        let legs = legs(&route);
        let (lap_m, length_m) = (route.lap_m(), route.length_m());
        let finished = length_m <= settings.arrival_m;
        Follower { legs, lap_m, length_m, settings, along_m: 0.0, finished }
    }

    /// What to do at a pose in the frame of the start; nothing at the end, and nothing for a pose that is not finite.
    pub fn steer(&mut self, start_from_base: &Pose2) -> Command {
        let place = Point2::from(start_from_base.translation.vector);
        let finite = place.iter().all(|n| n.is_finite()) && start_from_base.rotation.angle().is_finite();
        if self.finished || !finite {
            return Command::default();
        }
        self.along_m = self.nearest_m(&place);
        let remaining_m = self.length_m - self.along_m;
        if remaining_m <= self.settings.arrival_m {
            self.finished = true;
            return Command::default();
        }
        let goal =
            start_from_base.inverse_transform_point(&self.point(self.along_m + self.settings.look_ahead_m));
        let bearing_rad = goal.y.atan2(goal.x);
        let most = self.settings.turn_radps_max;
        let straightness = 1.0 - bearing_rad.abs() / self.settings.turn_in_place_deg.to_radians();
        let braking_mps = (2.0 * self.settings.braking_mps2 * remaining_m).sqrt().max(CREEP_MPS);
        Command {
            forward_mps: self.settings.speed_mps.min(braking_mps) * straightness.max(0.0),
            turn_radps: (self.settings.turn_gain_per_s * bearing_rad).clamp(-most, most),
        }
    }

    /// How far along.
    pub fn progress(&self) -> Progress {
        let laps = if self.lap_m > 0.0 { (self.along_m / self.lap_m) as u32 } else { 0 };
        Progress {
            lap: laps,
            distance_m: self.along_m,
            remaining_m: if self.finished { 0.0 } else { self.length_m - self.along_m },
            finished: self.finished,
        }
    }

    /// The point of the route nearest to a place, looked for only in the window ahead: progress never goes back, never
    /// jumps to another lap and never to the other side.
    fn nearest_m(&self, place: &Point2<f64>) -> f64 {
        let end_m = (self.along_m + self.settings.window_m).min(self.length_m);
        let steps = ((end_m - self.along_m) / SEARCH_STEP_M).ceil().max(0.0) as usize;
        let mut best = (self.along_m, (self.point(self.along_m) - place).norm_squared());
        for step in 1..=steps {
            let along_m = (self.along_m + step as f64 * SEARCH_STEP_M).min(end_m);
            let distance = (self.point(along_m) - place).norm_squared();
            if distance < best.1 {
                best = (along_m, distance);
            }
        }
        best.0
    }

    /// The point at a distance along the route; beyond its end, straight on.
    fn point(&self, along_m: f64) -> Point2<f64> {
        let beyond_m = along_m - self.length_m;
        let in_lap_m = if beyond_m >= 0.0 { self.lap_m + beyond_m } else { along_m.rem_euclid(self.lap_m) };
        let index = self.legs.partition_point(|leg| leg.begins_m <= in_lap_m).saturating_sub(1);
        let leg = &self.legs[index];
        leg.from + leg.toward * (in_lap_m - leg.begins_m)
    }
}

/// The straight pieces of one lap, without those of no length.
fn legs(route: &Route) -> Vec<Leg> {
    let mut corners: Vec<Point2<f64>> = route.waypoints_m.iter().map(|[x, y]| Point2::new(*x, *y)).collect();
    if route.closed {
        corners.extend(corners.first().copied());
    }
    let mut begins_m = 0.0;
    let mut legs = Vec::new();
    for pair in corners.windows(2) {
        let step = pair[1] - pair[0];
        let length_m = step.norm();
        if length_m > 1e-9 {
            legs.push(Leg { from: pair[0], toward: step / length_m, begins_m, length_m });
            begins_m += length_m;
        }
    }
    legs
}
