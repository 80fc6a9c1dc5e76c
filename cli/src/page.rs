//! A session as the report's input.

use crate::failure::Failure;
use crate::session::Session;
use arborloop_base::{Class, planar};
use arborloop_eval::dataset::sha256_hex;
use arborloop_eval::paper;
use arborloop_eval::report::{self, Event, Expectation, Landmark, Lane, ReportInput, SystemReport, Verdict};
use arborloop_worlds::TrunkTruth;
use std::path::Path;

pub(crate) fn render(
    session: &Session,
    resolved: &str,
    reproduce: &[String],
    folder: &Path,
) -> Result<String, Failure> {
    let simulated = session.simulated.as_ref();
    let lanes = simulated.map_or(Vec::new(), |simulated| {
        let lane = |name: &str, unit: &str, points: &[(f64, f64)]| Lane {
            name: name.into(),
            unit: unit.into(),
            points: points.to_vec(),
        };
        vec![lane("tilt of the body", "deg", &simulated.tilt_deg), lane("speed", "m/s", &simulated.speed_mps)]
    });
    let site = published_site(&session.name);
    let mut hashes = Vec::new();
    if simulated.is_some() {
        hashes.push(("scenario".to_owned(), sha256_hex(resolved.as_bytes())));
    }
    if let Some(recorded) = &session.recorded {
        hashes.push(("content".to_owned(), recorded.content_hash.clone()));
    }
    let input = ReportInput {
        title: format!("{}, seed {}, driven by {}", session.name, session.seed, session.driver),
        verdict: Verdict { passed: session.passed(), lines: verdict_lines(session) },
        scenario: session.name.clone(),
        seed: session.seed,
        driver: session.driver.clone(),
        version: env!("CARGO_PKG_VERSION").into(),
        hashes,
        reproduce: reproduce.to_vec(),
        check: checks(session),
        systems: session
            .systems
            .iter()
            .map(|system| SystemReport {
                name: system.name.clone(),
                score: system.score.as_ref().ok().cloned(),
                no_score: system.score.as_ref().err().cloned(),
                map_score: system.map_score,
                map: system.map.clone(),
                truth_from_map: simulated.map_or_else(nalgebra::Isometry2::identity, |simulated| {
                    planar(&simulated.start_from_world.inverse())
                }),
                trajectory: system.trajectory.clone(),
                cpu_ms_per_sweep: system.cpu_ms,
                health: system.health,
            })
            .collect(),
        reference: session.reference.clone(),
        truth_map: simulated.map(|simulated| simulated.truth_map.clone()),
        reference_from_truth: simulated
            .map_or_else(nalgebra::Isometry2::identity, |simulated| planar(&simulated.start_from_world)),
        landmarks: simulated.map_or(Vec::new(), |simulated| simulated.trunks.iter().map(landmark).collect()),
        contacts: simulated.map_or(Vec::new(), |simulated| {
            let events = simulated.outcome.contacts.iter();
            events.map(|event| Event { stamp: event.stamp, text: touch(&event.contact) }).collect()
        }),
        lanes,
        expectations: session
            .findings
            .iter()
            .map(|finding| Expectation {
                system: finding.system.clone(),
                metric: finding.metric.clone(),
                found: finding.found,
                limit: finding.limit.clone(),
                passed: finding.passed,
            })
            .collect(),
        published: site.map_or(Vec::new(), paper::rows_of),
        published_map: (site == Some("cone field")).then_some(paper::CONE_FIELD_MAP),
        realtime_factor: Some(session.realtime_factor),
        files: files(session, folder),
    };
    report::render(&input).map_err(|error| Failure::Internal(error.to_string()))
}

/// Which of the paper's sites a run is the twin of.
pub(crate) fn published_site(name: &str) -> Option<&'static str> {
    let twins = [
        ("cone-field", "cone field"),
        ("citrus", "CitrusFarm"),
        ("vineyard", "Bacchus"),
        ("orchard", "Pullally"),
        ("run1", "Pullally"),
        ("run2", "Pullally"),
    ];
    twins.into_iter().find(|(prefix, _)| name.starts_with(prefix)).map(|(_, site)| site)
}

/// Positions of what stands, world frame.
pub(crate) fn trunks_csv(trunks: &[TrunkTruth]) -> String {
    let mut text = "class,instance,x_m,y_m,radius_m\n".to_owned();
    for trunk in trunks {
        let class = format!("{:?}", trunk.class).to_lowercase();
        text +=
            &format!("{class},{},{:.4},{:.4},{:.4}\n", trunk.instance, trunk.x_m, trunk.y_m, trunk.radius_m);
    }
    text
}

pub(crate) fn verdict_lines(session: &Session) -> Vec<String> {
    let mut lines: Vec<String> = session
        .simulated
        .iter()
        .map(|simulated| {
            let outcome = &simulated.outcome;
            format!(
                "{} after {:.1} s and {:.1} m of the route, {} contact(s)",
                outcome.end,
                outcome.duration.seconds(),
                outcome.progress.distance_m,
                outcome.contacts.len()
            )
        })
        .collect();
    lines.extend(session.damage.iter().map(|damage| format!("the recording breaks off: {damage}")));
    lines.extend(session.findings.iter().filter(|finding| !finding.passed).map(|finding| finding.line()));
    lines
}

fn touch(contact: &arborloop_base::Contact) -> String {
    format!("{} touches {} {}", contact.part, format!("{:?}", contact.class).to_lowercase(), contact.instance)
}

fn landmark(trunk: &TrunkTruth) -> Landmark {
    let noun = match trunk.class {
        Class::Cone => "cone",
        _ => "tree",
    };
    Landmark {
        class: trunk.class,
        label: format!("{noun} {}", trunk.instance),
        x_m: trunk.x_m,
        y_m: trunk.y_m,
        radius_m: trunk.radius_m,
    }
}

fn checks(session: &Session) -> Vec<String> {
    if session.recorded.is_none() {
        return Vec::new();
    }
    let evo = session.systems.iter().map(|system| {
        format!("evo_ape tum gt/gt_base_link.tum est_{}.tum --project_to_plane xy", system.name)
    });
    evo.collect()
}

fn files(session: &Session, folder: &Path) -> Vec<(String, String)> {
    let mut files = vec![("metrics.json".to_owned(), "every number of this page".to_owned())];
    if session.simulated.is_some() {
        files.push(("scenario.resolved.toml".into(), "the scenario with every default".into()));
        files.push(("gt/map.yaml".into(), "true map, 0.15 to 0.75 m above ground".into()));
        files.push(("gt/trunks.csv".into(), "where cones and trunks stand".into()));
    }
    for system in &session.systems {
        files.push((format!("est_{}.tum", system.name), format!("poses of {}", system.name)));
        if system.revised.is_some() {
            let about = format!("path of {} as finally believed", system.name);
            files.push((format!("final_{}.tum", system.name), about));
        }
        if system.map.is_some() {
            files.push((format!("map_{}.yaml", system.name), format!("map of {}", system.name)));
        }
    }
    if session.recorded.is_some() {
        let bag = format!("{}_0.mcap", session.name);
        files.push((bag, "everything recorded; the folder is a rosbag2 recording".into()));
        files.push(("gt/gt_base_link.tum".into(), "true poses at the end of each sweep".into()));
    }
    files.retain(|(name, _)| name == "report.html" || folder.join(name).exists() || name == "metrics.json");
    files
}
