//! A lidar that is a file of the user's own, named by a scenario and put into it.

use super::model::LidarModel;
use crate::document::{Document, Refusal};
use serde::Deserialize;

/// The file that a scenario names as its lidar's model; `None` where it names none.
pub fn lidar_file(scenario: &Document) -> Option<String> {
    #[derive(Deserialize)]
    struct Peek {
        lidar: Named,
    }
    #[derive(Deserialize)]
    struct Named {
        model: String,
    }
    let name = scenario.read::<Peek>().ok()?.lidar.model;
    let embedded = super::model::NAMES.contains(&name.as_str());
    (name.ends_with(".toml") && !embedded).then_some(name)
}

/// The scenario with the lidar of a data file in the place of the file's name; everything else keeps its line.
///
/// # Errors
/// What the data file is refused for, at its place in that file.
pub fn with_lidar(scenario: &Document, file: &Document) -> Result<Document, Refusal> {
    let model = LidarModel::read(file)?;
    if LidarModel::embedded(&model.name).is_some_and(|known| known != model) {
        let message =
            format!("found `{}`, which is a lidar that comes with the program, and not this one", model.name);
        return Err(file.refuse("name", message, Some("give it another name".into())));
    }
    scenario.replaced("lidar.model", &model)
}
