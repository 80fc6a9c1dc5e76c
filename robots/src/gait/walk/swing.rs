//! The path of a foot through the air: off the ground, over an arc, and down with a chosen speed.

use nalgebra::{Point3, Vector3};

/// Where a foot is to be, how fast, and with which acceleration; world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Aim {
    pub(crate) at: Point3<f64>,
    pub(crate) velocity_mps: Vector3<f64>,
    pub(crate) acceleration_mps2: Vector3<f64>,
}

/// A swing from one foothold to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Swing {
    pub(crate) from: Point3<f64>,
    pub(crate) to: Point3<f64>,
    /// Height of the arc above the higher of both ends, meters.
    pub(crate) height_m: f64,
    /// Speed of lowering at the end, m/s.
    pub(crate) touchdown_mps: f64,
    /// Time from lift-off to the planned touchdown, seconds.
    pub(crate) duration_s: f64,
}

/// Share of the swing after which the foot is above its foothold and only comes down; assumed.
const THERE: f64 = 0.9;
/// Share of the swing at which the foot is highest; assumed.
const TOP: f64 = 0.45;

impl Swing {
    /// The aim at a share of the swing; beyond the end the foot is lowered on, as fast as planned.
    pub(crate) fn at(&self, share: f64) -> Aim {
        let duration_s = self.duration_s;
        let (along, along_rate, along_change) = quintic(share / THERE, [0.0; 3], [1.0, 0.0, 0.0]);
        let along_rate = along_rate / (THERE * duration_s);
        let along_change = along_change / (THERE * duration_s).powi(2);
        let shift = self.to - self.from;
        let top_m = self.from.z.max(self.to.z) + self.height_m;
        let (rise_s, fall_s) = (TOP * duration_s, (1.0 - TOP) * duration_s);
        let (rise_m, fall_m) = (top_m - self.from.z, top_m - self.to.z);
        // A step of the jerk at the top would shake the trunk between 20 and 50 Hz: the arc bends there as a natural spline.
        let bend_mps2 = -(60.0 * (rise_m / rise_s.powi(3) + fall_m / fall_s.powi(3))
            - 24.0 * self.touchdown_mps / fall_s.powi(2))
            / (9.0 * (1.0 / rise_s + 1.0 / fall_s));
        // Where a foot comes down faster than such an arc is high, the top stays the top.
        let bend_mps2 = bend_mps2.min(0.0);
        let (height_m, rate, change) = if share < TOP {
            let (x, v, a) =
                quintic(share / TOP, [self.from.z, 0.0, 0.0], [top_m, 0.0, bend_mps2 * rise_s * rise_s]);
            (x, v / rise_s, a / (rise_s * rise_s))
        } else if share < 1.0 {
            let bend = bend_mps2 * fall_s * fall_s;
            let (x, v, a) = quintic(
                (share - TOP) / (1.0 - TOP),
                [top_m, 0.0, bend],
                [self.to.z, -self.touchdown_mps * fall_s, 0.0],
            );
            (x, v / fall_s, a / (fall_s * fall_s))
        } else {
            let late_s = (share - 1.0) * duration_s;
            (self.to.z - self.touchdown_mps * late_s, -self.touchdown_mps, 0.0)
        };
        let flat = Vector3::new(shift.x, shift.y, 0.0);
        Aim {
            at: Point3::new(self.from.x + shift.x * along, self.from.y + shift.y * along, height_m),
            velocity_mps: flat * along_rate + Vector3::z() * rate,
            acceleration_mps2: flat * along_change + Vector3::z() * change,
        }
    }
}

/// The polynomial of fifth degree over [0, 1] with given value, slope and curvature at either end: value, first and second
/// derivative; outside it stays at its ends.
fn quintic(share: f64, [x0, v0, a0]: [f64; 3], [x1, v1, a1]: [f64; 3]) -> (f64, f64, f64) {
    if share <= 0.0 {
        return (x0, v0, a0);
    }
    if share >= 1.0 {
        return (x1, v1, a1);
    }
    let s = share;
    let rise = x1 - x0;
    let c3 = 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1;
    let c4 = -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1;
    let c5 = 6.0 * rise - 3.0 * (v0 + v1) + 0.5 * (a1 - a0);
    (
        x0 + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5)))),
        v0 + s * (a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5))),
        a0 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const SWING: Swing = Swing {
        from: Point3::new(0.1, -0.1, 0.02),
        to: Point3::new(0.3, -0.12, 0.05),
        height_m: 0.08,
        touchdown_mps: 0.15,
        duration_s: 0.2,
    };

    #[test]
    fn a_swing_begins_at_rest_and_ends_over_its_foothold_with_the_speed_chosen() {
        let (start, end) = (SWING.at(0.0), SWING.at(1.0));
        assert_eq!(start.at, SWING.from);
        assert_eq!(start.velocity_mps, Vector3::zeros());
        assert!((end.at - SWING.to).norm() < 1e-12);
        assert!((end.velocity_mps - Vector3::new(0.0, 0.0, -0.15)).norm() < 1e-12);
        let top = (0..=100).map(|n| SWING.at(f64::from(n) / 100.0).at.z).fold(0.0, f64::max);
        assert!((top - 0.13).abs() < 1e-3, "{top}");
    }

    #[test]
    fn speeds_and_accelerations_are_derivatives() {
        for n in 1..120 {
            let share = f64::from(n) / 100.0 + 0.003;
            let step = 1e-5;
            let (before, now, after) = (SWING.at(share - step), SWING.at(share), SWING.at(share + step));
            let span_s = 2.0 * step * SWING.duration_s;
            assert!(((after.at - before.at) / span_s - now.velocity_mps).norm() < 1e-5);
            let change = (after.velocity_mps - before.velocity_mps) / span_s;
            assert!((change - now.acceleration_mps2).norm() < 1e-2 * (1.0 + change.norm()));
        }
    }

    #[test]
    fn the_arc_s_jerk_has_no_step_at_its_top() {
        let jerk = |share: f64| {
            let step = 1e-4;
            let change = SWING.at(share + step).acceleration_mps2 - SWING.at(share - step).acceleration_mps2;
            change.z / (2.0 * step * SWING.duration_s)
        };
        let (before, after) = (jerk(TOP - 2e-4), jerk(TOP + 2e-4));
        let fastest = (5..90).map(|n| jerk(f64::from(n) / 100.0).abs()).fold(0.0, f64::max);
        assert!((after - before).abs() < 0.02 * fastest, "{before} and {after} m/s3, at the most {fastest}");
        assert!(SWING.at(TOP).acceleration_mps2.z < 0.0);
    }
}
