//! Echoes and returns: edges, leaves, brightness, reach, rounding.

use super::super::*;
use super::scene::*;
use arborloop_base::Class;

#[test]
fn an_edge_within_the_footprint_and_the_pulse_is_one_ghost_between_the_two_plates() {
    let mut lidar = probe(|spec| spec.sub_rays = 7);
    // The near plate's edge stands one milliradian to the left: three of six outer rays meet it.
    let scene = optics(vec![plate(10.0, 1.01, 1.0, 0.5, 0.0), plate(10.4, 0.0, 3.0, 0.5, 0.0)], Vec::new());
    let returns = ahead(&mut lidar, &scene);
    let [(one, label)] = returns.as_slice() else { panic!("{returns:?}") };
    let outer = (-2.0_f64).exp();
    let (near, far) = (3.0 * outer / 10.0_f64.powi(2), (1.0 + 3.0 * outer) / 10.4_f64.powi(2));
    let mean_m = (near * 10.0 + far * 10.4) / (near + far);
    assert!((one.range_m.unwrap() - mean_m).abs() < 2e-3, "{one:?}, wanted {mean_m}");
    assert!(label.mixed && label.class == Class::Post && label.instance == 10, "{label:?}");
    assert!((f64::from(label.range_m) - one.range_m.unwrap()).abs() < 1e-5);
}

#[test]
fn an_edge_wider_apart_than_the_pulse_gives_two_returns_and_no_ghost() {
    let scene =
        || optics(vec![plate(10.0, 1.01, 1.0, 0.5, 0.0), plate(13.0, 0.0, 3.0, 0.5, 0.0)], Vec::new());
    let ranges = |returns: EchoChoice| -> Vec<f64> {
        let mut lidar = probe(|spec| (spec.sub_rays, spec.returns) = (7, returns));
        let given = ahead(&mut lidar, &scene());
        assert!(given.iter().enumerate().all(|(n, (one, label))| one.number == n as u8 && !label.mixed));
        given.iter().map(|(one, _)| one.range_m.unwrap()).collect()
    };
    let close = |found: &[f64], wanted: &[f64]| {
        assert_eq!(found.len(), wanted.len(), "{found:?}, wanted {wanted:?}");
        found
            .iter()
            .zip(wanted)
            .for_each(|(a, b)| assert!((a - b).abs() < 1e-3, "{found:?}, wanted {wanted:?}"));
    };
    close(&ranges(EchoChoice::Dual), &[10.0, 13.0]);
    close(&ranges(EchoChoice::First), &[10.0]);
    close(&ranges(EchoChoice::Last), &[13.0]);
    // Four and a half outer shares against one and three halves: the far plate sends more.
    close(&ranges(EchoChoice::Strongest), &[13.0]);
}

#[test]
fn a_wall_behind_a_leaf_is_its_last_return() {
    let scene = optics(vec![plate(10.0, 0.0, 3.0, 0.9, 0.0)], vec![leaf(5.0)]);
    for sub_rays in [1, 5] {
        let of = |returns| {
            let mut lidar = probe(|spec| (spec.sub_rays, spec.returns) = (sub_rays, returns));
            let given = ahead(&mut lidar, &scene);
            given
                .into_iter()
                .map(|(one, label)| (one.range_m.unwrap().round(), label.class))
                .collect::<Vec<_>>()
        };
        assert_eq!(of(EchoChoice::Strongest), [(5.0, Class::Leaf)]);
        assert_eq!(of(EchoChoice::Last), [(10.0, Class::Post)]);
        assert_eq!(of(EchoChoice::Dual), [(5.0, Class::Leaf), (10.0, Class::Post)]);
    }
    // What comes through is the leaf's transmittance: 44 % of the wall's 90 %, and half of the light of the leaf.
    let mut lidar = probe(|spec| spec.returns = EchoChoice::Dual);
    let bytes: Vec<f32> = ahead(&mut lidar, &scene).iter().map(|(one, _)| one.intensity).collect();
    assert_eq!(bytes, [50.0, 40.0]);
}

#[test]
fn the_byte_is_reflectance_times_the_cosine_and_a_retro_reflector_exceeds_a_hundred() {
    for (reflectivity_ratio, turned_deg) in [(0.1, 0.0), (0.5, 0.0), (0.5, 30.0), (0.9, 60.0), (1.6, 40.0)] {
        let turned_rad = f64::to_radians(turned_deg);
        let scene = optics(vec![plate(5.0, 0.0, 2.0, reflectivity_ratio, turned_rad)], Vec::new());
        for sub_rays in [1, 19] {
            let returns = ahead(&mut probe(|spec| spec.sub_rays = sub_rays), &scene);
            let [(one, label)] = returns.as_slice() else { panic!("{returns:?}") };
            let retro = reflectivity_ratio > 1.0;
            let law = 100.0 * reflectivity_ratio * if retro { 1.0 } else { turned_rad.cos() };
            // The outer rays of a footprint see a turned plate at slightly other angles.
            assert!((f64::from(one.intensity) - law).abs() <= if sub_rays == 1 { 0.5 } else { 1.5 });
            assert!(one.intensity > 100.0 || !retro);
            assert!((f64::from(label.incidence_rad) - turned_rad).abs() < 0.006);
        }
    }
}

#[test]
fn a_target_is_seen_as_far_as_its_reflectance_reaches_and_missed_beyond() {
    for reflectivity_ratio in [0.025, 0.1, 0.4] {
        // 10 % reaches 40 m; energy falls with the square of the range.
        let reach_m = 40.0 * f64::sqrt(reflectivity_ratio / 0.1);
        for (range_m, seen) in [(reach_m - 0.1, true), (reach_m + 0.1, false)] {
            let scene = optics(vec![plate(range_m, 0.0, 3.0, reflectivity_ratio, 0.0)], Vec::new());
            let returns = ahead(&mut probe(|_| ()), &scene);
            let [(one, label)] = returns.as_slice() else { panic!("{returns:?}") };
            assert_eq!(one.range_m.is_some(), seen, "{reflectivity_ratio} at {range_m} m");
            // The truth knows what the sensor did not see.
            assert_eq!(label.class, Class::Post);
        }
    }
    let empty = ahead(&mut probe(|_| ()), &optics(Vec::new(), Vec::new()));
    assert_eq!((empty[0].0.range_m, empty[0].1.class), (None, Class::Sky));
}

#[test]
fn what_is_nearer_than_the_sensor_reports_gives_a_miss() {
    let near = ahead(&mut probe(|_| ()), &optics(vec![plate(0.3, 0.0, 1.0, 0.5, 0.0)], Vec::new()));
    assert_eq!((near[0].0.range_m, near[0].1.class), (None, Class::Post));
}

#[test]
fn ranges_and_bearings_of_a_plain_lidar_are_whole_steps() {
    let text = probe_text("range_noise_m = 0.0", "range_noise_m = 0.03\nrange_step_m = 0.04");
    let text = text.replace("columns = 3600", "azimuth_step_deg = 0.25\ncolumns = 3600");
    let own = model(&text).unwrap();
    let mut lidar = probe(|spec| *spec = LidarSpec { dropout_ratio: 0.0, ..LidarSpec::of(own.clone()) });
    let scene = optics(vec![plate(7.0, 0.0, 5.0, 0.5, 0.0)], Vec::new());
    let (sweep, _) = first_sweep(&mut lidar, &scene);
    let hits: Vec<_> = sweep.returns.iter().filter(|one| one.range_m.is_some()).collect();
    assert!(hits.len() > 500);
    for one in hits {
        let whole = |value: f64| (value - value.round()).abs() < 1e-9;
        assert!(whole(one.range_m.unwrap() / 0.04) && whole(one.azimuth_rad.to_degrees() / 0.25), "{one:?}");
    }
}

#[test]
fn noise_grows_toward_the_reach_as_photons_count() {
    let scene = |range_m| optics(vec![plate(range_m, 0.0, 60.0, 0.1, 0.0)], Vec::new());
    for range_m in [10.0, 20.0, 39.0] {
        let mut lidar = probe(|spec| (spec.range_noise_m, spec.weak_noise_ratio) = (0.01, 5.0));
        let (sweep, labels) = first_sweep(&mut lidar, &scene(range_m));
        // Bearings within ten degrees: the plate faces them almost, so that all are as bright.
        let met = sweep.returns.iter().zip(&labels).filter(|(one, _)| one.azimuth_rad.abs() < 0.17);
        let errors: Vec<f64> =
            met.filter_map(|(one, label)| Some(one.range_m? - f64::from(label.range_m))).collect();
        let n = errors.len() as f64;
        // sigma^2 (1 + 24 r^2 / 40^2): brightness varies by 3 % over these bearings.
        let law = 0.01_f64.powi(2) * (1.0 + 24.0 * range_m * range_m / 1600.0);
        let variance = errors.iter().map(|error| error * error).sum::<f64>() / n;
        assert!(n > 150.0, "{n} returns at {range_m} m");
        assert!((variance / law - 1.0).abs() < 4.0 * (2.0 / n).sqrt() + 0.06, "{variance} against {law}");
    }
}

#[test]
fn footprints_and_second_returns_are_the_same_bits_at_any_number_of_threads() {
    let scene = optics(vec![plate(9.0, 1.0, 2.0, 0.5, 0.3)], vec![leaf(5.0), leaf(6.5)]);
    let at = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut lidar = probe(|spec| {
                (spec.sub_rays, spec.returns, spec.range_noise_m) = (19, EchoChoice::Dual, 0.02);
            });
            first_sweep(&mut lidar, &scene).0
        })
    };
    let alone = at(1);
    assert!(alone.returns.iter().any(|one| one.number == 1));
    assert_eq!(alone, at(2));
    assert_eq!(alone, at(8));
}

#[test]
fn the_story_of_a_firing_ends_with_what_the_sweep_holds() {
    let scene =
        optics(vec![plate(10.0, 1.01, 1.0, 0.5, 0.0), plate(10.4, 0.0, 3.0, 0.5, 0.0)], vec![leaf(5.0)]);
    let mut lidar = probe(|spec| (spec.sub_rays, spec.returns) = (7, EchoChoice::Dual));
    let (sweep, _) = first_sweep(&mut lidar, &scene);
    let motion = standing();
    let around = Surroundings { motion: &motion, optics: &scene };
    let end = Time::SIMULATION_START + lidar.period();
    assert_eq!(lidar.firings(end), 3600);
    let mut told = Vec::new();
    for firing in 1700..1900 {
        let story = lidar.explain(end, firing, around).unwrap();
        let share: f64 = story.surfaces.iter().map(|surface| surface.energy_ratio).sum();
        assert!(story.surfaces.is_empty() || (share - 1.0).abs() < 1e-9);
        told.extend(story.returns.iter().map(|one| (one.range_m, one.intensity, one.number)));
    }
    let within = Span::from_nanos(1700 * 100_000_000 / 3600)..Span::from_nanos(1900 * 100_000_000 / 3600);
    let held = sweep.returns.iter().filter(|one| within.contains(&one.fired_after));
    assert_eq!(told, held.map(|one| (one.range_m, one.intensity, one.number)).collect::<Vec<_>>());
    assert!(lidar.explain(end, 3600, around).is_none());
    let story = lidar.explain(end, 1800, around).unwrap().to_string();
    for part in ["surfaces", "layer 1", "leaf 1", "mixed", "returned"] {
        assert!(story.contains(part), "`{part}` is missing in\n{story}");
    }
}
