//! What a mission was planned with.

use serde::Serialize;

use crate::planner::{CandidateSource, QpuSettings, Rounds};
use crate::qaoa::{EngineChoice, EngineKind};
use crate::replan::Options;
use crate::units::Metres;

/// The settings, by the names of their options.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SettingsDocument {
    /// quavd's version.
    pub version: &'static str,
    /// What paths keep from everything, metres.
    pub buffer: Metres,
    /// Qubits of a leg, where its candidates do not need more.
    pub qubits: usize,
    /// QAOA layers.
    pub layers: usize,
    /// Adam steps of a full training.
    pub steps: usize,
    /// Adam's learning rate.
    pub learning_rate: f64,
    /// The share of the best measurements that training looks at; `null`: all, ⟨H⟩.
    pub cvar: Option<f64>,
    /// Shots of each run.
    pub shots: u32,
    /// `auto` or the most rounds of a leg.
    pub rounds: String,
    /// The seed.
    pub seed: u64,
    /// The resolution of the candidate grid, metres.
    pub grid: Metres,
    /// Where candidates are looked for.
    pub source: CandidateSource,
    /// Candidates wanted.
    pub candidates: usize,
    /// `λ` of the edge cost, metres.
    pub lambda: Metres,
    /// `auto` or the engine asked for.
    pub engine: String,
    /// How a QPU is used; only with the ibm engine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub qpu: Option<QpuSettings>,
    /// Whether every round is trained in full.
    pub full_training: bool,
    /// `auto` or the zone of all legs.
    pub zone: String,
    /// What several inclusions mean together.
    pub inclusion: String,
    /// How long planning may take, seconds.
    pub deadline: Option<f64>,
}

impl From<&Options> for SettingsDocument {
    fn from(options: &Options) -> Self {
        let settings = &options.settings;
        Self {
            version: env!("CARGO_PKG_VERSION"),
            buffer: settings.buffer,
            qubits: settings.qubits,
            layers: settings.layers,
            steps: settings.steps,
            learning_rate: settings.learning_rate,
            cvar: settings.cvar,
            shots: settings.shots,
            rounds: match settings.rounds {
                Rounds::Auto => "auto".to_owned(),
                Rounds::AtMost(rounds) => rounds.to_string(),
            },
            seed: settings.seed,
            grid: settings.grid,
            source: settings.source,
            candidates: settings.candidates,
            lambda: settings.lambda,
            engine: match settings.engine {
                EngineChoice::Auto => "auto".to_owned(),
                EngineChoice::Only(kind) => kind.to_string(),
            },
            qpu: (settings.engine == EngineChoice::Only(EngineKind::Ibm))
                .then(|| settings.qpu.clone()),
            full_training: settings.full_training,
            zone: options.zone.map_or_else(|| "auto".to_owned(), |zone| zone.to_string()),
            inclusion: options.inclusion.to_string(),
            deadline: options.deadline.map(|time| time.as_secs_f64()),
        }
    }
}
