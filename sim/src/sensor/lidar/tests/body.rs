//! The robot's own body in a full sweep: class, place, and that nothing behind it is seen.

use super::super::*;
use super::scene::*;
use arborloop_base::{Class, Seed};
use arborloop_robots::go1;
use nalgebra::{Point3, UnitQuaternion, Vector3};

/// A Go1 that stands on level ground.
const BODY_M: f64 = 0.28;
/// Thigh and calf of the lidar's model of the body, meters.
const RADII_M: [f64; 2] = [0.02, 0.012];

fn standing_go1() -> Motion {
    let mut motion = Motion::new(
        Time::SIMULATION_START,
        Pose::translation(0.0, 0.0, BODY_M),
        Span::from_millis(1),
        Span::from_millis(400),
    );
    let angles: [f64; 12] = std::array::from_fn(|joint| go1::STANDING_RAD[joint % 3]);
    (0..350).for_each(|_| motion.push_body(Pose::translation(0.0, 0.0, BODY_M), angles));
    motion
}

fn sweep_from(name: &str, sub_rays: u32, base_from_lidar: Pose) -> (Sweep, Vec<Label>) {
    sweep_with(name, base_from_lidar, |spec| spec.sub_rays = sub_rays)
}

fn sweep_with(name: &str, base_from_lidar: Pose, change: impl Fn(&mut LidarSpec)) -> (Sweep, Vec<Label>) {
    let mut spec = LidarSpec {
        range_m_min: 0.0,
        range_noise_m: 0.0,
        dropout_ratio: 0.0,
        ..LidarSpec::of(LidarModel::embedded(name).unwrap())
    };
    change(&mut spec);
    let mut lidar = Lidar::new(&spec, Span::from_millis(100), base_from_lidar, Seed(1).stream("lidar"));
    let end = Time::SIMULATION_START + Span::from_millis(200);
    let scene = optics(Vec::new(), Vec::new());
    lidar.sweep(end, Surroundings { motion: &standing_go1(), optics: &scene })
}

/// From a point to the nearest surface of the standing body, meters; base frame.
fn from_body_m(point: &Point3<f64>) -> f64 {
    let boxes = go1::body_shapes().into_iter().filter(|shape| shape.part != "lidar").map(|shape| {
        let beyond = (shape.base_from_shape.inverse() * point).coords.abs() - shape.half_extents_m;
        // Outside the distance to the box, inside the depth below its nearest face.
        (beyond.map(|one| one.max(0.0)).norm() + beyond.max().min(0.0)).abs()
    });
    let legs = (0..4).flat_map(|leg| {
        let [hip_rad, thigh_rad, calf_rad] = go1::STANDING_RAD;
        let [shoulder, foot] =
            [std::f64::consts::PI, calf_rad].map(|calf| go1::foot(leg, [hip_rad, thigh_rad, calf]));
        // Straightened, the knee is halfway to the foot.
        let knee = nalgebra::center(&shoulder, &go1::foot(leg, [hip_rad, thigh_rad, 0.0]));
        [(shoulder, knee, RADII_M[0]), (knee, foot, RADII_M[1])]
    });
    let rods = legs.map(|(a, b, radius_m)| {
        let along = ((point - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        ((a + (b - a) * along - point).norm() - radius_m).abs()
    });
    boxes.chain(rods).fold(f64::MAX, f64::min)
}

#[test]
fn a_level_lidar_on_its_bracket_looks_over_the_robot_it_stands_on() {
    for name in ["vlp16", "os1-16"] {
        let mount = go1::go1().frame("velodyne").unwrap();
        let (_, labels) = sweep_from(name, 5, mount);
        assert!(labels.iter().all(|label| label.class != Class::Robot), "{name}");
        assert!(labels.iter().filter(|label| label.class == Class::Ground).count() > 5000);
    }
}

#[test]
fn every_return_from_the_robot_lies_on_its_own_body_and_hides_the_ground() {
    let nod = |pitch_deg: f64| UnitQuaternion::from_euler_angles(0.1, f64::to_radians(pitch_deg), 0.3);
    // Low, under the belly, and nodding so far that trunk, hips and legs come into view.
    let mounts = [
        Pose::translation(0.05, 0.0, -0.08),
        Pose::translation(0.0, 0.0, 0.08),
        Pose::from_parts(Vector3::new(0.05, 0.0, 0.16).into(), nod(25.0)),
        Pose::from_parts(Vector3::new(0.25, 0.2, 0.16).into(), nod(-55.0)),
    ];
    for (number, mount) in mounts.into_iter().enumerate() {
        for name in ["vlp16", "os1-16"] {
            let (sweep, labels) = sweep_from(name, 1, mount);
            let mut met = 0;
            for (one, label) in sweep.returns.iter().zip(&labels) {
                let Some(point) = one.point().map(|point| mount * point) else { continue };
                // Half a wire's step along the beam, 1.5 hundredths of a degree across it.
                let off_m = from_body_m(&point);
                if label.class == Class::Robot {
                    assert!(off_m < 0.002, "{name} at mount {number}: {point} is {off_m} m off the body");
                    met += 1;
                } else {
                    assert_eq!(label.class, Class::Ground);
                    assert!((point.z + BODY_M).abs() < 0.02, "{point}");
                }
            }
            assert!(met > 300, "{name} at mount {number}: {met} returns from the body");
        }
    }
}

#[test]
fn a_sweep_meets_the_body_as_a_search_without_short_cuts_does() {
    // Every firing again, ray by ray, past the test that spares most beams the body; from above, and from under the belly.
    let nodding = UnitQuaternion::from_euler_angles(0.0, 0.5, 0.0);
    for mount in
        [Pose::from_parts(Vector3::new(0.05, 0.0, 0.16).into(), nodding), Pose::translation(0.05, 0.0, -0.08)]
    {
        let (sweep, labels) = sweep_from("vlp16", 1, mount);
        let angles: [f64; 12] = std::array::from_fn(|joint| go1::STANDING_RAD[joint % 3]);
        let (body, stance) = (Body::go1(), Stance::of(&angles));
        for (one, label) in sweep.returns.iter().zip(&labels) {
            let laser = arborloop_base::vlp16::laser_of(one.ring);
            let (up, flat) = arborloop_base::vlp16::ELEVATION_DEG[laser].to_radians().sin_cos();
            let along = Vector3::new(flat * one.azimuth_rad.cos(), flat * one.azimuth_rad.sin(), up);
            let from = Point3::new(0.0, 0.0, arborloop_base::vlp16::OFFSET_M[laser]);
            // A bearing that the wire rounded may pass an edge that the beam met.
            let agrees = |turn_rad: f64| {
                let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn_rad) * along;
                let hit = body.cast(&(mount * from), &(mount * turned), &stance);
                hit.is_some() == (label.class == Class::Robot)
            };
            assert!([0.0, 3e-4, -3e-4].into_iter().any(agrees), "{one:?} {label:?}");
        }
        assert!(labels.iter().filter(|label| label.class == Class::Robot).count() > 300);
    }
}

#[test]
fn what_of_a_wide_beam_passes_the_bodys_edge_goes_on_to_the_ground() {
    let mount = Pose::from_parts(
        Vector3::new(0.05, 0.0, 0.16).into(),
        UnitQuaternion::from_euler_angles(0.0, 0.45, 0.0),
    );
    let (_, middle) = sweep_from("vlp16", 1, mount);
    let (_, last) = sweep_with("vlp16", mount, |spec| {
        (spec.sub_rays, spec.returns, spec.reach_m) = (19, EchoChoice::Last, 1e6);
        // Short enough to tell the ground from the body a hand above it.
        spec.model.pulse.length_m = 0.1;
    });
    let met = middle.iter().zip(&last).filter(|(middle, _)| middle.class == Class::Robot);
    let (mut past, mut all) = (0, 0);
    for (_, last) in met {
        assert!(matches!(last.class, Class::Robot | Class::Ground), "{last:?}");
        past += u32::from(last.class == Class::Ground);
        all += 1;
    }
    // Along the outline alone: more than a few, and far from all.
    assert!(past > 5 && 5 * past < all, "{past} of {all}");
}
