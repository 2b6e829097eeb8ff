//! The program itself against the fake vehicle: what arrives is judged by `sitl/judge.py`, which
//! shares no code with quavd.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use quav::mission::MissionType;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::sitl::{FakeVehicle, PERSONAS};

/// The scenarios with their exact shortest lengths, metres: bracketed from both sides to 1 cm by
/// a solver that is not part of quavd.
const SCENARIOS: [(&str, f64); 6] = [
    ("s1", 804.47),
    ("s2", 583.33),
    ("s3", 351.66),
    ("s4", 465.75),
    ("s5", 354.07),
    ("s6", 632.90),
];

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn example(name: &str) -> String {
    root(&format!("fence_examples/{name}.plan")).to_string_lossy().into_owned()
}

pub(crate) fn quavd(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_quavd")).args(arguments).output().unwrap()
}

/// A vehicle with a scenario, and a directory for records.
pub(crate) struct Field {
    pub(crate) vehicle: FakeVehicle,
    state: TempDir,
}

impl Field {
    pub(crate) fn new(link: &str, persona: &str, scenario: &str) -> Self {
        let plan = example(scenario);
        let vehicle = FakeVehicle::start_on(link, &["--persona", persona, "--mission", &plan]);
        Self { vehicle, state: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn once(&self, more: &[&str]) -> Output {
        let url = self.vehicle.endpoint().to_string();
        let state = self.state.path().to_string_lossy().into_owned();
        let mut arguments = vec!["once", "--connect", &url, "--state-dir", &state, "--system", "1"];
        arguments.extend(more);
        quavd(&arguments)
    }
}

pub(crate) fn stdout_json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| {
        panic!(
            "{error}: {}\n{}",
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        )
    })
}

fn all_six_over(link: &str, persona: &str) {
    for (name, exact) in SCENARIOS {
        let mut field = Field::new(link, persona, name);
        let output = field.once(&["--json"]);
        let what = format!("{name} {persona} {link}");
        assert_eq!(
            output.status.code(),
            Some(0),
            "{what}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        let verdict = field.vehicle.judged();
        assert_eq!(verdict["collisions"], 0, "{what}: {verdict}");
        assert!(verdict["min_clearance_m"].as_f64().unwrap() >= 4.99, "{what}: {verdict}");
        assert!(verdict["length_m"].as_f64().unwrap() <= 1.05 * exact, "{what}: {verdict}");
        // What was said is what is there.
        let said = stdout_json(&output);
        let length = said["length_m"].as_f64().unwrap();
        assert!((length - verdict["length_m"].as_f64().unwrap()).abs() < 0.05, "{what}: {said}");
        assert_eq!(said["vehicle"]["uploaded"], true);
        assert_eq!(said["vehicle"]["verified"], true);
    }
}

macro_rules! all_six {
    ($($name:ident: $link:expr, $persona:expr;)*) => {$(
        #[test]
        fn $name() {
            all_six_over($link, $persona);
        }
    )*};
}

all_six! {
    the_six_scenarios_arrive_on_ardupilot_over_udp: "udpin:127.0.0.1:0", "ardupilot";
    the_six_scenarios_arrive_on_ardupilot_over_tcp: "tcpin:127.0.0.1:0", "ardupilot";
    the_six_scenarios_arrive_on_ardupilot_over_a_serial_line: "pty", "ardupilot";
    the_six_scenarios_arrive_on_px4_over_udp: "udpin:127.0.0.1:0", "px4";
    the_six_scenarios_arrive_on_px4_over_tcp: "tcpin:127.0.0.1:0", "px4";
    the_six_scenarios_arrive_on_px4_over_a_serial_line: "pty", "px4";
}

#[test]
fn plan_and_once_give_the_same_waypoints_for_the_same_seed() {
    for (name, _) in SCENARIOS {
        let field = Field::new("udpin:127.0.0.1:0", "ardupilot", name);
        let once = stdout_json(&field.once(&["--json", "--dry-run", "--seed", "7"]));
        let plan = stdout_json(&quavd(&["plan", &example(name), "--json", "--seed", "7"]));
        assert!(once["waypoints"].as_array().unwrap().len() > 2);
        assert_eq!(once["waypoints"], plan["waypoints"], "{name}");
    }
}

#[test]
fn planning_the_same_mission_again_writes_nothing() {
    for persona in PERSONAS {
        let mut field = Field::new("udpin:127.0.0.1:0", persona, "s5");
        assert_eq!(field.once(&[]).status.code(), Some(0));
        let after_first = field.vehicle.dump();
        let again = stdout_json(&field.once(&["--json"]));
        assert_eq!(again["vehicle"]["uploaded"], false);
        assert_eq!(again["vehicle"]["verified"], true);
        let after_second = field.vehicle.dump();
        assert_eq!(after_first["mission"], after_second["mission"]);
        assert_eq!(after_first["uploads"], after_second["uploads"]);
    }
}

#[test]
fn an_infeasible_scenario_ends_with_3_and_leaves_the_vehicle_alone() {
    for persona in PERSONAS {
        let mut field = Field::new("udpin:127.0.0.1:0", persona, "infeasible");
        let before = field.vehicle.dump();
        let output = field.once(&["--json"]);
        assert_eq!(output.status.code(), Some(3));
        let said = stdout_json(&output);
        assert_eq!(said["feasible"], false);
        assert!(said["reason"].as_str().unwrap().contains("no safe path"), "{said}");
        let after = field.vehicle.dump();
        assert_eq!(before["mission"], after["mission"]);
        assert_eq!(after["uploads"].as_array().unwrap().len(), 0);
    }
}

#[test]
fn a_vehicle_lost_in_mid_upload_ends_with_4_and_restore_puts_the_original_back() {
    for persona in PERSONAS {
        let mut field = Field::new("udpin:127.0.0.1:0", persona, "s5");
        let before = field.vehicle.dump()["mission"]["items"].clone();
        field.vehicle.fault("vanish:item=2,type=mission,when=upload");
        let output = field.once(&[]);
        assert_eq!(output.status.code(), Some(4), "{}", String::from_utf8_lossy(&output.stderr));
        // It comes back with what its storage held: half a mission on ArduPilot.
        let mut left = field.vehicle.held(MissionType::Mission);
        assert_eq!(persona == "px4", json!(left) == before, "{left:?}");
        left.drain(..usize::from(persona == "ardupilot"));
        field.vehicle = FakeVehicle::start(&["--persona", persona, "--mission", &example("s5")]);
        field.vehicle.control(&json!({"cmd": "set", "mission": left}));
        let output = field.once(&["--restore"]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(field.vehicle.dump()["mission"]["items"], before, "{persona}");
    }
}

#[test]
fn an_armed_vehicle_is_refused_with_5() {
    let mut field = Field::new("udpin:127.0.0.1:0", "ardupilot", "s5");
    field.vehicle.control(&json!({"cmd": "set", "armed": true}));
    let before = field.vehicle.dump()["mission"].clone();
    let output = field.once(&[]);
    assert_eq!(output.status.code(), Some(5), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(field.vehicle.dump()["mission"], before);
}

#[test]
fn nobody_there_ends_with_4_and_a_bad_option_with_2() {
    let silent = ["once", "--connect", "udpin:127.0.0.1:0", "--wait", "1"];
    let state = tempfile::tempdir().unwrap();
    let state = state.path().to_string_lossy().into_owned();
    let output = quavd(&[&silent[..], &["--state-dir", &state]].concat());
    assert_eq!(output.status.code(), Some(4));
    assert_eq!(quavd(&["once", "--connect", "carrier-pigeon:1"]).status.code(), Some(2));
    assert_eq!(quavd(&["plan", "no-such-file.plan"]).status.code(), Some(2));
    let negative = quavd(&["plan", &example("s1"), "--buffer", "-1"]);
    assert_eq!(negative.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&negative.stderr).contains("'-1' is not a number from"));
}

#[test]
fn check_finds_the_collision_in_the_original_and_none_in_the_plan() {
    let directory = tempfile::tempdir().unwrap();
    let planned = directory.path().join("planned.waypoints").to_string_lossy().into_owned();
    let picture = directory.path().join("planned.svg").to_string_lossy().into_owned();
    let output = quavd(&["plan", &example("s4"), "--out", &planned, "--out", &picture]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(std::fs::read_to_string(&picture).unwrap().starts_with("<svg"));

    let before = quavd(&["check", &example("s4"), "--json"]);
    assert_eq!(before.status.code(), Some(3));
    assert_eq!(stdout_json(&before)["collision_free"], false);
    let after = quavd(&["check", &example("s4"), &planned, "--json"]);
    assert_eq!(after.status.code(), Some(0), "{}", String::from_utf8_lossy(&after.stderr));
    assert!(stdout_json(&after)["min_clearance_m"].as_f64().unwrap() >= 5.0);
}

#[test]
fn files_that_do_not_belong_together_are_doubted() {
    let said = |arguments: &[&str]| {
        let output = quavd(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}");
        let text = String::from_utf8(output.stdout).unwrap();
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let example = |name: &str| root(&format!("fence_examples/{name}")).display().to_string();
    let (mission, fence) = (example("one-polygon.waypoints"), example("one-polygon.kml"));
    let (elsewhere, planned) = (example("infeasible.plan"), example("one-polygon.plan"));
    let none = "warning: no fence or obstacle was given";
    // The two files of `check` in the wrong order.
    assert!(said(&["check", &mission, &mission]).contains(none));
    assert!(said(&["plan", &mission]).contains(none));
    let text = said(&["plan", &mission, "--fence", &elsewhere]);
    assert!(text.contains("km from the mission: are the files of the same place?"), "{text}");
    for right in [&["plan", &mission, "--fence", &fence][..], &["plan", &planned]] {
        let text = said(right);
        assert!(!text.contains("no fence or") && !text.contains("same place"), "{text}");
    }
}

#[test]
fn every_example_plans_or_says_why_not() {
    let mut plans = 0;
    for entry in std::fs::read_dir(root("fence_examples")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|suffix| suffix != "plan") {
            continue;
        }
        plans += 1;
        let infeasible = path.file_stem().unwrap() == "infeasible";
        let output = quavd(&["plan", &path.to_string_lossy(), "--json"]);
        let expected = if infeasible { 3 } else { 0 };
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(expected), "{}: {errors}", path.display());
        assert_eq!(stdout_json(&output)["feasible"], !infeasible);
    }
    assert!(plans >= 11);
}

/// s5's vehicle in the air over its home, at its takeoff.
fn in_the_air(persona: &str, mode: &str) -> (Field, Value) {
    let mut field = Field::new("udpin:127.0.0.1:0", persona, "s5");
    let first = if persona == "ardupilot" { 1 } else { 0 };
    let before = field.vehicle.dump()["mission"].take();
    over_its_takeoff(&mut field, mode, first);
    (field, before)
}

/// Puts a vehicle into the air over the first item of its mission.
fn over_its_takeoff(field: &mut Field, mode: &str, first: usize) {
    let dump = field.vehicle.dump();
    let item = &dump["mission"]["items"][first];
    let degrees = |axis: &str| item[axis].as_f64().unwrap() / 1e7;
    let above = json!([degrees("x"), degrees("y"), dump["home"]["alt"].as_f64().unwrap() + 30.0]);
    field.vehicle.control(&json!({
        "cmd": "set", "armed": true, "mode": mode, "current": first, "position": above
    }));
}

#[test]
fn in_flight_the_rest_of_the_mission_is_planned_and_the_vehicle_flies_on() {
    for (persona, mode) in [("px4", "MISSION"), ("ardupilot", "LOITER")] {
        let (mut field, _) = in_the_air(persona, mode);
        let current = field.vehicle.dump()["current_seq"].clone();
        let output = field.once(&["--json", "--in-flight"]);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{persona}: {errors}");
        assert_eq!(stdout_json(&output)["vehicle"]["uploaded"], true);
        assert_eq!(field.vehicle.judged()["collisions"], 0, "{persona}");
        assert_eq!(field.vehicle.dump()["current_seq"], current, "{persona}");
    }
}

#[test]
fn in_flight_ardupilot_is_refused_with_5_while_it_flies_its_mission() {
    let (mut field, before) = in_the_air("ardupilot", "AUTO");
    let output = field.once(&["--in-flight"]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(5), "{errors}");
    assert!(errors.contains("flies its mission"), "{errors}");
    assert_eq!(field.vehicle.dump()["mission"], before);
}

#[test]
fn in_flight_a_way_to_the_current_item_that_is_not_clear_is_refused_with_3() {
    let (mut field, _) = in_the_air("px4", "MISSION");
    // As if it had already been at the first item: the way to the second leads through a fence.
    field.vehicle.control(&json!({"cmd": "set", "current": 1}));
    let before = field.vehicle.dump()["mission"].clone();
    let output = field.once(&["--in-flight"]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{errors}");
    assert!(errors.contains("from where the vehicle is"), "{errors}");
    assert_eq!(field.vehicle.dump()["mission"]["items"], before["items"]);
}

#[test]
fn in_flight_a_vehicle_that_has_moved_behind_an_obstacle_meanwhile_is_told_of() {
    let state = tempfile::tempdir().unwrap();
    let script = state.path().join("script");
    // At the far end of s5, which is behind the obstacles.
    let end = std::fs::read_to_string(example("s5")).unwrap();
    let end: Value = serde_json::from_str(&end).unwrap();
    let mut places = end["mission"]["items"].as_array().unwrap().iter().map(|item| &item["params"]);
    let far = places.rfind(|params| params[4].as_f64() > Some(0.0)).unwrap();
    let moved = json!({
        "on": "upload_ended", "cmd": "set", "position": [far[4], far[5], 500.0]
    });
    std::fs::write(&script, format!("{moved}\n")).unwrap();
    let (plan, script) = (example("s5"), script.to_string_lossy().into_owned());
    let arguments = ["--persona", "px4", "--mission", &plan, "--script", &script];
    let mut field = Field { vehicle: FakeVehicle::start(&arguments), state };
    over_its_takeoff(&mut field, "MISSION", 0);
    let output = field.once(&["--in-flight"]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{errors}");
    assert!(errors.contains("the new mission is on the vehicle, but the way"), "{errors}");
}

#[test]
fn a_vehicle_with_little_room_is_refused_with_5_or_gets_fewer_waypoints() {
    let mut field = Field::new("udpin:127.0.0.1:0", "px4", "s1");
    let before = field.vehicle.dump();
    let full = stdout_json(&field.once(&["--json", "--dry-run"]));
    let waypoints = full["waypoints"].as_array().unwrap().len();
    let output = field.once(&["--max-items", "2"]);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(5), "{errors}");
    assert!(errors.contains("more than the 2 of --max-items"), "{errors}");
    assert_eq!(field.vehicle.dump()["mission"], before["mission"]);
    assert_eq!(field.vehicle.dump()["uploads"].as_array().unwrap().len(), 0);

    let inserted = before["mission"]["count"].as_u64().unwrap() as usize;
    let inserted = waypoints - inserted.min(waypoints);
    let fewer = (inserted - 1).to_string();
    let output = field.once(&["--json", "--max-waypoints", &fewer]);
    let errors = String::from_utf8_lossy(&output.stderr);
    match output.status.code() {
        Some(0) => {
            let said = stdout_json(&output);
            assert!(said["warnings"].to_string().contains("corners were merged"), "{said}");
            assert_eq!(field.vehicle.judged()["collisions"], 0);
        }
        Some(3) => assert!(errors.contains("inserted waypoints was found"), "{errors}"),
        code => panic!("{code:?}: {errors}"),
    }
    let output = field.once(&["--max-waypoints", "0"]);
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
}
