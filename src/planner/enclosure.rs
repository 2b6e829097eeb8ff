//! Proof that a leg has no way: start and goal lie in different parts of what is left to fly in.
//!
//! Obstacles are grown by a little *less* than the margin (inclusions shrunk by less), so that
//! what is found free is a superset of the free space. If start and goal are not connected in
//! the superset, no path exists at any grid size.

use std::collections::BTreeSet;

use geo::{Area, BooleanOps, Intersects, Line, MultiPolygon, Point, Polygon, Rect, unary_union};

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

/// How far around an end the first look reaches, in margins; each further one reaches twice as
/// far.
const FIRST_LOOK: f64 = 64.0;

/// Room around everything in which a path could go round the outside, metres.
const OUTSIDE: f64 = 1000.0;

/// A part of the free space this near to the edge of what was looked at may go on beyond it,
/// metres.
const AT_THE_EDGE: f64 = 1e-2;

/// Looks for a proof that no path leads from start to goal; `None` where there is none.
///
/// What shuts an end in is mostly near to it: first only what lies around the ends is looked at,
/// then twice as far, and at last everything.
#[must_use]
pub fn enclosure(space: &LegSpace<'_>, start: Xy, goal: Xy) -> Option<Enclosure> {
    let margin = space.margin() * SHARE - LESS;
    if margin <= 0.0 {
        return None;
    }
    let zones = room_of_zones(space, margin);
    let all = surroundings(space, start, goal);
    let mut reach = FIRST_LOOK * margin;
    while reach < all.width().max(all.height()) {
        for (end, other, goal) in [(goal, start, true), (start, goal, false)] {
            let off = Xy { x: reach, y: reach };
            let look = Rect::new(end - off, end + off);
            let free = free(space, margin, look, zones.as_ref());
            let part = free.0.into_iter().find(|part| part.intersects(&Point::from(end)));
            if let Some(part) = part
                && !part.intersects(&Point::from(other))
                && part.exterior().coords().all(|&corner| is_within(corner, &look))
            {
                return Some(Enclosure { goal, regions: along_the_edge(space, &part, end) });
            }
        }
        reach *= 2.0;
    }

    let free = free(space, margin, all, zones.as_ref());
    let part_of = |point: Xy| free.iter().position(|part| part.intersects(&Point::from(point)));
    let (from, to) = (part_of(start)?, part_of(goal)?);
    if from == to {
        return None;
    }
    // The smaller part is the one that is shut in.
    let goal_is_in = free.0[to].unsigned_area() < free.0[from].unsigned_area();
    let (part, inside) = if goal_is_in { (to, goal) } else { (from, start) };
    Some(Enclosure { goal: goal_is_in, regions: along_the_edge(space, &free.0[part], inside) })
}

/// What of a box is free to fly in, `margin` metres away from everything.
fn free(
    space: &LegSpace<'_>,
    margin: f64,
    look: Rect,
    zones: Option<&MultiPolygon>,
) -> MultiPolygon {
    let airspace = space.airspace();
    let beyond = Xy { x: margin, y: margin };
    let near: BTreeSet<RegionId> = airspace
        .obstacles_in(look.min() - beyond, look.max() + beyond)
        .map(|(region, _)| region)
        .collect();
    let grown: Vec<Polygon> = near
        .iter()
        .flat_map(|region| buffered(&airspace.outlines()[region.0 as usize], margin))
        .collect();
    let room = MultiPolygon::new(vec![look.to_polygon()]);
    let room = zones.map_or_else(|| room.clone(), |zones| room.intersection(zones));
    room.difference(&unary_union(&grown))
}

/// What the inclusions leave, where there are any.
fn room_of_zones(space: &LegSpace<'_>, margin: f64) -> Option<MultiPolygon> {
    let union = space.airspace().union().map(|union| shrunk_union(union, margin));
    let zones = space.airspace().zones().map(|zone| buffered(zone, margin));
    union.into_iter().chain(zones).reduce(|room, zone| room.intersection(&zone))
}

/// Whether a point lies in a box, and not next to its edge.
fn is_within(point: Xy, look: &Rect) -> bool {
    let (low, high) = (point - look.min(), look.max() - point);
    low.x.min(low.y).min(high.x).min(high.y) > AT_THE_EDGE
}

/// A box around everything, in which a path could go round the outside of all obstacles.
fn surroundings(space: &LegSpace<'_>, start: Xy, goal: Xy) -> Rect {
    let around = Rect::new(start, goal);
    let (mut low, mut high) = (around.min(), around.max());
    let mut add = |point: Xy, radius: f64| {
        low = Xy { x: low.x.min(point.x - radius), y: low.y.min(point.y - radius) };
        high = Xy { x: high.x.max(point.x + radius), y: high.y.max(point.y + radius) };
    };
    for outline in space.airspace().outlines() {
        match outline {
            Outline::Solid(rings) => rings.iter().flatten().for_each(|&point| add(point, 0.0)),
            Outline::SolidDisc { centre, radius } => add(*centre, *radius),
            // No path goes beyond these.
            Outline::Zone(_) | Outline::ZoneDisc { .. } => {}
        }
    }
    let border = OUTSIDE + space.margin();
    Rect::new(low - Xy { x: border, y: border }, high + Xy { x: border, y: border })
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
