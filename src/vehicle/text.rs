//! STATUSTEXT: the words in which an autopilot says why it refuses something.

use std::collections::VecDeque;
use std::time::Duration;

use tokio::time::Instant;

use crate::link::message::StatusText;

/// Texts kept; an autopilot that says more in a second is only repeating itself.
const MOST_TEXTS: usize = 16;
/// Bytes of one text, its chunks together.
const LONGEST_TEXT: usize = 400;

/// The latest texts of one autopilot.
#[derive(Debug, Default)]
pub(super) struct TextLog {
    texts: VecDeque<Text>,
}

#[derive(Debug)]
struct Text {
    at: Instant,
    id: u16,
    bytes: Vec<u8>,
}

impl TextLog {
    /// Takes in one text, or the next chunk of a long one.
    pub(super) fn push(&mut self, message: &StatusText, at: Instant) {
        let length = message.text.iter().position(|&byte| byte == 0).unwrap_or(message.text.len());
        let bytes = &message.text[..length];
        if message.id != 0
            && message.chunk > 0
            && let Some(text) = self.texts.iter_mut().rev().find(|text| text.id == message.id)
        {
            let room = LONGEST_TEXT.saturating_sub(text.bytes.len());
            text.bytes.extend(bytes.iter().take(room));
            text.at = at;
            return;
        }
        if self.texts.len() == MOST_TEXTS {
            self.texts.pop_front();
        }
        self.texts.push_back(Text { at, id: message.id, bytes: bytes.to_vec() });
    }

    /// The texts of the last `age`, oldest first, each once.
    pub(super) fn recent(&self, age: Duration) -> Vec<String> {
        let mut recent: Vec<String> = Vec::new();
        for text in &self.texts {
            let words = String::from_utf8_lossy(&text.bytes);
            let words: String = words.trim().chars().filter(|c| !c.is_control()).collect();
            if text.at.elapsed() <= age && !words.is_empty() && !recent.contains(&words) {
                recent.push(words);
            }
        }
        recent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(words: &str, id: u16, chunk: u8) -> StatusText {
        let mut text = [0; 50];
        text[..words.len()].copy_from_slice(words.as_bytes());
        StatusText { severity: 4, text, id, chunk }
    }

    #[tokio::test(start_paused = true)]
    async fn only_the_words_of_the_last_second_count_and_chunks_are_joined() {
        let mut log = TextLog::default();
        log.push(&text("old news", 0, 0), Instant::now());
        tokio::time::advance(Duration::from_secs(2)).await;
        log.push(&text("Fence validation ", 7, 0), Instant::now());
        log.push(&text("failed\n", 7, 1), Instant::now());
        log.push(&text("Bad lat or lon", 0, 0), Instant::now());
        log.push(&text("Bad lat or lon", 0, 0), Instant::now());
        let recent = log.recent(Duration::from_secs(1));
        assert_eq!(recent, ["Fence validation failed", "Bad lat or lon"]);
    }

    #[tokio::test(start_paused = true)]
    async fn a_flood_of_texts_costs_no_memory() {
        let mut log = TextLog::default();
        for k in 0..10_000_u32 {
            log.push(&text(&k.to_string(), 3, u8::from(k > 5_000)), Instant::now());
        }
        assert!(log.texts.len() <= MOST_TEXTS);
        assert!(log.texts.iter().all(|text| text.bytes.len() <= LONGEST_TEXT));
    }
}
