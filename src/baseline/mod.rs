//! What QUAV is compared with: A* and RRT, set as the paper sets them ("Experimental Settings").
//!
//! - [`astar`]: A* over a fine grid, and the smoothing of its path;
//! - [`rrt`]: a rapidly-exploring random tree;
//! - [`paper`]: the lengths that the paper reports;
//! - `reach`: how far from the leg they search.
//!
//! Both plan one leg in the planner's [`LegSpace`](crate::planner::leg_space::LegSpace), with the
//! same margin from the same exact geometry. They are yardsticks only: no mission is ever planned
//! with them. No I/O and no clock.

pub mod astar;
pub mod paper;
mod reach;
pub mod rrt;

pub use astar::AStar;
pub use rrt::Rrt;

use crate::geodesy::Xy;
use reach::Reach;

/// What a search has spent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Effort {
    /// Points taken up: cells expanded by A*, samples drawn by RRT.
    pub iterations: usize,
    /// Edges: those that A* considered, those of RRT's tree. The paper's `|E|`.
    pub edges: usize,
}

/// Why a search ended without a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failure {
    /// Everything within reach was searched: at this resolution there is no path there.
    NoWay,
    /// The iterations allowed were used up.
    Exhausted,
}

/// What a search came to.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// A path from the start to the goal, every edge of which keeps the margin.
    Found {
        /// Its points, start and goal included, local metres.
        path: Vec<Xy>,
        /// What it took.
        effort: Effort,
    },
    /// No path.
    NotFound {
        /// Why.
        failure: Failure,
        /// What was spent on it.
        effort: Effort,
    },
}

impl Outcome {
    /// The path, if there is one.
    #[must_use]
    pub fn path(&self) -> Option<&[Xy]> {
        match self {
            Self::Found { path, .. } => Some(path),
            Self::NotFound { .. } => None,
        }
    }

    /// What was spent.
    #[must_use]
    pub fn effort(&self) -> Effort {
        match self {
            Self::Found { effort, .. } | Self::NotFound { effort, .. } => *effort,
        }
    }
}

#[cfg(test)]
mod scenes;
