//! The footprint's geometry: how wide it is, how it lies on a slope, and what it mixes at an edge.

use super::super::*;
use super::scene::*;
use arborloop_base::Class;

/// Ranges of the rays of the firing straight ahead, the middle one first.
fn rays_m(lidar: &Lidar, scene: &Optics) -> Vec<f64> {
    let motion = standing();
    let around = Surroundings { motion: &motion, optics: scene };
    let story = lidar.explain(Time::SIMULATION_START + lidar.period(), 1800, around).unwrap();
    let mut surfaces = story.surfaces;
    surfaces.sort_by_key(|surface| surface.sub_ray);
    surfaces.iter().map(|surface| surface.range_m).collect()
}

#[test]
fn a_footprint_grows_with_range_by_the_beams_angle() {
    for range_m in [2.0, 5.0, 20.0, 80.0] {
        let scene = optics(vec![plate(range_m, 0.0, 10.0, 0.5, 0.0)], Vec::new());
        for sub_rays in [5, 7, 19, 37] {
            let rays = rays_m(&probe(|spec| spec.sub_rays = sub_rays), &scene);
            assert_eq!(rays.len(), sub_rays as usize);
            let off_m = rays.iter().map(|ray_m| (ray_m * ray_m - range_m * range_m).max(0.0).sqrt());
            // The probe's ten milliradians across: five to each side.
            let widest_m = off_m.fold(0.0, f64::max);
            assert!((widest_m - range_m * 0.005).abs() < 1e-4 * range_m, "{widest_m} m at {range_m} m");
            assert!((rays[0] - range_m).abs() < 1e-9);
        }
    }
}

#[test]
fn a_large_plane_is_measured_alike_by_any_number_of_rays() {
    let turned_rad = 0.5;
    let scene = optics(vec![plate(8.0, 0.0, 6.0, 0.5, turned_rad)], Vec::new());
    let alone = first_sweep(&mut probe(|_| ()), &scene);
    for sub_rays in [5, 7, 19, 37] {
        let wide = first_sweep(&mut probe(|spec| spec.sub_rays = sub_rays), &scene);
        let mut compared = 0;
        for ((a, b), label) in alone.0.returns.iter().zip(&wide.0.returns).zip(&wide.1) {
            // Well inside the rim, which some rays of a footprint pass; it is nearest at -0.45 rad.
            if a.azimuth_rad.abs() > 0.4 || label.class != Class::Post {
                continue;
            }
            let (one_m, many_m) = (a.range_m.unwrap(), b.range_m.unwrap());
            // A ray off by d meets the plane at r (1 + d tan i + ...), and light falls with cos i / r^2, so that near rays
            // weigh more: together at most r d^2 (2 tan^2 i + 1) for the half angle of 5 mrad, and the third order.
            let slope = f64::from(label.incidence_rad).tan();
            let bound_m = one_m * 0.005_f64.powi(2) * (2.0 * slope * slope + 1.0) + 1e-5;
            assert!(
                (one_m - many_m).abs() < bound_m,
                "{sub_rays} rays: {one_m} {many_m}, may be {bound_m} off"
            );
            assert!((a.intensity - b.intensity).abs() <= 1.0);
            assert!(!label.mixed, "{label:?}");
            compared += 1;
        }
        assert!(compared > 200, "{compared}");
    }
}

#[test]
fn at_grazing_incidence_the_footprint_is_as_long_as_its_angles_cut_from_the_plane() {
    let range_m = 10.0;
    for turned_deg in [0.0, 45.0, 70.0, 80.0] {
        let turned_rad = f64::to_radians(turned_deg);
        let scene = optics(vec![plate(range_m, 0.0, 8.0, 0.5, turned_rad)], Vec::new());
        let rays = rays_m(&probe(|spec| spec.sub_rays = 5), &scene);
        let (least_m, most_m) =
            (rays.iter().copied().fold(f64::MAX, f64::min), rays.iter().copied().fold(0.0, f64::max));
        // A ray off by d across meets the plane at r cos i / cos(i + d); off by d upward at r / cos d.
        let across = |off_rad: f64| range_m * turned_rad.cos() / (turned_rad + off_rad).cos();
        let ends = [across(0.005), across(-0.005), range_m / 0.005_f64.cos(), range_m];
        let wanted_m =
            ends.iter().copied().fold(0.0, f64::max) - ends.iter().copied().fold(f64::MAX, f64::min);
        assert!(
            (most_m - least_m - wanted_m).abs() < 2e-4,
            "{turned_deg} deg: {}, wanted {wanted_m}",
            most_m - least_m
        );
        // One plane is one echo of one object, however far its ranges spread within the pulse.
        let returns = ahead(&mut probe(|spec| spec.sub_rays = 5), &scene);
        let [(one, label)] = returns.as_slice() else { panic!("{returns:?}") };
        assert!(!label.mixed, "{turned_deg} deg: {label:?}");
        assert!((one.range_m.unwrap() - range_m).abs() < 0.01 * (1.0 + turned_rad.tan()));
    }
}

#[test]
fn a_ghost_wanders_from_the_far_plate_to_the_near_one_as_the_edge_crosses_the_beam() {
    let mut before_m = f64::INFINITY;
    let mut ghosts = 0;
    for step in 0..=24 {
        // The near plate's right edge moves from left of the beam to its right.
        let edge_m = 0.06 - 0.005 * f64::from(step);
        let scene = optics(
            vec![plate(10.0, 1.0 + edge_m, 1.0, 0.5, 0.0), plate(10.8, 0.0, 3.0, 0.5, 0.0)],
            Vec::new(),
        );
        let returns = ahead(&mut probe(|spec| spec.sub_rays = 37), &scene);
        let [(one, label)] = returns.as_slice() else { panic!("{returns:?}") };
        let range_m = one.range_m.unwrap();
        assert!(
            range_m < before_m + 1e-9 && (9.999..10.801).contains(&range_m),
            "{range_m} after {before_m}"
        );
        // Between the plates there is nothing: a return there says that it is mixed.
        let between = (10.01..10.79).contains(&range_m);
        assert!(label.mixed || !between, "{label:?}");
        ghosts += usize::from(between);
        before_m = range_m;
    }
    assert!(ghosts > 8 && (before_m - 10.0).abs() < 1e-3, "{ghosts} ghosts, the last at {before_m} m");
}

#[test]
fn without_a_footprint_no_edge_makes_a_ghost() {
    for step in 0..=24 {
        let edge_m = 0.06 - 0.005 * f64::from(step);
        let scene = optics(
            vec![plate(10.0, 1.0 + edge_m, 1.0, 0.5, 0.0), plate(10.4, 0.0, 3.0, 0.5, 0.0)],
            Vec::new(),
        );
        let (sweep, labels) = first_sweep(&mut probe(|_| ()), &scene);
        assert!(labels.iter().all(|label| !label.mixed));
        for one in sweep.returns.iter().filter(|one| one.azimuth_rad.abs() < 0.05) {
            let flat_m = one.range_m.unwrap() * one.azimuth_rad.cos();
            assert!((flat_m - 10.0).abs() < 1e-3 || (flat_m - 10.4).abs() < 1e-3, "{flat_m}");
        }
    }
}

#[test]
fn a_wire_thinner_than_the_beam_is_seen_as_far_as_its_share_of_the_light_reaches() {
    // A strip of two rays' width in front of the sky: the energy that comes back is its rays' share of a full plate's.
    let scene = |radius_m: f64| optics(vec![plate(20.0, 0.0, radius_m, 0.5, 0.0)], Vec::new());
    let full = ahead(&mut probe(|spec| (spec.sub_rays, spec.reach_m) = (7, 1e4)), &scene(2.0));
    let thin = ahead(&mut probe(|spec| (spec.sub_rays, spec.reach_m) = (7, 1e4)), &scene(0.01));
    // Only the middle ray meets a disc of a centimeter; its share is 1 / (1 + 6 / e^2).
    let share = 1.0 / (1.0 + 6.0 * (-2.0_f64).exp());
    assert_eq!((full[0].0.intensity, thin[0].0.intensity), (50.0, (50.0 * share).round() as f32));
    // 10 % reflectance reaches 40 m; half of the light's share of 50 % less far.
    let reach_m =
        |reach_m: f64| ahead(&mut probe(|spec| (spec.sub_rays, spec.reach_m) = (7, reach_m)), &scene(0.01));
    let just = 20.0 / (5.0 * share).sqrt();
    assert!(reach_m(just * 1.01)[0].0.range_m.is_some() && reach_m(just * 0.99)[0].0.range_m.is_none());
}
