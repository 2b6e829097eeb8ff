//! A comparison as one HTML page: the tables of the terminal, loss curves, growth, and how to get
//! the same.

use super::growth::{Grower, Growth};
use super::measure::{Measured, Method};
use super::{Comparison, PaperFigures, ScenarioResult, picture};
use crate::report::page::html::{data, page, section, table};

/// What a cell of a table says of something.
type Figure<T> = fn(&T) -> String;

/// The page of a comparison that `command` made.
#[must_use]
pub fn comparison_page(comparison: &Comparison, command: &str) -> String {
    let buffer = comparison.settings.buffer;
    let mut content = "<h1>A*, RRT and QUAV</h1>\n".to_owned();
    content += &format!(
        "<p>The same legs, planned by each method with a buffer of {buffer}, every path judged \
         alike. Lengths in metres; RRT: means over its seeds.</p>\n"
    );
    content += &section("Lengths", &lengths(comparison));
    let blocks: [(&str, Figure<Measured>); 4] = [
        ("Least clearance, metres", |row| number(row.min_clearance_m)),
        ("Colliding edges", |row| {
            if row.found == 0 { "-".to_owned() } else { row.collisions.to_string() }
        }),
        ("Time, ms", |row| format!("{:.2}", row.time_ms)),
        ("Found, of runs", |row| format!("{}/{}", row.found, row.runs)),
    ];
    let figures: String =
        blocks.into_iter().map(|(title, value)| block(comparison, title, value)).collect();
    content += &section("Figures", &beside(&figures));
    let reasons = reasons(comparison);
    if !reasons.is_empty() {
        content += &section("Where no path was found", &reasons);
    }
    let passed = passed(comparison);
    if !passed.is_empty() {
        content += &section("Flown over or under, and so in nobody's way", &passed);
    }
    let curves = picture::loss_curves(&comparison.scenarios);
    content += &section("Training", &format!("<div class=\"charts\">{curves}</div>\n"));
    if !comparison.growth.is_empty() {
        let growth: String = comparison.growth.iter().map(growth).collect();
        content += &section("How time grows with the number of edges", &beside(&growth));
    }
    let reproduce = format!(
        "<pre>{}</pre>\n<p><button type=\"button\" id=\"save\" data-name=\"compare.json\" \
         hidden>Save as JSON</button></p>\n{}",
        crate::report::page::html::escaped(command),
        data("document", comparison)
    );
    content += &section("Reproduce", &reproduce);
    page("quavd compare", &content)
}

/// Tables side by side, as far as there is room.
fn beside(tables: &str) -> String {
    format!("<div class=\"tables\">{tables}</div>\n")
}

fn lengths(comparison: &Comparison) -> String {
    let scenarios = &comparison.scenarios;
    let mut rows = vec![row("straight line", scenarios.iter().map(|s| number(Some(s.straight_m))))];
    for method in Method::ALL {
        rows.push(measured(comparison, method, |row| number(row.length_m)));
    }
    let paper: [(&str, Figure<PaperFigures>); 3] = [
        ("A* in the paper", |paper| number(Some(paper.a_star_m))),
        ("RRT in the paper", |paper| number(Some(paper.rrt_m))),
        ("QUAV in the paper", |paper| number(Some(paper.quav_m))),
    ];
    if scenarios.iter().any(|scenario| scenario.paper.is_some()) {
        for (label, figure) in paper {
            let cell = |s: &ScenarioResult| s.paper.as_ref().map_or_else(|| "-".to_owned(), figure);
            rows.push(row(label, scenarios.iter().map(cell)));
        }
    }
    let note = "The paper's maps are not published; s1 to s6 resemble them, and its figures are \
                for orientation";
    named_table(comparison, note, &rows)
}

fn block(comparison: &Comparison, title: &str, value: Figure<Measured>) -> String {
    let rows: Vec<_> =
        Method::ALL.into_iter().map(|method| measured(comparison, method, value)).collect();
    named_table(comparison, title, &rows)
}

fn named_table(comparison: &Comparison, caption: &str, rows: &[Vec<String>]) -> String {
    let names = comparison.scenarios.iter().map(|scenario| scenario.name.as_str());
    let heads: Vec<&str> = std::iter::once("").chain(names).collect();
    table(caption, &heads, rows)
}

fn measured(
    comparison: &Comparison,
    method: Method,
    value: impl Fn(&Measured) -> String,
) -> Vec<String> {
    let cells = comparison.scenarios.iter().map(|scenario| {
        let row = scenario.methods.iter().find(|row| row.method == method);
        row.map_or_else(|| "-".to_owned(), &value)
    });
    row(method.label(), cells)
}

fn row(label: &str, cells: impl Iterator<Item = String>) -> Vec<String> {
    std::iter::once(label.to_owned()).chain(cells).collect()
}

fn reasons(comparison: &Comparison) -> String {
    let mut rows = Vec::new();
    for scenario in &comparison.scenarios {
        for row in &scenario.methods {
            if let Some(reason) = &row.reason {
                let label = row.method.label().to_owned();
                rows.push(vec![scenario.name.clone(), label, reason.clone()]);
            }
        }
    }
    if rows.is_empty() { String::new() } else { table("", &["scenario", "method", "why"], &rows) }
}

/// The obstacles that do not count, by their heights.
fn passed(comparison: &Comparison) -> String {
    let mut rows = Vec::new();
    for scenario in &comparison.scenarios {
        for obstacle in &scenario.flown_over_or_under {
            rows.push(vec![scenario.name.clone(), obstacle.clone()]);
        }
    }
    if rows.is_empty() { String::new() } else { table("", &["scenario", "obstacle"], &rows) }
}

fn growth(growth: &Growth) -> String {
    let name = match growth.method {
        Grower::AStar => "A*, ever finer grids (paper: O(b^d))",
        Grower::Rrt => "RRT, ever more nodes (paper: O(|E| log |E|))",
        Grower::Quav => "QAOA training, chain engine (paper: O(S |E|))",
    };
    let caption = match growth.exponent {
        Some(exponent) => format!("{name}: time grows with |E|^{exponent:.2}"),
        None => name.to_owned(),
    };
    let rows: Vec<Vec<String>> = growth
        .points
        .iter()
        .map(|point| vec![point.edges.to_string(), format!("{:.2}", point.time_ms)])
        .collect();
    table(&caption, &["|E|", "ms"], &rows)
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"))
}
