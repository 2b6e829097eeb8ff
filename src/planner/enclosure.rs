//! Proof that a leg has no way: start and goal lie in different parts of what is left to fly in.
//!
//! Obstacles are grown by a little *less* than the margin (inclusions shrunk by less), so that
//! what is found free is a superset of the free space. If start and goal are not connected in
//! the superset, no path exists at any grid size.

use geo::{
    BooleanOps, BoundingRect, Intersects, Line, MultiPolygon, Point, Polygon, Rect, unary_union,
};

use super::leg_space::LegSpace;
use crate::airspace::buffered::{buffered, shrunk_union};
use crate::airspace::{Outline, RegionId};
use crate::geodesy::Xy;

/// The margin that the proof uses, as a share of the leg's, and what is taken off it, metres.
const SHARE: f64 = 0.995;
const LESS: f64 = 0.01;

/// The most regions that a message names.
const NAMED: usize = 5;

/// Why there is no way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Enclosure {
    /// Whether it is the goal that is shut in (else the start).
    pub goal: bool,
    /// Regions along the edge of the part that it is shut in, the nearest first.
    pub regions: Vec<RegionId>,
}

/// Looks for a proof that no path leads from start to goal; `None` where there is none.
#[must_use]
pub fn enclosure(space: &LegSpace<'_>, start: Xy, goal: Xy) -> Option<Enclosure> {
    let margin = space.margin() * SHARE - LESS;
    if margin <= 0.0 {
        return None;
    }
    let outlines = space.airspace().outlines();
    let grown: Vec<Polygon> = outlines
        .iter()
        .filter(|outline| matches!(outline, Outline::Solid(_) | Outline::SolidDisc { .. }))
        .flat_map(|outline| buffered(outline, margin))
        .collect();
    let forbidden = unary_union(&grown);
    let mut room = surroundings(&forbidden, start, goal);
    if let Some(union) = space.airspace().union() {
        room = room.intersection(&shrunk_union(union, margin));
    }
    for zone in space.airspace().zones() {
        room = room.intersection(&buffered(zone, margin));
    }
    let free = room.difference(&forbidden);
    let part_of = |point: Xy| free.iter().position(|part| part.intersects(&Point::from(point)));
    let (from, to) = (part_of(start)?, part_of(goal)?);
    if from == to {
        return None;
    }
    // The smaller part is the one that is shut in.
    use geo::Area;
    let goal_is_in = free.0[to].unsigned_area() < free.0[from].unsigned_area();
    let (part, inside) = if goal_is_in { (to, goal) } else { (from, start) };
    Some(Enclosure { goal: goal_is_in, regions: along_the_edge(space, &free.0[part], inside) })
}

/// A box around everything, in which a path could go round the outside of all obstacles.
fn surroundings(forbidden: &MultiPolygon, start: Xy, goal: Xy) -> MultiPolygon {
    let around = Rect::new(start, goal);
    let (mut low, mut high) = (around.min(), around.max());
    if let Some(rect) = forbidden.bounding_rect() {
        low = Xy { x: low.x.min(rect.min().x), y: low.y.min(rect.min().y) };
        high = Xy { x: high.x.max(rect.max().x), y: high.y.max(rect.max().y) };
    }
    let border = Xy { x: 1000.0, y: 1000.0 };
    MultiPolygon::new(vec![Rect::new(low - border, high + border).to_polygon()])
}

/// The regions within reach of a part's outline, by their distance from the point inside.
fn along_the_edge(space: &LegSpace<'_>, part: &Polygon, inside: Xy) -> Vec<RegionId> {
    let reach = space.margin() * 1.05 + 0.1;
    let mut near: Vec<(f64, RegionId)> = Vec::new();
    let rings = std::iter::once(part.exterior()).chain(part.interiors());
    for line in rings.flat_map(|ring| ring.lines()) {
        for (_, barrier) in space.airspace().barriers().within(line, reach) {
            let distance = barrier.distance(Line::new(inside, inside));
            match near.iter_mut().find(|(_, region)| *region == barrier.region) {
                Some((least, _)) => *least = least.min(distance),
                None => near.push((distance, barrier.region)),
            }
        }
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    near.into_iter().map(|(_, region)| region).take(NAMED).collect()
}
