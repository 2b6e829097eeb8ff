//! Shortest path over the corners of obstacles: the candidate search that needs no grid.
//!
//! Only obstacles that bar something take part. The search starts with those on the straight
//! line; every edge is tested against *all* obstacles, and what bars an edge that could have
//! been part of a shorter path joins the next pass. When nothing new joins, no path over
//! corners is shorter: a shorter one would also be a path among the obstacles that take part,
//! and the pass would have tried it.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap, HashMap};
use std::sync::atomic::{AtomicBool, Ordering};

use geo::{Intersects, Line};

use super::corners::{Corner, corners};
use super::leg_space::LegSpace;
use super::polyline::{cross, distance};
use crate::airspace::RegionId;
use crate::airspace::space::Boundary;
use crate::geodesy::Xy;

/// Corners and edges of one leg, found when they are needed and kept between searches.
pub struct CornerSearch<'a> {
    space: LegSpace<'a>,
    boundaries: HashMap<RegionId, Vec<Boundary>>,
    active: BTreeSet<RegionId>,
    corners: Vec<Corner>,
    start: Xy,
    goal: Xy,
    /// What bars the edge between two places, by their places in `corners` (start and goal last).
    tested: HashMap<(u32, u32), Option<RegionId>>,
    cancelled: &'a AtomicBool,
}

/// A path over corners.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerPath {
    /// From the start to the goal, local metres.
    pub points: Vec<Xy>,
    /// The corners passed, one less at each end than `points`.
    pub corners: Vec<Corner>,
}

/// What an edge may be off a corner's tangent beyond the corner's own half turn, radians: where
/// some points of a tight corner have no room, those that are left turn further.
const TANGENT_SLACK: f64 = 0.4;

/// A corner as it is passed: with its boundary on the left or on the right.
type State = (u32, bool);

const START: u32 = u32::MAX;
const GOAL: u32 = u32::MAX - 1;

/// An edge to try, ordered by the length of the shortest path that may use it.
#[derive(Clone, Copy, PartialEq)]
struct Offer {
    estimate: f64,
    so_far: f64,
    from: State,
    to: State,
}

impl Eq for Offer {}

impl PartialOrd for Offer {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Offer {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.estimate
            .total_cmp(&other.estimate)
            .then_with(|| (self.to, self.from).cmp(&(other.to, other.from)))
    }
}

impl<'a> CornerSearch<'a> {
    /// Prepares the search for a leg; `cancelled` ends it early, without a path.
    #[must_use]
    pub fn new(space: LegSpace<'a>, start: Xy, goal: Xy, cancelled: &'a AtomicBool) -> Self {
        let mut boundaries: HashMap<RegionId, Vec<Boundary>> = HashMap::new();
        for (region, boundary) in space.airspace().boundaries() {
            boundaries.entry(region).or_default().push(boundary);
        }
        let mut search = Self {
            space,
            boundaries,
            active: BTreeSet::new(),
            corners: Vec::new(),
            start,
            goal,
            tested: HashMap::new(),
            cancelled,
        };
        let margin = space.planning_margin();
        let on_the_way: BTreeSet<RegionId> = space
            .airspace()
            .barriers()
            .within(Line::new(start, goal), margin)
            .map(|(_, barrier)| barrier.region)
            .collect();
        search.activate(&on_the_way);
        search
    }

    /// The shortest path over corners that crosses none of the `shut` lines, or `None`.
    #[must_use]
    pub fn shortest(&mut self, shut: &[Line]) -> Option<CornerPath> {
        loop {
            let (path, newcomers) = self.pass(shut);
            if self.cancelled.load(Ordering::Relaxed) {
                return None;
            }
            if !self.activate(&newcomers) {
                return path;
            }
        }
    }

    /// Takes regions into the search; whether any of them was new.
    fn activate(&mut self, regions: &BTreeSet<RegionId>) -> bool {
        let mut any = false;
        for &region in regions {
            if self.active.insert(region) {
                any = true;
                for boundary in self.boundaries.get(&region).into_iter().flatten() {
                    self.corners.extend(corners(region, boundary, &self.space));
                }
            }
        }
        any
    }

    fn place(&self, index: u32) -> Xy {
        match index {
            START => self.start,
            GOAL => self.goal,
            index => self.corners[index as usize].point,
        }
    }

    /// What bars the edge between two places; remembered.
    fn barred(&mut self, from: u32, to: u32) -> Option<RegionId> {
        let key = (from.min(to), from.max(to));
        if let Some(&known) = self.tested.get(&key) {
            return known;
        }
        let (a, b) = (self.place(from), self.place(to));
        let found = self.space.airspace().blocker(a, b, self.space.planning_margin());
        self.tested.insert(key, found);
        found
    }

    /// One search among the active regions. Also returns the inactive regions that barred an
    /// edge which could have led to a shorter path.
    fn pass(&mut self, shut: &[Line]) -> (Option<CornerPath>, BTreeSet<RegionId>) {
        let mut newcomers = BTreeSet::new();
        let mut reached: HashMap<State, (f64, State)> = HashMap::new();
        let mut open = BinaryHeap::new();
        let start: State = (START, false);
        reached.insert(start, (0.0, start));
        self.offer_from(start, None, 0.0, &reached, &mut open);
        let mut popped = 0u32;
        while let Some(Reverse(offer)) = open.pop() {
            popped = popped.wrapping_add(1);
            if popped.is_multiple_of(1024) && self.cancelled.load(Ordering::Relaxed) {
                return (None, newcomers);
            }
            if reached.contains_key(&offer.to) {
                continue;
            }
            let edge = Line::new(self.place(offer.from.0), self.place(offer.to.0));
            if shut.iter().any(|line| line.intersects(&edge)) {
                continue;
            }
            if let Some(region) = self.barred(offer.from.0, offer.to.0) {
                if !self.active.contains(&region) {
                    newcomers.insert(region);
                }
                continue;
            }
            reached.insert(offer.to, (offer.so_far, offer.from));
            if offer.to.0 == GOAL {
                return (Some(self.path_to(offer.to, &reached)), newcomers);
            }
            let heading = edge.end - edge.start;
            self.offer_from(offer.to, Some(heading), offer.so_far, &reached, &mut open);
        }
        (None, newcomers)
    }

    /// Offers the edges that a taut path may take from a place: they leave close to the
    /// corner's tangent, bend towards its boundary, and arrive close to a tangent.
    fn offer_from(
        &self,
        from: State,
        heading: Option<Xy>,
        so_far: f64,
        reached: &HashMap<State, (f64, State)>,
        open: &mut BinaryHeap<Reverse<Offer>>,
    ) {
        let here = self.place(from.0);
        let leaving = self.corners.get(from.0 as usize).map(|corner| {
            let tangent = if from.1 { corner.tangent } else { -corner.tangent };
            (tangent, slack_cosine(corner.half_turn))
        });
        let bends_well = |way: Xy, length: f64| {
            let Some((tangent, cosine)) = leaving else { return true };
            if way.x * tangent.x + way.y * tangent.y < cosine * length {
                return false;
            }
            let bend = heading.map_or(0.0, |heading| cross(heading, way));
            let slack = 1e-9 * length;
            if from.1 { bend >= -slack } else { bend <= slack }
        };
        let mut push = |to: State, length: f64, rest: f64| {
            if !reached.contains_key(&to) {
                let so_far = so_far + length;
                open.push(Reverse(Offer { estimate: so_far + rest, so_far, from, to }));
            }
        };
        let way = self.goal - here;
        let length = distance(here, self.goal);
        if bends_well(way, length) {
            push((GOAL, false), length, 0.0);
        }
        for (index, corner) in self.corners.iter().enumerate() {
            let way = corner.point - here;
            let length = distance(here, corner.point);
            if length == 0.0 || !bends_well(way, length) {
                continue;
            }
            let along = way.x * corner.tangent.x + way.y * corner.tangent.y;
            if along.abs() >= slack_cosine(corner.half_turn) * length {
                push((index as u32, along > 0.0), length, distance(corner.point, self.goal));
            }
        }
    }

    fn path_to(&self, goal: State, reached: &HashMap<State, (f64, State)>) -> CornerPath {
        let mut points = vec![self.goal];
        let mut passed = Vec::new();
        let mut state = goal;
        while let Some(&(_, before)) = reached.get(&state) {
            if before == state {
                break;
            }
            points.push(self.place(before.0));
            passed.extend(self.corners.get(before.0 as usize).copied());
            state = before;
        }
        points.reverse();
        passed.reverse();
        CornerPath { points, corners: passed }
    }
}

/// The cosine of how far an edge may be off a corner's tangent.
fn slack_cosine(half_turn: f64) -> f64 {
    (half_turn + TANGENT_SLACK).cos()
}
