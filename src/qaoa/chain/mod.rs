//! The exact engine for open chains, linear in the number of qubits.
//!
//! What a qubit knows of its neighbours is its Z value during each phase layer, its *trajectory*, once
//! for the ket and once for the bra: 4^p numbers carry everything along the chain that an expectation
//! needs. `folded` stores such vectors and takes them over a bond, `site` has the weights of one qubit,
//! `sweep` steps from site to site, and `gradient` makes ⟨H⟩ and all derivatives out of a sweep from
//! each end. For bitstrings the ket's 2^p amplitudes are enough: `circuit` has them for one qubit,
//! `norms` what lies to the right, `prefixes` carries them
//! from qubit to qubit, and `sampling` draws from all that; `score` says how a bitstring's probability
//! changes with the angles.

mod circuit;
mod folded;
mod gradient;
mod norms;
mod prefixes;
mod sampling;
mod score;
mod site;
mod sweep;

use rand_chacha::ChaCha8Rng;

use super::angles::Angles;
use super::bits::Bits;
use super::cvar;
use super::engine::{Engine, EngineError, EngineKind, Sample};
use super::ising::{ChainIsing, Ising};
use super::simd;
use circuit::Circuit;
use gradient::{Expectation, Gradient, WINDOW};
use norms::Norms;
use sampling::{Draw, Probability};
use score::Scores;
use site::{MIN_LAYERS, Mixers};
use sweep::{SIDE_SLABS, SPECTRUM_SLABS, Workspace};

/// More layers than this would take hours; the workspace grows with 4^p.
pub const MAX_LAYERS: usize = 8;

/// The chain engine with its problem and workspace.
#[derive(Debug, Clone)]
pub struct ChainEngine {
    chain: ChainIsing,
    memory_limit: u64,
    workspace: Workspace,
}

impl ChainEngine {
    /// An engine for `chain` that may use `memory_limit` bytes.
    #[must_use]
    pub fn new(chain: ChainIsing, memory_limit: u64) -> Self {
        Self { chain, memory_limit, workspace: Workspace::default() }
    }

    /// Takes another problem and keeps the workspace.
    pub fn set_problem(&mut self, chain: ChainIsing) {
        self.chain = chain;
    }

    /// Bytes of workspace for a chain of `qubits` and a circuit of `layers`.
    #[must_use]
    pub fn memory(qubits: usize, layers: usize) -> u64 {
        let inner = layers.max(MIN_LAYERS) as u32 - 1;
        let slab = 8_u64.saturating_mul(1_u64.checked_shl(2 * inner).unwrap_or(u64::MAX));
        let per_site = (SIDE_SLABS + SPECTRUM_SLABS) as u64;
        let kept = gradient::window_sites(WINDOW, qubits, layers.max(MIN_LAYERS)) as u64;
        // The gradient's window; sampling keeps two slabs of every site.
        let slabs = per_site.saturating_mul(kept).max((qubits as u64).saturating_mul(2));
        slab.saturating_mul(slabs.saturating_add(64))
    }

    fn mixers(&self, angles: &Angles) -> Result<Mixers, EngineError> {
        let (qubits, layers) = (self.chain.qubits(), angles.layers());
        let engine = EngineKind::Chain;
        if layers > MAX_LAYERS {
            return Err(EngineError::TooManyLayers { engine, layers, limit: MAX_LAYERS });
        }
        let (needed, available) = (Self::memory(qubits, layers), self.memory_limit);
        if needed > available {
            return Err(EngineError::Memory { engine, qubits, needed, available });
        }
        Ok(Mixers::new(angles))
    }
}

/// The derivatives of the circuit's own layers, which come last.
fn without_padding(padded: &Angles, layers: usize) -> Angles {
    let padding = padded.layers() - layers;
    let mut own = Angles::zeros(layers);
    own.gammas_mut().copy_from_slice(&padded.gammas()[padding..]);
    own.betas_mut().copy_from_slice(&padded.betas()[padding..]);
    own
}

impl Engine for ChainEngine {
    fn kind(&self) -> EngineKind {
        EngineKind::Chain
    }

    fn qubits(&self) -> usize {
        self.chain.qubits()
    }

    fn expectation(&mut self, angles: &Angles) -> Result<f64, EngineError> {
        let mixers = &self.mixers(angles)?;
        let Self { chain, workspace, .. } = self;
        Ok(simd::run(Expectation { chain, mixers, workspace }))
    }

    fn expectation_and_gradient(&mut self, angles: &Angles) -> Result<(f64, Angles), EngineError> {
        let mixers = &self.mixers(angles)?;
        let Self { chain, workspace, .. } = self;
        let (expectation, padded) =
            simd::run(Gradient { chain, mixers, workspace, window: WINDOW });
        Ok((expectation, without_padding(&padded, angles.layers())))
    }

    fn cvar_and_gradient(
        &mut self,
        angles: &Angles,
        alpha: f64,
        shots: u32,
        rng: &mut ChaCha8Rng,
    ) -> Result<(f64, Angles), EngineError> {
        let samples = self.sample(angles, shots, rng)?;
        let mixers = self.mixers(angles)?;
        let circuit = Circuit::new(&mixers);
        let scores = Scores::new(&self.chain, &circuit, &mixers.betas);
        let ising = Ising::from(self.chain.clone());
        let (layers, padded) = (angles.layers(), mixers.betas.len());
        let (value, gradient) = cvar::estimate(
            &samples,
            alpha,
            padded,
            |bits| ising.energy(bits),
            |bits| scores.score(bits),
        );
        Ok((value, without_padding(&gradient, layers)))
    }

    fn cvar_is_exact(&self) -> bool {
        false
    }

    fn sample(
        &mut self,
        angles: &Angles,
        shots: u32,
        rng: &mut ChaCha8Rng,
    ) -> Result<Vec<Sample>, EngineError> {
        let mixers = &self.mixers(angles)?;
        let Self { chain, workspace, .. } = self;
        let norms = simd::run(Norms { chain, mixers, workspace });
        let circuit = Circuit::new(mixers);
        Ok(simd::run(Draw { circuit: &circuit, chain, right_norms: &norms, shots, rng }))
    }

    fn probability(&mut self, angles: &Angles, bits: &Bits) -> Result<f64, EngineError> {
        let (found, expected) = (bits.len(), self.chain.qubits());
        if found != expected {
            return Err(EngineError::BitsLength { found, expected });
        }
        let circuit = Circuit::new(&self.mixers(angles)?);
        Ok(simd::run(Probability { circuit: &circuit, chain: &self.chain, bits }))
    }
}
