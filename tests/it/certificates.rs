//! The certificate of the six scenarios: in nearly every round the best sample is the exact optimum of its
//! chain, and the rounds in which it is not are in the document with their gap.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// The rounds of a scenario.
fn rounds(scenario: u32, seed: u32) -> Vec<Value> {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("fence_examples");
    let mut command = Command::new(env!("CARGO_BIN_EXE_quavd"));
    command.arg("plan").arg(examples.join(format!("s{scenario}.plan")));
    command.args(["--quiet", "--json", "--seed", &seed.to_string()]);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    let legs = document["legs"].as_array().unwrap();
    legs.iter().flat_map(|leg| leg["rounds"].as_array().unwrap().clone()).collect()
}

#[test]
fn in_nearly_every_round_the_best_sample_is_the_chains_optimum() {
    let runs = (1..=6).flat_map(|scenario| (0..3).map(move |seed| (scenario, seed)));
    let mut hits = Vec::new();
    for (scenario, seed) in runs {
        let rounds = rounds(scenario, seed);
        assert!(!rounds.is_empty(), "s{scenario}, seed {seed}");
        for round in rounds {
            let figure = |name: &str| round[name].as_f64().unwrap();
            let (best, exact, gap) =
                (figure("best_sample"), figure("exact_optimum"), figure("gap"));
            assert!(gap >= 0.0 && (best - exact - gap).abs() < 1e-6, "{round}");
            // Whoever is certain to be drawn is drawn.
            assert!(gap < 1e-6 || figure("p_optimum") < 0.1, "{round}");
            hits.push(gap < 1e-6);
        }
    }
    let hit = hits.iter().filter(|&&hit| hit).count();
    assert!(hit as f64 >= 0.95 * hits.len() as f64, "{hit} of {}", hits.len());
}
