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
    assert!(rounds.iter().all(|round| round["qubits"] == 8 && round["engine"] == "statevector"));
    // The windows of the first chain reach from its start to its end.
    let chain = rounds[0]["window"]["of"].as_u64().unwrap();
    let first = |round: &Value| round["window"]["first"].as_u64().unwrap();
    assert!(chain > 8 && first(&rounds[0]) == 0);
    assert!(rounds.iter().any(|round| first(round) == chain - 8 && round["window"]["of"] == chain));
}
