//! ⟨H⟩ and all its derivatives from one sweep from the right end and one from the left.

use num_complex::Complex64;

use super::super::angles::Angles;
use super::super::ising::ChainIsing;
use super::transfer::{Folded, Transfer, walsh_hadamard};

/// Everything to one side of a site, as the site sees it.
#[derive(Debug, Clone)]
pub(super) struct Side {
    /// Nobody looks at that side.
    pub(super) norm: Folded,
    /// The energy of that side.
    energy: Folded,
    /// The coupling to this site, times Z of the neighbour.
    pull: Folded,
}

/// The three vectors of a site and all to one side of it, transformed for the bond on its other side.
#[derive(Debug, Clone)]
struct Crossing {
    norm: Folded,
    z: Folded,
    energy: Folded,
}

impl Side {
    fn end(size: usize) -> Self {
        Self {
            norm: vec![Complex64::ONE; size],
            energy: vec![Complex64::ZERO; size],
            pull: vec![Complex64::ZERO; size],
        }
    }

    fn through_site(&self, (trace, z): &(Folded, Folded), h: f64) -> Crossing {
        let mut crossing = Crossing {
            norm: trace.iter().zip(&self.norm).map(|(s, v)| s * v).collect(),
            z: z.iter().zip(&self.norm).map(|(s, v)| s * v).collect(),
            energy: (0..trace.len())
                .map(|x| trace[x] * self.energy[x] + z[x] * (h * self.norm[x] + self.pull[x]))
                .collect(),
        };
        walsh_hadamard(&mut crossing.norm);
        walsh_hadamard(&mut crossing.z);
        walsh_hadamard(&mut crossing.energy);
        crossing
    }
}

impl Crossing {
    fn over_bond(&self, transfer: &Transfer, j: f64) -> Side {
        let bond = transfer.bond(j);
        let mut pull = transfer.cross(&self.z, &bond);
        pull.iter_mut().for_each(|v| *v *= j);
        Side {
            norm: transfer.cross(&self.norm, &bond),
            energy: transfer.cross(&self.energy, &bond),
            pull,
        }
    }
}

/// What each site sees to its right when nobody looks there, for sampling.
pub(super) fn right_norms(transfer: &Transfer, chain: &ChainIsing) -> Vec<Folded> {
    let n = chain.qubits();
    let mut norms = vec![vec![Complex64::ONE; transfer.size()]];
    for i in (1..n).rev() {
        let (trace, _) = transfer.site(chain.h()[i]);
        let last = norms.last().into_iter().flatten();
        let mut vector: Folded = last.zip(&trace).map(|(v, s)| v * s).collect();
        walsh_hadamard(&mut vector);
        norms.push(transfer.cross(&vector, &transfer.bond(chain.j()[i - 1])));
    }
    norms.reverse();
    norms
}

/// ⟨H⟩.
pub(super) fn expectation(transfer: &Transfer, chain: &ChainIsing) -> f64 {
    let mut left = Side::end(transfer.size());
    for (i, &h) in chain.h().iter().enumerate() {
        let crossing = left.through_site(&transfer.site(h), h);
        let Some(&j) = chain.j().get(i) else {
            return chain.constant() + crossing.energy[0].re;
        };
        left = crossing.over_bond(transfer, j);
    }
    chain.constant()
}

/// ⟨H⟩ and its derivatives.
pub(super) fn expectation_and_gradient(transfer: &Transfer, chain: &ChainIsing) -> (f64, Angles) {
    let (n, size) = (chain.qubits(), transfer.size());
    let circuit = &transfer.circuit;
    let mut gradient = Angles::zeros(circuit.layers);

    let mut rights = vec![Side::end(size)];
    let mut crossings = Vec::new();
    for i in (1..n).rev() {
        let crossing = rights[n - 1 - i].through_site(&transfer.site(chain.h()[i]), chain.h()[i]);
        rights.push(crossing.over_bond(transfer, chain.j()[i - 1]));
        crossings.push(crossing);
    }

    let mut expectation = chain.constant();
    let mut left = Side::end(size);
    // Σ over sites of everything but the site's own weights, for the derivatives of those.
    let mut trace_dual = vec![Complex64::ZERO; size];
    let mut z_dual = vec![Complex64::ZERO; size];
    let mut field_dual = vec![0.0; size];
    for i in 0..n {
        let h = chain.h()[i];
        let site = transfer.site(h);
        let right = &rights[n - 1 - i];
        let phases = circuit.phases(h);
        for x in 0..size {
            let phase = phases[x % phases.len()] * phases[x / phases.len()].conj();
            let trace = left.energy[x] * right.norm[x] + left.norm[x] * right.energy[x];
            let z =
                (h * left.norm[x] + left.pull[x]) * right.norm[x] + left.norm[x] * right.pull[x];
            trace_dual[x] += phase * trace;
            z_dual[x] += phase * z;
            field_dual[x] += h * (site.0[x] * trace + site.1[x] * z).im;
        }
        let crossing = left.through_site(&site, h);
        let Some(&j) = chain.j().get(i) else {
            expectation += crossing.energy[0].re;
            break;
        };
        let other = &crossings[n - 2 - i];
        let spectrum: Folded = (0..size)
            .map(|k| {
                crossing.energy[k] * other.norm[k]
                    + crossing.norm[k] * other.energy[k]
                    + j * crossing.z[k] * other.z[k]
            })
            .collect();
        bond_gradient(transfer, j, spectrum, gradient.gammas_mut());
        left = crossing.over_bond(transfer, j);
    }
    site_gradient(transfer, &trace_dual, &z_dual, &field_dual, &mut gradient);
    (expectation, gradient)
}

/// The part of ∂/∂γ that comes from one bond, by collapsing its spectrum layer by layer.
fn bond_gradient(transfer: &Transfer, j: f64, mut spectrum: Folded, slopes: &mut [f64]) {
    let layers = slopes.len();
    let angles = transfer.circuit.gammas.iter().map(|gamma| (gamma * j).sin_cos());
    let factors: Vec<_> = angles.collect();
    // Layer by layer from the last: contract it with its derivative and all others with themselves.
    for layer in (0..layers).rev() {
        let (sin, cos) = factors[layer];
        let value = [Complex64::new(cos, 0.0), Complex64::new(0.0, -sin)];
        let slope = [Complex64::new(-sin * j, 0.0), Complex64::new(0.0, -cos * j)];
        let half = 1 << layer;
        let at = |ket: usize, bra: usize, k: usize| {
            let (low_ket, low_bra) = (k % half, k / half);
            spectrum[low_ket + ket * half + (low_bra + bra * half) * 2 * half]
        };
        let mut derived = vec![Complex64::ZERO; half * half];
        let mut kept = vec![Complex64::ZERO; half * half];
        for k in 0..half * half {
            for (ket, bra) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let entry = at(ket, bra, k);
                kept[k] += value[ket] * value[bra].conj() * entry;
                derived[k] +=
                    (slope[ket] * value[bra].conj() + value[ket] * slope[bra].conj()) * entry;
            }
        }
        for &(sin, cos) in factors[..layer].iter().rev() {
            let half = (derived.len() as f64).sqrt() as usize / 2;
            let value = [Complex64::new(cos, 0.0), Complex64::new(0.0, -sin)];
            derived = (0..half * half)
                .map(|k| {
                    let base = k % half + k / half * 2 * half;
                    value[0] * value[0].conj() * derived[base]
                        + value[1] * value[0].conj() * derived[base + half]
                        + value[0] * value[1].conj() * derived[base + 2 * half * half]
                        + value[1] * value[1].conj() * derived[base + half + 2 * half * half]
                })
                .collect();
        }
        slopes[layer] += derived[0].re;
        spectrum = kept;
    }
}

fn site_gradient(
    transfer: &Transfer,
    trace_dual: &Folded,
    z_dual: &Folded,
    field_dual: &[f64],
    gradient: &mut Angles,
) {
    let circuit = &transfer.circuit;
    let width = circuit.trajectories();
    for layer in 0..circuit.layers {
        let z = |a: usize| if a >> layer & 1 == 0 { 1.0 } else { -1.0 };
        let differences = (0..field_dual.len()).map(|x| z(x % width) - z(x / width));
        gradient.gammas_mut()[layer] +=
            differences.zip(field_dual).map(|(difference, dual)| difference * dual).sum::<f64>();
    }
    for (bit, sign) in [(0, 1.0), (1, -1.0)] {
        let walk = &circuit.walk[bit];
        let seen: Vec<Complex64> = (0..width)
            .map(|a| {
                let pairs = walk.iter().enumerate();
                pairs
                    .map(|(bra, w)| {
                        let x = a + width * bra;
                        w.conj() * (trace_dual[x] + sign * z_dual[x])
                    })
                    .sum()
            })
            .collect();
        for layer in 0..circuit.layers {
            let slope = circuit.walk_derivative(bit, layer);
            let sum: Complex64 = slope.iter().zip(&seen).map(|(w, v)| w * v).sum();
            gradient.betas_mut()[layer] += 2.0 * sum.re;
        }
    }
}
