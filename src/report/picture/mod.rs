//! The picture of a plan: the map alone as one self-contained SVG on white, for browsers, README
//! files and print.
//!
//! - `scene`: what is drawn, in the local metres of one zone;
//! - `view`: from local metres to the page;
//! - `map`: obstacles, buffers, fences, candidates, old and new route;
//! - `places`: the numbered waypoints, start and goal;
//! - `chart`: axes and curves; `training`: the two charts of the QAOA rounds for the HTML report;
//! - `interactive`: the map and the charts of the HTML report;
//! - `braille`: the map on a terminal;
//! - `png`: the picture in pixels;
//! - `findings`: what is not clear, where a mission was only judged;
//! - `legend`: what the colours mean.
//!
//! A mission over several zones is drawn for the zone with the most legs.

mod braille;
mod chart;
mod findings;
mod interactive;
mod legend;
mod map;
mod places;
mod png;
mod scene;
mod training;
mod view;

use svg::Document;
use svg::node::element::{Group, Rectangle, Style, Text, Title};

pub(super) use braille::braille;
pub(super) use interactive::{InteractiveMap, charts, interactive};
pub(super) use png::png;

use super::run::Run;
use super::text::{change, clearance, count, plain};
use crate::geodesy::ProjectionError;
use crate::replan::{Field, LegRecord, Replanned, Verdict};
use scene::Scene;
use view::{Rect, View};

/// The page, in pixels: width, border, and gap between panels.
const PAGE: f64 = 1200.0;
const BORDER: f64 = 20.0;
const GAP: f64 = 24.0;

/// The height of the title, and of what is below the map: the legend, beside it what is not clear.
const HEAD: f64 = 66.0;
const LEGEND: f64 = 92.0;
const FINDINGS: f64 = 200.0;

/// The least and the most height of the map.
const MAP_HEIGHT: (f64, f64) = (420.0, 900.0);

/// The look of everything: classes keep the file small.
const STYLE: &str = "\
text{font:13px 'Segoe UI',Roboto,Helvetica,Arial,sans-serif;fill:#2b3440}\
.title{font-size:22px;font-weight:600}.sub{font-size:14px;fill:#52606d}\
.small{font-size:11.5px;fill:#52606d}.head{font-weight:600}\
.panel{fill:#f8f7f3}.frame{fill:none;stroke:#c3c8ce}\
.obstacle{fill:#8b95a1;stroke:#5c6773;stroke-width:.8;stroke-linejoin:round}\
.rim{fill:none;stroke:#dd8b1d;stroke-linejoin:round}\
.buffer{fill:none;stroke:#fbe3bd;stroke-linejoin:round}\
.outside{fill:#d9dde2;fill-rule:evenodd}\
.fence{fill:none;stroke:#2f7d4f;stroke-width:2}\
.route{fill:none;stroke-width:2;stroke-linejoin:round;stroke-opacity:.9}\
.corners{stroke:#8e44ad}.grid{stroke:#0e9aa7}\
.old{fill:none;stroke:#d1242f;stroke-width:2.4;stroke-dasharray:9 6}\
.casing{fill:none;stroke:#fff;stroke-width:7;stroke-linecap:round;stroke-linejoin:round}\
.new{fill:none;stroke:#1257c0;stroke-width:3.4;stroke-linecap:round;stroke-linejoin:round}\
.circle{fill:none;stroke:#1257c0;stroke-width:1.2;stroke-dasharray:3 3}\
.item{fill:#1257c0;stroke:#fff;stroke-width:1.5}\
.inserted{fill:#fff;stroke:#1257c0;stroke-width:2}\
.start{fill:#1a9850;stroke:#fff;stroke-width:2}\
.goal{fill:#fff;stroke:#1b1f24;stroke-width:3}.bull{fill:#1b1f24}\
.number{font-size:12px;font-weight:600;fill:#0b3d91;stroke:#fff;stroke-width:3.5;\
stroke-linejoin:round;paint-order:stroke;text-anchor:middle}\
.ink{fill:#2b3440}.plate{fill:#fff;fill-opacity:.88}\
.middle{text-anchor:middle}.end{text-anchor:end}";

/// What a picture is of.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    before: &'a Verdict,
    /// The new mission, its inserted items and how it was found.
    after: Option<(&'a Verdict, &'a [usize], &'a [LegRecord])>,
    fields: &'a [Field],
}

impl<'a> Subject<'a> {
    /// A mission that was judged but not planned, or for which there is no plan.
    #[must_use]
    pub fn judged(verdict: &'a Verdict, fields: &'a [Field]) -> Self {
        Self { before: verdict, after: None, fields }
    }
}

impl<'a> From<&'a Replanned> for Subject<'a> {
    /// A mission that was planned.
    fn from(result: &'a Replanned) -> Self {
        let Replanned { before, after, inserted, legs, fields, .. } = result;
        let after = (!inserted.is_empty()).then_some((after, inserted.as_slice(), legs.as_slice()));
        Self { before, after, fields }
    }
}

/// Draws a mission; `title` is free text.
///
/// # Errors
/// [`ProjectionError`] where a place of the mission cannot be projected into the drawn zone.
pub fn picture<'a>(
    subject: impl Into<Subject<'a>>,
    run: &Run<'_>,
    title: &str,
) -> Result<String, ProjectionError> {
    let subject = subject.into();
    let scene = Scene::new(&subject)?;
    let (low, high) = scene.extent();
    let width = PAGE - 2.0 * BORDER;
    let (least, most) = MAP_HEIGHT;
    let height = (width * (high.y - low.y) / (high.x - low.x)).clamp(least, most).round();
    let panel = Rect { x: BORDER, y: BORDER + HEAD, width, height };
    let view = View::new(panel, low, high);

    let top = panel.y + panel.height + GAP;
    let below = if subject.after.is_some() { LEGEND } else { FINDINGS };
    let page_height = top + below + BORDER;
    let whole = Rect { x: BORDER, y: top, width, height: below };
    let left = Rect { width: 854.0, ..whole };
    let right = Rect { x: left.right() + GAP, width: width - GAP - left.width, ..whole };
    let key = if subject.after.is_some() { whole } else { right };
    let mut document = Document::new()
        .set("viewBox", (0, 0, PAGE as i32, page_height as i32))
        .set("width", PAGE as i32)
        .set("height", page_height as i32)
        .add(Title::new(plain(title)))
        .add(Style::new(STYLE))
        .add(Rectangle::new().set("width", "100%").set("height", "100%").set("fill", "#fff"))
        .add(header(&subject, run, title))
        .add(map::map(&scene, &view))
        .add(legend::legend(&scene, &view, run, key));
    if subject.after.is_none() {
        document = document.add(findings::findings(subject.before, left));
    }
    Ok(format!("{document}\n"))
}

/// The title and the figures before and after.
fn header(subject: &Subject<'_>, run: &Run<'_>, title: &str) -> Group {
    let before = subject.before;
    let settings = &run.options.settings;
    let was = (format!("{:.1}", before.length()), clearance(before.clearance()));
    let mut figures = match subject.after {
        None => {
            let verdict = if before.is_clear() { "clear" } else { "not clear" };
            vec![verdict.to_owned(), format!("length {}", was.0), format!("clearance {}", was.1)]
        }
        Some((after, inserted, records)) => {
            let rise = change(before.length(), after.length());
            vec![
                format!("length {} \u{2192} {:.1} ({rise})", was.0, after.length()),
                format!("clearance {} \u{2192} {}", was.1, clearance(after.clearance())),
                count(inserted.len(), "new waypoint"),
                count(records.iter().map(|record| record.rounds.len()).sum(), "QAOA round"),
            ]
        }
    };
    figures.push(format!("buffer {}", settings.buffer));
    if subject.after.is_some() {
        figures.push(format!("seed {}", settings.seed));
    }
    Group::new().add(text(BORDER, BORDER + 24.0, "title", &plain(title))).add(text(
        BORDER,
        BORDER + 48.0,
        "sub",
        &figures.join("  \u{b7}  "),
    ))
}

/// A line of text.
fn text(x: f64, y: f64, class: &str, content: &str) -> Text {
    Text::new(content).set("x", view::px(x)).set("y", view::px(y)).set("class", class)
}

#[cfg(test)]
mod tests {
    use quick_xml::events::Event;
    use quick_xml::reader::Reader;

    use super::*;
    use crate::replan::Options;
    use crate::report::samples::{self, BARN, POND, YARD};

    /// The classes of all elements and all texts of a well-formed document.
    fn read(svg: &str) -> (Vec<String>, Vec<String>) {
        let mut reader = Reader::from_str(svg);
        let (mut classes, mut texts, mut depth) = (Vec::new(), Vec::new(), 0);
        loop {
            let event = reader.read_event().unwrap();
            match &event {
                Event::Start(element) | Event::Empty(element) => {
                    for attribute in element.attributes() {
                        let attribute = attribute.unwrap();
                        let value = String::from_utf8(attribute.value.to_vec()).unwrap();
                        assert!(!value.contains("NaN") && !value.contains("inf"), "{value}");
                        if attribute.key.as_ref() == b"class" {
                            classes.push(value);
                        }
                    }
                }
                Event::Text(text) => texts.push(text.decode().unwrap().trim().to_owned()),
                Event::Eof => break,
                _ => {}
            }
            match event {
                Event::Start(_) => depth += 1,
                Event::End(_) => depth -= 1,
                _ => {}
            }
        }
        assert_eq!(depth, 0);
        (classes, texts)
    }

    #[test]
    fn a_plan_is_drawn_with_all_that_the_legend_names() {
        let options = Options::default();
        let result = samples::planned(POND, &options);
        let svg = picture(&result, &samples::run(&options, &[]), "the pond").unwrap();
        let (classes, texts) = read(&svg);
        for class in ["obstacle", "buffer", "outside", "fence", "route corners", "old", "new"] {
            assert!(classes.iter().any(|c| c == class), "{class}");
        }
        let marked = |class: &str| classes.iter().filter(|c| *c == class).count();
        // One of them is the legend's.
        assert_eq!(marked("inserted"), result.inserted.len() + 1);
        for index in &result.inserted {
            let number = (index + 1).to_string();
            assert!(texts.contains(&number), "{number}");
        }
        for text in ["the pond", "N", "start", "end", "outside of the fence", "new route"] {
            assert!(texts.iter().any(|t| t == text), "{text}");
        }
    }

    #[test]
    fn a_judged_mission_is_drawn_with_what_is_wrong_with_it() {
        let options = Options::default();
        let (verdict, fields) = samples::judged(YARD, &options);
        let run = samples::run(&options, &[]);
        let svg = picture(Subject::judged(&verdict, &fields), &run, "yard").unwrap();
        let (classes, texts) = read(&svg);
        assert!(classes.iter().any(|class| class == "old"));
        assert!(!classes.iter().any(|class| class == "inserted"));
        assert!(texts.iter().any(|text| text.starts_with("The leg from item 1 to item 2 meets")));
    }

    #[test]
    fn a_mission_without_fences_and_one_without_items_are_drawn() {
        let options = Options::default();
        let run = samples::run(&options, &[]);
        let result = samples::planned_without_fences(BARN, &options);
        let (_, texts) = read(&picture(&result, &run, "").unwrap());
        assert!(texts.iter().any(|text| text == "Every leg is clear"));
        let nothing = Verdict { legs: Vec::new(), warnings: Vec::new() };
        read(&picture(Subject::judged(&nothing, &[]), &run, "").unwrap());
    }

    #[test]
    fn names_from_outside_cannot_break_out_of_the_text() {
        let options = Options::default();
        let result = samples::planned_without_fences(BARN, &options);
        let title = "</text><script>alert(1)</script>&\u{0}\u{1b}";
        let svg = picture(&result, &samples::run(&options, &[]), title).unwrap();
        read(&svg);
        assert!(!svg.contains("<script"));
    }

    #[test]
    fn the_same_plan_gives_the_same_picture() {
        let options = Options::default();
        let run = samples::run(&options, &[]);
        let draw = || picture(&samples::planned(BARN, &options), &run, "barn").unwrap();
        assert_eq!(draw(), draw());
    }
}
