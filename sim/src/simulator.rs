//! World, robot and sensors on one clock: a tick in, what the sensors say out.

use crate::gait::{Gait, wheeled};
use crate::optics::Optics;
use crate::scenario::Scenario;
use crate::sensor::{FiringStory, Gnss, InertialSensor, LegOdometry, Lidar, Motion, Surroundings};
use arborloop_base::{
    Contact, Label, Observation, Pose, Pose2, Seed, Span, Time, Truth, Twist, planar, spatial,
};
use arborloop_robots::{Command, Fall, Follower, Robot, SensorFrame, TrunkState, go1};
use arborloop_worlds::World;
use nalgebra::Translation3;
use std::collections::VecDeque;

/// A scenario brought to life with one seed.
pub struct Simulator {
    scenario: Scenario,
    world: World,
    optics: Optics,
    robot: Robot,
    joint_names: Vec<String>,
    gait: Gait,
    motion: Motion,
    lidar: Lidar,
    imu: Option<InertialSensor>,
    gnss: Option<Gnss>,
    odometry: Option<LegOdometry>,
    labels: Vec<Label>,
    contacts: Vec<Contact>,
    world_from_start: Pose,
    now: Time,
    command: Command,
    queued: VecDeque<(Time, Command)>,
    state: TrunkState,
    fall: Option<Fall>,
    /// Ticks that nobody has seen yet, from the next one on.
    ahead: VecDeque<Tick>,
}

/// What one tick brings, the sweep left out.
struct Tick {
    now: Time,
    command: Command,
    state: TrunkState,
    contacts: Vec<Contact>,
    fall: Option<Fall>,
    observations: Vec<Observation>,
}

impl Simulator {
    /// Grows the world and stands the robot on it. The scenario has passed its checks when it was read.
    pub fn new(scenario: &Scenario, seed: Seed) -> Self {
        let tick = scenario.tick();
        let world = arborloop_worlds::build(&scenario.world, seed);
        let (gait, optics) = rayon::join(|| Gait::new(&world, scenario, seed), || Optics::new(&world));
        let state = gait.state().clone();
        let (robot, joint_names) = match wheeled(scenario.robot.model) {
            Some(wheeled) => (wheeled.robot.clone(), wheeled.joint_names()),
            None => (go1(), go1::JOINT_NAMES.map(str::to_owned).to_vec()),
        };
        let mount = |sensor| robot.mount(sensor).expect("the embedded robots carry every sensor's frame");
        let period = |rate_hz: f64| Span::from_seconds(1.0 / rate_hz);
        let turn = period(scenario.lidar.rate_hz);
        let start = planar(&state.world_from_base);
        let start_height = state.world_from_base.translation.z;
        Simulator {
            optics,
            // A turn is looked back on as a whole, plus the firing cycle that begins before it.
            motion: Motion::new(
                Time::SIMULATION_START,
                state.world_from_base,
                tick,
                turn + Span::from_millis(10),
            ),
            lidar: Lidar::new(&scenario.lidar, turn, mount(SensorFrame::Lidar), seed.stream("lidar"))
                .on(&robot)
                .under(&scenario.weather, &scenario.fault),
            imu: scenario.imu.as_ref().map(|imu| {
                InertialSensor::new(imu, period(imu.rate_hz), mount(SensorFrame::Imu), seed.stream("imu"))
            }),
            gnss: scenario.gnss.as_ref().map(|gnss| {
                Gnss::new(gnss, period(gnss.rate_hz), mount(SensorFrame::Antenna), seed.stream("gnss"))
            }),
            odometry: scenario.odometry.as_ref().map(|odometry| {
                LegOdometry::new(odometry, period(odometry.rate_hz), seed.stream("odometry"))
            }),
            labels: Vec::new(),
            contacts: Vec::new(),
            // Level, so that a route and a gravity-aligned map lie in the same plane whatever the first slope.
            world_from_start: Translation3::new(0.0, 0.0, start_height) * spatial(&start),
            now: Time::SIMULATION_START,
            command: Command::default(),
            queued: VecDeque::new(),
            fall: gait.fall(),
            state,
            ahead: VecDeque::new(),
            scenario: scenario.clone(),
            world,
            robot,
            joint_names,
            gait,
        }
    }

    /// The present.
    pub fn now(&self) -> Time {
        self.now
    }

    /// When the run ends at the latest.
    pub fn end(&self) -> Time {
        Time::SIMULATION_START + Span::from_seconds(self.scenario.run.duration_s_max)
    }

    /// What the simulator was made from.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// What stands around.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// What beams meet.
    pub fn optics(&self) -> &Optics {
        &self.optics
    }

    /// The robot's description, with its sensors' frames.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Names of the joints whose angles [`Simulator::joint_angles_rad`] tells.
    pub fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    /// Angles of the robot's joints now, radians.
    pub fn joint_angles_rad(&self) -> &[f64] {
        &self.state.joint_angles_rad[..self.joint_names.len()]
    }

    /// The lidar's mount on the base.
    pub fn base_from_lidar(&self) -> Pose {
        self.robot.mount(SensorFrame::Lidar).unwrap_or_else(Pose::identity)
    }

    /// The start in the world: level, at the base's place and heading at time zero.
    pub fn world_from_start(&self) -> Pose {
        self.world_from_start
    }

    /// A follower for the scenario's route.
    pub fn follower(&self) -> Follower {
        Follower::new(self.scenario.route.clone(), self.scenario.follower.clone())
    }

    /// Tells the robot what to do, from the scenario's latency after now.
    pub fn queue(&mut self, command: Command) {
        self.queued.push_back((self.now + Span::from_seconds(self.scenario.run.latency_s), command));
    }

    /// What the robot obeys now.
    pub fn command(&self) -> Twist {
        Twist::planar(self.command.forward_mps, self.command.turn_radps)
    }

    /// The robot's body now.
    pub fn body(&self) -> &TrunkState {
        &self.state
    }

    /// The robot's fall, once there was one.
    pub fn fall(&self) -> Option<Fall> {
        self.fall
    }

    /// Truth of every return of the last sweep, in its order.
    pub fn labels(&self) -> &[Label] {
        &self.labels
    }

    /// What is true now.
    pub fn truth(&self) -> Truth {
        let state = &self.state;
        Truth {
            stamp: self.now,
            world_from_base: state.world_from_base,
            world_from_start: self.world_from_start,
            twist: Twist {
                linear_mps: state.world_from_base.rotation.inverse() * state.linear_mps,
                angular_radps: state.angular_radps,
            },
            contacts: self.contacts.clone(),
        }
    }

    /// The robot obeys a command from the next tick on, whatever is queued: for walking a recorded path again.
    pub fn obey(&mut self, command: Command) {
        self.queued.clear();
        self.command = command;
    }

    /// Firings of the sweep that ends now.
    pub fn firings(&self) -> usize {
        self.lidar.firings(self.now)
    }

    /// The story of a firing of the sweep that ends now, counted from its first; `None` beyond its last.
    pub fn explain(&self, firing: usize) -> Option<FiringStory> {
        let around = Surroundings { motion: &self.motion, optics: &self.optics };
        self.lidar.explain(self.now, firing, around)
    }

    /// One tick: the robot moves, and what its sensors complete in this tick is returned, sweeps last.
    pub fn step(&mut self) -> Vec<Observation> {
        let tick = self.ahead.pop_front().unwrap_or_else(|| {
            let mut tick = self.drive();
            self.sense(&mut tick);
            tick
        });
        let mut observations = self.show(tick);
        if is_due(self.now, self.lidar.period()) {
            let around = Surroundings { motion: &self.motion, optics: &self.optics };
            let (sweep, labels) = self.lidar.sweep(self.now, around);
            self.lidar.reuse_labels(std::mem::replace(&mut self.labels, labels));
            observations.push(Observation::Sweep(sweep));
        }
        observations
    }

    /// Takes an observation that nobody reads any more: the next sweep uses its memory again.
    pub fn take_back(&mut self, observation: Observation) {
        if let Observation::Sweep(sweep) = observation {
            self.lidar.reuse(sweep.returns);
        }
    }

    /// One tick in which the sensors are not asked: the robot moves as it would have.
    pub fn advance(&mut self) {
        let tick = self.ahead.pop_front().unwrap_or_else(|| self.drive());
        self.show(tick);
    }

    /// Works out what no command that is still to come can change: the ticks before one that is queued now would be
    /// obeyed, and the part of the next sweep in them. Nothing of it is seen before its tick; the run is the same, to
    /// the bit, but this may be called while a system thinks.
    pub fn look_ahead(&mut self) {
        self.look_ahead_until(self.now + Span::from_seconds(self.scenario.run.latency_s));
    }

    /// The same up to the next sweep and with it, for a caller who queues no command before he has seen that sweep.
    pub fn look_ahead_to_sweep(&mut self) {
        self.look_ahead_until(self.now + self.lidar.period() + self.scenario.tick());
    }

    /// Works out the ticks before `heard`, the next sweep's at the latest.
    fn look_ahead_until(&mut self, heard: Time) {
        let period = self.lidar.period();
        let turns = (self.now - Time::SIMULATION_START).nanos() / period.nanos();
        let sweep = Time::SIMULATION_START + period * (turns + 1);
        loop {
            let (last, fallen) =
                self.ahead.back().map_or((self.now, self.fall), |tick| (tick.now, tick.fall));
            // A fall ends a run.
            if last + self.scenario.tick() >= heard || fallen.is_some() || last >= sweep {
                break;
            }
            let mut tick = self.drive();
            self.sense(&mut tick);
            self.ahead.push_back(tick);
        }
        if let Some(last) = self.ahead.back() {
            let around = Surroundings { motion: &self.motion, optics: &self.optics };
            self.lidar.fire_ahead(sweep, last.now, around);
        }
    }

    fn show(&mut self, tick: Tick) -> Vec<Observation> {
        (self.now, self.command, self.fall) = (tick.now, tick.command, tick.fall);
        (self.state, self.contacts) = (tick.state, tick.contacts);
        tick.observations
    }

    /// Moves the robot on by a tick.
    fn drive(&mut self) -> Tick {
        let (last, mut command) =
            self.ahead.back().map_or((self.now, self.command), |tick| (tick.now, tick.command));
        let now = last + self.scenario.tick();
        while let Some((due, queued)) = self.queued.front().copied()
            && due <= now
        {
            command = queued;
            self.queued.pop_front();
        }
        let standing = now < Time::SIMULATION_START + Span::from_seconds(self.scenario.run.stand_s);
        let obeyed = if standing { Command::default() } else { command };
        let mut contacts = self.gait.advance(&obeyed, &self.world.terrain);
        let mut state = self.gait.state().clone();
        self.motion.push_body(state.world_from_base, state.joint_angles_rad);
        if let Some(odometry) = self.odometry.as_mut() {
            odometry.feel(&state);
        }
        if let Some(imu) = self.imu.as_mut() {
            imu.feel(self.scenario.tick(), &state.world_from_base, &state.linear_mps, &state.angular_radps);
        }
        for number in 0..self.scenario.kidnap.len() {
            let kidnap = self.scenario.kidnap[number];
            if last <= kidnap.at() && kidnap.at() < now {
                contacts = self.carry_off(&kidnap.by());
                state = self.gait.state().clone();
            }
        }
        Tick { now, command, state, contacts, fall: self.gait.fall(), observations: Vec::new() }
    }

    /// Lifts the robot and puts it down elsewhere at the instant of its last tick; what it touches there.
    fn carry_off(&mut self, by: &Pose2) -> Vec<Contact> {
        let before = self.gait.state().world_from_base;
        let contacts = self.gait.carry(by, &self.world.terrain);
        let world_from_base = self.gait.state().world_from_base;
        let moved = world_from_base * before.inverse();
        self.motion.jump(world_from_base);
        if let Some(odometry) = self.odometry.as_mut() {
            odometry.carry(&moved);
        }
        if let Some(imu) = self.imu.as_mut() {
            imu.carry(&moved);
        }
        contacts
    }

    /// What the sensors complete in a tick, the lidar left out.
    fn sense(&mut self, tick: &mut Tick) {
        let Tick { now, state, observations, .. } = tick;
        let now = *now;
        let due = |period: Span| is_due(now, period);
        if let Some(imu) = self.imu.as_mut().filter(|imu| due(imu.period())) {
            let sample = imu.sample(now, &state.world_from_base, &state.linear_mps, &state.angular_radps);
            observations.extend(sample.map(Observation::Imu));
        }
        if let Some(odometry) = self.odometry.as_mut().filter(|odometry| due(odometry.period())) {
            observations.extend(odometry.sample(now, &state.world_from_base).map(Observation::Odometry));
        }
        if let Some(gnss) = self.gnss.as_ref().filter(|gnss| due(gnss.period())) {
            observations.push(Observation::Fix(gnss.sample(now, &state.world_from_base)));
        }
    }
}

/// Whether a period that counts from the begin of the simulation is over.
fn is_due(now: Time, period: Span) -> bool {
    (now - Time::SIMULATION_START).whole_steps(period).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looking_ahead_changes_nothing_of_what_is_seen() {
        let document = Scenario::embedded("cone-field-go1-short").unwrap();
        let changes = ["gait.mode=strides".to_owned(), "run.stand_s=0.1".to_owned()];
        let scenario = Scenario::read(&document.overridden(&changes).unwrap()).unwrap();
        let [mut plain, mut ahead] = [(); 2].map(|()| Simulator::new(&scenario, Seed(1)));
        for tick in 0..450 {
            let (one, other) = (plain.step(), ahead.step());
            assert_eq!(one, other, "tick {tick}");
            assert_eq!((plain.truth(), plain.command()), (ahead.truth(), ahead.command()), "tick {tick}");
            // NaN marks what was not met, and equals nothing.
            assert_eq!(format!("{:?}", plain.labels()), format!("{:?}", ahead.labels()), "tick {tick}");
            if one.iter().any(|one| matches!(one, Observation::Sweep(_))) {
                ahead.look_ahead();
                assert!(!ahead.ahead.is_empty());
                let command = Command { forward_mps: 0.5, turn_radps: 0.1 * f64::from(tick / 100) };
                [&mut plain, &mut ahead].into_iter().for_each(|sim| sim.queue(command));
                if tick > 250 {
                    ahead.look_ahead_to_sweep();
                    assert_eq!(ahead.ahead.len(), 100);
                }
            }
        }
    }
}
