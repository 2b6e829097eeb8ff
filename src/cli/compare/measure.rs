//! Every method on the legs of a scenario. The clock is here; the methods themselves have none.

use std::time::{Duration, Instant};

use serde::Serialize;

use super::legs::LegTask;
use crate::baseline::{AStar, Failure, Outcome, Rrt};
use crate::geodesy::Xy;
use crate::planner::leg::LegRequest;
use crate::planner::leg_space::LegSpace;
use crate::planner::{LegOutcome, LegPlanner, Settings};
use crate::report::json::leg::RoundDocument;
use crate::stop::Stop;
use crate::units::Metres;

/// A path that keeps all of the buffer but this much is not said to collide, metres: positions are
/// stored to a centimetre.
const STORED: f64 = 0.01;

/// A way to plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// A* over a grid of 0.5 m, its path as it is.
    AStar,
    /// The same path with the paper's smoothing.
    AStarSmoothed,
    /// RRT with the paper's settings.
    Rrt,
    /// RRT with settings that can reach.
    RrtReaching,
    /// QUAV with the paper's settings.
    QuavPaper,
    /// QUAV as asked for on the command line.
    Quav,
}

impl Method {
    /// All of them, in the order of the table.
    pub const ALL: [Self; 6] = [
        Self::AStar,
        Self::AStarSmoothed,
        Self::Rrt,
        Self::RrtReaching,
        Self::QuavPaper,
        Self::Quav,
    ];

    /// What the table calls it.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::AStar => "A*, 0.5 m grid",
            Self::AStarSmoothed => "A*, smoothed",
            Self::Rrt => "RRT, 1 m steps",
            Self::RrtReaching => "RRT, 10 m steps",
            Self::QuavPaper => "QUAV --paper",
            Self::Quav => "QUAV",
        }
    }
}

/// What a method came to on a scenario, over all its runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// The method.
    pub method: Method,
    /// Runs: one for each seed of RRT, one of the others.
    pub runs: u32,
    /// Runs that found a path for every leg.
    pub found: u32,
    /// The mean length of the paths found, all legs together.
    pub length_m: Option<f64>,
    /// The least clearance of any path found; `None` also where there is nothing to be near to.
    pub min_clearance_m: Option<f64>,
    /// Edges, of all paths found, that come nearer to something than the buffer (less 1 cm).
    pub collisions: usize,
    /// The mean time of a run, successful or not.
    pub time_ms: f64,
    /// The mean of what the searches took up: cells of A*, samples of RRT, rounds of QUAV.
    pub iterations: f64,
    /// Why there is no path, where no run found one.
    pub reason: Option<String>,
    /// The QAOA rounds with their loss curves.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rounds: Vec<RoundDocument>,
}

/// What all methods are measured with.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// What every path has to keep.
    pub buffer: Metres,
    /// Seeds of RRT.
    pub seeds: u32,
    /// Settings of [`Method::Quav`].
    pub quav: Settings,
    /// Settings of [`Method::QuavPaper`].
    pub paper: Settings,
}

/// One path, or why there is none.
struct Attempt {
    path: Result<Vec<Xy>, String>,
    iterations: usize,
    rounds: Vec<RoundDocument>,
}

impl From<Outcome> for Attempt {
    fn from(outcome: Outcome) -> Self {
        let iterations = outcome.effort().iterations;
        let path = match outcome {
            Outcome::Found { path, .. } => Ok(path),
            Outcome::NotFound { failure: Failure::NoWay, .. } => {
                Err("everything in reach was searched".to_owned())
            }
            Outcome::NotFound { failure: Failure::Exhausted, .. } => {
                Err(format!("not found in {iterations} iterations"))
            }
        };
        Self { path, iterations, rounds: Vec::new() }
    }
}

impl Measurement {
    /// Runs a method on all legs, as often as it has seeds.
    #[must_use]
    pub fn measure(&self, method: Method, tasks: &[LegTask]) -> Measured {
        let random = matches!(method, Method::Rrt | Method::RrtReaching);
        let runs = if random { self.seeds } else { 1 };
        let mut total = Total::default();
        for seed in 0..runs {
            let seed = self.quav.seed.wrapping_add(u64::from(seed));
            total.add(tasks, self.buffer, |task| self.attempt(method, task, seed));
        }
        let mean = |sum: f64, count: u32| sum / f64::from(count);
        Measured {
            method,
            runs,
            found: total.found,
            length_m: (total.found > 0).then(|| mean(total.length.0, total.found)),
            min_clearance_m: total.clearance.filter(|metres| metres.0.is_finite()).map(|m| m.0),
            collisions: total.collisions,
            time_ms: mean(total.time.as_secs_f64() * 1e3, runs),
            iterations: mean(total.iterations as f64, runs),
            reason: total.reason.filter(|_| total.found == 0),
            rounds: total.rounds,
        }
    }

    fn attempt(&self, method: Method, task: &LegTask, seed: u64) -> Attempt {
        let space = task.space(self.buffer);
        let (start, goal) = task.ends;
        let grid = AStar::default();
        match method {
            Method::AStar => grid.search(&space, start, goal).into(),
            Method::AStarSmoothed => {
                let mut attempt = Attempt::from(grid.search(&space, start, goal));
                attempt.path = attempt.path.map(|path| grid.smoothed(&path, &space));
                attempt
            }
            Method::Rrt => Rrt::paper(seed).search(&space, start, goal).into(),
            Method::RrtReaching => Rrt::reaching(seed).search(&space, start, goal).into(),
            Method::QuavPaper => quav(&self.paper, task, &space),
            Method::Quav => quav(&self.quav, task, &space),
        }
    }
}

fn quav(settings: &Settings, task: &LegTask, space: &LegSpace<'_>) -> Attempt {
    let request = LegRequest { from: task.from, to: task.to, from_reach: 0.0, to_reach: 0.0 };
    let mut rounds = Vec::new();
    let path = LegPlanner::new(settings.clone())
        .plan(&request, &task.frame, space, &Stop::new(), 1, |round| {
            rounds.push(RoundDocument::from(round));
        })
        .map(|outcome| match outcome {
            LegOutcome::Clear => vec![task.ends.0, task.ends.1],
            LegOutcome::Replanned(plan) => plan.finished.points,
        })
        .map_err(|error| error.to_string());
    Attempt { path, iterations: rounds.len(), rounds }
}

/// Sums over the runs of a method.
#[derive(Default)]
struct Total {
    found: u32,
    length: Metres,
    clearance: Option<Metres>,
    collisions: usize,
    time: Duration,
    iterations: usize,
    reason: Option<String>,
    rounds: Vec<RoundDocument>,
}

impl Total {
    /// One run over all legs. It ends with the first leg that has no path.
    fn add(&mut self, tasks: &[LegTask], buffer: Metres, attempt: impl Fn(&LegTask) -> Attempt) {
        let mut paths = Vec::new();
        for task in tasks {
            let began = Instant::now();
            let attempt = attempt(task);
            self.time += began.elapsed();
            self.iterations += attempt.iterations;
            self.rounds.extend(attempt.rounds);
            let measured = attempt.path.and_then(|path| {
                let length = task.length(&path).map_err(|error| error.to_string())?;
                Ok((task, path, length))
            });
            match measured {
                Ok(measured) => paths.push(measured),
                Err(reason) => {
                    self.reason = Some(reason);
                    return;
                }
            }
        }
        self.found += 1;
        for (task, path, length) in paths {
            self.length += length;
            for edge in path.windows(2) {
                let clearance = task.clearance(edge[0], edge[1]);
                self.collisions += usize::from(clearance.0 < buffer.0 - STORED);
                self.clearance =
                    Some(self.clearance.map_or(clearance, |least| least.min(clearance)));
            }
        }
    }
}
