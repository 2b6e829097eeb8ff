//! What is not clear, in words, where a mission was only judged.

use svg::node::element::Group;

use super::text;
use super::view::Rect;
use crate::replan::{LegVerdict, Verdict};
use crate::report::text::{finding, plain};

/// The height of a line, pixels, and the most letters of one.
const ROW: f64 = 21.5;
const LETTERS: usize = 130;

pub(super) fn findings(verdict: &Verdict, rect: Rect) -> Group {
    let bad: Vec<&LegVerdict> = verdict.legs.iter().filter(|leg| !leg.is_clear()).collect();
    let title = if bad.is_empty() { "Every leg is clear" } else { "Not clear" };
    let rows = (rect.height / ROW) as usize - 2;
    let mut lines: Vec<String> = bad.iter().take(rows).map(|leg| finding(leg)).collect();
    if bad.len() > rows {
        lines.push(format!("and {} more", bad.len() - rows));
    }
    let mut group = Group::new().add(text(rect.x, rect.y + 16.0, "head", title));
    for (k, line) in lines.iter().enumerate() {
        let line = plain(line);
        let short: String = line.chars().take(LETTERS).collect();
        let short = if short.len() < line.len() { short + "\u{2026}" } else { short };
        group = group.add(text(rect.x, rect.y + 16.0 + ROW * (k + 1) as f64, "small", &short));
    }
    group
}
