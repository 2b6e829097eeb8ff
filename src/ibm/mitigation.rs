//! [`mitigated_expectation`]: the readout errors of each qubit taken out of ⟨H⟩.
//!
//! With P(1|0) = a and P(0|1) = b the mean of what is read of a qubit is `(1 − a − b)⟨Z⟩ + b − a`, so that
//! `(z − b + a)/(1 − a − b)` is read without bias; and as qubits are read independently, so is a product of
//! two of these. A chain's ⟨H⟩ needs nothing else, at any number of qubits.

use super::device::Readout;
use crate::qaoa::ChainIsing;
use crate::qaoa::engine::Sample;

/// A qubit that is read wrongly more often than this in all says too little to divide by.
const MOST_WRONG: f64 = 0.9;

/// ⟨H⟩ of what was read with each qubit's known readout errors taken out, and its standard error, which is
/// a little larger than without. `readout[q]` is qubit q's; `None` counts as perfect.
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
                    Some(r) if r.one_for_zero + r.zero_for_one < MOST_WRONG => {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_read_wrongly_on_average_comes_out_right() {
        // Qubit 0 is |1⟩ and read as 0 in 20 % of the shots, qubit 1 is |0⟩ and read as 1 in 10 %.
        let readout = [(0.05, 0.2), (0.1, 0.3)].map(|(one_for_zero, zero_for_one)| {
            let error = f64::midpoint(one_for_zero, zero_for_one);
            Some(Readout { error, one_for_zero, zero_for_one, length: None })
        });
        let sample = |bits: &str, count| Sample { bits: bits.parse().unwrap(), count };
        let samples = [sample("00", 180), sample("01", 20), sample("10", 720), sample("11", 80)];
        let chain = ChainIsing::new(0.5, vec![1.0, 2.0], vec![-3.0]).unwrap();
        let (expectation, error) = mitigated_expectation(&chain, &samples, &readout);
        assert!((expectation - (0.5 - 1.0 + 2.0 + 3.0)).abs() < 1e-12, "{expectation}");
        assert!(error > 0.0 && error < 0.5);
        let (raw, _) = mitigated_expectation(&chain, &samples, &[None, None]);
        assert!((raw - (0.5 - 0.6 + 1.6 + 3.0 * 0.48)).abs() < 1e-12, "{raw}");
    }
}
