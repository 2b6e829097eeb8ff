//! Exact samples: qubit after qubit from the left, each with its conditional probability given the bits
//! before it. All shots that agree so far share one prefix, so a qubit costs once per distinct prefix.
//!
//! A prefix is carried as the amplitudes over the next qubit's trajectory. The probability of its next
//! bit is a quadratic form in those, whose matrix is what the qubit sees to its right.

use std::collections::BTreeMap;
use std::mem::swap;

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

/// Bytes that the amplitudes of one batch of shots may take.
const BATCH_BYTES: usize = 64 << 20;

/// One distinct prefix and the shots that share it.
#[derive(Debug, Clone)]
struct Prefix {
    bits: Bits,
    shots: u32,
    /// Its squared amplitudes; the conditional probability of its next bit is relative to this.
    weight: f64,
    /// Where its amplitudes before the last bit are.
    parent: usize,
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
        // Amplitudes of a batch before and after a bit.
        let batch = (BATCH_BYTES / (2 * 16 * circuit.trajectories())) as u32;
        let mut counts = BTreeMap::new();
        let mut left = shots;
        while left > 0 {
            let shots = left.min(batch);
            left -= shots;
            for Prefix { bits, shots, .. } in draw_batch(circuit, chain, right_norms, shots, rng) {
                *counts.entry(bits).or_insert(0) += shots;
            }
        }
        counts.into_iter().map(|(bits, count)| Sample { bits, count }).collect()
    }
}

#[inline(always)]
fn draw_batch(
    circuit: &Circuit,
    chain: &ChainIsing,
    right_norms: &RightNorms,
    shots: u32,
    rng: &mut ChaCha8Rng,
) -> Vec<Prefix> {
    let mut prefixes =
        vec![Prefix { bits: Bits::zeros(chain.qubits()), shots, weight: 1.0, parent: 0 }];
    let mut groups = vec![Group::start(circuit.trajectories())];
    let mut next_groups = Vec::new();
    let mut trial = Group::start(circuit.trajectories());
    let mut right = Vec::new();
    for (i, &h) in chain.h().iter().enumerate() {
        right_norms.matrix(i, &mut right);
        let factors = circuit.factors(h);
        let mut children = Vec::with_capacity(2 * prefixes.len());
        let mut parents = prefixes.into_iter().enumerate();
        for group in &groups {
            trial.clone_from(group);
            trial.multiply(&factors[0]);
            let weights = trial.quadratic_form(&right);
            for (weight, (parent, prefix)) in weights.into_iter().zip(&mut parents) {
                split(Prefix { parent, ..prefix }, i, weight, rng, &mut children);
            }
        }
        if let Some(&j) = chain.j().get(i) {
            advance(&groups, &mut children, i, &factors, &mut next_groups);
            swap(&mut groups, &mut next_groups);
            for group in &mut groups {
                group.cross_bond(&circuit.gammas, j);
            }
        }
        prefixes = children;
    }
    prefixes
}

/// Draws the next bit of every shot of a prefix, given the weight of bit 0.
#[inline(always)]
fn split(
    prefix: Prefix,
    qubit: usize,
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
    let rest = prefix.weight - weight;
    if ones == 0 {
        children.push(Prefix { weight, ..prefix });
        return;
    }
    let mut bits = prefix.bits.clone();
    bits.set(qubit, true);
    let (shots, parent) = (ones, prefix.parent);
    if zeros > 0 {
        children.push(Prefix { shots: zeros, weight, ..prefix });
    }
    children.push(Prefix { bits, shots, weight: rest, parent });
}

/// The normalised amplitudes of the children after their bit, before the bond.
#[inline(always)]
fn advance(
    groups: &[Group],
    children: &mut [Prefix],
    qubit: usize,
    factors: &[Vec<Complex64>; 2],
    next: &mut Vec<Group>,
) {
    next.resize(children.len().div_ceil(LANES), Group::start(factors[0].len()));
    for (children, group) in children.chunks_mut(LANES).zip(next) {
        let mut scales = [[0.0; LANES]; 2];
        for (lane, child) in children.iter_mut().enumerate() {
            group.copy_lane(lane, &groups[child.parent / LANES], child.parent % LANES);
            scales[usize::from(child.bits.get(qubit))][lane] = child.weight.sqrt().recip();
            child.weight = 1.0;
        }
        group.multiply_by_bit(factors, &scales);
    }
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
