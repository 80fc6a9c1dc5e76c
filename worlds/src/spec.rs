//! What a scenario may say about its world: plain values with units in their names, defaults with their source, limits.

mod citrus;
mod cones;
mod forest;
mod ground;
mod orchard;
mod plants;
mod surroundings;
mod table;
mod vineyard;

pub use citrus::CitrusSpec;
pub use cones::ConesSpec;
pub use forest::{ForestSpec, StandSpec, UndergrowthSpec};
pub use ground::{GrassSpec, TerrainSpec};
pub use orchard::OrchardSpec;
pub use plants::{CrownSpec, LeavesSpec, RowsSpec, TrunkSpec};
pub use surroundings::SurroundingsSpec;
pub use vineyard::{TrellisSpec, VineyardSpec};

use crate::wind::WindSpec;
use serde::{Deserialize, Serialize};

/// The world of a scenario.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq, Default)]
#[serde(deny_unknown_fields, default)]
pub struct WorldSpec {
    /// The ground.
    pub terrain: TerrainSpec,
    /// The grass on it.
    pub grass: GrassSpec,
    /// What the robot walks among.
    pub planting: Planting,
    /// The ring of trees and bushes far around.
    pub surroundings: SurroundingsSpec,
    /// What moves the leaves.
    pub wind: WindSpec,
}

/// What the robot walks among.
#[derive(Serialize, Deserialize, Debug, Clone, PartialEq)]
#[serde(tag = "kind", rename_all = "snake_case", from = "PlantingText")]
pub enum Planting {
    /// Traffic cones around a walked rectangle, the paper's controlled experiment.
    Cones(ConesSpec),
    /// Hedged citrus in rows, CitrusFarm's field 2.
    Citrus(CitrusSpec),
    /// Fruit trees in rows, Pullally.
    Orchard(OrchardSpec),
    /// Vines on a trellis, Bacchus.
    Vineyard(VineyardSpec),
    /// Scattered trees and undergrowth.
    Forest(ForestSpec),
    /// Nothing.
    None,
}

/// [`Planting`] as read: serde lets a unit variant pass with any keys beside its tag, an empty struct refuses them.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum PlantingText {
    Cones(ConesSpec),
    Citrus(CitrusSpec),
    Orchard(OrchardSpec),
    Vineyard(VineyardSpec),
    Forest(ForestSpec),
    None {},
}

impl From<PlantingText> for Planting {
    fn from(text: PlantingText) -> Self {
        match text {
            PlantingText::Cones(field) => Planting::Cones(field),
            PlantingText::Citrus(grove) => Planting::Citrus(grove),
            PlantingText::Orchard(orchard) => Planting::Orchard(orchard),
            PlantingText::Vineyard(vineyard) => Planting::Vineyard(vineyard),
            PlantingText::Forest(forest) => Planting::Forest(forest),
            PlantingText::None {} => Planting::None,
        }
    }
}

impl Default for Planting {
    fn default() -> Self {
        Planting::Cones(ConesSpec::default())
    }
}

/// A value that no world can be grown from.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{key} is {found}, wanted {wanted}")]
pub struct SpecError {
    /// Dotted path below `[world]`, for instance `terrain.slope_deg`.
    pub key: String,
    /// The value found.
    pub found: String,
    /// What would do.
    pub wanted: String,
}

/// Most leaves that one prototype may have.
const LEAVES_MAX: f64 = 200_000.0;
/// Most objects of one kind.
const COUNT_MAX: usize = 10_000;

impl WorldSpec {
    /// Whether a world can be grown from these values; the first that is not finite or out of range otherwise.
    pub fn check(&self) -> Result<(), SpecError> {
        self.terrain.check()?;
        self.grass.check()?;
        self.planting.check()?;
        self.surroundings.check()?;
        self.wind.check()
    }
}

impl Planting {
    /// Whether every value is finite and in its range.
    pub fn check(&self) -> Result<(), SpecError> {
        match self {
            Planting::Cones(field) => field.check(),
            Planting::Citrus(grove) => grove.check(),
            Planting::Orchard(orchard) => orchard.check(),
            Planting::Vineyard(vineyard) => vineyard.check(),
            Planting::Forest(forest) => forest.check(),
            Planting::None => Ok(()),
        }
    }
}

fn error(table: &str, key: &str, found: impl ToString, wanted: String) -> SpecError {
    SpecError { key: format!("{table}.{key}"), found: found.to_string(), wanted }
}

/// A number that is not finite is in no range.
pub(crate) fn within(table: &str, key: &str, value: f64, low: f64, high: f64) -> Result<(), SpecError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(error(table, key, value, format!("a number from {low} to {high}")))
}

fn at_most(table: &str, key: &str, value: usize, most: usize) -> Result<(), SpecError> {
    if value <= most { Ok(()) } else { Err(error(table, key, value, format!("{most} at most"))) }
}
