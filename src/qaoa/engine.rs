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
}

impl fmt::Display for EngineKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Chain => "chain",
            Self::Statevector => "statevector",
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

/// A name that is no engine.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("there is no engine {0:?}; choose auto, chain or statevector")]
pub struct NoSuchEngine(String);

impl FromStr for EngineChoice {
    type Err = NoSuchEngine;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        match name {
            "auto" => Ok(Self::Auto),
            "chain" => Ok(Self::Only(EngineKind::Chain)),
            "statevector" => Ok(Self::Only(EngineKind::Statevector)),
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
