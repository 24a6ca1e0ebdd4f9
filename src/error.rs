//! The one error type of the library: what happened, the value, what is allowed, what to do.

use std::path::{Path, PathBuf};

/// A process that a signal ended has this exit code, plus the signal's number.
const SIGNALLED: i32 = 128;
/// Number of the signal of Ctrl-C on every system.
const SIGINT: i32 = 2;

/// Why a stage could not do its work. `main` turns it into an exit code.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The command line or a settings file asks for something that does not exist: exit code 2.
    #[error("{0}")]
    Usage(String),
    /// A file or its content cannot be used: exit code 1.
    #[error("{}: {message}", path.display())]
    Input {
        /// The file at fault.
        path: PathBuf,
        /// What is wrong with it, what is allowed and what to do.
        message: String,
    },
    /// The operating system refused to read or write: exit code 1.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// The file or directory at fault.
        path: PathBuf,
        /// The verb: "read", "write", "create", "rename".
        action: &'static str,
        /// The operating system's own words.
        source: std::io::Error,
    },
    /// The work itself failed (no plan, no demo left, a loss that is not a number): exit code 1.
    #[error("{0}")]
    Failed(String),
    /// Ctrl-C or a termination signal: nothing half-written is left; exit code 130 or 143 (128 + the signal).
    #[error("interrupted; no artefact was changed, run the same command to start again")]
    Interrupted,
    /// The same in a stage that keeps its state: the words say where it is and how to go on.
    #[error("interrupted; no artefact was changed, {0}")]
    InterruptedAt(String),
}

/// Result of the library.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A file whose content cannot be used.
    pub fn input(path: &Path, message: impl Into<String>) -> Self {
        Error::Input { path: path.to_path_buf(), message: message.into() }
    }

    /// An operating-system error on `path` while doing `action`.
    pub fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Error::Io { path: path.to_path_buf(), action, source }
    }

    /// The process exit code of this error; `signal` is what interrupted the process, if anything did.
    pub fn exit_code(&self, signal: Option<i32>) -> u8 {
        match self {
            Error::Usage(_) => 2,
            Error::Interrupted | Error::InterruptedAt(_) => {
                let code = SIGNALLED + signal.unwrap_or(SIGINT);
                u8::try_from(code).unwrap_or(1)
            }
            _ => 1,
        }
    }
}
