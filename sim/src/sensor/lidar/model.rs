//! A lidar as a data file: beams, turn, pulse, range and wire. What comes with the program is a file too.

use crate::document::{Document, Refusal};
use crate::scenario::{Wrong, within};
use crate::sensor::lidar::wire_of;
use arborloop_base::Wire;
use serde::{Deserialize, Serialize};

/// The lidars that come with the program: name and text.
pub const EMBEDDED: &[(&str, &str)] = &[
    ("vlp16", include_str!("../../../sensors/vlp16.toml")),
    ("os1-16", include_str!("../../../sensors/os1-16.toml")),
];
/// Their names.
pub(super) const NAMES: &[&str] = &["vlp16", "os1-16"];

/// A lidar, every default spelled out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LidarModel {
    /// What a scenario and a report call it.
    pub name: String,
    /// One line about it.
    #[serde(default)]
    pub description: String,
    /// The form in which its sweeps travel.
    pub wire: WireForm,
    /// Wavelength of the light, nanometers.
    pub wavelength_nm: f64,
    /// Which echoes it can report; the first is its default.
    #[serde(default = "strongest")]
    pub returns: Vec<EchoChoice>,
    /// How it turns.
    pub turn: TurnModel,
    /// Its beams, in firing order.
    pub beams: BeamModel,
    /// Its light.
    pub pulse: PulseModel,
    /// What it measures.
    pub range: RangeModel,
}

/// The form in which a lidar's sweeps travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WireForm {
    /// The VLP-16's packets.
    Vlp16,
    /// Ouster's frames.
    Ouster,
    /// A cloud that loses nothing, for any other lidar.
    Plain,
}

/// Which echoes of a firing are reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EchoChoice {
    /// The nearest.
    First,
    /// The farthest.
    Last,
    /// The strongest.
    Strongest,
    /// The farthest and the strongest; the second strongest where these two are one.
    Dual,
}

fn strongest() -> Vec<EchoChoice> {
    vec![EchoChoice::Strongest]
}

/// How a lidar turns: clockwise seen from above, from straight behind on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TurnModel {
    /// Turns a second, unless a scenario says otherwise.
    pub rate_hz: f64,
    /// Slowest turn, where it is free.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_hz_min: Option<f64>,
    /// Fastest turn, where it is free.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate_hz_max: Option<f64>,
    /// Time between two firings of the same beam that does not depend on the turn, nanoseconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cycle_ns: Option<i64>,
    /// Firings of each beam in a turn, where the turn sets them; unless a scenario says otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<u32>,
    /// Columns and rates that go together, as `1024x10`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub modes: Vec<String>,
    /// Azimuths are whole multiples of this, degrees; 0 for as they are. Columns are exact.
    #[serde(default)]
    pub azimuth_step_deg: f64,
}

/// The beams of a lidar, in firing order. A list that is left out is all zeros.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeamModel {
    /// Elevation, degrees.
    pub elevation_deg: Vec<f64>,
    /// How far a beam looks clockwise of the head's bearing, degrees.
    #[serde(default)]
    pub azimuth_deg: Vec<f64>,
    /// Height of a beam's origin above the sensor's center, meters.
    #[serde(default)]
    pub height_m: Vec<f64>,
    /// When a beam fires within its cycle, nanoseconds.
    #[serde(default)]
    pub fires_after_ns: Vec<i64>,
    /// How far from the spin axis beams leave the sensor, meters.
    #[serde(default)]
    pub radius_m: f64,
}

/// The light of a beam.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PulseModel {
    /// Full angle of the beam across and along the spin axis, milliradians.
    pub divergence_mrad: [f64; 2],
    /// Intensity at that angle's edge, against the middle's: 0.5 for a full width at half maximum, 0.1353 for 1/e^2.
    pub edge_ratio: f64,
    /// Echoes that follow each other by less become one, meters.
    pub length_m: f64,
}

/// What a lidar measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RangeModel {
    /// Nearer echoes are not reported, meters.
    pub range_m_min: f64,
    /// Farther echoes are not reported, meters.
    pub range_m_max: f64,
    /// Range at which a target of 10 % reflectance that faces the beam and fills it is just seen, meters.
    pub reach_m: f64,
    /// Ranges are whole multiples of this, meters; 0 for as they are.
    #[serde(default)]
    pub range_step_m: f64,
    /// Standard deviation of the range of a strong echo, meters.
    pub range_noise_m: f64,
    /// The same of an echo that is just seen, as multiple of the strong echo's; 1 when it does not grow.
    #[serde(default = "one")]
    pub weak_noise_ratio: f64,
}

fn one() -> f64 {
    1.0
}

impl LidarModel {
    /// A lidar that comes with the program.
    pub fn embedded(name: &str) -> Option<LidarModel> {
        let (name, text) = EMBEDDED.iter().find(|(known, _)| *known == name)?;
        LidarModel::read(&Document::new(format!("{name}.toml"), *text)).ok()
    }

    /// Reads and checks a lidar's data file; every refusal names the place.
    pub fn read(document: &Document) -> Result<LidarModel, Refusal> {
        let model: LidarModel = document.read()?;
        match model.filled().check() {
            Ok(()) => Ok(model.filled()),
            Err(wrong) => Err(document.refuse(&wrong.path, wrong.message, None)),
        }
    }

    /// Columns and turns a second of a mode such as `1024x10`.
    pub(super) fn modes(&self) -> Vec<(u32, f64)> {
        self.turn.modes.iter().filter_map(|mode| mode_of(mode)).collect()
    }

    /// Lists that are left out become zeros.
    pub(super) fn filled(&self) -> LidarModel {
        let mut model = self.clone();
        let count = model.beams.elevation_deg.len();
        let fill = |list: &mut Vec<f64>| {
            if list.is_empty() {
                list.resize(count, 0.0);
            }
        };
        fill(&mut model.beams.azimuth_deg);
        fill(&mut model.beams.height_m);
        if model.beams.fires_after_ns.is_empty() {
            model.beams.fires_after_ns.resize(count, 0);
        }
        model
    }

    pub(super) fn check(&self) -> Result<(), Wrong> {
        let wrong = |path: &str, message: String| Err(Wrong { path: path.into(), message });
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if self.name.is_empty() || !self.name.chars().all(plain) {
            return wrong("name", format!("found `{}`, wanted letters, digits, `-` and `_`", self.name));
        }
        within("wavelength_nm", self.wavelength_nm, 300.0, 3000.0)?;
        if self.returns.is_empty() {
            return wrong("returns", "found none, wanted at least one".into());
        }
        self.check_turn()?;
        self.check_beams()?;
        within("pulse.divergence_mrad", self.pulse.divergence_mrad[0], 0.0, 100.0)?;
        within("pulse.divergence_mrad", self.pulse.divergence_mrad[1], 0.0, 100.0)?;
        within("pulse.edge_ratio", self.pulse.edge_ratio, 0.001, 0.999)?;
        within("pulse.length_m", self.pulse.length_m, 0.0, 100.0)?;
        let range = &self.range;
        within("range.range_m_max", range.range_m_max, 0.1, 1000.0)?;
        within("range.range_m_min", range.range_m_min, 0.0, range.range_m_max)?;
        within("range.reach_m", range.reach_m, 0.1, 1e6)?;
        within("range.range_step_m", range.range_step_m, 0.0, 1.0)?;
        within("range.range_noise_m", range.range_noise_m, 0.0, 10.0)?;
        within("range.weak_noise_ratio", range.weak_noise_ratio, 1.0, 1000.0)?;
        match self.wire {
            WireForm::Vlp16 => self.check_vlp16(),
            WireForm::Ouster => self.check_ouster(),
            WireForm::Plain => Ok(()),
        }
    }

    fn check_turn(&self) -> Result<(), Wrong> {
        let wrong = |path: &str, message: &str| Err(Wrong { path: path.into(), message: message.into() });
        let turn = &self.turn;
        within("turn.rate_hz", turn.rate_hz, 0.1, 100.0)?;
        within("turn.azimuth_step_deg", turn.azimuth_step_deg, 0.0, 10.0)?;
        match (turn.cycle_ns, turn.columns) {
            (Some(cycle_ns), None) => {
                within("turn.cycle_ns", cycle_ns as f64, 1000.0, 1e8)?;
                let (Some(slowest), Some(fastest)) = (turn.rate_hz_min, turn.rate_hz_max) else {
                    return wrong(
                        "turn",
                        "found `cycle_ns`, wanted `rate_hz_min` and `rate_hz_max` beside it",
                    );
                };
                within("turn.rate_hz_max", fastest, 0.1, 100.0)?;
                within("turn.rate_hz_min", slowest, 0.1, fastest)?;
                within("turn.rate_hz", turn.rate_hz, slowest, fastest)
            }
            (None, Some(columns)) => {
                if let Some(mode) = turn.modes.iter().find(|mode| mode_of(mode).is_none()) {
                    return wrong(
                        "turn.modes",
                        &format!("found `{mode}`, wanted columns x rate as `1024x10`"),
                    );
                }
                if !self.modes().contains(&(columns, turn.rate_hz)) {
                    let found = format!("found {columns}x{}, wanted one of `modes`", turn.rate_hz);
                    return wrong("turn.columns", &found);
                }
                Ok(())
            }
            _ => wrong("turn", "found both or none of `cycle_ns` and `columns`, wanted one of them"),
        }
    }

    fn check_beams(&self) -> Result<(), Wrong> {
        let beams = &self.beams;
        let count = beams.elevation_deg.len();
        if !(1..=512).contains(&count) {
            let message = format!("found {count} beams, wanted 1 to 512");
            return Err(Wrong { path: "beams.elevation_deg".into(), message });
        }
        for (name, found) in [
            ("beams.azimuth_deg", beams.azimuth_deg.len()),
            ("beams.height_m", beams.height_m.len()),
            ("beams.fires_after_ns", beams.fires_after_ns.len()),
        ] {
            if found != count {
                let message = format!("found {found} entries, wanted {count}, one a beam");
                return Err(Wrong { path: name.into(), message });
            }
        }
        for index in 0..count {
            let at = |list: &str| format!("beams.{list}[{index}]");
            within(&at("elevation_deg"), beams.elevation_deg[index], -89.0, 89.0)?;
            within(&at("azimuth_deg"), beams.azimuth_deg[index], -180.0, 180.0)?;
            within(&at("height_m"), beams.height_m[index], -1.0, 1.0)?;
            let cycle_ns = self.turn.cycle_ns.map_or(0, |cycle_ns| cycle_ns - 1);
            within(&at("fires_after_ns"), beams.fires_after_ns[index] as f64, 0.0, cycle_ns as f64)?;
        }
        if beams.fires_after_ns.windows(2).any(|pair| pair[0] > pair[1]) {
            let message =
                "found a beam that fires before the one listed above it, wanted firing order".into();
            return Err(Wrong { path: "beams.fires_after_ns".into(), message });
        }
        within("beams.radius_m", beams.radius_m, 0.0, 1.0)
    }

    /// The packets say nothing of beams: they mean the VLP-16's own.
    fn check_vlp16(&self) -> Result<(), Wrong> {
        use arborloop_base::vlp16::{
            AZIMUTH_STEP_DEG, CYCLE_STEP, DISTANCE_STEP_M, ELEVATION_DEG, LASER_STEP, LASERS, OFFSET_M,
        };
        let fires: Vec<i64> = (0..LASERS as i64).map(|laser| laser * LASER_STEP.nanos()).collect();
        let beams = &self.beams;
        let own = [
            ("beams.elevation_deg", beams.elevation_deg == ELEVATION_DEG),
            ("beams.height_m", beams.height_m == OFFSET_M),
            ("beams.azimuth_deg", beams.azimuth_deg == [0.0; LASERS]),
            ("beams.fires_after_ns", beams.fires_after_ns == fires),
            ("beams.radius_m", beams.radius_m == 0.0),
            ("turn.cycle_ns", self.turn.cycle_ns == Some(CYCLE_STEP.nanos())),
            ("turn.azimuth_step_deg", self.turn.azimuth_step_deg == AZIMUTH_STEP_DEG),
            ("range.range_step_m", self.range.range_step_m == DISTANCE_STEP_M),
            ("returns", !self.returns.contains(&EchoChoice::First)),
        ];
        match own.iter().find(|(_, same)| !same) {
            None => Ok(()),
            Some((path, _)) => Err(Wrong {
                path: (*path).into(),
                message:
                    "found another value than the VLP-16's, which its packets cannot say; wanted its own, or \
                          wire = \"plain\""
                        .into(),
            }),
        }
    }

    /// Ouster's frames hold one echo a pixel, rows from the highest beam down, and columns that fire at once.
    fn check_ouster(&self) -> Result<(), Wrong> {
        let beams = &self.beams;
        let wrong = |path: &str, message: &str| Err(Wrong { path: path.into(), message: message.into() });
        if self.turn.columns.is_none() {
            return wrong("turn", "found no `columns`, which Ouster's frames are made of");
        }
        if beams.fires_after_ns.iter().any(|after| *after != 0) {
            return wrong("beams.fires_after_ns", "found beams that fire apart, wanted all at once");
        }
        if beams.height_m.iter().any(|height_m| *height_m != 0.0) {
            return wrong("beams.height_m", "found heights, which Ouster's frames cannot say");
        }
        if beams.elevation_deg.windows(2).any(|pair| pair[0] <= pair[1]) {
            return wrong(
                "beams.elevation_deg",
                "found a beam no lower than the one before, wanted the highest first",
            );
        }
        if self.range.range_step_m != 0.001 {
            return wrong("range.range_step_m", "found another step than the frames' 0.001 m");
        }
        match self.returns.as_slice() {
            [EchoChoice::Dual] | [_, _, ..] if self.returns.contains(&EchoChoice::Dual) => {
                wrong("returns", "found `dual`, of which Ouster's frames hold one echo")
            }
            _ => Ok(()),
        }
    }

    /// How this lidar speaks at a rate with an echo choice.
    pub fn wire(&self, columns: Option<u32>, rate_hz: f64, returns: EchoChoice) -> Wire {
        wire_of(self, columns, rate_hz, returns)
    }
}

fn mode_of(mode: &str) -> Option<(u32, f64)> {
    let (columns, rate_hz) = mode.split_once('x')?;
    let (columns, rate_hz) = (columns.parse().ok()?, rate_hz.parse().ok()?);
    ((1..=65_536).contains(&columns) && rate_hz > 0.0 && rate_hz <= 100.0).then_some((columns, rate_hz))
}
