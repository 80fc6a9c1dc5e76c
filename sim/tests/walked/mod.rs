//! Walks of the physics gait and what is measured on them. Shared by the tests and by the study in `benches/gait.rs`.
#![allow(dead_code)]

pub(crate) mod bars;
pub(crate) mod strides;

use arborloop_base::{Pose, Seed, Span, planar, pose2};
use arborloop_robots::{
    Body, Command, Fall, Follower, FollowerSettings, GaitMode, Ground, KinematicTrot, Route, TrotSettings,
    TrunkMotion, TrunkState, go1,
};
use arborloop_sim::PhysicsGait;
use arborloop_worlds::{Planting, SurroundingsSpec, Terrain, TerrainSpec, World, WorldSpec, build};
use nalgebra::{Point2, Vector2, Vector3};
use std::f64::consts::TAU;

pub(crate) const TICK_S: f64 = 0.001;
pub(crate) const STRIDE_HZ: f64 = 1.0 / 0.45;

/// The ground as the gait's height function; the physics gait has its own.
pub(crate) struct Soil<'a>(pub &'a Terrain);

impl Ground for Soil<'_> {
    fn height_m(&self, x_m: f64, y_m: f64) -> f64 {
        self.0.height_m(x_m, y_m)
    }
}

/// Bare ground: bumps of a greatest height (three deviations: bounded
/// noise of that height has as much) over a slope.
pub(crate) fn ground(bump_m: f64, slope_deg: f64, seed: u64) -> World {
    let terrain = TerrainSpec {
        extent_m: 15.0,
        cell_m: 0.05,
        relief_m: 0.0,
        bump_m: bump_m / 3.0,
        bump_wavelength_m: 0.6,
        slope_deg,
        slope_toward_deg: 30.0,
        ..TerrainSpec::default()
    };
    let surroundings = SurroundingsSpec { trees: 0, bushes: 0, ..SurroundingsSpec::default() };
    build(&WorldSpec { terrain, planting: Planting::None, surroundings, ..WorldSpec::default() }, Seed(seed))
}

/// Who tells the robot where to go.
pub(crate) enum Guide {
    /// Always the same command.
    Always(Command),
    /// Around the paper's rectangle of 6 m x 2 m at a speed, by truth.
    Rectangle(f64),
}

/// A walk, state by state at 1 kHz, the start left out.
pub(crate) struct Walk {
    pub(crate) states: Vec<TrunkState>,
    pub(crate) fall: Option<Fall>,
    pub(crate) speed_mps: f64,
}

/// Stands for half a second, then walks: by physics unless the settings ask for strides or a smooth ride.
pub(crate) fn walk(world: &World, settings: &TrotSettings, guide: &Guide, seconds: f64, seed: u64) -> Walk {
    let (start, tick) = (pose2(0.0, 0.0, 0.0), Span::from_seconds(TICK_S));
    let mut gait: Box<dyn TrunkMotion> = match settings.mode {
        GaitMode::Strides | GaitMode::Smooth => {
            Box::new(KinematicTrot::new(settings.clone(), start, tick, &Soil(&world.terrain), Seed(seed)))
        }
        // The default mode too: this is the study of physics.
        GaitMode::Kinematic | GaitMode::Physics => {
            Box::new(PhysicsGait::new(world, settings, start, tick, Seed(seed)))
        }
    };
    walk_on(gait.as_mut(), world, guide, seconds)
}

/// The same for any gait.
pub(crate) fn walk_on(gait: &mut dyn TrunkMotion, world: &World, guide: &Guide, seconds: f64) -> Walk {
    let speed_mps = match guide {
        Guide::Always(command) => command.forward_mps,
        Guide::Rectangle(speed_mps) => *speed_mps,
    };
    let route =
        Route { waypoints_m: vec![[0.0, 0.0], [6.0, 0.0], [6.0, 2.0], [0.0, 2.0]], closed: true, laps: 1000 };
    let mut follower = Follower::new(
        route,
        FollowerSettings { speed_mps: speed_mps.max(0.1), ..FollowerSettings::default() },
    );
    let mut states = Vec::with_capacity((seconds / TICK_S) as usize);
    let mut command = Command::default();
    for tick in 0..(seconds / TICK_S).round() as usize {
        if tick >= 500 && tick % 20 == 0 {
            command = match guide {
                Guide::Always(command) => *command,
                Guide::Rectangle(_) => follower.steer(&planar(&gait.state().world_from_base)),
            };
        }
        gait.advance(&command, &Soil(&world.terrain));
        if gait.fall().is_some() {
            break;
        }
        states.push(gait.state().clone());
    }
    Walk { states, fall: gait.fall(), speed_mps }
}

/// What the acceptance bars speak of.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Measured {
    pub(crate) speed_mps: f64,
    pub(crate) cross_rms_m: f64,
    pub(crate) cross_max_m: f64,
    /// Hip, thigh, knee.
    pub(crate) torque_max_nm: [f64; 3],
    pub(crate) knee_rms_nm: f64,
    pub(crate) rate_max_radps: [f64; 3],
    /// Share of all joint samples at the envelope.
    pub(crate) saturated: f64,
    pub(crate) duty: [f64; 4],
    /// Mechanical cost of transport: all power as positive, and the positive part only.
    pub(crate) cost_abs: f64,
    pub(crate) cost_positive: f64,
    /// Vertical acceleration at the IMU in 1-20, 20-100 and 100-400 Hz, m/s2.
    pub(crate) az_mps2: [f64; 3],
    pub(crate) az_peak_mps2: f64,
    /// Its magnitude below 100 Hz that one sample in a hundred exceeds, m/s2.
    pub(crate) az_percentile_mps2: f64,
    /// At 1, 2, 4, 6 and 8 times the stride frequency, m/s2 rms.
    pub(crate) harmonics_mps2: [f64; 5],
    /// Where the spectrum peaks within a third of the stride frequency of its 2nd and 4th multiple, hertz.
    pub(crate) peaks_hz: [f64; 2],
    pub(crate) roll_deg: f64,
    pub(crate) pitch_deg: f64,
    pub(crate) bob_m: f64,
}

impl Walk {
    /// Everything, over the walk without its first two seconds.
    pub(crate) fn measured(&self) -> Measured {
        let states = &self.states[2000.min(self.states.len())..];
        let az = imu_az(states);
        let angle = |pick: usize| -> Vec<f64> {
            let angles = states.iter().map(|state| {
                let (roll, pitch, _) = state.world_from_base.rotation.euler_angles();
                [roll, pitch][pick].to_degrees()
            });
            angles.collect()
        };
        let heights: Vec<f64> = states.iter().map(|state| state.world_from_base.translation.z).collect();
        let (cross_rms_m, cross_max_m) = beside(states);
        let loads: Vec<_> = states.iter().filter_map(|state| state.loads).collect();
        let joint = |n: usize| (0..4).map(move |leg| 3 * leg + n);
        let most = |pick: &dyn Fn(usize, usize) -> f64| -> [f64; 3] {
            std::array::from_fn(|n| {
                (0..loads.len())
                    .flat_map(|t| joint(n).map(move |j| (t, j)))
                    .map(|(t, j)| pick(t, j))
                    .fold(0.0, f64::max)
            })
        };
        let motors = Body::go1().motors;
        let (mut full, mut knee, mut abs, mut positive) = (0_usize, 0.0, 0.0, 0.0);
        for load in &loads {
            for j in 0..12 {
                let (torque, rate) = (load.joint_torques_nm[j], load.joint_rates_radps[j]);
                full += usize::from(
                    torque.abs() >= motors[j % 3].torque_nm(1e9 * torque.signum(), rate).abs()
                        && torque != 0.0,
                );
                abs += (torque * rate).abs() * TICK_S;
                positive += (torque * rate).max(0.0) * TICK_S;
                if j % 3 == 2 {
                    knee += torque * torque;
                }
            }
        }
        let way_m: f64 = states
            .windows(2)
            .map(|w| (w[1].world_from_base.translation.vector - w[0].world_from_base.translation.vector).xy())
            .zip(states)
            .map(|(step, state)| step.dot(&(state.world_from_base.rotation * Vector3::x()).xy().normalize()))
            .sum();
        let weight_m = 9.806_65 * Body::go1().mass_kg * way_m;
        Measured {
            speed_mps: way_m / (states.len() as f64 * TICK_S),
            cross_rms_m,
            cross_max_m,
            torque_max_nm: most(&|t, j| loads[t].joint_torques_nm[j].abs()),
            knee_rms_nm: (knee / (4.0 * loads.len() as f64)).sqrt(),
            rate_max_radps: most(&|t, j| loads[t].joint_rates_radps[j].abs()),
            saturated: full as f64 / (12.0 * loads.len() as f64),
            duty: std::array::from_fn(|leg| {
                states.iter().filter(|state| state.stance[leg]).count() as f64 / states.len() as f64
            }),
            cost_abs: abs / weight_m,
            cost_positive: positive / weight_m,
            az_mps2: [band(&az, 1.0, 20.0), band(&az, 20.0, 100.0), band(&az, 100.0, 400.0)],
            az_percentile_mps2: bars::percentile(&bars::below_100_hz(&az)),
            az_peak_mps2: az.iter().fold(0.0, |most, a| a.abs().max(most)),
            harmonics_mps2: [1.0, 2.0, 4.0, 6.0, 8.0]
                .map(|times| band(&az, times * STRIDE_HZ - 0.3, times * STRIDE_HZ + 0.3)),
            peaks_hz: [2.0, 4.0].map(|times| peak(&az, times * STRIDE_HZ)),
            roll_deg: band(&angle(0), 0.8, 50.0),
            pitch_deg: band(&angle(1), 0.8, 50.0),
            bob_m: band(&heights, 0.8, 50.0) * 2.0 * 2_f64.sqrt(),
        }
    }
}

impl Measured {
    /// The peak near twice or four times the stride frequency, hertz.
    pub(crate) fn peak_near(&self, times: f64) -> f64 {
        self.peaks_hz[usize::from(times > 3.0)]
    }
}

/// The frequency of the greatest power within 0.7 Hz of one.
fn peak(signal: &[f64], around_hz: f64) -> f64 {
    let candidates = (-28..=28).map(|n| around_hz + 0.025 * f64::from(n));
    candidates
        .map(|hz| (hz, power(signal, hz)))
        .fold((0.0, 0.0), |best, one| if one.1 > best.1 { one } else { best })
        .0
}

/// Every number of a state.
pub(crate) fn numbers(state: &TrunkState) -> Vec<f64> {
    let pose = &state.world_from_base;
    let mut numbers: Vec<f64> =
        pose.translation.vector.iter().chain(pose.rotation.coords.iter()).copied().collect();
    numbers.extend(state.linear_mps.iter().chain(state.angular_radps.iter()));
    numbers.extend(state.joint_angles_rad);
    if let Some(loads) = state.loads {
        numbers.extend(loads.joint_rates_radps.iter().chain(&loads.joint_torques_nm));
        numbers
            .extend(loads.foot_forces_n.iter().flat_map(|force| force.iter().copied().collect::<Vec<_>>()));
    }
    numbers
}

/// Root mean square and greatest distance from the rectangle.
fn beside(states: &[TrunkState]) -> (f64, f64) {
    let corners = [[0.0, 0.0], [6.0, 0.0], [6.0, 2.0], [0.0, 2.0]].map(|[x, y]| Point2::new(x, y));
    let distance = |at: Point2<f64>| {
        (0..4)
            .map(|n| {
                let (from, to) = (corners[n], corners[(n + 1) % 4]);
                let leg: Vector2<f64> = to - from;
                let share = ((at - from).dot(&leg) / leg.norm_squared()).clamp(0.0, 1.0);
                (at - (from + leg * share)).norm()
            })
            .fold(f64::INFINITY, f64::min)
    };
    let distances: Vec<f64> =
        states.iter().map(|s| distance(s.world_from_base.translation.vector.xy().into())).collect();
    let square = distances.iter().map(|d| d * d).sum::<f64>() / distances.len().max(1) as f64;
    (square.sqrt(), distances.iter().fold(0.0, |most, d| d.max(most)))
}

/// Vertical acceleration at the IMU without gravity, world axes, m/s2: the velocity's differences.
pub(crate) fn imu_az(states: &[TrunkState]) -> Vec<f64> {
    imu_az_at(states, TICK_S)
}

/// The same for ticks of another length.
pub(crate) fn imu_az_at(states: &[TrunkState], tick_s: f64) -> Vec<f64> {
    let arm = go1::go1().frame("imu_link").map_or(Vector3::zeros(), |pose: Pose| pose.translation.vector);
    let velocity = |state: &TrunkState| {
        state.linear_mps + state.world_from_base.rotation * state.angular_radps.cross(&arm)
    };
    states.windows(2).map(|w| (velocity(&w[1]) - velocity(&w[0])).z / tick_s).collect()
}

/// Root mean square of a signal between two frequencies: mean power of windowed stretches of ten strides.
pub(crate) fn band(signal: &[f64], low_hz: f64, high_hz: f64) -> f64 {
    let length = 4500.min(signal.len());
    if length == 0 {
        return 0.0;
    }
    let step_hz = 1.0 / (length as f64 * TICK_S);
    let (first, last) = ((low_hz / step_hz).ceil() as usize, (high_hz / step_hz).floor() as usize);
    let (mut sum, mut count) = (0.0, 0.0);
    for stretch in signal.chunks_exact(length) {
        let mean = stretch.iter().sum::<f64>() / length as f64;
        let windowed: Vec<f64> = stretch
            .iter()
            .enumerate()
            // The Hann window; its power is 3/8.
            .map(|(n, x)| {
                (x - mean) * (0.5 - 0.5 * (TAU * n as f64 / length as f64).cos()) / 0.375_f64.sqrt()
            })
            .collect();
        sum += (first..=last).map(|bin| 2.0 * power(&windowed, bin as f64 * step_hz)).sum::<f64>();
        count += 1.0;
    }
    (sum / f64::max(count, 1.0)).sqrt()
}

/// Power of a signal at one frequency, by a plain Fourier sum.
pub(crate) fn power(signal: &[f64], hz: f64) -> f64 {
    let (turn_sin, turn_cos) = (TAU * hz * TICK_S).sin_cos();
    let (mut cos, mut sin, mut re, mut im) = (1.0, 0.0, 0.0, 0.0);
    for value in signal {
        re += value * cos;
        im += value * sin;
        (cos, sin) = (cos * turn_cos - sin * turn_sin, sin * turn_cos + cos * turn_sin);
    }
    (re * re + im * im) / (signal.len() as f64).powi(2)
}
