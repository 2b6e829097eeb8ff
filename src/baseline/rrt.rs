//! A rapidly-exploring random tree (LaValle 1998), as the paper sets it ("Experimental
//! Settings"), and with settings that can reach.
//!
//! The paper's 1,000 iterations of 1 m cannot reach a goal several hundred metres away: each adds
//! at most one metre to one branch. That is reported as what it is, not found.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::{Effort, Failure, Outcome, Reach};
use crate::geodesy::Xy;
use crate::planner::leg_space::LegSpace;
use crate::planner::polyline::distance;
use crate::units::Metres;

/// How RRT searches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rrt {
    /// The longest edge of the tree.
    pub step: Metres,
    /// Samples at the most; they bound the memory, by some 100 bytes each.
    pub iterations: usize,
    /// The share of samples that are the goal itself.
    pub goal_bias: f64,
    /// Seed of the samples; the same seed gives the same tree.
    pub seed: u64,
}

impl Rrt {
    /// The paper's settings.
    #[must_use]
    pub fn paper(seed: u64) -> Self {
        Self { step: Metres(1.0), iterations: 1000, goal_bias: 0.05, seed }
    }

    /// Settings that reach goals at a kilometre: steps of 10 m, 20,000 iterations.
    #[must_use]
    pub fn reaching(seed: u64) -> Self {
        Self { step: Metres(10.0), iterations: 20_000, ..Self::paper(seed) }
    }

    /// Grows a tree from `start` until an edge leads to `goal`. The path is what the tree gives,
    /// neither shortened nor smoothed.
    #[must_use]
    pub fn search(&self, space: &LegSpace<'_>, start: Xy, goal: Xy) -> Outcome {
        let clear = |a: Xy, b: Xy| space.airspace().is_clear(a, b, space.margin());
        let Reach { low, high } = Reach::of(space, start, goal);
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let mut tree = Tree::new(start);
        let mut arrival = joins(start, goal, self.step.0, &clear).then_some(0);
        let mut iterations = 0;
        while arrival.is_none() && iterations < self.iterations {
            iterations += 1;
            let sample = if rng.random_bool(self.goal_bias.clamp(0.0, 1.0)) {
                goal
            } else {
                Xy { x: rng.random_range(low.x..=high.x), y: rng.random_range(low.y..=high.y) }
            };
            let nearest = tree.nearest(sample);
            let from = tree.points[nearest];
            let away = distance(from, sample);
            if away == 0.0 {
                continue;
            }
            let to = from + (sample - from) * (self.step.0 / away).min(1.0);
            if clear(from, to) {
                let place = tree.add(to, nearest);
                arrival = joins(to, goal, self.step.0, &clear).then_some(place);
            }
        }
        let effort = Effort { iterations, edges: tree.points.len() - 1 };
        match arrival {
            Some(last) => Outcome::Found { path: tree.path(last, goal), effort },
            None => Outcome::NotFound { failure: Failure::Exhausted, effort },
        }
    }
}

/// Whether the goal is one clear step away.
fn joins(from: Xy, goal: Xy, step: f64, clear: &impl Fn(Xy, Xy) -> bool) -> bool {
    distance(from, goal) <= step && clear(from, goal)
}

struct Tree {
    points: Vec<Xy>,
    parents: Vec<usize>,
    index: RTree<GeomWithData<[f64; 2], usize>>,
}

impl Tree {
    fn new(root: Xy) -> Self {
        let mut tree = Self { points: Vec::new(), parents: Vec::new(), index: RTree::new() };
        tree.add(root, 0);
        tree
    }

    fn add(&mut self, point: Xy, parent: usize) -> usize {
        let place = self.points.len();
        self.points.push(point);
        self.parents.push(parent);
        self.index.insert(GeomWithData::new([point.x, point.y], place));
        place
    }

    fn nearest(&self, point: Xy) -> usize {
        self.index.nearest_neighbor(&[point.x, point.y]).map_or(0, |entry| entry.data)
    }

    fn path(&self, last: usize, goal: Xy) -> Vec<Xy> {
        let mut path = vec![goal];
        let mut place = last;
        loop {
            if path[path.len() - 1] != self.points[place] {
                path.push(self.points[place]);
            }
            if place == 0 {
                break;
            }
            place = self.parents[place];
        }
        path.reverse();
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::scenes::{Scene, scenario};
    use crate::planner::polyline::length;

    const START: Xy = Xy { x: 0.0, y: 0.0 };
    const GOAL: Xy = Xy { x: 60.0, y: 0.0 };

    fn one_obstacle() -> Scene {
        Scene::new(&[[(25.0, -15.0), (35.0, -15.0), (35.0, 15.0), (25.0, 15.0)]])
    }

    #[test]
    fn in_an_easy_scene_every_seed_finds_a_clear_path_of_short_edges() {
        let scene = one_obstacle();
        let space = scene.space(5.0);
        for seed in 0..10 {
            let outcome = Rrt::reaching(seed).search(&space, START, GOAL);
            let path = outcome.path().unwrap();
            assert_eq!((path[0], path[path.len() - 1]), (START, GOAL));
            for edge in path.windows(2) {
                assert!(distance(edge[0], edge[1]) <= 10.0 + 1e-9);
                assert!(space.airspace().is_clear(edge[0], edge[1], space.margin()));
            }
            // Not even over the corners themselves, without a margin, is it shorter.
            assert!(length(path) > 2.0 * 25f64.hypot(15.0) + 10.0);
        }
    }

    #[test]
    fn the_same_seed_grows_the_same_tree_and_another_seed_another_one() {
        let scene = one_obstacle();
        let space = scene.space(5.0);
        let path = |seed| Rrt::reaching(seed).search(&space, START, GOAL);
        assert_eq!(path(3), path(3));
        assert_ne!(path(3), path(4));
    }

    #[test]
    fn a_goal_one_step_away_needs_no_sample() {
        let scene = Scene::new(&[]);
        let goal = Xy { x: 0.7, y: 0.0 };
        let outcome = Rrt::paper(0).search(&scene.space(5.0), START, goal);
        assert_eq!(outcome.path().unwrap(), [START, goal]);
        assert_eq!(outcome.effort(), Effort::default());
    }

    #[test]
    fn with_the_papers_settings_s1_is_out_of_reach_and_said_to_be() {
        let (scene, start, goal) = scenario("s1");
        for seed in 0..5 {
            match Rrt::paper(seed).search(&scene.space(5.0), start, goal) {
                Outcome::NotFound { failure: Failure::Exhausted, effort } => {
                    assert_eq!(effort.iterations, 1000);
                    assert!((1..=1000).contains(&effort.edges));
                }
                other => panic!("{other:?}"),
            }
        }
    }
}
