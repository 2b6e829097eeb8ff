//! A name for what is asked of a QPU, the same in every run that asks the same.

use sha2::{Digest, Sha256};

use crate::qaoa::qpu::QpuCircuit;

/// 32 hexadecimal digits that stand for the request. Not the circuits' text: that depends on the
/// calibration of the hour, and a job that was paid for is wanted all the same.
pub(super) fn digest(
    backend: &str,
    number: usize,
    circuits: &[QpuCircuit<'_>],
    shots: u32,
) -> String {
    let mut hash = Sha256::new();
    let mut feed = |bytes: &[u8]| {
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(bytes);
    };
    feed(b"quavd job 1");
    feed(backend.as_bytes());
    feed(&(number as u64).to_le_bytes());
    feed(&shots.to_le_bytes());
    for circuit in circuits {
        let numbers = |values: &[f64]| -> Vec<u8> {
            values.iter().flat_map(|value| value.to_bits().to_le_bytes()).collect()
        };
        feed(&numbers(circuit.chain.h()));
        feed(&numbers(circuit.chain.j()));
        feed(&numbers(circuit.angles.gammas()));
        feed(&numbers(circuit.angles.betas()));
    }
    hash.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect()
}
