//! The options that say who pays and where the service is. Credentials are never options: every process
//! on the machine can read a command line.

use std::path::{Path, PathBuf};

use clap::Args;

use super::super::CliError;
use crate::ibm::account::{CredentialFiles, Credentials, Endpoints};
use crate::ibm::client::backends::BackendChoice;
use crate::ibm::client::{Client, Patience};
use crate::ibm::ledger::Ledger;
use crate::ibm::qpu::IbmQpu;

/// Who pays, and where the service is.
#[derive(Debug, Clone, Args)]
pub struct AccountArgs {
    /// A file (mode 600) with the IBM Cloud API key; else QUAV_IBM_API_KEY, else systemd's credential
    /// ibm-api-key.
    #[arg(long, value_name = "FILE")]
    pub api_key_file: Option<PathBuf>,
    /// A file with the instance's CRN; else QUAV_IBM_CRN, else systemd's credential ibm-crn.
    #[arg(long, value_name = "FILE")]
    pub crn_file: Option<PathBuf>,
    /// Address of IAM instead of IBM's own.
    #[arg(long, env = "QUAV_IBM_IAM_URL", value_name = "URL")]
    pub iam_url: Option<String>,
    /// Address of the quantum API instead of the one of the CRN's region.
    #[arg(long, env = "QUAV_IBM_API_URL", value_name = "URL")]
    pub api_url: Option<String>,
}

impl AccountArgs {
    /// A client; nothing is sent yet.
    ///
    /// # Errors
    /// [`CliError::Usage`] without usable credentials.
    pub fn client(&self) -> Result<Client, CliError> {
        let files = CredentialFiles { key: self.api_key_file.clone(), crn: self.crn_file.clone() };
        let usage = |error: crate::ibm::account::AccountError| CliError::Usage(error.to_string());
        let credentials = Credentials::find(&files).map_err(usage)?;
        let region = credentials.crn.region();
        let endpoints = Endpoints::new(self.iam_url.as_deref(), self.api_url.as_deref(), region)
            .map_err(usage)?;
        Ok(Client::new(endpoints, credentials, Patience::default())?)
    }

    /// A QPU with its record of jobs in a state directory.
    ///
    /// # Errors
    /// [`CliError`].
    pub fn qpu(&self, choice: &BackendChoice, state: &Path) -> Result<IbmQpu, CliError> {
        let client = self.client()?;
        Ok(IbmQpu::new(client, choice.clone(), Ledger::open(state)?)?)
    }
}

/// A runtime for one command.
///
/// # Errors
/// [`CliError::Usage`] where there is none to be had.
pub(super) fn runtime() -> Result<tokio::runtime::Runtime, CliError> {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|error| CliError::Usage(format!("cannot start: {error}")))
}
