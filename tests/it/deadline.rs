//! Planning ends when nobody wants the plan any more, and when its time is up: then the best clear
//! path until then is the plan, and that it is not all that could be had is said.

use std::path::Path;
use std::process::{Command, Output};

use quav::formats::{Scenario, read_scenario};
use quav::replan::{Input, Options, ReplanError, Stage, replan};
use quav::stop::Stop;
use serde_json::Value;

fn example(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("fence_examples/{name}.plan"));
    path.to_string_lossy().into_owned()
}

fn planned(name: &str, arguments: &[&str]) -> Output {
    let scenario = example(name);
    Command::new(env!("CARGO_BIN_EXE_quavd"))
        .args(["plan", &scenario])
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn a_plan_that_is_cut_short_is_clear_and_says_so() {
    // Fully trained, so many rounds take minutes; candidates take milliseconds.
    let cut = ["--paper", "--rounds", "10000", "--deadline", "3"];
    let output = planned("inclusion-with-hole", &[&cut[..], &["--json"]].concat());
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(document["collision_free"], true);
    assert!(document["min_clearance_m"].as_f64().unwrap() >= 4.99);
    let fallback = document["fallback"].as_str().unwrap();
    assert!(fallback.starts_with("the deadline passed: the leg from item"), "{fallback}");
    let output = planned("inclusion-with-hole", &cut);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("fallback: the deadline passed"), "{text}");
}

#[test]
fn without_time_for_any_path_there_is_no_plan() {
    let output = planned("s1", &["--deadline", "0.001", "--json"]);
    assert_eq!(output.status.code(), Some(3));
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(document["feasible"], false);
    let reason = document["reason"].as_str().unwrap();
    assert!(reason.starts_with("the deadline passed before"), "{reason}");
}

#[test]
fn a_cancelled_plan_ends_before_its_next_round() {
    let name = example("s1");
    let text = std::fs::read(&name).unwrap();
    let Scenario { mission, fences, vehicle, .. } = read_scenario(&name, &text).unwrap();
    let autopilot = vehicle.autopilot;
    let input = Input { mission: &mission, fences: &fences, rally: &[], start: None, autopilot };
    let stop = Stop::new();
    let mut seen = Vec::new();
    let outcome = replan(&input, &Options::default(), &stop, |progress| {
        seen.push(progress.to_string());
        if matches!(progress.stage, Stage::Round { number: 2, .. }) {
            stop.cancel();
        }
    });
    assert!(matches!(outcome, Err(ReplanError::Cancelled)));
    assert_eq!(seen.len(), 3, "{seen:?}");
    assert!(seen[0].starts_with("leg 1/1 (") && seen[0].ends_with("looking for candidates"));
    assert!(seen[2].contains(": round 2, loss "), "{}", seen[2]);
}
