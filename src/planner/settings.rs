//! The planner's settings, with the paper's values as defaults.

use serde::Serialize;

use super::finish::WORTH_OF_FEW;
use crate::qaoa::EngineChoice;
use crate::units::Metres;

/// Where candidates are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CandidateSource {
    /// Over the corners of obstacles, and over the grid where no clear path is found there.
    #[default]
    Corners,
    /// Over the grid only, as in the paper.
    Grid,
    /// Both.
    Both,
}

impl CandidateSource {
    /// Whether obstacle corners are searched.
    #[must_use]
    pub fn uses_corners(self) -> bool {
        matches!(self, Self::Corners | Self::Both)
    }

    /// Whether the grid is always searched.
    #[must_use]
    pub fn uses_grid(self) -> bool {
        matches!(self, Self::Grid | Self::Both)
    }
}

impl std::str::FromStr for CandidateSource {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "corners" => Ok(Self::Corners),
            "grid" => Ok(Self::Grid),
            "both" => Ok(Self::Both),
            _ => Err(format!("'{text}' is none of corners, grid, both")),
        }
    }
}

/// How many QAOA rounds a leg gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rounds {
    /// Until several rounds in a row have brought next to nothing.
    #[default]
    Auto,
    /// At most this many.
    AtMost(u32),
}

impl std::str::FromStr for Rounds {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            number => match number.parse() {
                Ok(rounds @ 1..=10_000) => Ok(Self::AtMost(rounds)),
                _ => Err(format!("'{text}' is neither auto nor a number of rounds (1 to 10000)")),
            },
        }
    }
}

/// Where the angles of circuits for a QPU are trained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum QpuTraining {
    /// By the exact local engine; the QPU only samples.
    #[default]
    Local,
    /// On the QPU, as in the paper: the first circuit of a leg is trained there, and the others carry its
    /// angles over.
    Qpu,
}

impl std::str::FromStr for QpuTraining {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "local" => Ok(Self::Local),
            "qpu" => Ok(Self::Qpu),
            _ => Err(format!("'{text}' is neither local nor qpu")),
        }
    }
}

/// How a leg is planned on a QPU.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct QpuSettings {
    /// Where angles are trained.
    pub training: QpuTraining,
    /// Adam steps of a training on the QPU (paper: 20).
    pub steps: usize,
    /// Jobs of a leg at most, those of a training not counted.
    pub jobs: usize,
    /// Circuits in each of them, one QAOA round each.
    pub circuits: usize,
    /// Whether the local engine goes on where the QPU gives nothing.
    pub fallback: bool,
}

impl Default for QpuSettings {
    fn default() -> Self {
        Self { training: QpuTraining::Local, steps: 20, jobs: 3, circuits: 6, fallback: true }
    }
}

/// How a leg is planned. The defaults are the paper's table of settings, where it has one.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// What a path keeps from every obstacle and from the fence's edge (paper: 5 m).
    pub buffer: Metres,
    /// Edges of the path, one qubit each (paper: 20). A leg whose candidates have more corners
    /// than fit gets more, where the engine takes them.
    pub qubits: usize,
    /// QAOA layers `p` (paper: 5).
    pub layers: usize,
    /// Adam steps of a full training (paper: 60).
    pub steps: usize,
    /// Adam's learning rate (paper: 0.1).
    pub learning_rate: f64,
    /// Train on the mean of this share of the best measurements instead of ⟨H⟩ (CVaR).
    pub cvar: Option<f64>,
    /// Shots of each run.
    pub shots: u32,
    /// QAOA runs for each leg.
    pub rounds: Rounds,
    /// Seed of everything random.
    pub seed: u64,
    /// Resolution `r` of the candidate grid.
    pub grid: Metres,
    /// Where candidates are looked for.
    pub source: CandidateSource,
    /// Structurally different candidates wanted, the straight line not counted.
    pub candidates: usize,
    /// `λ` of the edge cost `L + λ exp(−d/d_s)`, metres (paper, "Quantum-Assisted Optimization").
    pub lambda: Metres,
    /// Which QAOA engine runs.
    pub engine: EngineChoice,
    /// Whether every round is trained in full from the ramp, as in the paper. Else only the first
    /// is, and later ones carry the angles over and stop when the loss has settled.
    pub full_training: bool,
    /// What the waypoints that are saved by merging corners may cost together, as a share of a
    /// leg's length.
    pub corner_allowance: f64,
    /// Memory that an engine may use, bytes.
    pub memory_limit: u64,
    /// What is different on a QPU.
    pub qpu: QpuSettings,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            buffer: Metres(5.0),
            qubits: 20,
            layers: 5,
            steps: 60,
            learning_rate: 0.1,
            cvar: None,
            shots: 1024,
            rounds: Rounds::Auto,
            seed: 0,
            grid: Metres(5.0),
            source: CandidateSource::Corners,
            candidates: 4,
            lambda: Metres(0.05),
            engine: EngineChoice::Auto,
            full_training: false,
            corner_allowance: WORTH_OF_FEW,
            memory_limit: 4 << 30,
            qpu: QpuSettings::default(),
        }
    }
}

impl Settings {
    /// Precisely the paper's table of settings: 20 qubits, 5 layers, Adam 0.1, 60 steps in every
    /// round, 5 m buffer, step = distance / 20, grid candidates.
    #[must_use]
    pub fn paper() -> Self {
        Self { source: CandidateSource::Grid, full_training: true, ..Self::default() }
    }
}
