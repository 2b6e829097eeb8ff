//! IBM Quantum's REST API: <https://quantum.cloud.ibm.com/docs/en/api/qiskit-runtime-rest>.
//!
//! - `exchange`: one request and its bounded answer;
//! - `token`: the API key traded for a bearer token, in time;
//! - [`backends`]: what there is, and what it can do;
//! - [`jobs`]: create once, wait, fetch, cancel;
//! - [`sessions`]: several jobs in a row.
//!
//! Here: what is done about each status. Reading is tried again where that can help; creating never is
//! without making sure that it has not already happened ([`jobs`]).

pub mod backends;
mod exchange;
pub mod jobs;
pub mod sessions;
mod token;

use std::time::{Duration, SystemTime};

use reqwest::header::{ACCEPT, AUTHORIZATION, HeaderMap, HeaderValue};
use reqwest::{Method, StatusCode, Url};
use serde_json::Value;
use tracing::debug;

use super::account::{Credentials, Endpoints};
use super::error::IbmError;
pub(crate) use exchange::visible;
use exchange::{NoAnswer, Reply, exchange};
use token::Tokens;

/// The only version that is `live`; without the header the service answers in its oldest form.
const API_VERSION: &str = "2026-04-15";

/// Answers that are not results.
const MAX_DOCUMENT_BYTES: usize = 8 << 20;

/// How long and how often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patience {
    /// One exchange.
    pub request: Duration,
    /// How often a request is made before its failure counts.
    pub tries: u32,
    /// The pause after the first failure; doubles with each further one.
    pub backoff: Duration,
    /// The pause after 429 where the service names none (it allows 5 submissions a minute).
    pub rate_limited: Duration,
    /// How often a 429 is waited out.
    pub rate_limited_tries: u32,
    /// The pause between the first two looks at a job; grows to `poll_most`.
    pub poll: Duration,
    /// The longest pause between two looks.
    pub poll_most: Duration,
    /// How long a job is waited for although the service cannot be reached.
    pub outage: Duration,
}

impl Default for Patience {
    fn default() -> Self {
        Self {
            request: Duration::from_secs(60),
            tries: 5,
            backoff: Duration::from_millis(500),
            rate_limited: Duration::from_secs(12),
            rate_limited_tries: 10,
            poll: Duration::from_millis(500),
            poll_most: Duration::from_secs(30),
            outage: Duration::from_secs(600),
        }
    }
}

/// A client of one instance.
pub struct Client {
    http: reqwest::Client,
    endpoints: Endpoints,
    credentials: Credentials,
    tokens: Tokens,
    patience: Patience,
}

/// Why a request has no result.
enum CallError {
    /// The service refused it.
    Refused { status: u16, code: Option<i64>, error: IbmError },
    /// It has not happened.
    Failed(IbmError),
    /// It may have happened.
    Unsure(IbmError),
}

impl From<IbmError> for CallError {
    fn from(error: IbmError) -> Self {
        Self::Failed(error)
    }
}

impl CallError {
    fn into_error(self) -> IbmError {
        match self {
            Self::Refused { error, .. } | Self::Failed(error) | Self::Unsure(error) => error,
        }
    }
}

/// A request to the API.
struct Call<'a> {
    method: Method,
    url: Url,
    body: Option<&'a Value>,
    /// Whether doing it twice is the same as doing it once.
    repeatable: bool,
    /// Bytes of the answer at most.
    limit: usize,
}

impl Client {
    /// A client. Nothing is sent yet.
    ///
    /// # Errors
    /// [`IbmError::Tls`] where the system has no certificates.
    pub fn new(
        endpoints: Endpoints,
        credentials: Credentials,
        patience: Patience,
    ) -> Result<Self, IbmError> {
        // Whoever installed one first has done the same.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let http = reqwest::Client::builder()
            .user_agent(concat!("quavd/", env!("CARGO_PKG_VERSION")))
            .timeout(patience.request)
            .connect_timeout(patience.request.min(Duration::from_secs(15)))
            // A redirect would take the credentials to another host.
            .redirect(reqwest::redirect::Policy::none())
            .build()
            .map_err(|error| IbmError::Tls(error.to_string()))?;
        Ok(Self { http, endpoints, credentials, tokens: Tokens::default(), patience })
    }

    /// The address of an API path; segments are percent-encoded.
    fn url(&self, segments: &[&str]) -> Url {
        let mut url = self.endpoints.api.clone();
        if let Ok(mut path) = url.path_segments_mut() {
            path.pop_if_empty().extend(segments);
        }
        url
    }

    fn get(&self, segments: &[&str]) -> Call<'static> {
        Call {
            method: Method::GET,
            url: self.url(segments),
            body: None,
            repeatable: true,
            limit: MAX_DOCUMENT_BYTES,
        }
    }

    /// A request that is made again where that can help.
    async fn read(&self, call: Call<'_>) -> Result<Reply, IbmError> {
        self.call(call).await.map_err(CallError::into_error)
    }

    /// A request; answers with another status than 2xx are errors.
    async fn call(&self, call: Call<'_>) -> Result<Reply, CallError> {
        let what = format!("{} {}", call.method, call.url.path());
        let (mut failures, mut limited, mut refreshed) = (0, 0, false);
        loop {
            let token = self.token().await?;
            let mut request = self
                .http
                .request(call.method.clone(), call.url.clone())
                .headers(self.headers(&token)?);
            if let Some(body) = call.body {
                request = request.json(body);
            }
            let (failed, again) = match exchange(request, call.limit).await {
                Ok(reply) if reply.status.is_success() => {
                    debug!(status = reply.status.as_u16(), bytes = reply.body.len(), "{what}");
                    return Ok(reply);
                }
                Ok(reply) => {
                    debug!(status = reply.status.as_u16(), "{what}");
                    match reply.status {
                        StatusCode::UNAUTHORIZED if !refreshed => {
                            refreshed = true;
                            self.tokens.forget(&token).await;
                            continue;
                        }
                        StatusCode::TOO_MANY_REQUESTS => {
                            limited += 1;
                            if limited >= self.patience.rate_limited_tries {
                                return Err(IbmError::RateLimited { tries: limited }.into());
                            }
                            let pause = reply.retry_after.unwrap_or(self.patience.rate_limited);
                            debug!(?pause, "rate limited");
                            tokio::time::sleep(jittered(pause)).await;
                            continue;
                        }
                        status if status.is_server_error() => {
                            let (status, tries) = (status.as_u16(), failures + 1);
                            (IbmError::Unavailable { status, tries }, call.repeatable)
                        }
                        _ => return Err(self.refusal(&reply)),
                    }
                }
                Err(NoAnswer::TooLong(limit)) => {
                    let why = format!("it is longer than {limit} bytes");
                    return Err(IbmError::malformed(what, why).into());
                }
                Err(no_answer) => {
                    debug!(cause = no_answer.cause(), "{what}");
                    // What was never sent has not happened.
                    let again = call.repeatable || matches!(no_answer, NoAnswer::NotSent(_));
                    (self.unreachable(&call.url, &no_answer), again)
                }
            };
            if !again {
                return Err(CallError::Unsure(failed));
            }
            failures += 1;
            if failures >= self.patience.tries {
                return Err(failed.into());
            }
            tokio::time::sleep(self.backoff(failures)).await;
        }
    }

    fn backoff(&self, failures: u32) -> Duration {
        jittered(self.patience.backoff * 2u32.saturating_pow(failures.saturating_sub(1)).min(64))
    }

    fn unreachable(&self, url: &Url, no_answer: &NoAnswer) -> IbmError {
        let host = url.host_str().unwrap_or("the service").to_owned();
        IbmError::Unreachable { host, cause: visible(&no_answer.cause()) }
    }

    fn headers(&self, token: &super::secret::Secret) -> Result<HeaderMap, IbmError> {
        let sensitive = |text: &str| {
            let mut value = HeaderValue::from_str(text)
                .map_err(|_| IbmError::malformed("POST /identity/token", "the token is no text"))?;
            value.set_sensitive(true);
            Ok::<_, IbmError>(value)
        };
        let mut headers = HeaderMap::new();
        headers.insert(AUTHORIZATION, sensitive(&format!("Bearer {}", token.expose()))?);
        headers.insert("Service-CRN", sensitive(self.credentials.crn.expose())?);
        headers.insert("IBM-API-Version", HeaderValue::from_static(API_VERSION));
        headers.insert(ACCEPT, HeaderValue::from_static("application/json"));
        Ok(headers)
    }

    /// What a status other than 2xx, 429 and 5xx means.
    fn refusal(&self, reply: &Reply) -> CallError {
        let said = reply.said(&self.credentials);
        let (status, code) = (reply.status.as_u16(), said.code);
        let error = match (status, code) {
            (401, _) => IbmError::Unauthorised(said.text),
            (403, _) => IbmError::Forbidden(said.text),
            (404, Some(1279)) => {
                IbmError::NoSuchInstance { region: self.credentials.crn.region().to_owned() }
            }
            _ => IbmError::Refused(said.text),
        };
        CallError::Refused { status, code, error }
    }
}

/// A pause a little longer, differently each time, so that clients that failed together do not come
/// back together.
fn jittered(pause: Duration) -> Duration {
    let nanos =
        SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |t| t.subsec_nanos());
    pause.mul_f64(1.0 + 0.1 * f64::from(nanos % 1000) / 1000.0)
}
