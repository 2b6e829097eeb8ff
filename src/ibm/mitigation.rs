//! Readout errors taken out of an expectation.

use super::device::Readout;
use crate::qaoa::ChainIsing;
use crate::qaoa::engine::Sample;

/// ⟨H⟩ of what was read with each qubit's known readout errors taken out, and its standard error.
#[must_use]
pub fn mitigated_expectation(
    chain: &ChainIsing,
    samples: &[Sample],
    readout: &[Option<Readout>],
) -> (f64, f64) {
    let shots: f64 = samples.iter().map(|sample| f64::from(sample.count)).sum();
    let energy = |sample: &Sample| {
        let z: Vec<f64> = (0..chain.qubits())
            .map(|qubit| {
                let read = sample.bits.z(qubit);
                match readout.get(qubit).copied().flatten() {
                    Some(r) if r.one_for_zero + r.zero_for_one < 0.9 => {
                        (read + r.one_for_zero - r.zero_for_one)
                            / (1.0 - r.one_for_zero - r.zero_for_one)
                    }
                    _ => read,
                }
            })
            .collect();
        let fields: f64 = chain.h().iter().zip(&z).map(|(h, z)| h * z).sum();
        let bonds: f64 = chain.j().iter().zip(z.windows(2)).map(|(j, z)| j * z[0] * z[1]).sum();
        chain.constant() + fields + bonds
    };
    let energies: Vec<(f64, f64)> =
        samples.iter().map(|sample| (energy(sample), f64::from(sample.count))).collect();
    let mean = energies.iter().map(|(e, count)| e * count).sum::<f64>() / shots;
    let squares = energies.iter().map(|(e, count)| (e - mean).powi(2) * count).sum::<f64>();
    (mean, (squares / shots).sqrt() / shots.sqrt())
}
