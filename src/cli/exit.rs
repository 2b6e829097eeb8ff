//! Errors of the commands, and their exit codes.

use std::io::Write;
use std::process::ExitCode;

use crate::cli::files::FileError;
use crate::cli::qaoa::QaoaCommandError;
use crate::config::ConfigError;
use crate::fence::items::FenceItemError;
use crate::formats::FormatError;
use crate::ibm::error::IbmError;
use crate::link::LinkError;
use crate::replan::ReplanError;
use crate::store::StoreError;
use crate::vehicle::replace::{Failure, Obstacle, ReplaceError};
use crate::vehicle::{DiscoveryError, TransferError};

/// Why a command ended without its result. The code is part of the command line's contract.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// Exit code 2: the command line, a file or a setting cannot be used.
    #[error("{0}")]
    Usage(String),
    /// Exit code 3: no safe path. The document is what `--json` prints.
    #[error("{reason}")]
    NoPath {
        /// Why.
        reason: String,
        /// For stdout, where `--json` asked for it.
        document: Option<String>,
    },
    /// Exit code 4: the vehicle was not there, or was lost.
    #[error("{0}")]
    Unreachable(String),
    /// Exit code 5: the vehicle said no.
    #[error("{0}")]
    Refused(String),
    /// Exit code 6: the QPU gave nothing, and no fallback was allowed.
    #[error("{0}")]
    Qpu(String),
}

impl CliError {
    /// The exit code.
    #[must_use]
    pub fn code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::NoPath { .. } => 3,
            Self::Unreachable(_) => 4,
            Self::Refused(_) => 5,
            Self::Qpu(_) => 6,
        }
    }

    /// Prints the error on stderr (and its document on stdout) and gives the exit code.
    pub(super) fn report(&self) -> ExitCode {
        // Nothing can be done about a stderr that is gone.
        let _ = writeln!(std::io::stderr(), "quavd: {self}");
        let code = ExitCode::from(self.code());
        match self {
            Self::NoPath { document: Some(document), .. } => print(document, code),
            _ => code,
        }
    }
}

/// Prints a result on stdout. A reader that has gone away is not an error of the command.
pub(super) fn print(text: &str, code: ExitCode) -> ExitCode {
    let mut stdout = std::io::stdout().lock();
    let written = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
    match written {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            let _ = writeln!(std::io::stderr(), "quavd: cannot write the result: {error}");
            ExitCode::from(2)
        }
        _ => code,
    }
}

macro_rules! usage_errors {
    ($($error:ty),*) => {$(
        impl From<$error> for CliError {
            fn from(error: $error) -> Self {
                Self::Usage(error.to_string())
            }
        }
    )*};
}

impl From<IbmError> for CliError {
    fn from(error: IbmError) -> Self {
        match error {
            IbmError::Account(error) => Self::Usage(error.to_string()),
            error => Self::Qpu(error.to_string()),
        }
    }
}

usage_errors!(
    ConfigError,
    FileError,
    FormatError,
    FenceItemError,
    QaoaCommandError,
    StoreError,
    crate::link::SigningError
);

impl From<ReplanError> for CliError {
    fn from(error: ReplanError) -> Self {
        let reason = error.to_string();
        if error.is_no_path() {
            Self::NoPath { reason, document: None }
        } else if error.is_qpu_failure() {
            Self::Qpu(reason)
        } else {
            Self::Usage(reason)
        }
    }
}

macro_rules! link_errors {
    ($($error:ty),*) => {$(
        impl From<$error> for CliError {
            fn from(error: $error) -> Self {
                Self::Unreachable(error.to_string())
            }
        }
    )*};
}

link_errors!(
    DiscoveryError,
    LinkError,
    crate::link::OpenError,
    crate::vehicle::parameter::ParameterError
);

impl From<TransferError> for CliError {
    fn from(error: TransferError) -> Self {
        let reason = error.to_string();
        if error.is_unreachable() { Self::Unreachable(reason) } else { Self::Refused(reason) }
    }
}

fn by_failure(failure: Failure, reason: String) -> CliError {
    match failure {
        Failure::Unreachable => CliError::Unreachable(reason),
        Failure::Refused => CliError::Refused(reason),
        Failure::Local => CliError::Usage(reason),
    }
}

impl From<ReplaceError> for CliError {
    fn from(error: ReplaceError) -> Self {
        by_failure(error.failure(), error.to_string())
    }
}

impl From<Obstacle> for CliError {
    fn from(error: Obstacle) -> Self {
        by_failure(error.failure(), error.to_string())
    }
}
