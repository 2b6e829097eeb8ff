//! A leg whose path has more edges than the engine takes qubits is decided in windows that slide along.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

#[test]
fn a_long_chain_is_decided_in_windows_of_the_asked_for_qubits() {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("fence_examples/s1.plan");
    let output = Command::new(env!("CARGO_BIN_EXE_quavd"))
        .args(["--quiet", "plan", "--json", "--engine", "statevector", "--qubits", "8"])
        .arg(scenario)
        .output()
        .unwrap();
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(document["collision_free"], true);
    assert!(document["min_clearance_m"].as_f64().unwrap() >= 4.99);
    // 804.47 m is the exact shortest length.
    assert!(document["length_m"].as_f64().unwrap() <= 804.47 * 1.005);
    let rounds = document["legs"][0]["rounds"].as_array().unwrap();
    let window = |round: &Value| {
        let number = |value: &Value| value.as_u64().unwrap();
        let window = &round["window"];
        (number(&window["first"]), number(&round["qubits"]), number(&window["of"]))
    };
    // What no move would change needs no window; the others are within the chain and slide along it.
    let windows: Vec<(u64, u64, u64)> = rounds.iter().map(window).collect();
    assert!(rounds.iter().all(|round| round["engine"] == "statevector"));
    assert!(windows.iter().all(|(first, qubits, of)| *qubits <= 8 && first + qubits <= *of));
    let slides = |pair: &[(u64, u64, u64)]| {
        let [(first, 8, of), (next, _, again)] = pair else { return false };
        first < next && *next <= first + 8 && of == again && *of > 16
    };
    assert!(windows.windows(2).filter(|pair| slides(pair)).count() >= 3, "{windows:?}");
}
