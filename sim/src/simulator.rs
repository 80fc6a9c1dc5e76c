//! World, robot and sensors on one clock: a tick in, what the sensors say out.

use crate::gait::{Gait, wheeled};
use crate::optics::Optics;
use crate::scenario::Scenario;
use crate::sensor::{FiringStory, Gnss, InertialSensor, LegOdometry, Lidar, Motion, Surroundings};
use arborloop_base::{Contact, Label, Observation, Pose, Seed, Span, Time, Truth, Twist, spatial};
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
}

impl Simulator {
    /// Grows the world and stands the robot on it. The scenario has passed its checks when it was read.
    pub fn new(scenario: &Scenario, seed: Seed) -> Self {
        let tick = scenario.tick();
        let world = arborloop_worlds::build(&scenario.world, seed);
        let start = scenario.start.pose();
        let gait = Gait::new(&world, scenario, seed);
        let state = gait.state();
        let (robot, joint_names) = match wheeled(scenario.robot.model) {
            Some(wheeled) => (wheeled.robot.clone(), wheeled.joint_names()),
            None => (go1(), go1::JOINT_NAMES.map(str::to_owned).to_vec()),
        };
        let mount = |sensor| robot.mount(sensor).expect("the embedded robots carry every sensor's frame");
        let period = |rate_hz: f64| Span::from_seconds(1.0 / rate_hz);
        let turn = period(scenario.lidar.rate_hz);
        let start_height = state.world_from_base.translation.z;
        Simulator {
            optics: Optics::new(&world),
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
        &self.gait.state().joint_angles_rad[..self.joint_names.len()]
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
        self.gait.state()
    }

    /// The robot's fall, once there was one.
    pub fn fall(&self) -> Option<Fall> {
        self.gait.fall()
    }

    /// Truth of every return of the last sweep, in its order.
    pub fn labels(&self) -> &[Label] {
        &self.labels
    }

    /// What is true now.
    pub fn truth(&self) -> Truth {
        let state = self.gait.state();
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
        self.advance();
        self.observe()
    }

    /// One tick in which the sensors are not asked: the robot moves as it would have.
    pub fn advance(&mut self) {
        self.now += self.scenario.tick();
        while let Some((due, command)) = self.queued.front().copied()
            && due <= self.now
        {
            self.command = command;
            self.queued.pop_front();
        }
        let standing = self.now < Time::SIMULATION_START + Span::from_seconds(self.scenario.run.stand_s);
        let command = if standing { Command::default() } else { self.command };
        self.contacts = self.gait.advance(&command, &self.world.terrain);
        let state = self.gait.state();
        self.motion.push_body(state.world_from_base, state.joint_angles_rad);
        if let Some(odometry) = self.odometry.as_mut() {
            odometry.feel(state);
        }
        if let Some(imu) = self.imu.as_mut() {
            imu.feel(self.scenario.tick(), &state.world_from_base, &state.linear_mps, &state.angular_radps);
        }
    }

    fn observe(&mut self) -> Vec<Observation> {
        let (now, state) = (self.now, self.gait.state());
        let due = |period: Span| (now - Time::SIMULATION_START).whole_steps(period).is_some();
        let mut observations = Vec::new();
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
        if due(self.lidar.period()) {
            let (sweep, labels) =
                self.lidar.sweep(now, Surroundings { motion: &self.motion, optics: &self.optics });
            self.labels = labels;
            observations.push(Observation::Sweep(sweep));
        }
        observations
    }
}
