//! Echoes: what comes back of the surfaces in a footprint, before the sensor decides what to report.
//!
//! The energy of a surface is share of light x reflectance x cos(incidence) / range^2, in units of what a white facing
//! surface that fills the beam sends back from a meter. Surfaces nearer to each other than the pulse is long are one
//! echo at the mean of their ranges, weighted by energy: at an edge that is a point where nothing stands.

use super::cast::Surface;
use crate::optics::Hit;
use arborloop_base::Label;

/// One echo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Echo {
    /// Along the beam, meters.
    pub(super) range_m: f64,
    /// What comes back.
    pub(super) energy: f64,
    /// What the sensor makes of the energy once it has put the range right: 1 for a white facing surface.
    pub(super) brightness: f64,
    /// What it is of, before noise.
    pub(super) label: Label,
}

/// Surfaces are never taken to be nearer than this, meters: the energy stays finite.
const RANGE_MIN_M: f64 = 0.05;

/// Reflectance toward the sensor: Lambert's cosine, but a retro-reflector shines from wherever it is seen.
pub(super) fn brightness(hit: &Hit) -> f64 {
    if hit.reflectivity_ratio > 1.0 {
        hit.reflectivity_ratio
    } else {
        hit.reflectivity_ratio * hit.cos_incidence
    }
}

/// What comes back of a surface.
pub(super) fn energy(surface: &Surface) -> f64 {
    let range_m = surface.hit.range_m.max(RANGE_MIN_M);
    surface.share * brightness(&surface.hit) / (range_m * range_m)
}

/// Sorts the surfaces by range and joins them to echoes, nearest first. `width_rad` is the footprint's full angle.
pub(super) fn form(surfaces: &mut [Surface], length_m: f64, width_rad: f64, echoes: &mut Vec<Echo>) {
    echoes.clear();
    surfaces.sort_unstable_by(|a, b| {
        let place = |surface: &Surface| (surface.sub_ray, surface.layer);
        a.hit.range_m.total_cmp(&b.hit.range_m).then_with(|| place(a).cmp(&place(b)))
    });
    let mut first = 0;
    for next in 1..=surfaces.len() {
        let apart = surfaces
            .get(next)
            .is_none_or(|surface| surface.hit.range_m - surfaces[next - 1].hit.range_m >= length_m);
        if apart {
            echoes.push(join(&surfaces[first..next], width_rad));
            first = next;
        }
    }
}

/// The echo of a surface that nothing is near.
#[inline(always)]
pub(super) fn alone(surface: &Surface) -> Echo {
    Echo {
        range_m: surface.hit.range_m,
        energy: energy(surface),
        brightness: surface.share * brightness(&surface.hit),
        label: label_of(&surface.hit),
    }
}

fn join(members: &[Surface], width_rad: f64) -> Echo {
    if let [only] = members {
        return alone(only);
    }
    let sum = |of: fn(&Surface) -> f64| members.iter().map(of).sum::<f64>();
    let total = sum(energy);
    let moment = sum(|surface| energy(surface) * surface.hit.range_m);
    let range_m = if total > 0.0 { moment / total } else { members[0].hit.range_m };
    let same = |a: &Surface, b: &Surface| (a.hit.class, a.hit.instance) == (b.hit.class, b.hit.instance);
    // The echo is of the object that sends most of it, and looks like the brightest piece of that object.
    let of_object = |one: &Surface| members.iter().filter(|other| same(one, other)).map(energy).sum::<f64>();
    let mut chief = &members[0];
    for one in &members[1..] {
        let more = of_object(one).total_cmp(&of_object(chief)).then(energy(one).total_cmp(&energy(chief)));
        if more.is_gt() {
            chief = one;
        }
    }
    let spread_m = members[members.len() - 1].hit.range_m - members[0].hit.range_m;
    let mixed = members.iter().any(|one| !same(one, chief)) || spread_m > tilt_m(chief, width_rad);
    Echo {
        range_m,
        energy: total,
        brightness: sum(|surface| surface.share * brightness(&surface.hit)),
        label: Label { range_m: range_m as f32, mixed, ..label_of(&chief.hit) },
    }
}

/// How much of a spread of ranges one plane at this incidence explains, twice over, and two centimeters.
fn tilt_m(surface: &Surface, width_rad: f64) -> f64 {
    let cos = surface.hit.cos_incidence.max(0.01);
    2.0 * surface.hit.range_m * width_rad * (1.0 - cos * cos).max(0.0).sqrt() / cos + 0.02
}

#[inline(always)]
pub(super) fn label_of(hit: &Hit) -> Label {
    Label {
        class: hit.class,
        instance: hit.instance,
        range_m: hit.range_m as f32,
        incidence_rad: angle_of(hit.cos_incidence) as f32,
        mixed: false,
        displaced_m: hit.displacement_m.norm() as f32,
    }
}

/// The angle of a cosine in [0, 1] to 2e-8 rad, less than a label resolves (Abramowitz and Stegun 4.4.46).
#[inline(always)]
fn angle_of(cos: f64) -> f64 {
    const C: [f64; 8] = [
        1.570_796_305_0,
        -0.214_598_801_6,
        0.088_978_987_4,
        -0.050_174_304_6,
        0.030_891_881_0,
        -0.017_088_125_6,
        0.006_670_090_1,
        -0.001_262_491_1,
    ];
    let series = C.iter().rev().fold(0.0, |sum, c| sum * cos + c);
    (1.0 - cos).max(0.0).sqrt() * series
}

#[cfg(test)]
mod tests {
    use super::angle_of;

    #[test]
    fn an_angle_is_its_cosine_s() {
        let cosines = (0..=10_000).map(|n| f64::from(n) / 10_000.0);
        let worst = cosines.map(|cos| (angle_of(cos) - cos.acos()).abs()).fold(0.0, f64::max);
        assert!(worst < 3e-8, "{worst} rad");
    }
}
