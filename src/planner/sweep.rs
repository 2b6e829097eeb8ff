//! What can be seen from a place: the walls and corners that take part in a search, looked at from
//! near to far, until nothing further is in sight.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::{PI, TAU};

use geo::Line;
use rstar::{AABB, Envelope, ParentNode, RTree, RTreeNode, RTreeObject};

use super::polyline::distance;
use crate::geodesy::Xy;

/// A wall, or a corner by its number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Sight {
    Wall(Line),
    Corner(u32, Xy),
}

impl RTreeObject for Sight {
    type Envelope = AABB<[f64; 2]>;

    fn envelope(&self) -> Self::Envelope {
        match self {
            Self::Wall(wall) => {
                AABB::from_corners([wall.start.x, wall.start.y], [wall.end.x, wall.end.y])
            }
            Self::Corner(_, point) => AABB::from_point([point.x, point.y]),
        }
    }
}

/// The directions that are of interest from a place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cone {
    /// The middle, radians.
    pub(super) towards: f64,
    /// Up to this to both sides, radians; at least π for all directions.
    pub(super) half: f64,
}

impl Cone {
    /// Every direction.
    pub(super) const ALL: Self = Self { towards: 0.0, half: PI };
}

/// Taken off every shadow so that rounding never hides what just can be seen, radians.
const PENUMBRA: f64 = 1e-9;

/// Visits the corners in a cone from near to far, without those that some wall nearer than
/// themselves hides: an edge to them would come nearer than `margin` to that wall. Boxes that are
/// not `worth` it are left out; `visit` gets the corner.
pub(super) fn sweep(
    sights: &RTree<Sight>,
    place: Xy,
    cone: Cone,
    margin: f64,
    worth: impl Fn(&AABB<[f64; 2]>) -> bool,
    mut visit: impl FnMut(u32),
) {
    let bearing = |point: Xy| {
        let angle = (point.y - place.y).atan2(point.x - place.x) - cone.towards;
        angle - TAU * (angle / TAU).round()
    };
    let mut shadows = Shadows { half: cone.half.min(PI), dark: Vec::new() };
    // Walls whose far end is still ahead, by the distance from which on they hide everything.
    let mut walls: BinaryHeap<Reverse<(u64, [u64; 2])>> = BinaryHeap::new();
    let mut open: BinaryHeap<Near<'_>> = BinaryHeap::new();
    open.push(Near { distance: 0.0, what: What::Parent(sights.root()) });
    while let Some(Near { distance: here, what }) = open.pop() {
        while let Some(Reverse((from, range))) = walls.peek().copied() {
            if f64::from_bits(from) > here {
                break;
            }
            walls.pop();
            shadows.add(range.map(f64::from_bits));
        }
        if shadows.cover_all() {
            return;
        }
        match what {
            What::Parent(node) => {
                for child in node.children() {
                    let envelope = child.envelope();
                    let distance = envelope.distance_2(&[place.x, place.y]).sqrt();
                    let what = match child {
                        RTreeNode::Parent(node) => What::Parent(node),
                        RTreeNode::Leaf(sight) => What::Sight(*sight),
                    };
                    if worth(&envelope) && !shadows.hide_box(&envelope, place, bearing) {
                        open.push(Near { distance, what });
                    }
                }
            }
            What::Sight(Sight::Wall(wall)) => {
                let (a, b) = (distance(place, wall.start), distance(place, wall.end));
                if a == 0.0 || b == 0.0 {
                    continue;
                }
                let (at_a, at_b) = (bearing(wall.start), bearing(wall.end));
                let widen = |far: f64| (margin / far).min(1.0).asin() - PENUMBRA;
                // From one end to the other the short way round.
                let turn = at_b - at_a - TAU * ((at_b - at_a) / TAU).round();
                let range = if turn >= 0.0 {
                    [at_a - widen(a), at_a + turn + widen(b)]
                } else {
                    [at_a + turn - widen(b), at_a + widen(a)]
                };
                // The bits of a distance are in the order of the distances: none is negative.
                walls.push(Reverse((a.max(b).to_bits(), range.map(f64::to_bits))));
            }
            What::Sight(Sight::Corner(corner, point)) => {
                if !shadows.hide(bearing(point)) {
                    visit(corner);
                }
            }
        }
    }
}

/// Something to look at, the nearest first.
struct Near<'t> {
    distance: f64,
    what: What<'t>,
}

enum What<'t> {
    Parent(&'t ParentNode<Sight>),
    Sight(Sight),
}

impl PartialEq for Near<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.distance.total_cmp(&other.distance).is_eq()
    }
}

impl Eq for Near<'_> {}

impl PartialOrd for Near<'_> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Near<'_> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        other.distance.total_cmp(&self.distance)
    }
}

/// Directions in the dark, as sorted ranges that do not overlap, relative to a cone's middle.
struct Shadows {
    half: f64,
    dark: Vec<[f64; 2]>,
}

impl Shadows {
    /// Darkens a range; its middle is anywhere, its width less than a full circle.
    fn add(&mut self, [low, high]: [f64; 2]) {
        for shift in [-TAU, 0.0, TAU] {
            let (low, high) = ((low + shift).max(-self.half), (high + shift).min(self.half));
            if low < high {
                self.merge([low, high]);
            }
        }
    }

    fn merge(&mut self, mut range: [f64; 2]) {
        let first = self.dark.partition_point(|dark| dark[1] < range[0]);
        let mut last = first;
        while let Some(dark) = self.dark.get(last).filter(|dark| dark[0] <= range[1]) {
            range = [range[0].min(dark[0]), range[1].max(dark[1])];
            last += 1;
        }
        self.dark.splice(first..last, [range]);
    }

    fn cover_all(&self) -> bool {
        self.dark.first().is_some_and(|dark| dark[0] <= -self.half && dark[1] >= self.half)
    }

    /// Whether all of a box is in the dark or outside the cone.
    fn hide_box(&self, envelope: &AABB<[f64; 2]>, place: Xy, bearing: impl Fn(Xy) -> f64) -> bool {
        if self.dark.is_empty() && self.half >= PI {
            return false;
        }
        let [x, y] = envelope.center();
        let (low, far) = (envelope.lower(), distance(place, Xy { x, y }));
        let reach = distance(Xy { x: low[0], y: low[1] }, Xy { x, y });
        if reach >= far {
            return false;
        }
        let (middle, wide) = (bearing(Xy { x, y }), (reach / far).asin() + PENUMBRA);
        // All of it next to the cone, or all of it in one dark range.
        if middle.abs() - wide > self.half && middle.abs() + wide < TAU - self.half {
            return true;
        }
        let (low, high) = ((middle - wide).max(-self.half), (middle + wide).min(self.half));
        let k = self.dark.partition_point(|dark| dark[1] < high);
        middle - wide > -PI
            && middle + wide < PI
            && self.dark.get(k).is_some_and(|dark| dark[0] < low)
    }

    /// Whether a direction is in the dark or outside the cone.
    fn hide(&self, angle: f64) -> bool {
        let k = self.dark.partition_point(|dark| dark[1] < angle);
        angle.abs() > self.half || self.dark.get(k).is_some_and(|dark| dark[0] < angle)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use geo::{Distance, Euclidean};

    proptest! {
        #[test]
        fn what_is_not_visited_is_outside_the_cone_or_barred(
            walls in prop::collection::vec(prop::array::uniform4(-100.0f64..100.0), 0..40),
            corners in prop::collection::vec(prop::array::uniform2(-100.0f64..100.0), 1..40),
            towards in -7.0f64..7.0, half in 0.1f64..3.2,
        ) {
            let place = Xy { x: 0.3, y: 0.4 };
            let margin = 5.0;
            let walls: Vec<Line> =
                walls.into_iter().map(|[a, b, c, d]| Line::new((a, b), (c, d))).collect();
            let mut sights: Vec<Sight> = walls.iter().copied().map(Sight::Wall).collect();
            let corners: Vec<Xy> = corners.into_iter().map(|[x, y]| Xy { x, y }).collect();
            sights.extend(corners.iter().enumerate().map(|(i, &c)| Sight::Corner(i as u32, c)));
            // The search only asks from places that are clear.
            prop_assume!(walls.iter().all(|w| Euclidean.distance(w, &geo::Point::from(place)) > margin));
            let mut seen = vec![false; corners.len()];
            let mut last = 0.0;
            let (cone, sights) = (Cone { towards, half }, RTree::bulk_load(sights));
            sweep(&sights, place, cone, margin, |_| true, |corner| {
                let far = distance(place, corners[corner as usize]);
                assert!(far >= last);
                last = far;
                seen[corner as usize] = true;
            });
            for (corner, seen) in corners.iter().zip(seen) {
                let edge = Line::new(place, *corner);
                let off = (edge.dy().atan2(edge.dx()) - towards).rem_euclid(TAU);
                let barred = walls.iter().any(|wall| Euclidean.distance(&edge, wall) < margin);
                prop_assert!(seen || barred || off.min(TAU - off) >= half);
            }
        }
    }
}
