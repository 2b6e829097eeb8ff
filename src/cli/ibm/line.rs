//! `quavd ibm line`.

use clap::Args;
use serde_json::json;

use super::super::CliError;
use super::target::{ChainArgs, TargetArgs};
use crate::ibm::duration::shot_seconds;
use crate::ibm::{Binding, Metrics, lower};
use crate::qaoa::Angles;

/// The arguments of `quavd ibm line`.
#[derive(Debug, Args)]
pub struct LineArgs {
    /// The chain.
    #[command(flatten)]
    pub chain: ChainArgs,
    /// The QPU.
    #[command(flatten)]
    pub target: TargetArgs,
    /// Print one JSON document on stdout.
    #[arg(long)]
    pub json: bool,
}

pub(super) fn run(args: &LineArgs) -> Result<String, CliError> {
    let chain = args.chain.chain()?;
    let device = args.target.device(chain.qubits())?;
    let angles = Angles::ramp(usize::from(args.chain.layers));
    let circuit = lower(&device, &chain, Binding::Bound(&angles))
        .map_err(|error| CliError::Usage(error.to_string()))?;
    let (line, metrics) = (circuit.line(), Metrics::of(&circuit, &device));
    let qubits: Vec<u32> = line.qubits().iter().map(|qubit| qubit.0).collect();
    let shot = shot_seconds(&device, &circuit);
    let microseconds = metrics.duration.map(|duration| duration.0 / 1e3);
    if args.json {
        let document = json!({
            "backend": device.name(),
            "calibrated": device.calibrated(),
            "line": qubits,
            "two_qubit_gate": line.native().entangler.name(),
            "two_qubit_gates": metrics.two_qubit_gates,
            "two_qubit_depth": metrics.two_qubit_depth,
            "one_qubit_gates": metrics.pulses,
            "depth": metrics.depth,
            "duration_us": microseconds,
            "success": metrics.success,
            "proven_best": line.is_proven_best(),
            "seconds_per_1024_shots": 1024.0 * shot,
        });
        return Ok(format!("{document:#}\n"));
    }
    let path: Vec<String> = qubits.iter().map(u32::to_string).collect();
    let best = if line.is_proven_best() { ", proven to be the best line" } else { "" };
    let took = microseconds.map_or_else(String::new, |us| format!(", {us:.2} us"));
    Ok(format!(
        "{} (calibrated {})\nline           {}\ncircuit        {} {} gates at depth {}, {} one-qubit \
         pulses, depth {}{took}\nwithout error  {:.4} of the shots{best}\nQPU time       {:.2} s for \
         1024 shots\n",
        device.name(),
        device.calibrated().unwrap_or("at an unknown time"),
        path.join("-"),
        metrics.two_qubit_gates,
        line.native().entangler,
        metrics.two_qubit_depth,
        metrics.pulses,
        metrics.depth,
        metrics.success,
        1024.0 * shot,
    ))
}
