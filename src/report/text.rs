//! Plain text for people: lines of a terminal's width, numbers, names of legs.

use std::time::Duration;

use crate::mission::Leg;
use crate::mission::legs::{LegKind, ReturnTo, number as item_number};
use crate::planner::round::Round;
use crate::replan::LegVerdict;
use crate::units::Metres;

/// The width that everything fits into.
pub(super) const WIDTH: usize = 80;

/// A space that no line is broken at.
pub(super) const UNBROKEN: char = '\u{a0}';

/// Text from outside without what would control a terminal or is not allowed in XML.
pub(super) fn plain(text: &str) -> String {
    let allowed = |c: char| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}');
    text.chars().map(|c| if allowed(c) { c } else { '\u{fffd}' }).collect()
}

/// Appends a paragraph broken into lines of [`WIDTH`]; lines after the first are indented. A word
/// that is longer than a line is broken as well, a number stays with its unit ([`UNBROKEN`]).
pub(crate) fn push_wrapped(out: &mut String, text: &str, indent: usize) {
    let mut width = 0;
    for word in plain(text).split_ascii_whitespace() {
        let mut letters: Vec<char> =
            word.chars().map(|c| if c == UNBROKEN { ' ' } else { c }).collect();
        if width > 0 && width + 1 + letters.len() > WIDTH {
            out.push('\n');
            out.extend(std::iter::repeat_n(' ', indent));
            width = indent;
        } else if width > 0 {
            out.push(' ');
            width += 1;
        }
        while width + letters.len() > WIDTH {
            let rest = letters.split_off(WIDTH - width);
            out.extend(letters);
            out.push('\n');
            out.extend(std::iter::repeat_n(' ', indent));
            (letters, width) = (rest, indent);
        }
        width += letters.len();
        out.extend(letters);
    }
    out.push('\n');
}

/// A clearance to the centimetre, never more than it is; `-` where there is nothing to be near to.
pub(super) fn clearance(metres: Metres) -> String {
    if !metres.0.is_finite() {
        return "-".to_owned();
    }
    // 1e-6: what decimal fractions lose in binary.
    format!("{:.2} m", (metres.0 * 100.0 + 1e-6).floor() / 100.0)
}

/// A length to the centimetre that stays on one line.
pub(super) fn unbroken(metres: Metres) -> String {
    format!("{:.2}{UNBROKEN}m", metres.0)
}

/// The change from one length to another, such as `+6.9 %`; `-` where there is none to compare.
pub(super) fn change(from: Metres, to: Metres) -> String {
    let share = (to / from - 1.0) * 100.0;
    if share.is_finite() { format!("{share:+.1} %") } else { "-".to_owned() }
}

/// How near the best sample of any round came to the exact optimum of its chain.
pub(super) fn best_gap(rounds: &[Round]) -> String {
    let gaps = rounds.iter().map(|round| round.gap).filter(|gap| gap.is_finite());
    gaps.reduce(f64::min).map_or_else(|| "-".to_owned(), metres_above)
}

/// A gap in metres; `-` where it is not known.
pub(super) fn metres_above(gap: f64) -> String {
    if gap.is_finite() { format!("{:.2} m", (gap - 1e-9).max(0.0)) } else { "-".to_owned() }
}

/// A duration in at most five characters and a unit.
pub(super) fn duration(time: Duration) -> String {
    match time.as_secs_f64() {
        seconds if seconds < 1.0 => format!("{:.0} ms", seconds * 1e3),
        seconds if seconds < 600.0 => format!("{seconds:.1} s"),
        seconds => format!("{:.0} min", seconds / 60.0),
    }
}

/// A count with its noun.
pub(super) fn count(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// The first of some names, and how many there are more.
pub(crate) fn named(names: &[String]) -> String {
    const NAMED: usize = 3;
    let first = names.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(NAMED) {
        0 => first,
        more => format!("{first} and {more} more"),
    }
}

/// A leg in a table's cell: items as ground stations count them.
pub(crate) fn leg_label(leg: &Leg) -> String {
    let item = |item: Option<usize>| {
        item.map_or_else(|| "start".to_owned(), |item| item_number(item).to_string())
    };
    let from = item(leg.from.item);
    let to = match leg.kind {
        LegKind::Flown | LegKind::Takeoff => item(leg.to.item),
        LegKind::Stay => return format!("at {}", item(leg.to.item)),
        LegKind::Return(ReturnTo::Home) => "home".to_owned(),
        LegKind::Return(ReturnTo::Rally(rally)) => format!("rally {}", rally + 1),
        LegKind::Return(ReturnTo::LandingSequence(entry)) => {
            format!("landing {}", item_number(entry))
        }
    };
    match leg.jump {
        Some(jump) => format!("{from} - {to} by {}", item_number(jump)),
        None => format!("{from} - {to}"),
    }
}

/// What is wrong with a leg, as a sentence.
pub(super) fn finding(verdict: &LegVerdict) -> String {
    let name = verdict.leg.name();
    if let Some(limit) = &verdict.limit {
        return format!("The {name} {limit}.");
    }
    match &verdict.blocker {
        None => format!("The {name} is clear."),
        Some((region, true)) => format!("The {name} meets {region}."),
        Some((region, false)) => {
            format!("The {name} comes within {} of {region}.", clearance(verdict.clearance))
        }
    }
}

/// A table: the first column to the left, the others to the right, two spaces between them.
pub(super) struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    pub(super) fn new<const N: usize>(heads: [&str; N]) -> Self {
        Self { rows: vec![heads.map(str::to_owned).to_vec()] }
    }

    pub(super) fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.rows.push(cells.to_vec());
    }

    /// Appends it, each row on a line.
    pub(super) fn push_to(&self, out: &mut String) {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(width).collect();
        for row in &self.rows {
            let mut line = String::new();
            for (column, (cell, &width)) in row.iter().zip(&widths).enumerate() {
                if column == 0 {
                    line.push_str(&format!("{cell:<width$}"));
                } else {
                    line.push_str(&format!("  {cell:>width$}"));
                }
            }
            out.push_str(line.trim_end());
            out.push('\n');
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clearance_is_never_rounded_up() {
        assert_eq!(clearance(Metres(4.999)), "4.99 m");
        assert_eq!(clearance(Metres(5.0)), "5.00 m");
        assert_eq!(clearance(Metres(0.29)), "0.29 m");
        assert_eq!(clearance(Metres::INFINITY), "-");
    }

    #[test]
    fn a_number_stays_on_the_line_of_its_unit() {
        let mut out = String::new();
        push_wrapped(&mut out, &format!("{} {}", "x".repeat(75), unbroken(Metres(5.0))), 2);
        assert_eq!(out, format!("{}\n  5.00 m\n", "x".repeat(75)));
    }

    #[test]
    fn a_word_longer_than_a_line_is_broken() {
        let mut out = String::new();
        push_wrapped(&mut out, &"y".repeat(100), 4);
        assert_eq!(out, format!("{}\n    {}\n", "y".repeat(80), "y".repeat(20)));
    }

    #[test]
    fn control_characters_do_not_reach_the_terminal() {
        assert_eq!(plain("a\u{1b}[2Jb\u{9b}c"), "a\u{fffd}[2Jb\u{fffd}c");
    }

    #[test]
    fn a_change_without_a_length_to_compare_is_left_out() {
        assert_eq!(change(Metres(200.0), Metres(213.0)), "+6.5 %");
        assert_eq!(change(Metres::ZERO, Metres::ZERO), "-");
        assert_eq!(change(Metres::ZERO, Metres(3.0)), "-");
    }

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let mut table = Table::new(["a", "value"]);
        table.row(["longer".to_owned(), "1".to_owned()]);
        let mut out = String::new();
        table.push_to(&mut out);
        assert_eq!(out, "a       value\nlonger      1\n");
    }
}
