//! `arborloop show`: a scenario with every default, or a robot.

use crate::arguments::{Show, Shown};
use crate::failure::Failure;
use crate::load;
use arborloop_robots::{Robot, go1};
use arborloop_sim::Scenario;
use std::path::Path;

pub(crate) fn show(verb: &Show) -> Result<(), Failure> {
    match &verb.what {
        Shown::Scenario { scenario, set } => {
            let document = load::scenario(scenario, Path::new(""))?.overridden(set)?;
            print!("{}", Scenario::read(&document)?.resolved());
        }
        Shown::Robot { file } => {
            let robot = match file {
                Some(path) => {
                    let text = load::file(path)?;
                    Robot::from_urdf(&text.text, &text.name)?
                }
                None => go1(),
            };
            println!("{}", robot.tree());
        }
    }
    Ok(())
}
