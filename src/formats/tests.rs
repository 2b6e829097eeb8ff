//! Tests across formats: twins agree, what is written reads back, messages name the place.

use std::path::{Path, PathBuf};

use proptest::prelude::*;

use super::*;
use crate::fence::{FenceRegion, FenceRole, FenceShape};
use crate::geodesy::LatLon;
use crate::mission::Command;

mod mutation;
mod samples;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fence_examples")
}

/// All files of `fence_examples`, but for its README and pictures.
fn examples() -> Vec<PathBuf> {
    let mut files: Vec<_> = std::fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file() && path.extension().is_some_and(|suffix| suffix != "md"))
        .collect();
    files.sort();
    files
}

fn load(path: &Path) -> Scenario {
    let name = path.file_name().unwrap().to_str().unwrap();
    read_scenario(name, &std::fs::read(path).unwrap()).unwrap_or_else(|error| panic!("{error}"))
}

fn example(name: &str) -> Scenario {
    load(&folder().join(name))
}

fn parse(text: &str) -> Scenario {
    read_scenario("file", text.as_bytes()).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn error_of(text: &str) -> String {
    read_scenario("file", text.as_bytes()).unwrap_err().to_string()
}

/// Equality in which NaN is NaN: the debug form prints every bit that matters.
fn text_of(value: &impl std::fmt::Debug) -> String {
    format!("{value:?}")
}

/// Regions without their names, each ring counter-clockwise, polygons before circles.
fn regions(fences: &FenceSet) -> Vec<(FenceRole, FenceShape)> {
    let plain = |region: &FenceRegion| (region.role, oriented(&region.shape));
    let mut regions: Vec<_> = fences.regions.iter().map(plain).collect();
    regions.sort_by_key(|(_, shape)| matches!(shape, FenceShape::Circle { .. }));
    regions
}

fn oriented(shape: &FenceShape) -> FenceShape {
    let FenceShape::Polygon(ring) = shape else { return shape.clone() };
    let mut ring = ring.clone();
    let next = ring.iter().cycle().skip(1);
    let turn = |(a, b): (&LatLon, &LatLon)| a.lon() * b.lat() - b.lon() * a.lat();
    if ring.iter().zip(next).map(turn).sum::<f64>() < 0.0 {
        ring[1..].reverse();
    }
    FenceShape::Polygon(ring)
}

fn assert_same(one: &Scenario, other: &Scenario, context: &str) {
    assert_eq!(text_of(&one.mission), text_of(&other.mission), "{context}");
    assert_eq!(regions(&one.fences), regions(&other.fences), "{context}");
    assert_eq!(one.fences.return_point, other.fences.return_point, "{context}");
    assert_eq!(text_of(&one.rally), text_of(&other.rally), "{context}");
}

#[test]
fn every_example_is_read() {
    let files = examples();
    assert!(files.len() >= 12, "{files:?}");
    for file in files {
        let scenario = load(&file);
        let empty = scenario.mission.items.is_empty()
            && scenario.fences.regions.is_empty()
            && scenario.rally.is_empty();
        assert!(!empty, "{}", file.display());
    }
}

#[test]
fn the_geojson_twin_of_a_plan_is_the_same_scenario() {
    for number in 1..=6 {
        let plan = example(&format!("s{number}.plan"));
        let twin = example(&format!("s{number}.geojson"));
        assert_same(&plan, &twin, &format!("S{number}"));
        assert!(plan.warnings.is_empty() && twin.warnings.is_empty());
    }
}

/// Commands and places, which all formats agree on; yaw is unset in some and 0 in others.
fn flown(mission: &Mission) -> Vec<(Command, i32, i32, f32)> {
    mission.items.iter().map(|item| (item.command, item.x, item.y, item.z)).collect()
}

#[test]
fn the_same_example_in_several_formats_is_the_same() {
    let plan = example("one-polygon.plan");
    assert_eq!(flown(&plan.mission), flown(&example("one-polygon.waypoints").mission));
    for twin in ["one-polygon-fence.waypoints", "one-polygon.geojson", "one-polygon.kml"] {
        assert_eq!(regions(&example(twin).fences), regions(&plan.fences), "{twin}");
    }
    let plan = example("circles.plan");
    let twin = example("circles.waypoints");
    assert_eq!(flown(&plan.mission), flown(&twin.mission));
    assert_eq!(plan.mission.home, twin.mission.home);
    assert_eq!(plan.mission.items[7].params[..2], [2.0, 1.0], "the jump goes to index 2");
    assert_eq!(regions(&example("circles-fence.waypoints").fences), regions(&plan.fences));
    assert_eq!(text_of(&example("circles-rally.waypoints").rally), text_of(&plan.rally));

    let plan = example("inclusion-with-hole.plan").fences;
    let mut twin = regions(&example("inclusion-with-hole.geojson").fences);
    // The hole of the polygon is the pond, from another vertex on.
    let (FenceShape::Polygon(hole), FenceShape::Polygon(pond)) =
        (&mut twin[1].1, &plan.regions[1].shape)
    else {
        panic!()
    };
    let first = hole.iter().position(|vertex| *vertex == pond[0]).unwrap();
    hole.rotate_left(first);
    assert_eq!(twin, regions(&plan));
    assert_eq!(regions(&example("inclusion-fence.txt").fences), regions(&plan)[..1]);
    let corridor = regions(&example("corridor.plan").fences);
    assert_eq!(regions(&example("corridor.geojson").fences), corridor);
}

#[test]
fn every_example_reads_back_from_every_format() {
    for file in examples() {
        let scenario = load(&file);
        let context = file.display().to_string();
        assert_same(&parse(&write_plan(&scenario).unwrap()), &scenario, &context);
        assert_same(&parse(&write_geojson(&scenario).unwrap()), &scenario, &context);
        assert_same(&parse(&write_kml(&scenario).unwrap()), &scenario, &context);
        let mission = parse(&write_waypoints(&scenario.mission).unwrap()).mission;
        assert_eq!(text_of(&mission), text_of(&scenario.mission), "{context}");
        let fences = parse(&write_waypoints_fence(&scenario.fences).unwrap()).fences;
        assert_eq!(regions(&fences), regions(&scenario.fences), "{context}");
    }
}

/// Printable properties under names that no reader knows.
fn properties() -> impl Strategy<Value = serde_json::Map<String, serde_json::Value>> {
    let value = prop_oneof![
        "[ -~é]{0,12}".prop_map(serde_json::Value::from),
        "(5|true|null|\\[1\\]|-1e3| x )".prop_map(serde_json::Value::from),
        any::<i32>().prop_map(serde_json::Value::from),
        any::<bool>().prop_map(serde_json::Value::from),
        Just(serde_json::json!({"a": [1, null, {"b": "c"}]})),
    ];
    prop::collection::btree_map("x-[a-z<&\"]{0,4}|name", value, 0..4)
        .prop_map(|map| map.into_iter().collect())
}

proptest! {
    #[test]
    fn properties_of_features_are_kept_across_geojson_and_kml(
        scenario in samples::scenario(),
        given in properties(),
    ) {
        // As if each feature of a file had these properties besides its own.
        let mut document: serde_json::Value =
            serde_json::from_str(&write_geojson(&scenario).unwrap()).unwrap();
        for feature in document["features"].as_array_mut().unwrap() {
            let own = feature["properties"].as_object_mut().unwrap();
            own.extend(given.clone());
        }
        let read = parse(&document.to_string());
        assert_same(&read, &scenario, "with properties");
        let kept = |text: &str| -> Vec<serde_json::Map<String, serde_json::Value>> {
            let document: serde_json::Value = serde_json::from_str(text).unwrap();
            let features = document["features"].as_array().unwrap().iter();
            features.map(|feature| feature["properties"].as_object().unwrap().clone()).collect()
        };
        let direct = write_geojson(&read).unwrap();
        let over_kml = write_geojson(&parse(&write_kml(&read).unwrap())).unwrap();
        let over_kmz = read_scenario("file", &write_kmz(&read).unwrap()).unwrap();
        for written in [direct, over_kml, write_geojson(&over_kmz).unwrap()] {
            for (number, own) in kept(&written).iter().enumerate() {
                for (key, value) in &given {
                    prop_assert_eq!(own.get(key), Some(value), "feature {}: {}", number, key);
                }
            }
        }
    }

    #[test]
    fn what_is_written_reads_back_the_same(scenario in samples::scenario()) {
        assert_same(&parse(&write_plan(&scenario).unwrap()), &scenario, ".plan");
        assert_same(&parse(&write_geojson(&scenario).unwrap()), &scenario, ".geojson");
        assert_same(&parse(&write_kml(&scenario).unwrap()), &scenario, ".kml");
        let kmz = read_scenario("file", &write_kmz(&scenario).unwrap()).unwrap();
        assert_same(&kmz, &scenario, ".kmz");
        let mission = parse(&write_waypoints(&scenario.mission).unwrap()).mission;
        prop_assert_eq!(text_of(&mission), text_of(&scenario.mission));
        let fences = parse(&write_waypoints_fence(&scenario.fences).unwrap()).fences;
        prop_assert_eq!(regions(&fences), regions(&scenario.fences));
        prop_assert_eq!(fences.return_point, scenario.fences.return_point);
        let rally = parse(&write_waypoints_rally(&scenario.rally)).rally;
        prop_assert_eq!(text_of(&rally), text_of(&scenario.rally));
        match write_fence_text(&scenario.fences) {
            Ok(text) => {
                let fences = parse(&text).fences;
                prop_assert_eq!(regions(&fences), regions(&scenario.fences));
                let place = |fences: &FenceSet| fences.return_point.map(|(place, _)| place);
                prop_assert_eq!(place(&fences), place(&scenario.fences));
            }
            Err(error) => prop_assert!(error.to_string().contains("one inclusion polygon")),
        }
    }

    #[test]
    fn a_file_that_is_read_is_written_and_read_to_the_last_byte(scenario in samples::scenario()) {
        for write in [write_plan, write_geojson, write_kml] {
            let once = write(&scenario).unwrap();
            prop_assert_eq!(&write(&parse(&once)).unwrap(), &once);
        }
    }
}

#[test]
fn heights_are_kept_across_geojson_kml_and_kmz() {
    for (properties, amsl) in [
        (r#"{"name":"mast","height":12.5}"#, false),
        (r#"{"min_height":3,"max_height":20}"#, false),
        (r#"{"height":455.25,"height_reference":"amsl"}"#, true),
    ] {
        let scenario = parse(&format!(
            r#"{{"type":"Feature","properties":{properties},"geometry":{{"type":"Polygon",
            "coordinates":[[[8,47],[8.1,47],[8.1,47.1],[8,47]]]}}}}"#
        ));
        let heights = scenario.fences.regions[0].heights.unwrap();
        assert_eq!(heights.reference == crate::fence::HeightReference::MeanSeaLevel, amsl);
        // As they were read, and from a vehicle's or another file's regions.
        for scenario in [scenario.clone(), Scenario { kept: Kept::default(), ..scenario }] {
            let kmz = read_scenario("file", &write_kmz(&scenario).unwrap()).unwrap();
            let geojson = parse(&write_geojson(&scenario).unwrap());
            for again in [geojson, parse(&write_kml(&scenario).unwrap()), kmz] {
                assert_eq!(again.fences.regions[0].heights, Some(heights), "{properties}");
            }
        }
    }
}

#[test]
fn a_plan_keeps_the_vehicle_it_was_drawn_for() {
    let vehicle = VehicleHint {
        autopilot: Autopilot::Px4,
        vehicle_type: 1,
        cruise_speed: 18.5,
        hover_speed: 4.0,
    };
    let scenario = Scenario { vehicle, ..Scenario::default() };
    assert_eq!(parse(&write_plan(&scenario).unwrap()).vehicle, vehicle);
    assert_eq!(example("s1.plan").vehicle.autopilot, Autopilot::ArduPilot);
}

#[test]
fn a_jump_keeps_its_target_across_the_numberings() {
    let text = "QGC WPL 110\n0 1 0 16 0 0 0 0 47 8 400 1\n1 0 3 22 0 0 0 0 47 8 30 1\n\
                2 0 3 16 0 0 0 0 47.001 8 30 1\n3 0 2 177 2 5 0 0 0 0 0 1\n";
    let mission = parse(text).mission;
    assert_eq!(mission.items[2].command, Command::DO_JUMP);
    assert_eq!(mission.items[2].params[0], 1.0);
    let scenario = Scenario { mission, ..Scenario::default() };
    let plan: serde_json::Value = serde_json::from_str(&write_plan(&scenario).unwrap()).unwrap();
    let items = &plan["mission"]["items"];
    assert_eq!(items[2]["params"][0], items[1]["doJumpId"]);
    assert!(write_waypoints(&scenario.mission).unwrap().contains("\t177\t2\t5\t"));
}

#[test]
fn jumps_to_nowhere_are_errors_that_name_the_item() {
    for target in ["0", "9", "1.5", "-1", "nan"] {
        let text = format!(
            "QGC WPL 110\n0 1 0 16 0 0 0 0 47 8 400 1\n1 0 3 22 0 0 0 0 47 8 30 1\n\
             2 0 2 177 {target} 5 0 0 0 0 0 1\n"
        );
        assert!(error_of(&text).starts_with("file, line 4: the target of DO_JUMP"), "{target}");
    }
    let plan = r#"{"fileType":"Plan","mission":{"items":[
        {"type":"SimpleItem","command":177,"frame":2,"params":[7,2,0,0,0,0,0],"doJumpId":1}]}}"#;
    assert!(error_of(plan).starts_with("file, mission item 1: the target of DO_JUMP"));
}

#[test]
fn positions_are_rounded_to_the_nearest_not_cut() {
    let text = "QGC WPL 110\n0 1 0 16 0 0 0 0 0 0 0 1\n\
                1 0 3 16 0 0 0 0 -35.36326194999 149.16523745999 30 1\n";
    let item = parse(text).mission.items[0];
    assert_eq!((item.x, item.y), (-353_632_619, 1_491_652_375));
    assert_eq!(parse(text).mission.home, None, "zeros are no home");
    let nearly = "QGC WPL 110\n0 1 0 16 0 0 0 0 0 0.00000004 0 1\n";
    assert_eq!(parse(nearly).mission.home, None, "neither is what is written as zeros");
}

#[test]
fn files_of_other_kinds_are_refused_with_what_to_do() {
    assert!(error_of("").contains("the file is empty"));
    assert!(error_of(" \n# mine\n").contains("the file is empty"));
    assert!(error_of("hello").contains("none of the formats"));
    assert!(error_of("<gpx></gpx>").contains("none of the formats"));
    assert!(error_of("[1,2]").contains("none of the formats"));
    assert!(error_of("QGC WPL 100\n").contains("line 1: the header is"));
    assert!(error_of(r#"{"fileType":"Parameters"}"#).contains("type \"Parameters\""));
    assert!(error_of(r#"{"fileType":"Plan","#).contains("line 1 column"));
    let error = read_scenario("file", b"\xff\xfe").unwrap_err();
    assert!(matches!(*error.problem, Problem::NotText { at: 0 }));
    let error = read_scenario("file", &vec![b' '; MAX_FILE_BYTES + 1]).unwrap_err();
    assert!(matches!(*error.problem, Problem::TooLarge { .. }));
}

#[test]
fn a_byte_order_mark_and_windows_line_ends_are_fine() {
    let text = "\u{feff}QGC WPL 110\r\n0\t1\t0\t16\t0\t0\t0\t0\t47\t8\t0\t1\r\n\
                1\t0\t3\t16\t0\t0\t0\t0\t47\t8\t30\t1\r\n";
    assert_eq!(parse(text).mission.items.len(), 1);
}

#[test]
fn fences_alone_are_read_without_the_route_and_must_exist() {
    let bytes = std::fs::read(folder().join("s1.geojson")).unwrap();
    let read = read_fences("s1.geojson", &bytes).unwrap();
    assert_eq!(read.fences.regions.len(), 183);
    let error = read_fences("a.txt", b"QGC WPL 110\n0 1 0 16 0 0 0 0 47 8 0 1\n").unwrap_err();
    assert!(error.to_string().contains("no fence or obstacle"));
    let error = read_mission("a.txt", b"47 8\n47 8\n47.1 8\n47.1 8.1\n47 8\n").unwrap_err();
    assert!(error.to_string().contains("no mission"));
}

#[test]
fn a_fence_of_one_polygon_with_a_return_point_is_written_as_the_old_text() {
    let text = "47 8\n47 8\n47.1 8\n47.1 8.1\n47 8\n";
    let again = write_fence_text(&parse(text).fences).unwrap();
    assert_eq!(parse(&again), parse(text));
    assert!(again.starts_with("47.0000000 8.0000000\n"), "{again}");
    let both = "47 8\n47.1 8\n47.1 8.1\n47 8\n";
    let error = write_fence_text(&parse(both).fences).unwrap_err().to_string();
    assert!(error.contains("no return point"), "{error}");
}

#[test]
fn a_rally_point_that_is_no_place_on_earth_is_an_error_that_names_it() {
    let point = |frame: u8| {
        format!("QGC WPL 110\n0\t0\t{frame}\t5100\t0\t0\t0\t0\t47.39\t8.54\t30.00\t1\n")
    };
    assert_eq!(parse(&point(3)).rally.len(), 1);
    let told = error_of(&point(4));
    assert!(told.starts_with("file, line 2: the frame of a rally point"), "{told}");
}

#[test]
fn old_rally_text_is_read() {
    let scenario = parse("RALLY 47.5 8.25 40 20 90 1\n# a comment\nRALLY -1 -2 30.5\n");
    let place = |item: &MissionItem| (item.command.0, item.x, item.y, item.z);
    let places: Vec<_> = scenario.rally.iter().map(place).collect();
    assert_eq!(places[0], (5100, 475_000_000, 82_500_000, 40.0));
    assert_eq!(places[1], (5100, -10_000_000, -20_000_000, 30.5));
    assert!(
        error_of("RALLY 47.5 8.25 40\n47 8 9\n").starts_with("file, line 2: this line of rally")
    );
}
