//! The map of the HTML report: the same drawing without a frame, with what a script needs to zoom,
//! to show a round's incumbent, and to say what is under the pointer.
//!
//! `data-tip` is what an element says of itself. Lines keep their width when the map is zoomed
//! (the page's style sheet), buffers grow with it; a `mark` keeps its size.

use svg::Document;
use svg::node::element::{Circle, Group, Path, SVG, Title};

use super::map::{candidates, inclusions, lines, outline_path, outside, path};
use super::places::{describe, goal_mark, numbers, start_mark};
use super::scene::{Role, Scene};
use super::view::{Rect, View, px};
use super::{Subject, map, text};
use crate::fence::FenceSet;
use crate::geodesy::{ProjectionError, Xy};
use crate::planner::candidates::Source;
use crate::replan::LegRecord;
use crate::report::text::{leg_label, plain};

/// The width of the map, and the least and most height, in its own units.
const WIDTH: f64 = 1000.0;
const HEIGHT: (f64, f64) = (420.0, 900.0);

/// The map with what the page says about it.
pub(in crate::report) struct InteractiveMap<'a> {
    /// The drawing, an SVG element.
    pub(in crate::report) svg: String,
    /// Units of the drawing for a metre.
    pub(in crate::report) scale: f64,
    /// The re-planned legs on it, in the order of their `data-leg`.
    pub(in crate::report) records: Vec<&'a LegRecord>,
    /// Whether there is a new route besides the original.
    pub(in crate::report) is_planned: bool,
    /// Whether there are candidates over corners, and over the grid.
    pub(in crate::report) corners: bool,
    pub(in crate::report) grid: bool,
    /// Whether there are obstacles, and areas to stay inside.
    pub(in crate::report) obstacles: bool,
    pub(in crate::report) inclusions: bool,
    /// Zones with legs that are not on the map.
    pub(in crate::report) other_zones: usize,
}

/// Draws the map. `fences` names the regions.
pub(in crate::report) fn interactive<'a>(
    subject: &Subject<'a>,
    fences: &FenceSet,
    title: &str,
) -> Result<InteractiveMap<'a>, ProjectionError> {
    let scene = Scene::new(subject)?;
    let (low, high) = scene.extent();
    let (least, most) = HEIGHT;
    let height = (WIDTH * (high.y - low.y) / (high.x - low.x)).clamp(least, most).round();
    let page = Rect { x: 0.0, y: 0.0, width: WIDTH, height };
    let shown = View::new(page, low, high);
    // Drawn well beyond what is shown at first, for those who zoom out.
    let around = Rect { x: -WIDTH, y: -height, width: 3.0 * WIDTH, height: 3.0 * height };
    let view = shown.within(around);

    let world = Group::new()
        .set("id", "world")
        .add(around.element().set("class", "panel"))
        .add(map::buffers(&scene, &view).set("data-layer", "buffers"))
        .add(outside(&scene, &view))
        .add(obstacles(&scene, &view, fences))
        .add(path(inclusions(&scene, &view).concat(), "fence"))
        .add(candidates(&scene, &view).set("data-layer", "candidates"))
        .add(rounds(&scene, &view))
        .add(path(lines(&scene.new, &view), "casing"))
        .add(path(lines(&scene.old, &view), "old").set("data-layer", "old"))
        .add(path(lines(&scene.new, &view), "new"))
        .add(touchable(&scene, &view))
        .add(marks(&scene, &shown));
    let document: SVG = Document::new()
        .set("id", "map")
        .set("viewBox", (0, 0, WIDTH as i32, height as i32))
        .set("tabindex", "0")
        .set("role", "group")
        .set("aria-label", format!("Map of {}", plain(title)))
        .add(world);
    let is_solid = |outline: &crate::airspace::Outline| {
        use crate::airspace::Outline;
        matches!(outline, Outline::Solid(_) | Outline::SolidDisc { .. })
    };
    let corners = scene.candidates(Source::Corners).next().is_some();
    let grid = scene.candidates(Source::Grid).next().is_some();
    Ok(InteractiveMap {
        svg: document.to_string(),
        scale: shown.scale,
        is_planned: scene.is_planned,
        corners,
        grid,
        obstacles: scene.outlines.iter().any(is_solid),
        inclusions: scene.outlines.iter().any(|outline| !is_solid(outline)),
        other_zones: subject.fields.len().saturating_sub(1),
        records: scene.records,
    })
}

/// Each obstacle by itself, so that it can say its name.
fn obstacles(scene: &Scene<'_>, view: &View, fences: &FenceSet) -> Group {
    let mut group = Group::new();
    for (index, outline) in scene.outlines.iter().enumerate() {
        let Some(data) = outline_path(outline, scene.margin, view) else { continue };
        let name = fences.regions.get(index).map_or("", |region| region.origin.as_str());
        group = group.add(path(data, "obstacle").set("data-tip", plain(name)));
    }
    group
}

/// The incumbents of every leg: first what it began with, then what each round left. Those that
/// are the same as the one before are drawn once and found by `data-from` and `data-to`.
fn rounds(scene: &Scene<'_>, view: &View) -> Group {
    let mut group = Group::new().set("id", "rounds");
    for (leg, record) in scene.records.iter().enumerate() {
        let first = record.candidates.first().map(|candidate| candidate.points.as_slice());
        let paths = first.into_iter().chain(record.rounds.iter().map(|r| r.incumbent.as_slice()));
        let mut drawn: Vec<(usize, usize, String)> = Vec::new();
        for (number, points) in paths.enumerate() {
            let data = view.line(points);
            match drawn.last_mut() {
                Some((_, to, last)) if *last == data => *to = number,
                _ => drawn.push((number, number, data)),
            }
        }
        for (from, to, data) in drawn {
            group = group.add(
                path(data, "incumbent")
                    .set("data-leg", leg)
                    .set("data-from", from)
                    .set("data-to", to),
            );
        }
    }
    group
}

/// Broad lines that nobody sees, under the pointer: each leg says its length and clearance.
fn touchable(scene: &Scene<'_>, view: &View) -> Group {
    scene.tips.iter().fold(Group::new(), |group, (edge, tip)| {
        let line = path(view.line([&edge.from, &edge.to]), "hit");
        group.add(line.set("data-tip", plain(tip)))
    })
}

/// Waypoints with their numbers, start and goal.
fn marks(scene: &Scene<'_>, view: &View) -> Group {
    let mut group = Group::new();
    for place in scene.places.iter().filter(|place| place.circle > 0.0) {
        let circle = view.circle(place.at, place.circle);
        group = group.add(Path::new().set("d", circle).set("class", "circle"));
    }
    let numbers = numbers(scene, view);
    for (index, place) in scene.places.iter().enumerate() {
        let at = view.at(place.at);
        let (radius, class) = match place.role {
            Role::Item => (5.5, "item"),
            Role::Inserted => (4.5, "inserted"),
        };
        let mut mark = mark(at, &describe(place));
        mark = mark.add(Circle::new().set("r", px(radius)).set("class", class));
        if let Some((_, label_at, label)) = numbers.iter().find(|(place, ..)| *place == index) {
            let (dx, dy) = (label_at.x - at.x, label_at.y - at.y);
            mark = mark.add(text(dx, dy + 4.0, "number", label));
        }
        group = group.add(mark);
    }
    let zero = Xy { x: 0.0, y: 0.0 };
    let start = scene.start.map(|start| view.at(start));
    if let Some(goal) = scene.goal.map(|goal| view.at(goal)) {
        let same = start.is_some_and(|at| (at.x - goal.x).hypot(at.y - goal.y) < 12.0);
        let ring = goal_mark(zero, if same { 15.0 } else { 9.0 });
        group = group.add(still(mark(goal, "end").add(ring)));
    }
    if let Some(start) = start {
        group = group.add(still(mark(start, "start").add(start_mark(zero))));
    }
    group
}

fn mark(at: Xy, tip: &str) -> Group {
    Group::new()
        .set("class", "mark")
        .set("transform", format!("translate({} {})", px(at.x), px(at.y)))
        .set("tabindex", "0")
        .set("role", "img")
        .set("aria-label", tip)
        .set("data-tip", tip)
}

/// A mark that is no stop of the tabulator: the item at its place is one.
fn still(mark: Group) -> Group {
    mark.set("tabindex", "-1")
}

/// The two charts of one leg's rounds, each an SVG element.
pub(in crate::report) fn charts(record: &LegRecord) -> [String; 2] {
    let rect = Rect { x: 4.0, y: 4.0, width: 500.0, height: 260.0 };
    let records = [record];
    let titled = |what: &str, group: Group| {
        let name = format!("{what}, leg {}", leg_label(&record.leg));
        Document::new()
            .set("viewBox", (0, 0, 512, 268))
            .set("role", "img")
            .add(Title::new(name))
            .add(group)
            .to_string()
    };
    [
        titled("QAOA training loss", super::training::losses(&records, rect)),
        titled("Path length over the rounds", super::training::lengths(&records, rect)),
    ]
}
