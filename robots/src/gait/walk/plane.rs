//! The ground as the feet know it: a plane through the four last footholds, low-passed.

use arborloop_base::Pose;
use nalgebra::{Matrix2, Point3, UnitQuaternion, Vector2, Vector3};

/// Height and slope of the plane in which the feet's centers stand.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FootPlane {
    middle: Vector3<f64>,
    /// Rise per meter along x and y.
    pub(crate) slope: Vector2<f64>,
    /// How far the feet stand off the plane, low-passed over several strides, meters.
    pub(crate) roughness_m: f64,
}

/// How much slower the roughness follows than the plane; assumed: twenty times, some five strides.
const SLOWER: f64 = 20.0;

impl FootPlane {
    /// Through the feet as they stand.
    pub(crate) fn through(feet: &[Point3<f64>; 4]) -> Self {
        let (middle, slope) = fitted(feet);
        FootPlane { middle, slope, roughness_m: crosswise_m(feet) }
    }

    /// One tick toward the plane through the feet; `share` is the low-pass's step.
    pub(crate) fn follow(&mut self, feet: &[Point3<f64>; 4], share: f64) {
        let (middle, slope) = fitted(feet);
        self.slope += (slope - self.slope) * share;
        // The middle wanders with the feet: its height is carried along the plane, only the rest is low-passed.
        let carried_m = self.height_m(middle.xy());
        self.middle = Vector3::new(middle.x, middle.y, carried_m + (middle.z - carried_m) * share);
        self.roughness_m += (crosswise_m(feet) - self.roughness_m) * share / SLOWER;
    }

    /// The same plane elsewhere.
    pub(crate) fn carry(&mut self, moved: &Pose) {
        let normal = moved.rotation * Vector3::new(-self.slope.x, -self.slope.y, 1.0);
        self.middle = (moved * Point3::from(self.middle)).coords;
        // Ground is never put upright: the normal keeps a part along z.
        self.slope = -normal.xy() / normal.z;
    }

    /// The turn that brings the plane's normal to z, the short way.
    pub(crate) fn upright(&self) -> UnitQuaternion<f64> {
        let normal = Vector3::new(-self.slope.x, -self.slope.y, 1.0);
        // A plane of finite slope never faces down.
        UnitQuaternion::rotation_between(&normal, &Vector3::z()).unwrap_or_default()
    }

    /// Height of a foot's center on the plane, meters.
    pub(crate) fn height_m(&self, place: Vector2<f64>) -> f64 {
        self.middle.z + self.slope.dot(&(place - self.middle.xy()))
    }
}

/// Four feet have one way to stand off a plane: crosswise, all by as much.
fn crosswise_m(feet: &[Point3<f64>; 4]) -> f64 {
    let [fr, fl, rr, rl] = feet.map(|foot| foot.z);
    ((fr + rl - fl - rr) / 4.0).abs()
}

/// Least squares.
fn fitted(feet: &[Point3<f64>; 4]) -> (Vector3<f64>, Vector2<f64>) {
    let middle = feet.iter().map(|foot| foot.coords).sum::<Vector3<f64>>() / 4.0;
    let (mut spread, mut rise) = (Matrix2::zeros(), Vector2::zeros());
    for foot in feet {
        let offset = foot.coords - middle;
        spread += offset.xy() * offset.xy().transpose();
        rise += offset.xy() * offset.z;
    }
    // Feet in one line span no plane: level is the answer.
    let slope = spread.try_inverse().map_or(Vector2::zeros(), |inverse| inverse * rise);
    (middle, if slope.iter().all(|n| n.is_finite()) { slope } else { Vector2::zeros() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn feet_on_a_plane_find_it_and_a_walk_along_it_leaves_no_lag() {
        let ground = |x: f64, y: f64| 0.3 + 0.1 * x - 0.2 * y;
        let feet = |at: f64| {
            [(0.2, -0.1), (0.2, 0.1), (-0.2, -0.1), (-0.2, 0.1)]
                .map(|(x, y)| Point3::new(at + x, y, ground(at + x, y)))
        };
        let mut plane = FootPlane::through(&feet(0.0));
        for step in 0..1000 {
            plane.follow(&feet(f64::from(step) * 5e-4), 0.01);
        }
        assert!((plane.slope - Vector2::new(0.1, -0.2)).norm() < 1e-9);
        assert!((plane.height_m(Vector2::new(0.7, 0.1)) - ground(0.7, 0.1)).abs() < 1e-9);
    }

    #[test]
    fn feet_in_one_line_leave_the_plane_level() {
        let feet = [0.0, 1.0, 2.0, 3.0].map(|x| Point3::new(x, 0.0, x));
        assert_eq!(FootPlane::through(&feet).slope, Vector2::zeros());
    }
}
