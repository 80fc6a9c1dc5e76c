//! `arborloop check`: scenario and suite files, without running them.

use crate::failure::Failure;
use crate::{load, suite};
use arborloop_sim::Document;
use std::path::Path;

pub(crate) fn check(files: &[String]) -> Result<(), Failure> {
    for name in files {
        if suite::EMBEDDED.iter().any(|(known, _)| known == name) {
            suite::read(name)?;
            println!("{name}: a suite, in order");
            continue;
        }
        let document = load::scenario(name, Path::new(""))?;
        if is_suite(&document) {
            let (suite, jobs) = suite::read(name)?;
            println!("{name}: suite `{}`, {} runs, in order", suite.name, jobs.len());
        } else {
            let scenario = load::checked(name, Path::new(""), &[])?;
            println!("{name}: scenario `{}`, in order", scenario.name);
        }
    }
    Ok(())
}

/// A suite is known by its cases; broken TOML is reported as a scenario's.
fn is_suite(document: &Document) -> bool {
    document.read::<toml::Table>().is_ok_and(|table| table.contains_key("case"))
}
