//! The circuits for IBM's QPUs, judged by qiskit (`sitl/ibm/judge.py`): its OpenQASM 3 loader, its
//! instruction sets and its simulator.

use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use quav::ibm::{Binding, Device, Entangler, Metrics, choose_line, lower, lower_on};
use quav::qaoa::chain::ChainEngine;
use quav::qaoa::engine::Engine;
use quav::qaoa::{Angles, Bits, ChainIsing, Ising, Scale};
use serde_json::{Value, json};
use zip::ZipArchive;

const MEMORY: u64 = 1 << 30;

/// The Python that has qiskit: `QUAV_IBM_PYTHON`, or the environment `make` builds for it.
pub(crate) fn python() -> PathBuf {
    let venv = Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv-ibm/bin/python");
    let python = std::env::var_os("QUAV_IBM_PYTHON").map_or(venv, PathBuf::from);
    assert!(
        python.exists(),
        "{} is missing: run `make test`, which makes it, or point QUAV_IBM_PYTHON to a Python \
         with the packages of sitl/requirements-ibm.txt",
        python.display()
    );
    python
}

fn judge(question: &Value) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("sitl/ibm/judge.py");
    let mut process = Command::new(python())
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the judge starts");
    process.stdin.take().unwrap().write_all(question.to_string().as_bytes()).unwrap();
    let output = process.wait_with_output().unwrap();
    assert!(output.status.success(), "the judge gave up; the reason is on stderr above");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn device(name: &str) -> Device {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ibm_devices.zip");
    let mut archive = ZipArchive::new(Cursor::new(std::fs::read(path).unwrap())).unwrap();
    let mut text = |document: &str| {
        let mut text = String::new();
        let mut file = archive.by_name(&format!("{name}/{document}.json")).unwrap();
        file.read_to_string(&mut text).unwrap();
        text
    };
    Device::parse(&text("configuration"), &text("properties")).unwrap()
}

/// A chain without any symmetry, so that no exchange of bits, signs or angles goes unnoticed.
fn chain(qubits: usize) -> ChainIsing {
    let h = (0..qubits).map(|i| ((i * 7 % 11) as f64 - 5.2) / 10.0).collect();
    let j = (1..qubits).map(|i| ((i * 5 % 13) as f64 - 6.3) / 10.0).collect();
    let ising = Ising::from(ChainIsing::new(0.0, h, j).unwrap());
    ising.scaled(Scale::Sigma).ising.to_chain().unwrap()
}

/// The text and its values for one way of giving angles.
fn question(device: &str, chain: &ChainIsing, binding: Binding<'_>, angles: &Angles) -> Value {
    let circuit = lower(&self::device(device), chain, binding).unwrap();
    let values: Value = circuit.parameter_values(angles).into_iter().collect();
    json!({"device": device, "qasm": circuit.to_qasm(), "values": values})
}

const DEVICES: [&str; 3] = ["kyiv", "kingston", "nighthawk"];

#[test]
fn qiskit_accepts_every_circuit_and_measures_what_quavd_computes() {
    let (small, large) = (chain(8), chain(20));
    let mut cases = Vec::new();
    let angles = Angles::new(vec![0.31, 0.64, 0.93], vec![-0.71, -0.42, -0.17]).unwrap();
    let mut engine = ChainEngine::new(small.clone(), MEMORY);
    let probabilities: Vec<f64> = (0..256)
        .map(|index| engine.probability(&angles, &Bits::from_index(8, index)).unwrap())
        .collect();
    for device in DEVICES {
        for binding in [Binding::Bound(&angles), Binding::Inputs(3)] {
            let mut case = question(device, &small, binding, &angles);
            case["probabilities"] = json!(probabilities);
            cases.push(case);
        }
    }
    let ramp = Angles::ramp(5);
    let expectation = ChainEngine::new(large.clone(), MEMORY).expectation(&ramp).unwrap();
    for device in DEVICES {
        let mut case = question(device, &large, Binding::Bound(&ramp), &ramp);
        case["h"] = json!(large.h());
        case["j"] = json!(large.j());
        cases.push(case);
    }
    let answers = judge(&json!({ "cases": cases }));
    let answers = answers.as_array().unwrap();
    assert_eq!(answers.len(), 9);
    for (answer, case) in answers.iter().zip(&cases) {
        let device = &case["device"];
        assert_eq!(answer["parameters"], true, "{device}");
        assert_eq!(answer["definitions"], true, "{device}");
        assert_eq!(answer["violations"], json!([]), "{device}");
        match answer["expectation"].as_f64() {
            Some(found) => assert!((found - expectation).abs() < 1e-6, "{device}: {found}"),
            None => assert!(answer["tvd"].as_f64().unwrap() < 1e-6, "{device}: {answer}"),
        }
    }
}

#[test]
fn qiskit_would_notice_a_wrong_angle_and_a_wrong_direction() {
    let angles = Angles::ramp(2);
    let small = chain(8);
    let mut engine = ChainEngine::new(small.clone(), MEMORY);
    let probabilities: Vec<f64> = (0..256)
        .map(|index| engine.probability(&angles, &Bits::from_index(8, index)).unwrap())
        .collect();
    let mut wrong = question("kyiv", &small, Binding::Inputs(2), &angles);
    wrong["probabilities"] = json!(probabilities);
    wrong["values"]["g01"] = json!(angles.gammas()[1] + 0.01);
    let line = choose_line(&device("kyiv"), Entangler::Ecr, &small, Binding::Inputs(2)).unwrap();
    let (a, b) = (line.qubits()[3], line.qubits()[4]);
    let text = wrong["qasm"].as_str().unwrap();
    let (forward, backward) = (format!("ecr {a}, {b};"), format!("ecr {b}, {a};"));
    let turned = if text.contains(&forward) {
        text.replace(&forward, &backward)
    } else {
        text.replace(&backward, &forward)
    };
    wrong["qasm"] = json!(turned);
    let answer = &judge(&json!({ "cases": [wrong] }))[0];
    assert!(answer["tvd"].as_f64().unwrap() > 1e-3, "{answer}");
    assert!(!answer["violations"].as_array().unwrap().is_empty(), "{answer}");
}

/// `make bench-ibm`: what the circuit costs beside qiskit's, and the line beside every other one.
#[test]
#[ignore = "figures, not a promise: make bench-ibm prints them"]
fn figures() {
    let (chain, angles) = (chain(20), Angles::ramp(5));
    for name in DEVICES {
        let device = device(name);
        for entangler in device.entanglers() {
            for (kind, binding) in
                [("bound", Binding::Bound(&angles)), ("inputs", Binding::Inputs(5))]
            {
                let begin = std::time::Instant::now();
                let Ok(line) = choose_line(&device, entangler, &chain, binding) else { continue };
                let took = begin.elapsed();
                let Ok(circuit) = lower_on(&line, &chain, binding) else { continue };
                let m = Metrics::of(&circuit, &device);
                println!(
                    "{name:10} {entangler:4} {kind:7} two-qubit {:3} depth {:2}, pulses {:3}, depth \
                     {:3}, {:6.2} us, success {:.4}; line in {:.0} ms{}",
                    m.two_qubit_gates,
                    m.two_qubit_depth,
                    m.pulses,
                    m.depth,
                    m.duration.map_or(f64::NAN, |duration| duration.0 / 1e3),
                    m.success,
                    took.as_secs_f64() * 1e3,
                    if line.is_proven_best() { ", proven best" } else { "" },
                );
            }
        }
    }
    let mut question = question("kyiv", &chain, Binding::Bound(&angles), &angles);
    question["entangler"] = json!("ecr");
    question["h"] = json!(chain.h());
    question["j"] = json!(chain.j());
    question["gammas"] = json!(angles.gammas());
    question["betas"] = json!(angles.betas());
    let answer = judge(&json!({ "figures": question }));
    println!("kyiv: {} lines of 20 qubits, best error product {}", answer["lines"], answer["best"]);
    for who in ["quavd", "qiskit O1", "qiskit O3"] {
        println!("{who}: {}", answer[who]);
    }
    let on_line = |who: &str| answer[who]["on_line"].as_f64().unwrap();
    assert!(on_line("quavd") >= 0.99 * answer["best"].as_f64().unwrap());
    assert!(on_line("quavd") >= on_line("qiskit O1").max(on_line("qiskit O3")));
}
