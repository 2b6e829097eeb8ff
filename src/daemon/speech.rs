//! What the daemon tells a pilot: STATUSTEXT in words that fit a ground station's message line, and
//! NAMED_VALUE_FLOAT for its instruments.

use std::time::Instant;

use mavlink::dialects::ardupilotmega::NAMED_VALUE_FLOAT_DATA;

use crate::link::message::StatusText;
use crate::link::{Link, LinkError};
use crate::replan::Replanned;
use crate::report::stretch::stretches;
use crate::report::text::leg_label;

/// Bytes of one STATUSTEXT.
const CHUNK: usize = 50;
/// Bytes that a text may have in all; longer ones are in the log and in the report.
const LONGEST: usize = 200;
/// Legs told one by one.
const MOST_LEGS: usize = 3;

/// `MAV_SEVERITY`, the ones that are used here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Severity {
    /// Something the pilot must act on at once.
    Critical = 2,
    /// Something the pilot should act on.
    Warning = 4,
    /// Something the pilot wants to know.
    Notice = 5,
    /// Something that may interest.
    Info = 6,
}

/// One text for a pilot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Text {
    pub(super) severity: Severity,
    pub(super) words: String,
}

impl Text {
    pub(super) fn new(severity: Severity, words: impl AsRef<str>) -> Self {
        Self { severity, words: format!("QUAV: {}", words.as_ref()) }
    }
}

/// The daemon's voice on one link.
pub(super) struct Speaker {
    link: Link,
    began: Instant,
    next_id: u16,
}

impl Speaker {
    pub(super) fn new(link: Link, began: Instant) -> Self {
        Self { link, began, next_id: 1 }
    }

    /// Says one text, in chunks where it is long.
    pub(super) async fn say(&mut self, text: &Text) -> Result<(), LinkError> {
        tracing::info!(severity = ?text.severity, "{}", text.words);
        for message in chunks(text, self.next_id) {
            self.link.send(&message).await?;
        }
        self.next_id = self.next_id.checked_add(1).unwrap_or(1);
        Ok(())
    }

    /// Shows a number under a name of at most ten characters.
    pub(super) async fn show(&mut self, name: &str, value: f64) -> Result<(), LinkError> {
        let mut shown = NAMED_VALUE_FLOAT_DATA {
            time_boot_ms: u32::try_from(self.began.elapsed().as_millis()).unwrap_or(u32::MAX),
            value: value as f32,
            ..NAMED_VALUE_FLOAT_DATA::default()
        };
        for (to, from) in shown.name.iter_mut().zip(name.bytes()) {
            *to = from;
        }
        self.link.send(&shown).await
    }
}

/// A text as the messages that carry it: `id` is not 0 where there are several, and a chunk that
/// is not full ends it.
fn chunks(text: &Text, id: u16) -> Vec<StatusText> {
    let bytes = ascii(&text.words);
    let severity = text.severity as u8;
    if bytes.len() <= CHUNK {
        return vec![StatusText { severity, text: filled(&bytes), id: 0, chunk: 0 }];
    }
    let mut parts: Vec<&[u8]> = bytes.chunks(CHUNK).collect();
    if bytes.len().is_multiple_of(CHUNK) {
        parts.push(&[]);
    }
    let numbered = (0..).zip(parts);
    numbered.map(|(chunk, part)| StatusText { severity, text: filled(part), id, chunk }).collect()
}

fn filled(part: &[u8]) -> [u8; CHUNK] {
    let mut text = [0; CHUNK];
    text[..part.len()].copy_from_slice(part);
    text
}

/// Ground stations show ASCII everywhere, and other characters in places.
fn ascii(words: &str) -> Vec<u8> {
    let mut bytes: Vec<u8> = words
        .chars()
        .map(|c| match c {
            '–' | '−' => b'-',
            c if c.is_ascii() && !c.is_control() => c as u8,
            _ => b'?',
        })
        .collect();
    if bytes.len() > LONGEST {
        bytes.truncate(LONGEST - 3);
        bytes.extend(b"...");
    }
    bytes
}

/// What a plan did, leg by leg where these are few.
pub(super) fn about_plan(result: &Replanned) -> Vec<Text> {
    let say = |words: String| Text::new(Severity::Notice, words);
    let (before, after) = (result.before.length().0, result.after.length().0);
    let changed: Vec<_> = stretches(result).into_iter().filter(|leg| leg.replanned).collect();
    if changed.is_empty() {
        return vec![say("mission is clear, nothing to change".to_owned())];
    }
    if changed.len() > MOST_LEGS {
        return vec![say(format!(
            "{} legs re-planned, {:+.0} m, clearance {}",
            changed.len(),
            after - before,
            metres(result.after.clearance().0)
        ))];
    }
    changed
        .iter()
        .map(|leg| {
            let name = leg_label(&leg.before.leg).replace(" - ", "-");
            let rise = leg.length.0 - leg.before.length.0;
            say(format!(
                "leg {name} re-planned, {rise:+.0} m, clearance {}",
                metres(leg.clearance.0)
            ))
        })
        .collect()
}

/// That something else was used than what was asked for.
pub(super) fn about_fallback(fallback: &str) -> Text {
    Text::new(Severity::Notice, format!("fallback: {fallback}"))
}

fn metres(clearance: f64) -> String {
    if clearance.is_finite() { format!("{clearance:.1} m") } else { "free".to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replan::Options;
    use crate::report::samples::{self, BARN, POND};

    fn text(words: &str) -> Text {
        Text { severity: Severity::Notice, words: words.to_owned() }
    }

    #[test]
    fn a_short_text_is_one_message_and_a_long_one_is_chunks_that_end() {
        let short = chunks(&text("QUAV: leg 3-4 re-planned, +38 m, clearance 5.2 m"), 7);
        assert_eq!((short.len(), short[0].id, short[0].severity), (1, 0, 5));
        for length in [51, 99, 100, 101, 150] {
            let long = chunks(&text(&"x".repeat(length)), 7);
            let parts = (0..).zip(&long);
            assert!(parts.clone().all(|(k, part)| part.chunk == k && part.id == 7), "{long:?}");
            let bytes: Vec<u8> = long.iter().flat_map(|part| part.text).collect();
            assert_eq!(bytes.iter().filter(|&&byte| byte == b'x').count(), length);
            assert_eq!(bytes.last(), Some(&0), "the last chunk ends the text");
        }
    }

    #[test]
    fn whatever_a_text_holds_it_stays_short_and_printable() {
        let long = chunks(&text(&format!("λ\u{1b}[31m{}", "y".repeat(1000))), 1);
        assert!(long.len() <= LONGEST / CHUNK + 1);
        let bytes = long.iter().flat_map(|part| part.text);
        assert!(bytes.filter(|&byte| byte != 0).all(|byte| (0x20..0x7f).contains(&byte)));
    }

    #[test]
    fn the_words_about_a_leg_fit_one_message() {
        let options = Options::default();
        for scene in [POND, BARN] {
            let told = about_plan(&samples::planned(scene, &options));
            assert!(!told.is_empty());
            for text in told {
                assert!(text.words.len() <= CHUNK, "{text:?}");
                assert!(
                    text.words.starts_with("QUAV: leg ") && text.words.contains(" re-planned, +")
                );
            }
        }
    }

    #[test]
    fn a_clear_mission_is_called_clear() {
        let told = about_plan(&samples::planned_without_fences(BARN, &Options::default()));
        assert_eq!(told, [Text::new(Severity::Notice, "mission is clear, nothing to change")]);
    }
}
