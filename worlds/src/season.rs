//! The time of the year, and how closely foliage is drawn.

use serde::{Deserialize, Serialize};

/// The time of the year. A plant is the same plant all year: branches stay, leaves come and go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Season {
    /// No leaf.
    Leafless,
    /// Young leaves.
    Flush,
    /// Full leaf.
    #[default]
    Full,
    /// Cut back.
    Pruned,
}

/// Leaves as surfaces or as a turbid medium.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Foliage {
    /// Every leaf is a surface of its own.
    #[default]
    Leaves,
    /// The same leaf area in the same outlines as a medium that dims light (Beer-Lambert).
    Turbid,
}

/// What a season makes of a plant in full leaf.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeasonScales {
    /// Leaf area density as a share of the full one.
    pub area_ratio: f64,
    /// Side of a leaf as a share of the full one.
    pub leaf_ratio: f64,
    /// Size of the crown, from its lower end, as a share of the full one.
    pub crown_ratio: f64,
}

impl Season {
    /// Every season, from bare to full and cut back.
    pub const ALL: [Season; 4] = [Season::Leafless, Season::Flush, Season::Full, Season::Pruned];

    /// What it makes of a plant.
    pub fn scales(&self) -> SeasonScales {
        let [area_ratio, leaf_ratio, crown_ratio] = match self {
            Season::Leafless => [0.0, 1.0, 1.0],
            // assumed: some weeks after bud break a third of the leaf area, in leaves of three fifths of the final side.
            Season::Flush => [0.35, 0.6, 0.95],
            Season::Full => [1.0, 1.0, 1.0],
            // assumed: hedging takes a fifth of the size, thinning a quarter of what is left.
            Season::Pruned => [0.75, 1.0, 0.8],
        };
        SeasonScales { area_ratio, leaf_ratio, crown_ratio }
    }
}
