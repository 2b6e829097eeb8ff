//! QAOA on IBM's QPUs.
//!
//! The pure half, which does no I/O: [`device`] is what IBM says about one QPU ([`snapshot`] reads it
//! from the two REST documents), [`line`](mod@line) the physical qubits a chain is laid on, [`circuit`] native
//! gates on them, [`lower`](mod@lower) the way from an Ising chain to such a circuit, and `qasm` its text
//! ([`Circuit::to_qasm`]). Of what was measured, [`mitigation`] takes readout errors out of expectations, and
//! [`unfolding`] out of the probabilities of bitstrings.
//!
//! The half that talks to the service: [`account`] says who pays ([`secret`]), [`client`] speaks the REST
//! API, [`program`] is what a job holds and how its results are read, [`duration`] how long it takes,
//! [`ledger`] the jobs on disk, and [`qpu`] all of it as a [`Qpu`](crate::qaoa::qpu::Qpu);
//! [`error`](mod@error) says what went wrong and what to do.

pub mod account;
mod builder;
pub mod circuit;
pub mod client;
pub mod device;
mod digest;
pub mod duration;
pub mod error;
#[cfg(test)]
mod fidelity;
mod interrupted;
pub mod ledger;
pub mod line;
pub mod lower;
pub mod metrics;
pub mod mitigation;
pub mod program;
mod qasm;
pub mod qpu;
#[cfg(test)]
mod samples;
pub mod secret;
mod segments;
#[cfg(test)]
mod simulate;
pub mod snapshot;
mod turns;
pub mod unfolding;

pub use circuit::{Angle, Circuit, Gate, Parameter};
pub use device::{Device, Entangler, Native, PhysicalQubit};
pub use line::{Line, LineError};
pub use lower::{Binding, LowerError, choose_line, lower, lower_on};
pub use metrics::Metrics;
pub use snapshot::DeviceError;
