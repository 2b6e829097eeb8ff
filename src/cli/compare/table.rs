//! A comparison for people: the paper's table and its companions, in lines of at most 80 columns.

use super::growth::{Grower, Growth};
use super::measure::{Measured, Method};
use super::{Comparison, PaperFigures, ScenarioResult};
use crate::report::text::{named, push_wrapped};

/// Width of a line's first column, and of each of the others.
const LABEL: usize = 20;
const CELL: usize = 10;

/// Scenarios side by side: as many as the paper has.
const SIDE_BY_SIDE: usize = 6;

/// Measurements of growth side by side.
const MEASUREMENTS: usize = 7;

/// The text of a comparison.
#[must_use]
pub fn text(comparison: &Comparison) -> String {
    let runs = comparison.scenarios.iter().flat_map(|scenario| &scenario.methods);
    let seeds = runs.map(|row| row.runs).max().unwrap_or(1);
    let buffer = comparison.settings.buffer;
    let mut out = format!("A buffer of {buffer} for all; RRT: means over {seeds} seeds.\n\n");
    for scenarios in comparison.scenarios.chunks(SIDE_BY_SIDE) {
        lengths(scenarios, &mut out);
        block("clearance, metres", scenarios, |row| metres(row.min_clearance_m), &mut out);
        block("colliding edges", scenarios, collisions, &mut out);
        block("time, ms", scenarios, |row| milliseconds(row.time_ms), &mut out);
        block("found, of runs", scenarios, |row| format!("{}/{}", row.found, row.runs), &mut out);
    }
    for scenario in &comparison.scenarios {
        for row in &scenario.methods {
            if let Some(reason) = &row.reason {
                let line = format!("{}: {}: {reason}", scenario.name, row.method.label());
                out.push_str(&shortened(&line, 80));
                out.push('\n');
            }
        }
    }
    for ScenarioResult { name, flown_over_or_under, .. } in &comparison.scenarios {
        if !flown_over_or_under.is_empty() {
            let named = named(flown_over_or_under);
            let told = format!("{name}: flown over or under, and so in nobody's way: {named}");
            push_wrapped(&mut out, &told, 4);
        }
    }
    if comparison.scenarios.iter().any(|scenario| scenario.paper.is_some()) {
        out.push_str(
            "The paper's maps are not published; s1 to s6 resemble them, and its figures are\n\
             for orientation.\n",
        );
    }
    if let Some(first) = comparison.scenarios.first().filter(|_| !comparison.growth.is_empty()) {
        let name = shortened(&first.name, 30);
        out.push_str(&format!("\nHow time grows with |E|, first leg of {name}\n"));
        for growth in &comparison.growth {
            push_growth(growth, comparison.settings.steps, &mut out);
        }
    }
    out
}

/// The paper's table, with the paper's own figures beside.
fn lengths(scenarios: &[ScenarioResult], out: &mut String) {
    heading("length, metres", scenarios, out);
    line("straight line", scenarios.iter().map(|scenario| metres(Some(scenario.straight_m))), out);
    let paper = |label: &str, figure: fn(PaperFigures) -> f64, out: &mut String| {
        if scenarios.iter().any(|scenario| scenario.paper.is_some()) {
            line(label, scenarios.iter().map(|scenario| metres(scenario.paper.map(figure))), out);
        }
    };
    for method in Method::ALL {
        line(method.label(), cells(scenarios, method, |row| metres(row.length_m)), out);
        match method {
            Method::AStarSmoothed => paper("  A* in the paper", |paper| paper.a_star_m, out),
            Method::RrtReaching => paper("  RRT in the paper", |paper| paper.rrt_m, out),
            Method::Quav => paper("  QUAV in the paper", |paper| paper.quav_m, out),
            Method::AStar | Method::Rrt | Method::QuavPaper => {}
        }
    }
    out.push('\n');
}

/// One quantity of every method.
fn block(
    title: &str,
    scenarios: &[ScenarioResult],
    value: impl Fn(&Measured) -> String,
    out: &mut String,
) {
    heading(title, scenarios, out);
    for method in Method::ALL {
        line(method.label(), cells(scenarios, method, &value), out);
    }
    out.push('\n');
}

fn cells<'a>(
    scenarios: &'a [ScenarioResult],
    method: Method,
    value: impl Fn(&Measured) -> String + 'a,
) -> impl Iterator<Item = String> + 'a {
    scenarios.iter().map(move |scenario| {
        let row = scenario.methods.iter().find(|row| row.method == method);
        row.map_or_else(|| "-".to_owned(), &value)
    })
}

fn heading(title: &str, scenarios: &[ScenarioResult], out: &mut String) {
    line(title, scenarios.iter().map(|scenario| shortened(&scenario.name, CELL - 1)), out);
}

fn line(label: &str, cells: impl Iterator<Item = String>, out: &mut String) {
    let cells: String = cells.map(|cell| format!("{cell:>CELL$}")).collect();
    out.push_str(format!("{label:<LABEL$}{cells}").trim_end());
    out.push('\n');
}

fn metres(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |metres| format!("{metres:.2}"))
}

/// Edges that collide; nothing to say of paths that are not there.
fn collisions(row: &Measured) -> String {
    if row.found == 0 { "-".to_owned() } else { row.collisions.to_string() }
}

/// Three figures, however long it took.
fn milliseconds(time: f64) -> String {
    match time {
        short if short < 10.0 => format!("{short:.2}"),
        middle if middle < 100.0 => format!("{middle:.1}"),
        long => format!("{long:.0}"),
    }
}

/// A name in so many columns, control characters replaced.
fn shortened(name: &str, width: usize) -> String {
    let plain = name.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c });
    let mut kept: Vec<char> = plain.take(width + 1).collect();
    if kept.len() > width {
        kept.truncate(width - 1);
        kept.push('…');
    }
    kept.into_iter().collect()
}

/// The last measurements of a method, in two lines, with the exponent and the paper's complexity.
fn push_growth(growth: &Growth, steps: usize, out: &mut String) {
    let what = match growth.method {
        Grower::AStar => "A*, grids of 8 m to 0.5 m; paper: O(b^d)".to_owned(),
        Grower::Rrt => "RRT, 1 m steps; paper: O(|E| log |E|)".to_owned(),
        Grower::Quav => format!("QAOA training, {steps} steps, chain engine; paper: O(S |E|)"),
    };
    out.push_str(&format!("\n{what}\n"));
    let from = growth.points.len().saturating_sub(MEASUREMENTS);
    let points = &growth.points[from..];
    let row = |label: &str, cell: &dyn Fn(usize) -> String, out: &mut String| {
        let cells: String = (0..points.len()).map(|k| format!("{:>CELL$}", cell(k))).collect();
        out.push_str(&format!("{label:<10}{cells}\n"));
    };
    row("  |E|", &|k| points[k].edges.to_string(), out);
    row("  ms", &|k| milliseconds(points[k].time_ms), out);
    if let Some(exponent) = growth.exponent {
        out.push_str(&format!("  time grows with |E|^{exponent:.2}\n"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::compare::growth::GrowthPoint;
    use crate::replan::Options;
    use crate::report::json::SettingsDocument;

    fn measured(method: Method, length: Option<f64>) -> Measured {
        Measured {
            method,
            runs: 1000,
            found: if length.is_some() { 1000 } else { 0 },
            length_m: length,
            min_clearance_m: length.map(|_| 1234.567),
            collisions: 123_456,
            time_ms: 1_234_567.8,
            iterations: 8_000_000.0,
            reason: length.is_none().then(|| "no way was found, ".repeat(20)),
            rounds: Vec::new(),
        }
    }

    fn comparison(names: &[&str]) -> Comparison {
        let scenario = |name: &&str| ScenarioResult {
            name: (*name).to_owned(),
            legs: 1,
            straight_m: 123_456.78,
            flown_over_or_under: (0..9).map(|k| format!("{name} building {k}")).collect(),
            methods: Method::ALL
                .map(|method| measured(method, (method != Method::Rrt).then_some(123_456.78)))
                .into(),
            paper: crate::baseline::paper::paper_lengths(name).map(PaperFigures::from),
        };
        let points = (0..10).map(|k| GrowthPoint { edges: 10 << k, time_ms: 1e6 }).collect();
        Comparison {
            scenarios: names.iter().map(scenario).collect(),
            growth: vec![Growth { method: Grower::Quav, points, exponent: Some(1.0) }],
            settings: SettingsDocument::from(&Options::default()),
        }
    }

    #[test]
    fn every_line_fits_eighty_columns_whatever_the_names_and_figures() {
        let long = "a-scenario-with-a-name-that-is-much-longer-than-a-terminal-is-wide-".repeat(2);
        let names = ["s1", "s2", &long, "s4", "s5", "s6", "another", "line\nbreak"];
        let text = text(&comparison(&names));
        for line in text.lines() {
            assert!(line.chars().count() <= 80, "{line}");
        }
        let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let told = "s1: flown over or under, and so in nobody's way: s1 building 0, s1 building 1, \
                    s1 building 2 and 6 more";
        assert!(words.contains(told), "{text}");
    }

    #[test]
    fn the_papers_figures_stand_beside_its_scenarios_only() {
        let table = text(&comparison(&["s5", "city"]));
        let line = table.lines().find(|line| line.contains("QUAV in the paper")).unwrap();
        assert_eq!(line.split_whitespace().collect::<Vec<_>>()[4..], ["447.08", "-"]);
        assert!(!text(&comparison(&["city"])).contains("in the paper"));
    }
}
