//! A scenario says what exists: terrain, planting, robot, mounts, sensors, route. It never names a system.

use crate::document::{Document, Refusal, suggest};
use crate::kidnap::KidnapSpec;
use crate::sensor::{FaultSpec, GnssSpec, ImuSpec, LidarSpec, OdometrySpec, WeatherSpec, wire_under};
use arborloop_base::{Pose2, Span, Wire, pose2};
use arborloop_robots::{FollowerSettings, Route, TrotSettings, WheelSettings};
use arborloop_worlds::WorldSpec;
use serde::{Deserialize, Serialize};

/// The schema that this version reads and writes.
pub const SCHEMA: u32 = 1;

/// The scenarios that come with the program: name and text.
pub const EMBEDDED: &[(&str, &str)] = &[
    ("cone-field-go1", include_str!("../scenarios/cone-field-go1.toml")),
    ("cone-field-go1-short", include_str!("../scenarios/cone-field-go1-short.toml")),
    ("citrus-jackal", include_str!("../scenarios/citrus-jackal.toml")),
    ("citrus-jackal-short", include_str!("../scenarios/citrus-jackal-short.toml")),
    ("forest-go1", include_str!("../scenarios/forest-go1.toml")),
    ("orchard-go1", include_str!("../scenarios/orchard-go1.toml")),
    ("vineyard-thorvald", include_str!("../scenarios/vineyard-thorvald.toml")),
];

/// Everything that exists in a run, every default spelled out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Version of these keys; [`SCHEMA`].
    pub schema: u32,
    /// Names the run folder: letters, digits, `-` and `_`.
    pub name: String,
    /// Why the scenario exists.
    #[serde(default)]
    pub description: String,
    /// Seed of a run that is not given another.
    #[serde(default = "default_seed")]
    pub seed: u64,
    /// Clock, beginning and end.
    #[serde(default)]
    pub run: RunSpec,
    /// Who walks.
    #[serde(default)]
    pub robot: RobotSpec,
    /// Where the robot stands at time zero.
    #[serde(default)]
    pub start: StartSpec,
    /// Where it is to walk, in the frame of its start.
    pub route: Route,
    /// How it steers along the route.
    #[serde(default)]
    pub follower: FollowerSettings,
    /// How it walks, if it has legs.
    #[serde(default)]
    pub gait: TrotSettings,
    /// How it drives, if it has wheels.
    #[serde(default)]
    pub wheels: WheelSettings,
    /// The lidar on its back.
    #[serde(default)]
    pub lidar: LidarSpec,
    /// The inertial sensor; absent means none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imu: Option<ImuSpec>,
    /// The satellite receiver; absent means none. Recorded, and fed to a system only when that system asks for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gnss: Option<GnssSpec>,
    /// Leg odometry; absent means none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<OdometrySpec>,
    /// The air that the lidar's beams fly through.
    #[serde(default)]
    pub weather: WeatherSpec,
    /// What stands around.
    #[serde(default)]
    pub world: WorldSpec,
    /// What goes wrong with the lidar, and when.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fault: Vec<FaultSpec>,
    /// When the robot is carried off, and where to.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kidnap: Vec<KidnapSpec>,
}

/// Clock, beginning and end of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RunSpec {
    /// One physics step, seconds; every sensor period is a whole number of these.
    pub tick_s: f64,
    /// The robot stands still this long before it walks, so that systems can begin.
    pub stand_s: f64,
    /// It stands this long at the end of its route before the run ends.
    pub calm_s: f64,
    /// The run ends after this long whatever happens.
    pub duration_s_max: f64,
    /// From the end of a sweep until the command that answers it takes effect: simulated, never measured.
    pub latency_s: f64,
    /// A driver that is lost for this long ends the run.
    pub lost_s_max: f64,
}

impl Default for RunSpec {
    fn default() -> Self {
        RunSpec {
            tick_s: 0.001,
            stand_s: 1.0,
            calm_s: 2.0,
            duration_s_max: 600.0,
            latency_s: 0.05,
            lost_s_max: 10.0,
        }
    }
}

/// Who walks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RobotSpec {
    /// One of the robots that come with the program.
    pub model: RobotModel,
}

/// The robots that come with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RobotModel {
    /// Unitree Go1 with a VLP-16 on its back.
    #[default]
    Go1,
    /// Clearpath Jackal with a VLP-16 on a tower: skid steering.
    Jackal,
    /// Thorvald II, slim, with an OS1-16 above its front beam: four wheels driven and steered.
    Thorvald,
}

/// Where the robot stands at time zero, world frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StartSpec {
    /// East, meters.
    pub x_m: f64,
    /// North, meters.
    pub y_m: f64,
    /// Heading, counter-clockwise from east, degrees.
    pub yaw_deg: f64,
}

impl StartSpec {
    /// The start as a planar pose, world frame.
    pub fn pose(&self) -> Pose2 {
        pose2(self.x_m, self.y_m, self.yaw_deg.to_radians())
    }
}

fn default_seed() -> u64 {
    1
}

/// A value at a dotted path that no run can be made with.
pub(crate) struct Wrong {
    pub(crate) path: String,
    pub(crate) message: String,
}

impl Scenario {
    /// Reads and checks a scenario; every refusal names the place.
    pub fn read(document: &Document) -> Result<Scenario, Refusal> {
        let scenario: Scenario = document.read()?;
        match scenario.check() {
            Ok(()) => Ok(scenario),
            Err(wrong) => Err(document.refuse(&wrong.path, wrong.message, None)),
        }
    }

    /// The text of a scenario that comes with the program; the refusal lists what there is.
    pub fn embedded(name: &str) -> Result<Document, Refusal> {
        let known: Vec<&str> = EMBEDDED.iter().map(|(name, _)| *name).collect();
        EMBEDDED
            .iter()
            .find(|(known, _)| *known == name)
            .map(|(name, text)| Document::new(format!("{name}.toml"), *text))
            .ok_or_else(|| Refusal {
                document: Document::new(name, ""),
                span: None,
                message: "neither a file nor a scenario that comes with the program".into(),
                help: Some(suggest(name, &known)),
            })
    }

    /// The scenario as TOML with every default spelled out; reads back as the same scenario.
    pub fn resolved(&self) -> String {
        toml::to_string_pretty(self).expect("a scenario is tables, numbers and strings, which TOML can say")
    }

    /// How the lidar speaks: what its sweeps are rounded to and recorded as.
    pub fn wire(&self) -> Wire {
        wire_under(&self.lidar, &self.fault)
    }

    /// One tick of the clock.
    pub fn tick(&self) -> Span {
        Span::from_seconds(self.run.tick_s)
    }

    fn check(&self) -> Result<(), Wrong> {
        let wrong = |path: &str, message: String| Err(Wrong { path: path.into(), message });
        if self.schema != SCHEMA {
            return wrong("schema", format!("found schema {}, wanted {SCHEMA}", self.schema));
        }
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if self.name.is_empty() || !self.name.chars().all(plain) {
            return wrong("name", format!("found `{}`, wanted letters, digits, `-` and `_`", self.name));
        }
        let run = &self.run;
        within("run.tick_s", run.tick_s, 1e-4, 0.01)?;
        within("run.stand_s", run.stand_s, 0.0, 1e4)?;
        within("run.calm_s", run.calm_s, 0.0, 1e4)?;
        within("run.duration_s_max", run.duration_s_max, 1e-3, 1e5)?;
        within("run.latency_s", run.latency_s, 0.0, 10.0)?;
        within("run.lost_s_max", run.lost_s_max, 0.0, 1e5)?;
        if 1_000_000_000 % self.tick().nanos() != 0 {
            return wrong(
                "run.tick_s",
                format!("found {} s, wanted a whole number of ticks in a second", run.tick_s),
            );
        }
        within("start.x_m", self.start.x_m, -1e4, 1e4)?;
        within("start.y_m", self.start.y_m, -1e4, 1e4)?;
        within("start.yaw_deg", self.start.yaw_deg, -360.0, 360.0)?;
        let below = |table: &str, key: &str, found: &str, wanted: &str| Wrong {
            path: format!("{table}.{key}"),
            message: format!("found {found}, wanted {wanted}"),
        };
        self.route.check().map_err(|e| below("route", &e.key, &e.found, &e.wanted))?;
        self.follower.check().map_err(|e| below("follower", &e.key, &e.found, &e.wanted))?;
        self.gait.check().map_err(|e| below("gait", &e.key, &e.found, &e.wanted))?;
        self.wheels.check().map_err(|e| below("wheels", &e.key, &e.found, &e.wanted))?;
        self.world.check().map_err(|e| below("world", &e.key, &e.found, &e.wanted))?;
        let tick = self.tick();
        self.lidar.check(tick)?;
        self.weather.check()?;
        let (rings, turn_s) = (self.lidar.model.beams.elevation_deg.len() as u16, 1.0 / self.lidar.rate_hz);
        self.fault.iter().enumerate().try_for_each(|(number, fault)| fault.check(number, rings, turn_s))?;
        self.kidnap.iter().enumerate().try_for_each(|(number, kidnap)| kidnap.check(number))?;
        self.imu.iter().try_for_each(|imu| imu.check(tick))?;
        self.gnss.iter().try_for_each(|gnss| gnss.check(tick))?;
        self.odometry.iter().try_for_each(|odometry| odometry.check(tick))
    }
}

/// Refuses a number outside a range, and one that is no number.
pub(crate) fn within(path: &str, value: f64, low: f64, high: f64) -> Result<(), Wrong> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(Wrong { path: path.into(), message: format!("found {value}, wanted {low} to {high}") })
}

/// Refuses a rate whose period is no whole number of ticks.
pub(crate) fn whole_ticks(path: &str, rate_hz: f64, tick: Span) -> Result<Span, Wrong> {
    let period = Span::from_seconds(1.0 / rate_hz);
    let exact = (period.seconds() * rate_hz - 1.0).abs() < 1e-9;
    match period.whole_steps(tick) {
        Some(_) if exact => Ok(period),
        _ => Err(Wrong {
            path: path.into(),
            message: format!(
                "found {rate_hz} Hz, a period of {:.6} ms; wanted a whole number of ticks of {} ms",
                1e3 / rate_hz,
                tick.seconds() * 1e3
            ),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(change: &str) -> Refusal {
        let document = Scenario::embedded("cone-field-go1").unwrap().overridden(&[change.into()]).unwrap();
        Scenario::read(&document).unwrap_err()
    }

    #[test]
    fn every_embedded_scenario_is_complete_and_reads_back_from_its_resolved_form() {
        for (name, text) in EMBEDDED {
            assert!(text.starts_with("# "), "{name}: the first line says why it exists");
            let scenario = Scenario::read(&Scenario::embedded(name).unwrap()).unwrap();
            assert_eq!(scenario.name, *name);
            let again = Scenario::read(&Document::new("resolved", scenario.resolved())).unwrap();
            assert_eq!(scenario, again);
        }
    }

    #[test]
    fn values_outside_physics_are_refused_at_their_place() {
        for (change, path) in [
            ("lidar.range_m_max=130.0", "range_m_max"),
            ("lidar.range_noise_m=nan", "range_noise_m"),
            ("lidar.rate_hz=13.0", "rate_hz"),
            ("imu.rate_hz=333.0", "rate_hz"),
            ("gait.period_s=-1.0", "period_s"),
            ("world.terrain.slope_deg=91.0", "slope_deg"),
            ("run.tick_s=0.0007", "tick_s"),
            ("schema=2", "schema"),
            ("name=\"a/b\"", "name"),
            ("follower.speed_mps=-1.0", "speed_mps"),
            ("kidnap=[{at_s=-1.0, by_m=[1.0, 0.0]}]", "at_s"),
            ("kidnap=[{at_s=5.0, turned_deg=1000.0}]", "turned_deg"),
        ] {
            let refusal = refusal(change);
            let (line, _) =
                refusal.line_and_column().unwrap_or_else(|| panic!("{change}: no place in {refusal}"));
            let shown = refusal.document.text.lines().nth(line - 1).unwrap();
            assert!(shown.contains(path), "{change}: {refusal} shows `{shown}`");
        }
    }

    #[test]
    fn an_unknown_scenario_is_answered_with_the_nearest_name() {
        let refusal = Scenario::embedded("cone-feild-go1").unwrap_err();
        assert!(refusal.help.unwrap().contains("did you mean `cone-field-go1`"));
    }
}
