//! The two charts of the QAOA rounds: how training lowers the expected cost, and how the rounds
//! shorten the path.

use svg::node::element::{Group, Path};

use super::chart::{Axis, Chart};
use super::text;
use super::view::{Rect, px};
use crate::planner::round::Round;
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

/// Which colour is which leg, in the lower right corner.
fn names(records: &[&LegRecord], chart: &Chart, later: usize) -> Group {
    let mut entries: Vec<(String, &str, &str)> = coloured(records)
        .take(NAMED)
        .map(|(record, colour)| {
            (format!("leg {}, first round", leg_label(&record.leg)), "first", colour)
        })
        .collect();
    if records.len() > NAMED {
        let more = count(records.len() - NAMED, "more leg");
        entries.push((more, "none", "none"));
    }
    if later > 0 {
        entries.push((count(later, "later round"), "later", "#6f86a6"));
    }
    let area = chart.area();
    let (width, height) = (190.0, 16.0 * entries.len() as f64 + 6.0);
    let plate = Rect { x: area.right() - width, y: area.bottom() - height - 2.0, width, height };
    let mut group = Group::new().add(plate.element().set("class", "plate"));
    let x = area.right() - 24.0;
    for (k, (name, class, colour)) in entries.iter().enumerate() {
        let y = plate.y + 14.0 + 16.0 * k as f64;
        let swatch = Path::new().set("d", format!("M{} {}h20", px(x), px(y - 4.0)));
        group = group.add(swatch.set("class", *class).set("stroke", *colour)).add(text(
            x - 6.0,
            y,
            "small end",
            name,
        ));
    }
    group
}

/// The length of each leg's path after each round against that of the candidate it began with.
pub(super) fn lengths(records: &[&LegRecord], rect: Rect) -> Group {
    let title = "Path length against the best candidate (m)";
    let gains: Vec<Vec<f64>> = records.iter().map(|record| gains(record)).collect();
    let most = gains.iter().map(Vec::len).max().unwrap_or(0);
    if most == 0 {
        return nothing(title, rect);
    }
    let all = || gains.iter().flatten().copied();
    let (low, high) = (all().fold(0.0, f64::min), all().fold(0.0, f64::max));
    let room = (0.06 * (high - low)).max(0.05);
    let chart = Chart::new(
        rect,
        Axis::linear(0.0, (most - 1).max(1) as f64),
        Axis::linear(low - room, high + room),
    );
    let mut group = chart.axes(title, "after round (0: the best candidate)");
    for (gains, colour) in gains.iter().zip(COLOURS.into_iter().cycle()) {
        let data = chart.curve(gains.iter().enumerate().map(|(k, &gain)| (k as f64, gain)));
        let path = Path::new().set("d", data).set("class", "first").set("stroke", colour);
        group = group.add(path);
    }
    group
}

/// How much longer the path is than the first candidate, before and after each round, metres.
fn gains(record: &LegRecord) -> Vec<f64> {
    let Some(first) = record.candidates.first().map(|candidate| candidate.length) else {
        return Vec::new();
    };
    let rounds = record.rounds.iter().map(|round| round.length - first);
    std::iter::once(0.0).chain(rounds).collect()
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
