//! [`Secret`]: a text that must never be shown.

use std::sync::atomic::{Ordering, compiler_fence};

/// An API key or a token. It has neither `Debug` nor `Display`, so that no message, log or document can
/// hold it by accident; its memory is overwritten when it is dropped.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(String);

impl Secret {
    /// Wraps a text.
    #[must_use]
    pub fn new(text: String) -> Self {
        Self(text)
    }

    /// The text itself, for the one place that sends it.
    pub(super) fn expose(&self) -> &str {
        &self.0
    }

    /// `text` without any occurrence of the secret: what a server answers may echo it.
    pub(super) fn removed_from(&self, text: &str) -> String {
        if self.0.is_empty() { text.to_owned() } else { text.replace(&self.0, "<secret>") }
    }
}

impl Drop for Secret {
    fn drop(&mut self) {
        let mut bytes = std::mem::take(&mut self.0).into_bytes();
        bytes.fill(0);
        // The fence keeps the writes: the bytes are not read again.
        compiler_fence(Ordering::SeqCst);
        std::hint::black_box(&bytes);
    }
}
