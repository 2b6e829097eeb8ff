//! `quavd run`: the daemon. Here are its command line and its log; the rest is [`crate::daemon`].

use std::path::PathBuf;

use clap::Args;

use super::CliError;
use crate::config::{Configuration, reference};
use crate::daemon;

/// The arguments of `quavd run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// The configuration.
    #[arg(long, default_value = "/etc/quavd/quavd.toml", value_name = "FILE")]
    pub config: PathBuf,
    /// Only say whether the configuration is valid.
    #[arg(long)]
    pub check: bool,
    /// Only print a configuration with every option, its text and its default.
    #[arg(long, conflicts_with = "check")]
    pub example: bool,
}

/// Runs the command; returns what goes to stdout.
///
/// # Errors
/// [`CliError`] with the exit code.
pub fn run(args: &RunArgs) -> Result<String, CliError> {
    if args.example {
        return Ok(reference::example());
    }
    let configuration = Configuration::read(&args.config)?;
    configuration.options()?;
    if args.check {
        return Ok(format!("{}: valid\n", args.config.display()));
    }
    daemon::run(configuration)?;
    Ok(String::new())
}
