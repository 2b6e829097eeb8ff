//! The exact engine for open chains, linear in the number of qubits.
//!
//! The p layers make the state a matrix-product state whose bond index is a qubit's trajectory through
//! the layers. `circuit` holds the amplitudes of one qubit's trajectories, `transfer` carries folded
//! (ket and bra) vectors along the chain, `gradient` makes ⟨H⟩ and its derivatives out of them, and
//! `sampling` draws bitstrings and evaluates their probability.

mod circuit;
mod gradient;
mod sampling;
mod transfer;

use rand_chacha::ChaCha8Rng;

use super::angles::Angles;
use super::bits::Bits;
use super::engine::{Engine, EngineError, EngineKind, Sample};
use super::ising::ChainIsing;
use circuit::Circuit;
use transfer::Transfer;

/// More layers than this would take hours; the workspace grows with 4^p.
pub const MAX_LAYERS: usize = 8;

/// The chain engine with its problem and workspace.
#[derive(Debug, Clone)]
pub struct ChainEngine {
    chain: ChainIsing,
    memory_limit: u64,
}

impl ChainEngine {
    /// An engine for `chain` that may use `memory_limit` bytes.
    #[must_use]
    pub fn new(chain: ChainIsing, memory_limit: u64) -> Self {
        Self { chain, memory_limit }
    }

    /// Takes another problem and keeps the workspace.
    pub fn set_problem(&mut self, chain: ChainIsing) {
        self.chain = chain;
    }

    /// Bytes of workspace for a chain of `qubits` and a circuit of `layers`.
    #[must_use]
    pub fn memory(qubits: usize, layers: usize) -> u64 {
        let vectors = (qubits as u64).saturating_mul(6).saturating_add(32);
        vectors
            .saturating_mul(16)
            .saturating_mul(1_u64.checked_shl(2 * layers as u32).unwrap_or(u64::MAX))
    }

    fn transfer(&self, angles: &Angles) -> Result<Transfer, EngineError> {
        let (qubits, layers) = (self.chain.qubits(), angles.layers());
        let engine = EngineKind::Chain;
        if layers > MAX_LAYERS {
            return Err(EngineError::TooManyLayers { engine, layers, limit: MAX_LAYERS });
        }
        let (needed, available) = (Self::memory(qubits, layers), self.memory_limit);
        if needed > available {
            return Err(EngineError::Memory { engine, qubits, layers, needed, available });
        }
        Ok(Transfer::new(Circuit::new(angles)))
    }
}

impl Engine for ChainEngine {
    fn kind(&self) -> EngineKind {
        EngineKind::Chain
    }

    fn qubits(&self) -> usize {
        self.chain.qubits()
    }

    fn expectation(&mut self, angles: &Angles) -> Result<f64, EngineError> {
        Ok(gradient::expectation(&self.transfer(angles)?, &self.chain))
    }

    fn expectation_and_gradient(&mut self, angles: &Angles) -> Result<(f64, Angles), EngineError> {
        Ok(gradient::expectation_and_gradient(&self.transfer(angles)?, &self.chain))
    }

    fn sample(
        &mut self,
        angles: &Angles,
        shots: u32,
        rng: &mut ChaCha8Rng,
    ) -> Result<Vec<Sample>, EngineError> {
        let transfer = self.transfer(angles)?;
        let norms = gradient::right_norms(&transfer, &self.chain);
        Ok(sampling::sample(&transfer.circuit, &self.chain, &norms, shots, rng))
    }

    fn probability(&mut self, angles: &Angles, bits: &Bits) -> Result<f64, EngineError> {
        let (found, expected) = (bits.len(), self.chain.qubits());
        if found != expected {
            return Err(EngineError::BitsLength { found, expected });
        }
        Ok(sampling::probability(&self.transfer(angles)?.circuit, &self.chain, bits))
    }
}
