//! The engine for any 2-local Ising problem: all 2ⁿ amplitudes.
//!
//! A layer is two passes over memory, in place and on parts that fit into cache (`layout`): the
//! Walsh–Hadamard transform of one half of the qubits, the diagonal factor that meets there (the phase of
//! the energies for plain amplitudes, the mixer's eigenvalues for transformed ones), and the transform
//! back (`walsh`, `energies`, `kernels`). `evolution` strings the passes together, on all threads of the
//! current rayon pool; results do not depend on their number.

mod energies;
mod evolution;
mod kernels;
mod layout;
mod vector;
mod walsh;

use std::collections::BTreeMap;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::angles::Angles;
use super::bits::Bits;
use super::cvar::Tail;
use super::engine::{Engine, EngineError, EngineKind, Sample};
use super::ising::Ising;
use evolution::State;
use layout::Layout;

/// Rows and tiles in work on all threads.
const WORKSPACE_BYTES: u64 = 16 << 20;

/// The numbers that amplitudes are made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// `f64`.
    #[default]
    Double,
    /// `f32`: half the memory, about six digits.
    Single,
}

/// The statevector engine with its problem and workspace.
#[derive(Debug)]
pub struct StatevectorEngine {
    qubits: usize,
    state: Box<dyn State>,
    /// The circuit whose final state is held.
    held: Option<Angles>,
}

impl StatevectorEngine {
    /// An engine for `ising` that may use `memory_limit` bytes.
    ///
    /// # Errors
    /// If the state does not fit; nothing has been allocated then.
    pub fn new(
        ising: &Ising,
        precision: Precision,
        memory_limit: u64,
    ) -> Result<Self, EngineError> {
        let qubits = ising.qubits();
        let needed = Self::memory(qubits, precision);
        if needed > memory_limit {
            return Err(EngineError::Memory {
                engine: EngineKind::Statevector,
                qubits,
                needed,
                available: memory_limit,
            });
        }
        let state = match precision {
            Precision::Double => evolution::in_doubles(ising),
            Precision::Single => evolution::in_singles(ising),
        };
        Ok(Self { qubits, state, held: None })
    }

    /// Bytes needed for `qubits`: the state and its adjoint, and a little for rows and tiles.
    #[must_use]
    pub fn memory(qubits: usize, precision: Precision) -> u64 {
        let bytes = match precision {
            Precision::Double => 16,
            Precision::Single => 8,
        };
        Layout::amplitudes(qubits).saturating_mul(2 * bytes).saturating_add(WORKSPACE_BYTES)
    }

    fn hold(&mut self, angles: &Angles) {
        if self.held.as_ref() != Some(angles) {
            self.state.run(angles);
            self.held = Some(angles.clone());
        }
    }
}

impl Engine for StatevectorEngine {
    fn kind(&self) -> EngineKind {
        EngineKind::Statevector
    }

    fn qubits(&self) -> usize {
        self.qubits
    }

    fn expectation(&mut self, angles: &Angles) -> Result<f64, EngineError> {
        self.hold(angles);
        Ok(self.state.energy())
    }

    fn expectation_and_gradient(&mut self, angles: &Angles) -> Result<(f64, Angles), EngineError> {
        self.held = None;
        Ok(self.state.gradient(angles, None))
    }

    fn cvar_and_gradient(
        &mut self,
        angles: &Angles,
        alpha: f64,
        _shots: u32,
        _rng: &mut ChaCha8Rng,
    ) -> Result<(f64, Angles), EngineError> {
        self.hold(angles);
        let quantile = self.state.quantile(alpha);
        self.held = None;
        let tail = Some(Tail { alpha, quantile });
        Ok(self.state.gradient(angles, tail))
    }

    fn cvar_is_exact(&self) -> bool {
        true
    }

    fn sample(
        &mut self,
        angles: &Angles,
        shots: u32,
        rng: &mut ChaCha8Rng,
    ) -> Result<Vec<Sample>, EngineError> {
        self.hold(angles);
        let mut draws: Vec<f64> = (0..shots).map(|_| rng.random()).collect();
        draws.sort_by(f64::total_cmp);
        // Rounding may leave the sum of all probabilities a little off 1.
        let total: f64 =
            (0..self.state.basis_states()).map(|index| self.state.probability(index)).sum();
        let mask = (1_usize << self.qubits) - 1;
        let mut counts = BTreeMap::new();
        let (mut reached, mut index, mut likely) = (self.state.probability(0), 0, 0);
        for draw in draws {
            while reached <= draw * total && index + 1 < self.state.basis_states() {
                index += 1;
                let probability = self.state.probability(index);
                reached += probability;
                if probability > 0.0 {
                    likely = index;
                }
            }
            *counts.entry(Bits::from_index(self.qubits, likely & mask)).or_insert(0) += 1;
        }
        Ok(counts.into_iter().map(|(bits, count)| Sample { bits, count }).collect())
    }

    fn probability(&mut self, angles: &Angles, bits: &Bits) -> Result<f64, EngineError> {
        let (found, expected) = (bits.len(), self.qubits);
        if found != expected {
            return Err(EngineError::BitsLength { found, expected });
        }
        self.hold(angles);
        let index =
            bits.iter().enumerate().map(|(qubit, bit)| usize::from(bit) << qubit).sum::<usize>();
        let dummies = self.state.basis_states() >> self.qubits;
        Ok((0..dummies).map(|dummy| self.state.probability(index | dummy << self.qubits)).sum())
    }
}
