//! `quavd ibm`: what the QPU path sees, chooses and sends.
//!
//! - [`account`]: the options that say who pays and where the service is;
//! - [`backends`], [`line`](mod@line), [`qasm`], [`run`](mod@run): one command each;
//! - [`target`]: the QPU that a circuit is for, from the service or from files.

pub mod account;
pub mod backends;
pub mod line;
pub mod qasm;
pub mod run;
pub mod target;

use clap::{Args, Subcommand};

use super::CliError;

/// The arguments of `quavd ibm`.
#[derive(Debug, Args)]
pub struct IbmCommand {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// The backends of the instance, and the QPU time that is left.
    Backends(backends::BackendsArgs),
    /// The line of qubits that a chain is laid on, and what its circuit costs.
    Line(line::LineArgs),
    /// The circuit as OpenQASM 3.
    Qasm(qasm::QasmArgs),
    /// Run QAOA on a QPU, on an Ising problem that is a chain.
    Run(run::RunArgs),
}

/// Runs the command; returns what goes to stdout.
///
/// # Errors
/// [`CliError`]: exit code 6 where the QPU or the service fails.
pub fn run(command: &IbmCommand) -> Result<String, CliError> {
    match &command.what {
        What::Backends(args) => backends::run(args),
        What::Line(args) => line::run(args),
        What::Qasm(args) => qasm::run(args),
        What::Run(args) => run::run(args),
    }
}
