//! How times grow with the number of edges `|E|`, as the paper's table of complexities asks (its
//! section "Time Complexity Analysis"): measured on one leg, with the exponent fitted.
//!
//! `|E|` is what it is in the paper: QUAV's edges, one qubit each; the grid edges that A*
//! considered; the edges of RRT's tree.

use std::time::{Duration, Instant};

use serde::Serialize;

use super::legs::LegTask;
use crate::baseline::{AStar, Outcome, Rrt};
use crate::cli::CliError;
use crate::geodesy::Xy;
use crate::planner::Settings;
use crate::planner::trellis::{EdgeJudge, Trellis};
use crate::qaoa::chain::ChainEngine;
use crate::qaoa::train::train;
use crate::qaoa::{Angles, Bits, Ising, Scale, TrainSettings};
use crate::stop::Stop;
use crate::units::Metres;

/// The grids of A*, metres.
const RESOLUTIONS: [f64; 5] = [8.0, 4.0, 2.0, 1.0, 0.5];

/// The iterations of RRT, at the paper's step of 1 m.
const ITERATIONS: [usize; 6] = [1000, 2000, 4000, 8000, 16_000, 32_000];

/// The edges of the shortest chain.
const LEAST_EDGES: usize = 10;

/// A measurement is repeated until it has taken this long, and its fastest run counts.
const PATIENCE: Duration = Duration::from_millis(100);

/// What grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Grower {
    /// A* on finer and finer grids.
    AStar,
    /// RRT with more and more iterations.
    Rrt,
    /// A full training of QAOA with the chain engine on longer and longer chains.
    Quav,
}

/// The times of one method.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Growth {
    /// The method.
    pub method: Grower,
    /// What was measured, `|E|` ascending.
    pub points: Vec<GrowthPoint>,
    /// The `k` of `time = c · |E|^k` that fits best; `None` with fewer than two different `|E|`.
    pub exponent: Option<f64>,
}

/// One measurement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GrowthPoint {
    /// `|E|`.
    pub edges: usize,
    /// The time taken.
    pub time_ms: f64,
}

/// Measures all three on a leg; chains have up to `most` edges.
///
/// # Errors
/// [`CliError::Usage`] where the chain engine cannot run with these settings.
pub fn measure(task: &LegTask, settings: &Settings, most: usize) -> Result<Vec<Growth>, CliError> {
    let space = task.space(settings.buffer);
    let (start, goal) = task.ends;
    let grids = RESOLUTIONS.map(|resolution| {
        let search = AStar { resolution: Metres(resolution), ..AStar::default() };
        effort(|| search.search(&space, start, goal))
    });
    let trees = ITERATIONS.map(|iterations| {
        let search = Rrt { iterations, ..Rrt::paper(settings.seed) };
        effort(|| search.search(&space, start, goal))
    });
    let judge =
        EdgeJudge { space, lambda: settings.lambda.0, safety_margin: settings.buffer.0.max(0.1) };
    let mut chains = Vec::new();
    let mut edges = LEAST_EDGES;
    while edges <= most {
        let time = training_time(&chain(start, goal, edges, &judge)?, settings)?;
        chains.push(GrowthPoint { edges, time_ms: milliseconds(time) });
        edges *= 2;
    }
    Ok(vec![
        Growth::new(Grower::AStar, grids.into()),
        Growth::new(Grower::Rrt, trees.into()),
        Growth::new(Grower::Quav, chains),
    ])
}

impl Growth {
    fn new(method: Grower, mut points: Vec<GrowthPoint>) -> Self {
        // A search that ends early takes the same tree again: one of them is enough.
        points.dedup_by_key(|point| point.edges);
        let exponent = exponent(&points);
        Self { method, points, exponent }
    }
}

/// The slope of the straight line through `(ln |E|, ln time)` with the least squares.
#[must_use]
pub fn exponent(points: &[GrowthPoint]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points
        .iter()
        .filter(|point| point.edges > 0 && point.time_ms > 0.0)
        .map(|point| ((point.edges as f64).ln(), point.time_ms.ln()))
        .collect();
    let mean =
        |value: fn(&(f64, f64)) -> f64| logs.iter().map(value).sum::<f64>() / logs.len() as f64;
    let (x, y) = (mean(|log| log.0), mean(|log| log.1));
    let spread: f64 = logs.iter().map(|log| (log.0 - x).powi(2)).sum();
    let common: f64 = logs.iter().map(|log| (log.0 - x) * (log.1 - y)).sum();
    (spread > 0.0).then(|| common / spread)
}

/// The Ising chain of the leg's straight line, cut into edges as in the paper, against a bow
/// beside it: a trellis of any length with edges that collide and edges that do not.
fn chain(start: Xy, goal: Xy, edges: usize, judge: &EdgeJudge<'_>) -> Result<Ising, CliError> {
    let across = Xy { x: start.y - goal.y, y: goal.x - start.x } * 0.2;
    let share = |k: usize| k as f64 / edges as f64;
    let straight = |k: usize| start + (goal - start) * share(k);
    let bow = |k: usize| straight(k) + across * (4.0 * share(k) * (1.0 - share(k)));
    let stations = |place: &dyn Fn(usize) -> Xy| {
        let interior = (1..edges).map(place);
        std::iter::once(start).chain(interior).chain([goal]).collect()
    };
    let trellis = Trellis::new(stations(&straight), stations(&bow), judge);
    let whole = 0..trellis.qubits();
    let penalty = trellis.penalty(&whole, &Bits::zeros(trellis.qubits()));
    match trellis.ising(penalty) {
        Ok(chain) => Ok(chain.into()),
        Err(error) => Err(CliError::Usage(error.to_string())),
    }
}

/// The time of a full training of the paper's kind with the chain engine.
fn training_time(ising: &Ising, settings: &Settings) -> Result<Duration, CliError> {
    let unusable = |error: crate::qaoa::EngineError| CliError::Usage(error.to_string());
    let scaled = ising.scaled(Scale::Sigma);
    let Some(chain) = scaled.ising.to_chain() else {
        return Err(CliError::Usage("the trellis of the leg is no open chain".to_owned()));
    };
    let mut engine = ChainEngine::new(chain, settings.memory_limit);
    let steps = settings.steps;
    let how =
        TrainSettings { steps, learning_rate: settings.learning_rate, ..TrainSettings::default() };
    let mut failure = None;
    let time = fastest(|| {
        if let Err(error) = train(&mut engine, Angles::ramp(settings.layers), &how, &Stop::new()) {
            failure = Some(error);
        }
    });
    failure.map_or(Ok(time), |error| Err(unusable(error)))
}

fn effort(search: impl Fn() -> Outcome) -> GrowthPoint {
    let mut edges = 0;
    let time = fastest(|| edges = search().effort().edges);
    GrowthPoint { edges, time_ms: milliseconds(time) }
}

/// The fastest of as many runs as [`PATIENCE`] allows, at least one.
fn fastest(mut run: impl FnMut()) -> Duration {
    let first = Instant::now();
    let mut least = Duration::MAX;
    while least == Duration::MAX || first.elapsed() < PATIENCE {
        let began = Instant::now();
        run();
        least = least.min(began.elapsed());
    }
    least
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(times: &[(usize, f64)]) -> Vec<GrowthPoint> {
        times.iter().map(|&(edges, time_ms)| GrowthPoint { edges, time_ms }).collect()
    }

    #[test]
    fn the_exponent_of_a_power_is_the_power() {
        for power in [0.5, 1.0, 2.3] {
            let times: Vec<_> =
                [10usize, 20, 80, 640].map(|n| (n, 0.3 * (n as f64).powf(power))).to_vec();
            assert!((exponent(&points(&times)).unwrap() - power).abs() < 1e-12);
        }
    }

    #[test]
    fn one_size_alone_has_no_exponent() {
        assert_eq!(exponent(&points(&[(10, 1.0)])), None);
        assert_eq!(exponent(&points(&[(10, 1.0), (10, 2.0)])), None);
        assert_eq!(exponent(&[]), None);
    }
}
