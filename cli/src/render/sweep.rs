//! A sweep as a picture: a column per firing cycle, a band per ring, ranges above and classes below.

use super::{Picture, class_color};
use arborloop_base::{Label, Sweep};
use std::f64::consts::TAU;

const WIDTH: usize = 1440;
const RING_PIXELS: usize = 12;
/// Ranges at and beyond this have the last color, meters.
const FAR_M: f64 = 30.0;
const GAP_PIXELS: usize = 6;
const MISS: [u8; 3] = [24, 24, 28];

/// Straight ahead in the middle, left to the left, the highest ring on top; misses are dark.
pub(crate) fn range_image(sweep: &Sweep, labels: &[Label]) -> Picture {
    let rings = usize::from(sweep.rings.max(1));
    let band = rings * RING_PIXELS;
    let height = 2 * band + GAP_PIXELS;
    let mut pixels = vec![[255; 3]; WIDTH * height];
    pixels[..WIDTH * band].fill(MISS);
    pixels[WIDTH * (band + GAP_PIXELS)..].fill(MISS);
    for (one, label) in sweep.returns.iter().zip(labels).filter(|(one, _)| one.number == 0) {
        let Some(range_m) = one.range_m else { continue };
        let share = (0.5 - one.azimuth_rad / TAU).rem_euclid(1.0);
        let column = ((share * WIDTH as f64) as usize).min(WIDTH - 1);
        let top = (rings - 1 - usize::from(one.ring).min(rings - 1)) * RING_PIXELS;
        for line in top..top + RING_PIXELS {
            pixels[line * WIDTH + column] = heat(range_m / FAR_M);
            let class = class_color(label.class).map(|part| (part * 255.0) as u8);
            pixels[(line + band + GAP_PIXELS) * WIDTH + column] = class;
        }
    }
    Picture::new(WIDTH, height, pixels)
}

/// From warm (near) to cold (far): the viridis map's anchors, reversed.
fn heat(share: f64) -> [u8; 3] {
    const ANCHORS: [[f64; 3]; 5] = [
        [253.0, 231.0, 37.0],
        [94.0, 201.0, 98.0],
        [33.0, 145.0, 140.0],
        [59.0, 82.0, 139.0],
        [68.0, 1.0, 84.0],
    ];
    let at = share.clamp(0.0, 1.0).sqrt() * (ANCHORS.len() - 1) as f64;
    let first = (at as usize).min(ANCHORS.len() - 2);
    let part = at - first as f64;
    std::array::from_fn(|n| (ANCHORS[first][n] + (ANCHORS[first + 1][n] - ANCHORS[first][n]) * part) as u8)
}
