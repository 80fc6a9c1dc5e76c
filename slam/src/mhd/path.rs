//! The whole path as finally believed: what later sweeps and closed ways have told of earlier ones.
//!
//! An answer is given at a sweep's end, half a sweep after the instant that its points determine, and by the places as they
//! were believed then. Afterwards the next sweep's middle is known too, and where the places really were.

use super::motion::Motion;
use super::places::Places;
use arborloop_base::{Time, Trajectory, pose2, spatial};
use nalgebra::Vector3;

/// Between middles farther apart than so many times the way to the sweep's end nothing is interpolated.
const GAP_RATIO: f64 = 3.0;
/// Nor where the second is this far, meters and radians, from where the first leads: who was carried off did not walk there.
const JUMP_M: f64 = 0.15;
const JUMP_RAD: f64 = 0.15;

/// One sweep.
#[derive(Debug, Clone, Copy)]
struct Step {
    end: Time,
    motion: Motion,
    /// The place that the robot was at.
    place: u16,
}

/// All sweeps that were answered.
#[derive(Debug, Clone, Default)]
pub(crate) struct Path(Vec<Step>);

impl Path {
    /// Takes the motion by which a sweep that ends at `end` was answered, drawn from a place.
    pub(crate) fn push(&mut self, end: Time, motion: &Motion, place: u16) {
        self.0.push(Step { end, motion: *motion, place });
    }

    /// The base at the end of every sweep; `None` of fewer than two sweeps or of stamps that do not increase.
    pub(crate) fn finally(&self, places: &Places) -> Option<Trajectory> {
        let next = self.0.iter().skip(1).map(Some).chain([None]);
        let poses = self.0.iter().zip(next).map(|(step, next)| {
            let drawn = next.and_then(|next| between(step, &next.motion)).unwrap_or_else(|| {
                let after_s = (step.end - step.motion.stamp).seconds();
                step.motion.pose + step.motion.velocity * after_s
            });
            let pose = places.believed(step.place, &drawn);
            (step.end, spatial(&pose2(pose.x, pose.y, pose.z)))
        });
        Trajectory::new(poses.collect()).ok().filter(|path| path.len() > 1)
    }
}

/// The pose at a sweep's end on Hermite's cubic between its middle and the next one's.
fn between(step: &Step, next: &Motion) -> Option<Vector3<f64>> {
    let motion = &step.motion;
    let (after_s, whole_s) = ((step.end - motion.stamp).seconds(), (next.stamp - motion.stamp).seconds());
    let jump = next.pose - motion.pose - (motion.velocity + next.velocity) * (0.5 * whole_s);
    let is_near = jump.xy().norm() < JUMP_M && jump.z.abs() < JUMP_RAD;
    if after_s <= 0.0 || whole_s < after_s || whole_s > GAP_RATIO * after_s || !is_near {
        return None;
    }
    let s = after_s / whole_s;
    let (s2, s3) = (s * s, s * s * s);
    let pose = motion.pose * (2.0 * s3 - 3.0 * s2 + 1.0)
        + motion.velocity * (whole_s * (s3 - 2.0 * s2 + s))
        + next.pose * (3.0 * s2 - 2.0 * s3)
        + next.velocity * (whole_s * (s3 - s2));
    Some(pose)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::{Span, planar};

    fn at(time_s: f64) -> Time {
        Time::from_nanos(0) + Span::from_seconds(time_s)
    }

    /// A robot on a circle that shakes its heading.
    fn really(time_s: f64) -> Vector3<f64> {
        let angle = 0.4 * time_s;
        Vector3::new(2.0 * angle.sin(), 2.0 - 2.0 * angle.cos(), angle + 0.02 * (14.0 * time_s).sin())
    }

    fn motion(time_s: f64) -> Motion {
        let velocity = (really(time_s + 1e-4) - really(time_s - 1e-4)) / 2e-4;
        Motion { stamp: at(time_s), pose: really(time_s), velocity }
    }

    #[test]
    fn a_sweeps_end_lies_between_its_middle_and_the_next() {
        let mut path = Path::default();
        for n in 0..20 {
            let time_s = 0.1 * f64::from(n);
            path.push(at(time_s + 0.05), &motion(time_s), 0);
        }
        let finally = path.finally(&Places::default()).unwrap();
        for (stamp, pose) in &finally.poses()[..19] {
            let (found, wanted) = (planar(pose), really((*stamp - at(0.0)).seconds()));
            let off_rad = arborloop_base::wrap_angle(found.rotation.angle() - wanted.z).abs();
            // Constant velocity is off by up to 5 thousandths.
            assert!(off_rad < 5e-4 && (found.translation.vector - wanted.xy()).norm() < 1e-4, "{off_rad}");
        }
    }

    #[test]
    fn across_a_gap_or_a_jump_nothing_is_interpolated() {
        let step = Step { end: at(0.05), motion: motion(0.0), place: 0 };
        assert!(between(&step, &motion(0.1)).is_some());
        assert_eq!(between(&step, &motion(1.0)), None);
        let mut carried = motion(0.1);
        carried.pose.x += 1.0;
        assert_eq!(between(&step, &carried), None);
        assert!(Path::default().finally(&Places::default()).is_none());
    }
}
