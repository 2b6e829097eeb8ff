//! The map: obstacles, buffers, fences, candidates, old and new route, scale and north.

use svg::node::element::{ClipPath, Definitions, Group, Path, Polygon};

use super::places::places;
use super::scene::{Edge, Scene};
use super::text;
use super::view::{Rect, View, px};
use crate::airspace::Outline;
use crate::geodesy::Xy;
use crate::planner::candidates::Source;

/// The whole panel.
pub(super) fn map(scene: &Scene<'_>, view: &View) -> Group {
    let clip = ClipPath::new().set("id", "map").add(view.panel.element());
    let drawing = Group::new()
        .set("clip-path", "url(#map)")
        .add(view.panel.element().set("class", "panel"))
        .add(buffers(scene, view))
        .add(outside(scene, view))
        .add(path(obstacles(scene, view, 0.0), "obstacle"))
        .add(path(inclusions(scene, view).concat(), "fence"))
        .add(candidates(scene, view))
        .add(path(lines(&scene.new, view), "casing"))
        .add(path(lines(&scene.old, view), "old"))
        .add(path(lines(&scene.new, view), "new"))
        .add(places(scene, view));
    Group::new()
        .add(Definitions::new().add(clip))
        .add(drawing)
        .add(scale_bar(view))
        .add(north_arrow(view))
        .add(view.panel.element().set("class", "frame"))
}

pub(super) fn path(data: String, class: &str) -> Path {
    Path::new().set("d", data).set("class", class)
}

/// The obstacles that can be seen, with so many metres around them.
pub(super) fn visible<'a>(
    scene: &'a Scene<'_>,
    view: &'a View,
    grown: f64,
) -> impl Iterator<Item = &'a Outline> {
    scene.outlines.iter().filter(move |outline| is_visible(outline, view, grown))
}

fn is_visible(outline: &Outline, view: &View, grown: f64) -> bool {
    match outline {
        Outline::Solid(rings) => view.shows(rings.iter().flatten(), grown),
        Outline::SolidDisc { centre, radius } => view.shows([centre], radius + grown),
        Outline::Zone(_) | Outline::ZoneDisc { .. } => false,
    }
}

/// Path data of an obstacle that can be seen with so many metres around it.
pub(super) fn outline_path(outline: &Outline, around: f64, view: &View) -> Option<String> {
    is_visible(outline, view, around).then(|| outline_data(outline, view))
}

fn outline_data(outline: &Outline, view: &View) -> String {
    match outline {
        Outline::Solid(rings) => rings.iter().map(|ring| view.ring(ring)).collect(),
        Outline::SolidDisc { centre, radius } => view.circle(*centre, *radius),
        Outline::Zone(_) | Outline::ZoneDisc { .. } => String::new(),
    }
}

fn obstacles(scene: &Scene<'_>, view: &View, around: f64) -> String {
    visible(scene, view, around).map(|outline| outline_data(outline, view)).collect()
}

/// The buffers. What lies within `margin` of a ring is what a round pen of twice that width covers:
/// exact, rounded corners included, and joined where buffers meet. The half of it that is inside an
/// obstacle or outside an inclusion is painted over later.
pub(super) fn buffers(scene: &Scene<'_>, view: &View) -> Group {
    let data = obstacles(scene, view, scene.margin) + &inclusions(scene, view).concat();
    let pen = 2.0 * scene.margin * view.scale;
    Group::new()
        .add(path(data.clone(), "rim").set("stroke-width", px(pen + 2.0)))
        .add(path(data, "buffer").set("stroke-width", px(pen)))
}

/// Path data of each inclusion, or of their union.
pub(super) fn inclusions(scene: &Scene<'_>, view: &View) -> Vec<String> {
    if let Some(union) = scene.union {
        let rings = union.iter().flat_map(|polygon| {
            std::iter::once(polygon.exterior()).chain(polygon.interiors()).map(|ring| &ring.0)
        });
        return vec![rings.map(|ring| view.ring(ring)).collect()];
    }
    scene
        .outlines
        .iter()
        .filter_map(|outline| match outline {
            Outline::Zone(ring) => Some(view.ring(ring)),
            Outline::ZoneDisc { centre, radius } => Some(view.circle(*centre, *radius)),
            Outline::Solid(_) | Outline::SolidDisc { .. } => None,
        })
        .collect()
}

/// What inclusions forbid: the panel without each of them.
pub(super) fn outside(scene: &Scene<'_>, view: &View) -> Group {
    let Rect { x, y, width, height } = view.panel;
    let panel = format!("M{} {}h{}v{}h-{}Z", px(x), px(y), px(width), px(height), px(width));
    let shaded = inclusions(scene, view).into_iter().map(|ring| panel.clone() + &ring);
    shaded.fold(Group::new(), |group, data| group.add(path(data, "outside")))
}

/// Whether any of what inclusions forbid is in the panel.
pub(super) fn shows_outside(scene: &Scene<'_>, view: &View) -> bool {
    let meets = |ring: &[Xy]| {
        let ends = ring.iter().zip(ring.iter().cycle().skip(1));
        ends.into_iter().any(|(&a, &b)| view.panel.meets(view.at(a), view.at(b)))
    };
    if let Some(union) = scene.union {
        let mut rings =
            union.iter().flat_map(|p| std::iter::once(p.exterior()).chain(p.interiors()));
        return rings.any(|ring| meets(&ring.0));
    }
    scene.outlines.iter().any(|outline| match outline {
        Outline::Zone(ring) => meets(ring),
        Outline::ZoneDisc { centre, radius } => {
            let at = view.at(*centre);
            let far = |low: f64, high: f64, x: f64| (x - low).abs().max((x - high).abs());
            let (panel, radius) = (view.panel, radius * view.scale);
            far(panel.x, panel.right(), at.x).hypot(far(panel.y, panel.bottom(), at.y)) > radius
        }
        Outline::Solid(_) | Outline::SolidDisc { .. } => false,
    })
}

pub(super) fn candidates(scene: &Scene<'_>, view: &View) -> Group {
    [(Source::Grid, "grid"), (Source::Corners, "corners")].into_iter().fold(
        Group::new(),
        |group, (source, class)| {
            let mut ways = scene.candidates(source).peekable();
            if ways.peek().is_none() {
                return group;
            }
            let data: String = ways.map(|points| view.line(points)).collect();
            group.add(path(data, &format!("route {class}")))
        },
    )
}

/// The edges as one path; those that follow each other are joined.
pub(super) fn lines(edges: &[Edge], view: &View) -> String {
    let mut data = String::new();
    let mut line: Vec<Xy> = Vec::new();
    for edge in edges {
        if line.last() != Some(&edge.from) {
            data += &view.line(&line);
            line = vec![edge.from];
        }
        line.push(edge.to);
    }
    data + &view.line(&line)
}

/// A bar of a round length, about a seventh of the map.
fn scale_bar(view: &View) -> Group {
    let metres = round_length(view.panel.width / 7.0 / view.scale);
    let length = metres * view.scale;
    let (x, y) = (view.panel.x + 26.0, view.panel.bottom() - 24.0);
    let plate = Rect { x: x - 14.0, y: y - 26.0, width: length + 28.0, height: 38.0 };
    let label =
        if metres >= 1000.0 { format!("{} km", metres / 1000.0) } else { format!("{metres} m") };
    let bar = format!("M{} {}v8h{}v-8", px(x), px(y - 6.0), px(length));
    let line = Path::new().set("d", bar).set("fill", "none").set("stroke", "#2b3440");
    Group::new()
        .add(plate.element().set("class", "plate").set("rx", 5))
        .add(line.set("stroke-width", 2))
        .add(text(x + length / 2.0, y - 9.0, "middle", &label))
}

/// The largest of 1, 2, 5 times a power of ten that is not above a length.
fn round_length(length: f64) -> f64 {
    let decade = 10f64.powf(length.log10().floor());
    [5.0, 2.0].into_iter().map(|step| step * decade).find(|&step| step <= length).unwrap_or(decade)
}

fn north_arrow(view: &View) -> Group {
    let (x, y) = (view.panel.right() - 32.0, view.panel.y + 18.0);
    let points = [(0.0, 0.0), (9.0, 26.0), (0.0, 20.0), (-9.0, 26.0)]
        .map(|(dx, dy)| format!("{},{}", px(x + dx), px(y + dy)));
    let plate = Rect { x: x - 18.0, y: y - 8.0, width: 36.0, height: 56.0 };
    Group::new()
        .add(plate.element().set("class", "plate").set("rx", 5))
        .add(Polygon::new().set("points", points.join(" ")).set("class", "ink"))
        .add(text(x, y + 42.0, "middle head", "N"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_bar_has_a_round_length() {
        for (length, round) in [(99.0, 50.0), (100.0, 100.0), (260.0, 200.0), (0.7, 0.5)] {
            assert!((round_length(length) - round).abs() < 1e-9, "{length}");
        }
    }
}
