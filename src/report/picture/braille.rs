//! The map on a terminal: braille dots, two by four in each character.
//!
//! Obstacles are hatched with an outline, the original route is dotted where it was changed, the
//! new route is a line. Where a route passes, nothing else is drawn, so that it can be seen without
//! colours too.

use super::scene::{Edge, Role, Scene};
use super::{Subject, view::View};
use crate::airspace::Outline;
use crate::geodesy::{ProjectionError, Xy};
use crate::report::text::count;

/// The most characters across and down: with its legend it fits into 80 by 24.
const COLUMNS: usize = 78;
const ROWS: usize = 18;

/// Dots of the original route that are drawn, and their spacing.
const DASH: (usize, usize) = (2, 5);

/// What a character shows, least important first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Layer {
    Ground,
    Obstacle,
    Old,
    New,
}

#[derive(Debug, Clone, Copy)]
struct Cell {
    layer: Layer,
    dots: u8,
    letter: Option<char>,
}

struct Canvas {
    columns: usize,
    rows: usize,
    cells: Vec<Cell>,
}

/// Draws the map with its legend, in lines of at most 80 characters; with colours where the
/// terminal has them.
///
/// # Errors
/// [`ProjectionError`] where a place of the mission cannot be projected into the drawn zone.
pub(in crate::report) fn braille(
    subject: &Subject<'_>,
    colours: bool,
) -> Result<String, ProjectionError> {
    let scene = Scene::new(subject)?;
    let (low, high) = scene.extent();
    let size = high - low;
    // Dots are about square: a character is twice as high as wide, and has twice as many rows.
    let per_dot = (size.x / (2 * COLUMNS) as f64).max(size.y / (4 * ROWS) as f64);
    let whole =
        |metres: f64, dots: usize| ((metres / per_dot).ceil() as usize).div_ceil(dots).max(1);
    let (columns, rows) = (whole(size.x, 2).min(COLUMNS), whole(size.y, 4).min(ROWS));
    let blank = Cell { layer: Layer::Ground, dots: 0, letter: None };
    let mut canvas = Canvas { columns, rows, cells: vec![blank; columns * rows] };
    let panel = super::view::Rect {
        x: 0.0,
        y: 0.0,
        width: (2 * columns) as f64,
        height: (4 * rows) as f64,
    };
    let view = View::new(panel, low, high);

    for outline in scene.outlines {
        canvas.outline(outline, &view);
    }
    let kept = |edge: &&Edge| !scene.new.contains(edge);
    for edge in scene.old.iter().filter(kept) {
        canvas.line(view.at(edge.from), view.at(edge.to), Layer::Old, DASH);
    }
    for edge in &scene.new {
        canvas.line(view.at(edge.from), view.at(edge.to), Layer::New, (1, 1));
    }
    for place in &scene.places {
        let letter = if place.role == Role::Inserted { 'o' } else { '•' };
        canvas.letter(view.at(place.at), letter);
    }
    for (end, letter) in [(scene.goal, 'E'), (scene.start, 'S')] {
        if let Some(end) = end {
            canvas.letter(view.at(end), letter);
        }
    }
    let mut out = canvas.text(colours);
    let inserted = scene.places.iter().filter(|place| place.role == Role::Inserted).count();
    let waypoints = match inserted {
        0 => String::new(),
        some => format!(", o {}", count(some, "new waypoint")),
    };
    let column = 2.0 / view.scale;
    out += &format!("S start, E end, • item{waypoints}; a column is {column:.1} m, north is up\n");
    Ok(out)
}

impl Canvas {
    fn cell(&mut self, x: i64, y: i64) -> Option<(&mut Cell, u8)> {
        // Unicode's numbering of the dots, column by column.
        const BITS: [[u8; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];
        let (column, row) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        let bit = BITS[column % 2][row % 4];
        let (column, row) = (column / 2, row / 4);
        let inside = column < self.columns && row < self.rows;
        let cell = inside.then(|| self.cells.get_mut(row * self.columns + column)).flatten()?;
        Some((cell, bit))
    }

    /// Sets a dot; what is less important in its character goes away.
    fn dot(&mut self, x: f64, y: f64, layer: Layer) {
        if !x.is_finite() || !y.is_finite() || x.abs() > 1e6 || y.abs() > 1e6 {
            return;
        }
        let Some((cell, bit)) = self.cell(x.floor() as i64, y.floor() as i64) else { return };
        if layer > cell.layer {
            (cell.layer, cell.dots) = (layer, 0);
        }
        if layer == cell.layer {
            cell.dots |= bit;
        }
    }

    fn letter(&mut self, at: Xy, letter: char) {
        // The dot on the lower or right edge is the last one inside.
        let edge = |value: f64, dots: usize| value.min(dots as f64 - 0.5).max(0.0).floor() as i64;
        let (x, y) = (edge(at.x, 2 * self.columns), edge(at.y, 4 * self.rows));
        if let Some((cell, _)) = self.cell(x, y) {
            cell.letter = Some(letter);
        }
    }

    /// A line of dots, of which the first `on` of every `of` are drawn. What is off the canvas is
    /// not walked over.
    fn line(&mut self, from: Xy, to: Xy, layer: Layer, (on, of): (usize, usize)) {
        let Some((from, to)) = self.clipped(from, to) else { return };
        let steps = ((to.x - from.x).abs().max((to.y - from.y).abs()) * 1.5).ceil().max(1.0);
        for k in 0..=steps as usize {
            if k % of < on {
                let at = from + (to - from) * (k as f64 / steps);
                self.dot(at.x, at.y, layer);
            }
        }
    }

    /// The part of a line on the canvas (Liang and Barsky 1984).
    fn clipped(&self, a: Xy, b: Xy) -> Option<(Xy, Xy)> {
        let (width, height) = ((2 * self.columns) as f64, (4 * self.rows) as f64);
        let (mut enters, mut leaves) = (0.0f64, 1.0f64);
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        for (along, room) in [(-dx, a.x), (dx, width - a.x), (-dy, a.y), (dy, height - a.y)] {
            if along == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if along < 0.0 {
                enters = enters.max(room / along);
            } else {
                leaves = leaves.min(room / along);
            }
        }
        (enters <= leaves).then(|| (a + (b - a) * enters, a + (b - a) * leaves))
    }

    fn outline(&mut self, outline: &Outline, view: &View) {
        let circle = |centre: Xy, radius: f64| -> Vec<Xy> {
            let at = view.at(centre);
            let corner = |k: u32| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / 48.0).sin_cos();
                Xy { x: at.x + radius * view.scale * cos, y: at.y + radius * view.scale * sin }
            };
            (0..48).map(corner).collect()
        };
        let ring = |ring: &[Xy]| -> Vec<Xy> { ring.iter().map(|&at| view.at(at)).collect() };
        let (rings, solid): (Vec<Vec<Xy>>, bool) = match outline {
            Outline::Solid(rings) => (rings.iter().map(|r| ring(r)).collect(), true),
            Outline::SolidDisc { centre, radius } => (vec![circle(*centre, *radius)], true),
            Outline::Zone(zone) => (vec![ring(zone)], false),
            Outline::ZoneDisc { centre, radius } => (vec![circle(*centre, *radius)], false),
        };
        if solid {
            self.hatch(&rings);
        }
        for ring in &rings {
            for (&from, &to) in ring.iter().zip(ring.iter().cycle().skip(1)) {
                self.line(from, to, Layer::Obstacle, (1, 1));
            }
        }
    }

    /// Every second dot inside the rings, row by row, by the crossings of the row's middle.
    fn hatch(&mut self, rings: &[Vec<Xy>]) {
        let ends = || rings.iter().flatten().map(|at| at.y);
        let (top, bottom) = (ends().fold(f64::INFINITY, f64::min), ends().fold(0.0, f64::max));
        let last = (4 * self.rows) as f64;
        for row in (top.max(0.0) as usize)..(bottom.min(last).ceil() as usize) {
            let y = row as f64 + 0.5;
            let mut crossings: Vec<f64> = Vec::new();
            for ring in rings {
                for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
                    if (a.y <= y) != (b.y <= y) {
                        crossings.push(a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y));
                    }
                }
            }
            crossings.sort_by(f64::total_cmp);
            for inside in crossings.chunks_exact(2) {
                let from = inside[0].max(0.0).ceil() as usize;
                let to = inside[1].min((2 * self.columns) as f64).floor().max(0.0) as usize;
                for column in (from..to).filter(|column| (column + row) % 2 == 0) {
                    self.dot(column as f64, y, Layer::Obstacle);
                }
            }
        }
    }

    fn text(&self, colours: bool) -> String {
        let mut out = String::new();
        for row in self.cells.chunks(self.columns) {
            let mut line = String::new();
            let mut current = None;
            for cell in row {
                let shown = cell.letter.unwrap_or(match cell.dots {
                    0 => ' ',
                    dots => char::from_u32(0x2800 + u32::from(dots)).unwrap_or(' '),
                });
                let colour = match (cell.letter, cell.layer) {
                    (Some(_), _) => Some("1"),
                    (_, Layer::New) => Some("34"),
                    (_, Layer::Old) => Some("31"),
                    (_, Layer::Obstacle) => Some("90"),
                    (_, Layer::Ground) => None,
                };
                if colours && colour != current {
                    line += &format!("\u{1b}[0;{}m", colour.unwrap_or("0"));
                    current = colour;
                }
                line.push(shown);
            }
            if colours {
                line += "\u{1b}[0m";
            }
            out += line.trim_end();
            out.push('\n');
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replan::Options;
    use crate::report::samples::{self, POND, YARD};
    use crate::report::text::WIDTH;

    #[test]
    fn a_plan_has_its_start_its_new_waypoints_and_both_routes() {
        let options = Options::default();
        let result = samples::planned(POND, &options);
        let map = braille(&(&result).into(), false).unwrap();
        assert!(map.lines().all(|line| line.chars().count() <= WIDTH), "{map}");
        assert!(map.lines().count() <= 24);
        let drawn = &map[..map.find("S start").unwrap()];
        assert!(drawn.contains('S') && drawn.contains('o'), "{map}");
        let dots = drawn.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count();
        assert!(dots > 100, "{map}");
        assert!(!map.contains('\u{1b}'));
        let coloured = braille(&(&result).into(), true).unwrap();
        for colour in ["\u{1b}[0;34m", "\u{1b}[0;31m", "\u{1b}[0;90m"] {
            assert!(coloured.contains(colour), "{colour:?}");
        }
        // Colours change nothing else.
        let mut plain = String::new();
        for (k, part) in coloured.split('\u{1b}').enumerate() {
            plain += if k == 0 { part } else { part.split_once('m').unwrap().1 };
        }
        let trimmed: Vec<_> = plain.lines().map(str::trim_end).collect();
        assert_eq!(trimmed, map.lines().collect::<Vec<_>>());
    }

    #[test]
    fn a_mission_without_a_plan_and_one_without_legs_are_drawn() {
        let options = Options::default();
        let (verdict, fields) = samples::judged(YARD, &options);
        let map = braille(&Subject::judged(&verdict, &fields), false).unwrap();
        assert!(map.contains('S') && map.contains('E'), "{map}");
        let nothing = crate::replan::Verdict { legs: Vec::new(), warnings: Vec::new() };
        braille(&Subject::judged(&nothing, &[]), false).unwrap();
    }
}
