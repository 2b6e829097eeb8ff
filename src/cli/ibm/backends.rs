//! `quavd ibm backends`.

use std::fmt::Write;

use clap::Args;
use serde_json::json;

use super::super::CliError;
use super::account::{AccountArgs, runtime};
use crate::ibm::client::backends::Backend;
use crate::ibm::client::visible;

/// The arguments of `quavd ibm backends`.
#[derive(Debug, Args)]
pub struct BackendsArgs {
    /// Print one JSON document on stdout.
    #[arg(long)]
    pub json: bool,
    /// Who pays.
    #[command(flatten)]
    pub account: AccountArgs,
}

pub(super) fn run(args: &BackendsArgs) -> Result<String, CliError> {
    let client = args.account.client()?;
    let (mut backends, usage) = runtime()?.block_on(async {
        let backends = client.backends().await?;
        Ok::<_, CliError>((backends, client.usage().await?))
    })?;
    backends.sort_by(|a, b| a.name.cmp(&b.name));
    if args.json {
        let listed: Vec<_> = backends
            .iter()
            .map(|backend| {
                json!({
                    "name": backend.name,
                    "processor": backend.processor(),
                    "qubits": backend.qubits,
                    "status": backend.status.name,
                    "queue_length": backend.queue_length,
                })
            })
            .collect();
        return Ok(format!(
            "{:#}\n",
            json!({ "backends": listed, "qpu_seconds_left": usage.left() })
        ));
    }
    let mut text = String::new();
    for backend in &backends {
        let Backend { name, qubits, queue_length, status, .. } = backend;
        let number = |n: Option<u64>| n.map_or_else(|| "?".to_owned(), |n| n.to_string());
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{:<18} {:<12} {:>4} qubits  {:<8} {:>5} in the queue",
            visible(name),
            visible(&backend.processor()),
            number(qubits.map(u64::from)),
            visible(&status.name),
            number(*queue_length),
        );
    }
    let _ = match usage.left() {
        Some(left) => writeln!(text, "{left:.0} QPU seconds left"),
        None => writeln!(text, "no limit of QPU time"),
    };
    Ok(text)
}
