//! `arborloop gen`: a data set with exact truth, walked by truth, no SLAM.

use crate::arguments::{Arguments, Gen};
use crate::failure::Failure;
use crate::progress::{self, Progress};
use crate::session::{Case, recorder_settings, simulate};
use crate::systems::Catalog;
use crate::{load, page};
use arborloop_base::Seed;
use arborloop_eval::dataset::{Manifest, write_calibration, write_manifest, write_map, write_readme};
use arborloop_sim::{Scenario, Simulator};
use std::collections::BTreeMap;
use std::path::Path;

pub(crate) fn generate(arguments: &Arguments, verb: &Gen) -> Result<(), Failure> {
    let scenario = load::checked(&verb.scenario, Path::new(""), &verb.set)?;
    let seed = verb.seed.unwrap_or(scenario.seed);
    let folder = verb.output.as_path();
    if folder.exists() {
        return Err(Failure::File {
            path: folder.to_owned(),
            action: "make a data set",
            source: std::io::Error::new(
                std::io::ErrorKind::AlreadyExists,
                "found a file or folder, wanted none",
            ),
        });
    }
    let case = Case {
        scenario: &scenario,
        seed,
        systems: &[],
        specs: &BTreeMap::new(),
        driver: "truth",
        expectations: &[],
    };
    progress::listen()?;
    let mut progress = Progress::new(&scenario.name, arguments.quiet);
    let session = simulate(&Catalog::default(), &case, Some((folder, true)), &mut |share| {
        progress.at(share);
        !progress::interrupted()
    })?;
    progress.done();
    let resolved = Scenario { seed, ..scenario.clone() }.resolved();
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(Failure::file(&path, "write"))
    };
    write("scenario.resolved.toml", &resolved)?;
    if let Some(simulated) = &session.simulated {
        write_map(&folder.join("gt/map"), &simulated.truth_map)?;
        write("gt/trunks.csv", &page::trunks_csv(&simulated.trunks))?;
    }
    write_calibration(folder, &recorder_settings(&Simulator::new(&scenario, Seed(seed)), true))?;
    if let Some(recorded) = &session.recorded {
        let manifest = Manifest::new(&scenario.name, seed, &resolved, recorded);
        write_readme(folder, &manifest)?;
        write_manifest(folder, &manifest)?;
        println!("data set {}", folder.display());
        println!("{} messages, {} sweeps, {}", recorded.messages, session.sweeps, recorded.duration);
        println!("content hash {}", recorded.content_hash);
        println!("real-time factor {:.1}", session.realtime_factor);
    }
    if session.interrupted() { Err(Failure::Interrupted) } else { Ok(()) }
}
