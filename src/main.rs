//! The `quavd` program: parses the command line and hands over to [`quav::cli`].

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    quav::cli::run(quav::cli::Cli::parse())
}
