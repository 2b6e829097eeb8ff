//! quavd's engines beside PennyLane's simulators: the same problems, the same angles, one thread each,
//! in one run. `make bench-peers` installs PennyLane and starts this; `STEPS=3` shortens the training.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout)]

mod problems;

use std::io::Write;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use problems::{LAYERS, MEMORY, chain, three_regular};
use quav::qaoa::chain::ChainEngine;
use quav::qaoa::engine::Engine;
use quav::qaoa::statevector::{Precision, StatevectorEngine};
use quav::qaoa::train::{TrainSettings, train};
use quav::qaoa::{Angles, Ising};
use quav::stop::Stop;
use serde::Deserialize;
use serde_json::{Value, json};

const QUBITS: usize = 20;

/// What `peers.py` answers.
#[derive(Debug, Deserialize)]
struct Answer {
    seconds: f64,
    /// ⟨H⟩, or the loss after each step of a training.
    energies: Vec<f64>,
    /// γ and β of each loss of a training.
    #[serde(default)]
    angles: Vec<(Vec<f64>, Vec<f64>)>,
    versions: String,
}

fn ask(python: &str, task: &Value) -> Answer {
    let mut child = Command::new(python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers.py"))
        .env("OMP_NUM_THREADS", "1")
        .env("OPENBLAS_NUM_THREADS", "1")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(task.to_string().as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "peers.py failed");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn task(ising: &Ising, device: &str, single: bool, steps: usize) -> Value {
    let start = Angles::ramp(LAYERS);
    json!({
        "h": ising.h(), "J": ising.couplings(), "gammas": start.gammas(), "betas": start.betas(),
        "device": device, "single": single, "steps": steps,
    })
}

/// The best of five.
fn best<T>(mut run: impl FnMut() -> T) -> (Duration, T) {
    let timed = |run: &mut dyn FnMut() -> T| {
        let began = Instant::now();
        let result = run();
        (began.elapsed(), result)
    };
    (0..5).map(|_| timed(&mut run)).min_by_key(|(time, _)| *time).unwrap()
}

/// How far energies may lie apart.
const AGREE: f64 = 1e-6;

fn apart(own: &[f64], theirs: &[f64]) -> f64 {
    assert_eq!(own.len(), theirs.len());
    own.iter().zip(theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// One row of the table. `reference` is what the energies have to agree with.
fn row(what: &str, peer: &str, ours: Duration, own: &[f64], answer: &Answer, reference: &[f64]) {
    let off = apart(own, reference);
    assert!(off <= AGREE, "{what}: energies differ by {off:e}");
    let theirs = answer.seconds;
    let ratio = theirs / ours.as_secs_f64();
    println!(
        "{what:<44} {peer:<24} {:>10.4} s {theirs:>10.3} s {ratio:>9.1} x   energies within {off:.0e}",
        ours.as_secs_f64()
    );
}

fn main() {
    let Ok(python) = std::env::var("QUAVD_PEERS_PYTHON") else {
        println!("peers: needs PennyLane; run make bench-peers");
        return;
    };
    let steps = std::env::var("STEPS").ok().and_then(|n| n.parse().ok()).unwrap_or(60);
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    println!("{:<44} {:<24} {:>12} {:>12} {:>11}", "one thread", "peer", "quavd", "peer", "ratio");

    let problem = three_regular(QUBITS);
    let angles = Angles::ramp(LAYERS);
    let mut versions = String::new();
    // lightning's own energy in f32 is off by several times 1e-6, so f32 is held against its f64.
    let mut double = Vec::new();
    for (single, name) in [(false, "f64"), (true, "f32")] {
        let precision = if single { Precision::Single } else { Precision::Double };
        let mut engine = StatevectorEngine::new(&problem, precision, MEMORY).unwrap();
        let (time, (energy, _)) = best(|| engine.expectation_and_gradient(&angles).unwrap());
        let what = format!("statevector {name}, <H> and gradient, n=20 p=5");
        for device in ["lightning.qubit", "default.qubit"] {
            if single && device == "default.qubit" {
                continue; // always double
            }
            let answer = ask(&python, &task(&problem, device, single, 0));
            if single {
                let off = apart(&answer.energies, &double);
                println!("{device}'s energy in f32 is {off:.0e} off its own in f64");
            } else {
                double.clone_from(&answer.energies);
            }
            row(&what, device, time, &[energy], &answer, &double);
            versions = answer.versions;
        }
    }

    let problem = chain(QUBITS);
    let mut engine = ChainEngine::new(problem.clone(), MEMORY);
    let settings = TrainSettings { steps, ..TrainSettings::default() };
    let (time, training) =
        best(|| train(&mut engine, Angles::ramp(LAYERS), &settings, &Stop::new()).unwrap());
    let answer = ask(&python, &task(&problem.into(), "lightning.qubit", false, steps));
    let what = format!("chain, training of {steps} Adam steps, n=20 p=5");
    // Two Adams drift apart by their roundings, so the energies are those at PennyLane's angles.
    let mut ours = |(gammas, betas): &(Vec<f64>, Vec<f64>)| {
        engine.expectation(&Angles::new(gammas.clone(), betas.clone()).unwrap()).unwrap()
    };
    let energies: Vec<f64> = answer.angles.iter().map(&mut ours).collect();
    row(&what, "lightning.qubit", time, &energies, &answer, &answer.energies);
    println!("losses of the two trainings within {:.0e}", apart(&training.loss, &answer.energies));
    println!("{versions}");
}
