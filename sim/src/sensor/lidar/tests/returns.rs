//! Which echoes become returns: first, last, strongest and dual against each other; misses; noise; seeds.

use super::super::*;
use super::scene::*;
use arborloop_base::{Class, Return, Seed};

/// Plates of all sizes at many ranges, leaves among them.
fn clutter(seed: u64) -> Optics {
    let stream = Seed(seed).stream("test/clutter");
    let plates = (0..60).map(|index| {
        let mut draws = stream.at(index);
        let (range_m, bearing_rad) = (draws.within(3.0, 30.0), draws.within(-3.1, 3.1));
        let (x_m, y_m) = (range_m * bearing_rad.cos(), range_m * bearing_rad.sin());
        plate(
            x_m,
            y_m,
            draws.within(0.05, 1.5),
            draws.within(0.05, 0.9),
            bearing_rad + draws.within(-0.6, 0.6),
        )
    });
    optics(plates.collect(), vec![leaf(4.0), leaf(6.5), leaf(9.0)])
}

/// Returns of each firing, in order.
fn firings(sweep: &Sweep) -> Vec<Vec<Return>> {
    sweep.returns.chunk_by(|a, b| a.fired_after == b.fired_after).map(<[Return]>::to_vec).collect()
}

fn seen(returns: EchoChoice, scene: &Optics) -> Vec<Vec<Return>> {
    firings(&first_sweep(&mut probe(|spec| (spec.sub_rays, spec.returns) = (19, returns)), scene).0)
}

#[test]
fn first_last_strongest_and_dual_are_choices_among_the_same_echoes() {
    let (mut single, mut double, mut second) = (0, 0, 0);
    for seed in 0..3 {
        let scene = clutter(seed);
        let [first, last, strongest, dual] =
            [EchoChoice::First, EchoChoice::Last, EchoChoice::Strongest, EchoChoice::Dual]
                .map(|one| seen(one, &scene));
        assert!([&last, &strongest, &dual].iter().all(|all| all.len() == first.len()));
        for firing in 0..first.len() {
            let range = |all: &[Vec<Return>]| all[firing][0].range_m;
            assert!([&first, &last, &strongest].iter().all(|all| all[firing].len() == 1));
            let (Some(near_m), Some(far_m), Some(strong_m)) =
                (range(&first), range(&last), range(&strongest))
            else {
                // One sees nothing where all see nothing, and says so once.
                assert!([&first, &last, &strongest, &dual].iter().all(|all| all[firing].len() == 1));
                assert!([&first, &last, &strongest, &dual].iter().all(|all| range(all).is_none()));
                continue;
            };
            assert!(near_m <= strong_m && strong_m <= far_m, "{near_m} {strong_m} {far_m}");
            let both: Vec<f64> = dual[firing].iter().filter_map(|one| one.range_m).collect();
            assert_eq!(both.last(), Some(&far_m));
            if near_m == far_m {
                assert_eq!(both, [far_m], "a single echo is one return");
                single += 1;
            } else {
                assert_eq!(both.len(), 2, "{both:?} between {near_m} and {far_m}");
                assert!(both[0] < both[1] && both[0] >= near_m);
                // Beside the last the strongest, or the second strongest where these are one.
                assert!(both[0] == strong_m || strong_m == far_m, "{both:?}, strongest {strong_m}");
                double += 1;
                second += usize::from(strong_m == far_m);
            }
        }
    }
    assert!(single > 1000 && double > 200 && second > 20, "{single} {double} {second}");
}

#[test]
fn of_three_surfaces_dual_gives_the_strongest_and_the_last_and_leaves_the_third_out() {
    // Of nineteen rays three of the outer ring meet the first plate and three the second, each time 6.5 % of the light.
    for (reflectivity_ratio, strongest_m, dual_m) in [
        // The last is the strongest: beside it stands the second strongest.
        ([0.9, 0.2, 0.3], 14.0, [8.0, 14.0]),
        ([0.1, 0.9, 0.05], 11.0, [11.0, 14.0]),
        ([0.9, 0.2, 0.05], 8.0, [8.0, 14.0]),
    ] {
        let [near, middle, far] = reflectivity_ratio;
        let plates = vec![
            plate(8.0, 1.03, 1.0, near, 0.0),
            plate(11.0, -1.03, 1.0, middle, 0.0),
            plate(14.0, 0.0, 3.0, far, 0.0),
        ];
        let scene = optics(plates, Vec::new());
        let of = |returns| {
            let change =
                |spec: &mut LidarSpec| (spec.sub_rays, spec.returns, spec.reach_m) = (19, returns, 1e4);
            let given = ahead(&mut probe(change), &scene);
            given.iter().map(|(one, _)| one.range_m.unwrap().round()).collect::<Vec<_>>()
        };
        assert_eq!((of(EchoChoice::First), of(EchoChoice::Last)), (vec![8.0], vec![14.0]));
        assert_eq!((of(EchoChoice::Strongest), of(EchoChoice::Dual)), (vec![strongest_m], dual_m.to_vec()));
    }
}

#[test]
fn an_echo_below_the_sensors_sight_is_none_and_the_strong_one_stays() {
    // A plate's rim takes a sixth of the footprint; the wall behind takes the rest.
    let scene = optics(vec![plate(8.0, 1.03, 1.0, 0.1, 0.0), plate(12.0, 0.0, 3.0, 0.9, 0.0)], Vec::new());
    let of = |reach_m| {
        let change = |spec: &mut LidarSpec| {
            (spec.sub_rays, spec.returns, spec.reach_m) = (37, EchoChoice::Dual, reach_m);
        };
        ahead(&mut probe(change), &scene)
            .iter()
            .filter_map(|(one, _)| one.range_m)
            .map(f64::round)
            .collect::<Vec<_>>()
    };
    assert_eq!(of(1000.0), [8.0, 12.0]);
    assert_eq!(of(12.0), [12.0]);
    assert_eq!(of(2.0), Vec::<f64>::new());
}

#[test]
fn every_firing_is_in_the_sweep_once_whether_it_met_something_or_not() {
    for scene in [optics(Vec::new(), Vec::new()), clutter(1)] {
        for returns in [EchoChoice::First, EchoChoice::Last, EchoChoice::Strongest, EchoChoice::Dual] {
            let (sweep, labels) =
                first_sweep(&mut probe(|spec| (spec.sub_rays, spec.returns) = (7, returns)), &scene);
            assert_eq!(sweep.returns.iter().filter(|one| one.number == 0).count(), 3600);
            assert_eq!(labels.len(), sweep.returns.len());
            for (one, label) in sweep.returns.iter().zip(&labels) {
                match one.range_m {
                    // A miss keeps its direction and says no brightness.
                    None => assert!(one.number == 0 && one.intensity == 0.0 && one.azimuth_rad.is_finite()),
                    Some(_) => assert!(one.intensity >= 1.0 && label.class != Class::Sky),
                }
                assert!(label.class != Class::Sky || one.range_m.is_none());
            }
        }
    }
}

#[test]
fn the_byte_of_a_surface_is_the_same_at_every_range() {
    for range_m in [1.0, 5.0, 20.0, 80.0] {
        let scene = optics(vec![plate(range_m, 0.0, 4.0, 0.45, 0.0)], Vec::new());
        for sub_rays in [1, 37] {
            let returns = ahead(&mut probe(|spec| (spec.sub_rays, spec.reach_m) = (sub_rays, 1e4)), &scene);
            assert_eq!(returns[0].0.intensity, 45.0, "{range_m} m, {sub_rays} rays");
        }
    }
}

#[test]
fn noise_moves_a_return_along_its_beam_and_nowhere_else() {
    let scene = clutter(2);
    let exact = first_sweep(&mut probe(|spec| spec.sub_rays = 7), &scene);
    let noisy = first_sweep(&mut probe(|spec| (spec.sub_rays, spec.range_noise_m) = (7, 0.05)), &scene);
    let mut moved = 0;
    for ((a, b), (truth, label)) in
        exact.0.returns.iter().zip(&noisy.0.returns).zip(exact.1.iter().zip(&noisy.1))
    {
        assert_eq!(
            (a.azimuth_rad, a.elevation_rad, a.intensity),
            (b.azimuth_rad, b.elevation_rad, b.intensity)
        );
        assert_eq!((truth.class, truth.instance, truth.mixed), (label.class, label.instance, label.mixed));
        assert_eq!(a.range_m.is_some(), b.range_m.is_some());
        moved += usize::from(a.range_m != b.range_m);
    }
    assert!(moved > 500, "{moved}");
}

#[test]
fn a_turn_is_the_same_whether_or_not_those_before_it_were_fired() {
    let (scene, motion) = (clutter(3), standing());
    let noisy = || probe(|spec| (spec.sub_rays, spec.range_noise_m, spec.dropout_ratio) = (7, 0.02, 0.1));
    let turn = |lidar: &mut Lidar, number: i64| {
        let end = Time::SIMULATION_START + lidar.period() * number;
        lidar.sweep(end, Surroundings { motion: &motion, optics: &scene }).0
    };
    let mut patient = noisy();
    let before: Vec<Sweep> = (1..=3).map(|number| turn(&mut patient, number)).collect();
    let third = turn(&mut noisy(), 3);
    assert_eq!(third, before[2]);
    // Two turns of a still scene differ by their chance alone, and they do.
    assert_ne!(before[1].returns, before[2].returns);
    assert_ne!(
        third,
        turn(
            &mut Lidar::new(
                &noisy().spec,
                Span::from_millis(100),
                Pose::translation(0.0, 0.0, HEIGHT_M),
                Seed(4).stream("lidar")
            ),
            3
        )
    );
}
