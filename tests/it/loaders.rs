//! Files that quavd writes, in other people's loaders: pymavlink's `mavwp`, MAVProxy's own modules,
//! and QGroundControl's documentation as a JSON schema (`sitl/loaders.py`).

use std::path::{Path, PathBuf};
use std::process::Command;

use quav::fence::{FenceRole, FenceShape, encode_fence};
use quav::formats::{
    Scenario, read_scenario, write_fence_text, write_plan, write_waypoints, write_waypoints_fence,
    write_waypoints_rally,
};
use quav::mission::MissionItem;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::sitl::python;

fn examples() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fence_examples");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        files.filter(|path| path.is_file() && path.extension().unwrap() != "md").collect();
    files.sort();
    files
}

fn load(path: &Path) -> Scenario {
    let name = path.file_name().unwrap().to_str().unwrap();
    read_scenario(name, &std::fs::read(path).unwrap()).unwrap()
}

/// What the loaders make of files: one program for all of them, as it takes a while to start.
fn seen(kind: &str, files: &[PathBuf]) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("sitl/loaders.py");
    let output = Command::new(python()).arg(script).arg(kind).args(files).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "{files:?}: {said}{}",
        String::from_utf8_lossy(&output.stdout)
    );
    serde_json::from_slice(&output.stdout).unwrap()
}

fn write(directory: &TempDir, name: &str, text: &str) -> PathBuf {
    let path = directory.path().join(name);
    std::fs::write(&path, text).unwrap();
    path
}

/// Degrees as 1e-7 degrees; one off is what truncation in a loader makes.
fn assert_near(degrees: &Value, e7: i32, context: &str) {
    let difference = degrees.as_f64().unwrap() * 1e7 - f64::from(e7);
    assert!(difference.abs() < 1.01, "{context}: {degrees} is not {e7}");
}

fn assert_items(items: &Value, expected: &[MissionItem], context: &str) {
    let items = items.as_array().unwrap();
    assert_eq!(items.len(), expected.len(), "{context}");
    for (item, expected) in items.iter().zip(expected) {
        let context = format!("{context}, item {}", expected.seq);
        assert_eq!(item["command"], expected.command.0, "{context}");
        assert_eq!(item["frame"], expected.frame.0, "{context}");
        assert_eq!(item["autocontinue"], expected.autocontinue, "{context}");
        if expected.frame.is_global() {
            assert_near(&item["x"], expected.x, &context);
            assert_near(&item["y"], expected.y, &context);
        }
        let number =
            |value: f32| if value.is_nan() { Value::Null } else { json!(f64::from(value)) };
        let is = |seen: &Value, expected: f32, what: &str| match (seen.as_f64(), number(expected)) {
            (Some(seen), Value::Number(_)) => assert_eq!(seen as f32, expected, "{context} {what}"),
            (None, Value::Null) => {}
            (seen, expected) => panic!("{context} {what}: {seen:?}, not {expected}"),
        };
        is(&item["z"], expected.z, "z");
        for (k, param) in expected.params.iter().enumerate() {
            is(&item["params"][k], *param, "param");
        }
    }
}

/// The mission's items as a file of item 0 and the rest holds them: jumps count home.
fn in_file(scenario: &Scenario) -> Vec<MissionItem> {
    let mut items = scenario.mission.items.clone();
    for item in &mut items {
        item.seq += 1;
        if item.command.0 == 177 {
            item.params[0] += 1.0;
        }
    }
    items
}

#[test]
fn waypoint_files_open_in_mavwp_and_mavproxy_with_every_item() {
    let directory = tempfile::tempdir().unwrap();
    let scenarios: Vec<_> =
        examples().iter().map(|example| (example.clone(), load(example))).collect();
    let missions: Vec<_> =
        scenarios.iter().filter(|(_, scenario)| !scenario.mission.items.is_empty()).collect();
    let written = |(number, (_, scenario)): (usize, &&(PathBuf, Scenario))| {
        let text = write_waypoints(&scenario.mission).unwrap();
        write(&directory, &format!("{number}.waypoints"), &text)
    };
    let files: Vec<PathBuf> = missions.iter().enumerate().map(written).collect();
    let seen = seen("mission", &files);
    for (number, (example, scenario)) in missions.iter().enumerate() {
        for loader in ["mavwp", "mavproxy"] {
            let items = Value::Array(seen[number][loader].as_array().unwrap()[1..].to_vec());
            let context = format!("{} in {loader}", example.display());
            assert_items(&items, &in_file(scenario), &context);
        }
    }
    assert!(missions.len() > 10);
}

#[test]
fn fences_open_in_mavwp_and_mavproxy_with_every_region() {
    let directory = tempfile::tempdir().unwrap();
    // Each file with what is in it, and whether it is old text.
    let mut files = Vec::new();
    let mut expected = Vec::new();
    for (number, example) in examples().iter().enumerate() {
        let scenario = load(example);
        if scenario.fences.regions.is_empty() {
            continue;
        }
        let context = example.display().to_string();
        let text = write_waypoints_fence(&scenario.fences).unwrap();
        files.push(write(&directory, &format!("{number}.fence"), &text));
        expected.push((scenario.clone(), context.clone(), false));
        if let Ok(text) = write_fence_text(&scenario.fences) {
            files.push(write(&directory, &format!("{number}.fen"), &text));
            expected.push((scenario, format!("{context} as old text"), true));
        }
    }
    let seen = seen("fence", &files);
    for (number, (scenario, context, is_old)) in expected.iter().enumerate() {
        let view = &seen[number];
        if !is_old {
            let items = encode_fence(&scenario.fences).unwrap();
            assert_items(&view["mavwp"], &items, context);
            assert_items(&view["mavproxy"], &items, context);
        }
        assert_regions(&view["regions"], scenario, context);
    }
    let old = expected.iter().filter(|(.., is_old)| *is_old).count();
    let fences = expected.len() - old;
    assert!(fences > 15 && old > 0, "{fences} fences, {old} as old text");
}

fn assert_regions(seen: &Value, scenario: &Scenario, context: &str) {
    let kinds = [
        ("inclusion_polygons", FenceRole::Inclusion, false),
        ("exclusion_polygons", FenceRole::Exclusion, false),
        ("inclusion_circles", FenceRole::Inclusion, true),
        ("exclusion_circles", FenceRole::Exclusion, true),
    ];
    for (key, role, circles) in kinds {
        let of_kind = |shape: &FenceShape| matches!(shape, FenceShape::Circle { .. }) == circles;
        let regions = scenario.fences.regions.iter();
        let expected: Vec<_> =
            regions.filter(|r| r.role == role && of_kind(&r.shape)).map(|r| &r.shape).collect();
        let found = seen[key].as_array().unwrap();
        assert_eq!(found.len(), expected.len(), "{context}: {key}");
        for (found, expected) in found.iter().zip(expected) {
            match expected {
                FenceShape::Polygon(ring) => {
                    assert_eq!(found.as_array().unwrap().len(), ring.len(), "{context}: {key}");
                    for (vertex, expected) in found.as_array().unwrap().iter().zip(ring) {
                        assert_near(&vertex[0], expected.to_e7().lat, context);
                        assert_near(&vertex[1], expected.to_e7().lon, context);
                    }
                }
                FenceShape::Circle { centre, radius } => {
                    assert_near(&found[0], centre.to_e7().lat, context);
                    assert_near(&found[1], centre.to_e7().lon, context);
                    let difference = found[2].as_f64().unwrap() - radius.0;
                    assert!(difference.abs() < 1e-3, "{context}: radius {difference} off");
                }
            }
        }
    }
    let point = scenario.fences.return_point.map(|(place, _)| place.to_e7());
    assert_eq!(seen["return_point"].is_null(), point.is_none(), "{context}");
    if let Some(point) = point {
        assert_near(&seen["return_point"][0], point.lat, context);
        assert_near(&seen["return_point"][1], point.lon, context);
    }
}

#[test]
fn rally_points_open_in_mavwp_and_mavproxy() {
    let directory = tempfile::tempdir().unwrap();
    let mut files = 0;
    for example in examples() {
        let scenario = load(&example);
        if scenario.rally.is_empty() {
            continue;
        }
        let path = write(&directory, "a.rally", &write_waypoints_rally(&scenario.rally));
        let seen = seen("rally", &[path]);
        for loader in ["mavwp", "mavproxy"] {
            assert_items(&seen[0][loader], &scenario.rally, &example.display().to_string());
        }
        files += 1;
    }
    assert!(files > 0);
}

#[test]
fn plans_are_what_qgroundcontrols_documentation_says() {
    let directory = tempfile::tempdir().unwrap();
    let mut written = Vec::new();
    for (number, example) in examples().iter().enumerate() {
        let text = write_plan(&load(example)).unwrap();
        written.push(write(&directory, &format!("{number}.plan"), &text));
    }
    let seen = seen("plan", &written);
    assert_eq!(seen["problems"], json!([]));
    assert_eq!(seen["files"], written.len());
}
