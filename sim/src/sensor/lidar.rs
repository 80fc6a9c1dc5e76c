//! The spinning lidar: a true rolling sweep in which every laser fires from the body's pose at its own instant.

use crate::optics::{Hit, Optics, Ray};
use crate::scenario::{Wrong, whole_ticks, within};
use crate::sensor::Motion;
use arborloop_base::vlp16::{self, CYCLE_STEP, LASER_STEP, LASERS};
use arborloop_base::{Class, Label, Pose, Return, Span, Stream, Sweep, Time, wrap_angle};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// The lidars that come with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LidarModel {
    /// Velodyne VLP-16.
    #[default]
    Vlp16,
}

/// What the lidar is set to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LidarSpec {
    /// Which lidar.
    pub model: LidarModel,
    /// Turns a second.
    pub rate_hz: f64,
    /// Nearer surfaces give no return, meters.
    pub range_m_min: f64,
    /// Farther surfaces give no return, meters.
    pub range_m_max: f64,
    /// Standard deviation of the range, meters.
    pub range_noise_m: f64,
    /// Share of returns that get lost.
    pub dropout_ratio: f64,
}

impl Default for LidarSpec {
    fn default() -> Self {
        LidarSpec {
            model: LidarModel::Vlp16,
            rate_hz: 10.0,
            range_m_min: 0.4,
            range_m_max: 100.0,
            // slam facts 1; the maker's +-3 cm is typical over all ranges.
            range_noise_m: 0.02,
            dropout_ratio: 0.01,
        }
    }
}

impl LidarSpec {
    pub(crate) fn check(&self, tick: Span) -> Result<(), Wrong> {
        // 300 to 1200 rpm, manual 63-9243.
        within("lidar.rate_hz", self.rate_hz, 5.0, 20.0)?;
        whole_ticks("lidar.rate_hz", self.rate_hz, tick)?;
        if self.range_m_max > 100.0 {
            return Err(Wrong {
                path: "lidar.range_m_max".into(),
                message: format!("found {}, which exceeds the vlp16's 100 m", self.range_m_max),
            });
        }
        within("lidar.range_m_min", self.range_m_min, 0.0, 100.0)?;
        within("lidar.range_m_max", self.range_m_max, self.range_m_min, 100.0)?;
        within("lidar.range_noise_m", self.range_noise_m, 0.0, 10.0)?;
        within("lidar.dropout_ratio", self.dropout_ratio, 0.0, 1.0)
    }
}

pub(crate) struct Lidar {
    spec: LidarSpec,
    period: Span,
    base_from_lidar: Pose,
    beams: [Beam; LASERS],
    noise: Stream,
}

/// A laser's own line in the lidar frame before it is turned to an azimuth.
#[derive(Clone, Copy)]
struct Beam {
    elevation_rad: f64,
    sin: f64,
    cos: f64,
    offset_m: f64,
}

impl Lidar {
    pub(crate) fn new(spec: &LidarSpec, period: Span, base_from_lidar: Pose, stream: Stream) -> Self {
        let beams = std::array::from_fn(|laser| {
            let elevation_rad = vlp16::ELEVATION_DEG[laser].to_radians();
            let (sin, cos) = elevation_rad.sin_cos();
            Beam { elevation_rad, sin, cos, offset_m: vlp16::OFFSET_M[laser] }
        });
        Lidar { spec: spec.clone(), period, base_from_lidar, beams, noise: stream }
    }

    pub(crate) fn period(&self) -> Span {
        self.period
    }

    /// The turn that is complete at `end`, as the wire carries it, and what each return really met.
    ///
    /// A firing cycle belongs to the turn in which its last laser fires, so no firing is split or lost. The head
    /// turns clockwise from straight behind; azimuths of successive turns differ, because 55.296 us divides no turn.
    pub(crate) fn sweep(&self, end: Time, motion: &Motion, optics: &Optics) -> (Sweep, Vec<Label>) {
        let since_spin = |time: Time| (time - Time::SIMULATION_START).nanos();
        let last_laser = LASER_STEP.nanos() * (LASERS as i64 - 1);
        // The first cycle whose last laser fires at or after an instant.
        let first_after = |nanos: i64| {
            (nanos - last_laser).max(0).div_euclid(CYCLE_STEP.nanos())
                + i64::from((nanos - last_laser).max(0) % CYCLE_STEP.nanos() != 0)
        };
        let (begin, past) = (first_after(since_spin(end - self.period)), first_after(since_spin(end)));
        let cycle_start = |cycle: i64| Time::SIMULATION_START + CYCLE_STEP * cycle;
        let start = cycle_start(begin);
        let firings: Vec<(Return, Label)> = (begin..past)
            .into_par_iter()
            .flat_map_iter(|cycle| {
                (0..LASERS).map(move |laser| {
                    let stamp = cycle_start(cycle) + LASER_STEP * laser as i64;
                    let index = (cycle as u64) << 4 | laser as u64;
                    self.fire(stamp, stamp - start, laser, index, motion, optics)
                })
            })
            .collect();
        let (returns, labels) = firings.into_iter().unzip();
        let exact = Sweep { start, end, rings: LASERS as u16, returns };
        let packets = vlp16::encode(&exact).expect("these firings follow the VLP-16's own table");
        let sweep = vlp16::decode(&packets, end).expect("these packets were just encoded");
        (sweep, labels)
    }

    fn fire(
        &self,
        stamp: Time,
        fired_after: Span,
        laser: usize,
        index: u64,
        motion: &Motion,
        optics: &Optics,
    ) -> (Return, Label) {
        let beam = &self.beams[laser];
        let turned = (stamp - Time::SIMULATION_START).nanos() % self.period.nanos();
        let azimuth_rad = wrap_angle(std::f64::consts::PI - TAU * turned as f64 / self.period.nanos() as f64);
        let (sin_azimuth, cos_azimuth) = azimuth_rad.sin_cos();
        let (moment, share) = motion.moment(stamp);
        let world_from_lidar = moment.pose(share) * self.base_from_lidar;
        let mut draws = self.noise.at(index);
        let ray = Ray {
            stamp,
            origin: world_from_lidar * Point3::new(0.0, 0.0, beam.offset_m),
            direction: world_from_lidar
                * Vector3::new(beam.cos * cos_azimuth, beam.cos * sin_azimuth, beam.sin),
            range_m_min: 0.0,
            range_m_max: self.spec.range_m_max,
            depth: draws.exponential(),
        };
        let hit = optics.cast(&ray);
        let noise_m = draws.normal() * self.spec.range_noise_m;
        let kept = !draws.chance(self.spec.dropout_ratio);
        let seen = hit.filter(|hit| kept && hit.range_m >= self.spec.range_m_min);
        let along_beam_m = seen.map(|hit| (hit.range_m + noise_m).max(vlp16::DISTANCE_STEP_M));
        // The driver adds the laser's height to the point; polar coordinates are then the point's.
        let (horizontal, up) =
            along_beam_m.map_or((beam.cos, beam.sin), |r| (r * beam.cos, r * beam.sin + beam.offset_m));
        let answer = Return {
            azimuth_rad,
            elevation_rad: if along_beam_m.is_some() { up.atan2(horizontal) } else { beam.elevation_rad },
            range_m: along_beam_m.map(|_| horizontal.hypot(up)),
            ring: vlp16::ring_of(laser),
            number: 0,
            fired_after,
            intensity: seen.map_or(0.0, |hit| reflectivity_byte(&hit)),
        };
        (answer, label(hit))
    }
}

fn label(hit: Option<Hit>) -> Label {
    match hit {
        Some(hit) => Label {
            class: hit.class,
            instance: hit.instance,
            range_m: hit.range_m as f32,
            incidence_rad: hit.cos_incidence.acos() as f32,
        },
        None => Label { class: Class::Sky, instance: 0, range_m: f32::NAN, incidence_rad: f32::NAN },
    }
}

/// The sensor's calibrated byte (manual p. 32): 0-100 for diffuse reflectors, 101-255 for retro-reflectors.
fn reflectivity_byte(hit: &Hit) -> f32 {
    let byte = if hit.reflectivity_ratio > 1.0 {
        100.0 + 100.0 * (hit.reflectivity_ratio - 1.0)
    } else {
        100.0 * hit.reflectivity_ratio * hit.cos_incidence
    };
    byte.round().clamp(1.0, 255.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use arborloop_base::Seed;
    use arborloop_worlds::{GrassSpec, Planting, SurroundingsSpec, TerrainSpec, WindSpec, WorldSpec, build};

    fn level_ground() -> Optics {
        let spec = WorldSpec {
            terrain: TerrainSpec { relief_m: 0.0, bump_m: 0.0, slope_deg: 0.0, ..TerrainSpec::default() },
            grass: GrassSpec { height_m: 0.0, ..GrassSpec::default() },
            planting: Planting::None,
            surroundings: SurroundingsSpec { trees: 0, bushes: 0, ..SurroundingsSpec::default() },
            wind: WindSpec::default(),
        };
        Optics::new(&build(&spec, Seed(1)))
    }

    fn exact(rate_hz: f64) -> Lidar {
        let spec = LidarSpec { range_noise_m: 0.0, dropout_ratio: 0.0, rate_hz, ..LidarSpec::default() };
        let period = Span::from_seconds(1.0 / rate_hz);
        Lidar::new(&spec, period, Pose::translation(0.0, 0.0, 0.16), Seed(1).stream("lidar"))
    }

    /// A body that drives, climbs and turns at constant rates, sampled at 1 kHz.
    fn moving() -> (Motion, impl Fn(Time) -> Pose) {
        let start = Pose::translation(0.0, 0.0, 0.3);
        let pose = move |time: Time| {
            let t = (time - Time::SIMULATION_START).seconds();
            let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 0.3, 2.0) * t);
            Pose::from_parts(Vector3::new(1.0 * t, 0.2 * t, 0.3 + 0.1 * t).into(), turn)
        };
        let tick = Span::from_millis(1);
        let mut motion = Motion::new(Time::SIMULATION_START, start, tick, Span::from_millis(400));
        (1..=350).for_each(|n| motion.push(pose(Time::SIMULATION_START + tick * n)));
        (motion, pose)
    }

    #[test]
    fn consecutive_sweeps_hold_every_firing_once_at_the_manuals_instants() {
        let (lidar, optics) = (exact(10.0), level_ground());
        let (motion, _) = moving();
        let ends = [100, 200, 300].map(|ms| Time::SIMULATION_START + Span::from_millis(ms));
        let mut next = Time::SIMULATION_START;
        for end in ends {
            let (sweep, labels) = lidar.sweep(end, &motion, &optics);
            assert_eq!(labels.len(), sweep.returns.len());
            assert!((1808..=1809).contains(&(sweep.returns.len() / LASERS)), "{}", sweep.returns.len());
            for (n, one) in sweep.returns.iter().enumerate() {
                let stamp = sweep.start + one.fired_after;
                assert_eq!(stamp, next + LASER_STEP * (n % LASERS) as i64);
                assert!(stamp < end);
                if n % LASERS == LASERS - 1 {
                    next += CYCLE_STEP;
                }
            }
        }
    }

    #[test]
    fn a_sweep_put_back_with_its_own_true_poses_restores_the_ground_to_the_wires_steps() {
        let (lidar, optics) = (exact(10.0), level_ground());
        let (motion, pose) = moving();
        let (sweep, _) = lidar.sweep(Time::SIMULATION_START + Span::from_millis(300), &motion, &optics);
        let mut ground = 0;
        for one in &sweep.returns {
            let Some(point) = one.point() else { continue };
            let world_from_lidar = pose(sweep.start + one.fired_after) * Pose::translation(0.0, 0.0, 0.16);
            let height = (world_from_lidar * point).z;
            // Half a step of 2 mm along the beam and 1.5 steps of 0.01 degree across a tilted one.
            let bound = 0.001 + 1.5 * TAU / 36_000.0 * one.range_m.unwrap_or(0.0) + 1e-4;
            assert!(height.abs() < bound, "{height} m above the plane at {:?}", one);
            ground += 1;
        }
        assert!(ground > 10_000);
        let still = pose(sweep.end) * Pose::translation(0.0, 0.0, 0.16);
        let smeared =
            sweep.returns.iter().filter_map(Return::point).map(|p| (still * p).z.abs()).fold(0.0, f64::max);
        assert!(smeared > 0.02, "without the true poses the plane is bent, here by {smeared} m");
    }

    #[test]
    fn range_noise_and_dropout_follow_their_laws() {
        let spec = LidarSpec { dropout_ratio: 0.1, ..LidarSpec::default() };
        let noisy = Lidar::new(
            &spec,
            Span::from_millis(100),
            Pose::translation(0.0, 0.0, 0.16),
            Seed(7).stream("lidar"),
        );
        let (motion, _) = moving();
        let (sweep, labels) =
            noisy.sweep(Time::SIMULATION_START + Span::from_millis(300), &motion, &level_ground());
        let met: Vec<_> =
            sweep.returns.iter().zip(&labels).filter(|(_, label)| label.class != Class::Sky).collect();
        let lost = met.iter().filter(|(one, _)| one.range_m.is_none()).count();
        let count = met.len() as f64;
        assert!((lost as f64 - 0.1 * count).abs() < 4.0 * (0.09 * count).sqrt(), "{lost} of {count} lost");
        let errors: Vec<f64> = met
            .iter()
            .filter_map(|(one, label)| {
                let laser = vlp16::laser_of(one.ring);
                let along =
                    one.range_m? * one.elevation_rad.cos() / vlp16::ELEVATION_DEG[laser].to_radians().cos();
                Some(along - f64::from(label.range_m))
            })
            .collect();
        let n = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / n;
        let variance = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n;
        // Rounding to 2 mm adds a twelfth of its square.
        let law = 0.02_f64.powi(2) + 0.002_f64.powi(2) / 12.0;
        assert!(mean.abs() < 4.0 * (law / n).sqrt());
        assert!((variance - law).abs() < 4.0 * law * (2.0 / n).sqrt());
    }
}
