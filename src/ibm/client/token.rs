//! The bearer token: fetched from IAM with the API key, kept until most of its life is over.

use std::time::{Duration, Instant};

use serde::Deserialize;
use tokio::sync::Mutex;
use tracing::debug;

use super::super::error::IbmError;
use super::super::secret::Secret;
use super::exchange::{NoAnswer, exchange};
use super::{Client, MAX_DOCUMENT_BYTES};

const GRANT_TYPE: &str = "urn:ibm:params:oauth:grant-type:apikey";

/// A token is renewed after this share of its life (as IBM's own SDK does).
const SHARE_OF_LIFE: f64 = 0.8;

/// A token's life, whatever the answer says, is between these.
const LEAST_LIFE: f64 = 1.0;
const MOST_LIFE: f64 = 24.0 * 3600.0;

struct Token {
    secret: Secret,
    renew: Instant,
}

/// The token in use, if there is one.
#[derive(Default)]
pub(super) struct Tokens(Mutex<Option<Token>>);

impl Tokens {
    /// A token that was refused is not used again; a newer one stays.
    pub(super) async fn forget(&self, refused: &Secret) {
        let mut held = self.0.lock().await;
        if held.as_ref().is_some_and(|token| token.secret == *refused) {
            *held = None;
        }
    }
}

#[derive(Deserialize)]
struct TokenDocument {
    access_token: String,
    expires_in: f64,
}

impl Client {
    /// A token with enough of its life left.
    pub(super) async fn token(&self) -> Result<Secret, IbmError> {
        let mut held = self.tokens.0.lock().await;
        if let Some(token) = held.as_ref().filter(|token| Instant::now() < token.renew) {
            return Ok(token.secret.clone());
        }
        let token = self.new_token().await?;
        let secret = token.secret.clone();
        *held = Some(token);
        Ok(secret)
    }

    async fn new_token(&self) -> Result<Token, IbmError> {
        const WHAT: &str = "POST /identity/token";
        let mut url = self.endpoints.iam.clone();
        if let Ok(mut path) = url.path_segments_mut() {
            path.pop_if_empty().extend(["identity", "token"]);
        }
        let mut failures = 0;
        loop {
            let asked = Instant::now();
            let form = [
                ("grant_type", GRANT_TYPE),
                ("apikey", self.credentials.key.expose()),
                ("response_type", "cloud_iam"),
            ];
            let request = self.http.post(url.clone()).form(&form);
            let failed = match exchange(request, MAX_DOCUMENT_BYTES).await {
                Ok(reply) if reply.status.is_success() => {
                    debug!("a new bearer token");
                    let TokenDocument { access_token, expires_in } = reply
                        .document(WHAT)
                        // The parser's message could quote the token.
                        .map_err(|_| IbmError::malformed(WHAT, "it holds no token"))?;
                    let life = if expires_in.is_finite() { expires_in } else { LEAST_LIFE };
                    let life = SHARE_OF_LIFE * life.clamp(LEAST_LIFE, MOST_LIFE);
                    return Ok(Token {
                        secret: Secret::new(access_token),
                        renew: asked + Duration::from_secs_f64(life),
                    });
                }
                Ok(reply) if reply.status.is_server_error() => {
                    IbmError::Unavailable { status: reply.status.as_u16(), tries: failures + 1 }
                }
                Ok(reply) if reply.status.as_u16() == 429 => {
                    let pause = reply.retry_after.unwrap_or(self.patience.rate_limited);
                    tokio::time::sleep(pause).await;
                    IbmError::RateLimited { tries: failures + 1 }
                }
                Ok(reply) => {
                    return Err(IbmError::KeyRejected(reply.said(&self.credentials).text));
                }
                Err(no_answer @ NoAnswer::TooLong(_)) => {
                    return Err(IbmError::malformed(WHAT, no_answer.cause()));
                }
                Err(no_answer) => self.unreachable(&url, &no_answer),
            };
            failures += 1;
            if failures >= self.patience.tries {
                return Err(failed);
            }
            tokio::time::sleep(self.backoff(failures)).await;
        }
    }
}
