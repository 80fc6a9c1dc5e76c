//! A bar on a terminal, plain lines elsewhere, nothing when quiet; and the user's Ctrl-C.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From now on the first Ctrl-C asks runs to end and write what they have.
pub(crate) fn listen() -> Result<(), crate::Failure> {
    ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed))
        .map_err(|error| crate::Failure::Internal(format!("Ctrl-C cannot be listened to: {error}")))
}

pub(crate) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

pub(crate) enum Progress {
    Bar(ProgressBar),
    Lines { name: String, shown: u64 },
    Quiet,
}

const STEPS: u64 = 1000;

impl Progress {
    pub(crate) fn new(name: &str, quiet: bool) -> Self {
        if quiet {
            return Progress::Quiet;
        }
        if !std::io::stderr().is_terminal() {
            return Progress::Lines { name: name.to_owned(), shown: 0 };
        }
        let style = ProgressStyle::with_template("{prefix} {wide_bar} {percent}% {elapsed} (eta {eta})");
        let bar = ProgressBar::new(STEPS).with_prefix(name.to_owned());
        Progress::Bar(match style {
            Ok(style) => bar.with_style(style),
            Err(_) => bar,
        })
    }

    pub(crate) fn at(&mut self, share: f64) {
        let share = share.clamp(0.0, 1.0);
        match self {
            Progress::Bar(bar) => bar.set_position((share * STEPS as f64) as u64),
            Progress::Lines { name, shown } => {
                let tenths = (share * 10.0) as u64;
                if tenths > *shown {
                    *shown = tenths;
                    eprintln!("{name}: {} %", tenths * 10);
                }
            }
            Progress::Quiet => {}
        }
    }

    pub(crate) fn done(self) {
        if let Progress::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}
