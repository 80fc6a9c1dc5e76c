//! The robots on wheels against laws: straight ways, turns, slip, slopes, and what their wheels tell of it.

#![allow(clippy::unwrap_used)] // Everything here is a test.

mod walked;

use arborloop_base::{Observation, Seed, Span, planar, pose2};
use arborloop_robots::wheels::{jackal, thorvald};
use arborloop_robots::{Command, TrunkMotion, TrunkState, WheelSettings, Wheeled};
use arborloop_sim::{Scenario, Simulator, WheeledGait};
use arborloop_worlds::World;
use walked::{Soil, ground};

const TICK_S: f64 = 0.001;

/// A drive under one command, state by state.
fn drive(
    world: &World,
    robot: Wheeled,
    settings: &WheelSettings,
    command: Command,
    seconds: f64,
) -> Vec<TrunkState> {
    let tick = Span::from_seconds(TICK_S);
    let mut gait = WheeledGait::new(world, robot, settings, pose2(0.0, 0.0, 0.0), tick, Seed(1));
    let mut states = Vec::new();
    for number in 0..(seconds / TICK_S).round() as usize {
        let command = if number < 500 { Command::default() } else { command };
        gait.advance(&command, &Soil(&world.terrain));
        assert_eq!(gait.fall(), None, "after {number} ticks");
        states.push(gait.state().clone());
    }
    states
}

fn exact() -> WheelSettings {
    WheelSettings { radius_error_ratio: 0.0, ..WheelSettings::default() }
}

const fn ahead(forward_mps: f64) -> Command {
    Command { forward_mps, turn_radps: 0.0 }
}

/// Way over the ground and turn, by truth and as the wheels tell, between two ticks.
fn way(states: &[TrunkState]) -> [f64; 4] {
    let along = |state: &TrunkState| state.world_from_base.rotation.inverse() * state.linear_mps;
    let sum = |pick: &dyn Fn(&TrunkState) -> f64| states.iter().map(pick).sum::<f64>() * TICK_S;
    [
        sum(&|state| along(state).x),
        sum(&|state| (state.world_from_base.rotation * state.angular_radps).z),
        sum(&|state| state.rolled.unwrap().linear_mps.x),
        sum(&|state| state.rolled.unwrap().angular_radps.z),
    ]
}

#[test]
fn a_standing_robot_presses_on_the_ground_with_its_weight_and_stays_on_a_slope() {
    for robot in [jackal(), thorvald()] {
        for slope_deg in [0.0, 8.0] {
            let world = ground(0.0, slope_deg, 1);
            let states = drive(&world, robot.clone(), &exact(), ahead(0.0), 2.5);
            let last = states.last().unwrap();
            let weight_n = 9.806_65 * robot.mass_kg;
            let force_n: f64 = last.loads.unwrap().foot_forces_n.iter().map(|force| force.z).sum();
            assert!((force_n / weight_n - 1.0).abs() < 0.01, "{force_n} N of {weight_n} N");
            let moved =
                last.world_from_base.translation.vector - states[1499].world_from_base.translation.vector;
            println!("{} on {slope_deg} deg creeps {} mm/s", robot.robot.name, moved.norm() * 1e3);
            assert!(
                moved.norm() < 1e-3,
                "{} on {slope_deg} degrees moves by {moved:?} in a second",
                robot.robot.name
            );
        }
    }
}

#[test]
fn straight_ahead_is_straight_and_as_fast_as_commanded() {
    for robot in [jackal(), thorvald()] {
        let states = drive(&ground(0.0, 0.0, 1), robot, &exact(), ahead(0.5), 5.0);
        let steady = &states[2500..];
        let [way_m, turned_rad, told_m, _] = way(steady);
        assert!((way_m / 1.25 - 1.0).abs() < 0.01, "{way_m} m in 2.5 s");
        assert!((told_m / way_m - 1.0).abs() < 0.005, "{told_m} m told of {way_m} m");
        let beside_m = steady.last().unwrap().world_from_base.translation.y;
        assert!(turned_rad.abs() < 0.01 && beside_m.abs() < 0.02, "{turned_rad} rad, {beside_m} m");
    }
}

#[test]
fn a_skid_steered_robot_turns_as_coulomb_friction_says() {
    // Each wheel rubs along its velocity over the ground. In a steady turn the rubbing forces have no moment, which for
    // equal loads gives speeds of the wheels as if the track were wider by 1 + (wheelbase / track)^2: 1.487 for the
    // Jackal, whose maker's controller has 1.5. Its loads are not quite equal: its center of mass is 12 mm ahead.
    let robot = jackal();
    let wider = 1.0 + (robot.wheelbase_m() / robot.track_m()).powi(2);
    assert!((wider - 1.487).abs() < 0.001, "{wider}");
    for command in
        [Command { forward_mps: 0.0, turn_radps: 0.6 }, Command { forward_mps: 0.4, turn_radps: 0.6 }]
    {
        let states = drive(&ground(0.0, 0.0, 1), jackal(), &exact(), command, 6.0);
        let [way_m, turned_rad, told_m, told_rad] = way(&states[2000..]);
        let found = exact().track_ratio * told_rad / turned_rad;
        println!(
            "track as if {found:.3} times wider; {turned_rad:.3} rad of {:.3}, {way_m:.3} m, told {told_m:.3}",
            2.4
        );
        assert!((found / wider - 1.0).abs() < 0.05, "as if {found} times wider, wanted {wider}");
        assert!((turned_rad / 2.4 - 1.0).abs() < 0.06, "{turned_rad} rad in 4 s");
    }
}

#[test]
fn wheels_that_steer_turn_without_rubbing() {
    for (forward_mps, turn_radps) in [(0.0, 0.5), (0.5, 0.3)] {
        let command = Command { forward_mps, turn_radps };
        let states = drive(&ground(0.0, 0.0, 1), thorvald(), &exact(), command, 8.0);
        let [way_m, turned_rad, told_m, told_rad] = way(&states[4000..]);
        println!("{turned_rad:.3} rad of {:.3}, {way_m:.3} m of {:.3}", 4.0 * turn_radps, 4.0 * forward_mps);
        assert!((turned_rad - 4.0 * turn_radps).abs() < 0.02 * 4.0 * turn_radps, "{turned_rad} rad");
        assert!((way_m - 4.0 * forward_mps).abs() < 0.03, "{way_m} m");
        assert!((told_rad / turned_rad - 1.0).abs() < 0.01 && (told_m - way_m).abs() < 0.02);
    }
}

#[test]
fn the_error_of_what_wheels_tell_grows_with_their_slip() {
    // Uphill on ever less friction: the wheels turn as commanded and the robot lags behind.
    let lag = |friction: f64| {
        let settings = WheelSettings { friction, ..exact() };
        let uphill = Command { forward_mps: 0.5, turn_radps: 0.0 };
        let mut world = ground(0.0, 0.0, 1);
        world.terrain = sloping(9.0);
        let states = drive(&world, jackal(), &settings, uphill, 3.5);
        let [way_m, _, told_m, _] = way(&states[1500..]);
        1.0 - way_m / told_m
    };
    let (firm, slick, ice) = (lag(0.6), lag(0.18), lag(0.12));
    println!("lag {firm:.4}, {slick:.4}, {ice:.4}");
    assert!(firm.abs() < 0.01, "{firm}");
    assert!(firm < slick + 1e-3 && ice > 0.3, "{firm}, {slick}, {ice}: tan 9 deg is 0.158");
}

/// Rising straight ahead, degrees.
fn sloping(slope_deg: f64) -> arborloop_worlds::Terrain {
    let terrain = arborloop_worlds::TerrainSpec {
        extent_m: 12.0,
        relief_m: 0.0,
        bump_m: 0.0,
        slope_deg,
        slope_toward_deg: 180.0,
        ..arborloop_worlds::TerrainSpec::default()
    };
    let spec = arborloop_worlds::WorldSpec { terrain, ..arborloop_worlds::WorldSpec::default() };
    arborloop_worlds::build(&spec, Seed(1)).terrain
}

#[test]
fn ten_degrees_are_climbed() {
    for robot in [jackal(), thorvald()] {
        let mut world = ground(0.0, 0.0, 1);
        world.terrain = sloping(10.0);
        let states = drive(&world, robot, &exact(), ahead(0.5), 5.0);
        let last = states.last().unwrap().world_from_base.translation;
        let first = states[0].world_from_base.translation;
        assert!(
            last.z - first.z > 0.15 * (last.x - first.x) && last.x - first.x > 1.8,
            "{last:?} from {first:?}"
        );
        let [way_m, _, _, _] = way(&states[2500..]);
        assert!((way_m / 1.25 - 1.0).abs() < 0.03, "{way_m} m in 2.5 s");
    }
}

#[test]
fn the_same_seed_drives_the_same_bits() {
    let bits = || -> Vec<u64> {
        let command = Command { forward_mps: 0.5, turn_radps: 0.3 };
        let states = drive(&ground(0.03, 5.0, 1), thorvald(), &WheelSettings::default(), command, 2.0);
        states.iter().flat_map(walked::numbers).map(f64::to_bits).collect()
    };
    assert!(bits() == bits());
}

fn scenario(name: &str, changes: &[&str]) -> Scenario {
    let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
    Scenario::read(&Scenario::embedded(name).unwrap().overridden(&changes).unwrap()).unwrap()
}

#[test]
fn both_drive_the_cone_field_and_the_thorvald_a_vineyard_s_alley_by_truth_and_touch_nothing() {
    for (name, model, seconds) in [
        ("cone-field-go1-short", "robot.model=\"jackal\"", 45),
        ("cone-field-go1-short", "robot.model=\"thorvald\"", 60),
        ("vineyard-thorvald", "robot.model=\"thorvald\"", 55),
    ] {
        let mut sim = Simulator::new(&scenario(name, &[model]), Seed(1));
        let mut follower = sim.follower();
        for tick in 0..seconds * 1000 {
            if tick % 100 == 0 {
                let command = follower.steer(&planar(&sim.truth().as_estimate().map_from_base));
                sim.queue(command);
            }
            // No sensor is asked: rays are cast in other tests.
            sim.advance();
            let truth = sim.truth();
            assert_eq!(
                (truth.contacts.as_slice(), sim.fall()),
                (&[][..], None),
                "{name}, {model}, tick {tick}"
            );
        }
        let progress = follower.progress();
        println!("{name} {model}: {progress:?}");
        assert!(
            progress.finished || (name == "vineyard-thorvald" && progress.distance_m > 37.0),
            "{progress:?}"
        );
    }
}

#[test]
fn a_run_records_wheels_joints_odometry_and_a_lidar_that_sees_over_its_own_deck() {
    for (model, joints) in [("jackal", 4), ("thorvald", 8)] {
        let model = format!("robot.model=\"{model}\"");
        let still = [
            "odometry.scale_error_ratio=0.0",
            "odometry.speed_noise_mps=0.0",
            "odometry.turn_noise_radps=0.0",
        ];
        let changes: Vec<&str> = still.into_iter().chain([&*model]).collect();
        let mut sim = Simulator::new(&scenario("cone-field-go1-short", &changes), Seed(1));
        assert_eq!((sim.joint_names().len(), sim.joint_angles_rad().len()), (joints, joints));
        sim.obey(Command { forward_mps: 0.5, turn_radps: 0.0 });
        let (mut told_m, mut seen, mut own) = (0.0, 0, 0);
        for _ in 0..3000 {
            for observation in sim.step() {
                match observation {
                    Observation::Odometry(one) => told_m += one.twist.linear_mps.x / 50.0,
                    Observation::Sweep(sweep) => {
                        seen += sweep.returns.iter().filter(|one| one.range_m.is_some()).count();
                        own += sim
                            .labels()
                            .iter()
                            .filter(|label| label.class == arborloop_base::Class::Robot)
                            .count();
                    }
                    _ => {}
                }
            }
        }
        let truth = sim.truth();
        let went_m =
            (truth.world_from_base.translation.vector - truth.world_from_start.translation.vector).norm();
        println!("{model}: told {told_m} m of {went_m} m; {own} of {seen} returns are of the robot itself");
        assert!(went_m > 0.6 && (told_m / went_m - 1.0).abs() < 0.04, "{told_m} m told of {went_m} m");
        assert!(seen > 100_000 && own * 20 < seen, "{own} of {seen}");
    }
}

#[test]
fn a_robot_on_wheels_stands_at_rest_at_the_start_that_truth_counts_from() {
    // Uneven ground: put down on four points of it a robot rolls and turns before it stands.
    for seed in 1..=4 {
        let mut sim =
            Simulator::new(&scenario("citrus-jackal-short", &["world.planting.rows.count=0"]), Seed(seed));
        let pose = |sim: &Simulator| {
            let truth = sim.truth();
            planar(&(truth.world_from_start.inverse() * truth.world_from_base))
        };
        let begin = pose(&sim);
        assert!(begin.translation.vector.norm() < 1e-9 && begin.rotation.angle().abs() < 1e-9, "{begin}");
        for _ in 0..500 {
            sim.step();
        }
        let later = pose(&sim);
        let turned_deg = later.rotation.angle().to_degrees().abs();
        println!(
            "seed {seed}: {:.2} mm, {turned_deg:.4} deg in half a second",
            later.translation.vector.norm() * 1e3
        );
        assert!(later.translation.vector.norm() < 2e-3 && turned_deg < 0.05, "{later}");
    }
}
