//! What can be wrong with a file, said with its name, the place, what was found and what was wanted.

use std::fmt;
use std::path::{Path, PathBuf};

/// Where in a file something is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A line, counted from one.
    Line(usize),
    /// A named field, key or array.
    Field(String),
    /// A message of a topic, counted from zero.
    Message {
        /// The topic.
        topic: String,
        /// Which message of that topic, counted from zero.
        index: u64,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Whole => Ok(()),
            Place::Line(line) => write!(f, ":{line}"),
            Place::Field(name) => write!(f, ", field `{name}`"),
            Place::Message { topic, index } => write!(f, ", message {index} of {topic}"),
        }
    }
}

/// Why a data set cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// The system refuses the file.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried: `open`, `read`, `write`, `create`.
        action: &'static str,
        /// What the system says.
        source: std::io::Error,
    },
    /// The content is not what the format asks for.
    #[error("{}{place}: found {found}; wanted {wanted}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// What is there.
        found: String,
        /// What should be there.
        wanted: String,
    },
    /// An MCAP ends early or is damaged; everything before the place was delivered.
    #[error("{}: {what} after {messages} readable messages; wanted a complete MCAP", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
        /// How many messages could be read before.
        messages: u64,
    },
    /// A record cannot be written as a ROS message.
    #[error("{}: cannot record {what}: found {found}; wanted {wanted}", path.display())]
    Record {
        /// The recording.
        path: PathBuf,
        /// The record.
        what: &'static str,
        /// What was given.
        found: String,
        /// What can be written.
        wanted: String,
    },
}

impl DatasetError {
    /// Content at a place of a file that is not what was wanted.
    pub(super) fn content(
        path: &Path,
        place: Place,
        found: impl Into<String>,
        wanted: impl Into<String>,
    ) -> Self {
        DatasetError::Content { path: path.to_owned(), place, found: found.into(), wanted: wanted.into() }
    }

    /// The same for a file as a whole.
    pub(super) fn whole(path: &Path, found: impl Into<String>, wanted: impl Into<String>) -> Self {
        DatasetError::content(path, Place::Whole, found, wanted)
    }

    /// Adapter for `map_err` on input and output.
    pub(super) fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| DatasetError::Io { path, action, source }
    }
}

/// Content that a decoder refuses before it knows in which file it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Refusal {
    /// What is there.
    pub(super) found: String,
    /// What should be there.
    pub(super) wanted: String,
}

impl Refusal {
    /// Found this, wanted that.
    pub(super) fn new(found: impl Into<String>, wanted: impl Into<String>) -> Self {
        Refusal { found: found.into(), wanted: wanted.into() }
    }

    /// The refusal with its place.
    pub(super) fn at(self, path: &Path, place: Place) -> DatasetError {
        DatasetError::Content { path: path.to_owned(), place, found: self.found, wanted: self.wanted }
    }

    /// The refusal of a record that was to be written.
    pub(super) fn recording(self, path: &Path, what: &'static str) -> DatasetError {
        DatasetError::Record { path: path.to_owned(), what, found: self.found, wanted: self.wanted }
    }
}
