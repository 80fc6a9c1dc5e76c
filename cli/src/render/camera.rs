//! Where a picture is taken from.

use arborloop_base::Time;
use arborloop_sim::optics::{Depth, Ray};
use nalgebra::{Point2, Point3, Vector3};

/// A camera in the world frame; up is z.
pub(crate) enum Camera {
    /// From far above, without perspective; north is up.
    Top {
        /// Middle of the picture.
        center: Point2<f64>,
        /// Side of a pixel, meters.
        pixel_m: f64,
        /// Pixels.
        size: [usize; 2],
    },
    /// With perspective.
    Eye {
        /// Where it stands.
        from: Point3<f64>,
        /// What it looks at.
        at: Point3<f64>,
        /// Across the picture, radians.
        view_rad: f64,
        /// Pixels.
        size: [usize; 2],
    },
}

/// A top view is taken from this height, meters: above every tree.
const ABOVE_M: f64 = 80.0;

impl Camera {
    /// Width and height, pixels.
    pub(crate) fn size(&self) -> [usize; 2] {
        match self {
            Camera::Top { size, .. } | Camera::Eye { size, .. } => *size,
        }
    }

    /// The ray through a place of the picture, pixels from its upper left corner.
    pub(crate) fn ray(&self, u: f64, v: f64, stamp: Time) -> Ray {
        let [width, height] = self.size().map(|pixels| pixels as f64);
        let (right, down) = (u - width / 2.0, v - height / 2.0);
        let (origin, direction) = match self {
            Camera::Top { center, pixel_m, .. } => {
                (Point3::new(center.x + right * pixel_m, center.y - down * pixel_m, ABOVE_M), -Vector3::z())
            }
            Camera::Eye { from, at, view_rad, .. } => {
                let ahead = (at - from).normalize();
                let across = ahead.cross(&Vector3::z()).normalize();
                let below = ahead.cross(&across);
                let pixel = (view_rad / 2.0).tan() * 2.0 / width;
                (*from, (ahead + across * (right * pixel) + below * (down * pixel)).normalize())
            }
        };
        Ray { stamp, origin, direction, range_m_min: 0.0, range_m_max: 300.0, depth: Depth::of(depth(u, v)) }
    }
}

/// Optical depth of the exponential law for each place of a picture: grass is seen as dense as it is.
fn depth(u: f64, v: f64) -> f64 {
    // Roberts's R2 sequence spreads the drawn fractions evenly over neighboring pixels.
    let share = (0.754_877_666 * u * 2.0 + 0.569_840_291 * v * 2.0).fract();
    -(1.0 - share.abs()).max(1e-6).ln()
}
