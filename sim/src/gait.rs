//! What moves the robot in a run, and what it touches on the way: kinematics beside a contact finder, or physics.

use crate::physics::{PhysicsGait, Touch, WheeledGait};
use crate::scenario::{RobotModel, Scenario};
use arborloop_base::{Contact, Pose2, Seed, Span};
use arborloop_robots::{
    Command, Fall, GaitMode, Ground, KinematicTrot, TrotSettings, TrunkMotion, TrunkState, Wheeled, wheels,
};
use arborloop_worlds::{Terrain, World};

/// A gait with the contacts of its body.
pub(crate) enum Gait {
    /// A motion without forces, and an engine that finds what the body touches.
    Kinematic { motion: Box<dyn TrunkMotion>, touch: Box<Touch> },
    /// A body with legs in the engine.
    Physics(Box<PhysicsGait>),
    /// A body on wheels in the engine.
    Wheels(Box<WheeledGait>),
}

/// The terrain as the robot's feet know it.
struct Soil<'a>(&'a Terrain);

impl Ground for Soil<'_> {
    fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        self.0.height_m(x_m, y_m)
    }
}

impl Gait {
    pub(crate) fn new(world: &World, scenario: &Scenario, seed: Seed) -> Self {
        let (start, tick) = (scenario.start.pose(), scenario.tick());
        match wheeled(scenario.robot.model) {
            Some(robot) => {
                let gait = WheeledGait::new(world, robot, &scenario.wheels, start, tick, seed);
                Gait::Wheels(Box::new(gait))
            }
            None => Gait::on_legs(world, &scenario.gait, start, tick, seed),
        }
    }

    fn on_legs(world: &World, settings: &TrotSettings, start: Pose2, tick: Span, seed: Seed) -> Self {
        match settings.mode {
            GaitMode::Kinematic | GaitMode::Strides | GaitMode::Smooth => {
                let trot = KinematicTrot::new(settings.clone(), start, tick, &Soil(&world.terrain), seed);
                let touch = Box::new(Touch::new(world, trot.state(), tick.seconds()));
                Gait::Kinematic { motion: Box::new(trot), touch }
            }
            GaitMode::Physics => {
                Gait::Physics(Box::new(PhysicsGait::new(world, settings, start, tick, seed)))
            }
        }
    }

    /// One tick; what the body touches after it.
    pub(crate) fn advance(&mut self, command: &Command, terrain: &Terrain) -> Vec<Contact> {
        match self {
            Gait::Kinematic { motion, touch } => touch.step(motion.advance(command, &Soil(terrain))),
            Gait::Physics(gait) => {
                gait.advance(command, &Soil(terrain));
                gait.touching()
            }
            Gait::Wheels(gait) => {
                gait.advance(command, &Soil(terrain));
                gait.touching()
            }
        }
    }

    /// Puts the robot down elsewhere as it is; what a body that something else moves touches there. What physics finds there
    /// is known a tick later.
    pub(crate) fn carry(&mut self, by: &Pose2, terrain: &Terrain) -> Vec<Contact> {
        match self {
            Gait::Kinematic { motion, touch } => {
                motion.carry(by, &Soil(terrain));
                touch.step(motion.state())
            }
            Gait::Physics(gait) => {
                gait.carry(by, &Soil(terrain));
                Vec::new()
            }
            Gait::Wheels(gait) => {
                gait.carry(by, &Soil(terrain));
                Vec::new()
            }
        }
    }

    pub(crate) fn state(&self) -> &TrunkState {
        match self {
            Gait::Kinematic { motion, .. } => motion.state(),
            Gait::Physics(gait) => gait.state(),
            Gait::Wheels(gait) => gait.state(),
        }
    }

    pub(crate) fn fall(&self) -> Option<Fall> {
        match self {
            Gait::Kinematic { motion, .. } => motion.fall(),
            Gait::Physics(gait) => gait.fall(),
            Gait::Wheels(gait) => gait.fall(),
        }
    }
}

/// The robots on wheels; `None` for those on legs.
pub(crate) fn wheeled(model: RobotModel) -> Option<Wheeled> {
    match model {
        RobotModel::Go1 => None,
        RobotModel::Jackal => Some(wheels::jackal()),
        RobotModel::Thorvald => Some(wheels::thorvald()),
    }
}
