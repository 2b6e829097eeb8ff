//! The keys that scripts rely on, and that figures are those of the mission.

use serde_json::Value;

use super::*;
use crate::replan::Options;
use crate::report::samples::{self, BARN, POND, YARD};

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

fn plan(text: &str) -> (Replanned, Value) {
    let options = Options::default();
    let result = samples::planned(text, &options);
    let run = samples::run(&options, &[]);
    let document = PlanDocument::planned(&result, &run);
    (result, serde_json::to_value(document).unwrap())
}

#[test]
fn a_plan_has_the_keys_that_scripts_rely_on() {
    let (_, document) = plan(BARN);
    let has = |value: &Value, wanted: &[&str]| {
        let keys = keys(value);
        for key in wanted {
            assert!(keys.contains(key), "{key} is not in {keys:?}");
        }
    };
    has(&document, &["feasible", "reason", "collision_free", "length_m", "straight_m"]);
    has(&document, &["min_clearance_m", "waypoints", "legs", "fallback", "time_ms"]);
    has(&document, &["before", "warnings", "settings", "items_inserted"]);
    has(&document["time_ms"], &["load", "candidates", "qaoa", "finish", "total"]);
    let leg = &document["legs"][0];
    has(leg, &["from", "to", "name", "replanned", "length_m", "min_clearance_m", "rounds"]);
    has(&leg["candidates"][0], &["source", "length_m", "turning_rad", "clear"]);
    has(&leg["rounds"][0], &["engine", "qubits", "layers", "loss", "best_sample"]);
    has(&leg["rounds"][0], &["exact_optimum", "gap", "p_optimum", "challenger", "distinct"]);
    assert_eq!(document["settings"]["seed"], 0);
    assert_eq!(document["settings"]["rounds"], "auto");
    assert_eq!(document["time_ms"]["load"], 1.234);
}

#[test]
fn each_leg_of_the_original_has_the_figures_of_what_is_flown_now() {
    let (result, document) = plan(POND);
    let legs = document["legs"].as_array().unwrap();
    assert_eq!(legs.len(), result.before.legs.len());
    let number = |leg: &Value, key: &str| leg[key].as_f64().unwrap();
    for (leg, before) in legs.iter().zip(&result.before.legs) {
        let replanned = leg["replanned"].as_bool().unwrap();
        assert_eq!(replanned, before.blocker.is_some(), "{leg}");
        assert_eq!(replanned, !leg["rounds"].as_array().unwrap().is_empty());
        assert!(number(leg, "min_clearance_m") >= 5.0, "{leg}");
        assert_eq!(number(leg, "length_m") > number(leg, "straight_m"), replanned, "{leg}");
    }
    // All of these legs follow each other, so that they add up to the mission.
    let sum: f64 = legs.iter().map(|leg| number(leg, "length_m")).sum();
    assert!((sum - document["length_m"].as_f64().unwrap()).abs() < 1e-6, "{sum}");
    let least = legs.iter().map(|leg| number(leg, "min_clearance_m")).reduce(f64::min);
    assert_eq!(least, document["min_clearance_m"].as_f64());
    assert_eq!(document["before"]["collision_free"], false);
    assert_eq!(document["collision_free"], true);
}

#[test]
fn inserted_items_and_waypoints_are_those_of_the_mission() {
    let (result, document) = plan(BARN);
    let items = document["items_inserted"].as_array().unwrap();
    let waypoints = document["waypoints"].as_array().unwrap();
    assert!(!items.is_empty());
    for item in items {
        let item = &result.mission.items[item.as_u64().unwrap() as usize - 1];
        let place = item.position().unwrap();
        assert!(waypoints.iter().any(|w| w[0] == place.lat() && w[1] == place.lon()));
    }
    assert_eq!(document["legs"][0]["from"], 1);
    assert_eq!(document["legs"][0]["to"], 2);
}

#[test]
fn a_clearance_without_regions_is_null_and_nothing_is_infinite() {
    let options = Options::default();
    let result = samples::planned_without_fences(BARN, &options);
    let document = PlanDocument::planned(&result, &samples::run(&options, &[]));
    let text = serde_json::to_string(&document).unwrap();
    let document: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(document["min_clearance_m"], Value::Null);
    assert_eq!(document["legs"][0]["min_clearance_m"], Value::Null);
    assert_eq!(document["feasible"], true);
    assert!(document["length_m"].as_f64().unwrap() > 0.0);
}

#[test]
fn a_failure_has_all_keys_of_a_plan_and_says_why() {
    let options = Options::default();
    let (verdict, _) = samples::judged(YARD, &options);
    let warnings = ["the file is odd".to_owned()];
    let run = samples::run(&options, &warnings);
    let failed = PlanDocument::failed(&"shut in by the yard", Some(&verdict), &run);
    let failed = serde_json::to_value(failed).unwrap();
    assert_eq!(keys(&failed), keys(&plan(BARN).1));
    assert_eq!(failed["feasible"], false);
    assert_eq!(failed["collision_free"], false);
    assert_eq!(failed["reason"], "shut in by the yard");
    assert_eq!(failed["length_m"], Value::Null);
    assert_eq!(failed["warnings"][0], "the file is odd");
    assert_eq!(failed["legs"][0]["replanned"], false);
    assert_eq!(failed["legs"][0]["min_clearance_m"], 0.0);
}

#[test]
fn a_judgement_names_the_region_in_the_way_of_each_leg() {
    let options = Options::default();
    let (verdict, _) = samples::judged(BARN, &options);
    let check = CheckDocument::new(&verdict, &samples::run(&options, &[]));
    let check = serde_json::to_value(check).unwrap();
    assert_eq!(check["collision_free"], false);
    assert_eq!(check["clear"], false);
    assert_eq!(check["buffer_m"], 5.0);
    assert_eq!(check["legs"][0]["clear"], false);
    assert!(check["legs"][0]["blocker"].as_str().unwrap().contains("polygon 1"));
    assert_eq!(check["legs"][1]["clear"], true);
    assert_eq!(check["legs"][1]["blocker"], Value::Null);
}
