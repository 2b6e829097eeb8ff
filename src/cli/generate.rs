//! `quavd generate`: the files of a package that follow from the command line: manual pages, shell
//! completions and the example configuration. Hidden, since only packagers want it.

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::files::FileError;
use super::{Cli, CliError};
use crate::config::reference;

/// The arguments of `quavd generate`.
#[derive(Debug, Args)]
pub struct GenerateArgs {
    /// The directory that the files go to; made if need be.
    pub directory: PathBuf,
}

/// Runs the command; returns what goes to stdout.
///
/// # Errors
/// [`CliError::Usage`] where a file cannot be written.
pub fn run(args: &GenerateArgs) -> Result<String, CliError> {
    let write = |path: &Path, bytes: &[u8]| -> Result<(), CliError> {
        let failed = |source| FileError::Write { path: path.to_owned(), source };
        fs::create_dir_all(path.parent().unwrap_or(Path::new("."))).map_err(failed)?;
        Ok(fs::write(path, bytes).map_err(failed)?)
    };
    let mut command = Cli::command();
    let man = args.directory.join("man");
    fs::create_dir_all(&man)
        .and_then(|()| clap_mangen::generate_to(command.clone(), &man))
        .map_err(|source| FileError::Write { path: man, source })?;
    for (shell, name) in
        [(Shell::Bash, "quavd.bash"), (Shell::Zsh, "_quavd"), (Shell::Fish, "quavd.fish")]
    {
        let mut bytes = Vec::new();
        clap_complete::generate(shell, &mut command, "quavd", &mut bytes);
        write(&args.directory.join("completions").join(name), &bytes)?;
    }
    write(&args.directory.join("quavd.toml"), reference::example().as_bytes())?;
    Ok(String::new())
}
