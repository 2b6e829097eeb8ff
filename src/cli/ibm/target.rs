//! The QPU that a circuit is for, from the service or from files, and the chain.

use std::path::{Path, PathBuf};

use clap::Args;

use super::super::CliError;
use super::super::qaoa::read;
use super::account::{AccountArgs, runtime};
use crate::ibm::Device;
use crate::ibm::client::backends::BackendChoice;
use crate::qaoa::{ChainIsing, Scale};

/// A configuration or properties document is a few hundred kilobytes.
const MAX_DOCUMENT_BYTES: u64 = 16 << 20;

/// Which QPU.
#[derive(Debug, Clone, Args)]
pub struct TargetArgs {
    /// The backend: a name, or least_busy.
    #[arg(long, default_value = "least_busy", value_name = "NAME")]
    pub backend: BackendChoice,
    /// The backend's configuration from a file instead of the service (GET …/configuration).
    #[arg(long, value_name = "FILE", requires = "properties", conflicts_with = "backend")]
    pub configuration: Option<PathBuf>,
    /// The backend's properties from a file (GET …/properties).
    #[arg(long, value_name = "FILE", requires = "configuration")]
    pub properties: Option<PathBuf>,
    /// Who pays.
    #[command(flatten)]
    pub account: AccountArgs,
}

impl TargetArgs {
    /// Gates, coupling map and calibration.
    ///
    /// # Errors
    /// [`CliError`].
    pub(super) fn device(&self, qubits: usize) -> Result<Device, CliError> {
        if let (Some(configuration), Some(properties)) = (&self.configuration, &self.properties) {
            let (configuration, properties) = (text(configuration)?, text(properties)?);
            return Device::parse(&configuration, &properties)
                .map_err(|error| CliError::Usage(error.to_string()));
        }
        let client = self.account.client()?;
        Ok(runtime()?.block_on(async {
            let backend = client.choose(&self.backend, qubits).await?;
            client.device(&backend.name).await
        })?)
    }
}

fn text(path: &Path) -> Result<String, CliError> {
    let failed = |why: String| CliError::Usage(format!("cannot read {}: {why}", path.display()));
    let size = std::fs::metadata(path).map_err(|error| failed(error.to_string()))?.len();
    if size > MAX_DOCUMENT_BYTES {
        return Err(failed(format!("it is larger than {} MiB", MAX_DOCUMENT_BYTES >> 20)));
    }
    std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))
}

/// The chain that a circuit is for.
#[derive(Debug, Clone, Args)]
pub struct ChainArgs {
    /// An Ising problem (as for quavd qaoa) whose couplings are a chain; else one like the planner's.
    pub ising: Option<PathBuf>,
    /// Qubits of the chain, where no problem is given.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u16).range(2..=2000), conflicts_with = "ising")]
    pub qubits: u16,
    /// QAOA layers.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u8).range(1..=8))]
    pub layers: u8,
}

impl ChainArgs {
    /// The chain, scaled as the circuit sees it.
    ///
    /// # Errors
    /// [`CliError::Usage`] for what is no chain.
    pub(super) fn chain(&self) -> Result<ChainIsing, CliError> {
        let Some(path) = &self.ising else {
            let n = usize::from(self.qubits);
            let coefficients = |n: usize| (0..n).map(|i| 0.1 + 0.01 * (i % 7) as f64).collect();
            return ChainIsing::new(0.0, coefficients(n), coefficients(n - 1))
                .map_err(|error| CliError::Usage(error.to_string()));
        };
        let ising = read(path)?;
        ising.scaled(Scale::Sigma).ising.to_chain().ok_or_else(|| no_chain(path))
    }
}

/// What to say of a problem that is no chain.
pub(super) fn no_chain(path: &Path) -> CliError {
    CliError::Usage(format!(
        "{}: only problems whose couplings join neighbours (i, i + 1) go on a QPU without SWAPs; \
         use quavd qaoa --engine statevector",
        path.display()
    ))
}
