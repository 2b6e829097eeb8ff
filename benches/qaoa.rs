//! The QAOA engines: ⟨H⟩ with its gradient, whole trainings, and samples.
//!
//! `cargo bench --bench qaoa` prints one table; `cargo bench --bench qaoa chain` only a part of it.
#![allow(missing_docs, clippy::unwrap_used)]

use divan::{Bencher, black_box};
use quav::qaoa::chain::ChainEngine;
use quav::qaoa::engine::Engine;
use quav::qaoa::statevector::{Precision, StatevectorEngine};
use quav::qaoa::train::train;
use quav::qaoa::{Angles, ChainIsing, Ising, Scale, TrainSettings};
use quav::stop::Stop;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const LAYERS: usize = 5;
const MEMORY: u64 = 8 << 30;

fn main() {
    divan::main();
}

fn coefficients(count: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    (0..count).map(|_| rng.random_range(-1.0..1.0)).collect()
}

fn chain(qubits: usize) -> ChainEngine {
    let rng = &mut ChaCha8Rng::seed_from_u64(1);
    let (h, j) = (coefficients(qubits, rng), coefficients(qubits - 1, rng));
    let ising = Ising::from(ChainIsing::new(0.0, h, j).unwrap());
    let scaled = ising.scaled(Scale::Sigma).ising.to_chain().unwrap();
    ChainEngine::new(scaled, MEMORY)
}

/// A random 3-regular graph: three stubs per qubit, paired at random until no pair is bad.
fn three_regular(qubits: usize) -> Ising {
    let rng = &mut ChaCha8Rng::seed_from_u64(2);
    let couplings = loop {
        let mut stubs: Vec<usize> = (0..3 * qubits).map(|stub| stub / 3).collect();
        stubs.shuffle(rng);
        let mut edges: Vec<(usize, usize)> = stubs
            .chunks_exact(2)
            .map(|pair| (pair[0].min(pair[1]), pair[0].max(pair[1])))
            .collect();
        edges.sort_unstable();
        edges.dedup();
        if edges.len() == 3 * qubits / 2 && edges.iter().all(|(i, j)| i != j) {
            break edges.into_iter().map(|(i, j)| (i, j, rng.random_range(-1.0..1.0))).collect();
        }
    };
    let ising = Ising::new(0.0, coefficients(qubits, rng), couplings).unwrap();
    ising.scaled(Scale::Sigma).ising.into_owned()
}

const CHAINS: [usize; 3] = [20, 100, 1000];

#[divan::bench(args = CHAINS)]
fn chain_gradient(bencher: Bencher<'_, '_>, qubits: usize) {
    let (mut engine, angles) = (chain(qubits), Angles::ramp(LAYERS));
    bencher.bench_local(|| engine.expectation_and_gradient(black_box(&angles)).unwrap());
}

#[divan::bench(args = CHAINS)]
fn chain_expectation(bencher: Bencher<'_, '_>, qubits: usize) {
    let (mut engine, angles) = (chain(qubits), Angles::ramp(LAYERS));
    bencher.bench_local(|| engine.expectation(black_box(&angles)).unwrap());
}

#[divan::bench(args = CHAINS, sample_count = 10)]
fn chain_training_60_steps(bencher: Bencher<'_, '_>, qubits: usize) {
    let mut engine = chain(qubits);
    let settings = TrainSettings::default();
    bencher
        .bench_local(|| train(&mut engine, Angles::ramp(LAYERS), &settings, &Stop::new()).unwrap());
}

#[divan::bench(args = CHAINS, sample_count = 10)]
fn chain_1024_shots(bencher: Bencher<'_, '_>, qubits: usize) {
    let mut engine = chain(qubits);
    let settings = TrainSettings::default();
    let angles = train(&mut engine, Angles::ramp(LAYERS), &settings, &Stop::new()).unwrap().angles;
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    bencher.bench_local(|| engine.sample(&angles, 1024, &mut rng).unwrap());
}

fn statevector(bencher: Bencher<'_, '_>, qubits: usize, precision: Precision, threads: usize) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mut engine = StatevectorEngine::new(&three_regular(qubits), precision, MEMORY).unwrap();
    let angles = Angles::ramp(LAYERS);
    bencher.bench_local(|| pool.install(|| engine.expectation_and_gradient(&angles).unwrap()));
}

const STATES: [usize; 4] = [16, 20, 22, 24];

#[divan::bench(args = STATES, consts = [1, 2], sample_count = 3)]
fn statevector_gradient_f64<const THREADS: usize>(bencher: Bencher<'_, '_>, qubits: usize) {
    statevector(bencher, qubits, Precision::Double, THREADS);
}

#[divan::bench(args = STATES, consts = [1, 2], sample_count = 3)]
fn statevector_gradient_f32<const THREADS: usize>(bencher: Bencher<'_, '_>, qubits: usize) {
    statevector(bencher, qubits, Precision::Single, THREADS);
}
