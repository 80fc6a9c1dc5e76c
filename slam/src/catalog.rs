//! Systems by name, with settings from any serde source.

use crate::aloam::Aloam;
use crate::aloam::settings::AloamSettings;
use crate::icp2d::Icp2d;
use crate::icp2d::settings::Icp2dSettings;
use crate::mhd::Mhd;
use crate::mhd::settings::MhdSettings;
use crate::paper::MhdPaper;
use crate::paper::settings::MhdPaperSettings;
use crate::rig::Rig;
use crate::still::{Still, StillSettings};
use arborloop_base::Slam;
use serde::Deserialize;
use serde::de::Error as _;

/// The names that [`build`] knows, best first.
pub const NAMES: &[&str] = &["mhd", "mhd-paper", "aloam", "icp2d", "still"];

/// Why no system could be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BuildError<E> {
    /// No system has this name.
    #[error("no system is called `{found}`; known are {known:?}")]
    Unknown {
        /// The name asked for.
        found: String,
        /// The names that exist.
        known: &'static [&'static str],
    },
    /// The settings hold an unknown key, a wrong type or an impossible value.
    #[error("{0}")]
    Settings(E),
}

/// Builds a system by name. `settings` is a table of the system's keys; absent keys take their defaults.
///
/// # Errors
/// [`BuildError::Unknown`] for a name outside [`NAMES`]; [`BuildError::Settings`] for an unknown key, a wrong type
/// or a value outside its bounds.
pub fn build<'de, D: serde::Deserializer<'de>>(
    name: &str,
    settings: D,
    rig: &Rig,
) -> Result<Box<dyn Slam>, BuildError<D::Error>> {
    let refuse = |reason: String| BuildError::Settings(D::Error::custom(reason));
    match name {
        "mhd" => {
            let settings = MhdSettings::deserialize(settings).map_err(BuildError::Settings)?;
            settings.check().map_err(refuse)?;
            Ok(Box::new(Mhd::new(settings, rig)))
        }
        "mhd-paper" => {
            let settings = MhdPaperSettings::deserialize(settings).map_err(BuildError::Settings)?;
            settings.check().map_err(refuse)?;
            Ok(Box::new(MhdPaper::new(settings, rig)))
        }
        "aloam" => {
            let settings = AloamSettings::deserialize(settings).map_err(BuildError::Settings)?;
            settings.check().map_err(refuse)?;
            Ok(Box::new(Aloam::new(settings, rig)))
        }
        "icp2d" => {
            let settings = Icp2dSettings::deserialize(settings).map_err(BuildError::Settings)?;
            settings.check().map_err(refuse)?;
            Ok(Box::new(Icp2d::new(settings, rig)))
        }
        "still" => {
            StillSettings::deserialize(settings).map_err(BuildError::Settings)?;
            Ok(Box::new(Still))
        }
        _ => Err(BuildError::Unknown { found: name.to_owned(), known: NAMES }),
    }
}

/// Builds a system by name with its default settings; `None` for a name outside [`NAMES`].
pub fn build_default(name: &str, rig: &Rig) -> Option<Box<dyn Slam>> {
    match name {
        "mhd" => Some(Box::new(Mhd::new(MhdSettings::default(), rig))),
        "mhd-paper" => Some(Box::new(MhdPaper::new(MhdPaperSettings::default(), rig))),
        "aloam" => Some(Box::new(Aloam::new(AloamSettings::default(), rig))),
        "icp2d" => Some(Box::new(Icp2d::new(Icp2dSettings::default(), rig))),
        "still" => Some(Box::new(Still)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn built(name: &str, text: &str) -> Result<(), String> {
        let table: toml::Table = text.parse().unwrap();
        build(name, table, &Rig::default()).map(|_| ()).map_err(|error| error.to_string())
    }

    #[test]
    fn every_name_builds_from_an_empty_table_and_by_default() {
        for name in NAMES {
            assert_eq!(built(name, ""), Ok(()));
            assert!(build_default(name, &Rig::default()).is_some());
        }
        assert!(build_default("loam", &Rig::default()).is_none());
    }

    #[test]
    fn an_unknown_name_or_key_or_an_impossible_value_is_refused_by_name() {
        assert!(built("loam", "").unwrap_err().contains("mhd-paper"));
        for name in NAMES {
            assert!(built(name, "wheel_m = 1.0").unwrap_err().contains("wheel_m"));
        }
        for name in ["mhd", "mhd-paper", "icp2d"] {
            assert!(built(name, "cell_m = 0.0").unwrap_err().contains("cell_m"));
            assert!(built(name, "cell_m = nan").unwrap_err().contains("cell_m"));
            assert!(built(name, "cell_m = \"wide\"").is_err());
        }
        assert!(built("aloam", "edge_voxel_m = -0.2").unwrap_err().contains("edge_voxel_m"));
    }
}
