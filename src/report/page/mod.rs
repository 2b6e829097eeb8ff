//! The report: one HTML page with its style, script and data inside, for a browser on a desk or a
//! phone, without a network.
//!
//! - [`html`]: escaping, tables, the frame of a page (also of `quavd compare`'s report);
//! - `tables`: legs, rounds, settings;
//! - `reproduce`: the command line that gives the same plan.
//!
//! Map, charts and tables are there without the script, which adds zoom, tips and the slider over
//! the rounds.

pub(crate) mod html;
pub(crate) mod reproduce;
mod tables;
#[cfg(test)]
mod tests;

use super::files::Report;
use super::json::PlanDocument;
use super::picture::{InteractiveMap, charts, interactive};
use super::text::{change, clearance, count, finding, leg_label};
use crate::geodesy::ProjectionError;
use crate::replan::{LegRecord, Replanned, Verdict};
use html::{data, escaped, section};

/// The page of a report.
pub(super) fn page(report: &Report<'_>) -> Result<String, ProjectionError> {
    let map = interactive(&report.subject(), report.fences, report.title)?;
    let mut content = format!("<h1>{}</h1>\n", escaped(report.title));
    content += &headline(report);
    content += &section("Map", &map_section(&map, report));
    if let Some(planned) = report.planned.filter(|planned| planned.is_changed()) {
        content += &section("Legs", &tables::legs(planned));
        content += &section("QAOA", &qaoa_section(&map, planned));
    }
    let findings = findings(report);
    if !findings.is_empty() {
        content += &section("What to know", &list(&findings, "warnings"));
    }
    content += &section("Reproduce", &reproduce_section(report));
    Ok(html::page(report.title, &content))
}

/// The verdict in a sentence, and the figures before and after.
fn headline(report: &Report<'_>) -> String {
    let buffer = report.run.options.settings.buffer;
    let before = report.before;
    let mut out = String::new();
    let (good, verdict) = match report.planned {
        Some(planned) if planned.is_changed() => (
            true,
            format!(
                "{} of {} re-planned with {}: the whole mission now keeps {buffer} from everything.",
                planned.legs.len(),
                count(before.legs.len(), "leg"),
                count(planned.inserted.len(), "new waypoint"),
            ),
        ),
        _ if before.is_clear() => {
            (true, format!("The whole mission keeps {buffer} from everything: nothing to change."))
        }
        _ => match report.reason {
            Some(reason) => (false, format!("There is no plan: {reason}")),
            None => (false, format!("The mission does not keep {buffer} everywhere.")),
        },
    };
    let class = if good { "good" } else { "bad" };
    out += &format!("<p class=\"verdict {class}\">{}</p>\n", escaped(&with_units(&verdict)));
    let mut figures = vec![("Length", before.length().to_string())];
    figures.push(("Least clearance", clearance(before.clearance())));
    if let Some(planned) = report.planned.filter(|planned| planned.is_changed()) {
        let after = &planned.after;
        let rise = change(before.length(), after.length());
        figures[0].1 += &format!(" \u{2192} {} ({rise})", after.length());
        figures[1].1 += &format!(" \u{2192} {}", clearance(after.clearance()));
        let rounds = planned.legs.iter().map(|record| record.rounds.len()).sum::<usize>();
        figures.push(("New waypoints", planned.inserted.len().to_string()));
        figures.push(("QAOA rounds", rounds.to_string()));
    }
    let free = !report.planned.map_or(before, |planned| &planned.after).collides();
    figures.push(("Free of collisions", if free { "yes" } else { "no" }.to_owned()));
    figures.push(("Buffer", buffer.to_string()));
    out += "<dl class=\"figures\">";
    for (name, value) in figures {
        out += &format!("<div><dt>{name}</dt><dd>{}</dd></div>", escaped(&with_units(&value)));
    }
    out + "</dl>\n"
}

/// Text in which no line is broken between a number and its unit.
fn with_units(text: &str) -> String {
    let mut out = text.replace(" %", "\u{a0}%");
    for digit in '0'..='9' {
        out = out.replace(&format!("{digit} m"), &format!("{digit}\u{a0}m"));
    }
    out
}

fn map_section(map: &InteractiveMap<'_>, report: &Report<'_>) -> String {
    let mut out = format!("<div class=\"mapbox\" data-scale=\"{}\">{}</div>\n", map.scale, map.svg);
    out += &legend(map, report);
    let mut layers = vec![("buffers", "buffers")];
    if map.is_planned {
        layers.push(("old", "original route"));
    }
    if map.corners || map.grid {
        layers.push(("candidates", "candidates"));
    }
    out += "<div class=\"controls\">";
    for (layer, name) in layers {
        out += &format!(
            "<label><input type=\"checkbox\" checked data-shows=\"{layer}\"> {name}</label>"
        );
    }
    out += "</div>\n";
    if !map.records.is_empty() {
        out += &rounds_control(&map.records);
    }
    if map.other_zones > 0 {
        let zones = count(map.other_zones, "zone");
        out += &format!(
            "<p>Legs in {zones} of the projection besides this one are in the table, not on the \
             map.</p>\n"
        );
    }
    out
}

/// What the colours mean; only what the map has.
fn legend(map: &InteractiveMap<'_>, report: &Report<'_>) -> String {
    let line = |class: &str| format!("<path class=\"{class}\" d=\"M0 8h34\"/>");
    let disc = |class: &str| format!("<circle class=\"{class}\" cx=\"17\" cy=\"8\" r=\"5\"/>");
    let mut entries = Vec::new();
    if map.is_planned {
        entries.push((line("old"), "original route".to_owned()));
        entries.push((line("new"), "new route".to_owned()));
        entries.push((disc("inserted"), "inserted waypoint".to_owned()));
        entries.push((
            "<path class=\"incumbent on\" d=\"M0 8h34\"/>".to_owned(),
            "path after the chosen round".to_owned(),
        ));
    } else {
        entries.push((line("old"), "leg that is not clear".to_owned()));
        entries.push((line("new"), "leg that is clear".to_owned()));
    }
    entries.push((disc("item"), "item of the mission".to_owned()));
    if map.corners {
        entries.push((line("route corners"), "candidate over corners".to_owned()));
    }
    if map.grid {
        entries.push((line("route grid"), "candidate over the grid".to_owned()));
    }
    if map.obstacles {
        let swatch = "<rect width=\"34\" height=\"16\" style=\"fill:var(--buffer)\"/>\
                      <rect class=\"obstacle\" x=\"7\" y=\"4\" width=\"20\" height=\"8\"/>";
        let buffer = report.run.options.settings.buffer;
        entries.push((swatch.to_owned(), format!("obstacle and its buffer of {buffer}")));
    }
    if map.inclusions {
        let swatch = "<rect class=\"outside\" width=\"34\" height=\"16\"/>".to_owned();
        entries.push((swatch + &line("fence"), "outside of the fence".to_owned()));
    }
    let mut out = "<ul class=\"legend\">".to_owned();
    for (swatch, name) in entries {
        out += &format!(
            "<li><svg aria-hidden=\"true\" viewBox=\"0 0 34 16\">{swatch}</svg>{name}</li>"
        );
    }
    out + "</ul>\n"
}

/// The slider over a leg's rounds.
fn rounds_control(records: &[&LegRecord]) -> String {
    let mut out = "<div class=\"controls\"><label>Leg <select id=\"round-leg\">".to_owned();
    for (index, record) in records.iter().enumerate() {
        let name = escaped(&leg_label(&record.leg));
        out += &format!("<option value=\"{index}\">{name}</option>");
    }
    out += "</select></label><label for=\"round\">Round</label>\
            <input type=\"range\" id=\"round\" min=\"0\" max=\"0\" value=\"0\" \
            aria-describedby=\"round-words\"></div>\n\
            <output id=\"round-words\" for=\"round round-leg\"></output>\n";
    #[derive(serde::Serialize)]
    struct Leg {
        rounds: Vec<String>,
    }
    let legs: Vec<Leg> =
        records.iter().map(|record| Leg { rounds: tables::told_rounds(record) }).collect();
    out + &data("rounds-data", &legs)
}

/// Curves and rounds of each re-planned leg.
fn qaoa_section(map: &InteractiveMap<'_>, planned: &Replanned) -> String {
    let mut out =
        "<p>Each leg's path is a chain of qubits, one for each edge. The curves show the \
                   expected cost of the QAOA state above the exact optimum of its chain while it \
                   is trained (the first round bold, later ones light), and how the rounds \
                   shorten the path.</p>\n"
            .to_owned();
    let drawn = map.records.iter().copied();
    let others = planned.legs.iter().filter(|record| !map.records.contains(record));
    for record in drawn.chain(others).filter(|record| !record.rounds.is_empty()) {
        let [losses, lengths] = charts(record);
        out += &format!("<h3>Leg {}</h3>\n", escaped(&leg_label(&record.leg)));
        out += &format!("<div class=\"charts\">{losses}{lengths}</div>\n");
        out += &format!(
            "<details><summary>{}</summary>{}</details>\n",
            count(record.rounds.len(), "round"),
            tables::rounds(record)
        );
    }
    out
}

/// What is not clear, and the warnings.
fn findings(report: &Report<'_>) -> Vec<String> {
    let blocked = |verdict: &Verdict| -> Vec<String> {
        verdict.legs.iter().filter(|leg| leg.blocker.is_some()).map(finding).collect()
    };
    let mut findings = Vec::new();
    if report.planned.is_none() {
        findings.extend(blocked(report.before));
    }
    let fallback = report.planned.and_then(Replanned::fallback);
    findings.extend(fallback.map(|fallback| format!("Fallback: {fallback}")));
    findings.extend(report.run.warnings.iter().chain(&report.before.warnings).cloned());
    let notes = report.planned.into_iter().flat_map(|planned| &planned.notes);
    findings.extend(notes.map(ToString::to_string));
    findings
}

fn list(entries: &[String], class: &str) -> String {
    let items: String =
        entries.iter().map(|entry| format!("<li>{}</li>\n", escaped(entry))).collect();
    format!("<ul class=\"{class}\">{items}</ul>\n")
}

fn reproduce_section(report: &Report<'_>) -> String {
    let mut out = "<p>The same input, settings and version of quavd give the same waypoints.</p>\n"
        .to_owned();
    if let Some(command) = report.command {
        let options = reproduce::arguments(report.run.options);
        out += &format!("<pre>{}</pre>\n", escaped(&format!("quavd {command}{options}")));
    }
    out += &tables::settings(report.run.options);
    if let Some(planned) = report.planned {
        let document = PlanDocument::planned(planned, &report.run);
        out += &tables::times(&document.time_ms);
        out += "<p>Everything that <code>--json</code> prints is in this page: \
                <button type=\"button\" id=\"save\" data-name=\"quavd.json\" hidden>Save as \
                JSON</button></p>\n";
        out += &data("document", &document);
    }
    out
}
