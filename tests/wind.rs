//! Wind as the lidar sees it: through the whole simulator, from the scenario's dial to a return and its label.

use crate::check::{cone_field, rig};
use arborloop_base::{Class, Label, Observation, Pose, Seed, Sweep, Time};
use arborloop_sim::Simulator;
use nalgebra::Point3;

/// Sweeps of a robot that walks ahead among trees, with labels, and its poses at every tick.
struct Walk {
    simulator: Simulator,
    sweeps: Vec<(Sweep, Vec<Label>)>,
    poses: Vec<(Time, Pose)>,
}

fn walk(wind: &str, lidar: &[&str]) -> Walk {
    let near = ["world.surroundings.distance_m_min=6.0", "world.surroundings.distance_m_max=14.0"];
    let exact = ["lidar.range_noise_m=0.0", "lidar.dropout_ratio=0.0", "run.stand_s=0.0", wind];
    let scenario = cone_field(&[near.as_slice(), &exact, lidar].concat());
    let mut simulator = Simulator::new(&scenario, Seed(scenario.seed));
    simulator.queue(arborloop_robots::Command { forward_mps: 0.5, turn_radps: 0.2 });
    let mut poses = vec![(simulator.now(), simulator.body().world_from_base)];
    let mut sweeps = Vec::new();
    while sweeps.len() < 3 {
        let observations = simulator.step();
        poses.push((simulator.now(), simulator.body().world_from_base));
        for observation in observations {
            if let Observation::Sweep(sweep) = observation {
                sweeps.push((sweep, simulator.labels().to_vec()));
            }
        }
    }
    Walk { simulator, sweeps, poses }
}

impl Walk {
    /// Between two ticks: straight and at an even turn, a law of this test's own.
    fn pose(&self, stamp: Time) -> Pose {
        let next = self.poses.partition_point(|(time, _)| *time <= stamp).clamp(1, self.poses.len() - 1);
        let ((from, a), (to, b)) = (&self.poses[next - 1], &self.poses[next]);
        let share = (stamp - *from).seconds() / (*to - *from).seconds();
        Pose::from_parts(
            a.translation.vector.lerp(&b.translation.vector, share).into(),
            a.rotation.slerp(&b.rotation, share),
        )
    }

    /// For each return from a leaf: how far its point is from the nearest leaf of the plant that its label names, with
    /// the plant as it is at the firing's own instant, and as it would be had it not moved.
    fn misses_m(&self) -> Vec<(f64, f64)> {
        let world = self.simulator.world();
        let mut misses = Vec::new();
        for (sweep, labels) in &self.sweeps {
            let leafy = sweep
                .returns
                .iter()
                .zip(labels)
                .filter(|(_, label)| label.class == Class::Leaf && !label.mixed);
            for (one, label) in leafy.step_by(7) {
                let Some(point) = one.point() else { continue };
                let stamp = sweep.start + one.fired_after;
                let place = self.pose(stamp) * rig().base_from_lidar * point;
                let seconds = stamp.seconds();
                let mut nearest = (f64::INFINITY, f64::INFINITY);
                for (index, plant) in world.plants.iter().enumerate() {
                    if plant.instance != label.instance {
                        continue;
                    }
                    let now = world.wind.sway(index, plant, seconds);
                    let rest = arborloop_worlds::Sway::at_rest(plant);
                    for (number, leaf) in world.prototypes[plant.prototype].leaves.iter().enumerate() {
                        for (sway, nearest) in [(&now, &mut nearest.0), (&rest, &mut nearest.1)] {
                            let corners =
                                sway.leaf(number, leaf).corners().map(|c| sway.world_from_plant * c);
                            *nearest = nearest.min(distance_m(&corners, &place));
                        }
                    }
                }
                misses.push(nearest);
            }
        }
        misses
    }
}

/// From a parallelogram to a point.
fn distance_m([a, b, _, d]: &[Point3<f64>; 4], point: &Point3<f64>) -> f64 {
    let (u, v, to) = (b - a, d - a, point - a);
    // Coordinates along the two sides (they meet at nearly right angles, even when a gust shears the plant).
    let (uu, uv, vv) = (u.dot(&u), u.dot(&v), v.dot(&v));
    let (tu, tv) = (to.dot(&u), to.dot(&v));
    let scale = uu * vv - uv * uv;
    let (s, t) = ((tu * vv - tv * uv) / scale, (tv * uu - tu * uv) / scale);
    (to - u * s.clamp(0.0, 1.0) - v * t.clamp(0.0, 1.0)).norm()
}

#[test]
fn every_return_from_a_moving_leaf_lies_on_the_leaf_as_it_stood_when_the_laser_fired() {
    let misses = walk("world.wind.mean_mps=8.0", &[]).misses_m();
    assert!(misses.len() > 100, "{} returns from leaves", misses.len());
    // The wire: 1 mm along the beam, 1.5 hundredths of a degree at 15 m across it.
    let bound_m = 0.001 + 1.5 * 0.01_f64.to_radians() * 15.0;
    assert_on_leaves(&misses, bound_m);
    // Against the plants at rest, most returns would hang in the air.
    let astray = misses.iter().filter(|(_, rest)| *rest > bound_m).count();
    assert!(2 * astray > misses.len(), "only {astray} of {} would be off at rest", misses.len());
}

/// 99 returns in a hundred lie on their leaf within the bound. The tracer looks at leaves once in two milliseconds: a beam
/// past the edge of a leaf may meet the plane that it had there, up to a tenth of the leaf's side beyond it.
fn assert_on_leaves(misses: &[(f64, f64)], bound_m: f64) {
    let mut off_m: Vec<f64> = misses.iter().map(|(now, _)| *now).collect();
    off_m.sort_by(f64::total_cmp);
    let most_m = off_m[off_m.len() * 99 / 100];
    assert!(most_m < bound_m, "one return in a hundred lies more than {most_m} m off");
    let worst = off_m[off_m.len() - 1];
    assert!(worst < bound_m + 0.1 * 0.08, "a return lies {worst} m off");
}

#[test]
fn without_wind_every_return_from_a_leaf_lies_on_the_leaf_at_rest() {
    let still = walk("world.wind.mean_mps=0.0", &[]).misses_m();
    assert!(still.iter().all(|(now, rest)| now == rest && *now < 0.005));
}

#[test]
fn an_os1_and_wide_beams_see_moving_leaves_where_they_stood_when_they_fired() {
    let os1: &[&str] = &["lidar.model=os1-16"];
    for lidar in [os1, &["lidar.model=os1-16", "lidar.sub_rays=7"], &["lidar.sub_rays=5"]] {
        let misses = walk("world.wind.mean_mps=8.0", lidar).misses_m();
        assert!(misses.len() > 100, "{lidar:?}: {} returns from leaves", misses.len());
        let median = |of: fn(&(f64, f64)) -> f64| {
            let mut all: Vec<f64> = misses.iter().map(of).collect();
            all.sort_by(f64::total_cmp);
            all[all.len() / 2]
        };
        let (now_m, rest_m) = (median(|one| one.0), median(|one| one.1));
        if lidar == os1 {
            // One ray a beam: half a millimeter along it, bearings as the columns say them.
            assert_on_leaves(&misses, 0.001);
        }
        // A wide beam's return is the mean of the leaves in it, off any one of them by their spread; were leaves taken
        // where they hang at rest, it would be off by the sway.
        assert!(3.0 * now_m < rest_m, "{lidar:?}: {now_m} m off, {rest_m} m at rest");
    }
}
