//! The tables of the report.

use serde_json::Value;

use super::html::table;
use crate::planner::round::{Challenger, Round};
use crate::replan::{LegRecord, Options, Replanned};
use crate::report::json::{SettingsDocument, TimeDocument};
use crate::report::stretch::{Stretch, stretches};
use crate::report::text::{best_gap, change, clearance, count, duration, leg_label, metres_above};

/// Every leg of the original mission with what is flown for it now.
pub(super) fn legs(planned: &Replanned) -> String {
    let rows: Vec<Vec<String>> = stretches(planned).iter().map(leg).collect();
    let heads = [
        "leg",
        "straight",
        "flown",
        "detour",
        "clearance",
        "rounds",
        "gap to optimum",
        "engine",
        "time",
    ];
    table("Legs of the mission, items as ground stations number them", &heads, &rows)
}

fn leg(stretch: &Stretch<'_>) -> Vec<String> {
    let straight = stretch.before.length;
    let unknown = || "-".to_owned();
    let record = stretch.record;
    let engine = record.and_then(|record| record.rounds.first()).map(|round| {
        format!("{}, {} qubits \u{d7} {} layers", round.engine, round.qubits, round.layers)
    });
    vec![
        leg_label(&stretch.before.leg),
        straight.to_string(),
        stretch.length.to_string(),
        if stretch.replanned { change(straight, stretch.length) } else { unknown() },
        clearance(stretch.clearance),
        record.map_or_else(unknown, |record| record.rounds.len().to_string()),
        record.map_or_else(unknown, |record| best_gap(&record.rounds)),
        engine.unwrap_or_else(unknown),
        record.map_or_else(unknown, |record| {
            let times = record.times;
            duration(times.candidates + times.qaoa + times.finish)
        }),
    ]
}

/// The rounds of a leg.
pub(super) fn rounds(record: &LegRecord) -> String {
    let rows: Vec<Vec<String>> = record
        .rounds
        .iter()
        .enumerate()
        .map(|(index, round)| {
            vec![
                (index + 1).to_string(),
                challenger(round).to_owned(),
                round.qubits.to_string(),
                cost(round.loss.first()),
                cost(round.loss.last()),
                cost(Some(&round.best_sample)),
                cost(Some(&round.exact_optimum)),
                metres_above(round.gap),
                probability(round.p_optimum),
                format!("{:.2}", round.length),
                if round.improved { "yes" } else { "no" }.to_owned(),
            ]
        })
        .collect();
    let heads = [
        "round",
        "challenger",
        "qubits",
        "loss, first",
        "loss, last",
        "best sample",
        "optimum",
        "gap",
        "P(optimum)",
        "path, m",
        "improved",
    ];
    table("Energies are metres of path; a collision counts the penalty in them", &heads, &rows)
}

/// What the path of a leg was before the first round and after each, a line for each.
pub(super) fn told_rounds(record: &LegRecord) -> Vec<String> {
    let of = record.rounds.len();
    let first = match record.candidates.first() {
        Some(candidate) => {
            format!("Before the first round: candidate of {:.2} m", candidate.length)
        }
        None => "Before the first round".to_owned(),
    };
    let told = |(index, round): (usize, &Round)| {
        format!(
            "Round {} of {of}: {}, {} on {}, loss {} \u{2192} {}, best sample {} above the optimum, \
             path {:.2} m{}",
            index + 1,
            challenger(round),
            count(round.qubits, "qubit"),
            round.engine,
            cost(round.loss.first()),
            cost(round.loss.last()),
            metres_above(round.gap),
            round.length,
            if round.improved { ", improved" } else { "" },
        )
    };
    std::iter::once(first).chain(record.rounds.iter().enumerate().map(told)).collect()
}

/// The settings by the names of their options; what was not asked for is left out.
pub(super) fn settings(options: &Options) -> String {
    let document = serde_json::to_value(SettingsDocument::from(options)).unwrap_or_default();
    let rows: Vec<Vec<String>> = document
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(_, value)| !is_empty(value))
        .map(|(name, value)| {
            let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
            vec![name.replace('_', " "), value]
        })
        .collect();
    let table = table("Settings", &["setting", "value"], &rows);
    format!("<div class=\"settings\">{table}</div>\n")
}

/// Nothing, or a list or an object of nothing.
fn is_empty(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Array(list) => list.is_empty(),
        Value::Object(object) => object.values().all(is_empty),
        _ => false,
    }
}

/// Where the time went.
pub(super) fn times(times: &TimeDocument) -> String {
    let row = |name: &str, ms: f64| vec![name.to_owned(), format!("{ms:.1}")];
    let rows = [
        row("reading", times.load),
        row("candidates", times.candidates),
        row("QAOA", times.qaoa),
        row("finish", times.finish),
        row("in all", times.total),
    ];
    table("Where the time went", &["step", "ms"], &rows)
}

fn challenger(round: &Round) -> &'static str {
    match round.challenger {
        Challenger::Route => "another route",
        Challenger::Refinement => "refinement",
    }
}

fn cost(value: Option<&f64>) -> String {
    value.filter(|v| v.is_finite()).map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"))
}

fn probability(p: f64) -> String {
    if p.is_finite() { format!("{:.2} %", p * 100.0) } else { "-".to_owned() }
}
