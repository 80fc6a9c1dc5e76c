//! `arborloop run`: one scenario, closed or open loop.

use super::{print, verdict};
use crate::arguments::{Arguments, Format, Run};
use crate::failure::Failure;
use crate::progress::{self, Progress};
use crate::session::{Case, simulate};
use crate::systems::Catalog;
use crate::{load, output};
use arborloop_sim::Scenario;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

pub(crate) fn run(catalog: &Catalog, arguments: &Arguments, verb: &Run) -> Result<(), Failure> {
    let scenario = load::checked(&verb.scenario, Path::new(""), &verb.set)?;
    let seed = verb.seed.unwrap_or(scenario.seed);
    verb.systems.iter().try_for_each(|name| catalog.check(name))?;
    let folder = verb.output.clone().unwrap_or_else(|| {
        [Path::new("runs"), Path::new(&scenario.name), Path::new(&seed.to_string())]
            .iter()
            .collect::<PathBuf>()
    });
    let partial = output::begin(&folder)?;
    let case = Case {
        scenario: &scenario,
        seed,
        systems: &verb.systems,
        specs: &BTreeMap::new(),
        driver: &verb.driver,
        expectations: &verb.expect,
    };
    progress::listen()?;
    let mut progress = Progress::new(&scenario.name, arguments.quiet);
    let recording = (!verb.no_recording).then_some((partial.as_path(), false));
    let session = simulate(catalog, &case, recording, &mut |share| {
        progress.at(share);
        !progress::interrupted()
    })?;
    progress.done();
    let resolved = Scenario { seed, ..scenario.clone() }.resolved();
    output::write(&partial, &session, &resolved, &[reproduce(verb, seed)])?;
    output::settle(&partial, &folder)?;
    print(&session, &resolved, arguments.format);
    if arguments.format == Format::Human {
        println!("report {}", folder.join("report.html").display());
    }
    verdict(&session)
}

fn reproduce(verb: &Run, seed: u64) -> String {
    let mut words = vec!["arborloop run".to_owned(), quoted(&verb.scenario), format!("--seed {seed}")];
    words.extend(verb.set.iter().map(|set| format!("--set {}", quoted(set))));
    words.extend(verb.systems.iter().map(|system| format!("--system {}", quoted(system))));
    words.push(format!("--driver {}", quoted(&verb.driver)));
    words.join(" ")
}

fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=".contains(c);
    if word.chars().all(plain) { word.to_owned() } else { format!("'{}'", word.replace('\'', r"'\''")) }
}
