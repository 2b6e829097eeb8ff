//! `quavd compare` itself: the paper's table as a document and as text.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::{Value, json};

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fence_examples").join(name)
}

fn compare(scenario: &str, more: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_quavd"));
    command.arg("compare").arg(example(scenario)).args(more).output().unwrap()
}

fn text(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn row<'a>(scenario: &'a Value, method: &str) -> &'a Value {
    let rows = scenario["methods"].as_array().unwrap();
    rows.iter().find(|row| row["method"] == method).unwrap()
}

#[test]
fn on_s5_quav_is_shorter_than_every_baseline_and_than_the_papers_figures() {
    let directory = tempfile::tempdir().unwrap();
    let picture = directory.path().join("loss.svg");
    let picture = picture.to_string_lossy().into_owned();
    let arguments = ["--json", "--seeds", "3", "--edges", "20", "--out", &picture];
    let document: Value = serde_json::from_str(&text(&compare("s5.plan", &arguments))).unwrap();

    let [scenario] = document["scenarios"].as_array().unwrap().as_slice() else {
        panic!("{document}")
    };
    assert_eq!(scenario["name"], "s5");
    assert!((scenario["straight_m"].as_f64().unwrap() - 351.01).abs() < 0.01);
    let length = |method| row(scenario, method)["length_m"].as_f64().unwrap();
    let quav = length("quav");
    // The exact shortest length is 354.07 m.
    assert!(quav > 354.06 && quav < 354.07 * 1.005, "{quav}");
    assert!((length("a_star") / 379.70 - 1.0).abs() < 0.005);
    for other in ["a_star", "a_star_smoothed", "rrt_reaching"] {
        assert!(quav < length(other), "{other}");
    }
    for figure in ["a_star_m", "rrt_m", "quav_m"] {
        assert!(quav < scenario["paper"][figure].as_f64().unwrap(), "{figure}");
    }

    let rrt = row(scenario, "rrt");
    assert_eq!((rrt["runs"].as_u64(), rrt["found"].as_u64()), (Some(3), Some(0)));
    assert!(rrt["length_m"].is_null() && rrt["reason"].is_string());
    for method in ["a_star", "a_star_smoothed", "rrt_reaching", "quav_paper", "quav"] {
        let row = row(scenario, method);
        assert_eq!(row["found"], row["runs"], "{method}");
        assert_eq!(row["collisions"], 0, "{method}");
        assert!(row["min_clearance_m"].as_f64().unwrap() > 4.99, "{method}");
    }
    // The paper's settings train every round in full: a start and 60 steps.
    let rounds = row(scenario, "quav_paper")["rounds"].as_array().unwrap();
    assert!(!rounds.is_empty());
    for round in rounds {
        assert_eq!(round["loss"].as_array().unwrap().len(), 61);
    }

    let growth = document["growth"].as_array().unwrap();
    let edges = |of: &Value| -> Vec<u64> {
        let points = of["points"].as_array().unwrap().iter();
        points.map(|point| point["edges"].as_u64().unwrap()).collect()
    };
    let named = |name: &str| growth.iter().find(|of| of["method"] == name).unwrap();
    assert_eq!(edges(named("quav")), [10, 20]);
    for name in ["a_star", "rrt", "quav"] {
        assert!(named(name)["exponent"].is_f64(), "{name}");
        assert!(edges(named(name)).is_sorted());
    }

    let svg = std::fs::read_to_string(&picture).unwrap();
    assert!(svg.starts_with("<svg") && svg.matches("<polyline").count() == 1);
}

#[test]
fn the_table_of_s5_fits_eighty_columns_and_has_the_papers_figures() {
    let table = text(&compare("s5.plan", &["--seeds", "2", "--edges", "0"]));
    for line in table.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    let figures = ["A*", "RRT", "QUAV"].map(|method| {
        let label = format!("{method} in the paper");
        let line = table.lines().find(|line| line.contains(&label)).unwrap();
        line.split_whitespace().last().unwrap().to_owned()
    });
    assert_eq!(figures, ["380.00", "662.88", "447.08"]);
}

#[test]
fn a_scenario_without_a_way_is_a_result_and_one_without_a_mission_an_error() {
    let table = text(&compare("infeasible.plan", &["--seeds", "1", "--edges", "0"]));
    assert!(table.contains("QUAV: no way exists"), "{table}");

    let output = compare("inclusion-fence.txt", &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty());
}

#[test]
fn what_a_leg_is_flown_over_is_in_nobodys_way_and_is_said() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("barn.geojson");
    let page = directory.path().join("compare.html");
    // Between the first leg and the way home, and far to the south of both.
    let ring = [[5.665, 51.984], [5.666, 51.984], [5.666, 51.987], [5.665, 51.987]];
    let ring = [&ring[..], &ring[..1]].concat();
    let (path_text, page_text) = (path.to_string_lossy(), page.to_string_lossy());
    let options = ["--obstacles", &path_text, "--ground-relief", "5", "--seeds", "1"];
    let options = [&options[..], &["--edges", "0", "--json", "--out", &page_text]].concat();
    let compared = |height: f64| -> (Value, String) {
        let barn = json!({
            "type": "Feature", "properties": {"name": "barn", "height": height},
            "geometry": {"type": "Polygon", "coordinates": [ring]},
        });
        std::fs::write(&path, barn.to_string()).unwrap();
        let document = text(&compare("one-polygon.plan", &options));
        let document: Value = serde_json::from_str(&document).unwrap();
        (document["scenarios"][0].clone(), std::fs::read_to_string(&page).unwrap())
    };
    // Flown 30 m above home; 10 m to keep, 5 m of ground.
    let (over, told) = compared(15.0);
    assert!(over["flown_over_or_under"][0].as_str().unwrap().contains("barn"), "{over}");
    assert!(told.contains("Flown over or under"));
    let (around, told) = compared(15.5);
    assert_eq!(around["flown_over_or_under"], json!([]));
    assert!(!told.contains("Flown over or under"));
    assert_eq!((&over["legs"], &around["legs"]), (&json!(1), &json!(1)));
    for method in ["a_star", "a_star_smoothed", "quav_paper", "quav"] {
        let length = |of: &Value| row(of, method)["length_m"].as_f64().unwrap();
        assert!(length(&around) > length(&over) + 1.0, "{method}: {over} {around}");
    }
}
