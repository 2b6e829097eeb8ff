//! QAOA simulated classically: Ising problems, the engines that run the circuit, and its training.
//!
//! One run goes `ising` (the problem) → `run` (scale, train, sample, certify), which drives an
//! [`engine::Engine`]: `chain` for open chains of any length, `statevector` for every other graph.
//! Everything here is pure: no files, no clock, no network. What a bit *means* for a path is the
//! planner's business and not known here.

pub mod adam;
pub mod angles;
pub mod bits;
pub mod chain;
pub mod cvar;
pub mod engine;
pub mod ising;
pub mod qpu;
pub mod run;
mod simd;
pub mod statevector;
pub mod train;
pub mod viterbi;

pub use angles::Angles;
pub use bits::Bits;
pub use engine::{EngineChoice, EngineError, EngineKind};
pub use ising::{ChainIsing, Ising, IsingError, Scale};
pub use run::{AnglesSource, Qaoa, QaoaRun, RunSettings};
pub use train::{Objective, Settled, TrainSettings};

#[cfg(test)]
mod agreement;
#[cfg(test)]
mod vectors;
