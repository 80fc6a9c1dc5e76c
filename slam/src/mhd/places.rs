//! Where the robot was and what it saw from there: by this record a way that comes back is closed.
//!
//! The map is drawn as the robot goes, and stays as it was drawn. What moves when a way is closed is where its places are
//! believed to be, and with the place of the robot every estimate from then on. Map and way within it stay consistent, and
//! no cell is ever torn from the raster it was averaged in: moved cells leave holes and doubled walls that no later match
//! holds on to.

use super::features::Feature;
use super::graph::{Edge, carried, onto, relax, seen_from};
use super::meeting::Meetings;
use super::motion::Motion;
use super::settings::MhdSettings;
use arborloop_base::wrap_angle;
use nalgebra::{Matrix3, Rotation2, Vector2, Vector3};

/// Places lie so far apart, meters and radians.
const APART_M: f64 = 1.0;
const APART_RAD: f64 = 0.5;
/// What was seen from farther away is not kept, meters.
const REACH_M: f64 = 15.0;
/// The way after which a place is old, meters: what is met there again may be held against what was met before.
const OLD_M: f64 = 40.0;
/// What was seen from so many places, the newest last, is held against what was seen from old ones.
const RECENT: usize = 3;

/// Variance of a step per meter along and aside, meters^2, and per meter and per radian of turn, radians^2.
const STEP_M2: f64 = 9e-6;
const STEP_RAD2: f64 = 4e-8;
const TURN_RAD2: f64 = 1e-5;
/// A turn in place is a way of this, meters: no step is without error.
const WAY_M_MIN: f64 = 0.05;
/// Standard deviations of a return, meters and radians: neighboring ones share their errors, so these are wide.
const RETURN_M: f64 = 0.06;
const RETURN_RAD: f64 = 0.006;
/// Estimates are only moved by more than this, meters and radians: less is what a meeting errs by.
const MOVED_M: f64 = 0.03;
const MOVED_RAD: f64 = 0.003;

/// A meeting that wants to move the robot by more than this, meters or radians, must be confirmed by the next: within so much
/// of the way, and as alike as this.
const BOLD_M: f64 = 0.3;
const BOLD_RAD: f64 = 0.03;
const CONFIRMED_WITHIN_M: f64 = 8.0;
const SAME_M: f64 = 0.15;
const SAME_RAD: f64 = 0.02;

/// A point as it was seen from its place.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    at: (f32, f32),
    layer: u8,
}

/// One place.
#[derive(Debug, Clone)]
pub(crate) struct Place {
    /// x, y (meters) and heading (radians) as now believed.
    pub(crate) pose: Vector3<f64>,
    /// The same where the map was drawn from here.
    drawn: Vector3<f64>,
    /// Covariance of the pose as seen from the first place.
    covariance: Matrix3<f64>,
    /// The way up to here, meters.
    way_m: f64,
    points: Vec<Point>,
}

impl Place {
    /// What was seen from here, from `origin` along the axes that the pose is given in.
    pub(crate) fn features(&self, origin: Vector2<f64>) -> impl Iterator<Item = Feature> + '_ {
        let (turn, from) = (Rotation2::new(self.pose.z), self.pose.xy() - origin);
        self.points.iter().map(move |point| {
            let at = from + turn * Vector2::new(f64::from(point.at.0), f64::from(point.at.1));
            Feature { at, after_s: 0.0, layer: usize::from(point.layer) }
        })
    }

    /// Whether what was drawn from here lies elsewhere in the map than it should for a robot that is believed at a pose and
    /// drawn at another.
    fn has_left(&self, pose: &Vector3<f64>, drawn: &Vector3<f64>) -> bool {
        let off = onto(&self.drawn, &seen_from(&self.pose, pose)) - drawn;
        off.xy().norm() > MOVED_M || wrap_angle(off.z).abs() > MOVED_RAD
    }
}

/// A meeting that wants to move the robot by so much.
#[derive(Debug, Clone, Copy)]
struct Claim {
    way_m: f64,
    /// From where the robot is believed to where it was met, map frame.
    off: Vector3<f64>,
    edge: Edge,
}

/// All places and what joins them.
#[derive(Debug, Default)]
pub(crate) struct Places {
    all: Vec<Place>,
    edges: Vec<Edge>,
    meetings: Meetings,
    /// The last bold claim, still to be confirmed.
    claim: Option<Claim>,
    /// Index of the place that the robot was at last.
    last: usize,
    /// The way up to now, meters, and the pose by which it is counted.
    way_m: f64,
    at: Option<Vector3<f64>>,
}

impl Places {
    /// Takes in a key frame, and says whether it closed the way: where places are believed to be has changed.
    pub(crate) fn visit(&mut self, motion: &Motion, features: &[Feature], settings: &MhdSettings) -> bool {
        if let Some(at) = self.at.replace(motion.pose) {
            self.way_m += (motion.pose - at).xy().norm();
        }
        let drawn = motion.pose;
        let is_at = |place: &Place| {
            let off = drawn - place.drawn;
            off.xy().norm() < APART_M && wrap_angle(off.z).abs() < APART_RAD
        };
        if self.all.get(self.last).is_some_and(is_at) {
            return false;
        }
        // Where the map is known it holds the robot, and needs no new place.
        let pose = self.correct(&drawn);
        let known = |place: &Place| is_at(place) && !place.has_left(&pose, &drawn);
        if let Some(known) = self.all.iter().position(known) {
            self.last = known;
            return false;
        }
        self.add(pose, motion, features);
        self.close(settings)
    }

    /// The place that the robot was at last; the number stays at the largest that it can say.
    pub(crate) fn last(&self) -> u16 {
        u16::try_from(self.last).unwrap_or(u16::MAX)
    }

    /// Whether what was drawn from a place lies elsewhere in the map than it should for a robot that is here.
    pub(crate) fn has_left(&self, place: u16) -> bool {
        let (place, here) = (self.all.get(usize::from(place)), self.all.get(self.last));
        place.zip(here).is_some_and(|(place, here)| place.has_left(&here.pose, &here.drawn))
    }

    /// A pose in the map as it was drawn, where it is believed to be.
    pub(crate) fn correct(&self, drawn: &Vector3<f64>) -> Vector3<f64> {
        self.believed(self.last(), drawn)
    }

    /// A pose in the map as it was drawn from a place, where it is believed to be.
    pub(crate) fn believed(&self, place: u16, drawn: &Vector3<f64>) -> Vector3<f64> {
        match self.all.get(usize::from(place)) {
            Some(place) => onto(&place.pose, &seen_from(&place.drawn, drawn)),
            None => *drawn,
        }
    }

    /// A point of the map as it was drawn from a place, where it is believed to be.
    pub(crate) fn moved(&self, place: u16, at: Vector2<f64>) -> Vector2<f64> {
        match self.all.get(usize::from(place)) {
            Some(place) if place.pose != place.drawn => {
                let turn = Rotation2::new(place.pose.z - place.drawn.z);
                place.pose.xy() + turn * (at - place.drawn.xy())
            }
            _ => at,
        }
    }

    /// How far the way from the first place may have gone astray by now: covariance of a believed pose.
    pub(crate) fn astray(&self, pose: &Vector3<f64>) -> Matrix3<f64> {
        let Some(last) = self.all.get(self.last) else { return Matrix3::zeros() };
        carried(&last.pose, &last.covariance, &seen_from(&last.pose, pose), &Matrix3::zeros())
    }

    fn add(&mut self, pose: Vector3<f64>, motion: &Motion, features: &[Feature]) {
        let (placing, turn) = (motion.placing(), Rotation2::new(-motion.pose.z));
        let near = features.iter().filter(|feature| feature.at.norm() <= REACH_M);
        let points = near.map(|feature| {
            let at = turn * (placing.place(&feature.at, feature.after_s) - motion.pose.xy());
            Point { at: (at.x as f32, at.y as f32), layer: feature.layer as u8 }
        });
        let mut here = Place {
            pose,
            drawn: motion.pose,
            covariance: Matrix3::zeros(),
            way_m: self.way_m,
            points: points.collect(),
        };
        if let Some(last) = self.all.get(self.last) {
            let seen = seen_from(&last.drawn, &here.drawn);
            let way_m = seen.xy().norm().max(WAY_M_MIN);
            let turn_rad2 = STEP_RAD2 * way_m + TURN_RAD2 * wrap_angle(seen.z).abs();
            let variances = Vector3::new(STEP_M2 * way_m, STEP_M2 * way_m, turn_rad2);
            here.covariance =
                carried(&last.pose, &last.covariance, &seen, &Matrix3::from_diagonal(&variances));
            self.edges.push(Edge::new(self.last, self.all.len(), seen, &variances, false));
        }
        self.last = self.all.len();
        self.all.push(here);
    }

    /// Whether a claim may move the places: at once if it asks for little, else once another has asked for the same, which
    /// then comes with it.
    fn confirm(&mut self, claim: Claim) -> Option<Option<Claim>> {
        if claim.off.xy().norm() < BOLD_M && claim.off.z.abs() < BOLD_RAD {
            return Some(None);
        }
        let agrees = |before: &Claim| {
            let apart = claim.off - before.off;
            let is_near = claim.way_m - before.way_m < CONFIRMED_WITHIN_M;
            is_near && apart.xy().norm() < SAME_M && apart.z.abs() < SAME_RAD
        };
        match self.claim.replace(claim).filter(agrees) {
            Some(before) => {
                self.claim = None;
                Some(Some(before))
            }
            None => None,
        }
    }

    /// Looks whether what is seen here was seen long ago, and moves the places to agree.
    fn close(&mut self, settings: &MhdSettings) -> bool {
        let here = self.last;
        let old = self.all.partition_point(|place| self.way_m - place.way_m > OLD_M);
        let recent = &self.all[(here + 1).saturating_sub(RECENT)..];
        let astray = &self.all[here].covariance;
        let Some(pose) = self.meetings.look(&self.all[..old], recent, astray, settings) else { return false };
        let far_m = |place: &Place| (place.pose - pose).xy().norm();
        let anchor = (0..old).min_by(|a, b| far_m(&self.all[*a]).total_cmp(&far_m(&self.all[*b])));
        let Some(anchor) = anchor else { return false };
        let from = &self.all[anchor];
        let seen = seen_from(&from.pose, &pose);
        let variances = Vector3::new(RETURN_M, RETURN_M, RETURN_RAD).map(|sd| sd * sd);
        let edge = Edge::new(anchor, here, seen, &variances, true);
        let claim = Claim { way_m: self.way_m, off: pose - self.all[here].pose, edge };
        let Some(before) = self.confirm(claim) else { return false };
        let edges = self.edges.len();
        self.edges.extend(before.map(|before| before.edge).into_iter().chain([edge]));
        let mut poses: Vec<_> = self.all.iter().map(|place| place.pose).collect();
        let Some(covariance) = relax(&mut poses, &self.edges) else {
            self.edges.truncate(edges);
            return false;
        };
        self.all[here].covariance = covariance;
        let moved = poses[here] - self.all[here].pose;
        if moved.xy().norm() < MOVED_M && moved.z.abs() < MOVED_RAD {
            return false;
        }
        for (place, pose) in self.all.iter_mut().zip(poses) {
            place.pose = pose;
        }
        self.meetings.forget();
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Seed, Time};

    /// Things that stand about, and what is seen of them from a pose.
    struct Grove(Vec<Vector2<f64>>);

    impl Grove {
        fn new(seed: u64) -> Self {
            let mut draws = Seed(seed).stream("grove").at(0);
            Grove(
                (0..500)
                    .map(|_| Vector2::new(draws.within(-20.0, 35.0), draws.within(-20.0, 35.0)))
                    .collect(),
            )
        }

        fn seen_from(&self, pose: &Vector3<f64>) -> Vec<Feature> {
            let turn = Rotation2::new(-pose.z);
            let seen = self.0.iter().map(|at| turn * (at - pose.xy()));
            seen.filter(|at| at.norm() < 12.0).map(|at| Feature { at, after_s: 0.0, layer: 0 }).collect()
        }
    }

    /// The true pose after so much of the way around a square of 15 m.
    fn really(way_m: f64) -> Vector3<f64> {
        let (side, along) = ((way_m / 15.0).floor(), way_m % 15.0);
        let heading = side * std::f64::consts::FRAC_PI_2;
        let corner = [(0.0, 0.0), (15.0, 0.0), (15.0, 15.0), (0.0, 15.0)][side as usize % 4];
        Vector3::new(corner.0 + along * heading.cos(), corner.1 + along * heading.sin(), heading)
    }

    /// Walks around the square with a heading that goes astray, through one grove and from 40 m on through another; the
    /// largest errors of the last meters, as drawn and as believed, and whether any way was closed.
    fn walk(first: &Grove, then: &Grove, places: &mut Places) -> (f64, f64, bool) {
        let settings = MhdSettings::default();
        let (mut drawn, mut closed) = (really(0.0), false);
        let (mut drawn_m, mut believed_m) = (0.0_f64, 0.0_f64);
        for step in 0..118 {
            let way_m = 0.5 * f64::from(step);
            let pose = really(way_m);
            if step > 0 {
                let mut seen = seen_from(&really(way_m - 0.5), &pose);
                seen.z += 0.0003;
                drawn = onto(&drawn, &seen);
            }
            let motion = Motion { stamp: Time::default(), pose: drawn, velocity: Vector3::zeros() };
            let grove = if way_m < 40.0 { first } else { then };
            closed |= places.visit(&motion, &grove.seen_from(&pose), &settings);
            if way_m > 56.0 {
                drawn_m = drawn_m.max((drawn - pose).xy().norm());
                believed_m = believed_m.max((places.correct(&drawn) - pose).xy().norm());
            }
        }
        (drawn_m, believed_m, closed)
    }

    #[test]
    fn a_way_that_comes_back_is_closed_and_what_was_drawn_before_has_left() {
        let (grove, mut places) = (Grove::new(5), Places::default());
        let (drawn_m, believed_m, closed) = walk(&grove, &grove, &mut places);
        assert!(closed && drawn_m > 0.2, "{closed} {drawn_m}");
        assert!(believed_m < 0.1 && believed_m < 0.3 * drawn_m, "{believed_m} of {drawn_m}");
        assert!(places.has_left(0) && !places.has_left(places.last()));
        let astray_m = places.astray(&really(58.0))[(0, 0)].sqrt();
        assert!(astray_m > 0.01 && astray_m < 0.2, "{astray_m}");
    }

    #[test]
    fn who_comes_back_to_other_things_has_not_come_back() {
        let mut places = Places::default();
        let (_, believed_m, closed) = walk(&Grove::new(5), &Grove::new(6), &mut places);
        assert!(!closed && believed_m > 0.2, "{closed} {believed_m}");
    }

    #[test]
    fn a_robot_that_goes_round_and_round_needs_no_more_places() {
        let (grove, mut places) = (Grove::new(5), Places::default());
        let settings = MhdSettings::default();
        let mut counts = Vec::new();
        for step in 0..500 {
            let pose = really(0.5 * f64::from(step) % 60.0);
            let motion = Motion { stamp: Time::default(), pose, velocity: Vector3::zeros() };
            places.visit(&motion, &grove.seen_from(&pose), &settings);
            counts.push(places.all.len());
        }
        assert!(counts[119] >= 40 && counts[499] <= counts[119] + 2, "{} {}", counts[119], counts[499]);
        // An exact way is not moved.
        assert!((places.correct(&really(10.0)) - really(10.0)).norm() < 1e-9);
    }
}
