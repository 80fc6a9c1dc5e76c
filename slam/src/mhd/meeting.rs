//! What is seen now, held against what was seen from old places near by: where the robot is among them.
//!
//! Seen from the other side a hedge is mostly another hedge. Only where both looks met the same things do they agree, and
//! that may be a fifth of all points: so the best fourth decides, and it must agree closely.

use super::features::Feature;
use super::field::Field;
use super::motion::Motion;
use super::places::Place;
use super::refine::Refine;
use super::search::{Lattice, Search};
use super::settings::MhdSettings;
use crate::raster::cell_at;
use arborloop_base::Time;
use nalgebra::{Matrix3, Rotation2, Vector2, Vector3};

/// Share of the points that decides.
const KEEP_RATIO: f64 = 0.25;
/// How far off the robot is looked for, at least and at most, meters and radians; and how far headings lie apart.
const REACH_M: [f64; 2] = [0.5, 1.0];
const REACH_RAD: [f64; 2] = [0.02, 0.04];
const STEP_RAD: f64 = 0.005;
/// It is looked for within so many standard deviations.
const REACH_SD: f64 = 2.0;
/// Any prior makes the search look at all positions; this one prefers none.
const PRIOR_M: f64 = 1e-6;
/// Poses that are refined.
const WANTED: usize = 4;
/// Where the search finds nothing better than this, meters, there is nothing to refine: it knows distances to a cell.
const HOPELESS_M: f64 = 0.08;
/// Points nearer to their match than this were met twice, meters.
const OVERLAP_M: f64 = 0.12;
/// A meeting is sure when its points agree this closely, meters, and so many of all were met twice.
const SURE_M: f64 = 0.065;
const SURE_RATIO: f64 = 0.2;
/// Unless another pose, this far off, agrees about as closely, meters.
const ANOTHER_M: f64 = 0.15;
const CLEARLY_M: f64 = 0.008;
/// Old places within this of the robot see the same things, meters; what they saw is laid out for a stretch of the way.
pub(crate) const NEAR_M: f64 = 12.0;
const STRETCH_M: f64 = 5.0;
/// What the robot does not see from here is left out, meters.
const SEEN_M: f64 = 15.0;
/// Fewer old places than this near by are not worth a look.
const OLD_MIN: usize = 4;

/// Looks for meetings; keeps what it laid out and its memory.
#[derive(Debug, Default)]
pub(crate) struct Meetings {
    laid: Option<Laid>,
    search: Search,
    refine: Refine,
    now: Vec<Feature>,
    /// Cost, share met twice and pose of what was refined.
    refined: Vec<(f64, f64, Vector3<f64>)>,
}

/// What was seen from old places, as a distance field around a point of the way.
#[derive(Debug)]
struct Laid {
    origin: Vector2<f64>,
    field: Field,
}

impl Meetings {
    /// Forgets what was laid out: the old places have moved.
    pub(crate) fn forget(&mut self) {
        self.laid = None;
    }

    /// Holds what was seen from the recent places, of which the newest is where the robot is, against what was seen from
    /// the old ones; the newest pose among the old ones, if they have surely met. `astray` says how far that may be from
    /// where it is believed.
    pub(crate) fn look(
        &mut self,
        old: &[Place],
        recent: &[Place],
        astray: &Matrix3<f64>,
        settings: &MhdSettings,
    ) -> Option<Vector3<f64>> {
        let here = recent.last()?.pose;
        if self.laid.as_ref().is_none_or(|laid| (laid.origin - here.xy()).norm() > STRETCH_M) {
            self.laid = lay_out(old, here.xy(), settings);
        }
        let Laid { origin, field } = self.laid.as_ref()?;
        let turn = Rotation2::new(-here.z);
        let own = here.xy() - origin;
        let points = recent.iter().flat_map(|place| place.features(here.xy()));
        thinned(points, SEEN_M, 2.0 * settings.cell_m, &mut self.now);
        for feature in &mut self.now {
            feature.at = turn * feature.at;
        }
        let pose = Vector3::new(own.x, own.y, here.z);
        let believed = Motion { stamp: Time::default(), pose, velocity: Vector3::zeros() };
        let lattice = Lattice {
            reach_m: (REACH_SD * (astray[(0, 0)] + astray[(1, 1)]).sqrt()).clamp(REACH_M[0], REACH_M[1]),
            reach_rad: (REACH_SD * astray[(2, 2)].sqrt()).clamp(REACH_RAD[0], REACH_RAD[1]),
            step_m: settings.cell_m,
            step_rad: STEP_RAD,
            prior_m: PRIOR_M,
        };
        let found = self.search.run(field, &self.now, &believed, &lattice, KEEP_RATIO, WANTED);
        self.refined.clear();
        for start in found.iter().filter(|start| start.cost_m < HOPELESS_M) {
            let start = Motion { pose: start.pose, ..believed };
            let one = self.refine.run(field, &self.now, start, &believed, 0.0, KEEP_RATIO);
            self.refined.push((one.cost_m, self.refine.share_within(OVERLAP_M), one.motion.pose));
        }
        let (cost_m, ratio, pose) = self.refined.iter().copied().min_by(|(a, ..), (b, ..)| a.total_cmp(b))?;
        let is_another = |other: &Vector3<f64>| (other - pose).xy().norm() > ANOTHER_M;
        let is_alone = !self
            .refined
            .iter()
            .any(|(other_m, _, other)| *other_m < cost_m + CLEARLY_M && is_another(other));
        let is_sure = cost_m < SURE_M && ratio > SURE_RATIO && is_alone;
        is_sure.then(|| Vector3::new(pose.x + origin.x, pose.y + origin.y, pose.z))
    }
}

/// Lays out what was seen from the places around a point; `None` where there are too few of them.
fn lay_out(old: &[Place], origin: Vector2<f64>, settings: &MhdSettings) -> Option<Laid> {
    let near = |place: &&Place| (place.pose.xy() - origin).norm() < NEAR_M + STRETCH_M;
    if old.iter().filter(near).count() < OLD_MIN {
        return None;
    }
    let mut field = Field::new(settings.cell_m, settings.distance_m_max, settings.layers());
    let mut points = Vec::new();
    let all = old.iter().filter(near).flat_map(|place| place.features(origin));
    thinned(all, SEEN_M + STRETCH_M, settings.cell_m, &mut points);
    for point in points {
        field.show(point);
    }
    Some(Laid { origin, field })
}

/// Fills `means` with the mean of the points within reach in every cell that has any, in order of the cells.
fn thinned(points: impl Iterator<Item = Feature>, reach_m: f64, cell_m: f64, means: &mut Vec<Feature>) {
    let mut all: Vec<_> = points
        .filter(|point| point.at.norm() <= reach_m)
        .map(|point| ((point.layer, cell_at(point.at.x, point.at.y, cell_m)), point))
        .collect();
    // The order within a cell stays: sums do not depend on how they are sorted.
    all.sort_by_key(|(cell, _)| *cell);
    means.clear();
    for same in all.chunk_by(|(a, _), (b, _)| a == b) {
        let sum: Vector2<f64> = same.iter().map(|(_, point)| point.at).sum();
        means.push(Feature { at: sum / same.len() as f64, ..same[0].1 });
    }
}
