//! `quavd ibm qasm`.

use clap::Args;

use super::super::CliError;
use super::target::{ChainArgs, TargetArgs};
use crate::ibm::{Binding, lower};
use crate::qaoa::Angles;

/// The arguments of `quavd ibm qasm`.
#[derive(Debug, Args)]
pub struct QasmArgs {
    /// The chain.
    #[command(flatten)]
    pub chain: ChainArgs,
    /// The QPU.
    #[command(flatten)]
    pub target: TargetArgs,
    /// γ of each layer, comma-separated; with --betas. Without them the angles are inputs.
    #[arg(
        long,
        value_delimiter = ',',
        allow_hyphen_values = true,
        requires = "betas",
        value_name = "RAD",
        conflicts_with = "layers"
    )]
    pub gammas: Option<Vec<f64>>,
    /// β of each layer.
    #[arg(
        long,
        value_delimiter = ',',
        allow_hyphen_values = true,
        requires = "gammas",
        value_name = "RAD"
    )]
    pub betas: Option<Vec<f64>>,
}

pub(super) fn run(args: &QasmArgs) -> Result<String, CliError> {
    let chain = args.chain.chain()?;
    let angles = match (&args.gammas, &args.betas) {
        (Some(gammas), Some(betas)) => Some(
            Angles::new(gammas.clone(), betas.clone())
                .map_err(|error| CliError::Usage(format!("--gammas and --betas: {error}")))?,
        ),
        _ => None,
    };
    let binding =
        angles.as_ref().map_or(Binding::Inputs(usize::from(args.chain.layers)), Binding::Bound);
    let device = args.target.device(chain.qubits())?;
    let circuit =
        lower(&device, &chain, binding).map_err(|error| CliError::Usage(error.to_string()))?;
    Ok(circuit.to_qasm())
}
