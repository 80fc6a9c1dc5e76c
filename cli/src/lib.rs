//! The front door: every verb of the binary, and the library through which a stranger adds a system.
//!
//! A binary of your own gets every verb with your system in the catalog:
//!
//! ```no_run
//! use arborloop::base::{Estimate, Health, Observation, Pose, Slam};
//!
//! struct Mine;
//! impl Slam for Mine {
//!     fn observe(&mut self, observation: &Observation) -> Option<Estimate> {
//!         let Observation::Sweep(sweep) = observation else { return None };
//!         Some(Estimate { stamp: sweep.end, map_from_base: Pose::identity(), covariance: None, health: Health::Lost })
//!     }
//! }
//!
//! fn main() -> std::process::ExitCode {
//!     let mut catalog = arborloop::Catalog::default();
//!     catalog.add("mine", Box::new(|_base_from_lidar| Box::new(Mine)));
//!     arborloop::main_with(catalog)
//! }
//! ```
//!
//! In a plain test, [`scenario`] runs one and asserts what came of it.

mod arguments;
mod expect;
mod experiment;
mod failure;
mod load;
mod metric;
mod output;
mod page;
mod progress;
mod render;
mod session;
mod stress;
mod suite;
mod systems;
mod table;
mod trace;
mod twins;
mod verbs;

pub use arborloop_base as base;
pub use arborloop_eval as eval;
pub use arborloop_sim as sim;
pub use expect::{Expect, Finding};
pub use experiment::{Experiment, Summary, scenario};
pub use failure::Failure;
pub use suite::{Suite, SuiteCase, Vary};
pub use systems::{Builder, Catalog, SystemSpec};

use clap::Parser;
use std::process::ExitCode;

/// Runs the command line with a catalog of systems.
pub fn main_with(catalog: Catalog) -> ExitCode {
    let arguments = arguments::Arguments::parse();
    match verbs::run(&catalog, &arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.exit(),
    }
}
