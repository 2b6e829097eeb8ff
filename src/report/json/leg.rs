//! A leg of a plan, with its candidates and rounds.

use serde::Serialize;

use crate::mission::legs::number as item_number;
use crate::planner::candidates::{Candidate, Source};
use crate::planner::pair::Window;
use crate::planner::round::{Challenger, QpuRound, Round};
use crate::replan::LegVerdict;
use crate::report::stretch::Stretch;

/// A leg of the original mission.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LegDocument {
    /// The item that it starts from; `null` for the start.
    pub from: Option<usize>,
    /// The item that it ends at (a return: the returning item).
    pub to: Option<usize>,
    /// What messages call it.
    pub name: String,
    /// Whether it is now flown over inserted waypoints.
    pub replanned: bool,
    /// The length of what is flown now.
    pub length_m: f64,
    /// The straight line.
    pub straight_m: f64,
    /// The least clearance of what is flown now.
    pub min_clearance_m: f64,
    /// The obstacles that the original leg is flown over or under, near enough to be in the way
    /// otherwise.
    pub flown_over_or_under: Vec<String>,
    /// The QAOA rounds.
    pub rounds: Vec<RoundDocument>,
    /// What the rounds started from, the first incumbent first.
    pub candidates: Vec<CandidateDocument>,
}

/// A QAOA round. Energies are metres of path; a collision counts `penalty` in them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RoundDocument {
    /// What challenged the incumbent.
    pub challenger: Challenger,
    /// The engine that ran.
    pub engine: String,
    /// Qubits of the circuit.
    pub qubits: usize,
    /// The part of a longer chain that they are, where the engine does not take all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<Window>,
    /// Layers of the circuit.
    pub layers: usize,
    /// What the training lowered: `mean` (⟨H⟩) or `cvar α`.
    pub objective: String,
    /// Whether that was estimated from samples at every step.
    pub loss_is_sampled: bool,
    /// The objective at the start of the training and after each step.
    pub loss: Vec<f64>,
    /// Energy of the cheapest sample.
    pub best_sample: f64,
    /// The exact optimum.
    pub exact_optimum: f64,
    /// The difference of the two.
    pub gap: f64,
    /// The probability of the exact optimum in one shot.
    pub p_optimum: f64,
    /// The collision penalty.
    pub penalty: f64,
    /// Distinct bitstrings among the shots.
    pub distinct: usize,
    /// The length of the incumbent after the round.
    pub length_m: f64,
    /// Whether the round replaced the incumbent.
    pub improved: bool,
    /// What a QPU measured, where one ran the circuit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub qpu: Option<QpuRound>,
}

/// A candidate path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CandidateDocument {
    /// What found it.
    pub source: Source,
    /// Its length.
    pub length_m: f64,
    /// Its cumulative turning angle.
    pub turning_rad: f64,
    /// Whether every edge keeps the margin.
    pub clear: bool,
}

impl From<&Stretch<'_>> for LegDocument {
    fn from(stretch: &Stretch<'_>) -> Self {
        let LegVerdict { leg, length, .. } = stretch.before;
        let record = stretch.record;
        Self {
            from: leg.from.item.map(item_number),
            to: leg.to.item.map(item_number),
            name: leg.name().to_string(),
            replanned: stretch.replanned,
            length_m: stretch.length.0,
            straight_m: length.0,
            min_clearance_m: stretch.clearance.0,
            flown_over_or_under: stretch.before.passed.clone(),
            rounds: record.iter().flat_map(|r| &r.rounds).map(RoundDocument::from).collect(),
            candidates: record
                .iter()
                .flat_map(|r| &r.candidates)
                .map(CandidateDocument::from)
                .collect(),
        }
    }
}

impl From<&Round> for RoundDocument {
    fn from(round: &Round) -> Self {
        Self {
            challenger: round.challenger,
            engine: round.engine.to_string(),
            qubits: round.qubits,
            window: round.window,
            layers: round.layers,
            objective: round.objective.to_string(),
            loss_is_sampled: round.loss_is_sampled,
            loss: round.loss.clone(),
            best_sample: round.best_sample,
            exact_optimum: round.exact_optimum,
            gap: round.gap,
            p_optimum: round.p_optimum,
            penalty: round.penalty,
            distinct: round.distinct,
            length_m: round.length,
            improved: round.improved,
            qpu: round.qpu.clone(),
        }
    }
}

impl From<&Candidate> for CandidateDocument {
    fn from(candidate: &Candidate) -> Self {
        let &Candidate { source, length, turning, clear, .. } = candidate;
        Self { source, length_m: length, turning_rad: turning, clear }
    }
}
