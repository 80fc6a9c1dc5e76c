//! The run folder: estimates, maps, metrics, findings, the page and, where a recording was made, its manifest.

use crate::failure::Failure;
use crate::page;
use crate::session::Session;
use arborloop_eval::dataset::{Manifest, sha256_hex, write_manifest, write_map, write_tum};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Writes everything but the recording, which is there already.
pub(crate) fn write(
    folder: &Path,
    session: &Session,
    resolved: &str,
    reproduce: &[String],
) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).map_err(Failure::file(folder, "create"))?;
    for system in &session.systems {
        write_tum(&folder.join(format!("est_{}.tum", system.name)), &system.trajectory)?;
        if let Some(revised) = &system.revised {
            write_tum(&folder.join(format!("final_{}.tum", system.name)), revised)?;
        }
        if let Some(map) = &system.map {
            write_map(&folder.join(format!("map_{}", system.name)), map)?;
        }
    }
    if let Some(simulated) = &session.simulated {
        text(&folder.join("scenario.resolved.toml"), resolved)?;
        std::fs::create_dir_all(folder.join("gt")).map_err(Failure::file(folder, "create"))?;
        write_map(&folder.join("gt/map"), &simulated.truth_map)?;
        text(&folder.join("gt/trunks.csv"), &page::trunks_csv(&simulated.trunks))?;
    }
    if let Some(recorded) = &session.recorded {
        write_manifest(folder, &Manifest::new(&session.name, session.seed, resolved, recorded))?;
    }
    text(&folder.join("metrics.json"), &metrics(session, resolved))?;
    let html = page::render(session, resolved, reproduce, folder)?;
    text(&folder.join("report.html"), &html)
}

/// The numbers of a run as JSON. Computing times are left out: they differ from run to run.
pub(crate) fn metrics(session: &Session, resolved: &str) -> String {
    let systems: Vec<_> = session
        .systems
        .iter()
        .map(|system| {
            json!({
                "name": system.name,
                "score": system.score.as_ref().ok(),
                "no_score": system.score.as_ref().err(),
                "map": system.map_score,
                "health": {
                    "tracking": system.health.tracking,
                    "degraded": system.health.degraded,
                    "lost": system.health.lost,
                },
            })
        })
        .collect();
    let value = json!({
        "tool_version": env!("CARGO_PKG_VERSION"),
        "name": session.name,
        "seed": session.seed,
        "driver": session.driver,
        "sweeps": session.sweeps,
        "passed": session.passed(),
        "damage": session.damage,
        "findings": session.findings,
        "scenario_sha256": session.simulated.as_ref().map(|_| sha256_hex(resolved.as_bytes())),
        "content_sha256": session.recorded.as_ref().map(|recorded| &recorded.content_hash),
        "systems": systems,
    });
    format!("{value:#}\n")
}

fn text(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(Failure::file(path, "write"))
}

/// A fresh folder `<final>.partial` to write into; [`settle`] gives it its name when all is there.
pub(crate) fn begin(folder: &Path) -> Result<PathBuf, Failure> {
    let mut name = folder.file_name().map(std::ffi::OsStr::to_os_string).unwrap_or_default();
    name.push(".partial");
    let partial = folder.with_file_name(name);
    if partial.exists() {
        std::fs::remove_dir_all(&partial).map_err(Failure::file(&partial, "clear"))?;
    }
    std::fs::create_dir_all(&partial).map_err(Failure::file(&partial, "create"))?;
    Ok(partial)
}

/// Puts a complete folder in the place of an earlier one, and points `latest` at it.
pub(crate) fn settle(partial: &Path, folder: &Path) -> Result<(), Failure> {
    if folder.exists() {
        std::fs::remove_dir_all(folder).map_err(Failure::file(folder, "replace"))?;
    }
    std::fs::rename(partial, folder).map_err(Failure::file(folder, "name"))?;
    #[cfg(unix)]
    if let (Some(parent), Some(name)) = (folder.parent(), folder.file_name()) {
        let latest = parent.join("latest");
        if latest.is_symlink() {
            std::fs::remove_file(&latest).map_err(Failure::file(&latest, "replace"))?;
        }
        std::os::unix::fs::symlink(name, &latest).map_err(Failure::file(&latest, "link"))?;
    }
    Ok(())
}
