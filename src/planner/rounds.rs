//! The QAOA rounds of one leg: candidates challenge the incumbent, then moved copies of itself.
//!
//! A round builds a trellis from two polylines, runs QAOA on its Ising chain, decodes every
//! distinct bitstring, and keeps the cheapest clean path. The incumbent (the all-zeros string) is
//! always judged too, so a round never makes the path worse.

use std::sync::atomic::{AtomicBool, Ordering};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::candidates::Candidate;
use super::moves::moves;
use super::polyline::{length, simplified};
use super::settings::{Rounds, Settings};
use super::stations::stations;
use super::trellis::{EdgeJudge, Trellis};
use crate::geodesy::Xy;
use crate::qaoa::{
    Angles, AnglesSource, Bits, EngineError, EngineKind, Ising, Qaoa, RunSettings, Scale, Settled,
    TrainSettings,
};

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
    Engine(#[from] EngineError),
    /// The costs of a trellis were not usable.
    #[error("the costs of the leg are not a usable Ising problem: {0}")]
    Ising(#[from] crate::qaoa::IsingError),
    /// The plan was called off.
    #[error("planning was cancelled")]
    Cancelled,
}

/// Refinement rounds at least, rounds without progress before the end, and rounds at most, where
/// the number of rounds is left to the planner.
const LEAST_REFINEMENTS: u32 = 6;
const IDLE_REFINEMENTS: u32 = 4;
const MOST_REFINEMENTS: u32 = 60;

/// An improvement that counts as progress, as a share of the path's length.
const PROGRESS: f64 = 5e-5;

/// Points this near to the line between their neighbours are no corners, metres.
const STRAIGHT: f64 = 1e-3;

/// Steps of a training that starts from the angles of an earlier round.
const CARRIED_STEPS: usize = 8;

/// The incumbent with all that the rounds share.
pub struct Contest<'a> {
    judge: EdgeJudge<'a>,
    settings: &'a Settings,
    qaoa: &'a mut Qaoa,
    rng: ChaCha8Rng,
    incumbent: Vec<Xy>,
    angles: Option<Angles>,
    rounds: Vec<Round>,
    cancelled: &'a AtomicBool,
}

impl<'a> Contest<'a> {
    /// A contest with the first candidate as the incumbent.
    #[must_use]
    pub fn new(
        first: &Candidate,
        judge: EdgeJudge<'a>,
        settings: &'a Settings,
        qaoa: &'a mut Qaoa,
        cancelled: &'a AtomicBool,
    ) -> Self {
        Self {
            judge,
            settings,
            qaoa,
            rng: ChaCha8Rng::seed_from_u64(settings.seed),
            incumbent: first.points.clone(),
            angles: None,
            rounds: Vec::new(),
            cancelled,
        }
    }

    /// Runs all rounds: each other candidate once, then refinements.
    ///
    /// # Errors
    /// [`RoundError`] where an engine fails or the plan is cancelled.
    pub fn run(
        mut self,
        others: &[Candidate],
        mut watch: impl FnMut(&Round),
    ) -> Result<(Vec<Xy>, Vec<Round>), RoundError> {
        let budget = match self.settings.rounds {
            Rounds::Auto => u32::MAX,
            Rounds::AtMost(rounds) => rounds,
        };
        for other in others.iter().take(budget as usize) {
            let challenger = other.points.clone();
            self.round(Challenger::Route, self.incumbent.clone(), challenger, &mut watch)?;
        }
        let spent = self.rounds.len() as u32;
        let most = MOST_REFINEMENTS.min(budget.saturating_sub(spent));
        let planned = if self.settings.rounds == Rounds::Auto { 24 } else { most };
        let mut idle = 0;
        for k in 0..most {
            let before = length(&self.incumbent);
            let progress = (f64::from(k) / f64::from(planned.max(1))).min(1.0);
            let moves =
                moves(&self.incumbent, &self.judge.space, progress, self.room(), &mut self.rng);
            self.round(Challenger::Refinement, moves.from, moves.to, &mut watch)?;
            let gained = before - length(&self.incumbent);
            idle = if gained > PROGRESS * before { 0 } else { idle + 1 };
            let settled = k + 1 >= LEAST_REFINEMENTS && idle >= IDLE_REFINEMENTS;
            if self.settings.rounds == Rounds::Auto && settled {
                break;
            }
        }
        Ok((self.incumbent, self.rounds))
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
        if self.cancelled.load(Ordering::Relaxed) {
            return Err(RoundError::Cancelled);
        }
        let edges = self.settings.qubits.max(from.len() - 1).max(to.len() - 1);
        let (Some(a), Some(b)) = (stations(&from, edges), stations(&to, edges)) else {
            return Ok(()); // a path without length: nothing to contest
        };
        let trellis = Trellis::new(a, b, &self.judge);
        let penalty = trellis.penalty();
        let ising: Ising = trellis.ising(penalty)?.into();
        let settings = self.run_settings();
        let run = self.qaoa.run(&ising, &settings)?;

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
        self.angles = Some(run.angles.clone());

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

    fn run_settings(&mut self) -> RunSettings {
        let settings = self.settings;
        let full = TrainSettings {
            steps: settings.steps,
            learning_rate: settings.learning_rate,
            settled: None,
        };
        let (angles, train) = match &self.angles {
            Some(angles) if !settings.full_training => {
                let settled = Some(Settled { window: 2, tolerance: 2e-2 });
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
