//! `arborloop explain`: what one beam of a run met. The run is walked again by its recorded commands, up to that sweep.

use crate::arguments::Explain;
use crate::failure::Failure;
use crate::load;
use arborloop_base::{Observation, Seed, Span, Sweep, Time, Twist};
use arborloop_eval::dataset::{self, Recording};
use arborloop_robots::Command;
use arborloop_sim::{Scenario, Simulator};
use std::collections::VecDeque;

pub(crate) fn explain(verb: &Explain) -> Result<(), Failure> {
    let scenario = Scenario::read(&load::file(&verb.run.join("scenario.resolved.toml"))?)?;
    let recording = dataset::open(&verb.run)?;
    let recorded = recorded_sweep(verb, &recording)?;
    let mut sim = Simulator::new(&scenario, Seed(scenario.seed));
    let period = Span::from_seconds(1.0 / scenario.lidar.rate_hz);
    let end = Time::SIMULATION_START + period * (verb.sweep as i64 + 1);
    let mut commands = effective(&recording.commands()?, &scenario, period);
    while sim.now() + scenario.tick() < end {
        obey(&mut sim, &scenario, &mut commands);
        sim.advance();
    }
    obey(&mut sim, &scenario, &mut commands);
    let sweep = sim.step().into_iter().find_map(|observation| match observation {
        Observation::Sweep(sweep) => Some(sweep),
        _ => None,
    });
    if sweep.as_ref() != Some(&recorded) {
        return Err(Failure::Input(format!(
            "{}: sweep {} came out otherwise when the run was walked again; wanted the run of this version of arborloop, \
             made on a machine of this kind, with its files unchanged",
            verb.run.display(),
            verb.sweep
        )));
    }
    let Some(story) = sim.explain(verb.ray) else {
        return Err(Failure::Usage(format!(
            "found --ray {}, wanted 0 to {}: sweep {} has {} firings",
            verb.ray,
            sim.firings().saturating_sub(1),
            verb.sweep,
            sim.firings()
        )));
    };
    println!(
        "{}, seed {}, sweep {} of the {}",
        scenario.name, scenario.seed, verb.sweep, scenario.lidar.model.name
    );
    print!("{story}");
    Ok(())
}

/// The sweep as the run's recording holds it.
fn recorded_sweep(verb: &Explain, recording: &Recording) -> Result<Sweep, Failure> {
    let mut count = 0;
    for observation in recording.observations()? {
        let Observation::Sweep(sweep) = observation? else { continue };
        if count == verb.sweep {
            return Ok(sweep);
        }
        count += 1;
    }
    Err(Failure::Usage(format!(
        "found --sweep {}, wanted 0 to {}: {} has {count} sweeps",
        verb.sweep,
        count.max(1) - 1,
        verb.run.display()
    )))
}

/// Commands with the instant from which each was obeyed. What was obeyed at the end of a sweep had been queued at the
/// end of an earlier one, the latency before.
fn effective(commands: &[(Time, Twist)], scenario: &Scenario, period: Span) -> VecDeque<(Time, Twist)> {
    let delay = Span::from_seconds(scenario.run.latency_s).max(scenario.tick());
    let whole = |span: Span| span.nanos().div_euclid(period.nanos());
    let due = |stamp: Time| {
        let sweeps_before = whole(stamp - Time::SIMULATION_START - delay);
        (sweeps_before >= 1).then(|| Time::SIMULATION_START + period * sweeps_before + delay)
    };
    commands.iter().filter_map(|(stamp, twist)| Some((due(*stamp)?, *twist))).collect()
}

/// Obeys what is due by the next tick.
fn obey(sim: &mut Simulator, scenario: &Scenario, commands: &mut VecDeque<(Time, Twist)>) {
    while let Some((due, twist)) = commands.front().copied()
        && due <= sim.now() + scenario.tick()
    {
        sim.obey(Command { forward_mps: twist.linear_mps.x, turn_radps: twist.angular_radps.z });
        commands.pop_front();
    }
}
