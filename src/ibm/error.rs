//! What can go wrong with a QPU, and what to do about it.

use std::path::PathBuf;
use std::time::Duration;

use thiserror::Error;

use super::account::AccountError;

/// Why there is no result from the QPU. Each message says what to do next; none holds a credential.
#[derive(Debug, Error)]
pub enum IbmError {
    /// No usable credentials or addresses.
    #[error(transparent)]
    Account(#[from] AccountError),
    /// IAM does not know the key (HTTP 400, BXNIM0415E).
    #[error("IBM rejected the API key ({0}); make a new one at cloud.ibm.com/iam/apikeys")]
    KeyRejected(String),
    /// The token was refused, also a new one.
    #[error(
        "IBM Quantum refused a fresh token ({0}); check that the key's owner may use the instance"
    )]
    Unauthorised(String),
    /// 403.
    #[error("IBM Quantum does not allow this ({0}); ask for access, or use another instance")]
    Forbidden(String),
    /// 404 with code 1279.
    #[error(
        "there is no such instance in {region}: the CRN is wrong or belongs to another region; copy \
         it from quantum.cloud.ibm.com/instances"
    )]
    NoSuchInstance {
        /// The region that was asked.
        region: String,
    },
    /// A backend that the account is not offered.
    #[error("{}", no_such_backend(name, available))]
    NoSuchBackend {
        /// What was asked for.
        name: String,
        /// What there is.
        available: Vec<String>,
    },
    /// No backend is online.
    #[error("none of the backends is online ({}); try later, or use a local engine", available.join(", "))]
    NoneOnline {
        /// What there is.
        available: Vec<String>,
    },
    /// A backend that exists but takes no jobs at present.
    #[error(
        "{name} is {status} and would only hold the job; use --backend least_busy, or try later"
    )]
    NotOnline {
        /// The backend.
        name: String,
        /// What it says.
        status: String,
    },
    /// 409 at job creation, or a cap that does not suffice.
    #[error(
        "the instance has no QPU time left ({0}); wait for the next period, or use another instance"
    )]
    NoTimeLeft(String),
    /// More QPU time than is left, known before anything is paid.
    #[error(
        "this would take about {needed:.0} QPU seconds and the instance has {left:.0} left; use fewer \
         --shots or --qpu-jobs, or --train local"
    )]
    TooDear {
        /// The estimate, seconds.
        needed: f64,
        /// What is left, seconds.
        left: f64,
    },
    /// 429, again and again.
    #[error("IBM Quantum limits the rate of requests and still did after {tries} tries; try later")]
    RateLimited {
        /// How often it was tried.
        tries: u32,
    },
    /// 5xx, again and again.
    #[error("IBM Quantum answered {status} {tries} times; see cloud.ibm.com/status, and try later")]
    Unavailable {
        /// The HTTP status.
        status: u16,
        /// How often it was tried.
        tries: u32,
    },
    /// No answer at all.
    #[error("{host} gives no answer: {cause}; check the network and the clock")]
    Unreachable {
        /// The host.
        host: String,
        /// Why.
        cause: String,
    },
    /// Any other refusal.
    #[error("IBM Quantum refused the request: {0}")]
    Refused(String),
    /// An answer that is not what it should be.
    #[error("IBM Quantum's answer to {what} makes no sense: {why}; nothing was used of it")]
    Malformed {
        /// Which request.
        what: String,
        /// What is wrong.
        why: String,
    },
    /// The job ended without a result.
    #[error("job {id} failed: {reason}; {}", advice(*code))]
    JobFailed {
        /// The job.
        id: String,
        /// What the service says.
        reason: String,
        /// Its reason code.
        code: Option<i64>,
    },
    /// The job was cancelled, here or by its owner.
    #[error("job {0} was cancelled")]
    JobCancelled(String),
    /// The job ran into its cap.
    #[error("job {0} ran into its cap of QPU time; use fewer --shots or circuits")]
    RanTooLong(String),
    /// The service does not know the job.
    #[error("IBM Quantum no longer knows job {0}; it will be submitted again when run again")]
    NoSuchJob(String),
    /// The deadline passed first.
    #[error("no result within {:.0} s (--deadline){}", after.as_secs_f64(), job.as_ref().map_or(String::new(), |job| format!("; job {job} was cancelled")))]
    Deadline {
        /// How long was waited.
        after: Duration,
        /// The job waited for.
        job: Option<String>,
    },
    /// Planning was called off.
    #[error("called off")]
    CalledOff,
    /// The record of jobs cannot be kept, without which one might be paid twice.
    #[error("cannot keep the record of jobs in {}: {cause}; nothing was submitted", path.display())]
    Ledger {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// No circuit can be made for the backend.
    #[error("{0}")]
    Circuit(String),
    /// The HTTP client cannot be made.
    #[error("cannot set up TLS: {0}; install the package ca-certificates")]
    Tls(String),
}

/// Names of retired processors and when they went (IBM's table of retired QPUs).
const RETIRED: [(&str, &str); 3] =
    [("ibm_kyiv", "2025-04-18"), ("ibm_sherbrooke", "2025-07-31"), ("ibm_brisbane", "2025-11-03")];

fn no_such_backend(name: &str, available: &[String]) -> String {
    let what = match RETIRED.iter().find(|(retired, _)| *retired == name) {
        Some((_, date)) => format!("{name} was retired on {date}"),
        None => format!("the instance offers no backend {name}"),
    };
    let there = if available.is_empty() {
        "it offers none at all; check the instance's access".to_owned()
    } else {
        format!("choose --backend least_busy or one of {}", available.join(", "))
    };
    format!("{what}; {there}")
}

/// What to do about a failed job (IBM Quantum, "Error codes").
fn advice(code: Option<i64>) -> &'static str {
    match code {
        Some(1517) => {
            "the circuit does not fit the backend's instruction set, whose calibration may have \
             changed meanwhile: run it again, and report it if it fails again"
        }
        Some(1506 | 1603) => "the service could not read the circuit: please report this",
        Some(1305) => "it ran into its cap of QPU time: use fewer --shots",
        Some(1520 | 5302) => "it is larger than the service takes: use fewer --shots or --qubits",
        Some(1217) => "its session was closed: run it again",
        _ => "run it again, on another --backend if it fails again",
    }
}

impl IbmError {
    pub(super) fn malformed(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Malformed { what: what.into(), why: why.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_retired_backend_is_named_as_such_with_those_that_exist() {
        let available = vec!["ibm_fez".to_owned(), "ibm_kingston".to_owned()];
        let error = IbmError::NoSuchBackend { name: "ibm_kyiv".to_owned(), available };
        let text = error.to_string();
        assert!(text.contains("retired on 2025-04-18") && text.contains("ibm_fez, ibm_kingston"));
    }

    #[test]
    fn a_failed_job_says_what_to_do_by_its_code() {
        let failed = |code| IbmError::JobFailed { id: "x".into(), reason: "r".into(), code };
        assert!(failed(Some(1517)).to_string().contains("instruction set"));
        assert!(failed(None).to_string().contains("another --backend"));
    }
}
