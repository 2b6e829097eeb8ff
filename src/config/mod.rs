//! `quavd.toml`: the configuration of the daemon.
//!
//! An option of the file is an option of the command line under the same name: [`options`]
//! declares those of the daemon for clap and takes in those of planning, and [`document`] turns a
//! file into arguments for them. So each option's name, type, range, default and text stand in one
//! place, which [`mod@reference`] reads for the commented example and for documents.

pub mod document;
pub mod options;
pub mod reference;

use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

pub use options::{DaemonOptions, Policy};

/// A configuration is a page; whatever is larger is another file.
const LARGEST_FILE: u64 = 1 << 20;

/// One thing that is wrong with a configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// The line, from 1; `None` where something is missing from the file.
    pub line: Option<usize>,
    /// What is wrong, and what to write instead.
    pub message: String,
}

/// Why a configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read the configuration {}: {source}; name the file with --config FILE", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Everything that is wrong with it, a line each.
    #[error("{}", listed(path, problems))]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong, from its top to its bottom.
        problems: Vec<Problem>,
    },
}

fn listed(path: &Path, problems: &[Problem]) -> String {
    let line = |problem: &Problem| match problem.line {
        Some(line) => format!("{}:{line}: {}", path.display(), problem.message),
        None => format!("{}: {}", path.display(), problem.message),
    };
    problems.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// Keys with values that count more than those of the file.
pub type Overrides = BTreeMap<String, String>;

/// A configuration file as it was read, with what has been set over it since.
#[derive(Debug, Clone)]
pub struct Configuration {
    path: PathBuf,
    text: String,
    overrides: Overrides,
}

impl Configuration {
    /// Reads a file. Relative paths in it are relative to its directory.
    ///
    /// # Errors
    /// [`ConfigError::Read`].
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let failed = |source| ConfigError::Read { path: path.to_owned(), source };
        let mut text = String::new();
        let file = File::open(path).map_err(failed)?;
        let read = file.take(LARGEST_FILE + 1).read_to_string(&mut text).map_err(failed)?;
        if read as u64 > LARGEST_FILE {
            return Err(failed(io::Error::other("it is larger than 1 MiB, so it is another file")));
        }
        Ok(Self { path: path.to_owned(), text, overrides: Overrides::new() })
    }

    /// The file as it is now, validated, with the same values set over it.
    ///
    /// # Errors
    /// [`ConfigError`]; then nothing has changed.
    pub fn again(&self) -> Result<Self, ConfigError> {
        let read = Self::read(&self.path)?.with(&self.overrides);
        read.options()?;
        Ok(read)
    }

    /// The same with these values in place of the file's.
    #[must_use]
    pub fn with(&self, overrides: &Overrides) -> Self {
        Self { overrides: overrides.clone(), ..self.clone() }
    }

    /// What it says, as a whole.
    ///
    /// # Errors
    /// [`ConfigError::Invalid`], with everything that is wrong at once.
    pub fn options(&self) -> Result<DaemonOptions, ConfigError> {
        let directory = self.path.parent().unwrap_or(Path::new(""));
        document::parse(&self.text, directory, &self.overrides)
            .map_err(|problems| ConfigError::Invalid { path: self.path.clone(), problems })
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "line {line}: {}", self.message),
            None => f.write_str(&self.message),
        }
    }
}
