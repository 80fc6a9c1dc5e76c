//! One run or one replay from beginning to scored end.

use crate::expect::{Expect, Finding};
use crate::failure::Failure;
use crate::systems::{Catalog, Stopwatch, SystemSpec};
use crate::trace::Trace;
use arborloop_base::{
    Cell, Estimate, Grid, Health, Pose, Record, Seed, Sink, Time, Trajectory, Wire, planar,
};
use arborloop_eval::dataset::{
    BackgroundRecorder, Recorded, Recorder, RecorderSettings, Recording, RecordingKind,
};
use arborloop_eval::report::HealthCounts;
use arborloop_eval::{
    Alignment, MapScore, MapScoreSettings, PoseTime, Score, ScoreSettings, Stats, resample, score, score_map,
};
use arborloop_robots::SensorFrame;
use arborloop_sim::{Driver, End, Outcome, Scenario, Simulator, System, run};
use arborloop_worlds::footprint::{HeightSlice, footprint};
use arborloop_worlds::{TrunkTruth, trunk_map};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// The slice of the true map: from knee to hip above the ground, where trunks and cones stand clear of grass.
pub(crate) const TRUTH_SLICE: HeightSlice = HeightSlice { low_m: 0.15, high_m: 0.75 };
/// Side of a cell of the true map, meters.
const TRUTH_CELL_M: f64 = 0.05;

/// What is to be run.
pub(crate) struct Case<'a> {
    pub(crate) scenario: &'a Scenario,
    pub(crate) seed: u64,
    /// Names of systems, in the order of the report.
    pub(crate) systems: &'a [String],
    /// Settings by system name.
    pub(crate) specs: &'a BTreeMap<String, SystemSpec>,
    /// `truth` or a system's name.
    pub(crate) driver: &'a str,
    pub(crate) expectations: &'a [Expect],
}

/// What one system did.
pub(crate) struct SystemResult {
    pub(crate) name: String,
    pub(crate) trajectory: Trajectory,
    /// The path as finally believed, of a system that revises its past.
    pub(crate) revised: Option<Trajectory>,
    pub(crate) score: Result<Score, String>,
    pub(crate) map: Option<Grid<Cell>>,
    pub(crate) map_score: Option<MapScore>,
    pub(crate) health: HealthCounts,
    pub(crate) cpu_ms: Option<Stats>,
}

/// What came of it all.
pub(crate) struct Session {
    pub(crate) name: String,
    pub(crate) seed: u64,
    pub(crate) driver: String,
    pub(crate) systems: Vec<SystemResult>,
    /// The true path, or the reference of a recording.
    pub(crate) reference: Trajectory,
    pub(crate) simulated: Option<Simulated>,
    pub(crate) recorded: Option<Recorded>,
    pub(crate) findings: Vec<Finding>,
    pub(crate) sweeps: u64,
    /// Seconds of the recording's clock per second of ours, everything included.
    pub(crate) realtime_factor: f64,
    /// What made a recording end early.
    pub(crate) damage: Option<String>,
}

/// What only a simulator knows.
pub(crate) struct Simulated {
    pub(crate) outcome: Outcome,
    pub(crate) truth_map: Grid<Cell>,
    pub(crate) trunks: Vec<TrunkTruth>,
    pub(crate) start_from_world: Pose,
    pub(crate) tilt_deg: Vec<(f64, f64)>,
    pub(crate) speed_mps: Vec<(f64, f64)>,
}

impl Session {
    pub(crate) fn passed(&self) -> bool {
        self.findings.iter().all(|finding| finding.passed) && self.damage.is_none()
    }

    pub(crate) fn interrupted(&self) -> bool {
        self.simulated.as_ref().is_some_and(|simulated| simulated.outcome.end == End::Stopped)
    }
}

/// Recorder settings for a simulator's robot.
pub(crate) fn recorder_settings(sim: &Simulator, clouds: bool) -> RecorderSettings {
    let mount = |sensor| sim.robot().mount(sensor).unwrap_or_else(Pose::identity);
    let wire = sim.scenario().wire();
    let datum = sim.scenario().gnss.clone().unwrap_or_default().datum;
    RecorderSettings {
        name: sim.scenario().name.clone(),
        clouds,
        packets: true,
        lidar_frame: lidar_frame(&wire).to_owned(),
        wire,
        base_from_lidar: sim.base_from_lidar(),
        base_from_imu: mount(SensorFrame::Imu),
        base_from_antenna: mount(SensorFrame::Antenna),
        datum: arborloop_eval::dataset::Datum {
            latitude_deg: datum.latitude_deg,
            longitude_deg: datum.longitude_deg,
            altitude_m: datum.altitude_m,
        },
        ..RecorderSettings::default()
    }
}

/// What the driver of such a lidar calls its frame.
fn lidar_frame(wire: &Wire) -> &'static str {
    match wire {
        Wire::Vlp16(_) => "velodyne",
        Wire::Ouster(_) => "os_sensor",
        Wire::Plain => "lidar",
    }
}

/// The true map of a world in the frame `world`, over the whole terrain.
pub(crate) fn truth_map(sim: &Simulator) -> Grid<Cell> {
    footprint(sim.world(), TRUTH_SLICE, TRUTH_CELL_M, &sim.world().terrain.bounds())
}

/// Runs a case; `folder` is where a recording goes, `go_on` is told the share done once a sweep.
pub(crate) fn simulate(
    catalog: &Catalog,
    case: &Case<'_>,
    folder: Option<(&Path, bool)>,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Session, Failure> {
    let begin = wall_clock();
    let mut sim = Simulator::new(case.scenario, Seed(case.seed));
    let mount = sim.base_from_lidar();
    let (mut systems, stopwatches) = build(catalog, case.systems, case.specs, &mount)?;
    let driver = match case.driver {
        "truth" => Driver::Truth,
        name => Driver::System(case.systems.iter().position(|system| system == name).ok_or_else(|| {
            Failure::Usage(format!("the driver `{name}` is neither `truth` nor one of {:?}", case.systems))
        })?),
    };
    let mut recorder = match folder {
        Some((folder, clouds)) => {
            let recorder = Recorder::create(folder, recorder_settings(&sim, clouds))?;
            Some(BackgroundRecorder::start(recorder)?)
        }
        None => None,
    };
    let truth_map = truth_map(&sim);
    let mut trace = Trace::new(recorder.as_mut().map(|recorder| recorder as &mut dyn Sink));
    let outcome = run(&mut sim, &mut systems, driver, &mut trace, &mut |_, progress| {
        let whole = progress.distance_m + progress.remaining_m;
        go_on(if whole > 0.0 { progress.distance_m / whole } else { 1.0 })
    })
    .map_err(Failure::Recording)?;
    let maps: Vec<Option<Grid<Cell>>> = systems.iter().map(|system| system.slam.map()).collect();
    for (system, map) in systems.iter().zip(&maps) {
        if let Some(map) = map {
            let record = Record::Map { system: &system.name, map };
            trace.write(sim.now(), &record).map_err(Failure::Recording)?;
        }
    }
    let mut trace = trace.ended();
    let path = Trajectory::new(std::mem::take(&mut trace.path))
        .map_err(|error| Failure::Internal(format!("the simulated path is broken: {error}")))?;
    let (now, world_from_map) = (sim.now(), planar(&sim.world_from_start()));
    // The recording is completed while what was said is scored.
    let (results, recorded) = std::thread::scope(|scope| {
        let recorded = scope.spawn(|| close(recorder, now, &truth_map));
        let results: Vec<SystemResult> = systems
            .iter()
            .zip(&stopwatches)
            .zip(maps)
            .map(|((system, stopwatch), map)| {
                let trajectory = trace.trajectory(&system.name);
                let stamps: Vec<Time> = trajectory.poses().iter().map(|(stamp, _)| *stamp).collect();
                let settings = ScoreSettings::new(Alignment::None, PoseTime::SweepEnd);
                let said = trace.estimates.get(&system.name).map_or(&[][..], Vec::as_slice);
                let revised = system.slam.trajectory();
                let score = resample(&path, &stamps)
                    .and_then(|reference| {
                        score(&reference, &trajectory, &settings)?
                            .with_covariances(&reference, &trajectory, said, &settings)?
                            .with_revised(&reference, revised.as_ref(), &settings)
                    })
                    .map_err(|error| error.to_string());
                let map_score = map.as_ref().and_then(|map| {
                    score_map(&truth_map, map, &world_from_map, MapScoreSettings::default()).ok()
                });
                let health = count(said);
                SystemResult {
                    name: system.name.clone(),
                    trajectory,
                    revised,
                    score,
                    map,
                    map_score,
                    health,
                    cpu_ms: Stats::of(&stopwatch.milliseconds()),
                }
            })
            .collect();
        (results, recorded.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    });
    let recorded = recorded?;
    let (tilt_deg, speed_mps, sweeps) =
        (std::mem::take(&mut trace.tilt_deg), std::mem::take(&mut trace.speed_mps), trace.sweeps);
    let stamps: Vec<Time> =
        (0..).map(|n| n * 20).map_while(|n| path.poses().get(n)).map(|(t, _)| *t).collect();
    let reference = resample(&path, &stamps)
        .map_err(|error| Failure::Internal(format!("the simulated path cannot be thinned: {error}")))?;
    let findings = crate::expect::judge(case, &outcome, &results);
    Ok(Session {
        name: case.scenario.name.clone(),
        seed: case.seed,
        driver: case.driver.to_owned(),
        systems: results,
        reference,
        recorded,
        findings,
        sweeps,
        realtime_factor: outcome.duration.seconds() / begin.elapsed().as_secs_f64().max(1e-9),
        damage: None,
        simulated: Some(Simulated {
            outcome,
            truth_map,
            trunks: trunk_map(sim.world()),
            start_from_world: sim.world_from_start().inverse(),
            tilt_deg,
            speed_mps,
        }),
    })
}

/// Feeds a recording to systems. A recording that breaks off is scored as far as it goes, and says so.
pub(crate) fn replay(
    catalog: &Catalog,
    recording: &Recording,
    names: &[String],
    specs: &BTreeMap<String, SystemSpec>,
    expectations: &[Expect],
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Session, Failure> {
    let begin = wall_clock();
    let (mut systems, stopwatches) = build(catalog, names, specs, &recording.base_from_lidar())?;
    let mut trace = Trace::new(None);
    let (mut first, mut last, mut sweeps, mut damage) = (None, Time::default(), 0_u64, None);
    for observation in recording.observations()? {
        let observation = match observation {
            Ok(observation) => observation,
            Err(error) if sweeps > 0 => {
                damage = Some(error.to_string());
                break;
            }
            Err(error) => return Err(error.into()),
        };
        last = observation.stamp();
        first.get_or_insert(last);
        for system in &mut systems {
            if system.inputs.contains(&observation.kind())
                && let Some(estimate) = system.slam.observe(&observation)
            {
                trace.estimates.entry(system.name.clone()).or_default().push(estimate);
                system.slam.settle();
            }
        }
        if matches!(observation, arborloop_base::Observation::Sweep(_)) {
            sweeps += 1;
            let share = recording.sweeps().map_or(0.0, |all| sweeps as f64 / all.max(1) as f64);
            if !go_on(share) {
                return Err(Failure::Interrupted);
            }
        }
    }
    let reference = recording.reference()?;
    let alignment = match recording.kind() {
        RecordingKind::Pullally => Alignment::OriginYaw,
        RecordingKind::Rosbag2 => Alignment::None,
        RecordingKind::Mcap => Alignment::Origin,
    };
    let results: Vec<SystemResult> = systems
        .iter()
        .zip(&stopwatches)
        .map(|(system, stopwatch)| {
            let trajectory = trace.trajectory(&system.name);
            let revised = system.slam.trajectory();
            let said = trace.estimates.get(&system.name).map_or(&[][..], Vec::as_slice);
            let scored = match &reference {
                Some(reference) => {
                    let settings = ScoreSettings {
                        has_heading: reference.has_heading,
                        ..ScoreSettings::new(alignment, reference.pose_time)
                    };
                    score(&reference.trajectory, &trajectory, &settings)
                        .and_then(|score| {
                            score.with_covariances(&reference.trajectory, &trajectory, said, &settings)
                        })
                        .and_then(|score| {
                            score.with_revised(&reference.trajectory, revised.as_ref(), &settings)
                        })
                        .map_err(|error| error.to_string())
                }
                None => Err("the recording holds no reference".to_owned()),
            };
            SystemResult {
                name: system.name.clone(),
                score: scored,
                map: system.slam.map(),
                map_score: None,
                health: count(said),
                cpu_ms: Stats::of(&stopwatch.milliseconds()),
                trajectory,
                revised,
            }
        })
        .collect();
    let findings = crate::expect::judge_replay(expectations, &results);
    let span = first.map_or(0.0, |first| (last - first).seconds());
    Ok(Session {
        name: recording.name().to_owned(),
        seed: 0,
        driver: "replay".into(),
        systems: results,
        reference: reference.map(|reference| reference.trajectory).unwrap_or_default(),
        simulated: None,
        recorded: None,
        findings,
        sweeps,
        realtime_factor: span / begin.elapsed().as_secs_f64().max(1e-9),
        damage,
    })
}

/// Waits for what is still to be written, adds the true map and completes the recording.
fn close(
    recorder: Option<BackgroundRecorder>,
    now: Time,
    truth_map: &Grid<Cell>,
) -> Result<Option<Recorded>, Failure> {
    let recorder = recorder.map(BackgroundRecorder::finish).transpose();
    match recorder.map_err(|error| Failure::Recording(error.into()))?.flatten() {
        Some(mut recorder) => {
            recorder.truth_map(now, truth_map)?;
            Ok(Some(recorder.finish()?))
        }
        None => Ok(None),
    }
}

fn build(
    catalog: &Catalog,
    names: &[String],
    specs: &BTreeMap<String, SystemSpec>,
    base_from_lidar: &Pose,
) -> Result<(Vec<System>, Vec<Stopwatch>), Failure> {
    let plain = SystemSpec::default();
    let built: Result<Vec<_>, Failure> = names
        .iter()
        .map(|name| catalog.build(name, specs.get(name).unwrap_or(&plain), base_from_lidar))
        .collect();
    Ok(built?.into_iter().unzip())
}

fn count(estimates: &[Estimate]) -> HealthCounts {
    let of = |health: Health| estimates.iter().filter(|estimate| estimate.health == health).count() as u64;
    HealthCounts { tracking: of(Health::Tracking), degraded: of(Health::Degraded), lost: of(Health::Lost) }
}

#[expect(clippy::disallowed_methods, reason = "wall time is measured here alone, and only printed")]
fn wall_clock() -> Instant {
    Instant::now()
}
