//! `arborloop test`: a suite in parallel, JUnit XML, and every failing run as a folder that reproduces it.

use crate::arguments::{Arguments, Format, Test};
use crate::failure::Failure;
use crate::output;
use crate::progress::{self, Progress};
use crate::session::{Case, Session, simulate};
use crate::stress;
use crate::suite::{self, Job};
use crate::systems::Catalog;
use crate::table::plain_table;
use crate::twins;
use arborloop_eval::OverSeeds;
use arborloop_sim::Scenario;
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

pub(crate) fn test(catalog: &Catalog, arguments: &Arguments, verb: &Test) -> Result<(), Failure> {
    let (suite, mut jobs) = suite::read(&verb.suite)?;
    if let Some(most) = verb.seeds {
        let first = |job: &Job| job.case.seeds.iter().take(most).any(|&seed| seed == job.seed);
        jobs.retain(first);
    }
    for name in suite.cases.iter().flat_map(|case| &case.systems) {
        catalog.check(name)?;
    }
    if let Some(filter) = &verb.filter {
        jobs.retain(|job| job.name.contains(filter.as_str()));
    }
    if jobs.is_empty() {
        return Err(Failure::Nothing(format!("no run of suite `{}` is left by the filter", suite.name)));
    }
    let folder = verb.output.clone().unwrap_or_else(|| Path::new("runs").join(&suite.name));
    std::fs::create_dir_all(&folder).map_err(Failure::file(&folder, "create"))?;
    progress::listen()?;
    let progress = Mutex::new((Progress::new(&suite.name, arguments.quiet), vec![0.0; jobs.len()]));
    let ended: Vec<Result<Session, Failure>> = jobs
        .par_iter()
        .enumerate()
        .map(|(index, job)| {
            let mut tell = |share: f64| {
                if let Ok(mut shared) = progress.lock() {
                    shared.1[index] = share;
                    let whole = shared.1.iter().sum::<f64>() / shared.1.len() as f64;
                    shared.0.at(whole);
                }
                !progress::interrupted()
            };
            let session = one(catalog, &suite.systems, job, &folder, &mut tell);
            tell(1.0);
            session
        })
        .collect();
    if let Ok((progress, _)) = progress.into_inner() {
        progress.done();
    }
    let junit = folder.join("junit.xml");
    let xml = report(&suite.name, &jobs, &ended)
        .to_string()
        .map_err(|error| Failure::Internal(format!("JUnit XML: {error}")))?;
    std::fs::write(&junit, xml).map_err(Failure::file(&junit, "write"))?;
    let tables = [stress::tables(&jobs, &ended), twins::tables(&jobs, &ended)].into_iter().flatten();
    let tables = tables.reduce(|above, below| format!("{above}\n{below}"));
    let page = folder.join("tables.md");
    if let Some(tables) = &tables {
        std::fs::write(&page, tables).map_err(Failure::file(&page, "write"))?;
    }
    match arguments.format {
        Format::Human => {
            print!("{}", summary(&jobs, &ended));
            if let Some(tables) = &tables {
                println!("{tables}tables {}", page.display());
            }
            println!("junit {}", junit.display());
        }
        Format::Json => print!("{}", as_json(&jobs, &ended)),
    }
    let failed = ended.iter().filter(|session| !session.as_ref().is_ok_and(Session::passed)).count();
    if progress::interrupted() {
        return Err(Failure::Interrupted);
    }
    if failed > 0 {
        return Err(Failure::Expectation(format!("{failed} of {} runs failed", ended.len())));
    }
    Ok(())
}

fn one(
    catalog: &Catalog,
    specs: &BTreeMap<String, crate::SystemSpec>,
    job: &Job,
    folder: &Path,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Session, Failure> {
    let case = Case {
        scenario: &job.scenario,
        seed: job.seed,
        systems: &job.case.systems,
        specs,
        driver: &job.case.driver,
        expectations: &job.case.expect,
    };
    let session = simulate(catalog, &case, None, go_on)?;
    let resolved = Scenario { seed: job.seed, ..job.scenario.clone() }.resolved();
    output::write(&place(folder, job), &session, &resolved, &[reproduce(job, folder)])?;
    Ok(session)
}

/// `<suite folder>/<case>/<seed>`.
fn place(folder: &Path, job: &Job) -> PathBuf {
    let case = job.name.split_once('/').map_or(job.name.as_str(), |(_, case)| case);
    folder.join(case).join(job.seed.to_string())
}

fn reproduce(job: &Job, folder: &Path) -> String {
    let systems: Vec<String> = job.case.systems.iter().map(|system| format!("--system {system}")).collect();
    let scenario = place(folder, job).join("scenario.resolved.toml");
    format!("arborloop run {} {} --driver {}", scenario.display(), systems.join(" "), job.case.driver)
}

fn report(name: &str, jobs: &[Job], ended: &[Result<Session, Failure>]) -> Report {
    let mut suite = TestSuite::new(name);
    for (job, session) in jobs.iter().zip(ended) {
        let status = match session {
            Ok(session) if session.passed() => TestCaseStatus::success(),
            Ok(session) => {
                let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
                let failed =
                    session.findings.iter().filter(|finding| !finding.passed).map(|finding| finding.line());
                status.set_message(failed.collect::<Vec<_>>().join("; "));
                status
            }
            Err(failure) => {
                let mut status = TestCaseStatus::non_success(NonSuccessKind::Error);
                status.set_message(failure.to_string());
                status
            }
        };
        let mut case = TestCase::new(format!("{} seed {}", job.name, job.seed), status);
        case.set_classname(&job.scenario.name);
        suite.add_test_case(case);
    }
    let mut report = Report::new("arborloop");
    report.add_test_suite(suite);
    report
}

/// Mean and worst over seeds for each case and system.
fn summary(jobs: &[Job], ended: &[Result<Session, Failure>]) -> String {
    let mut table = plain_table();
    table.set_header([
        "case",
        "system",
        "seeds",
        "position mean (m)",
        "worst",
        "heading mean (deg)",
        "worst",
        "loop (m)",
        "worst",
        "ATE (m)",
        "CPU (ms)",
        "contacts",
        "failed",
    ]);
    let mut groups: BTreeMap<(&str, usize), Vec<usize>> = BTreeMap::new();
    for (index, job) in jobs.iter().enumerate() {
        for system in 0..job.case.systems.len() {
            groups.entry((job.name.as_str(), system)).or_default().push(index);
        }
    }
    for ((name, system), members) in groups {
        let sessions: Vec<&Session> =
            members.iter().filter_map(|&index| ended[index].as_ref().ok()).collect();
        let over = |pick: &dyn Fn(&Session) -> Option<f64>| {
            OverSeeds::of(&sessions.iter().filter_map(|session| pick(session)).collect::<Vec<_>>())
        };
        let score = |session: &Session| session.systems[system].score.as_ref().ok().cloned();
        let position = over(&|session| Some(score(session)?.position_mean_m));
        let heading = over(&|session| score(session)?.heading_mean_deg);
        let loop_m = over(&|session| Some(score(session)?.loop_m));
        let ate = over(&|session| Some(score(session)?.ape_se2?.rmse));
        let cpu = over(&|session| Some(session.systems[system].cpu_ms?.mean));
        let show =
            |value: Option<f64>, decimals: usize| value.map_or("n/a".into(), |v| format!("{v:.decimals$}"));
        let contacts: usize =
            sessions.iter().filter_map(|s| s.simulated.as_ref()).map(|s| s.outcome.contacts.len()).sum();
        let failed =
            members.iter().filter(|&&index| !ended[index].as_ref().is_ok_and(Session::passed)).count();
        table.add_row([
            name.to_owned(),
            jobs[members[0]].case.systems[system].clone(),
            members.len().to_string(),
            show(position.map(|o| o.mean), 4),
            show(position.map(|o| o.max), 4),
            show(heading.map(|o| o.mean), 3),
            show(heading.map(|o| o.max), 3),
            show(loop_m.map(|o| o.mean), 4),
            show(loop_m.map(|o| o.max), 4),
            show(ate.map(|o| o.mean), 4),
            show(cpu.map(|o| o.mean), 2),
            contacts.to_string(),
            failed.to_string(),
        ]);
    }
    let mut text = format!("{table}\n");
    for (job, session) in jobs.iter().zip(ended) {
        match session {
            Ok(session) => {
                for finding in session.findings.iter().filter(|finding| !finding.passed) {
                    text += &format!("FAILED {} seed {}: {}\n", job.name, job.seed, finding.line());
                }
            }
            Err(failure) => text += &format!("ERROR {} seed {}: {failure}\n", job.name, job.seed),
        }
    }
    text
}

fn as_json(jobs: &[Job], ended: &[Result<Session, Failure>]) -> String {
    let runs: Vec<serde_json::Value> = jobs
        .iter()
        .zip(ended)
        .map(|(job, session)| match session {
            Ok(session) => {
                let resolved = Scenario { seed: job.seed, ..job.scenario.clone() }.resolved();
                serde_json::from_str(&output::metrics(session, &resolved)).unwrap_or_default()
            }
            Err(failure) => {
                serde_json::json!({ "name": job.name, "seed": job.seed, "error": failure.to_string() })
            }
        })
        .collect();
    format!("{:#}\n", serde_json::Value::Array(runs))
}
