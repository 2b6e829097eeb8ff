//! A* as the paper sets it ("Experimental Settings"): a grid of 0.5 m with eight neighbours, the
//! Euclidean distance as the estimate, and a smoothing factor of 0.2.
//!
//! The grid is kept in tiles that are made when the search comes to them: no memory is spent on
//! where it does not go.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use super::{Effort, Failure, Outcome, Reach};
use crate::geodesy::Xy;
use crate::planner::leg_space::LegSpace;
use crate::planner::polyline::distance;
use crate::units::Metres;

/// How A* searches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AStar {
    /// Distance between neighbouring rows and columns (paper: 0.5 m), at least 1 cm.
    pub resolution: Metres,
    /// Cells that may be expanded; they bound the memory, by some 30 bytes each.
    pub expansions: usize,
    /// The paper's smoothing factor; see [`AStar::smoothed`].
    pub smoothing: f64,
}

impl Default for AStar {
    /// The paper's settings; expansions for about two square kilometres.
    fn default() -> Self {
        Self { resolution: Metres(0.5), expansions: 8_000_000, smoothing: 0.2 }
    }
}

/// Weight of the original place of a point in the smoothing; 0.5 is its usual value.
const WEIGHT_DATA: f64 = 0.5;

/// The smoothing has settled when no point moves by more than this, metres.
const SETTLED: f64 = 1e-4;

/// Passes of the smoothing at the most.
const PASSES: usize = 1000;

/// Cells along the side of a tile.
const SIDE: i32 = 32;

/// Eight neighbours: column and row offsets.
const NEIGHBOURS: [(i32, i32); 8] =
    [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)];

/// What is known of the space around a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Room {
    Unknown,
    /// Too near to something.
    Blocked,
    /// Free, but not every edge from it need be.
    Tight,
    /// Far enough from everything for all edges from it.
    Wide,
}

/// A column and a row; the start is (0, 0).
type Cell = (i32, i32);

#[derive(Debug, Clone, Copy)]
struct Known {
    /// Length of the shortest way found to the cell, metres.
    cost: f64,
    /// Which of [`NEIGHBOURS`] led to it from its predecessor.
    by: u8,
    closed: bool,
    room: Room,
}

/// An entry of the open list. The lowest estimate comes first; of equal ones the nearest to the
/// goal, and then the order of the cells, so that the search is the same every time.
#[derive(Debug, PartialEq)]
struct Open {
    estimate: f64,
    rest: f64,
    cell: Cell,
    /// Not the cell itself but the edge from it to the goal, which need not be on the grid.
    arrives: bool,
}

impl Eq for Open {}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.estimate
            .total_cmp(&other.estimate)
            .then(self.rest.total_cmp(&other.rest))
            .then(self.cell.cmp(&other.cell))
    }
}

impl AStar {
    /// Searches a path from `start` to `goal`; its points are one grid step apart.
    #[must_use]
    pub fn search(&self, space: &LegSpace<'_>, start: Xy, goal: Xy) -> Outcome {
        Search::new(self, space, start, goal).run()
    }

    /// The path with its points moved by the usual gradient smoothing, of which the paper gives
    /// one factor, read as the weight of smoothness `s` (`weight_smooth`) beside the usual weight
    /// of the data 0.5:
    ///
    /// `y_i += 0.5 (x_i − y_i) + s (y_{i−1} + y_{i+1} − 2 y_i)`
    ///
    /// over all interior points until they rest. A move that would bring one of the two edges at
    /// the point nearer than the margin is not made.
    #[must_use]
    pub fn smoothed(&self, path: &[Xy], space: &LegSpace<'_>) -> Vec<Xy> {
        let clear = |a: Xy, b: Xy| space.airspace().is_clear(a, b, space.margin());
        let mut smooth = path.to_vec();
        for _ in 0..PASSES {
            let mut moved = 0.0f64;
            for i in 1..path.len().saturating_sub(1) {
                let [before, here, after] = [smooth[i - 1], smooth[i], smooth[i + 1]];
                let there = here
                    + (path[i] - here) * WEIGHT_DATA
                    + (before + after - here * 2.0) * self.smoothing;
                let step = distance(here, there);
                if step > SETTLED && clear(before, there) && clear(there, after) {
                    smooth[i] = there;
                    moved = moved.max(step);
                }
            }
            if moved <= SETTLED {
                break;
            }
        }
        smooth
    }
}

struct Search<'a> {
    space: &'a LegSpace<'a>,
    resolution: f64,
    expansions: usize,
    start: Xy,
    goal: Xy,
    reach: Reach,
    index: HashMap<Cell, usize>,
    tiles: Vec<Box<[Known]>>,
}

impl<'a> Search<'a> {
    fn new(settings: &AStar, space: &'a LegSpace<'a>, start: Xy, goal: Xy) -> Self {
        Self {
            space,
            resolution: settings.resolution.0.max(0.01),
            expansions: settings.expansions,
            start,
            goal,
            reach: Reach::of(space, start, goal),
            index: HashMap::new(),
            tiles: Vec::new(),
        }
    }

    fn point(&self, cell: Cell) -> Xy {
        let offset = Xy { x: f64::from(cell.0), y: f64::from(cell.1) };
        self.start + offset * self.resolution
    }

    /// How far an edge leads from its cell at the most.
    fn diagonal(&self) -> f64 {
        self.resolution * std::f64::consts::SQRT_2
    }

    fn run(mut self) -> Outcome {
        let mut effort = Effort::default();
        let mut open = BinaryHeap::new();
        if self.room((0, 0)) != Room::Blocked {
            self.known((0, 0)).cost = 0.0;
            self.offer((0, 0), 0.0, &mut open);
        }
        while let Some(Reverse(entry)) = open.pop() {
            if entry.arrives {
                return Outcome::Found { path: self.path_to(entry.cell), effort };
            }
            let known = self.known(entry.cell);
            if known.closed {
                continue;
            }
            known.closed = true;
            if effort.iterations == self.expansions {
                return Outcome::NotFound { failure: Failure::Exhausted, effort };
            }
            effort.iterations += 1;
            self.expand(entry.cell, &mut open, &mut effort);
        }
        Outcome::NotFound { failure: Failure::NoWay, effort }
    }

    fn expand(&mut self, cell: Cell, open: &mut BinaryHeap<Reverse<Open>>, effort: &mut Effort) {
        let Known { cost, room, .. } = *self.known(cell);
        let here = self.point(cell);
        let margin = self.space.margin();
        let rest = distance(here, self.goal);
        if rest <= self.diagonal() && self.space.airspace().is_clear(here, self.goal, margin) {
            let estimate = cost + rest;
            open.push(Reverse(Open { estimate, rest: 0.0, cell, arrives: true }));
        }
        for (by, (column, row)) in NEIGHBOURS.into_iter().enumerate() {
            let next = (cell.0 + column, cell.1 + row);
            if !self.reach.contains(self.point(next)) {
                continue;
            }
            let step = if column != 0 && row != 0 { self.diagonal() } else { self.resolution };
            effort.edges += 1;
            let known = self.known(next);
            if known.closed || cost + step >= known.cost {
                continue;
            }
            let clear = match (room, self.room(next)) {
                (_, Room::Blocked) => false,
                (Room::Wide, _) | (_, Room::Wide) => true,
                _ => self.space.airspace().is_clear(here, self.point(next), margin),
            };
            if clear {
                let known = self.known(next);
                known.cost = cost + step;
                known.by = by as u8;
                self.offer(next, cost + step, open);
            }
        }
    }

    fn offer(&self, cell: Cell, cost: f64, open: &mut BinaryHeap<Reverse<Open>>) {
        let rest = distance(self.point(cell), self.goal);
        open.push(Reverse(Open { estimate: cost + rest, rest, cell, arrives: false }));
    }

    /// The points from the start over the grid to the goal.
    fn path_to(&mut self, last: Cell) -> Vec<Xy> {
        let mut path = vec![self.goal];
        let mut cell = last;
        loop {
            let point = self.point(cell);
            if path[path.len() - 1] != point {
                path.push(point);
            }
            if cell == (0, 0) {
                break;
            }
            let (column, row) = NEIGHBOURS[usize::from(self.known(cell).by)];
            cell = (cell.0 - column, cell.1 - row);
        }
        path.reverse();
        path
    }

    /// What is known of a cell; its tile is made where there is none yet.
    fn known(&mut self, cell: Cell) -> &mut Known {
        let tile = (cell.0.div_euclid(SIDE), cell.1.div_euclid(SIDE));
        let place = match self.index.get(&tile) {
            Some(&place) => place,
            None => {
                let room = self.room_of_tile(tile);
                let fresh = Known { cost: f64::INFINITY, by: 0, closed: false, room };
                self.tiles.push(vec![fresh; (SIDE * SIDE) as usize].into_boxed_slice());
                self.index.insert(tile, self.tiles.len() - 1);
                self.tiles.len() - 1
            }
        };
        let (column, row) = (cell.0.rem_euclid(SIDE), cell.1.rem_euclid(SIDE));
        &mut self.tiles[place][(row * SIDE + column) as usize]
    }

    /// One question for a whole tile where nothing is near.
    fn room_of_tile(&self, tile: Cell) -> Room {
        let side = f64::from(SIDE) * self.resolution;
        let corner = self.point((tile.0 * SIDE, tile.1 * SIDE));
        let centre = corner + Xy { x: side / 2.0, y: side / 2.0 };
        let needed = self.space.margin() + self.diagonal() + side * std::f64::consts::FRAC_1_SQRT_2;
        match self.space.airspace().nearest(centre, centre, needed) {
            None => Room::Wide,
            Some(_) => Room::Unknown,
        }
    }

    /// The room around a cell, found out once.
    fn room(&mut self, cell: Cell) -> Room {
        let room = self.known(cell).room;
        if room != Room::Unknown {
            return room;
        }
        let point = self.point(cell);
        let margin = self.space.margin();
        let room = match self.space.airspace().nearest(point, point, margin + self.diagonal()) {
            None => Room::Wide,
            Some((clearance, _)) if clearance >= margin && clearance > 0.0 => Room::Tight,
            Some(_) => Room::Blocked,
        };
        self.known(cell).room = room;
        room
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::scenes::{Scene, scenario};
    use crate::planner::polyline::length;

    const ORIGIN: Xy = Xy { x: 0.0, y: 0.0 };

    /// The length of the shortest way on an empty grid of eight neighbours.
    fn octile(x: f64, y: f64) -> f64 {
        x.max(y) - x.min(y) + x.min(y) * std::f64::consts::SQRT_2
    }

    #[test]
    fn in_an_empty_sky_the_path_has_the_octile_length() {
        let scene = Scene::new(&[]);
        for (x, y) in [(30.0, 0.0), (-20.0, 20.0), (30.0, -10.0), (0.5, 40.0)] {
            let outcome = AStar::default().search(&scene.space(5.0), ORIGIN, Xy { x, y });
            let found = length(outcome.path().unwrap());
            assert!((found - octile(x.abs(), y.abs())).abs() < 1e-6, "{x} {y}: {found}");
        }
    }

    #[test]
    fn a_goal_beside_the_grid_is_reached_by_an_edge_of_its_own() {
        let scene = Scene::new(&[]);
        let goal = Xy { x: 10.2, y: 0.1 };
        let outcome = AStar::default().search(&scene.space(5.0), ORIGIN, goal);
        let path = outcome.path().unwrap();
        assert_eq!((path[0], path[path.len() - 1]), (ORIGIN, goal));
        assert!(length(path) < 10.35);
    }

    #[test]
    fn around_a_square_the_path_is_the_known_one_on_the_grid() {
        // A square from 10 to 20 m east, 10 m to either side; a little less than 5 m of margin, so
        // that cells at exactly 5 m are free. The way: 7.5 m north, so that the diagonal keeps off
        // the corner (10, 10), 7.5 m diagonally, 2.5 m east to (10, 15); 10 m on, and down again.
        let scene = Scene::new(&[[(10.0, -10.0), (20.0, -10.0), (20.0, 10.0), (10.0, 10.0)]]);
        let space = scene.space(4.99);
        let goal = Xy { x: 30.0, y: 0.0 };
        let outcome = AStar::default().search(&space, ORIGIN, goal);
        let path = outcome.path().unwrap();
        let expected = 2.0 * (7.5 + 7.5 * std::f64::consts::SQRT_2 + 2.5) + 10.0;
        assert!((length(path) - expected).abs() < 1e-6, "{} {expected}", length(path));
        for edge in path.windows(2) {
            assert!(space.airspace().is_clear(edge[0], edge[1], space.margin()));
        }
    }

    #[test]
    fn smoothing_shortens_the_path_and_keeps_its_ends_and_the_margin() {
        let scene = Scene::new(&[[(10.0, -10.0), (20.0, -10.0), (20.0, 10.0), (10.0, 10.0)]]);
        let space = scene.space(5.0);
        let goal = Xy { x: 31.0, y: 3.0 };
        let settings = AStar::default();
        let outcome = settings.search(&space, ORIGIN, goal);
        let path = outcome.path().unwrap();
        let smooth = settings.smoothed(path, &space);
        assert!(length(&smooth) < length(path));
        assert_eq!((smooth[0], smooth[smooth.len() - 1]), (ORIGIN, goal));
        for edge in smooth.windows(2) {
            assert!(space.airspace().is_clear(edge[0], edge[1], space.margin()));
        }
    }

    #[test]
    fn a_goal_that_is_shut_in_has_no_way_and_too_few_expansions_are_exhausted() {
        let inside = Xy { x: 100.0, y: 0.0 };
        let scene = Scene::new(&[
            [(80.0, -20.0), (120.0, -20.0), (120.0, -18.0), (80.0, -18.0)],
            [(80.0, 18.0), (120.0, 18.0), (120.0, 20.0), (80.0, 20.0)],
            [(80.0, -20.0), (82.0, -20.0), (82.0, 20.0), (80.0, 20.0)],
            [(118.0, -20.0), (120.0, -20.0), (120.0, 20.0), (118.0, 20.0)],
        ]);
        let settings = AStar { resolution: Metres(1.0), expansions: 3000, smoothing: 0.2 };
        let space = scene.space(2.0);
        let failure = |outcome: Outcome| match outcome {
            Outcome::NotFound { failure, effort } => (failure, effort.iterations),
            Outcome::Found { .. } => panic!("{outcome:?}"),
        };
        let (why, iterations) = failure(settings.search(&space, inside, ORIGIN));
        assert_eq!(why, Failure::NoWay);
        assert!((500..3000).contains(&iterations));
        let inward = failure(settings.search(&space, ORIGIN, inside));
        assert_eq!(inward, (Failure::Exhausted, 3000));
        let settings = AStar { expansions: 1_000_000, ..settings };
        let (why, iterations) = failure(settings.search(&space, ORIGIN, inside));
        assert_eq!(why, Failure::NoWay);
        assert!(iterations < 20_000);
    }

    #[test]
    fn the_lengths_on_two_of_the_scenarios_are_those_of_another_implementation() {
        // 0.5 m grid, eight neighbours, 5 m buffer, computed independently of this program.
        for (name, expected) in [("s4", 488.75), ("s5", 379.70)] {
            let (scene, start, goal) = scenario(name);
            let outcome = AStar::default().search(&scene.space(5.0), start, goal);
            let found = length(outcome.path().unwrap());
            assert!((found / expected - 1.0).abs() < 0.005, "{name}: {found}");
        }
    }
}
