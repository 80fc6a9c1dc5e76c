//! Why a verb did not do what it was asked, the exit code that says so, and how a person reads it.

use arborloop_base::SinkError;
use arborloop_eval::ScoreError;
use arborloop_eval::dataset::DatasetError;
use arborloop_sim::Refusal;
use miette::{LabeledSpan, MietteDiagnostic, NamedSource};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Why a verb stopped.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A scenario or a suite is not what it should be.
    #[error(transparent)]
    Document(#[from] Refusal),
    /// A recording, trajectory or map is not what it should be.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// Two trajectories or maps cannot be compared.
    #[error("{what}: {source}")]
    Score {
        /// The files compared.
        what: String,
        /// Why not.
        source: ScoreError,
    },
    /// A robot's description is not what it should be.
    #[error("{0}")]
    Robot(#[from] arborloop_robots::RobotError),
    /// The command line asks for something that does not exist.
    #[error("{0}")]
    Usage(String),
    /// What a verb was given is not what it should be; names the place, what was found and what was wanted.
    #[error("{0}")]
    Input(String),
    /// Nothing fits what was asked for.
    #[error("{0}")]
    Nothing(String),
    /// The system refuses a file.
    #[error("{}: cannot {action}: {source}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// The system's words.
        source: std::io::Error,
    },
    /// A recorder could not write.
    #[error("the recording stopped: {0}")]
    Recording(SinkError),
    /// Expectations were not met; everything is written.
    #[error("{0}")]
    Expectation(String),
    /// The user interrupted; what there was is written.
    #[error("interrupted")]
    Interrupted,
    /// A mistake of ours.
    #[error("internal error: {0}")]
    Internal(String),
}

impl Failure {
    /// 1 internal, 2 usage, 3 invalid input, 4 nothing selected, 100 expectation failed, 130 interrupted.
    pub fn code(&self) -> u8 {
        match self {
            Failure::Internal(_) | Failure::Recording(_) => 1,
            Failure::Usage(_) => 2,
            Failure::Document(_)
            | Failure::Dataset(_)
            | Failure::Score { .. }
            | Failure::Robot(_)
            | Failure::Input(_)
            | Failure::File { .. } => 3,
            Failure::Nothing(_) => 4,
            Failure::Expectation(_) => 100,
            Failure::Interrupted => 130,
        }
    }

    /// Adapter for `map_err` on files.
    pub(crate) fn file(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Failure {
        let path = path.to_owned();
        move |source| Failure::File { path, action, source }
    }

    /// Prints the failure on standard error and gives the process's exit code.
    pub fn exit(self) -> ExitCode {
        let code = self.code();
        eprintln!("{:?}", shown(&self));
        ExitCode::from(code)
    }
}

/// The failure as a diagnostic, with its place drawn where there is one.
fn shown(failure: &Failure) -> miette::Report {
    let Failure::Document(refusal) = failure else {
        return miette::Report::new(MietteDiagnostic::new(failure.to_string()));
    };
    let mut diagnostic = MietteDiagnostic::new(match refusal.span {
        Some(_) => refusal.message.clone(),
        None => format!("{}: {}", refusal.document.name, refusal.message),
    });
    diagnostic.help.clone_from(&refusal.help);
    if let Some(span) = &refusal.span {
        diagnostic = diagnostic.and_label(LabeledSpan::at(span.clone(), "here"));
    }
    let source =
        NamedSource::new(&refusal.document.name, refusal.document.text.clone()).with_language("toml");
    miette::Report::new(diagnostic).with_source_code(source)
}
