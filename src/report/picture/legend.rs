//! What the colours and marks mean; only what the picture has.

use svg::node::element::{Circle, Group, Path};

use super::map::{shows_outside, visible};
use super::places::{goal_mark, start_mark};
use super::scene::Scene;
use super::text;
use super::view::{Rect, View, px};
use crate::geodesy::Xy;
use crate::planner::candidates::Source;
use crate::report::run::Run;

/// The fills of the map, as its classes have them.
const RIM: &str = "#dd8b1d";
const BUFFER: &str = "#fbe3bd";
const OBSTACLE: &str = "#8b95a1";
const OUTSIDE: &str = "#d9dde2";

/// The height of an entry, and the width of a column of them.
const ROW: f64 = 21.5;
const COLUMN: f64 = 300.0;

pub(super) fn legend(scene: &Scene<'_>, view: &View, run: &Run<'_>, rect: Rect) -> Group {
    let mut list = List { group: Group::new(), x: rect.x, y: rect.y + 16.0, rect };
    list.title("Legend");
    let line = |class: &str| Path::new().set("d", "M0 0h34").set("class", class);
    match scene.is_planned {
        true => {
            list.entry(line("old"), "original route, where it was changed");
            list.entry(line("new"), "new route");
            list.entry(mark(4.5, "inserted"), "inserted waypoint with its item number");
        }
        false => {
            if !scene.old.is_empty() {
                list.entry(line("old"), "leg that is not clear");
            }
            if !scene.new.is_empty() {
                list.entry(line("new"), "leg that is clear");
            }
        }
    }
    if !scene.places.is_empty() {
        list.entry(mark(5.5, "item"), "item of the original mission");
        list.entry(Group::new().add(start_mark(MIDDLE)), "start");
        list.entry(Group::new().add(goal_mark(MIDDLE, 9.0)), "end");
    }
    for (source, class, name) in [
        (Source::Corners, "route corners", "candidate over obstacle corners"),
        (Source::Grid, "route grid", "candidate over the grid"),
    ] {
        if scene.candidates(source).next().is_some() {
            list.entry(line(class), name);
        }
    }
    let buffer = run.options.settings.buffer;
    if visible(scene, view, 0.0).next().is_some() {
        let swatch = Group::new()
            .add(box_(RIM, 34.0, 16.0))
            .add(box_(BUFFER, 32.0, 14.0))
            .add(box_(OBSTACLE, 20.0, 6.0));
        list.entry(swatch, &format!("obstacle and its buffer of {buffer}"));
    }
    if shows_outside(scene, view) {
        let swatch = Group::new()
            .add(box_(OUTSIDE, 34.0, 16.0))
            .add(Path::new().set("d", "M0 8h34").set("class", "fence"));
        list.entry(swatch, "outside of the fence");
    }
    list.group
}

/// The middle of a swatch.
const MIDDLE: Xy = Xy { x: 17.0, y: 0.0 };

fn mark(radius: f64, class: &str) -> Circle {
    Circle::new().set("cx", px(MIDDLE.x)).set("r", px(radius)).set("class", class)
}

/// A box around the middle of a swatch.
fn box_(fill: &str, width: f64, height: f64) -> svg::node::element::Rectangle {
    let rect = Rect { x: MIDDLE.x - width / 2.0, y: -height / 2.0, width, height };
    rect.element().set("fill", fill)
}

/// Entries below each other, in columns where the rectangle has no more room below.
struct List {
    group: Group,
    x: f64,
    y: f64,
    rect: Rect,
}

impl List {
    fn title(&mut self, title: &str) {
        let group = std::mem::take(&mut self.group);
        self.group = group.add(text(self.x, self.y, "head", title));
        self.y += ROW;
    }

    fn entry(&mut self, swatch: impl Into<Box<dyn svg::Node>>, name: &str) {
        if self.y > self.rect.bottom() {
            (self.x, self.y) = (self.x + COLUMN, self.rect.y + 16.0 + ROW);
        }
        let placed = Group::new()
            .set("transform", format!("translate({} {})", px(self.x), px(self.y - 4.5)))
            .add(swatch);
        let group = std::mem::take(&mut self.group);
        self.group = group.add(placed).add(text(self.x + 46.0, self.y, "small", name));
        self.y += ROW;
    }
}
