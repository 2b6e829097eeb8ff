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
use super::pair::Pair;
use super::polyline::{length, simplified};
use super::round::{Challenger, QpuRound, Round};
use super::settings::{Rounds, Settings};
use super::stations::{Spare, aligned};
use super::trellis::{EdgeJudge, Trellis};
use crate::geodesy::Xy;
use crate::qaoa::qpu::QpuError;
use crate::qaoa::{
    Angles, AnglesSource, Bits, EngineChoice, EngineError, EngineKind, Objective, Qaoa, QaoaRun,
    RunSettings, Scale, Settled, TrainSettings,
};
use crate::stop::{Stop, Stopped};

/// The better of staying and the cheapest sample of a round.
pub(super) struct Decided {
    pub(super) cost: f64,
    bits: Bits,
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
    /// The QPU gave nothing, and nothing else was allowed.
    #[error(transparent)]
    Qpu(#[from] QpuError),
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
pub(super) const PROPOSALS: usize = 8;

/// An improvement that counts as progress, as a share of the path's length.
pub(super) const PROGRESS: f64 = 5e-5;

/// Points this near to the line between their neighbours are no corners, metres.
const STRAIGHT: f64 = 1e-3;

/// Steps of a training that starts from the angles of an earlier round.
const CARRIED_STEPS: usize = 24;

/// When such a training has settled.
const CARRIED_SETTLED: Option<Settled> = Some(Settled { window: 4, tolerance: 3e-3 });

/// The incumbent with all that the rounds share.
pub struct Contest<'a> {
    pub(super) judge: EdgeJudge<'a>,
    pub(super) settings: &'a Settings,
    pub(super) qaoa: &'a mut Qaoa,
    pub(super) rng: ChaCha8Rng,
    pub(super) incumbent: Vec<Xy>,
    /// The last angles of route rounds and of refinements.
    pub(super) angles: [Option<Angles>; 2],
    pub(super) rounds: Vec<Round>,
    /// Rounds at most.
    pub(super) budget: usize,
    pub(super) stop: &'a Stop,
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
    /// What ran instead of the QPU that was asked for, and why.
    pub fallback: Option<String>,
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
        if self.settings.engine == EngineChoice::Only(EngineKind::Ibm) {
            return Err(EngineError::NoQpu.into());
        }
        let cut_short = match self.all_rounds(others, &mut watch) {
            Ok(()) => false,
            Err(RoundError::Stopped(Stopped::DeadlinePassed)) => true,
            Err(error) => return Err(error),
        };
        Ok(Contested { path: self.incumbent, rounds: self.rounds, cut_short, fallback: None })
    }

    pub(super) fn all_rounds(
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
    pub(super) fn cost(&self, path: &[Xy]) -> f64 {
        path.windows(2).map(|edge| self.judge.edge(edge[0], edge[1]).cost()).sum()
    }

    /// Corners that an incumbent may have.
    pub(super) fn room(&self) -> usize {
        self.settings.qubits + 1
    }

    /// One round between two polylines with the same ends; where the chain is too long for one, one
    /// for each window, each with the bits that those before it have found.
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
        // Each window holds the bits that those before it have found.
        let mut held = None;
        for mut pair in self.pairs_of(kind, &from, &to)? {
            if self.rounds.len() >= self.budget {
                break;
            }
            if let Some(held) = held.take() {
                pair = pair.holding(held);
            }
            let settings = self.run_settings(kind);
            let run = self.qaoa.run(&pair.ising, &settings, self.stop)?;
            self.angles[kind as usize] = Some(run.angles.clone());
            held = Some(self.decide(&pair, run, None, f64::INFINITY, watch).bits);
        }
        Ok(())
    }

    /// Two polylines as problems: one, or where the engine does not take the whole chain one for each
    /// window that has something to decide. None for a path without length.
    pub(super) fn pairs_of(
        &self,
        kind: Challenger,
        from: &[Xy],
        to: &[Xy],
    ) -> Result<Vec<Pair>, RoundError> {
        let spare = if self.settings.full_training { Spare::Along } else { Spare::Alike };
        let Some((a, b)) = aligned(from, to, self.settings.qubits, spare) else {
            return Ok(Vec::new());
        };
        let trellis = Trellis::new(a, b, &self.judge);
        let few = self.settings.qubits;
        let most = match kind {
            // Two routes differ nearly everywhere: the more there is to decide at once, the less
            // likely is it that a shot has all of it right.
            Challenger::Route => few,
            Challenger::Refinement => self.settings.engine.most_qubits(few),
        };
        Ok(Pair::windows_of(kind, &trellis, most)?)
    }

    /// Judges every sample of a run; the cheapest path is the incumbent if it is cheaper than staying
    /// and than `champion`.
    pub(super) fn decide(
        &mut self,
        pair: &Pair,
        run: QaoaRun,
        qpu: Option<QpuRound>,
        champion: f64,
        watch: &mut impl FnMut(&Round),
    ) -> Decided {
        let trellis = &pair.trellis;
        let cost = |bits: &Bits| trellis.path_edges(bits).map(|edge| edge.cost()).sum::<f64>();
        let stay = Decided { cost: cost(&pair.held), bits: pair.held.clone() };
        let best = run
            .samples
            .iter()
            .map(|sample| pair.whole(&sample.bits))
            .map(|bits| Decided { cost: cost(&bits), bits })
            .min_by(|x, y| x.cost.total_cmp(&y.cost))
            .filter(|best| best.cost < stay.cost - 1e-9);
        let improved = best.as_ref().is_some_and(|best| best.cost < champion - 1e-9);
        let best = best.unwrap_or(stay);
        // Without an earlier champion the incumbent is what this pair made of it.
        if improved || champion.is_infinite() {
            let space = self.judge.space;
            let chosen = trellis.decode(&best.bits);
            self.incumbent = simplified(&chosen, STRAIGHT, |a, b| space.is_clear(a, b));
        }

        let (exact_optimum, gap, p_optimum) = match &run.certificate {
            Some(c) => (c.exact_optimum, c.gap.unwrap_or(f64::INFINITY), c.p_optimum),
            None => (f64::NAN, f64::NAN, f64::NAN),
        };
        let round = Round {
            challenger: pair.kind,
            engine: run.engine,
            qubits: run.qubits,
            window: pair.part(),
            layers: run.angles.layers(),
            objective: run.objective,
            loss_is_sampled: run.loss_is_sampled,
            loss: run.loss,
            distinct: run.samples.len(),
            best_sample: run.best.as_ref().map_or(f64::INFINITY, |best| best.energy),
            exact_optimum,
            gap,
            p_optimum,
            penalty: pair.penalty,
            incumbent: self.incumbent.clone(),
            length: length(&self.incumbent),
            improved,
            qpu,
        };
        watch(&round);
        self.rounds.push(round);
        best
    }

    pub(super) fn run_settings(&mut self, kind: Challenger) -> RunSettings {
        let settings = self.settings;
        let objective = match settings.cvar {
            None => Objective::Mean,
            Some(alpha) => {
                Objective::Cvar { alpha, shots: settings.shots, seed: self.rng.random() }
            }
        };
        let full = TrainSettings {
            steps: settings.steps,
            learning_rate: settings.learning_rate,
            settled: None,
            objective,
        };
        let (angles, train) = match &self.angles[kind as usize] {
            // The trellises of different routes have little in common: each is trained in full.
            Some(angles) if kind == Challenger::Refinement && !settings.full_training => {
                let steps = settings.steps.min(CARRIED_STEPS);
                let carried = AnglesSource::CarriedOver(angles.clone());
                (carried, TrainSettings { steps, settled: CARRIED_SETTLED, ..full })
            }
            _ => (AnglesSource::Ramp(settings.layers), full),
        };
        RunSettings {
            engine: settings.engine.local(),
            scale: Scale::Sigma,
            angles,
            train,
            shots: settings.shots,
            seed: self.rng.random(),
        }
    }
}
