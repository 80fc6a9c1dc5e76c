//! What a scenario says of its lidar: the model, and what differs from the model's own figures.

use super::footprint::PATTERNS;
use super::model::{EchoChoice, LidarModel, NAMES};
use crate::scenario::{Wrong, whole_ticks, within};
use arborloop_base::{Span, Wire};
use serde::de::value::MapAccessDeserializer;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// What the lidar is set to. Values that a scenario leaves out are the model's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "LidarText")]
pub struct LidarSpec {
    /// Turns a second.
    pub rate_hz: f64,
    /// Firings of each beam in a turn, of a lidar whose turn sets them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns: Option<u32>,
    /// Which echoes are reported.
    pub returns: EchoChoice,
    /// Rays that stand for one beam's footprint: 1, 5, 7, 19 or 37.
    pub sub_rays: u32,
    /// Nearer surfaces give no return, meters.
    pub range_m_min: f64,
    /// Farther surfaces give no return, meters.
    pub range_m_max: f64,
    /// Range at which a target of 10 % reflectance that faces the beam and fills it is just seen, meters.
    pub reach_m: f64,
    /// Standard deviation of the range of a strong echo, meters.
    pub range_noise_m: f64,
    /// The same of an echo that is just seen, as multiple of the strong echo's.
    pub weak_noise_ratio: f64,
    /// Share of returns that get lost.
    pub dropout_ratio: f64,
    /// Which lidar: written by name where it comes with the program, else in full.
    #[serde(serialize_with = "by_name")]
    pub model: LidarModel,
}

/// The table as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LidarText {
    #[serde(default)]
    model: ModelText,
    rate_hz: Option<f64>,
    columns: Option<u32>,
    returns: Option<EchoChoice>,
    sub_rays: Option<u32>,
    range_m_min: Option<f64>,
    range_m_max: Option<f64>,
    reach_m: Option<f64>,
    range_noise_m: Option<f64>,
    weak_noise_ratio: Option<f64>,
    dropout_ratio: Option<f64>,
}

/// A model by name, or in full.
#[derive(Debug)]
struct ModelText(LidarModel);

impl Default for ModelText {
    fn default() -> Self {
        ModelText(LidarModel::embedded("vlp16").expect("the embedded models are read by this crate's tests"))
    }
}

impl<'de> Deserialize<'de> for ModelText {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ModelVisitor)
    }
}

struct ModelVisitor;

impl<'de> serde::de::Visitor<'de> for ModelVisitor {
    type Value = ModelText;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the name of a lidar, a .toml file that describes one, or the description itself")
    }

    fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<ModelText, E> {
        match LidarModel::embedded(name) {
            Some(model) => Ok(ModelText(model)),
            None if name.ends_with(".toml") => {
                Err(E::custom(format!("found no file `{name}` beside the scenario or in this folder")))
            }
            None => Err(E::unknown_variant(name, NAMES)),
        }
    }

    fn visit_map<A: serde::de::MapAccess<'de>>(self, map: A) -> Result<ModelText, A::Error> {
        let model = LidarModel::deserialize(MapAccessDeserializer::new(map))?;
        Ok(ModelText(model.filled()))
    }
}

fn by_name<S: Serializer>(model: &LidarModel, serializer: S) -> Result<S::Ok, S::Error> {
    match LidarModel::embedded(&model.name) {
        Some(known) if known == *model => serializer.serialize_str(&model.name),
        _ => model.serialize(serializer),
    }
}

impl From<LidarText> for LidarSpec {
    fn from(text: LidarText) -> Self {
        let own = LidarSpec::of(text.model.0);
        LidarSpec {
            rate_hz: text.rate_hz.unwrap_or(own.rate_hz),
            columns: text.columns.or(own.columns),
            returns: text.returns.unwrap_or(own.returns),
            sub_rays: text.sub_rays.unwrap_or(own.sub_rays),
            range_m_min: text.range_m_min.unwrap_or(own.range_m_min),
            range_m_max: text.range_m_max.unwrap_or(own.range_m_max),
            reach_m: text.reach_m.unwrap_or(own.reach_m),
            range_noise_m: text.range_noise_m.unwrap_or(own.range_noise_m),
            weak_noise_ratio: text.weak_noise_ratio.unwrap_or(own.weak_noise_ratio),
            dropout_ratio: text.dropout_ratio.unwrap_or(own.dropout_ratio),
            model: own.model,
        }
    }
}

impl Default for LidarSpec {
    /// A VLP-16.
    fn default() -> Self {
        LidarSpec::of(ModelText::default().0)
    }
}

impl LidarSpec {
    /// A lidar with its model's own figures, one ray a beam and one return in a hundred lost.
    pub fn of(model: LidarModel) -> Self {
        LidarSpec {
            rate_hz: model.turn.rate_hz,
            columns: model.turn.columns,
            returns: model.returns.first().copied().unwrap_or(EchoChoice::Strongest),
            sub_rays: 1,
            range_m_min: model.range.range_m_min,
            range_m_max: model.range.range_m_max,
            reach_m: model.range.reach_m,
            range_noise_m: model.range.range_noise_m,
            weak_noise_ratio: model.range.weak_noise_ratio,
            dropout_ratio: 0.01,
            model,
        }
    }

    /// How it speaks.
    pub fn wire(&self) -> Wire {
        self.model.wire(self.columns, self.rate_hz, self.returns)
    }

    pub(crate) fn check(&self, tick: Span) -> Result<(), Wrong> {
        let model = &self.model;
        let wrong = |path: &str, message: String| Err(Wrong { path: path.into(), message });
        model.check().map_err(|wrong| Wrong { path: format!("lidar.model.{}", wrong.path), ..wrong })?;
        if let (Some(slowest), Some(fastest)) = (model.turn.rate_hz_min, model.turn.rate_hz_max) {
            within("lidar.rate_hz", self.rate_hz, slowest, fastest)?;
        }
        match (self.columns, model.turn.columns) {
            (Some(columns), Some(_)) if !model.modes().contains(&(columns, self.rate_hz)) => {
                let modes = model.turn.modes.join(", ");
                let found = format!(
                    "found {columns}x{}, wanted one of the {}'s modes {modes}",
                    self.rate_hz, model.name
                );
                return wrong("lidar.columns", found);
            }
            (Some(_), None) => {
                return wrong(
                    "lidar.columns",
                    format!("found columns, which a turn of the {} has not", model.name),
                );
            }
            _ => {}
        }
        whole_ticks("lidar.rate_hz", self.rate_hz, tick)?;
        if !model.returns.contains(&self.returns) {
            let message = format!("found `{}`, wanted one of {}", word(self.returns), words(&model.returns));
            return wrong("lidar.returns", format!("{message} (what the {} can say)", model.name));
        }
        if !PATTERNS.contains(&self.sub_rays) {
            return wrong("lidar.sub_rays", format!("found {}, wanted one of {PATTERNS:?}", self.sub_rays));
        }
        let farthest = model.range.range_m_max;
        if self.range_m_max > farthest {
            let message =
                format!("found {}, which exceeds the {}'s {farthest} m", self.range_m_max, model.name);
            return wrong("lidar.range_m_max", message);
        }
        within("lidar.range_m_min", self.range_m_min, 0.0, farthest)?;
        within("lidar.range_m_max", self.range_m_max, self.range_m_min, farthest)?;
        within("lidar.reach_m", self.reach_m, 0.1, 1e6)?;
        within("lidar.range_noise_m", self.range_noise_m, 0.0, 10.0)?;
        within("lidar.weak_noise_ratio", self.weak_noise_ratio, 1.0, 1000.0)?;
        within("lidar.dropout_ratio", self.dropout_ratio, 0.0, 1.0)
    }
}

/// An echo choice as it is written.
pub(super) fn word(choice: EchoChoice) -> &'static str {
    match choice {
        EchoChoice::First => "first",
        EchoChoice::Last => "last",
        EchoChoice::Strongest => "strongest",
        EchoChoice::Dual => "dual",
    }
}

fn words(choices: &[EchoChoice]) -> String {
    choices.iter().map(|choice| word(*choice)).collect::<Vec<_>>().join(", ")
}
