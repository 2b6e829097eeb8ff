//! [`unfolded`]: the probabilities of the bitstrings that a QPU gave, with each qubit's readout errors taken
//! out, to rank them by.
//!
//! The readout errors of n qubits are a 2ⁿ × 2ⁿ matrix, the tensor product of n small ones. It is only
//! needed between bitstrings that were seen, and there only where few bits differ (as in M3; Nation et
//! al., PRX Quantum 2, 040326). Where inverting it would give negative probabilities,
//! expectation-maximisation gives the likeliest non-negative ones: with `q` the frequencies that were
//! read and `A[y][x]` the probability to read y for x, `p[x] ← p[x] Σ_y A[y][x] q[y] / (A p)[y]`.

use super::device::Readout;
use crate::qaoa::engine::Sample;

/// Pairs of bitstrings that differ in more bits are taken to never be read for each other.
const MAX_DISTANCE: u32 = 3;
/// Rounds of expectation-maximisation at most.
const MAX_ROUNDS: usize = 1_000;
/// The change of any probability below which it has settled.
const SETTLED: f64 = 1e-9;

/// One probability per sample, adding up to 1; empty without samples. `readout[q]` is qubit q's, `None`
/// where it is not known and is taken to be perfect. Memory and time grow with the square of the number
/// of distinct bitstrings.
#[must_use]
pub fn unfolded(samples: &[Sample], readout: &[Option<Readout>]) -> Vec<f64> {
    let shots: f64 = samples.iter().map(|sample| f64::from(sample.count)).sum();
    let read: Vec<f64> = samples.iter().map(|sample| f64::from(sample.count) / shots).collect();
    let rows = confusion(samples, readout);
    let mut probabilities = read.clone();
    for _ in 0..MAX_ROUNDS {
        let mut next = vec![0.0; samples.len()];
        for (row, &frequency) in rows.iter().zip(&read) {
            let expected: f64 = row.iter().map(|&(x, chance)| chance * probabilities[x]).sum();
            if expected > 0.0 {
                for &(x, chance) in row {
                    next[x] += chance * probabilities[x] * frequency / expected;
                }
            }
        }
        let total: f64 = next.iter().sum();
        next.iter_mut().for_each(|probability| *probability /= total);
        let changes = next.iter().zip(&probabilities).map(|(new, old)| (new - old).abs());
        let change = changes.fold(0.0, f64::max);
        probabilities = next;
        if change < SETTLED {
            break;
        }
    }
    probabilities
}

/// For each bitstring y: the bitstrings x that may have been read as y, and how likely each is to be. What
/// one x is read as adds up to 1 over the bitstrings that were seen.
fn confusion(samples: &[Sample], readout: &[Option<Readout>]) -> Vec<Vec<(usize, f64)>> {
    let qubits = samples.first().map_or(0, |sample| sample.bits.len());
    let packed: Vec<Vec<u64>> = samples
        .iter()
        .map(|sample| {
            let mut words = vec![0_u64; qubits.div_ceil(64)];
            sample.bits.iter().enumerate().filter(|&(_, bit)| bit).for_each(|(qubit, _)| {
                words[qubit / 64] |= 1 << (qubit % 64);
            });
            words
        })
        .collect();
    let chance = |qubit: usize, truth: bool, flips: bool| {
        let wrong =
            readout.get(qubit).copied().flatten().map_or(0.0, |readout| {
                if truth { readout.zero_for_one } else { readout.one_for_zero }
            });
        if flips { wrong } else { 1.0 - wrong }
    };
    let mut columns = vec![0.0; samples.len()];
    let mut rows: Vec<Vec<(usize, f64)>> = packed
        .iter()
        .enumerate()
        .map(|(y, read)| {
            let near = packed.iter().enumerate().filter(|(_, truth)| {
                let differing = read.iter().zip(*truth).map(|(a, b)| (a ^ b).count_ones());
                differing.sum::<u32>() <= MAX_DISTANCE
            });
            near.map(|(x, _)| {
                let (read, truth) = (&samples[y].bits, &samples[x].bits);
                let product: f64 = (0..qubits)
                    .map(|qubit| {
                        let bit = truth.get(qubit);
                        chance(qubit, bit, bit != read.get(qubit))
                    })
                    .product();
                columns[x] += product;
                (x, product)
            })
            .collect()
        })
        .collect();
    for (x, chance) in rows.iter_mut().flatten() {
        *chance /= columns[*x].max(f64::MIN_POSITIVE);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::qaoa::Bits;

    fn readout(one_for_zero: f64, zero_for_one: f64) -> Option<Readout> {
        let error = (one_for_zero + zero_for_one) / 2.0;
        Some(Readout { error, one_for_zero, zero_for_one, length: None })
    }

    /// What would be read, exactly, as counts of many shots.
    fn read(truth: &[f64], readout: &[Option<Readout>]) -> Vec<Sample> {
        let qubits = readout.len();
        (0..truth.len())
            .map(|y| {
                let chance: f64 = truth
                    .iter()
                    .enumerate()
                    .map(|(x, p)| {
                        let flips = (0..qubits).map(|qubit| {
                            let (bit, seen) = (x >> qubit & 1 == 1, y >> qubit & 1 == 1);
                            let readout = readout[qubit].unwrap();
                            let wrong =
                                if bit { readout.zero_for_one } else { readout.one_for_zero };
                            if bit == seen { 1.0 - wrong } else { wrong }
                        });
                        p * flips.product::<f64>()
                    })
                    .sum();
                let count = (chance * 4e9).round() as u32;
                Sample { bits: Bits::from_index(qubits, y), count }
            })
            .collect()
    }

    #[test]
    fn what_was_read_is_turned_back_into_what_was_there() {
        let readout = [readout(0.03, 0.08), readout(0.002, 0.01), readout(0.1, 0.05)];
        let truth = [0.4, 0.0, 0.05, 0.2, 0.0, 0.1, 0.0, 0.25];
        let samples = read(&truth, &readout);
        let worst =
            |found: &[f64]| found.iter().zip(truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let shots: f64 = samples.iter().map(|sample| f64::from(sample.count)).sum();
        let raw: Vec<f64> = samples.iter().map(|s| f64::from(s.count) / shots).collect();
        assert!(worst(&raw) > 0.03);
        assert!(worst(&unfolded(&samples, &readout)) < 1e-4);
    }

    #[test]
    fn a_bitstring_that_is_another_ones_misreading_loses_its_rank() {
        // 11 is read as 01 a quarter of the time; 01 itself is never there, 00 is.
        let readout = [readout(0.01, 0.25), readout(0.01, 0.01)];
        let truth = [0.18, 0.0, 0.0, 0.82];
        let samples = read(&truth, &readout);
        let index = |text: &str| {
            let bits: Bits = text.parse().unwrap();
            samples.iter().position(|sample| sample.bits == bits).unwrap()
        };
        let (misread, rare) = (index("01"), index("00"));
        assert!(samples[misread].count > samples[rare].count);
        let found = unfolded(&samples, &readout);
        assert!(found[misread] < found[rare] && (found[rare] - 0.18).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn without_errors_or_samples_nothing_changes() {
        assert!(unfolded(&[], &[]).is_empty());
        let sample = |text: &str, count| Sample { bits: text.parse().unwrap(), count };
        let samples = [sample("00", 1), sample("01", 3), sample("11", 4)];
        assert_eq!(unfolded(&samples, &[None, None]), [0.125, 0.375, 0.5]);
    }
}
