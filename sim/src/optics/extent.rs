//! How far apart beams that travel together begin and go: what holds for all of them is asked once.

use super::Ray;

/// The least and the greatest of what some beams say.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    /// Origin, direction, and the nearest and the farthest distance that counts.
    pub(super) low: [f64; 8],
    pub(super) high: [f64; 8],
}

impl Extent {
    /// Of no beams, what no number is in.
    pub(super) fn of(rays: &[Ray]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 8], [f64::NEG_INFINITY; 8]);
        for ray in rays {
            let (from, along) = (&ray.origin, &ray.direction);
            let numbers =
                [from.x, from.y, from.z, along.x, along.y, along.z, ray.range_m_min, ray.range_m_max];
            // `f64::min` and `f64::max` would also care for NaN.
            for (number, value) in numbers.into_iter().enumerate() {
                low[number] = if value < low[number] { value } else { low[number] };
                high[number] = if value > high[number] { value } else { high[number] };
            }
        }
        Extent { low, high }
    }
}
