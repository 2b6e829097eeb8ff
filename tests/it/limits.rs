//! What a vehicle's parameters say about its fence, and heights of obstacles, through the program.

use quav::fence::{FenceRegion, FenceRole, FenceSet, FenceShape, encode_fence};
use quav::geodesy::LatLon;
use quav::mission::MissionType;
use serde_json::{Value, json};

use crate::commands::{Field, quavd, stdout_json};

/// A vehicle with the mission of `one-polygon.plan`, which goes up to 325 m from home at 30 m, and
/// with these parameters.
fn field(persona: &str, parameters: Value) -> Field {
    let mut field = Field::new("udpin:127.0.0.1:0", persona, "one-polygon");
    field.vehicle.control(&json!({"cmd": "set", "param": parameters}));
    field
}

/// The exit code and the document of a dry run.
fn dry(field: &Field, more: &[&str]) -> (Option<i32>, Value) {
    let output = field.once(&[&["--json", "--dry-run"], more].concat());
    let code = output.status.code();
    (code, stdout_json(&output))
}

fn reason(said: &Value) -> &str {
    said["reason"].as_str().unwrap_or_default()
}

#[test]
fn ardupilots_limits_count_while_they_are_enforced() {
    let mut field = field("ardupilot", json!({"FENCE_ENABLE": 1}));
    let before = field.vehicle.dump()["mission"].clone();
    let (code, said) = dry(&field, &[]);
    assert_eq!(code, Some(3));
    assert!(reason(&said).contains("FENCE_RADIUS (300 m)"), "{said}");
    assert_eq!(said["settings"]["vehicle_fence"]["radius_m"], 300.0);
    assert_eq!(field.once(&[]).status.code(), Some(3), "and nothing is written");
    assert_eq!(field.vehicle.dump()["mission"], before);

    field.vehicle.control(&json!({"cmd": "set", "param": {"FENCE_RADIUS": 400}}));
    assert_eq!(dry(&field, &[]).0, Some(0));
    field.vehicle.control(&json!({"cmd": "set", "param": {"FENCE_ALT_MAX": 30}}));
    let (code, said) = dry(&field, &[]);
    assert_eq!(code, Some(3));
    assert!(reason(&said).contains("FENCE_ALT_MAX (30 m)"), "{said}");

    field.vehicle.control(&json!({"cmd": "set", "param": {"FENCE_ENABLE": 0}}));
    let (code, said) = dry(&field, &[]);
    assert_eq!(code, Some(0));
    let applied = said["settings"]["vehicle_fence"]["applied"].to_string();
    assert!(applied.contains("switched off (FENCE_ENABLE 0)"), "{applied}");
    let summary = field.once(&["--dry-run"]);
    let summary = String::from_utf8_lossy(&summary.stdout).into_owned();
    assert!(summary.contains("vehicle fence: the fence is switched off"), "{summary}");
}

#[test]
fn px4s_limits_count_where_they_are_set() {
    let mut field = field("px4", json!({"GF_MAX_HOR_DIST": 320}));
    let (code, said) = dry(&field, &[]);
    assert_eq!(code, Some(3));
    assert!(reason(&said).contains("GF_MAX_HOR_DIST (320 m)"), "{said}");
    let more = json!({"GF_MAX_HOR_DIST": 0, "GF_MAX_VER_DIST": 29.5, "GF_ACTION": 0});
    field.vehicle.control(&json!({"cmd": "set", "param": more}));
    let (code, said) = dry(&field, &[]);
    assert_eq!(code, Some(3));
    assert!(reason(&said).contains("GF_MAX_VER_DIST (29.5 m)"), "{said}");
    field.vehicle.control(&json!({"cmd": "set", "param": {"GF_MAX_VER_DIST": 120}}));
    assert_eq!(dry(&field, &[]).0, Some(0));
}

#[test]
fn a_fence_that_is_switched_off_counts_unless_told_otherwise() {
    for (persona, off) in
        [("ardupilot", json!({"FENCE_ENABLE": 0})), ("px4", json!({"GF_ACTION": 0}))]
    {
        let field = field(persona, off);
        let inserted = |said: &Value| said["items_inserted"].as_array().unwrap().len();
        let (code, said) = dry(&field, &[]);
        assert_eq!(code, Some(0), "{persona}: {said}");
        assert!(inserted(&said) > 0, "{persona}: {said}");
        let (code, said) = dry(&field, &["--ignore-disabled-fence"]);
        assert_eq!(code, Some(0), "{persona}: {said}");
        assert_eq!(inserted(&said), 0, "{persona}: {said}");
        assert!(said["warnings"].to_string().contains("left out"), "{persona}: {said}");
    }
    // One that is not switched off counts all the same.
    let field = field("ardupilot", json!({"FENCE_ENABLE": 1, "FENCE_TYPE": 4}));
    let (_, said) = dry(&field, &["--ignore-disabled-fence"]);
    assert!(!said["items_inserted"].as_array().unwrap().is_empty(), "{said}");
}

#[test]
fn the_vehicles_margin_is_kept_where_it_is_larger_than_the_buffer() {
    let field = field("ardupilot", json!({"FENCE_MARGIN": 8}));
    let (code, said) = dry(&field, &[]);
    assert_eq!(code, Some(0));
    assert_eq!(said["settings"]["buffer"], 8.0);
    assert!(said["min_clearance_m"].as_f64().unwrap() >= 8.0, "{said}");
    assert!(said["settings"]["vehicle_fence"]["applied"].to_string().contains("FENCE_MARGIN of 8"));
    assert_eq!(dry(&field, &["--buffer", "9"]).1["settings"]["buffer"], 9.0);
}

#[test]
fn ardupilot_may_join_its_inclusions_and_px4_never_does() {
    // Two fields, of which home is in the western one only, and the mission needs both.
    let area = |west: f64, east: f64| FenceRegion {
        role: FenceRole::Inclusion,
        shape: FenceShape::Polygon(
            [(51.9850, west), (51.9850, east), (51.9890, east), (51.9890, west)]
                .map(|(lat, lon)| LatLon::new(lat, lon).unwrap())
                .to_vec(),
        ),
        heights: None,
        origin: String::new(),
    };
    let regions = vec![area(5.6610, 5.6660), area(5.6640, 5.6690)];
    let items = encode_fence(&FenceSet { regions, return_point: None }).unwrap();
    let with = |persona: &str, parameters: Value| {
        let mut field = field(persona, parameters);
        field.vehicle.set(MissionType::Fence, &items);
        field
    };
    let joined = with("ardupilot", json!({"FENCE_OPTIONS": 3}));
    let (code, said) = dry(&joined, &[]);
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(said["settings"]["inclusion"], "any");
    assert_eq!(dry(&joined, &["--inclusion", "all"]).0, Some(3), "what is asked for counts");
    assert_eq!(dry(&with("ardupilot", json!({"FENCE_OPTIONS": 1})), &[]).0, Some(3));
    let (code, said) = dry(&with("px4", json!({})), &[]);
    assert_eq!(code, Some(3));
    assert!(said["warnings"].to_string().contains("PX4 would leave this inclusion out"), "{said}");
}

#[test]
fn an_obstacle_that_is_low_enough_is_flown_over() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("barn.geojson");
    let ring = [[5.665, 51.986], [5.666, 51.986], [5.666, 51.9869], [5.665, 51.9869]];
    let ring = [&ring[..], &ring[..1]].concat();
    let barn = |height: f64| {
        json!({
            "type": "Feature", "properties": {"name": "barn", "height": height},
            "geometry": {"type": "Polygon", "coordinates": [ring]},
        })
    };
    let field = field("ardupilot", json!({}));
    let path_text = path.to_string_lossy().into_owned();
    let judged = |height: f64, more: &[&str]| {
        std::fs::write(&path, barn(height).to_string()).unwrap();
        let options = ["--ignore-disabled-fence", "--obstacles", &path_text];
        let (code, said) = dry(&field, &[&options, more].concat());
        assert_eq!(code, Some(0), "{said}");
        let over = said["legs"][0]["flown_over_or_under"].to_string().contains("barn");
        let unchanged = said["items_inserted"].as_array().unwrap().is_empty();
        (over, unchanged, said)
    };
    // 30 m above home, 10 m to keep, 5 m of ground. The way home, how high it is flown unknown,
    // passes north of the barn.
    let (over, unchanged, said) = judged(15.0, &["--ground-relief", "5"]);
    assert!(over && unchanged, "{said}");
    let (over, unchanged, _) = judged(15.5, &["--ground-relief", "5"]);
    assert!(!over && !unchanged);
    let (over, unchanged, said) = judged(15.0, &[]);
    assert!(!over && !unchanged);
    assert!(said["warnings"].to_string().contains("--ground-relief"), "{said}");
    let (over, unchanged, _) = judged(20.0, &["--ground-relief", "5", "--vertical-margin", "5"]);
    assert!(over && unchanged);

    // The same from a file, in words.
    std::fs::write(&path, barn(9.0).to_string()).unwrap();
    let scenario = format!("{}/fence_examples/one-polygon.waypoints", env!("CARGO_MANIFEST_DIR"));
    let options = ["check", &scenario, "--obstacles", &path_text, "--ground-relief", "5"];
    let output = quavd(&options);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("barn") && words.contains("by its altitude"), "{text}");
}
