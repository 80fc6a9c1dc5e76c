//! A grove of posts on flat ground, seen by exact geometry: rays against circles and a plane.

use arborloop_base::{Pose2, Return, Span, Sweep, Time, wrap_angle};
use nalgebra::{Point2, Vector2};
use std::f64::consts::{PI, TAU};

/// Height of the lidar above the ground, meters.
pub(crate) const LIDAR_M: f64 = 0.5;
/// Height of the posts, meters.
pub(crate) const POST_M: f64 = 1.0;

/// Posts: center and radius, meters.
pub(crate) struct Grove(pub(crate) Vec<(Point2<f64>, f64)>);

impl Grove {
    /// Fourteen posts at irregular places, so that no turn or shift maps the grove on itself.
    pub(crate) fn new() -> Self {
        let posts = (0..14).map(|n| {
            let n = f64::from(n);
            let bearing = n * TAU * 0.381_966;
            let distance = 2.5 + 0.75 * n;
            (Point2::new(1.5 + distance * bearing.cos(), distance * bearing.sin()), 0.08 + 0.01 * (n % 4.0))
        });
        Grove(posts.collect())
    }

    /// Level distance from a place along a unit direction to the nearest post.
    fn post(&self, from: &Point2<f64>, along: &Vector2<f64>) -> Option<f64> {
        let met = self.0.iter().filter_map(|(center, radius)| {
            let to = center - from;
            let ahead = to.dot(along);
            let square = radius * radius - (to.norm_squared() - ahead * ahead);
            (square > 0.0 && ahead > 0.0).then(|| ahead - square.sqrt())
        });
        met.min_by(f64::total_cmp)
    }

    /// A planar scan of 897 bins of 0.007 rad, all bearings turned by `turn_rad`.
    pub(crate) fn scan(&self, pose: &Pose2, stamp: Time, turn_rad: f64) -> Sweep {
        let returns = (0..897).map(|bin| {
            let bearing = -PI + 0.007 * f64::from(bin);
            let along = pose.rotation * Vector2::new(bearing.cos(), bearing.sin());
            let range_m = self.post(&Point2::from(pose.translation.vector), &along);
            beam(wrap_angle(bearing + turn_rad), 0.0, range_m, 0, Span::ZERO)
        });
        Sweep { start: stamp, end: stamp, rings: 1, returns: returns.collect() }
    }

    /// A rolling sweep of sixteen rings in 0.1 s, ending at `end`; `pose_at` gives the base at seconds after the start.
    pub(crate) fn sweep(&self, pose_at: impl Fn(f64) -> Pose2, end: Time) -> Sweep {
        let start = end - Span::from_millis(100);
        let returns = (0..900).flat_map(|column| {
            let after = Span::from_nanos(i64::from(column) * 111_111);
            let pose = pose_at(after.seconds());
            let bearing = wrap_angle(PI - TAU * f64::from(column) / 900.0);
            let along = pose.rotation * Vector2::new(bearing.cos(), bearing.sin());
            let post_m = self.post(&Point2::from(pose.translation.vector), &along);
            (0..16_u16).map(move |ring| {
                let elevation = (2.0 * f64::from(ring) - 15.0).to_radians();
                let height = |level_m: f64| LIDAR_M + level_m * elevation.tan();
                let post_m = post_m.filter(|level_m| (0.0..POST_M).contains(&height(*level_m)));
                let ground_m = (elevation < 0.0).then(|| LIDAR_M / -elevation.tan());
                let level_m = post_m.into_iter().chain(ground_m).min_by(f64::total_cmp);
                beam(bearing, elevation, level_m.map(|level_m| level_m / elevation.cos()), ring, after)
            })
        });
        Sweep { start, end, rings: 16, returns: returns.collect() }
    }
}

/// One beam's answer.
pub(crate) fn beam(
    azimuth_rad: f64,
    elevation_rad: f64,
    range_m: Option<f64>,
    ring: u16,
    fired_after: Span,
) -> Return {
    Return { azimuth_rad, elevation_rad, range_m, ring, number: 0, fired_after, intensity: 0.0 }
}
