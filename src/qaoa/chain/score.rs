//! How the probability of one bitstring changes with the angles: `∂ log p / ∂θ = 2 Re(∂ψ/∂θ / ψ)`.
//!
//! The amplitude ψ of a bitstring is a sum over the trajectories of all qubits, carried along the chain
//! from the left and from the right. Where the two meet, at a site or a bond, every derivative is a sum
//! over the trajectories there; quotients with ψ do not notice that the carried vectors are normalised.

use num_complex::Complex64;

use super::super::angles::Angles;
use super::super::bits::Bits;
use super::super::ising::ChainIsing;
use super::circuit::Circuit;

/// Derivatives of log-probabilities for one set of angles.
#[derive(Debug)]
pub(super) struct Scores<'a> {
    chain: &'a ChainIsing,
    circuit: &'a Circuit,
    /// `slopes[l][s][a]`: the derivative of a site's walk to bit s with respect to β of layer l.
    slopes: Vec<[Vec<Complex64>; 2]>,
}

fn sign(trajectory: usize, layer: usize) -> f64 {
    if trajectory >> layer & 1 == 0 { 1.0 } else { -1.0 }
}

fn dot(a: &[Complex64], b: &[Complex64]) -> Complex64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The same, each term with its trajectory's sign in a layer.
fn signed_dot(a: &[Complex64], b: &[Complex64], layer: usize) -> Complex64 {
    a.iter().zip(b).enumerate().map(|(k, (a, b))| sign(k, layer) * a * b).sum()
}

fn product(a: &[Complex64], b: &[Complex64]) -> Vec<Complex64> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

fn normalised(mut vector: Vec<Complex64>) -> Vec<Complex64> {
    let norm = vector.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
    if norm > 0.0 {
        vector.iter_mut().for_each(|entry| *entry /= norm);
    }
    vector
}

impl<'a> Scores<'a> {
    pub(super) fn new(chain: &'a ChainIsing, circuit: &'a Circuit, betas: &[f64]) -> Self {
        let slopes = (0..betas.len()).map(|layer| Circuit::walks(betas, Some(layer))).collect();
        Self { chain, circuit, slopes }
    }

    /// ∂ log p(bits) / ∂angles of the (padded) circuit.
    pub(super) fn score(&self, bits: &Bits) -> Angles {
        let (h, j) = (self.chain.h(), self.chain.j());
        let (n, layers) = (h.len(), self.slopes.len());
        let width = self.circuit.trajectories();
        let bit = |i: usize| usize::from(bits.get(i));
        let factors: Vec<Vec<Complex64>> =
            (0..n).map(|i| std::mem::take(&mut self.circuit.factors(h[i])[bit(i)])).collect();
        // rights[i]: what lies beyond site i, over its trajectories.
        let mut rights = vec![vec![Complex64::ONE; width]; n];
        for i in (0..n - 1).rev() {
            let next = product(&factors[i + 1], &rights[i + 1]);
            rights[i] = normalised(self.across(next, j[i]));
        }
        let mut score = Angles::zeros(layers);
        let mut left = vec![Complex64::ONE; width];
        for i in 0..n {
            let here = product(&left, &factors[i]);
            let total = dot(&here, &rights[i]);
            let outer = product(&product(&left, &self.circuit.phases(h[i])), &rights[i]);
            for layer in 0..layers {
                // −i h Σ a: the real part of −i x is the imaginary part of x.
                let field = signed_dot(&here, &rights[i], layer) / total;
                score.gammas_mut()[layer] += 2.0 * h[i] * field.im;
                let slope = dot(&outer, &self.slopes[layer][bit(i)]) / total;
                score.betas_mut()[layer] += 2.0 * slope.re;
            }
            if i + 1 < n {
                let beyond = product(&factors[i + 1], &rights[i + 1]);
                let total = dot(&here, &self.across(beyond.clone(), j[i]));
                for layer in 0..layers {
                    let signed =
                        beyond.iter().enumerate().map(|(k, b)| sign(k, layer) * b).collect();
                    let bond = signed_dot(&here, &self.across(signed, j[i]), layer) / total;
                    score.gammas_mut()[layer] += 2.0 * j[i] * bond.im;
                }
                left = normalised(self.across(here, j[i]));
            }
        }
        score
    }

    /// Over a bond: `Π_l e^{−iγ_l J a_l b_l}`.
    fn across(&self, mut vector: Vec<Complex64>, j: f64) -> Vec<Complex64> {
        for (layer, gamma) in self.circuit.gammas.iter().enumerate() {
            let half = 1 << layer;
            let plus = Complex64::cis(-gamma * j);
            let minus = plus.conj();
            for block in vector.chunks_exact_mut(2 * half) {
                let (low, high) = block.split_at_mut(half);
                for (p, m) in low.iter_mut().zip(high) {
                    (*p, *m) = (plus * *p + minus * *m, minus * *p + plus * *m);
                }
            }
        }
        vector
    }
}
