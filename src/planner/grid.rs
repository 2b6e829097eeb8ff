//! The paper's grid ("Path Finding"): points `(x0 + i r, y0 + j r)` with eight neighbours each,
//! and several different shortest paths over the free ones.
//!
//! The paper enumerates all paths without regard to obstacles; that is exponential. Here A* finds
//! the shortest free one, and further ones with the neighbourhood of those before made dearer.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::homotopy::passes_differently;
use super::leg_space::LegSpace;
use super::polyline::{distance, simplified};
use crate::geodesy::Xy;
use crate::stop::Stop;
use crate::units::Metres;

/// The most points a grid may have; where `r` would give more, `r` is doubled.
const MAX_POINTS: usize = 1 << 21;

/// How much dearer a step becomes near a path that was already taken.
const TAKEN: f64 = 0.1;

/// Eight neighbours: column and row offsets.
const NEIGHBOURS: [(i64, i64); 8] =
    [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)];

/// A grid over the surroundings of a leg.
pub struct GridSearch<'a> {
    space: LegSpace<'a>,
    origin: Xy,
    /// Unit vector from start to goal: the grid's columns run along the leg.
    along: Xy,
    resolution: f64,
    columns: usize,
    rows: usize,
    start: Xy,
    goal: Xy,
    stop: &'a Stop,
}

impl<'a> GridSearch<'a> {
    /// A grid of the given resolution that reaches past the leg by as much as the leg is long
    /// (at least 100 m). It is aligned with the leg.
    #[must_use]
    pub fn new(
        space: &LegSpace<'a>,
        start: Xy,
        goal: Xy,
        resolution: Metres,
        stop: &'a Stop,
    ) -> Self {
        let leg = distance(start, goal);
        let along = if leg > 0.0 { (goal - start) / leg } else { Xy { x: 1.0, y: 0.0 } };
        let reach = leg.max(100.0);
        let mut resolution = resolution.0.max(0.1);
        let size =
            |r: f64| (((leg + 2.0 * reach) / r) as usize + 1, ((2.0 * reach) / r) as usize + 1);
        while size(resolution).0 * size(resolution).1 > MAX_POINTS {
            resolution *= 2.0;
        }
        let (columns, rows) = size(resolution);
        // The start is a grid point.
        let before = (reach / resolution).floor() * resolution;
        let aside = (rows / 2) as f64 * resolution;
        let across = Xy { x: -along.y, y: along.x };
        let origin = start - along * before - across * aside;
        Self { space: *space, origin, along, resolution, columns, rows, start, goal, stop }
    }

    /// The resolution: the one asked for, or a coarser one where that would be too many points.
    #[must_use]
    pub fn resolution(&self) -> Metres {
        Metres(self.resolution)
    }

    /// Up to `wanted` paths that pass obstacles on different sides, the shortest first.
    #[must_use]
    pub fn paths(&self, wanted: usize) -> Vec<Vec<Xy>> {
        let mut free: Vec<Option<bool>> = vec![None; self.columns * self.rows];
        let mut price = vec![1.0f64; free.len()];
        let mut found: Vec<Vec<Xy>> = Vec::new();
        // A dearer neighbourhood may lead back to the same path: try a few times more.
        for _ in 0..3 * wanted {
            if found.len() >= wanted || self.stop.is_stopped() {
                break;
            }
            let Some(cells) = self.cheapest(&mut free, &price) else { break };
            for &cell in &cells {
                self.raise(cell, &mut price);
            }
            let mut points: Vec<Xy> = std::iter::once(self.start)
                .chain(cells.iter().map(|&cell| self.point(cell)))
                .chain(std::iter::once(self.goal))
                .collect();
            points.dedup();
            let points = simplified(&points, 1e-6, |_, _| true);
            if found.iter().all(|known| passes_differently(known, &points, &self.space)) {
                found.push(points);
            }
        }
        found
    }

    fn point(&self, cell: usize) -> Xy {
        let across = Xy { x: -self.along.y, y: self.along.x };
        self.origin
            + self.along * ((cell % self.columns) as f64 * self.resolution)
            + across * ((cell / self.columns) as f64 * self.resolution)
    }

    /// The grid point nearest to a point.
    fn cell(&self, point: Xy) -> usize {
        let offset = point - self.origin;
        let across = Xy { x: -self.along.y, y: self.along.x };
        let column = (offset.x * self.along.x + offset.y * self.along.y) / self.resolution;
        let row = (offset.x * across.x + offset.y * across.y) / self.resolution;
        let column = (column.round().max(0.0) as usize).min(self.columns - 1);
        let row = (row.round().max(0.0) as usize).min(self.rows - 1);
        row * self.columns + column
    }

    /// A* from the start's cell to the goal's, with the Euclidean distance as the estimate.
    fn cheapest(&self, free: &mut [Option<bool>], price: &[f64]) -> Option<Vec<usize>> {
        #[derive(PartialEq)]
        struct Ordered(f64);
        impl Eq for Ordered {}
        impl PartialOrd for Ordered {
            fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
                Some(self.cmp(other))
            }
        }
        impl Ord for Ordered {
            fn cmp(&self, other: &Self) -> std::cmp::Ordering {
                self.0.total_cmp(&other.0)
            }
        }
        let (start, goal) = (self.cell(self.start), self.cell(self.goal));
        let target = self.point(goal);
        let mut cost = vec![f64::INFINITY; free.len()];
        let mut from = vec![usize::MAX; free.len()];
        let mut open = BinaryHeap::new();
        cost[start] = 0.0;
        open.push((Reverse(Ordered(distance(self.point(start), target))), start));
        let mut popped = 0u32;
        while let Some((Reverse(Ordered(estimate)), cell)) = open.pop() {
            let here = self.point(cell);
            if estimate > cost[cell] + distance(here, target) + 1e-9 {
                continue;
            }
            popped = popped.wrapping_add(1);
            if popped.is_multiple_of(4096) && self.stop.is_stopped() {
                return None;
            }
            if cell == goal {
                let mut path = vec![goal];
                let mut at = goal;
                while at != start {
                    at = from[at];
                    path.push(at);
                }
                path.reverse();
                return Some(path);
            }
            let (column, row) = ((cell % self.columns) as i64, (cell / self.columns) as i64);
            for (dx, dy) in NEIGHBOURS {
                let (c, r) = (column + dx, row + dy);
                if c < 0 || r < 0 || c >= self.columns as i64 || r >= self.rows as i64 {
                    continue;
                }
                let next = r as usize * self.columns + c as usize;
                let there = self.point(next);
                let step = distance(here, there) * price[next];
                if cost[cell] + step >= cost[next] {
                    continue;
                }
                let is_free = *free[next].get_or_insert_with(|| self.space.is_clear(there, there));
                if (!is_free && next != goal) || !self.space.is_clear(here, there) {
                    continue;
                }
                cost[next] = cost[cell] + step;
                from[next] = cell;
                open.push((Reverse(Ordered(cost[next] + distance(there, target))), next));
            }
        }
        None
    }

    /// Makes the neighbourhood of a cell dearer.
    fn raise(&self, cell: usize, price: &mut [f64]) {
        let reach = (20.0 / self.resolution).ceil().clamp(1.0, 8.0) as i64;
        let (column, row) = ((cell % self.columns) as i64, (cell / self.columns) as i64);
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let (c, r) = (column + dx, row + dy);
                if c >= 0 && r >= 0 && c < self.columns as i64 && r < self.rows as i64 {
                    let near = &mut price[r as usize * self.columns + c as usize];
                    *near = (*near + TAKEN / (reach as f64)).min(4.0);
                }
            }
        }
    }
}
