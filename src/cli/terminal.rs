//! What the terminal can show. (`NO_COLOR`: no-color.org.)

use std::io::IsTerminal;

/// Whether a stream is a terminal that colours may be written to.
#[must_use]
pub fn has_colours(stream: &impl IsTerminal) -> bool {
    stream.is_terminal() && !is_set("NO_COLOR") && !is_dumb()
}

/// Whether stdout is a terminal that can show braille dots.
#[must_use]
pub fn shows_dots() -> bool {
    // What a program's text is encoded in, most important first (POSIX).
    let locale = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().find(|name| is_set(name));
    let locale = locale.and_then(std::env::var_os).unwrap_or_default();
    let locale = locale.to_string_lossy().to_lowercase();
    let is_utf8 = locale.contains("utf-8") || locale.contains("utf8");
    std::io::stdout().is_terminal() && is_utf8 && !is_dumb()
}

fn is_set(name: &str) -> bool {
    std::env::var_os(name).is_some_and(|value| !value.is_empty())
}

fn is_dumb() -> bool {
    std::env::var_os("TERM").is_some_and(|term| term == "dumb")
}
