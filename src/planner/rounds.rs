//! The QAOA rounds of one leg: candidates challenge the incumbent, then moved copies of itself.
//!
//! A round builds a trellis from two polylines, runs QAOA on its Ising chain, decodes every
//! distinct bitstring, and keeps the cheapest clean path. The incumbent (the all-zeros string) is
//! always judged too, so a round never makes the path worse.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::candidates::{Candidate, Source};
use super::homotopy::passes_differently;
use super::moves::moves;
use super::polyline::{length, simplified};
use super::settings::{Rounds, Settings};
use super::stations::aligned;
use super::trellis::{EdgeJudge, Trellis};
use crate::geodesy::Xy;
use crate::qaoa::{
    Angles, AnglesSource, Bits, EngineError, EngineKind, Ising, Qaoa, RunSettings, Scale, Settled,
    TrainSettings,
};
use crate::stop::{Stop, Stopped};

/// What challenged the incumbent in a round.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Challenger {
    /// Another candidate.
    Route,
    /// The incumbent with its stations moved.
    Refinement,
}

/// The record of one round. Energies are metres; a collision counts `penalty` in them.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    /// What challenged.
    pub challenger: Challenger,
    /// The engine that ran.
    pub engine: EngineKind,
    /// Qubits of the chain.
    pub qubits: usize,
    /// Layers of the circuit.
    pub layers: usize,
    /// ⟨H⟩ at the start of the training and after each step.
    pub loss: Vec<f64>,
    /// Distinct bitstrings among the shots.
    pub distinct: usize,
    /// Energy of the cheapest sample.
    pub best_sample: f64,
    /// The chain's exact optimum.
    pub exact_optimum: f64,
    /// The difference of the two.
    pub gap: f64,
    /// The probability of the exact optimum in one shot.
    pub p_optimum: f64,
    /// The collision penalty `M` of this chain.
    pub penalty: f64,
    /// The incumbent after the round, local metres.
    pub incumbent: Vec<Xy>,
    /// Its length.
    pub length: f64,
    /// Whether the round replaced the incumbent.
    pub improved: bool,
}

/// Why the rounds ended without a result.
#[derive(Debug, thiserror::Error)]
pub enum RoundError {
    /// An engine would not run.
    #[error(transparent)]
    Engine(EngineError),
    /// The costs of a trellis were not usable.
    #[error("the costs of the leg are not a usable Ising problem: {0}")]
    Ising(#[from] crate::qaoa::IsingError),
    /// The plan was called off, or its time is up.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// Refinement rounds at least, and rounds without progress before the end, where the number of
/// rounds is left to the planner.
const LEAST_REFINEMENTS: usize = 6;
const IDLE_REFINEMENTS: usize = 4;

/// Rounds at most, where their number is left to the planner.
const MOST_ROUNDS: usize = 60;

/// Refinement rounds for a rough candidate to show what it is worth.
const TRIAL: usize = 12;

/// A rough candidate this many times as long as the incumbent has a chance.
const RIVAL: f64 = 1.06;

/// Steps shrink over so many refinement rounds.
const STEPS_SHRINK_OVER: usize = 24;

/// How often moves are drawn until one moves something.
const PROPOSALS: usize = 8;

/// An improvement that counts as progress, as a share of the path's length.
const PROGRESS: f64 = 5e-5;

/// Points this near to the line between their neighbours are no corners, metres.
const STRAIGHT: f64 = 1e-3;

/// Steps of a training that starts from the angles of an earlier round.
const CARRIED_STEPS: usize = 16;

/// The incumbent with all that the rounds share.
pub struct Contest<'a> {
    judge: EdgeJudge<'a>,
    settings: &'a Settings,
    qaoa: &'a mut Qaoa,
    rng: ChaCha8Rng,
    incumbent: Vec<Xy>,
    /// The last angles of route rounds and of refinements.
    angles: [Option<Angles>; 2],
    rounds: Vec<Round>,
    /// Rounds at most.
    budget: usize,
    stop: &'a Stop,
}

/// What the rounds of a leg came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Contested {
    /// The incumbent at the end.
    pub path: Vec<Xy>,
    /// The rounds that were run to their end.
    pub rounds: Vec<Round>,
    /// Whether the deadline passed before the rounds had brought all that they could.
    pub cut_short: bool,
}

impl From<EngineError> for RoundError {
    fn from(error: EngineError) -> Self {
        match error {
            EngineError::Stopped(reason) => Self::Stopped(reason),
            error => Self::Engine(error),
        }
    }
}

impl<'a> Contest<'a> {
    /// A contest with the first candidate as the incumbent.
    #[must_use]
    pub fn new(
        first: &Candidate,
        judge: EdgeJudge<'a>,
        settings: &'a Settings,
        qaoa: &'a mut Qaoa,
        stop: &'a Stop,
    ) -> Self {
        Self {
            judge,
            settings,
            qaoa,
            rng: ChaCha8Rng::seed_from_u64(settings.seed),
            incumbent: first.points.clone(),
            angles: [None, None],
            rounds: Vec::new(),
            budget: 0,
            stop,
        }
    }

    /// Runs all rounds: each other candidate once, then refinements. A deadline that passes ends
    /// them with what they have brought.
    ///
    /// # Errors
    /// [`RoundError`] where an engine fails or the plan is cancelled.
    pub fn run(
        mut self,
        others: &[Candidate],
        mut watch: impl FnMut(&Round),
    ) -> Result<Contested, RoundError> {
        let cut_short = match self.all_rounds(others, &mut watch) {
            Ok(()) => false,
            Err(RoundError::Stopped(Stopped::DeadlinePassed)) => true,
            Err(error) => return Err(error),
        };
        Ok(Contested { path: self.incumbent, rounds: self.rounds, cut_short })
    }

    fn all_rounds(
        &mut self,
        others: &[Candidate],
        watch: &mut impl FnMut(&Round),
    ) -> Result<(), RoundError> {
        self.budget = match self.settings.rounds {
            Rounds::Auto => MOST_ROUNDS.max(others.len() + LEAST_REFINEMENTS),
            Rounds::AtMost(rounds) => rounds as usize,
        };
        for other in others {
            self.challenge(other.points.clone(), watch)?;
        }
        // Candidates from the grid are rough: the one that is best once it is taut need not be
        // the one that is best now. Those that pass obstacles on other sides get their chance.
        let rough = others.iter().filter(|other| other.source == Source::Grid && other.clear);
        let mut seen = vec![self.incumbent.clone()];
        if self.settings.rounds == Rounds::Auto {
            for other in rough {
                let space = &self.judge.space;
                let rival = length(&other.points) <= RIVAL * length(&self.incumbent);
                let new = seen.iter().all(|seen| passes_differently(seen, &other.points, space));
                if !rival || !new || self.rounds.len() + 2 * TRIAL > self.budget {
                    continue;
                }
                if seen.len() == 1 {
                    self.refine(TRIAL, watch)?;
                }
                seen.push(other.points.clone());
                let champion = std::mem::replace(&mut self.incumbent, other.points.clone());
                let trial = self.refine(TRIAL, watch);
                // Also when the trial was stopped the cheaper of the two stays.
                let back = self.challenge(champion, watch);
                trial.and(back)?;
            }
        }
        self.refine(usize::MAX, watch)
    }

    /// A route round against another polyline; the cheaper of the two is the incumbent.
    fn challenge(
        &mut self,
        other: Vec<Xy>,
        watch: &mut impl FnMut(&Round),
    ) -> Result<(), RoundError> {
        let mut from = std::mem::take(&mut self.incumbent);
        let mut to = other;
        if self.cost(&to) < self.cost(&from) {
            std::mem::swap(&mut from, &mut to);
        }
        self.incumbent.clone_from(&from);
        self.round(Challenger::Route, from, to, watch)
    }

    /// Refinement rounds until several in a row have brought next to nothing.
    fn refine(&mut self, at_most: usize, watch: &mut impl FnMut(&Round)) -> Result<(), RoundError> {
        let auto = self.settings.rounds == Rounds::Auto;
        let most = self.budget.saturating_sub(self.rounds.len()).min(at_most);
        let planned = if auto { STEPS_SHRINK_OVER.min(most) } else { most };
        let mut idle = 0;
        for k in 0..most {
            let before = self.cost(&self.incumbent);
            let progress = (k as f64 / planned.max(1) as f64).min(1.0);
            let moves = (0..PROPOSALS)
                .map(|_| moves(&self.incumbent, &self.judge, progress, self.room(), &mut self.rng))
                .find(|moves| moves.from != moves.to);
            // Nothing can be moved at all, as on a straight line.
            let Some(moves) = moves else { break };
            self.round(Challenger::Refinement, moves.from, moves.to, watch)?;
            let gained = before - self.cost(&self.incumbent);
            idle = if gained > PROGRESS * before { 0 } else { idle + 1 };
            if auto && k + 1 >= LEAST_REFINEMENTS && idle >= IDLE_REFINEMENTS {
                break;
            }
        }
        Ok(())
    }

    /// What a path costs, collisions as the paper reports them.
    fn cost(&self, path: &[Xy]) -> f64 {
        path.windows(2).map(|edge| self.judge.edge(edge[0], edge[1]).cost()).sum()
    }

    /// Corners that an incumbent may have.
    fn room(&self) -> usize {
        self.settings.qubits + 1
    }

    /// One round between two polylines with the same ends.
    fn round(
        &mut self,
        kind: Challenger,
        from: Vec<Xy>,
        to: Vec<Xy>,
        watch: &mut impl FnMut(&Round),
    ) -> Result<(), RoundError> {
        self.stop.check()?;
        if self.rounds.len() >= self.budget {
            return Ok(());
        }
        let Some((a, b)) = aligned(&from, &to, self.settings.qubits) else {
            return Ok(()); // a path without length: nothing to contest
        };
        let trellis = Trellis::new(a, b, &self.judge);
        let penalty = trellis.penalty();
        let ising: Ising = trellis.ising(penalty)?.into();
        let settings = self.run_settings(kind);
        let run = self.qaoa.run(&ising, &settings, self.stop)?;

        let zeros = Bits::zeros(trellis.qubits());
        let cost = |bits: &Bits| trellis.path_edges(bits).map(|edge| edge.cost()).sum::<f64>();
        let stay = cost(&zeros);
        let best = run
            .samples
            .iter()
            .map(|sample| (cost(&sample.bits), &sample.bits))
            .min_by(|x, y| x.0.total_cmp(&y.0));
        let improved = best.is_some_and(|(cost, _)| cost < stay - 1e-9);
        let chosen = match best {
            Some((_, bits)) if improved => trellis.decode(bits),
            _ => trellis.decode(&zeros),
        };
        let space = self.judge.space;
        self.incumbent = simplified(&chosen, STRAIGHT, |a, b| space.is_clear(a, b));
        self.angles[kind as usize] = Some(run.angles.clone());

        let best_sample = run.best.as_ref().map_or(f64::INFINITY, |best| best.energy);
        let (exact_optimum, gap, p_optimum) = match &run.certificate {
            Some(c) => (c.exact_optimum, c.gap.unwrap_or(f64::INFINITY), c.p_optimum),
            None => (f64::NAN, f64::NAN, f64::NAN),
        };
        let round = Round {
            challenger: kind,
            engine: run.engine,
            qubits: run.qubits,
            layers: run.angles.layers(),
            loss: run.loss,
            distinct: run.samples.len(),
            best_sample,
            exact_optimum,
            gap,
            p_optimum,
            penalty,
            incumbent: self.incumbent.clone(),
            length: length(&self.incumbent),
            improved,
        };
        watch(&round);
        self.rounds.push(round);
        Ok(())
    }

    fn run_settings(&mut self, kind: Challenger) -> RunSettings {
        let settings = self.settings;
        let full = TrainSettings {
            steps: settings.steps,
            learning_rate: settings.learning_rate,
            settled: None,
        };
        let (angles, train) = match &self.angles[kind as usize] {
            Some(angles) if !settings.full_training => {
                let settled = Some(Settled { window: 3, tolerance: 1e-2 });
                let steps = settings.steps.min(CARRIED_STEPS);
                (
                    AnglesSource::CarriedOver(angles.clone()),
                    TrainSettings { steps, settled, ..full },
                )
            }
            _ => (AnglesSource::Ramp(settings.layers), full),
        };
        RunSettings {
            engine: settings.engine,
            scale: Scale::Sigma,
            angles,
            train,
            shots: settings.shots,
            seed: self.rng.random(),
        }
    }
}
