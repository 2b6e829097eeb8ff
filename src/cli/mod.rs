//! The commands of `quavd`. This is the edge: files, links, the terminal and exit codes are here
//! and nowhere else.
//!
//! - [`options`]: what the commands have in common, with the names of the configuration file;
//! - [`signing`]: the options that sign a link;
//! - [`files`]: scenarios, missions and fences from files, results to files;
//! - [`reading`]: what is read from a vehicle; [`flight`]: the rest of a mission that is being flown;
//! - [`progress`]: what is shown while something runs; [`terminal`]: what the terminal can show;
//! - [`mod@run`], [`status`], [`plan`], [`check`], [`once`], [`compare`], [`qaoa`], [`ibm`]: one command
//!   each;
//! - [`generate`]: manual pages and completions;
//! - [`memory`]: what the machine has left;
//! - [`exit`]: errors and their exit codes.

pub mod check;
pub mod compare;
pub mod exit;
pub mod files;
pub(crate) mod flight;
pub mod generate;
pub mod ibm;
pub mod memory;
pub mod once;
pub mod options;
pub mod plan;
pub mod progress;
pub mod qaoa;
pub(crate) mod reading;
pub mod run;
pub mod signing;
pub mod status;
pub mod terminal;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

pub use exit::CliError;

/// Plans a drone's mission around no-fly areas with QAOA, and puts it on the vehicle.
#[derive(Debug, Parser)]
#[command(name = "quavd", version, about, propagate_version = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Only results and errors: no progress, no warnings.
    #[arg(long, short, global = true)]
    quiet: bool,
    /// More about what is done, on stderr; twice for every message. RUST_LOG overrides it.
    #[arg(long, short, global = true, action = clap::ArgAction::Count)]
    verbose: u8,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// The daemon: stays with the vehicle, and plans when its mission or fence changes.
    Run(run::RunArgs),
    /// What the running daemon does, and what it did last.
    Status(status::StatusArgs),
    /// Have the running daemon plan now.
    Trigger(status::StatusArgs),
    /// Read from the vehicle, plan, upload, verify, exit.
    Once(once::OnceArgs),
    /// Plan a mission from files; no vehicle needed.
    Plan(plan::PlanArgs),
    /// Judge any mission against any fences.
    Check(check::CheckArgs),
    /// The paper's table: A*, RRT and QUAV side by side.
    Compare(compare::CompareArgs),
    /// Run QAOA alone on an Ising problem.
    Qaoa(qaoa::QaoaArgs),
    /// What the QPU path sees, chooses and sends.
    Ibm(ibm::IbmCommand),
    /// Write manual pages, completions and the example configuration for a package.
    #[command(hide = true)]
    Generate(generate::GenerateArgs),
}

/// Runs the command of a parsed command line, prints its result on stdout and its error on
/// stderr, and returns the exit code.
#[must_use]
pub fn run(cli: Cli) -> ExitCode {
    start_log(cli.verbose, cli.quiet, matches!(cli.command, Command::Run(_)));
    let shown = progress::Shown::new(cli.quiet);
    let outcome = match cli.command {
        Command::Run(args) => run::run(&args),
        Command::Status(args) => status::run(&args, "status"),
        Command::Trigger(args) => status::run(&args, "plan"),
        Command::Once(args) => once::run(args, &shown),
        Command::Plan(args) => plan::run(&args, &shown),
        Command::Check(args) => check::run(&args, &shown),
        Command::Compare(args) => compare::run(&args, &shown),
        Command::Qaoa(args) => qaoa::run(&args).map_err(CliError::from),
        Command::Ibm(command) => ibm::run(&command),
        Command::Generate(args) => generate::run(&args),
    };
    match outcome {
        Ok(text) => exit::print(&text, ExitCode::SUCCESS),
        Err(error) => error.report(),
    }
}

/// Logs go to stderr, never to stdout. A daemon that systemd has started logs to the journal, with
/// fields, and tells what happens without being asked to.
fn start_log(verbose: u8, quiet: bool, is_daemon: bool) {
    use tracing::level_filters::LevelFilter;
    use tracing_subscriber::filter::Targets;
    use tracing_subscriber::layer::SubscriberExt;
    use tracing_subscriber::util::SubscriberInitExt;

    let level = match (quiet, verbose + u8::from(is_daemon)) {
        (true, _) => LevelFilter::ERROR,
        (_, 0) => LevelFilter::WARN,
        (_, 1) => LevelFilter::INFO,
        _ => LevelFilter::DEBUG,
    };
    let asked = std::env::var("RUST_LOG").ok().and_then(|text| text.parse::<Targets>().ok());
    let filter = asked.unwrap_or_else(|| Targets::new().with_target("quav", level));
    // systemd sets JOURNAL_STREAM; without a journal socket stderr is as good as it gets.
    let journal = std::env::var_os("JOURNAL_STREAM")
        .filter(|_| is_daemon)
        .and_then(|_| tracing_journald::layer().ok());
    let stderr = journal.is_none().then(|| {
        tracing_subscriber::fmt::layer()
            .with_writer(std::io::stderr)
            .with_target(false)
            .with_ansi(terminal::has_colours(&std::io::stderr()))
            .without_time()
    });
    // A second subscriber (in tests) is no reason to fail.
    let _ = tracing_subscriber::registry().with(filter).with(journal).with(stderr).try_init();
}
