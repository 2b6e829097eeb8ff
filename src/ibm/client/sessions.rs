//! Batches: several jobs that the service runs close together.

use reqwest::Method;
use serde::Deserialize;
use serde_json::json;

use super::super::error::IbmError;
use super::{Call, Client};

#[derive(Deserialize)]
struct SessionDocument {
    id: String,
}

impl Client {
    /// Opens a batch (the only mode that every plan has) that lives for at most `max_ttl` seconds, and
    /// gives its id.
    ///
    /// # Errors
    /// [`IbmError`].
    pub async fn open_batch(&self, backend: &str, max_ttl: u32) -> Result<String, IbmError> {
        let body = json!({ "mode": "batch", "backend": backend, "max_ttl": max_ttl });
        // A batch that was opened twice costs nothing and closes by itself.
        let call = Call {
            method: Method::POST,
            body: Some(&body),
            repeatable: true,
            ..self.get(&["sessions"])
        };
        let SessionDocument { id } = self.read(call).await?.document("POST /sessions")?;
        let valid = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if id.is_empty() || id.len() > 36 || !id.chars().all(valid) {
            return Err(IbmError::malformed("POST /sessions", "it has no usable id"));
        }
        Ok(id)
    }

    /// Lets a batch take no further jobs; those it has still run.
    ///
    /// # Errors
    /// [`IbmError`].
    pub async fn drain_batch(&self, id: &str) -> Result<(), IbmError> {
        let body = json!({ "accepting_jobs": false });
        let call = Call {
            method: Method::PATCH,
            body: Some(&body),
            repeatable: true,
            ..self.get(&["sessions", id])
        };
        self.read(call).await.map(|_| ())
    }
}
