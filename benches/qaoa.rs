//! The QAOA engines: ⟨H⟩ with its gradient, whole trainings, and samples.
//!
//! `cargo bench --bench qaoa` prints one table; `cargo bench --bench qaoa chain` only a part of it.
#![allow(missing_docs, clippy::unwrap_used)]

mod problems;

use divan::{Bencher, black_box};
use problems::{LAYERS, MEMORY, three_regular};
use quav::qaoa::chain::ChainEngine;
use quav::qaoa::engine::Engine;
use quav::qaoa::statevector::{Precision, StatevectorEngine};
use quav::qaoa::train::train;
use quav::qaoa::{Angles, TrainSettings};
use quav::stop::Stop;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn main() {
    divan::main();
}

fn chain(qubits: usize) -> ChainEngine {
    ChainEngine::new(problems::chain(qubits), MEMORY)
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
