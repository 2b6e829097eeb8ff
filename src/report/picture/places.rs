//! The numbered waypoints, start and goal. Numbers are put where they cover nothing else.

use svg::node::element::{Circle, Group, Path, Title};

use super::scene::{Place, Role, Scene};
use super::text;
use super::view::{Rect, View, px};
use crate::geodesy::Xy;

/// Beyond so many places there are dots without numbers.
const NUMBERED: usize = 400;

/// How far a number may be from its place, pixels.
const DISTANCES: [f64; 3] = [14.0, 20.0, 28.0];

pub(super) fn places(scene: &Scene<'_>, view: &View) -> Group {
    let mut group = Group::new();
    for place in scene.places.iter().filter(|place| place.circle > 0.0) {
        let circle = view.circle(place.at, place.circle);
        group = group.add(Path::new().set("d", circle).set("class", "circle"));
    }
    for place in &scene.places {
        group = group.add(dot(place, view));
    }
    group = group.add(ends(scene, view));
    for (_, at, label) in numbers(scene, view) {
        group = group.add(text(at.x, at.y + 4.0, "number", &label));
    }
    group
}

/// The numbers of the places: which place, the middle of the number on the page, the number.
pub(super) fn numbers(scene: &Scene<'_>, view: &View) -> Vec<(usize, Xy, String)> {
    if scene.places.len() > NUMBERED {
        return Vec::new();
    }
    let mut numbers = Numbers::new(scene, view);
    let places = scene.places.iter().enumerate();
    places
        .filter_map(|(index, place)| {
            let label = place.number?.to_string();
            Some((index, numbers.place(view.at(place.at), &label), label))
        })
        .collect()
}

/// What a place is, in words.
pub(super) fn describe(place: &Place) -> String {
    let name = match (place.number, place.role) {
        (None, _) => "start, home or rally point".to_owned(),
        (Some(number), Role::Item) => format!("item {number}"),
        (Some(number), Role::Inserted) => format!("item {number}, inserted"),
    };
    let clearance = place.clearance.map_or_else(String::new, |clearance| {
        format!("; the leg to it keeps {:.2} m", (clearance * 100.0).floor() / 100.0)
    });
    name + &clearance
}

fn dot(place: &Place, view: &View) -> Circle {
    let at = view.at(place.at);
    let (radius, class) = match place.role {
        Role::Item => (5.5, "item"),
        Role::Inserted => (4.5, "inserted"),
    };
    circle(at, radius, class).add(Title::new(describe(place)))
}

fn circle(at: Xy, radius: f64, class: &str) -> Circle {
    Circle::new().set("cx", px(at.x)).set("cy", px(at.y)).set("r", px(radius)).set("class", class)
}

/// Start: a green disc with a triangle. Goal: a target, around the start where it is the same.
fn ends(scene: &Scene<'_>, view: &View) -> Group {
    let mut group = Group::new();
    let start = scene.start.map(|start| view.at(start));
    if let Some(goal) = scene.goal.map(|goal| view.at(goal)) {
        let same = start.is_some_and(|at| (at.x - goal.x).hypot(at.y - goal.y) < 12.0);
        group = group.add(goal_mark(goal, if same { 15.0 } else { 9.0 }));
    }
    if let Some(start) = start {
        group = group.add(start_mark(start));
    }
    group
}

pub(super) fn goal_mark(at: Xy, radius: f64) -> Group {
    Group::new().add(circle(at, radius, "goal")).add(circle(at, 4.0, "bull"))
}

pub(super) fn start_mark(at: Xy) -> Group {
    let triangle = format!("M{} {}l8 5l-8 5Z", px(at.x - 3.0), px(at.y - 5.0));
    Group::new()
        .add(circle(at, 10.0, "start"))
        .add(Path::new().set("d", triangle).set("fill", "#fff"))
}

/// Finds room for numbers.
struct Numbers {
    panel: Rect,
    dots: Vec<Xy>,
    edges: Vec<(Xy, Xy)>,
    taken: Vec<Rect>,
}

impl Numbers {
    fn new(scene: &Scene<'_>, view: &View) -> Self {
        let around = |at: Xy| Rect { x: at.x - 12.0, y: at.y - 12.0, width: 24.0, height: 24.0 };
        let ends = [scene.start, scene.goal].into_iter().flatten();
        let edges = scene.new.iter().chain(&scene.old);
        Self {
            panel: view.panel,
            dots: scene.places.iter().map(|place| view.at(place.at)).collect(),
            edges: edges.map(|edge| (view.at(edge.from), view.at(edge.to))).collect(),
            taken: ends.map(|end| around(view.at(end))).collect(),
        }
    }

    /// The middle of a number's best place around a dot.
    fn place(&mut self, dot: Xy, label: &str) -> Xy {
        let width = 7.5 * label.len() as f64 + 3.0;
        let rect = |at: Xy| Rect { x: at.x - width / 2.0, y: at.y - 7.0, width, height: 14.0 };
        let around = DISTANCES.into_iter().flat_map(|distance| {
            (0..12).map(move |k| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 12.0).sin_cos();
                (
                    distance,
                    Xy { x: dot.x + (distance + width / 4.0) * cos, y: dot.y - distance * sin },
                )
            })
        });
        let best = around
            .map(|(distance, at)| (self.cost(rect(at), dot) + distance / 10.0, at))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(dot, |(_, at)| at);
        self.taken.push(rect(best));
        best
    }

    /// How bad a place is for a dot's number: what it would cover, and dots that it is nearer to.
    fn cost(&self, rect: Rect, dot: Xy) -> f64 {
        let labels = self.taken.iter().filter(|taken| taken.overlaps(rect)).count() as f64;
        let near = Rect {
            x: rect.x - 5.0,
            y: rect.y - 5.0,
            width: rect.width + 10.0,
            height: rect.height + 10.0,
        };
        let dots = self.dots.iter().filter(|dot| near.contains(dot.x, dot.y)).count() as f64;
        let away = |at: Xy| (at.x - rect.x - rect.width / 2.0).hypot(at.y - rect.y - 7.0);
        let nearer = self.dots.iter().filter(|&&other| away(other) < away(dot)).count() as f64;
        let lines = self.edges.iter().filter(|(a, b)| rect.meets(*a, *b)).count() as f64;
        let out = !self.panel.contains(rect.x, rect.y)
            || !self.panel.contains(rect.right(), rect.bottom());
        30.0 * labels + 12.0 * dots + 8.0 * nearer + 6.0 * lines + if out { 100.0 } else { 0.0 }
    }
}
