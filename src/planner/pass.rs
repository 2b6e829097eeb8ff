//! What one search over corners has reached, and what it still has to try.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A corner as it is passed: twice its number, plus one with its boundary on the left.
pub(super) type State = u32;

/// The numbers of the start and of the goal.
pub(super) const START: u32 = 0;
pub(super) const GOAL: u32 = 1;

/// Paths are compared with this tolerance, metres.
pub(super) const SAME: f64 = 1e-9;

/// An edge to try, ordered by the length of the shortest path that may use it.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Offer {
    pub(super) estimate: f64,
    pub(super) so_far: f64,
    pub(super) from: State,
    pub(super) to: State,
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

/// How a state was reached.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reached {
    pub(super) so_far: f64,
    pub(super) from: State,
}

/// One search: what was reached, and what is still to be tried.
pub(super) struct Pass {
    /// How much the way that is left counts: above 1 the search is quicker and less exact.
    pub(super) weight: f64,
    /// Places that may still be looked at.
    pub(super) patience: u32,
    /// Longer paths are of no interest, metres.
    pub(super) bound: f64,
    pub(super) reached: Vec<Option<Reached>>,
    pub(super) open: BinaryHeap<Reverse<Offer>>,
}

impl Pass {
    /// Whether reaching a state in `so_far` metres would be better than anything before.
    pub(super) fn is_news(&self, state: State, so_far: f64) -> bool {
        self.reached[state as usize].is_none_or(|reached| so_far < reached.so_far - SAME)
    }
}
