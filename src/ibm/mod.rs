//! QAOA on IBM's QPUs.
//!
//! The pure half, which does no I/O: [`device`] is what IBM says about one QPU ([`snapshot`] reads it
//! from the two REST documents), [`line`](mod@line) the physical qubits a chain is laid on, [`circuit`] native
//! gates on them, [`lower`] the way from an Ising chain to such a circuit, and `qasm` its text ([`Circuit::to_qasm`]).

mod builder;
pub mod circuit;
pub mod device;
#[cfg(test)]
mod fidelity;
pub mod line;
pub mod lower;
pub mod metrics;
mod qasm;
#[cfg(test)]
mod samples;
mod segments;
#[cfg(test)]
mod simulate;
pub mod snapshot;
mod turns;

pub use circuit::{Angle, Circuit, Gate, Parameter};
pub use device::{Device, Entangler, Native, PhysicalQubit};
pub use line::{Line, LineError};
pub use lower::{Binding, LowerError, choose_line, lower, lower_on};
pub use metrics::Metrics;
pub use snapshot::DeviceError;
