//! `mhd`: our lidar SLAM for orchards. One method for the sixteen rings of a walking robot and for planar recordings.
//!
//! Upright, compact things are seen from above in layers of height; an exhaustive k-best search finds the pose, and
//! Gauss-Newton on a distance field finer than its cells refines it together with the velocity within the sweep. Where a long
//! way meets its own places again, a pose graph says where they all are.

mod bins;
mod chart;
mod compact;
mod features;
mod field;
mod foresight;
mod front;
mod graph;
mod ground;
mod hits;
mod layers;
mod meeting;
mod motion;
mod path;
mod places;
mod plumb;
mod refine;
mod round;
mod search;
pub(crate) mod settings;
mod skew;
mod uncertainty;
mod upright;

use crate::rig::Rig;
use arborloop_base::{
    Cell, Estimate, Grid, Health, Observation, Slam, Sweep, Time, Trajectory, pose2, spatial,
};
use chart::{Chart, Rules};
use features::Feature;
pub(crate) use features::View;
use field::Field;
use foresight::Foresight;
pub(crate) use front::FrontEnd;
use motion::Motion;
use nalgebra::Vector3;
use path::Path;
use places::Places;
use refine::{Match, Refine};
use search::{Lattice, Search};
use settings::MhdSettings;

/// Fewer points than this determine no pose.
const POINTS_MIN: usize = 8;
/// So many points choose between hypotheses; all of them refine the one that is chosen.
const POINTS_TO_CHOOSE: usize = 600;
/// The map takes in all of the first sweeps.
const FIRST_SWEEPS: usize = 5;
/// Who has not left the place where he began by more than this stands there still, meters and radians.
const STANDING_M: f64 = 0.02;
const STANDING_RAD: f64 = 0.005;
/// A far pose must match better than the near one by this, meters.
const MARGIN_M: f64 = 0.02;
/// After so many refused matches in a row the best is believed: the surroundings have changed, not the pose.
const REFUSALS_MAX: usize = 3;
/// How far from the prediction the wide search looks: at once, more per second without a match, and at most, meters.
const ASTRAY_M_MIN: f64 = 1.0;
const ASTRAY_MPS: f64 = 0.5;
/// And more with every refused match: who is not found where he may have walked to was carried off, meters.
const ASTRAY_M_REFUSED: f64 = 2.0;
const ASTRAY_M_MAX: f64 = 5.0;
/// How many times as poor as usual the match of a torn sweep is at the least, and the share by which a match tells what is
/// usual: two seconds. Ordinary walks stay below 2, torn sweeps came out at 4 and 8.
const UNUSUAL: f64 = 2.5;
const USUAL_SHARE: f64 = 0.05;
/// After so many sweeps in a row without a match the pose must not be used.
const LOST_AFTER: usize = 10;

/// The system; see the module.
pub(crate) struct Mhd {
    settings: MhdSettings,
    front_end: FrontEnd,
    view: View,
    /// Every n-th feature of the view.
    thinned: Vec<Feature>,
    chart: Chart,
    field: Field,
    keep_ratio: f64,
    far_m: f64,
    search: Search,
    refine: Refine,
    foresight: Foresight,
    places: Places,
    path: Path,
    motion: Option<Motion>,
    drawn: Option<Motion>,
    /// From where the last sweep is still to be drawn.
    to_draw: Option<Motion>,
    sweeps_drawn: usize,
    /// Whether the robot still stands where it began.
    stands: bool,
    is_planar: bool,
    failures: usize,
    refusals: usize,
    /// When the last match was good.
    seen: Option<Time>,
    /// The k-best mean of a usual match of late, meters.
    usual_m: Option<f64>,
}

impl Mhd {
    /// A system that has seen nothing; the settings are checked.
    pub(crate) fn new(settings: MhdSettings, rig: &Rig) -> Self {
        let chart = Chart::new(settings.cell_m, settings.layers(), Rules::OF_RINGS);
        let field = Field::new(settings.cell_m, settings.distance_m_max, settings.layers());
        let (keep_ratio, far_m) = (settings.keep_ratio, settings.far_m);
        Mhd {
            front_end: FrontEnd::with(settings.clone(), rig),
            settings,
            view: View::default(),
            thinned: Vec::new(),
            chart,
            field,
            keep_ratio,
            far_m,
            search: Search::default(),
            refine: Refine::default(),
            foresight: Foresight::default(),
            places: Places::default(),
            path: Path::default(),
            motion: None,
            drawn: None,
            to_draw: None,
            sweeps_drawn: 0,
            stands: true,
            is_planar: false,
            failures: 0,
            refusals: 0,
            seen: None,
            usual_m: None,
        }
    }

    fn sweep(&mut self, sweep: &Sweep) -> Estimate {
        self.settle();
        let heading_rad = self.motion.map_or(0.0, |motion| motion.predict(sweep.end).pose.z);
        self.front_end.look(sweep, heading_rad, &mut self.view);
        let duration_s = (sweep.end - sweep.start).seconds().max(0.0);
        let middle = sweep.start + (sweep.end - sweep.start) / 2;
        let stamp = if duration_s > 0.0 { middle } else { sweep.end };
        let enough = self.view.features.len() >= POINTS_MIN;
        let Some(before) = self.motion else {
            if sweep.rings <= 1 {
                self.begin_planar();
            }
            let motion = Motion { stamp, pose: Vector3::zeros(), velocity: Vector3::zeros() };
            self.motion = Some(motion);
            if enough {
                self.draw(&motion);
            }
            let health = if enough { Health::Tracking } else { Health::Degraded };
            return self.answer(sweep.end, &motion, None, health);
        };
        let predicted = before.predict(stamp);
        if !enough || self.sweeps_drawn == 0 {
            (self.failures, self.refusals) = (self.failures + 1, 0);
            self.motion = Some(predicted);
            if enough {
                self.draw(&predicted);
            }
            return self.answer(sweep.end, &predicted, None, self.health());
        }
        self.thinned.clear();
        // A lone ring has no neighbors to spare.
        let points_max = if sweep.rings > 1 { POINTS_TO_CHOOSE } else { usize::MAX };
        let stride = self.view.features.len().div_ceil(points_max).max(1);
        self.thinned.extend(self.view.features.iter().step_by(stride));
        let mut found = self.locate(&before, &predicted, duration_s);
        let failed = found.half_m > self.settings.failed_match_m;
        if failed {
            (self.failures, self.refusals) = (self.failures + 1, self.refusals + 1);
        } else {
            (self.failures, self.refusals, self.seen) = (0, 0, Some(stamp));
        }
        let mut health = self.health();
        if health == Health::Tracking && self.is_torn(&found) {
            health = Health::Degraded;
        }
        if failed && self.refusals < REFUSALS_MAX {
            self.motion = Some(predicted);
            return self.answer(sweep.end, &predicted, None, health);
        }
        if !failed {
            self.refine.skew.learn(&before, &found.motion, duration_s);
        }
        self.refine.skew.take_off(&mut found.motion, duration_s);
        self.motion = Some(found.motion);
        self.foresight.learn(&found.motion);
        // Who is lost must not draw: the map is what the way back is found by.
        if health != Health::Lost {
            self.draw_if_due(&found.motion);
        }
        self.answer(sweep.end, &found.motion, Some(&found), health)
    }

    /// Whether a match that is good enough is far from what is usual here: half of the sweep may be seen from elsewhere. Learns
    /// what is usual.
    fn is_torn(&mut self, found: &Match) -> bool {
        let usual_m = *self.usual_m.get_or_insert(found.cost_m);
        let limit_m = UNUSUAL * usual_m;
        self.usual_m = Some(usual_m + USUAL_SHARE * (found.cost_m.min(limit_m) - usual_m));
        found.cost_m > self.settings.poor_match_m && found.cost_m > limit_m
    }

    /// By the sweeps in a row without a good match.
    fn health(&self) -> Health {
        match self.failures {
            0 => Health::Tracking,
            LOST_AFTER.. => Health::Lost,
            _ => Health::Degraded,
        }
    }

    /// Lays out an empty map for planar sweeps.
    fn begin_planar(&mut self) {
        self.is_planar = true;
        let settings = &self.settings;
        self.chart = Chart::new(settings.planar_cell_m, settings.layers(), Rules::OF_PLANAR);
        self.field = Field::new(settings.planar_cell_m, settings.planar_distance_m_max, settings.layers());
        self.keep_ratio = settings.planar_keep_ratio;
        self.far_m = f64::INFINITY;
    }

    /// The best match around the prediction, or anywhere near it when that is poor or the pause was long.
    fn locate(&mut self, before: &Motion, predicted: &Motion, duration_s: f64) -> Match {
        let elapsed_s = (predicted.stamp - before.stamp).seconds().max(0.0);
        let near = Lattice {
            reach_m: (0.2 + 0.5 * elapsed_s).min(0.7),
            reach_rad: (0.05 + 0.4 * elapsed_s).min(0.45),
            step_m: (0.07 + 0.1 * elapsed_s).min(0.2),
            step_rad: (0.02 + 0.02 * elapsed_s).min(0.05),
            prior_m: 0.02,
        };
        let mut best = self.best_of(before, predicted, &near, duration_s, 3);
        // Who is found outside of the lattice has not walked there.
        let strayed = (best.motion.pose - predicted.pose).xy().norm() > near.reach_m;
        if strayed || best.cost_m > self.settings.poor_match_m || elapsed_s > self.settings.pause_s {
            let wide = Lattice {
                reach_m: self.astray_m(predicted.stamp),
                reach_rad: std::f64::consts::PI,
                step_m: 0.2,
                step_rad: 0.05,
                prior_m: 0.0,
            };
            let other = self.best_of(before, predicted, &wide, duration_s, 6);
            // A false turn spoils all that follows: a far pose must be clearly better than the near one.
            if other.cost_m < best.cost_m - MARGIN_M {
                best = other;
            }
        }
        if duration_s <= 0.0 && elapsed_s > 0.0 {
            best.motion.velocity = (best.motion.pose - before.pose) / elapsed_s;
            // A turn between two scans says little of the turn to the next.
            best.motion.velocity.z *= 0.5;
        }
        best.motion = best.motion.sane();
        best
    }

    /// How far from the prediction the robot may be: it walks on while its system is blind, and is not always let walk.
    fn astray_m(&self, stamp: Time) -> f64 {
        let blind_s = match self.seen {
            Some(seen) if self.failures > 0 => (stamp - seen).seconds(),
            _ => 0.0,
        };
        let refused_m = ASTRAY_M_REFUSED * self.refusals as f64;
        (ASTRAY_M_MIN + ASTRAY_MPS * blind_s + refused_m).clamp(ASTRAY_M_MIN, ASTRAY_M_MAX)
    }

    fn best_of(
        &mut self,
        before: &Motion,
        predicted: &Motion,
        lattice: &Lattice,
        duration_s: f64,
        wanted: usize,
    ) -> Match {
        let (features, keep) = (&self.thinned, self.keep_ratio);
        let hypotheses = self.search.run(&self.field, features, predicted, lattice, keep, wanted);
        let refine = &mut self.refine;
        refine.far_m = self.far_m;
        let mut best = refine.run(&self.field, features, *predicted, before, duration_s, keep);
        let mut tied = *before;
        let promising_m = hypotheses.first().map_or(0.0, |first| first.cost_m + MARGIN_M);
        for hypothesis in hypotheses {
            // What is clearly worse before any descent is left out, but not after a long way between two scans.
            if duration_s > 0.0 && hypothesis.cost_m > promising_m {
                continue;
            }
            let start = Motion { pose: hypothesis.pose, ..*predicted };
            // Who was carried off or lost his way has not walked there: only a near pose is tied to the motion before.
            let (start, before) = if lattice.prior_m > 0.0 {
                (start, *before)
            } else {
                (predicted.carried(predicted, &start), before.carried(predicted, &start))
            };
            let found = refine.run(&self.field, features, start, &before, duration_s, keep);
            if found.cost_m < best.cost_m {
                (best, tied) = (found, before);
            }
        }
        if features.len() < self.view.features.len() {
            best = refine.run(&self.field, &self.view.features, best.motion, &tied, duration_s, keep);
        }
        best
    }

    fn draw_if_due(&mut self, motion: &Motion) {
        let due = match &self.drawn {
            None => true,
            Some(drawn) => {
                let way = motion.pose - drawn.pose;
                way.xy().norm() >= self.settings.key_step_m || way.z.abs() >= self.settings.key_turn_rad
            }
        };
        let stays = motion.pose.xy().norm() < STANDING_M && motion.pose.z.abs() < STANDING_RAD;
        self.stands &= stays;
        if self.stands {
            let standing = Motion { stamp: motion.stamp, pose: Vector3::zeros(), velocity: Vector3::zeros() };
            self.draw(&standing);
        } else if due || self.sweeps_drawn < FIRST_SWEEPS {
            self.draw(motion);
        }
    }

    /// The sweep is drawn when the system settles: the answer does not need it.
    fn draw(&mut self, motion: &Motion) {
        self.to_draw = Some(*motion);
        self.drawn = Some(*motion);
        self.sweeps_drawn += 1;
    }

    /// The estimate at the sweep's end: half a sweep after the instant of the pose.
    fn answer(&mut self, end: Time, motion: &Motion, found: Option<&Match>, health: Health) -> Estimate {
        self.path.push(end, motion, self.places.last());
        let after_s = (end - motion.stamp).seconds();
        let pose = match found {
            Some(_) => self.foresight.after(motion, after_s),
            None => motion.after(after_s),
        };
        let drawn = Vector3::new(pose.translation.x, pose.translation.y, pose.rotation.angle());
        let believed = self.places.correct(&drawn);
        let astray = if self.is_planar {
            uncertainty::astray_by_distance(&believed)
        } else {
            self.places.astray(&believed)
        };
        let covariance = found.and_then(|found| uncertainty::covariance(found, after_s, &astray));
        let pose = pose2(believed.x, believed.y, believed.z);
        Estimate { stamp: end, map_from_base: spatial(&pose), covariance, health }
    }
}

impl Slam for Mhd {
    fn observe(&mut self, observation: &Observation) -> Option<Estimate> {
        match observation {
            Observation::Sweep(sweep) => Some(self.sweep(sweep)),
            _ => None,
        }
    }

    fn settle(&mut self) {
        if let Some(motion) = self.to_draw.take() {
            self.front_end.clear(&mut self.view);
            self.chart.draw(&motion, &self.view.features, &self.view.clearings, self.places.last());
            if !self.is_planar && self.places.visit(&motion, &self.view.features, &self.settings) {
                self.chart.hide(|place| self.places.has_left(place));
            }
            self.field.follow(&mut self.chart);
        }
    }

    fn trajectory(&self) -> Option<Trajectory> {
        // Planar sweeps are answered at the instant that they determine, and their places are never moved.
        (!self.is_planar).then(|| self.path.finally(&self.places)).flatten()
    }

    fn map(&self) -> Option<Grid<Cell>> {
        let [low, high] = self.settings.map_height_m;
        let edges = &self.settings.layer_edges_m;
        let from = edges.partition_point(|edge| *edge < low - 1e-9).min(self.settings.layers() - 1);
        let to = edges.partition_point(|edge| *edge < high - 1e-9).clamp(from + 1, self.settings.layers());
        self.chart.drawing(from, to, |place, at| self.places.moved(place, at))
    }
}
