//! Pictures of a world, cast with the same rays as the lidar's: what a person recognizes, beams meet.

mod camera;
mod picture;
mod sweep;

pub(crate) use camera::Camera;
pub(crate) use picture::Picture;
pub(crate) use sweep::range_image;

use arborloop_base::{Class, Time};
use arborloop_sim::optics::{Hit, Optics, Ray};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Rays per pixel along each side.
const SAMPLES: usize = 2;
const SKY: [f64; 3] = [0.72, 0.82, 0.93];
/// Light that comes from everywhere, as a share.
const AMBIENT_RATIO: f64 = 0.45;

/// What the camera sees at an instant, in sunlight.
pub(crate) fn render(optics: &Optics, camera: &Camera, stamp: Time) -> Picture {
    let [width, height] = camera.size();
    let toward_sun = Vector3::new(0.45, -0.35, 0.82).normalize();
    let rows: Vec<Vec<[u8; 3]>> = (0..height)
        .into_par_iter()
        .map(|row| {
            let offsets = (0..SAMPLES).flat_map(|v| (0..SAMPLES).map(move |u| [u, v]));
            let rays: Vec<Ray> = offsets
                .flat_map(|[u, v]| {
                    let inside = |n: usize| (n as f64 + 0.5) / SAMPLES as f64;
                    (0..width).map(move |column| {
                        camera.ray(column as f64 + inside(u), row as f64 + inside(v), stamp)
                    })
                })
                .collect();
            let (mut hits, mut shades) = (Vec::new(), Vec::new());
            optics.cast_all(&rays, &mut hits);
            // A ray that met nothing casts its shadow ray from far above everything: into the light.
            let shadows: Vec<Ray> = rays
                .iter()
                .zip(&hits)
                .map(|(ray, hit)| Ray {
                    origin: hit.map_or(ray.origin + Vector3::z() * 1e4, |hit| {
                        ray.origin + ray.direction * (hit.range_m - 1e-3)
                    }),
                    direction: toward_sun,
                    range_m_min: 0.01,
                    range_m_max: 60.0,
                    ..*ray
                })
                .collect();
            optics.cast_all(&shadows, &mut shades);
            (0..width)
                .map(|column| {
                    let mut sum = [0.0; 3];
                    for sample in 0..SAMPLES * SAMPLES {
                        let index = sample * width + column;
                        let color = color(hits[index].as_ref(), shades[index].is_some());
                        sum.iter_mut().zip(color).for_each(|(sum, part)| *sum += part);
                    }
                    // Gamma 2.2: equal steps of light are not equal steps of a screen.
                    sum.map(|part| ((part / (SAMPLES * SAMPLES) as f64).powf(1.0 / 2.2) * 255.0) as u8)
                })
                .collect()
        })
        .collect();
    Picture::new(width, height, rows.concat())
}

/// Linear light of what a ray met.
fn color(hit: Option<&Hit>, in_shade: bool) -> [f64; 3] {
    let Some(hit) = hit else { return SKY.map(|part: f64| part.powf(2.2)) };
    let light = AMBIENT_RATIO + if in_shade { 0.0 } else { 1.0 - AMBIENT_RATIO };
    let bright = light * (0.35 + 0.65 * hit.cos_incidence);
    base_color(hit).map(|part| part.powf(2.2) * bright)
}

/// Colors that a person expects, as on a screen.
pub(crate) fn base_color(hit: &Hit) -> [f64; 3] {
    match hit.class {
        Class::Cone if hit.reflectivity_ratio > 1.0 => [0.97, 0.97, 0.97],
        class => class_color(class),
    }
}

/// The color of a class, as on a screen.
pub(crate) fn class_color(class: Class) -> [f64; 3] {
    match class {
        Class::Ground => [0.66, 0.55, 0.42],
        Class::Grass => [0.50, 0.66, 0.30],
        Class::Trunk => [0.44, 0.31, 0.20],
        Class::Branch => [0.52, 0.38, 0.26],
        Class::Leaf => [0.20, 0.50, 0.18],
        Class::Cone => [0.95, 0.42, 0.10],
        Class::Post => [0.78, 0.74, 0.68],
        Class::Wire => [0.35, 0.37, 0.40],
        Class::Robot => [0.20, 0.24, 0.32],
        _ => SKY,
    }
}
