//! Shortest path over the corners of obstacles: the candidate search that needs no grid.
//!
//! Only obstacles that bar something take part. The search (A*, from the start) begins with those
//! on the straight line; every edge is tested against *all* obstacles, and what bars an edge that
//! could have been part of a shorter path joins at once: its corners are offered to every place
//! that was reached before. When the goal is reached, no path over corners is shorter: its first
//! edge that was not tried would have come up before.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap, HashMap};

use geo::{Intersects, Line};
use rstar::{AABB, RTree};

use super::corners::{Corner, corners};
use super::leg_space::LegSpace;
use super::pass::{GOAL, Offer, Pass, Reached, SAME, START, State};
use super::polyline::{cross, distance, distance_to_edge, length};
use super::sweep::{Cone, Sight, sweep};
use crate::airspace::RegionId;
use crate::airspace::space::Boundary;
use crate::geodesy::Xy;
use crate::stop::Stop;

/// Corners and edges of one leg, found when they are needed and kept between searches.
pub struct CornerSearch<'a> {
    space: LegSpace<'a>,
    /// By the number of their region.
    boundaries: Vec<Vec<Boundary>>,
    /// Whether a region takes part.
    active: Vec<bool>,
    /// The start, the goal, and the corners of the regions that take part.
    corners: Vec<Corner>,
    sights: RTree<Sight>,
    /// The turn between neighbouring points of a rounded corner, radians.
    step: f64,
    /// Only corners this near to this path take part, where there is one.
    along: Option<(Vec<Xy>, f64)>,
    /// What bars the edge between two corners.
    tested: HashMap<(u32, u32), Option<RegionId>>,
    stop: &'a Stop,
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
/// parts of a tight corner have no room, the points that are left turn further.
const TANGENT_SLACK: f64 = 0.1;

/// The first look at a leg may miss the shortest path by this factor; it takes a small part of
/// the time, and nothing longer than what it finds is looked at again.
const GLANCE: f64 = 1.05;

/// The most places that are looked at for the exact answer; a leg that needs more gets the first
/// look's path, made exact in one window after the other.
const PATIENCE: u32 = 8_000;

/// How many windows a path is divided into; they overlap by half.
const WINDOWS: usize = 8;

impl<'a> CornerSearch<'a> {
    /// Prepares the search for a leg, with corners rounded by points `step` radians apart;
    /// `stop` ends it early, with what it has.
    #[must_use]
    pub fn new(space: LegSpace<'a>, start: Xy, goal: Xy, step: f64, stop: &'a Stop) -> Self {
        let regions = space.airspace().outlines().len();
        let mut boundaries: Vec<Vec<Boundary>> = vec![Vec::new(); regions];
        for (region, boundary) in space.airspace().boundaries() {
            boundaries[region.0 as usize].push(boundary);
        }
        let end = |point: Xy| Corner {
            point,
            tangent: Xy { x: 1.0, y: 0.0 },
            half_turn: std::f64::consts::PI,
            region: RegionId(u32::MAX),
            hidden_by: None,
        };
        let mut search = Self {
            space,
            boundaries,
            active: vec![false; regions],
            corners: vec![end(start), end(goal)],
            sights: RTree::new(),
            step,
            along: None,
            tested: HashMap::new(),
            stop,
        };
        search.sights.insert(Sight::Corner(START, start));
        let on_the_way: BTreeSet<RegionId> = space
            .airspace()
            .barriers()
            .within(Line::new(start, goal), space.planning_margin())
            .map(|(_, barrier)| barrier.region)
            .collect();
        for region in on_the_way {
            search.activate(region);
        }
        search
    }

    /// The same leg with corners rounded by points `step` radians apart, only along a path: what
    /// it finds is that path with rounder corners.
    #[must_use]
    pub fn finer(&self, path: &CornerPath, step: f64) -> Self {
        // Coarse corners stand out from the arc by a tenth of the margin.
        let beside = 0.2 * self.space.planning_margin() + 1.0;
        let mut finer = Self {
            space: self.space,
            boundaries: self.boundaries.clone(),
            active: vec![false; self.active.len()],
            corners: self.corners[..2].to_vec(),
            sights: RTree::new(),
            step,
            along: Some((path.points.clone(), beside)),
            tested: HashMap::new(),
            stop: self.stop,
        };
        finer.sights.insert(Sight::Corner(START, self.corners[0].point));
        let passed: BTreeSet<RegionId> = path.corners.iter().map(|corner| corner.region).collect();
        for region in passed {
            finer.activate(region);
        }
        finer
    }

    /// The shortest path over corners; next to the shortest where the leg is a very large one.
    #[must_use]
    pub fn shortest(&mut self) -> Option<CornerPath> {
        let glance = self.search(&[], f64::INFINITY, GLANCE, u32::MAX)?;
        let bound = glance.length() + SAME;
        if let Some(path) = self.search(&[], bound, 1.0, PATIENCE) {
            return Some(path);
        }
        let ends = [START, GOAL].map(|end| self.corners[end as usize].point);
        let path = self.in_windows(glance);
        self.set_ends(ends);
        Some(path)
    }

    /// A path that crosses none of the `shut` lines, no longer than `bound` metres and at most
    /// 5 % longer than the shortest such; `None` where there is none.
    #[must_use]
    pub fn around(&mut self, shut: &[Line], bound: f64) -> Option<CornerPath> {
        self.search(shut, bound, GLANCE, u32::MAX)
    }

    /// The shortest path that is no longer than `bound` metres, or `None`.
    #[must_use]
    pub fn within(&mut self, bound: f64) -> Option<CornerPath> {
        self.search(&[], bound, 1.0, u32::MAX)
    }

    /// Makes a path exact within each of some windows.
    fn in_windows(&mut self, mut path: CornerPath) -> CornerPath {
        let window = path.length() / WINDOWS as f64;
        let mut begin = 0.0;
        while begin < path.length() - window {
            // The vertices next to the window's ends.
            let (mut along, mut first, mut last) = (0.0, 0, path.points.len() - 1);
            for k in 1..path.points.len() {
                along += distance(path.points[k - 1], path.points[k]);
                if along <= begin {
                    first = k;
                }
                if along >= begin + 2.0 * window {
                    last = k;
                    break;
                }
            }
            begin += window;
            let part = &path.points[first..=last];
            self.set_ends([part[0], part[part.len() - 1]]);
            if let Some(better) = self.search(&[], length(part) - SAME, 1.0, PATIENCE) {
                path.points.splice(first..=last, better.points);
                // The corners are those of the interior points.
                path.corners.splice(first..last - 1, better.corners);
            }
        }
        path
    }

    /// Searches between other ends from now on.
    fn set_ends(&mut self, [start, goal]: [Xy; 2]) {
        self.sights.remove(&Sight::Corner(START, self.corners[START as usize].point));
        self.sights.insert(Sight::Corner(START, start));
        self.corners[START as usize].point = start;
        self.corners[GOAL as usize].point = goal;
    }

    fn search(
        &mut self,
        shut: &[Line],
        bound: f64,
        weight: f64,
        patience: u32,
    ) -> Option<CornerPath> {
        let reached = vec![None; 2 * self.corners.len()];
        let mut pass = Pass { weight, patience, bound, reached, open: BinaryHeap::new() };
        let start = 2 * START;
        pass.reached[start as usize] = Some(Reached { so_far: 0.0, from: start });
        self.expand(start, &mut pass);
        let mut popped = 0u32;
        while let Some(Reverse(offer)) = pass.open.pop() {
            popped = popped.wrapping_add(1);
            if popped.is_multiple_of(16) && self.stop.is_stopped() {
                return None;
            }
            if !pass.is_news(offer.to, offer.so_far) {
                continue;
            }
            let (from, to) = (offer.from / 2, offer.to / 2);
            let edge =
                Line::new(self.corners[from as usize].point, self.corners[to as usize].point);
            if shut.iter().any(|line| line.intersects(&edge)) {
                continue;
            }
            if let Some(region) = self.barred(from, to) {
                if self.activate(region) {
                    pass.reached.resize(2 * self.corners.len(), None);
                    self.offer_to_newcomers(region, &mut pass);
                }
                continue;
            }
            pass.reached[offer.to as usize] =
                Some(Reached { so_far: offer.so_far, from: offer.from });
            if to == GOAL {
                return Some(self.path_to(offer.to, &pass));
            }
            pass.patience = pass.patience.checked_sub(1)?;
            self.expand(offer.to, &mut pass);
        }
        None
    }

    /// Takes a region into the search; whether it is new there.
    fn activate(&mut self, region: RegionId) -> bool {
        let Some(active) = self.active.get_mut(region.0 as usize) else { return false };
        if std::mem::replace(active, true) {
            return false;
        }
        for boundary in &self.boundaries[region.0 as usize] {
            for corner in corners(region, boundary, &self.space, self.step) {
                let beside = self.along.as_ref().is_none_or(|(path, at_most)| {
                    path.windows(2)
                        .any(|edge| distance_to_edge(corner.point, edge[0], edge[1]) <= *at_most)
                });
                // What the region itself leaves no room for never will have any.
                if beside && corner.hidden_by != Some(region) {
                    self.sights.insert(Sight::Corner(self.corners.len() as u32, corner.point));
                    self.corners.push(corner);
                }
            }
            if let Boundary::Ring(ring) = boundary {
                for (a, b) in crate::airspace::outline::edges(ring) {
                    self.sights.insert(Sight::Wall(Line::new(a, b)));
                }
            }
        }
        true
    }

    /// What bars the edge between two corners; remembered.
    fn barred(&mut self, from: u32, to: u32) -> Option<RegionId> {
        if let Some(hider) = self.corners[to as usize].hidden_by {
            return Some(hider);
        }
        // The ends may move; only edges between corners are remembered.
        let key = (from.min(to), from.max(to));
        if let Some(&known) = self.tested.get(&key) {
            return known;
        }
        let (a, b) = (self.corners[from as usize].point, self.corners[to as usize].point);
        // Where an edge starts is known to be clear, so the side that it is on is known, too.
        let found = self.space.airspace().blocker_from_inside(a, b, self.space.planning_margin());
        if key.0 > GOAL {
            self.tested.insert(key, found);
        }
        found
    }

    /// Offers the edges that a taut path may take from a state: they leave close to the
    /// corner's tangent, bend towards its boundary, and arrive close to a tangent.
    fn expand(&self, from: State, pass: &mut Pass) {
        let Some(Reached { so_far, from: before }) = pass.reached[from as usize] else { return };
        self.offer(from, 2 * GOAL, pass);
        let corner = &self.corners[(from / 2) as usize];
        let cone = if from / 2 == START {
            Cone::ALL
        } else {
            let ahead = if from % 2 == 1 { corner.tangent } else { -corner.tangent };
            let heading = corner.point - self.corners[(before / 2) as usize].point;
            // Between straight on and the far end of the corner's turn.
            let towards = ahead.y.atan2(ahead.x);
            let straight = (cross(ahead, heading))
                .atan2(ahead.x * heading.x + ahead.y * heading.y)
                .clamp(-corner.half_turn - TANGENT_SLACK, corner.half_turn + TANGENT_SLACK);
            let far = (corner.half_turn + TANGENT_SLACK) * if from % 2 == 1 { 1.0 } else { -1.0 };
            let half = (far - straight).abs() / 2.0 + 1e-6;
            Cone { towards: towards + f64::midpoint(straight, far), half }
        };
        let (place, goal) = (corner.point, self.corners[GOAL as usize].point);
        let bound = pass.bound;
        // The way there and on to the goal is at least as long as that over the nearest points.
        let worth = |envelope: &AABB<[f64; 2]>| {
            let far = |point: Xy| envelope.distance_2(&[point.x, point.y]).sqrt();
            so_far + far(place) + far(goal) <= bound
        };
        sweep(&self.sights, place, cone, self.space.planning_margin(), worth, |to| {
            if to != START && to != from / 2 {
                self.offer(from, 2 * to, pass);
                self.offer(from, 2 * to + 1, pass);
            }
        });
    }

    /// Offers the corners of a region that has just joined to all states that see them.
    fn offer_to_newcomers(&self, region: RegionId, pass: &mut Pass) {
        let first = self.corners.iter().rposition(|corner| corner.region != region);
        let goal = self.corners[GOAL as usize].point;
        for number in first.map_or(0, |k| k + 1)..self.corners.len() {
            let (corner, bound) = (self.corners[number], pass.bound);
            let worth = |envelope: &AABB<[f64; 2]>| {
                let place = [corner.point.x, corner.point.y];
                envelope.distance_2(&place).sqrt() + distance(corner.point, goal) <= bound
            };
            for side in 0..2 {
                // Paths come from where the tangent of that side points back to.
                let back = if side == 1 { -corner.tangent } else { corner.tangent };
                let half = corner.half_turn + TANGENT_SLACK + 1e-6;
                let cone = Cone { towards: back.y.atan2(back.x), half };
                let margin = self.space.planning_margin();
                let to = 2 * number as u32 + side;
                sweep(&self.sights, corner.point, cone, margin, worth, |from| {
                    for from in [2 * from, 2 * from + 1] {
                        if pass.reached[from as usize].is_some() {
                            self.offer(from, to, pass);
                        }
                    }
                });
            }
        }
    }

    /// Offers one edge, if a taut path may take it.
    fn offer(&self, from: State, to: State, pass: &mut Pass) {
        let Some(Reached { so_far, from: before }) = pass.reached[from as usize] else { return };
        let (here, there) = (&self.corners[(from / 2) as usize], &self.corners[(to / 2) as usize]);
        let way = there.point - here.point;
        let long = distance(here.point, there.point);
        let (so_far, goal) = (so_far + long, self.corners[GOAL as usize].point);
        let rest = distance(there.point, goal);
        if long == 0.0 || so_far + rest > pass.bound || !pass.is_news(to, so_far) {
            return;
        }
        let along = |corner: &Corner, state: State| {
            let tangent = if state % 2 == 1 { corner.tangent } else { -corner.tangent };
            way.x * tangent.x + way.y * tangent.y >= slack_cosine(corner.half_turn) * long
        };
        if from / 2 != START {
            let bend = cross(here.point - self.corners[(before / 2) as usize].point, way);
            let inwards = if from % 2 == 1 { bend } else { -bend };
            if inwards < -SAME * long || !along(here, from) {
                return;
            }
        }
        if to / 2 != GOAL && !along(there, to) {
            return;
        }
        let estimate = so_far + pass.weight * rest;
        pass.open.push(Reverse(Offer { estimate, so_far, from, to }));
    }

    fn path_to(&self, goal: State, pass: &Pass) -> CornerPath {
        let mut states = vec![goal];
        while let Some(Reached { from, .. }) = pass.reached[states[states.len() - 1] as usize] {
            if states[states.len() - 1] == from {
                break;
            }
            states.push(from);
        }
        let corners: Vec<Corner> =
            states.iter().rev().map(|&state| self.corners[(state / 2) as usize]).collect();
        let points = corners.iter().map(|corner| corner.point).collect();
        CornerPath { points, corners: corners[1..corners.len() - 1].to_vec() }
    }
}

impl CornerPath {
    /// Metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        length(&self.points)
    }
}

/// The cosine of how far an edge may be off a corner's tangent.
fn slack_cosine(half_turn: f64) -> f64 {
    (half_turn + TANGENT_SLACK).min(std::f64::consts::PI).cos()
}
