use proptest::prelude::*;
use serde_json::{Value, json};

use super::structure_scan::tests::tower;
use crate::formats::{Scenario, plan_flattened, read_scenario, write_plan};
use crate::mission::{Command, Frame};

fn plan(items: &Value, fence: &Value) -> String {
    json!({
        "fileType": "Plan", "version": 1, "groundStation": "QGroundControl",
        "mission": { "version": 2, "plannedHomePosition": [47.0, 8.0, 400], "items": items },
        "geoFence": fence,
    })
    .to_string()
}

fn no_fence() -> Value {
    json!({ "version": 2, "polygons": [], "circles": [] })
}

fn read(items: &Value) -> Scenario {
    read_scenario("a.plan", plan(items, &no_fence()).as_bytes()).unwrap()
}

fn item_error(items: &Value) -> String {
    read_scenario("a.plan", plan(items, &no_fence()).as_bytes()).unwrap_err().to_string()
}

fn fence_error(fence: &Value) -> String {
    read_scenario("a.plan", plan(&json!([]), fence).as_bytes()).unwrap_err().to_string()
}

fn waypoint(id: u32) -> Value {
    json!({ "type": "SimpleItem", "command": 16, "frame": 3, "doJumpId": id,
            "params": [0, 0, 0, null, 47.1, 8.1, 30], "autoContinue": true })
}

fn jump(id: u32, target: u32) -> Value {
    json!({ "type": "SimpleItem", "command": 177, "frame": 2, "doJumpId": id,
            "params": [target, 2, 0, 0, 0, 0, 0], "autoContinue": true })
}

#[test]
fn null_is_nan() {
    let params = read(&json!([waypoint(1)])).mission.items[0].params;
    assert!(params[3].is_nan() && params[..3] == [0.0; 3]);
}

#[test]
fn a_survey_is_read_as_the_items_it_stands_for_and_jumps_still_meet() {
    let survey = json!({ "type": "ComplexItem", "complexItemType": "survey", "version": 5,
        "angle": 0, "polygon": [[47, 8], [47, 8.1], [47.1, 8]],
        "TransectStyleComplexItem": { "version": 2, "Items": [waypoint(2), waypoint(3)],
                                      "VisualTransectPoints": [[47, 8]] } });
    let scenario = read(&json!([waypoint(1), survey, jump(4, 3)]));
    assert_eq!(scenario.mission.items.len(), 4);
    assert_eq!(scenario.mission.items[3].params[0], 2.0);
    assert!(scenario.warnings.is_empty());
    // Numbers of its own: the jump goes to the same item in the plan that is written.
    let again = read_scenario("b", write_plan(&scenario).unwrap().as_bytes()).unwrap();
    assert_eq!(again.mission.items[3].params[0], 2.0);
}

#[test]
fn a_jump_to_an_id_that_stands_twice_is_an_error() {
    let error = item_error(&json!([waypoint(1), waypoint(1), jump(3, 1)]));
    assert!(error.starts_with("a.plan, mission item 3: the target of DO_JUMP"), "{error}");
}

#[test]
fn a_fixed_wing_landing_is_read_as_qgroundcontrol_uploads_it() {
    let landing = json!({ "type": "ComplexItem", "complexItemType": "fwLandingPattern",
        "version": 2, "altitudesAreRelative": true, "landCoordinate": [47.0, 8.0, 0],
        "landingApproachCoordinate": [47.01, 8.0, 40], "loiterClockwise": false,
        "loiterRadius": 75, "stopTakingPhotos": true, "stopVideoPhotos": true,
        "useLoiterToAlt": true, "valueSetIsDistance": true });
    let items = read(&json!([landing])).mission.items;
    let commands: Vec<_> = items.iter().map(|item| item.command.0).collect();
    assert_eq!(commands, [189, 206, 2001, 2501, 31, 21]);
    assert_eq!(items[4].params, [1.0, -75.0, 0.0, 1.0]);
    assert_eq!((items[4].frame, items[4].z), (Frame::GLOBAL_RELATIVE_ALT, 40.0));
    assert_eq!((items[5].command, items[5].x), (Command::NAV_LAND, 470_000_000));
}

#[test]
fn a_complex_item_that_does_not_say_what_is_flown_is_an_error_that_names_it() {
    for kind in ["StructureScan", "survey", "fwLandingPattern", "new thing"] {
        let item = json!({ "type": "ComplexItem", "complexItemType": kind, "version": 3 });
        let error = item_error(&json!([waypoint(1), item]));
        assert!(error.starts_with("a.plan, mission item 2:") && error.contains(kind), "{error}");
    }
}

#[test]
fn items_of_the_wrong_shape_are_errors_that_name_them() {
    let broken = |key: &str, value: Value| {
        let mut item = waypoint(2);
        item[key] = value;
        item_error(&json!([waypoint(1), item]))
    };
    let starts = |error: String| assert!(error.starts_with("a.plan, mission item 2:"), "{error}");
    starts(broken("command", json!(70_000)));
    starts(broken("command", json!(16.5)));
    starts(broken("command", Value::Null));
    starts(broken("frame", json!(-1)));
    starts(broken("params", json!([0, 0, 0, 0])));
    starts(broken("params", json!([0, 0, 0, 0, 97.0, 8.1, 30])));
    starts(broken("params", json!([1e39, 0, 0, 0, 47.0, 8.1, 30])));
    starts(broken("params", json!([0, 0, 0, 0, 47.0, 8.1, null])));
    starts(broken("type", json!("Surprise")));
    assert!(broken("params", json!("x")).contains("line 1 column"));
}

#[test]
fn fence_regions_that_cannot_be_used_are_errors_that_name_them() {
    let ring = json!([[47, 8], [47, 8.1], [47.1, 8]]);
    let polygon = |ring: Value| {
        let good = json!({ "polygon": [[47, 8], [47, 8.1], [47.1, 8]], "inclusion": true });
        fence_error(&json!({ "version": 2, "circles": [],
            "polygons": [good, { "polygon": ring, "inclusion": false }] }))
    };
    for broken in [
        json!([]),
        json!([[47, 8], [47, 8.1]]),
        json!([[47, 8], [47, 188], [47.1, 8]]),
        json!([[47, 8], [47], [47.1, 8]]),
    ] {
        let error = polygon(broken);
        assert!(error.starts_with("a.plan, geoFence polygon 2:"), "{error}");
    }
    for radius in [json!(0), json!(-1), json!(1e9)] {
        let circle =
            json!({ "circle": { "center": [47, 8], "radius": radius }, "inclusion": true });
        let error = fence_error(&json!({ "version": 2, "polygons": [], "circles": [circle] }));
        assert!(error.starts_with("a.plan, geoFence circle 1: the radius"), "{error}");
    }
    let error = fence_error(&json!({ "version": 3, "polygons": [], "circles": [] }));
    assert!(error.contains("version 3"), "{error}");
    // Whether it is an inclusion must be said: guessing wrong would turn the fence inside out.
    let unsaid = fence_error(&json!({ "version": 2, "polygons": [{ "polygon": ring }] }));
    assert!(unsaid.contains("missing field `inclusion`"), "{unsaid}");
}

#[test]
fn a_plan_without_optional_parts_is_read() {
    let scenario = read_scenario("a.plan", br#"{"fileType":"Plan"}"#).unwrap();
    assert_eq!(scenario, Scenario::default());
    let home = r#"{"fileType":"Plan","mission":{"plannedHomePosition":[null,null,null]}}"#;
    assert_eq!(read_scenario("a.plan", home.as_bytes()).unwrap().mission.home, None);
}

#[test]
fn the_first_fence_version_is_one_inclusion_polygon() {
    let fence = json!({ "version": 1, "polygon": [[47, 8], [47, 8.1], [47.1, 8]] });
    let scenario = read_scenario("a.plan", plan(&json!([]), &fence).as_bytes()).unwrap();
    assert_eq!(scenario.fences.regions.len(), 1);
    assert!(scenario.warnings[0].contains("version 1"));
}

/// A survey as QGroundControl 4 writes it, shortened to two of its items.
fn survey(first_id: u32) -> Value {
    json!({ "type": "ComplexItem", "complexItemType": "survey", "version": 5,
        "angle": 30, "entryLocation": 2, "flyAlternateTransects": false,
        "polygon": [[47, 8], [47, 8.1], [47.1, 8]],
        "TransectStyleComplexItem": { "version": 2, "TurnAroundDistance": 10,
            "CameraCalc": { "CameraName": "Manual (no camera specs)", "version": 2 },
            "Items": [waypoint(first_id), waypoint(first_id + 1)],
            "VisualTransectPoints": [[47, 8]] } })
}

fn written_items(scenario: &Scenario) -> Vec<Value> {
    let plan: Value = serde_json::from_str(&write_plan(scenario).unwrap()).unwrap();
    plan["mission"]["items"].as_array().unwrap().clone()
}

#[test]
fn a_complex_item_stays_one_with_new_waypoints_before_and_after_it() {
    let mut scenario = read(&json!([waypoint(1), survey(2), waypoint(4), jump(5, 3)]));
    let mut new = scenario.mission.items[0];
    (new.x, new.y) = (1, 2);
    scenario.mission.items.insert(1, new);
    scenario.mission.items.insert(4, new);
    for (seq, item) in scenario.mission.items.iter_mut().enumerate() {
        item.seq = seq as u16;
    }
    scenario.mission.items[6].params[0] = 3.0; // the survey's second item, moved along
    let items = written_items(&scenario);
    let kinds: Vec<_> = items.iter().map(|item| item["type"].as_str().unwrap()).collect();
    let simple = "SimpleItem";
    assert_eq!(kinds, [simple, simple, "ComplexItem", simple, simple, simple]);
    // All of it but the numbers.
    assert_eq!(items[2], survey(3));
    assert_eq!(items[5]["params"][0], items[2]["TransectStyleComplexItem"]["Items"][1]["doJumpId"]);
    assert!(plan_flattened(&scenario).is_empty());
    let again = read_scenario("b", write_plan(&scenario).unwrap().as_bytes()).unwrap();
    assert_eq!(format!("{:?}", again.mission), format!("{:?}", scenario.mission));
}

#[test]
fn a_complex_item_with_a_new_waypoint_inside_is_written_flat_and_said_so() {
    let mut scenario = read(&json!([waypoint(1), survey(2), waypoint(4)]));
    let mut new = scenario.mission.items[0];
    (new.x, new.y) = (1, 2);
    scenario.mission.items.insert(2, new);
    let items = written_items(&scenario);
    assert!(items.iter().all(|item| item["type"] == "SimpleItem"));
    assert_eq!(items.len(), 5);
    let said = plan_flattened(&scenario);
    assert_eq!(said.len(), 1);
    assert!(said[0].starts_with("mission item 2: the survey item has new waypoints"), "{said:?}");
}

#[test]
fn a_complex_item_that_stands_for_nothing_yet_is_kept_in_its_place() {
    let empty = json!({ "type": "ComplexItem", "complexItemType": "survey", "version": 5,
        "polygon": [], "TransectStyleComplexItem": { "version": 2, "Items": [] } });
    let list = json!([empty, waypoint(1), empty, empty, survey(2), waypoint(4), empty]);
    let mut scenario = read(&list);
    assert_eq!(scenario.mission.items.len(), 4);
    let kinds = |scenario: &Scenario| -> String {
        let letter = |item: &Value| match item["complexItemType"].as_str() {
            None => 'w',
            Some(_) if item["TransectStyleComplexItem"]["Items"] == json!([]) => 'e',
            Some(_) => 's',
        };
        written_items(scenario).iter().map(letter).collect()
    };
    assert_eq!(kinds(&scenario), "eweeswe");
    let mut new = scenario.mission.items[0];
    (new.x, new.y) = (1, 2);
    scenario.mission.items.insert(1, new);
    assert_eq!(kinds(&scenario), "eweewswe");
    assert!(plan_flattened(&scenario).is_empty());
    // And where nothing else is flown.
    assert_eq!(kinds(&read(&json!([empty]))), "e");
}

#[test]
fn a_landing_pattern_stays_one() {
    let landing = json!({ "type": "ComplexItem", "complexItemType": "vtolLandingPattern",
        "version": 1, "altitudesAreRelative": true, "landCoordinate": [47.0, 8.0, 0],
        "landingApproachCoordinate": [47.01, 8.0, 40], "loiterClockwise": true,
        "loiterRadius": 75, "stopTakingPhotos": true, "stopVideoPhotos": true,
        "useLoiterToAlt": true });
    let scenario = read(&json!([waypoint(1), landing]));
    assert_eq!(written_items(&scenario)[1], landing);
}

#[test]
fn what_quavd_does_not_know_of_a_plan_is_kept() {
    let mut item = waypoint(1);
    item["AltitudeMode"] = json!(3); // calculated above terrain
    item["AMSLAltAboveTerrain"] = json!(455.5);
    item["Altitude"] = json!(55.5);
    item["something"] = json!([1]);
    let mut document: Value = serde_json::from_str(&plan(&json!([item]), &no_fence())).unwrap();
    document["mission"]["firmwareType"] = json!(8);
    document["mission"]["later"] = json!("x");
    document["pilot"] = json!({ "name": "A" });
    let scenario = read_scenario("a.plan", document.to_string().as_bytes()).unwrap();
    let again: Value = serde_json::from_str(&write_plan(&scenario).unwrap()).unwrap();
    assert_eq!(again["pilot"], document["pilot"]);
    assert_eq!(again["mission"]["later"], "x");
    assert_eq!(again["mission"]["firmwareType"], 8);
    let written = &again["mission"]["items"][0];
    for key in ["AltitudeMode", "AMSLAltAboveTerrain", "Altitude", "something"] {
        assert_eq!(written[key], item[key], "{key}");
    }
}

/// A corridor scan as QGroundControl 4 writes it, shortened.
fn corridor(first_id: u32, items: u32) -> Value {
    let items: Vec<Value> = (first_id..first_id + items).map(waypoint).collect();
    json!({ "type": "ComplexItem", "complexItemType": "CorridorScan", "version": 2,
        "CorridorWidth": 50, "EntryPoint": 0, "polyline": [[47, 8], [47, 8.1]],
        "TransectStyleComplexItem": { "version": 2, "HoverAndCapture": false, "Items": items } })
}

fn landing(kind: &str) -> Value {
    json!({ "type": "ComplexItem", "complexItemType": kind, "version": 2,
        "altitudesAreRelative": true, "landCoordinate": [47.0, 8.0, 0],
        "landingApproachCoordinate": [47.01, 8.0, 40], "loiterClockwise": true,
        "loiterRadius": 75, "stopTakingPhotos": true, "stopTakingVideo": false,
        "useLoiterToAlt": true })
}

/// Lists of items with `doJumpId`s as QGroundControl counts them; the last item may jump to any.
fn lists() -> impl Strategy<Value = Value> {
    let kinds = prop::collection::vec((0..6u32, 0..4u32), 0..8);
    (kinds, prop::option::of(any::<prop::sample::Index>())).prop_map(|(kinds, target)| {
        let mut next = 1;
        let mut list = Vec::new();
        for (kind, items) in kinds {
            let (entry, flown) = match kind {
                0 => (survey(next), 2),
                1 => (corridor(next, items), items),
                2 => (landing("fwLandingPattern"), 5),
                3 => (landing("vtolLandingPattern"), 5),
                4 => (tower(), 18),
                _ => (waypoint(next), 1),
            };
            list.push(entry);
            next += flown;
        }
        if let Some(target) = target.filter(|_| next > 1) {
            list.push(jump(next, 1 + target.index(next as usize - 1) as u32));
        }
        Value::Array(list)
    })
}

proptest! {
    #[test]
    fn complex_items_that_are_read_are_written_as_they_were(list in lists()) {
        let scenario = read(&list);
        let written = written_items(&scenario);
        let list = list.as_array().unwrap();
        prop_assert_eq!(written.len(), list.len());
        for (written, read) in written.iter().zip(list) {
            if read["type"] == "ComplexItem" {
                prop_assert_eq!(written, read);
            }
        }
        let text = write_plan(&scenario).unwrap();
        let again = read_scenario("a.plan", text.as_bytes()).unwrap();
        prop_assert_eq!(format!("{:?}", again.mission), format!("{:?}", scenario.mission));
        prop_assert_eq!(write_plan(&again).unwrap(), text);
    }

    #[test]
    fn with_a_new_waypoint_anywhere_what_is_written_is_what_is_flown(
        list in lists(), at in any::<prop::sample::Index>(),
    ) {
        let mut scenario = read(&list);
        let items = &mut scenario.mission.items;
        let at = at.index(items.len() + 1);
        let mut new = read(&json!([waypoint(1)])).mission.items[0];
        (new.x, new.y) = (1, 2);
        items.insert(at, new);
        for (seq, item) in items.iter_mut().enumerate() {
            item.seq = seq as u16;
            if item.command == Command::DO_JUMP && item.params[0] as usize >= at {
                item.params[0] += 1.0;
            }
        }
        let text = write_plan(&scenario).unwrap();
        let again = read_scenario("a.plan", text.as_bytes()).unwrap();
        prop_assert_eq!(format!("{:?}", again.mission), format!("{:?}", scenario.mission));
        let complex = |list: &[Value]| list.iter().filter(|i| i["type"] == "ComplexItem").count();
        let flattened = plan_flattened(&scenario).len();
        prop_assert!(flattened <= 1);
        let written = complex(&written_items(&scenario));
        prop_assert_eq!(written + flattened, complex(list.as_array().unwrap()));
    }
}
