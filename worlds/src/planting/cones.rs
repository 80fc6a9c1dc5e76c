//! Traffic cones around a walked rectangle: the paper's controlled experiment, trunks that cannot be argued with.

use crate::Solid;
use crate::shape::Frustum;
use crate::spec::ConesSpec;
use crate::terrain::Terrain;
use arborloop_base::{Class, Seed};
use nalgebra::{Point2, Point3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Where the cones stand, world frame. They follow the curve at the clearance around the rectangle, unevenly spaced,
/// each from its own address of the stream `world/cones`.
pub fn places(field: &ConesSpec, seed: Seed) -> Vec<Point2<f64>> {
    let stream = seed.stream("world/cones");
    let spacing_m = ring_length_m(field) / field.count as f64;
    (0..field.count)
        .map(|index| {
            let mut draws = stream.at(index as u64);
            let uneven = draws.within(-1.0, 1.0) * field.spacing_variation_ratio;
            let place = ring_point(field, (index as f64 + 0.5 + uneven) * spacing_m);
            let jitter = |unit: f64| (2.0 * unit - 1.0) * field.jitter_m;
            Point2::new(place.x + jitter(draws.unit()), place.y + jitter(draws.unit()))
        })
        .collect()
}

/// The cones' pieces, cone by cone, each square to the ground under it.
pub(crate) fn solids(field: &ConesSpec, terrain: &Terrain, seed: Seed) -> Vec<Solid> {
    places(field, seed)
        .iter()
        .enumerate()
        .flat_map(|(index, place)| {
            let ground = Point3::new(place.x, place.y, terrain.height_m(place.x, place.y));
            let up = terrain.normal(place.x, place.y);
            let plate = Frustum {
                base: ground,
                axis: up,
                height_m: field.plate_height_m,
                radius_base_m: field.plate_radius_m,
                radius_top_m: field.plate_radius_m,
            };
            let body = Frustum {
                base: plate.center(plate.height_m),
                axis: up,
                height_m: field.height_m - field.plate_height_m,
                radius_base_m: field.base_radius_m,
                radius_top_m: field.top_radius_m,
            };
            let mut pieces = vec![(plate, field.reflectivity_ratio)];
            pieces.extend(body_pieces(&body, field));
            pieces.into_iter().map(move |(shape, reflectivity_ratio)| Solid {
                class: Class::Cone,
                instance: index as u32 + 1,
                shape,
                reflectivity_ratio,
            })
        })
        .collect()
}

/// The body in one piece, or below, at and above the collar.
fn body_pieces(body: &Frustum, field: &ConesSpec) -> Vec<(Frustum, f64)> {
    if field.collar_reflectivity_ratio <= 0.0 {
        return vec![(*body, field.reflectivity_ratio)];
    }
    let [low_m, high_m] = COLLAR.map(|share| share * body.height_m);
    vec![
        (body.part(0.0, low_m), field.reflectivity_ratio),
        (body.part(low_m, high_m), field.collar_reflectivity_ratio),
        (body.part(high_m, body.height_m), field.reflectivity_ratio),
    ]
}

/// Where the collar begins and ends as shares of the body's height; assumed: the upper of the usual two bands.
const COLLAR: [f64; 2] = [0.6, 0.8];

/// Length of the curve at the clearance around the rectangle: four sides and a full circle at the corners.
fn ring_length_m(field: &ConesSpec) -> f64 {
    2.0 * (field.length_m + field.width_m) + 2.0 * PI * field.clearance_m
}

/// The point at a distance along that curve, counter-clockwise from below the corner (0, 0).
fn ring_point(field: &ConesSpec, along_m: f64) -> Point2<f64> {
    let (length, width, clearance) = (field.length_m, field.width_m, field.clearance_m);
    let corners = [(length, 0.0), (length, width), (0.0, width), (0.0, 0.0)];
    let mut left_m = along_m.rem_euclid(ring_length_m(field));
    for (side, (corner_x, corner_y)) in corners.into_iter().enumerate() {
        let side_m = if side % 2 == 0 { length } else { width };
        // Outward normal of this side, and the direction of travel along it.
        let (normal_y, normal_x) = (side as f64 * FRAC_PI_2 - FRAC_PI_2).sin_cos();
        let back_m = side_m - left_m;
        if back_m >= 0.0 {
            let (travel_x, travel_y) = (-normal_y, normal_x);
            return Point2::new(
                corner_x + clearance * normal_x - back_m * travel_x,
                corner_y + clearance * normal_y - back_m * travel_y,
            );
        }
        left_m -= side_m;
        if left_m < FRAC_PI_2 * clearance {
            let (sin, cos) = (side as f64 * FRAC_PI_2 - FRAC_PI_2 + left_m / clearance).sin_cos();
            return Point2::new(corner_x + clearance * cos, corner_y + clearance * sin);
        }
        left_m -= FRAC_PI_2 * clearance;
    }
    Point2::new(0.0, -clearance)
}
