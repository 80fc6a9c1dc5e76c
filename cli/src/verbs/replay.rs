//! `arborloop replay`: systems over a recording, ours or a real one.

use super::{print, verdict};
use crate::arguments::{Arguments, Format, Replay};
use crate::failure::Failure;
use crate::output;
use crate::progress::{self, Progress};
use crate::systems::Catalog;
use arborloop_eval::dataset;
use std::collections::BTreeMap;
use std::path::Path;

pub(crate) fn replay(catalog: &Catalog, arguments: &Arguments, verb: &Replay) -> Result<(), Failure> {
    verb.systems.iter().try_for_each(|name| catalog.check(name))?;
    let recording = dataset::open(&verb.recording)?;
    progress::listen()?;
    let mut progress = Progress::new(recording.name(), arguments.quiet);
    let session = crate::session::replay(
        catalog,
        &recording,
        &verb.systems,
        &BTreeMap::new(),
        &verb.expect,
        &mut |share| {
            progress.at(share);
            !progress::interrupted()
        },
    )?;
    progress.done();
    let folder = verb
        .output
        .clone()
        .unwrap_or_else(|| Path::new("runs").join(format!("replay-{}", session.name)).join("0"));
    let partial = output::begin(&folder)?;
    let systems: Vec<String> = verb.systems.iter().map(|system| format!("--system {system}")).collect();
    let command = format!("arborloop replay {} {}", verb.recording.display(), systems.join(" "));
    output::write(&partial, &session, "", &[command])?;
    output::settle(&partial, &folder)?;
    print(&session, "", arguments.format);
    if arguments.format == Format::Human {
        println!("report {}", folder.join("report.html").display());
    }
    verdict(&session)
}
