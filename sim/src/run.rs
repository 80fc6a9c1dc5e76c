//! The loop: open, closed, and the comparison of several systems are one `while`; who drives is data.

use crate::simulator::Simulator;
use arborloop_base::{
    Contact, Estimate, Health, Observation, ObservationKind, Record, Sink, SinkError, Slam, Span, Time,
    planar,
};
use arborloop_robots::{Command, FallCause, Follower, Progress};
use std::collections::VecDeque;
use std::sync::Arc;

/// A system under test with the name that records and reports use.
pub struct System {
    /// Its name.
    pub name: String,
    /// The system.
    pub slam: Box<dyn Slam>,
    /// What it is fed; lidar alone unless it asks for more.
    pub inputs: Vec<ObservationKind>,
}

/// Who steers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Driver {
    /// Truth: the same path for every system.
    Truth,
    /// The system at this index, by its own belief.
    System(usize),
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The driver believes to be at the end of the route.
    Finished,
    /// The time was up first.
    TimeUp,
    /// The driving system was lost for too long.
    Lost,
    /// The robot fell; how long after the run began is its duration.
    Fell(FallCause),
    /// The caller asked to stop.
    Stopped,
}

impl std::fmt::Display for End {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            End::Fell(cause) => write!(f, "Fell ({cause})"),
            End::Finished | End::TimeUp | End::Lost | End::Stopped => write!(f, "{self:?}"),
        }
    }
}

/// The robot began to touch something.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ContactEvent {
    /// When.
    pub stamp: Time,
    /// What touched what.
    pub contact: Contact,
}

/// What came of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub end: End,
    /// Simulated time.
    pub duration: Span,
    /// How far along the route the driver believed to be.
    pub progress: Progress,
    /// Every touch, once at its beginning.
    pub contacts: Vec<ContactEvent>,
}

/// Runs to the end of the route or of the time. `sink` gets every record in order; `go_on` is asked once a sweep.
///
/// # Errors
/// What the sink refuses, as it said it.
pub fn run(
    sim: &mut Simulator,
    systems: &mut [System],
    driver: Driver,
    sink: &mut dyn Sink,
    go_on: &mut dyn FnMut(&Simulator, &Progress) -> bool,
) -> Result<Outcome, SinkError> {
    let mut follower = sim.follower();
    let joints = sim.joint_names().to_vec();
    let mut watch = Watch::default();
    let mut end = End::TimeUp;
    let mut lent = VecDeque::new();
    let steered_by_sweeps = match driver {
        Driver::Truth => true,
        Driver::System(index) => {
            systems.get(index).is_none_or(|system| system.inputs == [ObservationKind::Lidar])
        }
    };
    sink.write(sim.now(), &Record::Truth(&sim.truth()))?;
    while sim.now() < sim.end() {
        let observations: Vec<Arc<Observation>> = sim.step().into_iter().map(Arc::new).collect();
        let truth = sim.truth();
        sink.write(sim.now(), &Record::Truth(&truth))?;
        watch.contacts(sim.now(), &truth.contacts);
        for observation in &observations {
            sink.write_observation(sim.now(), observation)?;
            if let Observation::Sweep(sweep) = &**observation {
                sink.write(sim.now(), &Record::Labels { sweep, labels: sim.labels() })?;
                sink.write(
                    sim.now(),
                    &Record::Joints { names: &joints, angles_rad: sim.joint_angles_rad() },
                )?;
                if driver == Driver::Truth {
                    steer(sim, &mut follower, &truth.as_estimate());
                }
            }
            let answers = ask(sim, systems, observation);
            for (index, (system, answer)) in systems.iter().zip(answers).enumerate() {
                let Some(estimate) = answer else { continue };
                sink.write(sim.now(), &Record::Estimate { system: &system.name, estimate: &estimate })?;
                if driver == Driver::System(index) {
                    watch.health(&estimate);
                    steer(sim, &mut follower, &estimate);
                }
            }
            if is_sweep(observation) {
                sink.write(sim.now(), &Record::Command(&sim.command()))?;
                if !go_on(sim, &follower.progress()) {
                    end = End::Stopped;
                }
            }
        }
        let has_sweep = observations.iter().any(|observation| is_sweep(observation));
        lent.extend(observations.into_iter().filter(|observation| is_sweep(observation)));
        take_back(sim, &mut lent);
        if let Some(fall) = sim.fall() {
            end = End::Fell(fall.cause);
        }
        let over = matches!(end, End::Stopped | End::Fell(_)) || watch.over(sim, &follower, &mut end);
        if has_sweep {
            settle(sim, systems, !over && steered_by_sweeps);
        }
        if over {
            break;
        }
    }
    Ok(Outcome {
        end,
        duration: sim.now() - Time::SIMULATION_START,
        progress: follower.progress(),
        contacts: watch.events,
    })
}

fn is_sweep(observation: &Observation) -> bool {
    matches!(observation, Observation::Sweep(_))
}

/// Gives the simulator its sweeps' memory back, as far as a recorder has done with them.
fn take_back(sim: &mut Simulator, lent: &mut VecDeque<Arc<Observation>>) {
    while let Some(first) = lent.pop_front() {
        match Arc::try_unwrap(first) {
            Ok(observation) => sim.take_back(observation),
            Err(first) => {
                lent.push_front(first);
                break;
            }
        }
    }
}

/// Every system's answer. While they think about a sweep, the simulator works out what no answer can change.
fn ask(sim: &mut Simulator, systems: &mut [System], observation: &Observation) -> Vec<Option<Estimate>> {
    let mut asked = || systems.iter_mut().map(|system| answer(system, observation)).collect::<Vec<_>>();
    if is_sweep(observation) { rayon::join(asked, || sim.look_ahead()).0 } else { asked() }
}

/// Every system's work behind its answer. Meanwhile the next sweep is worked out as a whole, where commands follow sweeps.
fn settle(sim: &mut Simulator, systems: &mut [System], to_sweep: bool) {
    let ahead = || {
        if to_sweep {
            sim.look_ahead_to_sweep();
        }
    };
    rayon::join(|| systems.iter_mut().for_each(|system| system.slam.settle()), ahead);
}

fn answer(system: &mut System, observation: &Observation) -> Option<Estimate> {
    if !system.inputs.contains(&observation.kind()) {
        return None;
    }
    system.slam.observe(observation)
}

/// A robot whose driver is lost stands still rather than walk blind.
fn steer(sim: &mut Simulator, follower: &mut Follower, estimate: &Estimate) {
    let command = match estimate.health {
        Health::Lost => Command::default(),
        Health::Tracking | Health::Degraded => follower.steer(&planar(&estimate.map_from_base)),
    };
    sim.queue(command);
}

/// What the loop keeps an eye on.
#[derive(Default)]
struct Watch {
    touching: Vec<Contact>,
    events: Vec<ContactEvent>,
    finished_at: Option<Time>,
    lost_since: Option<Time>,
}

impl Watch {
    fn contacts(&mut self, stamp: Time, contacts: &[Contact]) {
        for contact in contacts {
            if !self.touching.contains(contact) {
                self.events.push(ContactEvent { stamp, contact: contact.clone() });
            }
        }
        self.touching = contacts.to_vec();
    }

    fn health(&mut self, estimate: &Estimate) {
        self.lost_since = match estimate.health {
            Health::Lost => self.lost_since.or(Some(estimate.stamp)),
            Health::Tracking | Health::Degraded => None,
        };
    }

    fn over(&mut self, sim: &Simulator, follower: &Follower, end: &mut End) -> bool {
        let run = &sim.scenario().run;
        if follower.progress().finished {
            let finished_at = *self.finished_at.get_or_insert(sim.now());
            *end = End::Finished;
            return sim.now() - finished_at >= Span::from_seconds(run.calm_s);
        }
        let lost =
            self.lost_since.is_some_and(|since| sim.now() - since > Span::from_seconds(run.lost_s_max));
        if lost {
            *end = End::Lost;
        }
        lost
    }
}
