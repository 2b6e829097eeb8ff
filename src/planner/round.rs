//! The record of a round: what was decided by which circuit, and how near that is to the optimum.

use super::pair::Window;
use crate::geodesy::Xy;
use crate::qaoa::{EngineKind, Objective};

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
    /// Qubits of the circuit.
    pub qubits: usize,
    /// The part of a longer chain that these are, where they are not all of it.
    pub window: Option<Window>,
    /// Layers of the circuit.
    pub layers: usize,
    /// What the training lowered.
    pub objective: Objective,
    /// Whether that was estimated from samples at every step.
    pub loss_is_sampled: bool,
    /// The objective at the start of the training and after each step.
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
    /// What a QPU measured, where one ran the circuit.
    pub qpu: Option<QpuRound>,
}

/// What a QPU measured in a round. Energies are metres, as those of the [`Round`].
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct QpuRound {
    /// The processor.
    pub backend: String,
    /// Where the angles were trained: on the QPU, or by the exact local engine.
    pub trained_on: &'static str,
    /// ⟨H⟩ of the shots with readout errors taken out.
    pub expectation: f64,
    /// ⟨H⟩ of the shots as they were read.
    pub raw_expectation: f64,
    /// The standard error of `expectation` from the number of shots.
    pub standard_error: f64,
    /// ⟨H⟩ of the circuit without errors, by the local engine.
    pub ideal_expectation: f64,
    /// The standard errors of the loss, where the QPU trained.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub loss_errors: Vec<f64>,
}
