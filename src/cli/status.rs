//! `quavd status` and `quavd trigger`: asking the daemon that runs on this board.

use std::path::{Path, PathBuf};

use clap::Args;

use super::CliError;
use super::plan::to_json;
use crate::daemon::socket;

/// Where the packaged unit has its socket.
const PACKAGED: &str = "/run/quavd/status.sock";

/// The arguments of `quavd status` and `quavd trigger`.
#[derive(Debug, Args)]
pub struct StatusArgs {
    /// The daemon's socket, where it is neither /run/quavd/status.sock nor in the state directory.
    #[arg(long, value_name = "FILE")]
    pub socket: Option<PathBuf>,
    /// The daemon's state directory.
    #[arg(long, env = "STATE_DIRECTORY", value_name = "DIR")]
    pub state_dir: Option<PathBuf>,
    /// Print one JSON document on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Asks for the status, or for a plan as well; returns what goes to stdout.
///
/// # Errors
/// [`CliError::Unreachable`] where no daemon answers.
pub fn run(args: &StatusArgs, question: &str) -> Result<String, CliError> {
    let path = match &args.socket {
        Some(path) => path.clone(),
        None if Path::new(PACKAGED).exists() => PathBuf::from(PACKAGED),
        None => socket::path(None, &super::options::state_directory(args.state_dir.as_ref())?),
    };
    let status = socket::ask(&path, question).map_err(|error| {
        CliError::Unreachable(format!(
            "no daemon answers at {}: {error}; see that it runs (`systemctl status quavd`), or \
             name its --socket",
            path.display()
        ))
    })?;
    if args.json { to_json(&status) } else { Ok(status.to_text()) }
}
