//! `mhd-paper`: the paper's 2D SLAM, stage by stage, with the parameters of its authors' code.
//!
//! Left out are the code's slips (dilation by 2 x 2 cells, an index off by one, headings shrunk by 0.95), its inputs
//! made from the reference track, and its slope term, which needs those inputs. See each stage.

mod filter;
mod occupancy;
mod search;
pub(crate) mod settings;
mod slice;
mod transform;

use crate::rig::Rig;
use arborloop_base::{
    Cell, Estimate, Grid, Health, Observation, Pose2, Slam, Sweep, Time, Twist, planar, pose2, spatial,
    wrap_angle,
};
use filter::{Drive, Filter};
use nalgebra::{Matrix6, Vector2, Vector3};
use occupancy::Occupancy;
use search::Search;
use settings::MhdPaperSettings;
use slice::Slice;
use transform::Transform;

/// After so many doubted matches in a row the pose must not be used.
const LOST_AFTER: usize = 10;
/// A false match must not be taken for a speed that the robot cannot have, m/s and rad/s.
const SPEED_MPS_MAX: f64 = 2.0;
const TURN_RADPS_MAX: f64 = 2.0;
/// The match that is doubted is repeated without points farther than this from the map, meters (30 cells of 1 cm).
const OUTLIER_M: f64 = 0.3;

/// The system; see the module.
pub(crate) struct MhdPaper {
    settings: MhdPaperSettings,
    base_from_lidar: Pose2,
    slice: Slice,
    points: Vec<Vector2<f64>>,
    occupancy: Occupancy,
    transform: Transform,
    search: Search,
    filter: Filter,
    last: Option<Time>,
    step_s: Option<f64>,
    drive: Drive,
    odometry: Option<(Twist, f64)>,
    refusals: usize,
    has_map: bool,
}

impl MhdPaper {
    /// A system that has seen nothing; the settings are checked.
    pub(crate) fn new(settings: MhdPaperSettings, rig: &Rig) -> Self {
        MhdPaper {
            base_from_lidar: planar(&rig.base_from_lidar),
            slice: Slice::default(),
            points: Vec::new(),
            occupancy: Occupancy::new(&settings),
            transform: Transform::default(),
            search: Search::default(),
            filter: Filter::new(&settings),
            last: None,
            step_s: None,
            drive: Drive::default(),
            odometry: None,
            refusals: 0,
            has_map: false,
            settings,
        }
    }

    fn sweep(&mut self, sweep: &Sweep) -> Estimate {
        self.slice.cut(sweep, &self.settings);
        self.points.clear();
        self.points.extend(
            self.slice.points.iter().map(|p| (self.base_from_lidar * nalgebra::Point2::from(*p)).coords),
        );
        // The paper does not deskew: its match belongs to the middle of the sweep, and the motion model carries the
        // answer to the end.
        let middle = sweep.start + (sweep.end - sweep.start) / 2;
        let elapsed_s = self.last.map_or(0.0, |last| (middle - last).seconds().max(0.0));
        let is_first = self.last.replace(middle).is_none();
        let before = self.filter.state;
        let mut health = Health::Tracking;
        if !is_first {
            let drive = self.odometry.take().map_or(self.drive, |(twist, share)| Drive {
                forward_mps: twist.linear_mps.x / share,
                turn_radps: twist.angular_radps.z / share,
            });
            // The authors' code takes the mean step of the whole recording for every step. A live system knows the past
            // alone: a pause counts as twice the step before it at most, else the track flies on through it.
            let step_s = self.step_s.map_or(elapsed_s, |step_s| elapsed_s.min(2.0 * step_s));
            self.step_s = Some(step_s);
            self.filter.predict(&drive, step_s, &self.settings);
            health = self.correct();
            self.remember(&before, step_s);
        }
        if !self.has_map && !self.points.is_empty() {
            // The first scan is the map: M_0 = Z_0.
            self.draw();
        } else if self.points.is_empty() {
            health = Health::Degraded;
        }
        self.answer(sweep, health)
    }

    /// Matches the slice to the map and updates the filter and the map.
    fn correct(&mut self) -> Health {
        if !self.has_map || self.points.is_empty() {
            return Health::Degraded;
        }
        self.measure();
        let settings = &self.settings;
        let start = self.filter.state;
        let Some(mut found) = self.search.run(&self.transform, &self.points, start, settings) else {
            return Health::Degraded;
        };
        if self.filter.innovation(&found.pose).xy().norm() > settings.gate_m {
            let limit = (OUTLIER_M / settings.cell_m) as f32;
            let distances =
                self.search.distances(&self.transform, &self.points, &found.pose, settings.cell_m);
            let near: Vec<Vector2<f64>> =
                self.points.iter().zip(distances).filter(|(_, d)| **d <= limit).map(|(p, _)| *p).collect();
            found = self.search.run(&self.transform, &near, start, settings).unwrap_or(found);
        }
        let innovation = self.filter.innovation(&found.pose);
        self.filter.update(&found.pose, settings);
        let is_doubted = innovation.xy().norm() > settings.gate_m || innovation.z.abs() > settings.gate_rad;
        self.refusals = if is_doubted { self.refusals + 1 } else { 0 };
        if !is_doubted || self.refusals > settings.refusals_max {
            self.draw();
        }
        match self.refusals {
            0 => Health::Tracking,
            LOST_AFTER.. => Health::Lost,
            _ => Health::Degraded,
        }
    }

    /// The input of the next prediction: the increment that the filter believes, as the paper has no IMU and no odometry.
    fn remember(&mut self, before: &Vector3<f64>, elapsed_s: f64) {
        if elapsed_s > 0.0 {
            let way = self.filter.state - before;
            let (sin, cos) = before.z.sin_cos();
            self.drive = Drive {
                forward_mps: ((way.x * cos + way.y * sin) / elapsed_s).clamp(-SPEED_MPS_MAX, SPEED_MPS_MAX),
                turn_radps: (wrap_angle(way.z) / elapsed_s).clamp(-TURN_RADPS_MAX, TURN_RADPS_MAX),
            };
        }
    }

    /// The distance transform in the window that the sweep can see.
    fn measure(&mut self) {
        let (state, reach) = (self.filter.state, self.occupancy.reach());
        let margin = (1.0 / self.settings.cell_m).ceil() as i32;
        let center = self.occupancy.cell_of(state.x, state.y);
        let side = reach + margin;
        let occupancy = &self.occupancy;
        self.transform.rebuild(
            (center.0 - side, center.1 - side),
            (center.0 + side, center.1 + side),
            |cell| occupancy.is_occupied(cell),
        );
    }

    fn draw(&mut self) {
        let state = self.filter.state;
        let lidar = pose2(state.x, state.y, state.z) * self.base_from_lidar;
        let pose = Vector3::new(lidar.translation.x, lidar.translation.y, lidar.rotation.angle());
        self.occupancy.add(&pose, &self.slice, &self.settings);
        self.has_map = true;
    }

    fn answer(&self, sweep: &Sweep, health: Health) -> Estimate {
        let mut ahead = self.filter;
        let half_s = (sweep.end - sweep.start).seconds().max(0.0) / 2.0;
        ahead.predict(&self.drive, half_s, &self.settings);
        let mut covariance = Matrix6::zeros();
        for (row, i) in [0, 1, 5].into_iter().enumerate() {
            for (column, j) in [0, 1, 5].into_iter().enumerate() {
                covariance[(i, j)] = ahead.covariance[(row, column)];
            }
        }
        Estimate {
            stamp: sweep.end,
            map_from_base: spatial(&pose2(ahead.state.x, ahead.state.y, ahead.state.z)),
            covariance: Some(covariance),
            health,
        }
    }
}

impl Slam for MhdPaper {
    fn observe(&mut self, observation: &Observation) -> Option<Estimate> {
        match observation {
            Observation::Sweep(sweep) => Some(self.sweep(sweep)),
            Observation::Odometry(odometry) => {
                let twist = &odometry.twist;
                if !twist.linear_mps.iter().chain(&twist.angular_radps).all(|n| n.is_finite()) {
                    return None;
                }
                // The mean of the twists since the last sweep.
                let (sum, count) = self.odometry.unwrap_or_default();
                let sum = Twist {
                    linear_mps: sum.linear_mps + odometry.twist.linear_mps,
                    angular_radps: sum.angular_radps + odometry.twist.angular_radps,
                };
                self.odometry = Some((sum, count + 1.0));
                None
            }
            _ => None,
        }
    }

    fn map(&self) -> Option<Grid<Cell>> {
        self.occupancy.drawing()
    }
}
