//! `icp2d`: the naive floor. Point-to-line ICP of a sweep's slices on a map of points, from a constant-velocity guess.
//!
//! Slices are those of `mhd`; nothing else is: no search, no trimming, no robust weights, no velocity within the sweep, no
//! taking back of what was drawn.

mod points;
pub(crate) mod settings;

use crate::mhd::{FrontEnd, View};
use crate::rig::Rig;
use arborloop_base::{Estimate, Health, Observation, Pose2, Slam, Sweep, Time, pose2, spatial};
use nalgebra::{Matrix3, Point2, Vector3};
use points::Points;
use settings::Icp2dSettings;

/// Fewer pairs determine no pose.
const PAIRS_MIN: usize = 8;
/// The map takes in all of the first sweeps.
const FIRST_SWEEPS: usize = 5;
/// A step shorter than this (meters and radians together) ends a match.
const STEP_MIN: f64 = 1e-5;
/// A longer one comes from pairs that determine nothing.
const STEP_MAX: f64 = 2.0;
/// After so many sweeps in a row without enough pairs the pose must not be used.
const LOST_AFTER: usize = 10;

/// The system; see the module.
pub(crate) struct Icp2d {
    settings: Icp2dSettings,
    front_end: FrontEnd,
    view: View,
    points: Points,
    /// The instant and pose of the last sweep's middle, and the motion since the one before.
    last: Option<(Time, Pose2)>,
    motion: Pose2,
    drawn: Pose2,
    sweeps_drawn: usize,
    failures: usize,
}

impl Icp2d {
    /// A system that has seen nothing; the settings are checked.
    pub(crate) fn new(settings: Icp2dSettings, rig: &Rig) -> Self {
        Icp2d {
            settings,
            front_end: FrontEnd::new(rig),
            view: View::default(),
            points: Points::default(),
            last: None,
            motion: Pose2::identity(),
            drawn: Pose2::identity(),
            sweeps_drawn: 0,
            failures: 0,
        }
    }

    fn sweep(&mut self, sweep: &Sweep) -> Estimate {
        let before = self.last.map_or_else(Pose2::identity, |(_, pose)| pose);
        self.front_end.look(sweep, before.rotation.angle(), &mut self.view);
        let mut pose = before * self.motion;
        let pairs = if self.points.is_empty() { 0 } else { self.align(&mut pose) };
        let is_first = self.sweeps_drawn == 0;
        let determined = pairs >= PAIRS_MIN;
        if is_first || !determined {
            pose = before;
        }
        self.motion = before.inverse() * pose;
        self.motion.rotation.renormalize();
        self.failures = if determined || (is_first && self.enough()) { 0 } else { self.failures + 1 };
        if self.enough() && (is_first || determined) && self.is_due(&pose) {
            self.draw(&pose);
        }
        let end_from_middle = self.since_middle(sweep);
        self.last = Some((sweep.end, pose));
        let health = match self.failures {
            0 => Health::Tracking,
            LOST_AFTER.. => Health::Lost,
            _ => Health::Degraded,
        };
        let map_from_base = spatial(&(pose * end_from_middle));
        Estimate { stamp: sweep.end, map_from_base, covariance: None, health }
    }

    fn enough(&self) -> bool {
        self.view.features.len() >= PAIRS_MIN
    }

    /// Gauss-Newton on the distances from lines, neighbors found anew in every step; how many pairs the last step had.
    fn align(&self, pose: &mut Pose2) -> usize {
        let mut pairs = 0;
        for _ in 0..self.settings.steps_max {
            let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
            pairs = 0;
            for feature in &self.view.features {
                let place = (*pose * Point2::from(feature.at)).coords;
                let Some((on, across)) = self.points.line(feature.layer, &place, self.settings.reach_m)
                else {
                    continue;
                };
                let arm = place - pose.translation.vector;
                let row = Vector3::new(across.x, across.y, across.y * arm.x - across.x * arm.y);
                normal += row * row.transpose();
                right -= row * across.dot(&(place - on));
                pairs += 1;
            }
            for axis in 0..3 {
                normal[(axis, axis)] += 1e-6;
            }
            let Some(step) = normal.cholesky().map(|normal| normal.solve(&right)) else { break };
            if pairs < PAIRS_MIN || !step.iter().all(|n| n.is_finite()) || step.norm() > STEP_MAX {
                return 0;
            }
            let (place, heading) = (pose.translation.vector + step.xy(), pose.rotation.angle() + step.z);
            *pose = pose2(place.x, place.y, heading);
            if step.norm() < STEP_MIN {
                break;
            }
        }
        pairs
    }

    fn is_due(&self, pose: &Pose2) -> bool {
        let way = self.drawn.inverse() * pose;
        self.sweeps_drawn < FIRST_SWEEPS
            || way.translation.vector.norm() >= self.settings.key_step_m
            || way.rotation.angle().abs() >= self.settings.key_turn_rad
    }

    fn draw(&mut self, pose: &Pose2) {
        let placed = self.view.features.iter().map(|feature| {
            let place = (pose * Point2::from(feature.at)).coords;
            (feature.layer, place)
        });
        self.points.add(placed, self.settings.cell_m);
        self.drawn = *pose;
        self.sweeps_drawn += 1;
    }

    /// The motion from the sweep's middle, to which points that are taken as met at once belong, to its end.
    fn since_middle(&self, sweep: &Sweep) -> Pose2 {
        let elapsed_s = self.last.map_or(0.0, |(end, _)| (sweep.end - end).seconds());
        let half_s = 0.5 * (sweep.end - sweep.start).seconds();
        if elapsed_s <= 0.0 || half_s <= 0.0 {
            return Pose2::identity();
        }
        let share = (half_s / elapsed_s).min(1.0);
        let way = self.motion.translation.vector * share;
        pose2(way.x, way.y, self.motion.rotation.angle() * share)
    }
}

impl Slam for Icp2d {
    fn observe(&mut self, observation: &Observation) -> Option<Estimate> {
        match observation {
            Observation::Sweep(sweep) => Some(self.sweep(sweep)),
            _ => None,
        }
    }
}
