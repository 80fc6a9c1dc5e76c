//! Files and embedded documents by the name that a user gives.

use crate::failure::Failure;
use arborloop_sim::sensor::lidar::{lidar_file, with_lidar};
use arborloop_sim::{Document, Refusal, Scenario};
use std::path::Path;

/// A text file as a document.
pub(crate) fn file(path: &Path) -> Result<Document, Failure> {
    let bytes = std::fs::read(path).map_err(Failure::file(path, "read"))?;
    let name = path.display().to_string();
    match String::from_utf8(bytes) {
        Ok(text) => Ok(Document::new(name, text)),
        Err(error) => Err(Failure::Document(Refusal {
            document: Document::new(name, ""),
            span: None,
            message: format!("byte {} is no UTF-8; wanted a TOML text", error.utf8_error().valid_up_to()),
            help: None,
        })),
    }
}

/// A scenario: a path, a file beside `beside`, or the name of an embedded one.
pub(crate) fn scenario(name: &str, beside: &Path) -> Result<Document, Failure> {
    let here = Path::new(name);
    if here.is_file() {
        return file(here);
    }
    let there = beside.join(name);
    if there.is_file() {
        return file(&there);
    }
    if here.extension().is_some_and(|extension| extension == "toml") {
        return file(here);
    }
    Ok(Scenario::embedded(name)?)
}

/// A scenario with values put over its own, read and checked; a lidar of the user's own is looked for beside the
/// scenario, then in this folder.
pub(crate) fn checked(name: &str, beside: &Path, set: &[String]) -> Result<Scenario, Failure> {
    let document = scenario(name, beside)?.overridden(set)?;
    let Some(lidar) = lidar_file(&document) else { return Ok(Scenario::read(&document)?) };
    let named = Path::new(name);
    let scenario_file = if named.is_file() { named.to_owned() } else { beside.join(name) };
    let found = scenario_file.parent().unwrap_or(Path::new("")).join(&lidar);
    let found = if found.is_file() { found } else { Path::new(&lidar).to_owned() };
    if !found.is_file() {
        // The scenario's own refusal shows where the file is named.
        return Ok(Scenario::read(&document)?);
    }
    Ok(Scenario::read(&with_lidar(&document, &file(&found)?)?)?)
}
