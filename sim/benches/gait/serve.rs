//! The controller of the walk for a body in another program's engine: its state comes in, torques go out, line by line.
//!
//! `serve flat SECONDS` or `serve uneven SECONDS`. First this side says what it walks with, one `name numbers...` a line
//! and then `ready`. From there on the other side says its state (position, quaternion x y z w, velocity of the base in
//! world axes, turn rate in base axes, joint angles, joint rates, force on each foot: 41 numbers), and is answered by
//! twelve torques, every millisecond. At the end come lines of what was measured, ours and theirs, with the greatest
//! difference that is allowed between them. Motors give what they are asked for on both sides, and nobody pushes.

use super::walked::{Guide, Measured, TICK_S, Walk, ground, walk, walk_on};
use super::{ahead, sensed};
use arborloop_base::{Pose, Pose2, Seed, Span, pose2};
use arborloop_robots::{
    Body, Command, Fall, FallCause, Ground, Loads, TrotSettings, TrunkMotion, TrunkState, Walker, go1,
};
use arborloop_sim::PhysicsGait;
use arborloop_worlds::World;
use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3};
use std::io::{BufRead, Write};

/// Numbers of a state.
const STATE: usize = 41;
/// A trunk that leans by more has fallen, radians: as in our own engine.
const FALLEN_RAD: f64 = std::f64::consts::FRAC_PI_3;

/// Serves one walk and compares it with ours.
///
/// # Panics
/// When the other side does not keep to the protocol.
pub(crate) fn serve(words: &[String]) {
    let uneven = words.iter().any(|word| word == "uneven");
    let seconds = words.iter().find_map(|word| word.parse().ok()).unwrap_or(20.0);
    let mut settings = TrotSettings::default();
    settings.physics.torque_error_ratio = 0.0;
    let world = if uneven { ground(0.03, 5.0, 1) } else { ground(0.0, 0.0, 1) };
    let guide = if uneven { Guide::Rectangle(0.5) } else { ahead(0.5) };
    let tick = Span::from_seconds(TICK_S);
    let standing = PhysicsGait::new(&world, &settings, pose2(0.0, 0.0, 0.0), tick, Seed(1)).state().clone();
    introduce(&world, &settings, &standing);
    let theirs = walk_on(&mut Foreign::new(settings.clone()), &world, &guide, seconds);
    println!("done");
    let ours = walk(&world, &settings, &guide, seconds, 1);
    match (&ours.fall, &theirs.fall) {
        (None, None) => compare(&ours, &theirs),
        (ours, theirs) => println!("fell: {ours:?} with us, {theirs:?} with them"),
    }
}

fn row(name: &str, numbers: impl IntoIterator<Item = f64>) {
    let numbers: Vec<String> = numbers.into_iter().map(|number| format!("{number:e}")).collect();
    println!("{name} {}", numbers.join(" "));
}

/// Says what the other engine is to be filled with.
fn introduce(world: &World, settings: &TrotSettings, standing: &TrunkState) {
    row("tick_s", [TICK_S]);
    row("friction", [settings.physics.friction]);
    println!("joints {}", go1::JOINT_NAMES.join(" "));
    println!("feet {}", go1::LEGS.map(|leg| format!("{leg}_foot")).join(" "));
    row("rotors_kgm2", go1::JOINT_NAMES.iter().enumerate().map(|(n, _)| go1::MOTORS[n % 3].rotor_kgm2));
    let payload = go1::payload();
    row("payload_kg", [payload.mass_kg]);
    row("payload_center_m", payload.center_of_mass.iter().copied());
    row("payload_inertia_kgm2", payload.inertia_kgm2.iter().copied());
    row("position_m", standing.world_from_base.translation.vector.iter().copied());
    row("quaternion_xyzw", standing.world_from_base.rotation.coords.iter().copied());
    row("angles_rad", standing.joint_angles_rad);
    let (grid, bounds) = (world.terrain.grid(), world.terrain.bounds());
    row("ground_low_m", bounds.low.iter().copied());
    row("ground_high_m", bounds.high.iter().copied());
    row("ground_columns", [grid.columns() as f64]);
    // Row by row from the lowest y, x upward in each.
    let places = (0..grid.rows()).flat_map(|row| (0..grid.columns()).map(move |column| (column, row)));
    row("ground_m", places.map(|(column, row)| grid.get(column, row).copied().unwrap_or_default()));
    println!("ready");
}

/// A body in the other program, behind the gait seam.
struct Foreign {
    walker: Walker,
    state: TrunkState,
    ticks: i64,
    fall: Option<Fall>,
    contact_n: f64,
}

impl Foreign {
    fn new(settings: TrotSettings) -> Self {
        let contact_n = settings.physics.contact_n;
        let state = heard([0.0; 12], 0.0, contact_n);
        let known = sensed(&state).expect("a state that was heard has its loads");
        let walker = Walker::new(Body::go1(), settings, &known, TICK_S);
        Foreign { walker, state, ticks: 0, fall: None, contact_n }
    }
}

impl TrunkMotion for Foreign {
    fn advance(&mut self, command: &Command, _ground: &dyn Ground) -> &TrunkState {
        let (Some(known), None) = (sensed(&self.state), self.fall) else { return &self.state };
        let asked = self.walker.step(command, &known);
        let motors = self.walker.body().motors;
        let given = std::array::from_fn(|j| motors[j % 3].torque_nm(asked[j], known.joint_rates_radps[j]));
        row("torques", given);
        std::io::stdout().flush().expect("the other side listens");
        self.state = heard(given, self.walker.phase(), self.contact_n);
        self.ticks += 1;
        let up = self.state.world_from_base.rotation * Vector3::z();
        if up.z < FALLEN_RAD.cos() {
            let after = Span::from_seconds(TICK_S) * self.ticks;
            self.fall = Some(Fall { after, cause: FallCause::Tipped });
        }
        &self.state
    }

    fn carry(&mut self, _by: &Pose2, _ground: &dyn Ground) {
        unimplemented!("the other side has no word for being carried off")
    }

    fn state(&self) -> &TrunkState {
        &self.state
    }

    fn fall(&self) -> Option<Fall> {
        self.fall
    }
}

/// The next state that the other side says, under the torques that it was given.
fn heard(torques_nm: [f64; 12], phase: f64, contact_n: f64) -> TrunkState {
    let mut line = String::new();
    std::io::stdin().lock().read_line(&mut line).expect("the other side talks");
    let said: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    assert_eq!(said.len(), STATE, "a state has {STATE} numbers, but the line reads {line:?}");
    let three = |n: usize| Vector3::new(said[n], said[n + 1], said[n + 2]);
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(said[6], said[3], said[4], said[5]));
    let world_from_base = Pose::from_parts(Translation3::from(three(0)), turn);
    let joint_angles_rad: [f64; 12] = std::array::from_fn(|n| said[13 + n]);
    let forces: [f64; 4] = std::array::from_fn(|leg| said[37 + leg]);
    TrunkState {
        world_from_base,
        linear_mps: three(7),
        angular_radps: three(10),
        phase,
        stance: forces.map(|force| force > contact_n),
        feet_world: std::array::from_fn(|leg| {
            let angles = [0, 1, 2].map(|n| joint_angles_rad[3 * leg + n]);
            world_from_base * go1::foot(leg, angles)
        }),
        joint_angles_rad,
        loads: Some(Loads {
            joint_rates_radps: std::array::from_fn(|n| said[25 + n]),
            joint_torques_nm: torques_nm,
            // Sizes are what the controller feels; they stand upright here for want of a direction.
            foot_forces_n: forces.map(|force| Vector3::z() * force),
        }),
        rolled: None,
    }
}

/// One line a measure: `name | ours | theirs | greatest difference allowed in percent, 0 for none`.
fn compare(ours: &Walk, theirs: &Walk) {
    let (ours, theirs) = (ours.measured(), theirs.measured());
    let below = |one: &Measured| one.az_mps2[0].hypot(one.az_mps2[1]);
    let line = |name: &str, percent: f64, pick: &dyn Fn(&Measured) -> f64| {
        println!("{name} | {} | {} | {percent}", pick(&ours), pick(&theirs));
    };
    line("az 1-20 Hz, m/s2", 15.0, &|one| one.az_mps2[0]);
    line("az 20-100 Hz, m/s2", 15.0, &|one| one.az_mps2[1]);
    line("az 1-100 Hz, m/s2", 15.0, &below);
    line("az 100-400 Hz, m/s2", 0.0, &|one| one.az_mps2[2]);
    line("az at f, m/s2", 0.0, &|one| one.harmonics_mps2[0]);
    for (index, times) in [(1, 2), (2, 4), (3, 6), (4, 8)] {
        line(&format!("az at {times}f, m/s2"), 25.0, &|one| one.harmonics_mps2[index]);
    }
    line("cost of transport, all power", 10.0, &|one| one.cost_abs);
    line("cost of transport, positive power", 10.0, &|one| one.cost_positive);
    line("roll, deg rms", 0.0, &|one| one.roll_deg);
    line("pitch, deg rms", 0.0, &|one| one.pitch_deg);
    line("bob, mm", 0.0, &|one| one.bob_m * 1e3);
    line("speed, m/s", 0.0, &|one| one.speed_mps);
}
