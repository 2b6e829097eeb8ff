//! One HTTP exchange: a bounded answer, and what its error body says.

use std::time::Duration;

use reqwest::header::{CONTENT_TYPE, RETRY_AFTER};
use reqwest::{RequestBuilder, StatusCode};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::super::account::Credentials;
use super::super::error::IbmError;

/// What a server says in an error is shown up to this length.
const MAX_SAID: usize = 400;

/// A longer pause than this is not slept through on a server's word.
const MAX_RETRY_AFTER: Duration = Duration::from_secs(300);

/// Why no answer came.
#[derive(Debug)]
pub(super) enum NoAnswer {
    /// Nothing reached the server: it has not acted.
    NotSent(String),
    /// The connection broke or took too long after the request had gone out: it may have acted.
    Cut(String),
    /// More than the limit.
    TooLong(usize),
}

impl NoAnswer {
    pub(super) fn cause(&self) -> String {
        match self {
            Self::NotSent(cause) | Self::Cut(cause) => cause.clone(),
            Self::TooLong(limit) => format!("the answer is longer than {limit} bytes"),
        }
    }
}

/// An answer of any status.
pub(super) struct Reply {
    pub(super) status: StatusCode,
    pub(super) body: Vec<u8>,
    pub(super) retry_after: Option<Duration>,
    is_json: bool,
}

/// Sends a request and reads at most `limit` bytes of the answer.
pub(super) async fn exchange(request: RequestBuilder, limit: usize) -> Result<Reply, NoAnswer> {
    // The error's address could hold what a user typed into it; causes are enough.
    let mut response = request.send().await.map_err(|error| {
        let not_sent = error.is_connect() || error.is_builder();
        let cause = causes(&error.without_url());
        if not_sent { NoAnswer::NotSent(cause) } else { NoAnswer::Cut(cause) }
    })?;
    let header = |name| response.headers().get(name).and_then(|value| value.to_str().ok());
    let retry_after = header(RETRY_AFTER)
        .and_then(|text| text.trim().parse::<f64>().ok())
        .filter(|seconds| seconds.is_finite() && *seconds >= 0.0)
        .map(|seconds| Duration::from_secs_f64(seconds.min(MAX_RETRY_AFTER.as_secs_f64())));
    let is_json = header(CONTENT_TYPE).is_some_and(|kind| kind.contains("json"));
    let status = response.status();
    let mut body = Vec::new();
    loop {
        match response.chunk().await {
            Ok(Some(chunk)) if body.len() + chunk.len() > limit => {
                return Err(NoAnswer::TooLong(limit));
            }
            Ok(Some(chunk)) => body.extend_from_slice(&chunk),
            Ok(None) => break,
            Err(error) => return Err(NoAnswer::Cut(causes(&error.without_url()))),
        }
    }
    Ok(Reply { status, body, retry_after, is_json })
}

fn causes(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        let cause_text = cause.to_string();
        if !text.contains(&cause_text) {
            text.push_str(": ");
            text.push_str(&cause_text);
        }
        source = cause.source();
    }
    text
}

impl Reply {
    /// The body as a document.
    pub(super) fn document<T: DeserializeOwned>(&self, what: &str) -> Result<T, IbmError> {
        serde_json::from_str(self.text(what)?)
            .map_err(|error| IbmError::malformed(what, error.to_string()))
    }

    /// The body as text, if it says that it is JSON (`/jobs/` answers 200 with a web page).
    pub(super) fn text(&self, what: &str) -> Result<&str, IbmError> {
        if !self.is_json {
            return Err(IbmError::malformed(what, "it is no JSON; check the API's address"));
        }
        std::str::from_utf8(&self.body).map_err(|_| IbmError::malformed(what, "it is not UTF-8"))
    }

    /// What an error body says.
    pub(super) fn said(&self, credentials: &Credentials) -> Said {
        let body: ErrorBody = serde_json::from_slice(&self.body).unwrap_or_default();
        let ErrorBody { errors, error, error_code, error_message, trace } = body;
        let first = errors.into_iter().next().or(error);
        let ErrorItem { code, message, solution } = first.unwrap_or_default();
        let code = code.as_ref().and_then(as_code);
        let mut text = message.or(error_message).unwrap_or_else(|| {
            self.status.canonical_reason().unwrap_or("no reason given").to_owned()
        });
        if let Some(solution) = solution.filter(|solution| !solution.is_empty()) {
            text = format!("{text} {solution}");
        }
        let text = visible(&credentials.removed_from(&text));
        let mut notes = vec![format!("HTTP {}", self.status.as_u16())];
        notes.extend(code.map(|code| format!("code {code}")));
        notes.extend(error_code.map(|code| visible(&code)));
        notes.extend(trace.map(|trace| format!("trace {}", visible(&trace))));
        Said { code, text: format!("{text} [{}]", notes.join(", ")) }
    }
}

/// A server's text on one line, bounded.
pub(crate) fn visible(text: &str) -> String {
    let mut line: String =
        text.chars().take(MAX_SAID).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.chars().nth(MAX_SAID).is_some() {
        line.push('…');
    }
    line.trim().to_owned()
}

/// What a server said about an error.
pub(super) struct Said {
    pub(super) code: Option<i64>,
    pub(super) text: String,
}

/// The three forms of error bodies: the API's, its older one, and IAM's.
#[derive(Default, Deserialize)]
#[serde(default)]
struct ErrorBody {
    errors: Vec<ErrorItem>,
    error: Option<ErrorItem>,
    #[serde(rename = "errorCode")]
    error_code: Option<String>,
    #[serde(rename = "errorMessage")]
    error_message: Option<String>,
    trace: Option<String>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct ErrorItem {
    /// A number in practice; the documents also have strings.
    code: Option<Value>,
    message: Option<String>,
    solution: Option<String>,
}

/// A code as a number or as its text.
pub(super) fn as_code(value: &Value) -> Option<i64> {
    value.as_i64().or_else(|| value.as_str()?.trim().parse().ok())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ibm::secret::Secret;

    const CRN: &str = "crn:v1:bluemix:public:quantum-computing:us-east:a/0123:1111::";

    fn said(body: &str) -> Said {
        let reply = Reply {
            status: StatusCode::BAD_REQUEST,
            body: body.into(),
            retry_after: None,
            is_json: true,
        };
        let key = Secret::new("the-key".to_owned());
        reply.said(&Credentials { key, crn: CRN.parse().ok().unwrap() })
    }

    #[test]
    fn every_form_of_error_body_is_read() {
        let new = said(r#"{"errors":[{"code":1517,"message":"no","solution":"do"}],"trace":"t"}"#);
        assert_eq!(
            (new.code, new.text.as_str()),
            (Some(1517), "no do [HTTP 400, code 1517, trace t]")
        );
        assert_eq!(said(r#"{"errors":[{"code":"1234","message":"x"}]}"#).code, Some(1234));
        assert_eq!(said(r#"{"error":{"code":7,"message":"old"}}"#).code, Some(7));
        let iam = said(r#"{"errorCode":"BXNIM0415E","errorMessage":"Provided API key"}"#);
        assert_eq!(iam.text, "Provided API key [HTTP 400, BXNIM0415E]");
        assert_eq!(said("<html>").text, "Bad Request [HTTP 400]");
    }

    #[test]
    fn what_a_server_repeats_of_the_credentials_is_left_out() {
        let body = format!(r#"{{"errors":[{{"code":1279,"message":"CRN {CRN} for the-key"}}]}}"#);
        let said = said(&body);
        assert!(said.text.starts_with("CRN <crn> for <secret>"), "{}", said.text);
    }

    #[test]
    fn a_long_or_odd_text_is_one_bounded_line() {
        let long = visible(&format!("a\n\u{1b}[31m{}", "b".repeat(10_000)));
        assert!(long.chars().count() <= MAX_SAID + 1 && !long.chars().any(char::is_control));
    }
}
