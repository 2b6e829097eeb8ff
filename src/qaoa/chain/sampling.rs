//! Exact samples: qubit after qubit from the left, each with its conditional probability given the bits
//! before it. All shots that agree so far share one prefix, so a qubit costs once per distinct prefix.
//!
//! A prefix is carried as the amplitudes over the next qubit's trajectory. The probability of its next
//! bit is a quadratic form in those, whose matrix is what the qubit sees to its right.

use num_complex::Complex64;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::super::bits::Bits;
use super::super::engine::Sample;
use super::super::ising::ChainIsing;
use super::circuit::Circuit;
use super::norms::RightNorms;

/// Prefixes that are worked on together, one per vector lane.
const LANES: usize = 8;
type Lanes = [f64; LANES];
const ZERO: Lanes = [0.0; LANES];

/// One distinct prefix: the shots that share it, and where it came from.
#[derive(Debug, Clone, Copy)]
struct Prefix {
    shots: u32,
    /// Probability of the prefix relative to its normalised amplitudes.
    weight: f64,
    parent: u32,
    bit: bool,
}

/// Amplitudes of up to [`LANES`] prefixes over all trajectories: real parts, imaginary parts.
#[derive(Debug, Clone)]
struct Group {
    re: Vec<Lanes>,
    im: Vec<Lanes>,
}

impl Group {
    fn new(trajectories: usize) -> Self {
        Self { re: vec![ZERO; trajectories], im: vec![ZERO; trajectories] }
    }

    fn multiply(&mut self, factors: &[Complex64]) {
        for ((re, im), factor) in self.re.iter_mut().zip(&mut self.im).zip(factors) {
            for lane in 0..LANES {
                let (x, y) = (re[lane], im[lane]);
                re[lane] = x * factor.re - y * factor.im;
                im[lane] = x * factor.im + y * factor.re;
            }
        }
    }

    /// Carries the amplitudes over a bond: `Π_l e^{−iγ_l J a_l b_l}`.
    fn cross_bond(&mut self, gammas: &[f64], j: f64) {
        for (layer, gamma) in gammas.iter().enumerate() {
            let (sin, cos) = (gamma * j).sin_cos();
            let half = 1 << layer;
            let blocks = self.re.chunks_exact_mut(2 * half).zip(self.im.chunks_exact_mut(2 * half));
            for (re, im) in blocks {
                let (re_plus, re_minus) = re.split_at_mut(half);
                let (im_plus, im_minus) = im.split_at_mut(half);
                for k in 0..half {
                    for lane in 0..LANES {
                        let even_re = cos * (re_plus[k][lane] + re_minus[k][lane]);
                        let even_im = cos * (im_plus[k][lane] + im_minus[k][lane]);
                        let odd_re = sin * (re_plus[k][lane] - re_minus[k][lane]);
                        let odd_im = sin * (im_plus[k][lane] - im_minus[k][lane]);
                        // cos·even − i sin·odd, and its mirror image.
                        re_plus[k][lane] = even_re + odd_im;
                        im_plus[k][lane] = even_im - odd_re;
                        re_minus[k][lane] = even_re - odd_im;
                        im_minus[k][lane] = even_im + odd_re;
                    }
                }
            }
        }
    }

    /// `Σ w(a) w(ā)* R(a, ā)` per lane for a Hermitian R.
    fn quadratic_form(&self, right: &[Complex64]) -> Lanes {
        let width = self.re.len();
        let mut total = ZERO;
        for bra in 0..width {
            let (mut row_re, mut row_im) = (ZERO, ZERO);
            for ket in 0..bra {
                let r = right[ket + width * bra];
                for lane in 0..LANES {
                    row_re[lane] += r.re * self.re[ket][lane] - r.im * self.im[ket][lane];
                    row_im[lane] += r.re * self.im[ket][lane] + r.im * self.re[ket][lane];
                }
            }
            let diagonal = 0.5 * right[bra + width * bra].re;
            for lane in 0..LANES {
                let (x, y) = (self.re[bra][lane], self.im[bra][lane]);
                total[lane] +=
                    x * (row_re[lane] + diagonal * x) + y * (row_im[lane] + diagonal * y);
            }
        }
        total.map(|sum| 2.0 * sum)
    }
}

/// Draws `shots` bitstrings; distinct ones in ascending order.
pub(super) fn sample(
    circuit: &Circuit,
    chain: &ChainIsing,
    right_norms: &RightNorms,
    shots: u32,
    rng: &mut ChaCha8Rng,
) -> Vec<Sample> {
    if shots == 0 {
        return Vec::new();
    }
    let n = chain.qubits();
    let width = circuit.trajectories();
    let mut generations = vec![vec![Prefix { shots, weight: 1.0, parent: 0, bit: false }]];
    let mut first = Group::new(width);
    first.re.iter_mut().for_each(|lanes| *lanes = [1.0; LANES]);
    let mut groups = vec![first];
    let mut right = Vec::new();
    for i in 0..n {
        right_norms.matrix(i, &mut right);
        let phases = circuit.phases(chain.h()[i]);
        let factors: [Vec<Complex64>; 2] =
            [0, 1].map(|bit| circuit.walk[bit].iter().zip(&phases).map(|(w, p)| w * p).collect());
        let prefixes = &generations[i];
        let mut next = Vec::with_capacity(prefixes.len() * 2);
        for (g, group) in groups.iter().enumerate() {
            let mut zero = group.clone();
            zero.multiply(&factors[0]);
            let weights = zero.quadratic_form(&right);
            for (lane, &weight_zero) in weights.iter().enumerate() {
                let parent = g * LANES + lane;
                let Some(prefix) = prefixes.get(parent) else { break };
                let threshold = weight_zero / prefix.weight;
                let drawn = (0..prefix.shots).filter(|_| rng.random::<f64>() < threshold).count();
                let zeros = drawn as u32;
                let children = [
                    (false, zeros, weight_zero),
                    (true, prefix.shots - zeros, prefix.weight - weight_zero),
                ];
                for (bit, shots, weight) in children {
                    if shots > 0 {
                        next.push(Prefix { shots, weight, parent: parent as u32, bit });
                    }
                }
            }
        }
        if i + 1 < n {
            groups = next
                .chunks(LANES)
                .map(|children| {
                    let mut group = Group::new(width);
                    for (lane, child) in children.iter().enumerate() {
                        let parent = child.parent as usize;
                        let (from, column) = (&groups[parent / LANES], parent % LANES);
                        let scale = child.weight.sqrt().recip();
                        for (a, factor) in factors[usize::from(child.bit)].iter().enumerate() {
                            let value = factor
                                * Complex64::new(from.re[a][column], from.im[a][column])
                                * scale;
                            group.re[a][lane] = value.re;
                            group.im[a][lane] = value.im;
                        }
                    }
                    group.cross_bond(&circuit.gammas, chain.j()[i]);
                    group
                })
                .collect();
            next.iter_mut().for_each(|child| child.weight = 1.0);
        }
        generations.push(next);
    }
    (0..generations[n].len())
        .map(|leaf| {
            let mut bits = Bits::zeros(n);
            let mut at = leaf;
            for i in (0..n).rev() {
                let prefix = generations[i + 1][at];
                bits.set(i, prefix.bit);
                at = prefix.parent as usize;
            }
            Sample { bits, count: generations[n][leaf].shots }
        })
        .collect()
}

/// The probability of one bitstring: its amplitude, squared.
pub(super) fn probability(circuit: &Circuit, chain: &ChainIsing, bits: &Bits) -> f64 {
    let mut group = Group::new(circuit.trajectories());
    group.re.iter_mut().for_each(|lanes| lanes[0] = 1.0);
    for (i, bit) in bits.iter().enumerate() {
        group.multiply(&circuit.walk[usize::from(bit)]);
        group.multiply(&circuit.phases(chain.h()[i]));
        if let Some(&j) = chain.j().get(i) {
            group.cross_bond(&circuit.gammas, j);
        }
    }
    let sum = |parts: &[Lanes]| parts.iter().map(|lanes| lanes[0]).sum::<f64>();
    sum(&group.re).powi(2) + sum(&group.im).powi(2)
}
