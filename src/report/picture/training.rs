//! The two charts of the QAOA rounds: how training lowers the expected cost, and how the rounds
//! shorten the path.

use svg::node::element::{Group, Path};

use super::chart::{Axis, Chart};
use super::text;
use super::view::Rect;
use crate::planner::polyline::distance;
use crate::planner::rounds::Round;
use crate::replan::LegRecord;
use crate::report::text::{count, leg_label};

/// The colours of legs, again from the first where there are more.
const COLOURS: [&str; 6] = ["#1257c0", "#d9730d", "#1a9850", "#b5179e", "#0e9aa7", "#7a5c00"];

/// Curves of later rounds at most; of more, only some are drawn.
const LATER: usize = 200;

/// Legs with a name in the chart.
const NAMED: usize = 6;

/// ⟨H⟩ above the exact optimum over the steps of the training: the first round of each leg in
/// colour, all others lightly.
pub(super) fn losses(records: &[&LegRecord], rect: Rect) -> Group {
    let title = "QAOA training: expected cost above the exact optimum (m)";
    let rounds = || records.iter().flat_map(|record| &record.rounds);
    let excess: Vec<f64> = rounds().flat_map(above_optimum).collect();
    if excess.is_empty() {
        return nothing(title, rect);
    }
    let steps = rounds().map(|round| round.loss.len()).max().unwrap_or(1).saturating_sub(1);
    let low = excess.iter().copied().filter(|e| *e > 0.0).fold(f64::INFINITY, f64::min);
    let high = excess.iter().copied().fold(0.0, f64::max);
    let chart =
        Chart::new(rect, Axis::linear(0.0, steps as f64), Axis::decades(low.min(high), high, 5));
    let curve = |round| {
        let steps = above_optimum(round).enumerate();
        chart.curve(steps.map(|(step, excess)| (step as f64, excess)))
    };
    let later: Vec<&Round> =
        records.iter().flat_map(|record| record.rounds.iter().skip(1)).collect();
    let every = later.len().div_ceil(LATER).max(1);
    let light: String = later.iter().step_by(every).map(|round| curve(round)).collect();
    let mut group =
        chart.axes(title, "Adam step").add(Path::new().set("d", light).set("class", "later"));
    for (record, colour) in coloured(records) {
        if let Some(first) = record.rounds.first() {
            let path = Path::new().set("d", curve(first)).set("class", "first");
            group = group.add(path.set("stroke", colour));
        }
    }
    group.add(names(records, &chart, later.len()))
}

/// ⟨H⟩ of a training above the exact optimum, or above the best value known where that is out of
/// reach.
fn above_optimum(round: &Round) -> impl Iterator<Item = f64> + '_ {
    let least = round.loss.iter().copied().fold(round.best_sample, f64::min);
    let optimum = if round.exact_optimum.is_finite() { round.exact_optimum } else { least };
    round.loss.iter().map(move |loss| (loss - optimum).max(0.0)).filter(|e| e.is_finite())
}

fn coloured<'a>(
    records: &'a [&'a LegRecord],
) -> impl Iterator<Item = (&'a LegRecord, &'static str)> {
    records.iter().copied().zip(COLOURS.into_iter().cycle())
}

/// Which colour is which leg, in the upper right corner.
fn names(records: &[&LegRecord], chart: &Chart, later: usize) -> Group {
    let area = chart.area();
    let mut group = Group::new();
    let mut y = area.y + 12.0;
    let mut entry = |group: Group, name: &str, class: &str, colour: Option<&str>| {
        let x = area.right() - 20.0;
        let mut swatch = Path::new().set("d", format!("M{x} {}h20", y - 4.0)).set("class", class);
        if let Some(colour) = colour {
            swatch = swatch.set("stroke", colour);
        }
        let group = group.add(swatch).add(text(x - 6.0, y, "small end", name));
        y += 16.0;
        group
    };
    for (record, colour) in coloured(records).take(NAMED) {
        let name = format!("leg {}, first round", leg_label(&record.leg));
        group = entry(group, &name, "first", Some(colour));
    }
    if records.len() > NAMED {
        let name = format!("and {} more", count(records.len() - NAMED, "leg"));
        group = entry(group, &name, "none", None);
    }
    if later > 0 {
        let name = count(later, "later round");
        group = entry(group, &name, "later", None);
    }
    group
}

/// The length of each leg's path after each round, as a detour over the straight line.
pub(super) fn lengths(records: &[&LegRecord], rect: Rect) -> Group {
    let title = "Detour over the straight line (%)";
    let detours: Vec<Vec<f64>> = records.iter().map(|record| detours(record)).collect();
    let all = || detours.iter().flatten().copied();
    let most = detours.iter().map(Vec::len).max().unwrap_or(0);
    let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max));
    if most == 0 || !low.is_finite() {
        return nothing(title, rect);
    }
    let room = (0.08 * (high - low)).max(0.02);
    let chart = Chart::new(
        rect,
        Axis::linear(0.0, (most - 1).max(1) as f64),
        Axis::linear((low - room).max(0.0), high + room),
    );
    let mut group = chart.axes(title, "after round (0: the best candidate)");
    for (detours, colour) in detours.iter().zip(COLOURS.into_iter().cycle()) {
        let data = chart.curve(detours.iter().enumerate().map(|(k, &d)| (k as f64, d)));
        let path = Path::new().set("d", data).set("class", "first").set("stroke", colour);
        group = group.add(path);
    }
    group
}

/// The detour of the first candidate and after each round, percent.
fn detours(record: &LegRecord) -> Vec<f64> {
    let straight = match (record.points.first(), record.points.last()) {
        (Some(&start), Some(&goal)) => distance(start, goal),
        _ => return Vec::new(),
    };
    let first = record.candidates.first().map(|candidate| candidate.length);
    let lengths = first.into_iter().chain(record.rounds.iter().map(|round| round.length));
    lengths.map(|length| (length / straight - 1.0) * 100.0).filter(|d| d.is_finite()).collect()
}

fn nothing(title: &str, rect: Rect) -> Group {
    let y = rect.y + 16.0;
    Group::new().add(text(rect.x, y, "head", title)).add(text(
        rect.x,
        y + 24.0,
        "small",
        "No leg needed a QAOA round.",
    ))
}
