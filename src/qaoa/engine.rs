//! [`Engine`]: what every way of running the circuit can do, so that training and the planner need not
//! know which one it is.

use std::fmt;
use std::str::FromStr;

use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use super::angles::Angles;
use super::bits::Bits;
use crate::stop::Stopped;

/// Which simulator runs a circuit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EngineKind {
    /// Exact, for open chains; time and memory linear in the number of qubits.
    Chain,
    /// Exact, for any graph; 2ⁿ amplitudes.
    Statevector,
    /// No simulator: an IBM QPU, for open chains.
    Ibm,
}

impl fmt::Display for EngineKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Chain => "chain",
            Self::Statevector => "statevector",
            Self::Ibm => "ibm",
        })
    }
}

/// What a user asks for with `--engine`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EngineChoice {
    /// `chain` for an open chain, `statevector` for everything else.
    #[default]
    Auto,
    /// This one or an error.
    Only(EngineKind),
}

impl EngineChoice {
    /// The most qubits of one run where a chain has more than `preferred`: `chain` is linear in their
    /// number and takes any; on others a window of `preferred` qubits slides along.
    #[must_use]
    pub fn most_qubits(self, preferred: usize) -> usize {
        match self {
            Self::Auto | Self::Only(EngineKind::Chain) => usize::MAX,
            Self::Only(_) => preferred,
        }
    }
}

/// A name that is no engine.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("there is no engine {0:?}; choose auto, chain, statevector or ibm")]
pub struct NoSuchEngine(String);

impl EngineChoice {
    /// Which simulator trains, and runs what a QPU does not.
    #[must_use]
    pub fn local(self) -> Self {
        match self {
            Self::Only(EngineKind::Ibm) => Self::Auto,
            choice => choice,
        }
    }
}

impl FromStr for EngineChoice {
    type Err = NoSuchEngine;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        match name {
            "auto" => Ok(Self::Auto),
            "chain" => Ok(Self::Only(EngineKind::Chain)),
            "statevector" => Ok(Self::Only(EngineKind::Statevector)),
            "ibm" => Ok(Self::Only(EngineKind::Ibm)),
            other => Err(NoSuchEngine(other.into())),
        }
    }
}

/// How often one bitstring was measured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sample {
    /// The bitstring.
    pub bits: Bits,
    /// Shots that gave it, at least 1.
    pub count: u32,
}

/// A circuit that an engine cannot run.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum EngineError {
    /// The chain engine was asked for, but a coupling joins distant qubits.
    #[error(
        "qubits {i} and {j} are coupled, so the problem is no open chain; use --engine statevector"
    )]
    NotAChain {
        /// First qubit.
        i: usize,
        /// Second qubit.
        j: usize,
    },
    /// A QPU was asked for where only simulators run.
    #[error(
        "the ibm engine is no simulator; it runs with quavd plan, once and run, and with quavd ibm run"
    )]
    NoQpu,
    /// The workspace would not fit.
    #[error(
        "the {engine} engine needs {} MiB for {qubits} qubits, but {} MiB are available; use fewer \
         qubits, or fewer layers with the chain engine",
        needed.div_ceil(1 << 20), available >> 20
    )]
    Memory {
        /// Which engine.
        engine: EngineKind,
        /// Number of qubits.
        qubits: usize,
        /// Bytes the workspace takes.
        needed: u64,
        /// Bytes there are.
        available: u64,
    },
    /// More layers than the engine can represent.
    #[error("{layers} layers; the {engine} engine takes at most {limit}")]
    TooManyLayers {
        /// Which engine.
        engine: EngineKind,
        /// Number of layers asked for.
        layers: usize,
        /// The most it takes.
        limit: usize,
    },
    /// The run was called off, or its time is up.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// A bitstring of another length than the problem.
    #[error("a bitstring of {found} bits for {expected} qubits")]
    BitsLength {
        /// Bits given.
        found: usize,
        /// Qubits of the problem.
        expected: usize,
    },
}

/// Runs the QAOA circuit of one Ising problem, exactly.
///
/// Energies and expectations are those of the problem the engine was given, its constant included;
/// callers that scale it scale back themselves ([`super::ising::Scaled`]). Methods take `&mut self`
/// because an engine keeps its workspace from call to call.
pub trait Engine {
    /// Which engine this is.
    fn kind(&self) -> EngineKind;

    /// Number of qubits of the problem.
    fn qubits(&self) -> usize;

    /// ⟨H⟩.
    ///
    /// # Errors
    /// If the circuit has too many layers or does not fit into memory.
    fn expectation(&mut self, angles: &Angles) -> Result<f64, EngineError>;

    /// ⟨H⟩ and its exact derivatives with respect to all 2p angles.
    ///
    /// # Errors
    /// If the circuit has too many layers or does not fit into memory.
    fn expectation_and_gradient(&mut self, angles: &Angles) -> Result<(f64, Angles), EngineError>;

    /// The CVaR objective and its derivatives: the mean energy of the best share `alpha` (above 0, at
    /// most 1) of all measurements. Exact where [`Engine::cvar_is_exact`] says so, and else estimated
    /// from `shots` samples as the module [`super::cvar`] defines it.
    ///
    /// # Errors
    /// If the circuit has too many layers or does not fit into memory.
    fn cvar_and_gradient(
        &mut self,
        angles: &Angles,
        alpha: f64,
        shots: u32,
        rng: &mut ChaCha8Rng,
    ) -> Result<(f64, Angles), EngineError>;

    /// Whether CVaR is exact, without samples.
    fn cvar_is_exact(&self) -> bool;

    /// Measures every qubit `shots` times; distinct bitstrings in ascending order. The same `rng` state
    /// gives the same samples.
    ///
    /// # Errors
    /// If the circuit has too many layers or does not fit into memory.
    fn sample(
        &mut self,
        angles: &Angles,
        shots: u32,
        rng: &mut ChaCha8Rng,
    ) -> Result<Vec<Sample>, EngineError>;

    /// The probability that one measurement gives exactly `bits`.
    ///
    /// # Errors
    /// If the bitstring's length is not the number of qubits, the circuit has too many layers or does
    /// not fit into memory.
    fn probability(&mut self, angles: &Angles, bits: &Bits) -> Result<f64, EngineError>;
}
