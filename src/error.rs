//! One error type for the whole library, and the warnings that travel to the report.
//!
//! Every message names the file, line, joint or argument it is about and says what to do.
//! Numerical outcomes (a design that stalled, a fit that is poor) are *not* errors: they are
//! statuses in the results.

use std::path::{Path, PathBuf};

/// What can go wrong before a computation starts: unreadable, malformed or contradictory input.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// the file
        path: PathBuf,
        /// what the operating system said
        source: std::io::Error,
    },
    /// A file was read, but its contents are not what they must be.
    #[error("{}{}: {message}", file.display(), if place.is_empty() { String::new() } else { format!(": {place}") })]
    File {
        /// the file
        file: PathBuf,
        /// line, joint or link; empty where it is the whole file
        place: String,
        /// what is wrong and what to do
        message: String,
    },
    /// An argument or setting is unusable.
    #[error("{0}")]
    Argument(String),
    /// The request is well-formed but cannot be met.
    #[error("{0}")]
    Infeasible(String),
    /// An output exists and may not be replaced.
    #[error("{} exists already; pass --force to replace it, or choose another --output", .0.display())]
    Exists(PathBuf),
}

/// Result of the library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// An I/O error with the file it happened on.
    pub fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Error::Io {
            path: path.as_ref().to_path_buf(),
            source,
        }
    }

    /// An error in the contents of a file.
    pub fn file(
        file: impl AsRef<Path>,
        place: impl Into<String>,
        message: impl Into<String>,
    ) -> Self {
        Error::File {
            file: file.as_ref().to_path_buf(),
            place: place.into(),
            message: message.into(),
        }
    }

    /// Whether this is a mistake in the arguments (exit status 2) rather than something that
    /// could not be done (exit status 1).
    pub fn is_argument(&self) -> bool {
        matches!(self, Error::Argument(_))
    }
}

/// Something imperfect that did not stop the work: it is printed and carried to the report.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Warning {
    /// what it is about: a link, a joint, a file, a channel
    pub subject: String,
    /// what was found and what was assumed instead
    pub message: String,
}

impl Warning {
    /// A warning about `subject`.
    pub fn new(subject: impl Into<String>, message: impl Into<String>) -> Self {
        Warning {
            subject: subject.into(),
            message: message.into(),
        }
    }
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.subject, self.message)
    }
}
