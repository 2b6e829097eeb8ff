//! The chain seen sideways: vectors over the pair (ket trajectory a, bra trajectory ā) of one site, index
//! `a + 2^p ā`, are carried from site to site. A site multiplies elementwise; a bond with coupling J
//! applies `Π_l e^{−iγ_l J (a_l b_l − ā_l b̄_l)}`, which the Walsh–Hadamard transform makes diagonal.

use num_complex::Complex64;

use super::circuit::Circuit;

/// A vector over trajectory pairs, 4^p entries.
pub(super) type Folded = Vec<Complex64>;

/// In-place Walsh–Hadamard transform, not normalised.
pub(super) fn walsh_hadamard(vector: &mut [Complex64]) {
    let mut half = 1;
    while half < vector.len() {
        for block in vector.chunks_exact_mut(2 * half) {
            let (low, high) = block.split_at_mut(half);
            for (x, y) in low.iter_mut().zip(high) {
                (*x, *y) = (*x + *y, *x - *y);
            }
        }
        half *= 2;
    }
}

/// The tables of one set of angles.
#[derive(Debug, Clone)]
pub(super) struct Transfer {
    pub(super) circuit: Circuit,
    /// Σ_s walk_s(a) walk_s(ā)*: a qubit nobody looks at.
    trace: Folded,
    /// Σ_s z_s walk_s(a) walk_s(ā)*: a qubit whose Z is measured.
    z: Folded,
}

impl Transfer {
    pub(super) fn new(circuit: Circuit) -> Self {
        let outer = |sign: f64| -> Folded {
            let [zero, one] = &circuit.walk;
            let bras = zero.iter().zip(one);
            bras.flat_map(|(zero_bra, one_bra)| {
                zero.iter()
                    .zip(one)
                    .map(move |(z, o)| z * zero_bra.conj() + sign * o * one_bra.conj())
            })
            .collect()
        };
        Self { trace: outer(1.0), z: outer(-1.0), circuit }
    }

    /// 4^p.
    pub(super) fn size(&self) -> usize {
        self.trace.len()
    }

    /// The weights of a site with field `h`: (nobody looks, Z measured).
    pub(super) fn site(&self, h: f64) -> (Folded, Folded) {
        let phases = self.circuit.phases(h);
        let with_phases = |table: &Folded| {
            let rows = table.chunks_exact(phases.len()).zip(&phases);
            rows.flat_map(|(row, bra)| {
                row.iter().zip(&phases).map(move |(weight, ket)| weight * ket * bra.conj())
            })
            .collect()
        };
        (with_phases(&self.trace), with_phases(&self.z))
    }

    /// The bond's eigenvalues in the Walsh–Hadamard basis, normalised for two unnormalised transforms.
    pub(super) fn bond(&self, j: f64) -> Folded {
        let mut ket = vec![Complex64::ONE];
        for gamma in &self.circuit.gammas {
            let (sin, cos) = (gamma * j).sin_cos();
            let odd: Vec<_> = ket.iter().map(|v| v * Complex64::new(0.0, -sin)).collect();
            ket.iter_mut().for_each(|v| *v *= cos);
            ket.extend(odd);
        }
        ket.iter().flat_map(|bra| ket.iter().map(move |v| v * bra.conj())).collect()
    }

    /// Carries a transformed vector over the bond and back out of the Walsh–Hadamard basis.
    pub(super) fn cross(&self, transformed: &Folded, bond: &Folded) -> Folded {
        let mut out: Folded = transformed.iter().zip(bond).map(|(x, d)| x * d).collect();
        walsh_hadamard(&mut out);
        out
    }
}
