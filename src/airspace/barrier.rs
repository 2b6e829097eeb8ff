//! What stands in the way: wall segments and discs, their distance to a segment of a path, and
//! the R-tree over them. Sidedness (inside or outside) is [`super::space`]'s.

use std::cell::Cell;

use geo::line_intersection::{LineIntersection, line_intersection};
use geo::{Distance, Euclidean, Line, Point};
use rstar::{AABB, RTree, RTreeObject, SelectionFunction};

use super::space::RegionId;
use crate::geodesy::Xy;

/// A wall or a round obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Barrier {
    /// Its shape.
    pub shape: BarrierShape,
    /// The region it belongs to.
    pub region: RegionId,
}

/// A barrier's shape, in local metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BarrierShape {
    /// A straight wall.
    Wall(Line),
    /// A disc that is forbidden inside.
    Disc {
        /// Its centre.
        centre: Xy,
        /// Its radius, metres.
        radius: f64,
    },
}

impl Barrier {
    /// The distance from a segment to the barrier, metres; 0 where they meet.
    #[must_use]
    pub fn distance(&self, segment: Line) -> f64 {
        match self.shape {
            BarrierShape::Wall(wall) => Euclidean.distance(&segment, &wall),
            BarrierShape::Disc { centre, radius } => {
                (Euclidean.distance(&segment, &Point::from(centre)) - radius).max(0.0)
            }
        }
    }
}

impl Barrier {
    /// How far along a ray (from its start) the barrier is first met, metres.
    #[must_use]
    pub fn first_hit(&self, ray: Line) -> Option<f64> {
        let from_start = |point: Xy| (point.x - ray.start.x).hypot(point.y - ray.start.y);
        match self.shape {
            BarrierShape::Wall(wall) => line_intersection(ray, wall).map(|hit| match hit {
                LineIntersection::SinglePoint { intersection, .. } => from_start(intersection),
                LineIntersection::Collinear { intersection } => {
                    from_start(intersection.start).min(from_start(intersection.end))
                }
            }),
            BarrierShape::Disc { centre, radius } => {
                (self.distance(ray) <= 0.0).then(|| (from_start(centre) - radius).max(0.0))
            }
        }
    }
}

impl RTreeObject for Barrier {
    type Envelope = AABB<[f64; 2]>;

    fn envelope(&self) -> Self::Envelope {
        match self.shape {
            BarrierShape::Wall(wall) => {
                AABB::from_corners([wall.start.x, wall.start.y], [wall.end.x, wall.end.y])
            }
            BarrierShape::Disc { centre, radius } => AABB::from_corners(
                [centre.x - radius, centre.y - radius],
                [centre.x + radius, centre.y + radius],
            ),
        }
    }
}

/// Slack for rounding in the lower bounds of the search, metres.
const ROUNDING: f64 = 1e-6;

/// The barriers in an R-tree.
#[derive(Debug)]
pub struct BarrierIndex {
    tree: RTree<Barrier>,
}

impl BarrierIndex {
    /// Builds the index; `O(n log n)`.
    #[must_use]
    pub fn new(barriers: Vec<Barrier>) -> Self {
        Self { tree: RTree::bulk_load(barriers) }
    }

    /// The nearest barrier closer than `at_most` to a segment, with its distance in metres.
    ///
    /// Only subtrees that may hold something nearer than the best so far are opened. With
    /// `enough`, the search ends at the first barrier at or below that distance: whoever only
    /// wants to know *whether* something is too near need not find the nearest.
    #[must_use]
    pub fn nearest(&self, segment: Line, at_most: f64, enough: f64) -> Option<(f64, RegionId)> {
        let (bound, found) = (Cell::new(at_most), Cell::new(None));
        let search = NearSegment::new(segment, enough, &bound, &found);
        // The search keeps its result in its cells; no element is ever "selected".
        let _ = self.tree.locate_with_selection_function(search).next();
        found.get().map(|region| (bound.get(), region))
    }

    /// Visits every barrier within `at_most` metres of a segment.
    pub fn within(&self, segment: Line, at_most: f64) -> impl Iterator<Item = (f64, &Barrier)> {
        let at_least = at_most + ROUNDING;
        let (low, high) = (
            [
                segment.start.x.min(segment.end.x) - at_least,
                segment.start.y.min(segment.end.y) - at_least,
            ],
            [
                segment.start.x.max(segment.end.x) + at_least,
                segment.start.y.max(segment.end.y) + at_least,
            ],
        );
        self.tree
            .locate_in_envelope_intersecting(&AABB::from_corners(low, high))
            .map(move |barrier| (barrier.distance(segment), barrier))
            .filter(move |(distance, _)| *distance <= at_most)
    }
}

/// Opens the subtrees that may hold something nearer to a segment than the best so far.
struct NearSegment<'a> {
    segment: Line,
    middle: Xy,
    /// Unit vector along the segment; any unit vector for a point.
    along: Xy,
    half_length: f64,
    enough: f64,
    bound: &'a Cell<f64>,
    found: &'a Cell<Option<RegionId>>,
}

impl<'a> NearSegment<'a> {
    fn new(
        segment: Line,
        enough: f64,
        bound: &'a Cell<f64>,
        found: &'a Cell<Option<RegionId>>,
    ) -> Self {
        let delta = segment.delta();
        let length = delta.x.hypot(delta.y);
        let along = if length > 0.0 { delta / length } else { Xy { x: 1.0, y: 0.0 } };
        let middle = (segment.start + segment.end) / 2.0;
        Self { segment, middle, along, half_length: length / 2.0, enough, bound, found }
    }

    /// Whether what was found is near enough to stop.
    fn is_done(&self) -> bool {
        self.found.get().is_some() && self.bound.get() <= self.enough
    }

    /// A lower bound of the distance from the segment to a box: the largest gap between their
    /// shadows on the axes, on the segment's direction and on its normal (separating axes).
    fn gap(&self, envelope: &AABB<[f64; 2]>) -> f64 {
        let (low, high) = (envelope.lower(), envelope.upper());
        let half = Xy { x: (high[0] - low[0]) / 2.0, y: (high[1] - low[1]) / 2.0 };
        let offset = Xy { x: low[0] + half.x, y: low[1] + half.y } - self.middle;
        let (ux, uy) = (self.along.x.abs(), self.along.y.abs());
        let gap_x = offset.x.abs() - half.x - self.half_length * ux;
        let gap_y = offset.y.abs() - half.y - self.half_length * uy;
        let gap_along = (offset.x * self.along.x + offset.y * self.along.y).abs()
            - self.half_length
            - (half.x * ux + half.y * uy);
        let gap_across =
            (offset.y * self.along.x - offset.x * self.along.y).abs() - (half.x * uy + half.y * ux);
        gap_x.max(gap_y).max(gap_along).max(gap_across)
    }
}

impl SelectionFunction<Barrier> for NearSegment<'_> {
    fn should_unpack_parent(&self, envelope: &AABB<[f64; 2]>) -> bool {
        !self.is_done() && self.gap(envelope) < self.bound.get() + ROUNDING
    }

    fn should_unpack_leaf(&self, barrier: &Barrier) -> bool {
        if !self.is_done() && self.gap(&barrier.envelope()) < self.bound.get() + ROUNDING {
            let distance = barrier.distance(self.segment);
            if distance < self.bound.get() {
                self.bound.set(distance);
                self.found.set(Some(barrier.region));
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn line((ax, ay, bx, by): (f64, f64, f64, f64)) -> Line {
        Line::new((ax, ay), (bx, by))
    }

    fn coordinate() -> impl Strategy<Value = (f64, f64, f64, f64)> {
        let c = -100.0f64..100.0;
        (c.clone(), c.clone(), c.clone(), c)
    }

    proptest! {
        #[test]
        fn the_tree_finds_what_a_look_at_every_barrier_finds(
            walls in prop::collection::vec(coordinate(), 1..80),
            discs in prop::collection::vec((-100.0f64..100.0, -100.0f64..100.0, 0.1f64..9.0), 0..20),
            segment in coordinate(),
            at_most in 0.1f64..80.0,
        ) {
            let mut barriers: Vec<Barrier> = walls
                .into_iter()
                .map(|wall| BarrierShape::Wall(line(wall)))
                .chain(discs.into_iter().map(|(x, y, radius)| BarrierShape::Disc {
                    centre: Xy { x, y },
                    radius,
                }))
                .enumerate()
                .map(|(i, shape)| Barrier { shape, region: RegionId(i as u32) })
                .collect();
            barriers.push(barriers[0]);
            let segment = line(segment);
            let plain = barriers
                .iter()
                .map(|barrier| barrier.distance(segment))
                .filter(|&distance| distance < at_most)
                .min_by(f64::total_cmp);
            let within = barriers.iter().filter(|b| b.distance(segment) <= at_most).count();
            let index = BarrierIndex::new(barriers);
            prop_assert_eq!(index.nearest(segment, at_most, -1.0).map(|hit| hit.0), plain);
            prop_assert_eq!(index.nearest(segment, at_most, at_most).is_some(), plain.is_some());
            prop_assert_eq!(index.within(segment, at_most).count(), within);
        }
    }
}
