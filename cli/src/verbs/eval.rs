//! `arborloop eval`: one file against another, trajectories or maps.

use crate::arguments::{Arguments, Eval, Format};
use crate::failure::Failure;
use arborloop_base::{Pose2, Span};
use arborloop_eval::dataset::{read_map, read_tum};
use arborloop_eval::{MapScoreSettings, ScoreSettings, score, score_map};
use serde::Serialize;

pub(crate) fn eval(arguments: &Arguments, verb: &Eval) -> Result<(), Failure> {
    let what = || format!("{} against {}", verb.estimate.display(), verb.reference.display());
    let yaml = |path: &std::path::Path| path.extension().is_some_and(|e| e == "yaml" || e == "yml");
    if yaml(&verb.reference) && yaml(&verb.estimate) {
        let (truth, map) = (read_map(&verb.reference)?, read_map(&verb.estimate)?);
        let settings = MapScoreSettings { tolerance_m: verb.tolerance_m };
        let score = score_map(&truth, &map, &Pose2::identity(), settings)
            .map_err(|source| Failure::Score { what: what(), source })?;
        print(&score, arguments.format);
        return Ok(());
    }
    let Some(pose_time) = verb.pose_time else {
        return Err(Failure::Usage(
            "the instant of the poses is never guessed: say --pose-time sweep_start, sweep_end or instant"
                .into(),
        ));
    };
    let (reference, estimate) = (read_tum(&verb.reference)?, read_tum(&verb.estimate)?);
    let settings = ScoreSettings {
        has_heading: !verb.no_heading,
        association_max: Span::from_millis(10),
        ..ScoreSettings::new(verb.alignment, pose_time)
    };
    let score =
        score(&reference, &estimate, &settings).map_err(|source| Failure::Score { what: what(), source })?;
    print(&score, arguments.format);
    Ok(())
}

fn print(score: &impl Serialize, format: Format) {
    let value = serde_json::to_value(score).unwrap_or_default();
    match (format, value.as_object()) {
        (Format::Human, Some(rows)) => {
            for (name, value) in rows {
                match value.as_object() {
                    Some(inner) if inner.contains_key("rmse") => {
                        for (statistic, value) in inner {
                            println!("{name}.{statistic} {value}");
                        }
                    }
                    _ => println!("{name} {value}"),
                }
            }
        }
        _ => println!("{value:#}"),
    }
}
