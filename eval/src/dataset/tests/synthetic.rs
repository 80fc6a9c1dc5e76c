//! A walk on a circle inside a room without a roof, in closed form: sweeps, all other sensors, truth and a system's answers.

use arborloop_base::vlp16::{self, CYCLE_STEP, ELEVATION_DEG, LASER_STEP, LASERS};
use arborloop_base::{
    Cell, Class, Contact, Estimate, Fix, FixQuality, Grid, Health, Imu, Label, Observation, Odometry, Pose,
    Record, Return, Sink, Span, Sweep, Time, Truth, Twist, wrap_angle,
};
use nalgebra::{Matrix3, Matrix6, Point2, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

const TICK: Span = Span::from_millis(1);
const PERIOD: Span = Span::from_millis(100);
/// Whole cycles of a turn at 10 Hz.
const CYCLES: usize = 1808;
const RADIUS_M: f64 = 3.0;
const TURN_RADPS: f64 = 0.2;
const RANGE_M_MAX: f64 = 100.0;

/// Where the lidar sits.
pub(crate) fn base_from_lidar() -> Pose {
    Pose::from_parts(
        Translation3::new(0.12, -0.01, 0.2),
        UnitQuaternion::from_euler_angles(0.01, -0.02, 0.03),
    )
}

/// The base in the world; the walk begins at (1, 2), heading north.
pub(crate) fn world_from_base(time: Time) -> Pose {
    world_from_start() * start_from_base(time)
}

pub(crate) fn world_from_start() -> Pose {
    Pose::from_parts(Translation3::new(1.0, 2.0, 0.3), UnitQuaternion::from_euler_angles(0.0, 0.0, TAU / 4.0))
}

pub(crate) fn start_from_base(time: Time) -> Pose {
    let turned = TURN_RADPS * (time - Time::SIMULATION_START).seconds();
    let place = Translation3::new(RADIUS_M * turned.sin(), RADIUS_M * (1.0 - turned.cos()), 0.0);
    Pose::from_parts(place, UnitQuaternion::from_euler_angles(0.0, 0.0, turned))
}

/// The sweep that ends at `end`, as it comes off the wire, with what each return met.
pub(crate) fn sweep(end: Time) -> (Sweep, Vec<Label>) {
    let start = end - PERIOD;
    let mut raw = Sweep { start, end, rings: LASERS as u16, returns: Vec::with_capacity(CYCLES * LASERS) };
    for cycle in 0..CYCLES {
        let mut world_from_lidar = None;
        for (laser, elevation_deg) in ELEVATION_DEG.iter().enumerate() {
            let fired_after = CYCLE_STEP * cycle as i64 + LASER_STEP * laser as i64;
            let world_from_lidar = *world_from_lidar
                .get_or_insert_with(|| world_from_base(start + fired_after) * base_from_lidar());
            let azimuth_rad = wrap_angle(-TAU * fired_after.seconds() / PERIOD.seconds());
            let elevation_rad = elevation_deg.to_radians();
            let range_m = range_in_room(&world_from_lidar, azimuth_rad, elevation_rad);
            raw.returns.push(Return {
                azimuth_rad,
                elevation_rad,
                range_m,
                ring: vlp16::ring_of(laser),
                number: 0,
                fired_after,
                intensity: (cycle % 101) as f32,
            });
        }
    }
    let sweep = vlp16::decode(&vlp16::encode(&raw).unwrap(), end).unwrap();
    let labels = sweep.returns.iter().map(|one| Label {
        class: if one.range_m.is_some() { Class::Ground } else { Class::Sky },
        instance: u32::from(one.ring),
        range_m: one.range_m.map_or(f32::NAN, |range_m| range_m as f32),
        incidence_rad: 0.1,
        ..Label::MISS
    });
    let labels = labels.collect();
    (sweep, labels)
}

/// Distance to the floor at height zero or to the walls at 12 m east and west, 9 m north and south, 4 m high.
fn range_in_room(world_from_lidar: &Pose, azimuth_rad: f64, elevation_rad: f64) -> Option<f64> {
    let (horizontal, up) = (elevation_rad.cos(), elevation_rad.sin());
    let beam = world_from_lidar.rotation
        * Vector3::new(horizontal * azimuth_rad.cos(), horizontal * azimuth_rad.sin(), up);
    let origin = world_from_lidar.translation.vector;
    let floor = (beam.z < 0.0).then(|| -origin.z / beam.z);
    let wall = |axis: usize, half: f64| {
        let range_m = (half * beam[axis].signum() - origin[axis]) / beam[axis];
        (range_m.is_finite() && origin.z + range_m * beam.z < 4.0).then_some(range_m)
    };
    let hits = [floor, wall(0, 12.0), wall(1, 9.0)];
    hits.into_iter().flatten().min_by(f64::total_cmp).filter(|range_m| *range_m < RANGE_M_MAX)
}

fn fix_of(now: Time) -> Fix {
    Fix {
        stamp: now,
        position_m: world_from_base(now).translation.vector,
        covariance_m2: Matrix3::new(1e-4, 1e-6, 0.0, 1e-6, 2e-4, 0.0, 0.0, 0.0, 4e-4),
        quality: if now.seconds() < 1.5 { FixQuality::Float } else { FixQuality::Fixed },
    }
}

fn twist() -> Twist {
    Twist::planar(RADIUS_M * TURN_RADPS, TURN_RADPS)
}

fn truth_of(now: Time) -> Truth {
    let contact = Contact { part: "trunk".to_owned(), class: Class::Cone, instance: 3 };
    let touching = (1.2..1.25).contains(&now.seconds());
    Truth {
        stamp: now,
        world_from_base: world_from_base(now),
        world_from_start: world_from_start(),
        twist: twist(),
        contacts: if touching { vec![contact] } else { Vec::new() },
    }
}

/// A small map with all three kinds of cell.
pub(crate) fn map() -> Grid<Cell> {
    let mut map = Grid::filled(Point2::new(-1.0, -0.5), 0.1, 20, 10, Cell::Unknown);
    map.cells_mut()[7] = Cell::Occupied;
    map.cells_mut()[8..40].fill(Cell::Free);
    map
}

/// Walks for a number of sweeps in the order of the loop and hands every record to the sink; returns the observations.
pub(crate) fn walk(sweeps: i64, sink: &mut dyn Sink) -> Vec<Observation> {
    let mut given = Vec::new();
    let names = ["hip".to_owned(), "knee".to_owned()];
    for tick in 1..=sweeps * 100 {
        let now = Time::SIMULATION_START + TICK * tick;
        let wave = (tick as f64 * 0.01).sin();
        let mut observations = Vec::new();
        let mut labels = Vec::new();
        if tick % 5 == 0 {
            observations.push(Observation::Imu(Imu {
                stamp: now,
                specific_force_mps2: Vector3::new(0.1 * wave, -0.12, 9.81),
                rate_radps: Vector3::new(0.01 * wave, 0.0, TURN_RADPS),
            }));
        }
        if tick % 20 == 0 {
            observations.push(Observation::Odometry(Odometry { stamp: now, twist: twist() }));
        }
        if tick % 100 == 0 {
            let (sweep, truth) = sweep(now);
            observations.push(Observation::Sweep(sweep));
            labels = truth;
        }
        if tick % 200 == 0 {
            observations.push(Observation::Fix(fix_of(now)));
        }
        for observation in &observations {
            sink.write(now, &Record::Observation(observation)).unwrap();
            if let Observation::Sweep(sweep) = observation {
                sink.write(now, &Record::Labels { sweep, labels: &labels }).unwrap();
                let estimate = Estimate {
                    stamp: now,
                    map_from_base: start_from_base(now),
                    covariance: Some(Matrix6::identity() * 1e-4),
                    health: Health::Tracking,
                };
                for system in ["mhd", "mhd-paper"] {
                    sink.write(now, &Record::Estimate { system, estimate: &estimate }).unwrap();
                    sink.write(now, &Record::Map { system, map: &map() }).unwrap();
                }
                sink.write(now, &Record::Command(&twist())).unwrap();
                sink.write(now, &Record::Joints { names: &names, angles_rad: &[0.1, wave] }).unwrap();
            }
        }
        sink.write(now, &Record::Truth(&truth_of(now))).unwrap();
        given.append(&mut observations);
    }
    given
}
