//! A robot that is carried off: truth jumps by what was asked, the body goes on, and its own senses do not know.

use arborloop_base::{Observation, Pose2, Seed, Time, Truth, planar, pose2, wrap_angle};
use arborloop_robots::Command;
use arborloop_sim::{Document, Scenario, Simulator};

const KIDNAP: &str = "kidnap=[{at_s=3.0, by_m=[0.8, -0.5], turned_deg=30.0}]";
const ELSEWHERE: &str = "kidnap=[]";
/// Level, without bumps, nothing to touch.
const LEVEL: [&str; 6] = [
    "world.terrain.relief_m=0.0",
    "world.terrain.bump_m=0.0",
    "world.planting.count=0",
    "world.surroundings.trees=0",
    "world.surroundings.bushes=0",
    "run.stand_s=0.5",
];
/// Every way to move.
const MOVERS: [&str; 6] = [
    "gait.mode='kinematic'",
    "gait.mode='strides'",
    "gait.mode='smooth'",
    "gait.mode='physics'",
    "robot.model='jackal'",
    "robot.model='thorvald'",
];

fn simulator(changes: &[&str]) -> Simulator {
    let changes: Vec<String> = changes.iter().map(|change| (*change).to_owned()).collect();
    let field = Scenario::embedded("cone-field-go1-short").expect("it comes with the program");
    let document = field.overridden(&changes).expect("the changes are assignments");
    let scenario = Scenario::read(&document).unwrap_or_else(|refusal| panic!("{refusal}"));
    let mut sim = Simulator::new(&scenario, Seed(1));
    sim.obey(Command { forward_mps: 0.4, turn_radps: 0.1 });
    sim
}

fn by() -> Pose2 {
    pose2(0.8, -0.5, 30_f64.to_radians())
}

/// Truth after so many ticks more.
fn after(sim: &mut Simulator, ticks: usize) -> Truth {
    (0..ticks).for_each(|_| sim.advance());
    sim.truth()
}

/// How far two planar poses are apart, meters and radians.
fn apart(one: &Pose2, other: &Pose2) -> (f64, f64) {
    let off = one.inverse() * other;
    (off.translation.vector.norm(), wrap_angle(off.rotation.angle()).abs())
}

#[test]
fn truth_jumps_by_exactly_what_was_asked_and_the_body_moves_on_however_it_moves() {
    for mover in MOVERS {
        // Slopes and bumps of the cone field, without its cones.
        let changes = [mover, "world.planting.count=0", "world.surroundings.trees=0"];
        let [mut carried, mut left] =
            [KIDNAP, ELSEWHERE].map(|kidnap| simulator(&[&changes[..], &[kidnap]].concat()));
        assert_eq!(after(&mut carried, 3000), after(&mut left, 3000), "{mover}: nothing happens before");
        let (found, before) = (after(&mut carried, 1), after(&mut left, 1));
        let wanted = planar(&before.world_from_base) * by();
        let (off_m, off_rad) = apart(&wanted, &planar(&found.world_from_base));
        assert!(off_m < 1e-9 && off_rad < 1e-9, "{mover}: {off_m} m, {off_rad} rad");
        let (speed, old) = (found.twist, before.twist);
        // Seen from the base: what the slope changes is second order in a few degrees.
        assert!((speed.linear_mps - old.linear_mps).norm() < 0.01, "{mover}: {speed:?} after {old:?}");
        assert!((speed.angular_radps - old.angular_radps).norm() < 0.01, "{mover}: {speed:?} after {old:?}");
        let from = planar(&found.world_from_base);
        let height_m = |sim: &Simulator, truth: &Truth| {
            let at = truth.world_from_base.translation;
            at.z - sim.world().terrain.height_m(at.x, at.y)
        };
        let risen_m = height_m(&carried, &found) - height_m(&left, &before);
        assert!(risen_m.abs() < 0.04, "{mover}: {risen_m} m higher over the ground");
        let later = after(&mut carried, 3000);
        assert_eq!(carried.fall(), None, "{mover}");
        let way_m = apart(&from, &planar(&later.world_from_base)).0;
        assert!((1.0..1.35).contains(&way_m), "{mover}: {way_m} m in three seconds at 0.4 m/s");
    }
}

#[test]
fn on_level_ground_the_body_goes_on_as_if_nothing_had_been() {
    for (mover, off_m_max, off_rad_max) in [
        ("gait.mode='kinematic'", 1e-9, 1e-9),
        ("gait.mode='strides'", 1e-9, 1e-9),
        ("gait.mode='smooth'", 1e-9, 1e-9),
        // The engine's friction knows east from north, and its contacts begin anew: less than a step's own scatter.
        ("gait.mode='physics'", 0.02, 0.02),
        ("robot.model='jackal'", 1e-4, 1e-4),
        ("robot.model='thorvald'", 1e-4, 1e-4),
    ] {
        let [mut carried, mut left] =
            [KIDNAP, ELSEWHERE].map(|kidnap| simulator(&[&LEVEL[..], &[mover, kidnap]].concat()));
        let (before, found) = (after(&mut left, 3001), after(&mut carried, 3001));
        let world_from_world = planar(&found.world_from_base) * planar(&before.world_from_base).inverse();
        let (before, found) = (after(&mut left, 1000), after(&mut carried, 1000));
        let wanted = world_from_world * planar(&before.world_from_base);
        let (off_m, off_rad) = apart(&wanted, &planar(&found.world_from_base));
        assert!(off_m < off_m_max && off_rad < off_rad_max, "{mover}: {off_m} m, {off_rad} rad");
        let sunk_m = found.world_from_base.translation.z - before.world_from_base.translation.z;
        assert!(sunk_m.abs() < 0.005, "{mover}: {sunk_m} m");
        assert_eq!(found.contacts, before.contacts);
    }
}

#[test]
fn the_inertial_sensor_and_odometry_do_not_feel_it() {
    for mover in ["gait.mode='strides'", "robot.model='jackal'"] {
        for bandwidth in ["imu.rate_hz=500.0", "imu.bandwidth_hz=100.0"] {
            let [carried, left] = [KIDNAP, ELSEWHERE].map(|kidnap| {
                let mut sim = simulator(&[&LEVEL[..], &[mover, bandwidth, kidnap]].concat());
                after(&mut sim, 2900);
                let seen: Vec<Observation> = (0..200).flat_map(|_| sim.step()).collect();
                seen
            });
            let mut compared = 0;
            for (one, other) in carried.iter().zip(&left) {
                let off = match (one, other) {
                    (Observation::Imu(one), Observation::Imu(other)) => {
                        (one.specific_force_mps2 - other.specific_force_mps2).norm()
                            + (one.rate_radps - other.rate_radps).norm()
                    }
                    (Observation::Odometry(one), Observation::Odometry(other)) => {
                        (one.twist.linear_mps - other.twist.linear_mps).norm()
                            + (one.twist.angular_radps - other.twist.angular_radps).norm()
                    }
                    _ => continue,
                };
                compared += 1;
                assert!(off < 1e-3, "{mover}, {bandwidth}: {one:?} instead of {other:?}");
            }
            assert!(compared > 100);
        }
    }
}

#[test]
fn physics_keeps_its_feet_on_the_cone_field_wherever_it_is_put() {
    for (forward_m, left_m, turned_deg) in
        [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-2.0, 0.5, 180.0), (0.3, -1.0, -70.0)]
    {
        let kidnap =
            format!("kidnap=[{{at_s=3.0, by_m=[{forward_m:?}, {left_m:?}], turned_deg={turned_deg:?}}}]");
        let mut sim = simulator(&["gait.mode='physics'", "world.planting.count=0", &kidnap]);
        for tick in 0..6000 {
            sim.advance();
            assert_eq!(sim.fall(), None, "{kidnap}: falls {tick} ms after the run began");
        }
    }
}

#[test]
fn two_kidnaps_add_up_and_looking_ahead_of_them_changes_nothing() {
    let twice = "kidnap=[{at_s=0.3, by_m=[0.5, 0.0]}, {at_s=0.32, turned_deg=90.0}]";
    let [mut plain, mut ahead] =
        [(); 2].map(|()| simulator(&["gait.mode='strides'", "run.stand_s=0.0", twice]));
    for tick in 1..=500 {
        let (one, other) = (plain.step(), ahead.step());
        assert_eq!(one, other, "tick {tick}");
        assert_eq!(plain.truth(), ahead.truth(), "tick {tick}");
        if one.iter().any(|one| matches!(one, Observation::Sweep(_))) {
            ahead.look_ahead();
            ahead.look_ahead_to_sweep();
        }
    }
    let mut left = simulator(&["gait.mode='strides'", "run.stand_s=0.0"]);
    let turned = |truth: &Truth| planar(&truth.world_from_base).rotation.angle();
    let off_rad = wrap_angle(turned(&plain.truth()) - turned(&after(&mut left, 500)));
    assert!((off_rad - 90_f64.to_radians()).abs() < 1e-6, "{off_rad}");
    assert_eq!(plain.now(), Time::SIMULATION_START + arborloop_base::Span::from_millis(500));
}

#[test]
fn a_kidnap_that_no_run_can_make_is_refused_where_it_is_written() {
    let text = |kidnap: &str| {
        let scenario = Scenario::embedded("cone-field-go1-short").unwrap().text;
        Document::new("mine.toml", format!("{scenario}\n[[kidnap]]\nat_s = 5.0\n\n[[kidnap]]\n{kidnap}\n"))
    };
    for (kidnap, wanted) in [
        ("at_s = -1.0", "found -1, wanted 0 to 1000000"),
        ("at_s = 9.0\nby_m = [0.0, 5000.0]", "found 5000, wanted -1000 to 1000"),
        ("at_s = 9.0\nturned_deg = 720.0", "found 720, wanted -360 to 360"),
        ("at_s = 9.0\nturn_deg = 20.0", "unknown key `turn_deg` (did you mean `turned_deg`?"),
        ("by_m = [1.0, 0.0]", "missing field `at_s`"),
    ] {
        let refusal = Scenario::read(&text(kidnap)).unwrap_err();
        assert!(refusal.to_string().contains(wanted), "{refusal}");
        let (line, _) = refusal.line_and_column().unwrap();
        let first = text(kidnap).text.lines().position(|line| line == "[[kidnap]]").unwrap() + 1;
        assert!(line > first + 2, "{refusal} is not at the second of them");
        assert!(refusal.to_string().starts_with("mine.toml:"), "{refusal}");
    }
}
