//! The air's laws: what it takes and what it throws back.

use super::super::*;
use super::scene::*;
use crate::sensor::lidar::weather::Air;
use arborloop_base::Class;

fn fog(visibility_m: f64) -> WeatherSpec {
    WeatherSpec { fog_visibility_m: Some(visibility_m), ..WeatherSpec::default() }
}

#[test]
fn extinction_is_koschmieders_in_fog_and_carbonneaus_in_rain() {
    let [rain, fog, dust] = fog(200.0).extinction_per_m();
    assert_eq!((rain, dust), (0.0, 0.0));
    // Five per cent of the contrast are left at the visibility.
    assert!(((-fog * 200.0).exp() - 0.05).abs() < 1e-12);
    let [rain, ..] = WeatherSpec { rain_mm_per_h: 25.0, ..WeatherSpec::default() }.extinction_per_m();
    // 1.076 x 25^0.67 = 9.30 dB/km.
    assert!((10.0 * (rain * 1000.0).exp().log10() - 9.30).abs() < 0.01, "{rain}");
}

#[test]
fn a_wall_in_fog_is_darker_by_the_way_there_and_back() {
    for range_m in [5.0, 20.0, 40.0] {
        let scene = optics(vec![plate(range_m, 0.0, 3.0, 0.9, 0.0)], Vec::new());
        let change = |spec: &mut LidarSpec| (spec.returns, spec.reach_m) = (EchoChoice::Last, 1e4);
        let mut lidar = probe(change).under(&fog(100.0), &[]);
        let returns = ahead(&mut lidar, &scene);
        let law = 90.0 * (-2.0 * 20.0_f64.ln() / 100.0 * range_m).exp();
        let found = f64::from(returns[0].0.intensity);
        assert!((found - law).abs() <= 0.5, "{found} at {range_m} m, wanted {law}");
        assert_eq!(returns[0].1.class, Class::Post);
    }
}

#[test]
fn as_many_beams_come_back_from_fog_rain_and_dust_as_the_law_of_their_backscatter_says() {
    let scene = optics(Vec::new(), Vec::new());
    let rain = WeatherSpec { rain_mm_per_h: 50.0, ..WeatherSpec::default() };
    let dust = WeatherSpec { dust_visibility_m: Some(30.0), ..WeatherSpec::default() };
    for weather in [fog(80.0), rain, dust] {
        let mut lidar = probe(|_| ()).under(&weather, &[]);
        let (mut fired, mut seen) = (0.0, 0.0);
        let motion = standing();
        for turn in 1..=3 {
            let end = Time::SIMULATION_START + lidar.period() * turn;
            let (sweep, labels) = lidar.sweep(end, Surroundings { motion: &motion, optics: &scene });
            fired += sweep.returns.len() as f64;
            seen += sweep.returns.iter().filter(|one| one.range_m.is_some()).count() as f64;
            assert!(labels.iter().all(|label| label.class == Class::Weather));
        }
        // The place follows 1 / r^2 from the overlap on, the brightness speckle's exponential law; a beam returns where
        // its energy exceeds the threshold.
        let (extinction, brightness, nearest_m) = Air::new(&weather, 1.0).law();
        let threshold = 0.1 / 1600.0;
        let steps = 200_000;
        let (near, far) = (1.0 / nearest_m, 1.0 / 100.0);
        let chance = (0..steps).map(|n| {
            let range_m = 1.0 / (near - (n as f64 + 0.5) / f64::from(steps) * (near - far));
            let needed = threshold * range_m * range_m * (2.0 * extinction * range_m).exp() / brightness;
            if range_m >= 0.4 { (-needed).exp() } else { 0.0 }
        });
        let law = chance.sum::<f64>() / f64::from(steps);
        assert!((0.05..0.95).contains(&law), "{law}");
        let sigma = (law * (1.0 - law) / fired).sqrt();
        assert!(
            (seen / fired - law).abs() < 4.0 * sigma,
            "{weather:?}: {} of {fired}, the law says {law}",
            seen / fired
        );
    }
}

#[test]
fn the_reach_of_a_lidar_in_fog_is_where_its_light_on_the_way_there_and_back_equals_the_threshold() {
    let weather = fog(60.0);
    let extinction = weather.extinction_per_m()[1];
    // A facing plate of 60 %: 0.6 exp(-2 s r) / r^2 = 0.1 / 40^2, by halving.
    let light = |range_m: f64| 0.6 * (-2.0 * extinction * range_m).exp() / (range_m * range_m);
    let (mut low, mut high) = (1.0, 100.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if light(middle) > 0.1 / 1600.0 { low = middle } else { high = middle }
    }
    assert!((10.0..30.0).contains(&low), "{low}");
    for (range_m, seen) in [(low - 0.05, true), (low + 0.05, false)] {
        let scene = optics(vec![plate(range_m, 0.0, 3.0, 0.6, 0.0)], Vec::new());
        let mut lidar = probe(|spec| spec.returns = EchoChoice::Last).under(&weather, &[]);
        let returns = ahead(&mut lidar, &scene);
        assert_eq!(
            returns[0].1.class == Class::Post && returns[0].0.range_m.is_some(),
            seen,
            "{range_m}: {returns:?}"
        );
    }
}

#[test]
fn the_light_that_three_weathers_leave_is_the_product_of_what_each_leaves() {
    let each = [
        fog(90.0),
        WeatherSpec { rain_mm_per_h: 30.0, ..WeatherSpec::default() },
        WeatherSpec { dust_visibility_m: Some(70.0), ..WeatherSpec::default() },
    ];
    let all = WeatherSpec { rain_mm_per_h: 30.0, dust_visibility_m: Some(70.0), ..fog(90.0) };
    let product: f64 = each.iter().map(|weather| Air::new(weather, 1.0).left(12.0)).product();
    assert!((Air::new(&all, 1.0).left(12.0) - product).abs() < 1e-12);
}

#[test]
fn clear_air_changes_nothing() {
    let scene = optics(vec![plate(10.0, 0.0, 3.0, 0.9, 0.0)], Vec::new());
    let clear = first_sweep(&mut probe(|_| ()), &scene).0;
    assert_eq!(clear, first_sweep(&mut probe(|_| ()).under(&WeatherSpec::default(), &[]), &scene).0);
}
