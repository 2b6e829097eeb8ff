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
use super::super::simd::Kernel;
use super::circuit::Circuit;
use super::norms::RightNorms;
use super::prefixes::{Group, LANES};

/// One distinct prefix: the shots that share it, and where it came from.
#[derive(Debug, Clone, Copy)]
struct Prefix {
    shots: u32,
    /// Its squared amplitudes; the conditional probability of its next bit is relative to this.
    weight: f64,
    parent: usize,
    bit: bool,
}

/// Draws `shots` bitstrings; distinct ones in ascending order.
pub(super) struct Draw<'a> {
    pub(super) circuit: &'a Circuit,
    pub(super) chain: &'a ChainIsing,
    pub(super) right_norms: &'a RightNorms,
    pub(super) shots: u32,
    pub(super) rng: &'a mut ChaCha8Rng,
}

impl Kernel for Draw<'_> {
    type Output = Vec<Sample>;

    #[inline(always)]
    fn run(self) -> Vec<Sample> {
        let Self { circuit, chain, right_norms, shots, rng } = self;
        if shots == 0 {
            return Vec::new();
        }
        let root = Prefix { shots, weight: 1.0, parent: 0, bit: false };
        let mut generations = vec![vec![root]];
        let mut groups = vec![Group::start(circuit.trajectories())];
        let mut trial = Group::start(circuit.trajectories());
        let mut right = Vec::new();
        for (i, &h) in chain.h().iter().enumerate() {
            right_norms.matrix(i, &mut right);
            let factors = circuit.factors(h);
            let parents = &generations[i];
            let mut children = Vec::with_capacity(2 * parents.len());
            for (g, group) in groups.iter().enumerate() {
                trial.clone_from(group);
                trial.multiply(&factors[0]);
                let weights = trial.quadratic_form(&right);
                for (lane, &weight) in weights.iter().enumerate() {
                    let parent = g * LANES + lane;
                    let Some(prefix) = parents.get(parent) else { break };
                    split(prefix, parent, weight, rng, &mut children);
                }
            }
            if let Some(&j) = chain.j().get(i) {
                groups = next_groups(&groups, &children, &factors);
                for (group, children) in groups.iter_mut().zip(children.chunks_mut(LANES)) {
                    group.cross_bond(&circuit.gammas, j);
                    children.iter_mut().for_each(|child| child.weight = 1.0);
                }
            }
            generations.push(children);
        }
        collect(&generations)
    }
}

/// Draws the next bit of every shot of a prefix, given the weight of bit 0.
#[inline(always)]
fn split(
    prefix: &Prefix,
    parent: usize,
    weight: f64,
    rng: &mut ChaCha8Rng,
    children: &mut Vec<Prefix>,
) {
    let threshold = weight / prefix.weight;
    let mut zeros = 0;
    for _ in 0..prefix.shots {
        zeros += u32::from(rng.random::<f64>() < threshold);
    }
    let ones = prefix.shots - zeros;
    if zeros > 0 {
        children.push(Prefix { shots: zeros, weight, parent, bit: false });
    }
    if ones > 0 {
        children.push(Prefix { shots: ones, weight: prefix.weight - weight, parent, bit: true });
    }
}

/// The normalised amplitudes of the children after their bit, before the bond.
#[inline(always)]
fn next_groups(groups: &[Group], children: &[Prefix], factors: &[Vec<Complex64>; 2]) -> Vec<Group> {
    let mut next = Vec::with_capacity(children.len().div_ceil(LANES));
    for children in children.chunks(LANES) {
        let mut group = Group::empty(factors[0].len());
        let mut scales = [[0.0; LANES]; 2];
        for (lane, child) in children.iter().enumerate() {
            group.copy_lane(lane, &groups[child.parent / LANES], child.parent % LANES);
            scales[usize::from(child.bit)][lane] = child.weight.sqrt().recip();
        }
        group.multiply_by_bit(factors, &scales);
        next.push(group);
    }
    next
}

/// Reads the bits back from the last generation to the first.
fn collect(generations: &[Vec<Prefix>]) -> Vec<Sample> {
    let n = generations.len() - 1;
    (0..generations[n].len())
        .map(|leaf| {
            let mut bits = Bits::zeros(n);
            let mut at = leaf;
            for i in (0..n).rev() {
                let prefix = generations[i + 1][at];
                bits.set(i, prefix.bit);
                at = prefix.parent;
            }
            Sample { bits, count: generations[n][leaf].shots }
        })
        .collect()
}

/// The probability of one bitstring: its amplitude, squared.
pub(super) struct Probability<'a> {
    pub(super) circuit: &'a Circuit,
    pub(super) chain: &'a ChainIsing,
    pub(super) bits: &'a Bits,
}

impl Kernel for Probability<'_> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Self { circuit, chain, bits } = self;
        let mut group = Group::start(circuit.trajectories());
        for (i, &h) in chain.h().iter().enumerate() {
            group.multiply(&circuit.factors(h)[usize::from(bits.get(i))]);
            if let Some(&j) = chain.j().get(i) {
                group.cross_bond(&circuit.gammas, j);
            }
        }
        group.amplitude(0).norm_sqr()
    }
}
