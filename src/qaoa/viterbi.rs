//! The certificate: the exact optimum of an Ising problem by classical means. A chain is solved by
//! dynamic programming (Viterbi) in linear time; any other graph by trying every bitstring, which stops
//! at [`BRUTE_FORCE_QUBITS`]. Its results are shown beside the quantum ones, never in their place.

use super::bits::Bits;
use super::ising::{ChainIsing, Ising};

/// The largest graph that is not a chain whose optimum is looked for: 2²⁴ bitstrings take a fraction of
/// a second.
pub const BRUTE_FORCE_QUBITS: usize = 24;
/// At most this many equally good bitstrings are listed.
pub const MAX_OPTIMA: usize = 64;
/// Energies that differ by less than this, relative to the sum of all coefficients, count as equal.
const TIE: f64 = 1e-11;

/// The lowest energy of a problem and the bitstrings that have it.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimum {
    /// The lowest energy, in the units of the problem.
    pub energy: f64,
    /// The bitstrings with that energy in ascending order, at least one and at most [`MAX_OPTIMA`].
    pub bits: Vec<Bits>,
}

/// The exact optimum, or `None` for a graph that is neither a chain nor small.
#[must_use]
pub fn exact_optimum(ising: &Ising) -> Option<Optimum> {
    match ising.to_chain() {
        Some(chain) => Some(chain_optimum(&chain)),
        None => (ising.qubits() <= BRUTE_FORCE_QUBITS).then(|| brute_force(ising)),
    }
}

/// The exact optimum of a chain, in linear time.
#[must_use]
pub fn chain_optimum(chain: &ChainIsing) -> Optimum {
    let (h, j) = (chain.h(), chain.j());
    let n = chain.qubits();
    let z = |bit: usize| if bit == 0 { 1.0 } else { -1.0 };
    // rest[i][b]: the lowest energy of everything from qubit i on, if qubit i has bit b.
    let mut rest = vec![[0.0; 2]; n];
    for i in (0..n).rev() {
        for bit in 0..2 {
            let ahead = if i + 1 < n { best_next(&rest[i + 1], j[i] * z(bit)) } else { 0.0 };
            rest[i][bit] = h[i] * z(bit) + ahead;
        }
    }
    let lowest = best_next(&rest[0], 0.0);
    let tie = TIE * h.iter().chain(j).map(|v| v.abs()).sum::<f64>();

    // Depth-first through every choice that ties with the lowest, bit 0 first.
    let mut optima = Vec::new();
    let mut bits = Bits::zeros(n);
    let mut open = vec![(0, 1, lowest), (0, 0, lowest)];
    while let Some((i, bit, target)) = open.pop() {
        if optima.len() == MAX_OPTIMA {
            break;
        }
        let coupling = if i == 0 { 0.0 } else { j[i - 1] * bits.z(i - 1) };
        let energy = rest[i][bit] + coupling * z(bit);
        if energy > target + tie {
            continue;
        }
        bits.set(i, bit == 1);
        if i + 1 == n {
            optima.push(bits.clone());
        } else {
            let ahead = best_next(&rest[i + 1], j[i] * z(bit));
            open.extend([(i + 1, 1, ahead), (i + 1, 0, ahead)]);
        }
    }
    Optimum { energy: chain.constant() + lowest, bits: optima }
}

fn best_next(rest: &[f64; 2], coupling: f64) -> f64 {
    (rest[0] + coupling).min(rest[1] - coupling)
}

/// Every bitstring: the high qubits counted, the low ones in Gray-code order so that each step costs one
/// qubit's local field.
fn brute_force(ising: &Ising) -> Optimum {
    let n = ising.qubits();
    let low = n.min(12);
    let mut neighbours = vec![Vec::new(); n];
    for &(i, j, value) in ising.couplings() {
        neighbours[i].push((j, value));
        neighbours[j].push((i, value));
    }
    let magnitudes = ising.h().iter().chain(ising.couplings().iter().map(|c| &c.2));
    let tie = TIE * magnitudes.map(|v| v.abs()).sum::<f64>();
    let mut lowest = f64::INFINITY;
    let mut found: Vec<(usize, f64)> = Vec::new();
    for high in 0..1_usize << (n - low) {
        let mut index = high << low;
        let start = Bits::from_index(n, index);
        let mut z: Vec<f64> = (0..n).map(|qubit| start.z(qubit)).collect();
        let mut energy = ising.energy(&start);
        for step in 1..=1_usize << low {
            if energy < lowest + tie && found.len() < 4 * MAX_OPTIMA || energy < lowest - tie {
                lowest = lowest.min(energy);
                found.retain(|other| other.1 <= lowest + tie);
                found.push((index, energy));
            }
            let flip = step.trailing_zeros() as usize;
            if flip < low {
                let field: f64 = neighbours[flip].iter().map(|&(other, v)| v * z[other]).sum();
                energy -= 2.0 * z[flip] * (ising.h()[flip] + field);
                z[flip] = -z[flip];
                index ^= 1 << flip;
            }
        }
    }
    let mut bits: Vec<Bits> = found.iter().map(|&(index, _)| Bits::from_index(n, index)).collect();
    bits.sort();
    bits.truncate(MAX_OPTIMA);
    let energy = bits.iter().map(|bits| ising.energy(bits)).fold(f64::INFINITY, f64::min);
    Optimum { energy, bits }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn viterbi_finds_what_trying_everything_finds(
            h in prop::collection::vec(-2.0..2.0_f64, 1..10),
            j in prop::collection::vec(-2.0..2.0_f64, 9),
        ) {
            let j = j[..h.len() - 1].to_vec();
            let chain = ChainIsing::new(0.7, h, j).unwrap();
            let (fast, slow) = (chain_optimum(&chain), brute_force(&chain.into()));
            prop_assert!((fast.energy - slow.energy).abs() < 1e-9);
            prop_assert_eq!(fast.bits, slow.bits);
        }
    }

    #[test]
    fn equally_good_bitstrings_are_all_listed_in_order() {
        // A ferromagnet with a free qubit at its end.
        let chain = ChainIsing::new(0.0, vec![0.0; 4], vec![-1.0, -1.0, 0.0]).unwrap();
        let optimum = chain_optimum(&chain);
        let text: Vec<String> = optimum.bits.iter().map(Bits::to_string).collect();
        assert_eq!(text, ["0000", "0001", "1110", "1111"]);
        assert_eq!(optimum, brute_force(&chain.into()));
    }

    #[test]
    fn a_frustrated_ring_is_solved_and_a_large_graph_is_not_tried() {
        let ring = |n: usize| {
            let couplings = (0..n).map(|i| (i, (i + 1) % n, 1.0)).collect();
            Ising::new(0.0, vec![0.0; n], couplings).unwrap()
        };
        let optimum = exact_optimum(&ring(13)).unwrap();
        assert_eq!((optimum.energy, optimum.bits.len()), (-11.0, 26));
        assert_eq!(exact_optimum(&ring(25)), None);
    }

    #[test]
    fn the_list_of_optima_is_bounded() {
        let free = ChainIsing::new(0.0, vec![0.0; 1000], vec![0.0; 999]).unwrap();
        assert_eq!(chain_optimum(&free).bits.len(), MAX_OPTIMA);
    }
}
