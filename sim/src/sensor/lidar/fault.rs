//! Faults of a lidar by name, each over a stretch of time: a system sees them, a recording keeps them, truth knows nothing.

use super::answer::{Answer, Given};
use super::{Lidar, WireForm};
use crate::scenario::{Wrong, within};
use arborloop_base::{Span, Time, wrap_angle};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// One fault. `from_s` counts from the beginning of the run, `for_s` is how long it lasts, both seconds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum FaultSpec {
    /// Nothing comes back: every firing is a miss.
    Blackout {
        /// Begins, seconds.
        from_s: f64,
        /// Lasts, seconds.
        for_s: f64,
    },
    /// The driver's clock within a turn stands still: every firing claims the turn's first instant. No packet can say
    /// so, so a run with this fault is recorded as clouds.
    FrozenStamps {
        /// Begins, seconds.
        from_s: f64,
        /// Lasts, seconds.
        for_s: f64,
    },
    /// The sensor's clock is off: sweeps that end within the fault claim to be this much later.
    SkewedStamps {
        /// Begins, seconds.
        from_s: f64,
        /// Lasts, seconds.
        for_s: f64,
        /// How much later, seconds; negative for earlier.
        offset_s: f64,
    },
    /// Two beams are taken for each other: what one measured is reported as the other's.
    SwappedRings {
        /// Begins, seconds.
        from_s: f64,
        /// Lasts, seconds.
        for_s: f64,
        /// The two, counted from the lowest.
        rings: [u16; 2],
    },
    /// Packets get lost on the way.
    DroppedPackets {
        /// Begins, seconds.
        from_s: f64,
        /// Lasts, seconds.
        for_s: f64,
        /// Share of packets that get lost.
        ratio: f64,
    },
    /// Dirt on the window: light through a sector is weakened, going out and coming back.
    DirtSector {
        /// Begins, seconds.
        from_s: f64,
        /// Lasts, seconds.
        for_s: f64,
        /// One side of the sector, degrees counter-clockwise from straight ahead.
        azimuth_deg_min: f64,
        /// The other side, degrees.
        azimuth_deg_max: f64,
        /// Share of light that gets through the window once.
        #[serde(default)]
        transmittance_ratio: f64,
    },
}

impl FaultSpec {
    /// Its name in a scenario.
    pub fn kind(&self) -> &'static str {
        match self {
            FaultSpec::Blackout { .. } => "blackout",
            FaultSpec::FrozenStamps { .. } => "frozen_stamps",
            FaultSpec::SkewedStamps { .. } => "skewed_stamps",
            FaultSpec::SwappedRings { .. } => "swapped_rings",
            FaultSpec::DroppedPackets { .. } => "dropped_packets",
            FaultSpec::DirtSector { .. } => "dirt_sector",
        }
    }

    /// First instant, and the first one after it.
    pub fn time(&self) -> Range<Time> {
        let (from_s, for_s) = self.span_s();
        let from = Time::SIMULATION_START + Span::from_seconds(from_s);
        from..from + Span::from_seconds(for_s)
    }

    fn span_s(&self) -> (f64, f64) {
        match *self {
            FaultSpec::Blackout { from_s, for_s }
            | FaultSpec::FrozenStamps { from_s, for_s }
            | FaultSpec::SkewedStamps { from_s, for_s, .. }
            | FaultSpec::SwappedRings { from_s, for_s, .. }
            | FaultSpec::DroppedPackets { from_s, for_s, .. }
            | FaultSpec::DirtSector { from_s, for_s, .. } => (from_s, for_s),
        }
    }

    /// `number` is its place in the scenario, `rings` and `turn_s` are the lidar's.
    pub(crate) fn check(&self, number: usize, rings: u16, turn_s: f64) -> Result<(), Wrong> {
        let at = |key: &str| format!("fault[{number}].{key}");
        let (from_s, for_s) = self.span_s();
        within(&at("from_s"), from_s, 0.0, 1e6)?;
        within(&at("for_s"), for_s, 0.0, 1e6)?;
        match self {
            FaultSpec::Blackout { .. } | FaultSpec::FrozenStamps { .. } => Ok(()),
            // Less than half a turn keeps the order of sweeps.
            FaultSpec::SkewedStamps { offset_s, .. } => {
                within(&at("offset_s"), *offset_s, -0.49 * turn_s, 0.49 * turn_s)
            }
            FaultSpec::SwappedRings { rings: two, .. } => {
                let highest = rings.saturating_sub(1);
                two.iter()
                    .try_for_each(|ring| within(&at("rings"), f64::from(*ring), 0.0, f64::from(highest)))
            }
            FaultSpec::DroppedPackets { ratio, .. } => within(&at("ratio"), *ratio, 0.0, 1.0),
            FaultSpec::DirtSector { azimuth_deg_min, azimuth_deg_max, transmittance_ratio, .. } => {
                within(&at("azimuth_deg_min"), *azimuth_deg_min, -360.0, 360.0)?;
                within(&at("azimuth_deg_max"), *azimuth_deg_max, *azimuth_deg_min, 360.0)?;
                within(&at("transmittance_ratio"), *transmittance_ratio, 0.0, 1.0)
            }
        }
    }
}

/// Address of chance of the first fault.
const FAULTS: u64 = 4000;

impl Lidar {
    /// Share of light that dirt on the window leaves, both ways.
    pub(super) fn window_left(&self, stamp: Time, azimuth_rad: f64) -> f64 {
        let through = |fault: &FaultSpec| match fault {
            FaultSpec::DirtSector { azimuth_deg_min, azimuth_deg_max, transmittance_ratio, .. } => {
                let middle_rad = (0.5 * (azimuth_deg_min + azimuth_deg_max)).to_radians();
                let half_rad = (0.5 * (azimuth_deg_max - azimuth_deg_min)).to_radians();
                let dirty =
                    fault.time().contains(&stamp) && wrap_angle(azimuth_rad - middle_rad).abs() <= half_rad;
                if dirty { transmittance_ratio * transmittance_ratio } else { 1.0 }
            }
            _ => 1.0,
        };
        self.faults.iter().map(through).product()
    }

    /// Spoils the answers of a turn, one cycle after the other from its first on: dark firings, beams taken for each
    /// other, packets that get lost.
    pub(super) fn spoil(&self, cycles: &Range<i64>, turn: &mut [Answer]) {
        for (number, fault) in self.faults.iter().enumerate() {
            let time = fault.time();
            let chance = self.noise.child(FAULTS + number as u64);
            for (cycle, answers) in cycles.clone().zip(turn.chunks_exact_mut(self.beams.len())) {
                let begin = self.schedule.start(cycle);
                let struck = |beam: usize| time.contains(&(begin + self.beams[beam].fires_after));
                match fault {
                    FaultSpec::Blackout { .. } => {
                        let dark = answers.iter_mut().enumerate().filter(|(beam, _)| struck(*beam));
                        dark.for_each(|(_, answer)| darken(answer));
                    }
                    FaultSpec::SwappedRings { rings, .. } => {
                        let beam_of = |ring: u16| self.beams.iter().position(|beam| beam.ring == ring);
                        if let (Some(one), Some(other)) = (beam_of(rings[0]), beam_of(rings[1]))
                            && struck(one)
                            && struck(other)
                        {
                            let (a, b) = (answers[one].given, answers[other].given);
                            (answers[one].given, answers[other].given) = (b, a);
                        }
                    }
                    FaultSpec::DroppedPackets { ratio, .. } => {
                        let within = (cycle - cycles.start) % self.packet_cycles;
                        let packet = cycle - within;
                        // A packet is lost whole, or not: its first firing says whether the fault is on.
                        let struck = time.contains(&self.schedule.start(packet));
                        for answer in answers {
                            if struck && chance.at(packet as u64).chance(*ratio) {
                                answer.dropped = true;
                                if self.spec.model.wire == WireForm::Ouster {
                                    // A frame has no gaps: its lost columns are misses.
                                    darken(answer);
                                }
                            }
                        }
                    }
                    FaultSpec::DirtSector { .. }
                    | FaultSpec::FrozenStamps { .. }
                    | FaultSpec::SkewedStamps { .. } => {}
                }
            }
        }
    }

    /// When a firing claims to have been, and when the sweep that ends at `end` does.
    pub(super) fn said_after(&self, stamp: Time, after: Span) -> Span {
        let frozen = |fault: &FaultSpec| {
            matches!(fault, FaultSpec::FrozenStamps { .. }) && fault.time().contains(&stamp)
        };
        if self.faults.iter().any(frozen) { Span::default() } else { after }
    }

    pub(super) fn clock_offset(&self, end: Time) -> Span {
        let offset = |fault: &FaultSpec| match fault {
            FaultSpec::SkewedStamps { offset_s, .. } if fault.time().contains(&end) => {
                Span::from_seconds(*offset_s)
            }
            _ => Span::default(),
        };
        self.faults.iter().map(offset).fold(Span::default(), |sum, one| sum + one)
    }
}

/// What was met is met still.
fn darken(answer: &mut Answer) {
    if let Some(given) = answer.given[0] {
        answer.given = [Some(Given::miss(given.label)), None];
    }
}
