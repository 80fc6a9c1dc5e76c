//! The footprint of a beam: rays over the ellipse of its divergence, each with its share of the light.

use std::f64::consts::TAU;

/// How many rays a footprint may have: one in the middle and whole rings around it.
pub(super) const PATTERNS: [u32; 5] = [1, 5, 7, 19, 37];

/// One ray of a footprint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SubRay {
    /// Off the middle, counter-clockwise seen from above, radians across the beam.
    pub(super) across_rad: f64,
    /// Off the middle, upward, radians.
    pub(super) up_rad: f64,
    /// Share of the beam's light; all shares add up to 1.
    pub(super) share: f64,
}

/// The rays of a beam with a full angle across and along the spin axis, at whose edge the intensity is `edge_ratio` of
/// the middle's. The outermost ring lies where a Gaussian beam is down to 1/e^2; shares follow the Gaussian.
pub(super) fn footprint(sub_rays: u32, divergence_mrad: [f64; 2], edge_ratio: f64) -> Vec<SubRay> {
    // Rays of each ring from the inside out.
    let rings: &[u32] = match sub_rays {
        5 => &[4],
        7 => &[6],
        19 => &[6, 12],
        37 => &[6, 12, 18],
        _ => &[],
    };
    // The intensity at `r` times the half angle is edge_ratio^(r^2): 1/e^2 is reached at this r.
    let outermost = (2.0 / -edge_ratio.ln()).sqrt();
    let half_rad = divergence_mrad.map(|full| full * 0.5e-3);
    let mut rays = vec![SubRay { across_rad: 0.0, up_rad: 0.0, share: 1.0 }];
    for (ring, count) in rings.iter().enumerate() {
        let reach = outermost * (ring + 1) as f64 / rings.len() as f64;
        for n in 0..*count {
            let (sin, cos) = (TAU * f64::from(n) / f64::from(*count)).sin_cos();
            rays.push(SubRay {
                across_rad: half_rad[0] * reach * cos,
                up_rad: half_rad[1] * reach * sin,
                share: edge_ratio.powf(reach * reach),
            });
        }
    }
    let whole: f64 = rays.iter().map(|ray| ray.share).sum();
    rays.iter_mut().for_each(|ray| ray.share /= whole);
    rays
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_and_the_pattern_is_centered_within_the_beams_edge() {
        for sub_rays in PATTERNS {
            let rays = footprint(sub_rays, [3.0, 1.5], (-2.0_f64).exp());
            assert_eq!(rays.len(), sub_rays as usize);
            assert_eq!((rays[0].across_rad, rays[0].up_rad), (0.0, 0.0));
            let sum = |of: fn(&SubRay) -> f64| rays.iter().map(of).sum::<f64>();
            assert!((sum(|ray| ray.share) - 1.0).abs() < 1e-12);
            assert!(sum(|ray| ray.across_rad * ray.share).abs() < 1e-15);
            assert!(sum(|ray| ray.up_rad * ray.share).abs() < 1e-15);
            for ray in &rays {
                let out = (ray.across_rad / 1.5e-3).hypot(ray.up_rad / 0.75e-3);
                assert!(out < 1.0 + 1e-9, "{ray:?}");
                // A Gaussian beam: 1/e^2 at the edge.
                let law = rays[0].share * (-2.0 * out * out).exp();
                assert!((ray.share - law).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_full_width_at_half_maximum_is_widened_to_the_edge_at_one_over_e_squared() {
        let rays = footprint(5, [2.27, 2.27], 0.5);
        // sqrt(2 / ln 2) half widths.
        assert!((rays[1].across_rad - 0.5 * 2.27e-3 * (2.0 / 2.0_f64.ln()).sqrt()).abs() < 1e-15);
        assert!((rays[1].share / rays[0].share - (-2.0_f64).exp()).abs() < 1e-12);
    }
}
