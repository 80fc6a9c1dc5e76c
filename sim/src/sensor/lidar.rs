//! The spinning lidar: a true rolling sweep in which every beam fires from the body's pose at its own instant.
//!
//! Surfaces that the rays of a footprint meet become echoes, echoes become returns, and the sweep goes over the wire.

mod answer;
mod body;
mod cast;
mod deliver;
mod echo;
mod explain;
mod fault;
mod file;
mod footprint;
mod model;
mod schedule;
mod spec;
mod weather;

pub use explain::{EchoStory, FiringStory, SurfaceStory};
pub use fault::FaultSpec;
pub use file::{lidar_file, with_lidar};
pub use model::{BeamModel, EMBEDDED, EchoChoice, LidarModel, PulseModel, RangeModel, TurnModel, WireForm};
pub use spec::LidarSpec;
pub use weather::WeatherSpec;

use crate::optics::Optics;
use crate::sensor::Motion;
use answer::{Answer, Given};
use arborloop_base::os1::Os1;
use arborloop_base::vlp16::ReturnMode;
use arborloop_base::{Label, Pose, Return, Span, Stream, Sweep, Time, Wire};
use arborloop_robots::{JointKind, Robot, SensorFrame};
use body::Body;
pub(crate) use body::Stance;
use cast::Scratch;
use deliver::Direct;
use footprint::{SubRay, footprint};
use nalgebra::{Matrix3, Point3, UnitQuaternion};
use rayon::prelude::*;
use schedule::Schedule;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use weather::Air;

pub(crate) struct Lidar {
    spec: LidarSpec,
    wire: Wire,
    period: Span,
    base_from_lidar: Pose,
    /// Its turn, as a matrix.
    base_turned: Matrix3<f64>,
    schedule: Schedule,
    beams: Vec<Beam>,
    footprint: Vec<SubRay>,
    /// Full angle of the footprint, radians.
    width_rad: f64,
    /// Whether what lies behind a leaf can change an answer.
    looks_behind: bool,
    /// Least energy that is seen: of a facing target of 10 % reflectance at the reach.
    threshold: f64,
    noise: Stream,
    air: Air,
    faults: Vec<FaultSpec>,
    /// Whether returns go over the wire without packets in between.
    is_direct: bool,
    body: Body,
    /// Firing cycles of a packet, for packets that get lost.
    packet_cycles: i64,
    answers: Vec<Answer>,
    /// The turn that is made directly, as far as it has answered.
    direct: Direct,
    /// First cycle of the turn that was begun ahead of its end, and how many blocks of it have answered.
    begun: Option<(i64, usize)>,
    /// One a thread that ever cast, handed back after each block of cycles.
    scratch: Mutex<Vec<Scratch>>,
}

/// A laser's own line in the lidar frame before it is turned to an azimuth.
#[derive(Debug, Clone, Copy)]
struct Beam {
    elevation_rad: f64,
    sin: f64,
    cos: f64,
    /// Clockwise of the head's bearing.
    azimuth_rad: f64,
    /// How far the beam points clockwise of the head's bearing at the begin of the cycle: sine and cosine.
    lag: (f64, f64),
    height_m: f64,
    /// Where it leaves a lidar whose beams start on its axis, base frame.
    exit_in_base: Point3<f64>,
    fires_after: Span,
    ring: u16,
    /// Whether it can meet the robot's own body.
    near_body: bool,
}

/// What surrounds the lidar while it turns.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub(crate) motion: &'a Motion,
    pub(crate) optics: &'a Optics,
}

impl Lidar {
    pub(crate) fn new(spec: &LidarSpec, period: Span, base_from_lidar: Pose, stream: Stream) -> Self {
        let pulse = &spec.model.pulse;
        let footprint = footprint(spec.sub_rays, pulse.divergence_mrad, pulse.edge_ratio);
        let body = Body::go1();
        let schedule = Schedule::new(&spec.model, spec.columns, period);
        let off = |ray: &SubRay| ray.across_rad.hypot(ray.up_rad);
        let (wire, beams) = (spec.wire(), beams_of(&spec.model, &base_from_lidar, &body, &schedule));
        Lidar {
            is_direct: Lidar::is_direct(&wire, &beams, spec.model.turn.cycle_ns),
            width_rad: 2.0 * footprint.iter().map(off).fold(0.0, f64::max),
            looks_behind: spec.sub_rays > 1 || matches!(spec.returns, EchoChoice::Last | EchoChoice::Dual),
            packet_cycles: match spec.wire() {
                Wire::Vlp16(mode) => mode.cycles_per_packet() as i64,
                // Ouster's legacy packets hold sixteen columns; a plain lidar is taken to be like a VLP-16.
                Wire::Ouster(_) => 16,
                Wire::Plain => 24,
            },
            air: Air::new(&WeatherSpec::default(), pulse.length_m),
            faults: Vec::new(),
            wire,
            period,
            base_from_lidar,
            base_turned: base_from_lidar.rotation.to_rotation_matrix().into_inner(),
            schedule,
            beams,
            body,
            footprint,
            threshold: 0.1 / (spec.reach_m * spec.reach_m),
            noise: stream,
            answers: Vec::new(),
            direct: Direct::default(),
            begun: None,
            scratch: Mutex::new(Vec::new()),
            spec: spec.clone(),
        }
    }

    /// The same lidar on another robot than the Go1.
    pub(crate) fn on(mut self, robot: &Robot) -> Self {
        let on_legs = robot.joints.iter().all(|joint| joint.kind != JointKind::Continuous);
        if !on_legs {
            self.body = Body::on_wheels(robot, robot.sensor_link(SensorFrame::Lidar).unwrap_or_default());
            self.beams = beams_of(&self.spec.model, &self.base_from_lidar, &self.body, &self.schedule);
        }
        self
    }

    /// The same lidar in some weather, with faults to come.
    pub(crate) fn under(mut self, weather: &WeatherSpec, faults: &[FaultSpec]) -> Self {
        self.air = Air::new(weather, self.spec.model.pulse.length_m);
        self.faults = faults.to_vec();
        self.wire = wire_under(&self.spec, faults);
        self
    }

    /// Whether a lost packet leaves a gap: the frames of an Ouster sensor hold misses instead.
    fn leaves_gaps(&self) -> bool {
        !matches!(self.wire, Wire::Ouster(_))
    }

    pub(crate) fn period(&self) -> Span {
        self.period
    }

    /// The turn that is complete at `end`, as the wire carries it, and what each return really met.
    pub(crate) fn sweep(&mut self, end: Time, around: Surroundings<'_>) -> (Sweep, Vec<Label>) {
        let cycles = self.schedule.cycles(end);
        let first = self.fire(cycles.clone(), None, around);
        self.begun = None;
        if self.makes_directly() && !cycles.is_empty() {
            let (start, rings) = (self.schedule.start(cycles.start), self.beams.len() as u16);
            let Direct { returns, labels, .. } = &mut self.direct;
            let (returns, labels) = (std::mem::take(returns), std::mem::take(labels));
            return (Sweep { start, end, rings, returns }, labels);
        }
        let mut answers = std::mem::take(&mut self.answers);
        let beams = self.beams.len();
        let place = |cycle: i64| (cycle - first).max(0) as usize * beams;
        let turn = &mut answers[place(cycles.start)..place(cycles.end)];
        self.spoil(&cycles, turn);
        let delivered = self.deliver(cycles, end, turn);
        self.answers = answers;
        delivered
    }

    /// Takes the memory of a sweep that nobody reads any more, for a later one.
    pub(crate) fn reuse(&mut self, returns: Vec<Return>) {
        if self.makes_directly() {
            self.direct.spare.push(returns);
        }
    }

    /// The same of its labels.
    pub(crate) fn reuse_labels(&mut self, labels: Vec<Label>) {
        self.direct.spare_labels = labels;
    }

    /// Fires what of the turn that ends at `end` is over before `now`, or all of it at its end.
    pub(crate) fn fire_ahead(&mut self, end: Time, now: Time, around: Surroundings<'_>) {
        self.fire(self.schedule.cycles(end), (now < end).then_some(now), around);
    }

    /// Answers of every firing of these cycles, cycle by cycle; blocks of cycles are aligned to the beginning of the
    /// run, so that a firing is traced with the same neighbors whoever asks for it. Says the first cycle that answers.
    /// Blocks that fire at `until` or later are left for the next call for this turn, which goes on where this one ends.
    fn fire(&mut self, cycles: Range<i64>, until: Option<Time>, around: Surroundings<'_>) -> i64 {
        let block = self.schedule.together() as i64;
        let first = cycles.start.div_euclid(block) * block;
        let blocks = ((cycles.end - first + block - 1).div_euclid(block).max(0)) as usize;
        let begun = self.begun.filter(|(cycle, _)| *cycle == cycles.start).map_or(0, |(_, blocks)| blocks);
        let last = self.beams.iter().map(|beam| beam.fires_after).max().unwrap_or_default();
        let over = |index: &usize| {
            let cycle = first + (*index as i64 + 1) * block - 1;
            until.is_none_or(|until| self.schedule.start(cycle) + last < until)
        };
        let ready = (begun..blocks).take_while(over).count();
        let blocks_due = begun..begun + ready;
        let block_of = |index: usize| first + index as i64 * block..first + (index as i64 + 1) * block;
        if self.makes_directly() {
            self.fire_directly(&cycles, begun == 0, blocks_due.map(block_of), around);
        } else {
            let mut answers = std::mem::take(&mut self.answers);
            let beams = self.beams.len();
            let block_answers = block as usize * beams;
            // Every firing of every block answers, so that what is left of the sweep before is overwritten.
            answers.resize_with(blocks * block_answers, || Answer::NONE);
            let due = &mut answers[blocks_due.start * block_answers..blocks_due.end * block_answers];
            due.par_chunks_mut(block_answers).enumerate().for_each(|(index, answers)| {
                self.fire_block(block_of(begun + index), around, |number, beam, answer| {
                    answers[number * beams + beam] = answer;
                });
            });
            self.answers = answers;
        }
        self.begun = Some((cycles.start, begun + ready));
        first
    }

    /// One beam after the other: what sixteen firings of it need stays in the fastest memory. `put` gets the number of the
    /// cycle in the block, the beam and the answer.
    fn fire_block(
        &self,
        cycles: Range<i64>,
        around: Surroundings<'_>,
        mut put: impl FnMut(usize, usize, Answer),
    ) {
        if self.is_lone() {
            let only = |given: &Given| Answer { dropped: false, given: [Some(*given), None] };
            self.fire_lone(cycles, around, |number, beam, given| put(number, beam, only(given)));
        } else {
            self.fire_several(cycles, around, put);
        }
    }

    /// The same where every shot is lone: see [`Lidar::is_lone`].
    #[inline(always)]
    fn fire_lone(
        &self,
        cycles: Range<i64>,
        around: Surroundings<'_>,
        mut put: impl FnMut(usize, usize, &Given),
    ) {
        let mut scratch = self.borrow_scratch();
        let mut caster = around.optics.caster();
        self.turn_head(&cycles, &mut scratch);
        for beam in 0..self.beams.len() {
            self.cast_lone(&cycles, beam, around, &mut caster, &mut scratch);
            for (number, shot) in scratch.shots.iter().enumerate() {
                put(number, beam, &self.given_lone(shot, scratch.met(number)));
            }
        }
        self.give_back(scratch);
    }

    /// The same where shots may meet several surfaces.
    fn fire_several(
        &self,
        cycles: Range<i64>,
        around: Surroundings<'_>,
        mut put: impl FnMut(usize, usize, Answer),
    ) {
        let mut scratch = self.borrow_scratch();
        let mut caster = around.optics.caster();
        self.turn_head(&cycles, &mut scratch);
        for beam in 0..self.beams.len() {
            self.cast(&cycles, beam, around, &mut caster, &mut scratch);
            for number in 0..scratch.shots.len() {
                put(number, beam, self.answer(number, &mut scratch));
            }
        }
        self.give_back(scratch);
    }

    fn borrow_scratch(&self) -> Scratch {
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default()
    }

    fn give_back(&self, scratch: Scratch) {
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
    }
}

fn beams_of(model: &LidarModel, base_from_lidar: &Pose, body: &Body, schedule: &Schedule) -> Vec<Beam> {
    // The footprint's rays look a little lower than their beam.
    let margin_rad = 0.01 + base_from_lidar.rotation.angle_to(&flat(base_from_lidar));
    let beams = &model.beams;
    let higher =
        |a: usize, b: usize| beams.elevation_deg[a].total_cmp(&beams.elevation_deg[b]).then(b.cmp(&a));
    let count = beams.elevation_deg.len();
    (0..count)
        .map(|beam| {
            let elevation_rad = beams.elevation_deg[beam].to_radians();
            let (sin, cos) = elevation_rad.sin_cos();
            let fires_after = Span::from_nanos(beams.fires_after_ns[beam]);
            Beam {
                elevation_rad,
                sin,
                cos,
                azimuth_rad: beams.azimuth_deg[beam].to_radians(),
                lag: (beams.azimuth_deg[beam].to_radians() + schedule.lag_rad(fires_after)).sin_cos(),
                height_m: beams.height_m[beam],
                exit_in_base: base_from_lidar * Point3::new(0.0, 0.0, beams.height_m[beam]),
                fires_after,
                near_body: body.is_near(
                    &(base_from_lidar * Point3::new(0.0, 0.0, beams.height_m[beam])),
                    (elevation_rad - margin_rad).max(-1.5),
                ),
                ring: (0..count).filter(|other| higher(beam, *other).is_gt()).count() as u16,
            }
        })
        .collect()
}

/// The turn about the vertical that is in a mount.
fn flat(base_from_lidar: &Pose) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), arborloop_base::yaw_of(base_from_lidar))
}

/// How a lidar speaks when these faults are to be recorded: packets and frames have no word for frozen stamps.
pub(crate) fn wire_under(spec: &LidarSpec, faults: &[FaultSpec]) -> Wire {
    if faults.iter().any(|fault| matches!(fault, FaultSpec::FrozenStamps { .. })) {
        return Wire::Plain;
    }
    spec.wire()
}

/// How a lidar speaks.
fn wire_of(model: &LidarModel, columns: Option<u32>, rate_hz: f64, returns: EchoChoice) -> Wire {
    match model.wire {
        WireForm::Vlp16 => Wire::Vlp16(match returns {
            EchoChoice::Dual => ReturnMode::Dual,
            EchoChoice::Last => ReturnMode::Last,
            EchoChoice::First | EchoChoice::Strongest => ReturnMode::Strongest,
        }),
        WireForm::Ouster => Wire::Ouster(Os1 {
            altitude_deg: model.beams.elevation_deg.clone(),
            azimuth_deg: model.beams.azimuth_deg.clone(),
            beam_radius_m: model.beams.radius_m,
            columns: columns.or(model.turn.columns).unwrap_or(1),
            turn: Span::from_seconds(1.0 / rate_hz),
        }),
        WireForm::Plain => Wire::Plain,
    }
}

#[cfg(test)]
mod tests;
