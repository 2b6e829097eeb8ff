//! Jobs: created once, waited for, fetched, cancelled.
//!
//! `POST /jobs` charges QPU time, so that a request that got no answer is not simply made again: each
//! job carries a tag of its own, and the service is asked for a job with that tag first.

use std::time::Duration;

use reqwest::Method;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::time::Instant;
use tracing::{debug, info, warn};

use super::super::error::IbmError;
use super::super::program::Program;
use super::{Call, CallError, Client, jittered, visible};

/// The service's bound on a job's cap, seconds of QPU time.
pub const MAX_COST: u32 = 10_800;

/// How often a job is looked for after an attempt to create it got no answer, before the next attempt.
const LOOKS: u32 = 3;

/// What to run.
#[derive(Debug, Clone)]
pub struct Submission<'a> {
    /// Where.
    pub backend: &'a str,
    /// The program's parameters ([`Program::params`]).
    pub params: &'a Value,
    /// What no other job is tagged with.
    pub tag: &'a str,
    /// QPU seconds it may take at most.
    pub cost: u32,
    /// The session or batch that it belongs to.
    pub session: Option<&'a str>,
}

/// How a job is doing.
#[derive(Debug, Clone, PartialEq)]
pub enum JobState {
    /// Waiting.
    Queued,
    /// On the QPU.
    Running,
    /// Done: there are results.
    Completed,
    /// Cancelled by its owner.
    Cancelled,
    /// Cancelled by the service, which had run it for as long as it may.
    RanTooLong,
    /// Ended without results.
    Failed {
        /// Why.
        reason: String,
        /// The service's code.
        code: Option<i64>,
    },
    /// Something that is not in IBM's documents; taken as not finished.
    Unknown(String),
}

#[derive(Deserialize)]
struct JobDocument {
    #[serde(default)]
    status: Option<String>,
    #[serde(default)]
    state: Option<StateDocument>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct StateDocument {
    status: Option<String>,
    reason: Option<String>,
    reason_code: Option<Value>,
    reason_solution: Option<String>,
}

/// The code of a job that ran for too long.
const RAN_TOO_LONG: i64 = 1305;

impl JobDocument {
    fn state(self) -> JobState {
        let StateDocument { status, reason, reason_code, reason_solution } =
            self.state.unwrap_or_default();
        let code = reason_code.as_ref().and_then(super::exchange::as_code);
        let top = self.status.unwrap_or_default();
        match status.as_deref().unwrap_or(&top) {
            "Queued" => JobState::Queued,
            "Running" => JobState::Running,
            "Completed" => JobState::Completed,
            _ if code == Some(RAN_TOO_LONG) || top == "Cancelled - Ran too long" => {
                JobState::RanTooLong
            }
            "Cancelled" => JobState::Cancelled,
            "Failed" => {
                let said: Vec<String> = reason.into_iter().chain(reason_solution).collect();
                let reason = visible(&said.join(" "));
                let reason = if reason.is_empty() { "no reason given".to_owned() } else { reason };
                JobState::Failed { reason, code }
            }
            other => JobState::Unknown(visible(other)),
        }
    }
}

/// What a job has cost.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(default)]
pub struct Metrics {
    usage: UsageMetrics,
}

#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(default)]
struct UsageMetrics {
    qpu_charge_time_seconds: Option<f64>,
}

impl Metrics {
    /// QPU seconds that the instance was charged.
    #[must_use]
    pub fn qpu_seconds(&self) -> Option<f64> {
        self.usage.qpu_charge_time_seconds.filter(|seconds| seconds.is_finite() && *seconds >= 0.0)
    }
}

#[derive(Deserialize)]
struct Created {
    id: String,
}

#[derive(Deserialize)]
struct JobList {
    jobs: Vec<Listed>,
}

#[derive(Deserialize)]
struct Listed {
    id: String,
    #[serde(default)]
    tags: Vec<String>,
}

/// Whether an id can be put into a path.
fn checked_id(id: String, what: &str) -> Result<String, IbmError> {
    let valid = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !id.is_empty() && id.len() <= 100 && id.chars().all(valid) {
        Ok(id)
    } else {
        Err(IbmError::malformed(what, "it has no usable job id"))
    }
}

impl Client {
    /// Creates a job, exactly one, and gives its id.
    ///
    /// # Errors
    /// [`IbmError`]. Only after [`IbmError::Unreachable`] and [`IbmError::Unavailable`] may a job with
    /// the tag exist all the same.
    pub async fn submit(
        &self,
        program: &dyn Program,
        submission: &Submission<'_>,
    ) -> Result<String, IbmError> {
        let Submission { backend, params, tag, cost, session } = submission;
        let mut body = json!({
            "program_id": program.id(),
            "backend": backend,
            "params": params,
            "tags": ["quavd", tag],
            "cost": (*cost).clamp(1, MAX_COST),
            "log_level": "warning",
        });
        if let (Some(session), Some(body)) = (session, body.as_object_mut()) {
            body.insert("session_id".to_owned(), json!(session));
        }
        let mut attempts = 0;
        loop {
            let call = Call {
                method: Method::POST,
                body: Some(&body),
                repeatable: false,
                ..self.get(&["jobs"])
            };
            let unsure = match self.call(call).await {
                Ok(reply) => {
                    const WHAT: &str = "POST /jobs";
                    // An answer that cannot be read leaves a job behind: it is found by its tag.
                    match reply
                        .document(WHAT)
                        .and_then(|created: Created| checked_id(created.id, WHAT))
                    {
                        Ok(id) => {
                            info!(job = id, backend, "submitted");
                            return Ok(id);
                        }
                        Err(error) => error,
                    }
                }
                Err(CallError::Refused { status: 409, error: IbmError::Refused(said), .. }) => {
                    return Err(IbmError::NoTimeLeft(said));
                }
                Err(CallError::Refused { status: 404, error: IbmError::Refused(_), .. }) => {
                    let available = self.backends().await?;
                    let available = available.into_iter().map(|b| visible(&b.name)).collect();
                    return Err(IbmError::NoSuchBackend { name: (*backend).to_owned(), available });
                }
                Err(CallError::Unsure(error)) => error,
                Err(error) => return Err(error.into_error()),
            };
            attempts += 1;
            warn!(attempts, "no answer to a submission ({unsure}); looking for its job");
            for look in 1..=LOOKS {
                tokio::time::sleep(self.backoff(look)).await;
                if let Some(id) = self.tagged(tag).await? {
                    info!(job = id, backend, "it had been submitted");
                    return Ok(id);
                }
            }
            if attempts >= self.patience.tries {
                return Err(unsure);
            }
        }
    }

    /// The job with a tag, if there is one.
    ///
    /// # Errors
    /// [`IbmError`].
    pub async fn tagged(&self, tag: &str) -> Result<Option<String>, IbmError> {
        const WHAT: &str = "GET /jobs";
        let mut call = self.get(&["jobs"]);
        call.url.query_pairs_mut().append_pair("limit", "10").append_pair("tags", tag);
        let list: JobList = self.read(call).await?.document(WHAT)?;
        // A service that ignores the filter must not give somebody else's job.
        let found = list.jobs.into_iter().find(|job| job.tags.iter().any(|own| own == tag));
        found.map(|job| checked_id(job.id, WHAT)).transpose()
    }

    /// How a job is doing.
    ///
    /// # Errors
    /// [`IbmError`].
    pub async fn job_state(&self, id: &str) -> Result<JobState, IbmError> {
        let mut call = self.get(&["jobs", id]);
        call.url.query_pairs_mut().append_pair("exclude_params", "true");
        match self.call(call).await {
            Ok(reply) => {
                let document: JobDocument = reply.document(&format!("GET /jobs/{id}"))?;
                Ok(document.state())
            }
            Err(CallError::Refused { status: 404, error: IbmError::Refused(_), .. }) => {
                Err(IbmError::NoSuchJob(id.to_owned()))
            }
            Err(error) => Err(error.into_error()),
        }
    }

    /// Waits for a job to end and gives the body of its results. Waits through outages of the service
    /// ([`super::Patience::outage`]): the job is paid for. A deadline is the caller's.
    ///
    /// # Errors
    /// [`IbmError`].
    pub async fn results(
        &self,
        id: &str,
        limit: usize,
        mut watch: impl FnMut(&JobState),
    ) -> Result<Vec<u8>, IbmError> {
        let mut pause = self.patience.poll;
        let mut heard = Instant::now();
        let mut last = None;
        loop {
            match self.job_state(id).await {
                Ok(state) => {
                    heard = Instant::now();
                    if last.as_ref() != Some(&state) {
                        debug!(job = id, ?state, "job");
                        watch(&state);
                    }
                    match &state {
                        JobState::Completed => {
                            if let Some(body) = self.fetch(id, limit).await? {
                                return Ok(body);
                            }
                        }
                        JobState::Failed { reason, code } => {
                            return Err(IbmError::JobFailed {
                                id: id.to_owned(),
                                reason: self.credentials.removed_from(reason),
                                code: *code,
                            });
                        }
                        JobState::Cancelled => return Err(IbmError::JobCancelled(id.to_owned())),
                        JobState::RanTooLong => return Err(IbmError::RanTooLong(id.to_owned())),
                        JobState::Queued | JobState::Running | JobState::Unknown(_) => {}
                    }
                    last = Some(state);
                }
                Err(
                    error @ (IbmError::Unreachable { .. }
                    | IbmError::Unavailable { .. }
                    | IbmError::RateLimited { .. }
                    | IbmError::Malformed { .. }),
                ) if heard.elapsed() < self.patience.outage => {
                    warn!(job = id, "the job is waited for, although: {error}");
                }
                Err(error) => return Err(error),
            }
            tokio::time::sleep(jittered(pause)).await;
            pause = pause.mul_f64(1.4).min(self.patience.poll_most);
        }
    }

    /// The body of a job's results; `None` where they are not there yet.
    async fn fetch(&self, id: &str, limit: usize) -> Result<Option<Vec<u8>>, IbmError> {
        let call = Call { limit, ..self.get(&["jobs", id, "results"]) };
        match self.call(call).await {
            Ok(reply) if reply.status.as_u16() == 204 => {
                Err(IbmError::malformed(format!("GET /jobs/{id}/results"), "it is empty"))
            }
            Ok(reply) => Ok(Some(reply.body)),
            // "Job results not ready".
            Err(CallError::Refused { status: 400, code: Some(1234), .. }) => Ok(None),
            Err(error) => Err(error.into_error()),
        }
    }

    /// Cancels a job. One that has ended is left as it is.
    ///
    /// # Errors
    /// [`IbmError`].
    pub async fn cancel(&self, id: &str) -> Result<(), IbmError> {
        let call =
            Call { method: Method::POST, repeatable: true, ..self.get(&["jobs", id, "cancel"]) };
        match self.call(call).await {
            Ok(_) | Err(CallError::Refused { status: 404 | 409, .. }) => Ok(()),
            Err(error) => Err(error.into_error()),
        }
    }

    /// What a job has cost.
    ///
    /// # Errors
    /// [`IbmError`].
    pub async fn metrics(&self, id: &str) -> Result<Metrics, IbmError> {
        let reply = self.read(self.get(&["jobs", id, "metrics"])).await?;
        reply.document(&format!("GET /jobs/{id}/metrics"))
    }
}

/// A tag that no other job has.
#[must_use]
pub fn unique_tag(request: &str) -> String {
    use sha2::{Digest, Sha256};
    let now = std::time::SystemTime::now()
        .duration_since(std::time::SystemTime::UNIX_EPOCH)
        .unwrap_or(Duration::ZERO);
    let seed = format!("{request} {} {}", now.as_nanos(), std::process::id());
    let hash = Sha256::digest(seed.as_bytes());
    let hex: String = hash.iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    format!("quavd-{hex}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(text: &str) -> JobState {
        serde_json::from_str::<JobDocument>(text).unwrap().state()
    }

    #[test]
    fn every_state_of_the_service_is_known() {
        let simple = |name: &str| state(&format!(r#"{{"state":{{"status":"{name}"}}}}"#));
        assert_eq!(simple("Queued"), JobState::Queued);
        assert_eq!(simple("Completed"), JobState::Completed);
        assert_eq!(simple("Cancelled"), JobState::Cancelled);
        assert_eq!(simple("Pending"), JobState::Unknown("Pending".into()));
        assert_eq!(state(r#"{"status":"Running"}"#), JobState::Running);
        let long = r#"{"status":"Cancelled - Ran too long","state":{"status":"Cancelled"}}"#;
        assert_eq!(state(long), JobState::RanTooLong);
        let failed = state(r#"{"state":{"status":"Failed","reason":"no","reason_code":"1517"}}"#);
        assert_eq!(failed, JobState::Failed { reason: "no".into(), code: Some(1517) });
    }

    #[test]
    fn an_id_that_would_change_the_path_is_refused() {
        for bad in ["", "../x", "a b", "a/b"] {
            assert!(checked_id(bad.to_owned(), "x").is_err());
        }
        assert!(checked_id("d1a2-b".to_owned(), "x").is_ok());
    }

    #[test]
    fn tags_fit_and_differ() {
        let tags = [unique_tag("a"), unique_tag("b")];
        assert_ne!(tags[0], tags[1]);
        assert!(tags[0].len() <= 86);
    }
}
