//! When the daemon plans, and what becomes of it.

use serde_json::{Value, json};

use super::{Daemon, Station, example, vehicle_with, verdict};
use crate::sitl::PERSONAS;

#[test]
fn a_mission_is_planned_when_the_vehicle_is_found_and_when_it_changes() {
    for persona in PERSONAS {
        let mut vehicle = vehicle_with(persona, "s1");
        let daemon = Daemon::start(&vehicle.urls[0], "poll = 5");
        let status = daemon.wait_for_answer(1);
        assert_eq!(verdict(&status), "uploaded", "{status:#?}");
        let report = vehicle.judged();
        assert_eq!(report["collisions"], 0, "{report}");
        assert!(report["min_clearance_m"].as_f64().unwrap() >= 4.99, "{report}");
        let last = status.last.unwrap();
        assert!(last.text.iter().any(|text| text.contains("re-planned, +")), "{last:?}");
        let kept: Value =
            serde_json::from_slice(&std::fs::read(last.report.unwrap()).unwrap()).unwrap();
        assert_eq!(kept["plan"]["collision_free"], true);

        // The pilot uploads the mission as drawn once more, over the protocol.
        let drawn = example("s1");
        vehicle.control(
            &json!({"cmd": "gcs-upload", "type": "mission", "items": drawn, "pace": 0.02}),
        );
        let status = daemon.wait_for("a second upload", |status| status.counts.uploads >= 2);
        assert_eq!(verdict(&status), "uploaded");
        let report = vehicle.judged();
        assert_eq!(report["collisions"], 0, "{report}");
        assert!(daemon.end().0.success());
    }
}

#[test]
fn its_own_upload_is_not_taken_for_a_change_nor_is_a_restart() {
    let mut vehicle = vehicle_with("ardupilot", "s5");
    let daemon = Daemon::start(&vehicle.urls[0], "poll = 5");
    daemon.wait_for_answer(1);
    let looks = daemon.wait_for("a look after it", |status| status.counts.looks >= 2).counts;
    assert_eq!((looks.answers, looks.uploads), (1, 1));
    let (_, directory) = daemon.end();
    let daemon = Daemon::start_in(directory, &vehicle.urls[0], "");
    let status = daemon.wait_for_answer(1);
    assert_eq!(verdict(&status), "already_there");
    let uploads = vehicle.dump()["uploads"].as_array().unwrap().len();
    assert_eq!(uploads, 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_safe_path_is_told_to_the_pilot_and_touches_nothing() {
    let mut vehicle = vehicle_with("ardupilot", "infeasible");
    let before = vehicle.dump()["mission"].clone();
    let mut station = Station::open(&vehicle).await;
    let daemon = Daemon::start(&vehicle.urls[0], "");
    assert_eq!(station.text("no safe path").await, "QUAV: no safe path, mission untouched");
    let status = daemon.wait_for_answer(1);
    assert_eq!(verdict(&status), "no_path");
    assert!(status.last.unwrap().reason.unwrap().contains("no safe path"));
    assert_eq!(vehicle.dump()["mission"], before);
    station.close().await;
}

#[test]
fn a_vehicle_that_is_carried_to_another_place_is_planned_for_from_there() {
    let mut vehicle = vehicle_with("ardupilot", "s5");
    let daemon = Daemon::start(&vehicle.urls[0], "poll = 3600");
    daemon.wait_for_answer(1);
    daemon.wait_for("its own upload seen", |status| {
        status.counts.looks >= 2 && status.state == "watching"
    });
    let home = vehicle.dump()["home"].clone();
    // Some 40 m to the north.
    let lat = home["lat"].as_f64().unwrap() + 0.000_36;
    let place = json!([lat, home["lon"], home["alt"]]);
    vehicle.control(&json!({"cmd": "set", "home": place, "position": place}));
    let last = daemon.wait_for_answer(2).last.unwrap();
    assert_eq!(last.trigger, "the vehicle or its home is in another place");
    let report = vehicle.judged();
    assert_eq!(report["clear"], last.verdict != "no_path", "{last:#?} {report}");
    let kept: Value =
        serde_json::from_slice(&std::fs::read(last.report.unwrap()).unwrap()).unwrap();
    assert_eq!(kept["verdict"], last.verdict.as_str());
}

#[test]
fn an_armed_vehicle_is_written_to_when_it_is_disarmed() {
    let mut vehicle = vehicle_with("ardupilot", "s5");
    vehicle.control(&json!({"cmd": "set", "armed": true}));
    let daemon = Daemon::start(&vehicle.urls[0], "");
    let status = daemon.wait_for_answer(1);
    assert_eq!(verdict(&status), "armed");
    assert!(vehicle.dump()["uploads"].as_array().unwrap().is_empty());
    vehicle.control(&json!({"cmd": "set", "armed": false}));
    daemon.wait_for("the upload", |status| status.counts.uploads == 1);
}

#[test]
fn a_vehicle_that_was_armed_out_of_reach_and_comes_back_is_written_to_when_it_is_disarmed() {
    let mut vehicle = vehicle_with("ardupilot", "s5");
    vehicle.control(&json!({"cmd": "set", "armed": true}));
    let daemon = Daemon::start(&vehicle.urls[0], "retry = 1\npoll = 3600");
    assert_eq!(verdict(&daemon.wait_for_answer(1)), "armed");
    vehicle.fault("silence:for=12");
    daemon.wait_for("the loss", |status| status.vehicle.is_none());
    daemon.wait_for("its return", |status| {
        status.vehicle.as_ref().is_some_and(|vehicle| vehicle.armed) && status.counts.looks >= 2
    });
    vehicle.control(&json!({"cmd": "set", "armed": false}));
    let status = daemon.wait_for("the upload", |status| status.counts.uploads == 1);
    assert_eq!(status.last.unwrap().trigger, "the vehicle was disarmed");
}

#[test]
fn in_flight_it_writes_where_the_configuration_allows_it_and_the_vehicle_flies_on() {
    let mut vehicle = vehicle_with("px4", "s5");
    let dump = vehicle.dump();
    let first = &dump["mission"]["items"][0];
    let degrees = |axis: &str| first[axis].as_f64().unwrap() / 1e7;
    let above = json!([degrees("x"), degrees("y"), dump["home"]["alt"].as_f64().unwrap() + 30.0]);
    vehicle.control(&json!({
        "cmd": "set", "armed": true, "mode": "MISSION", "current": 0, "position": above
    }));
    let daemon = Daemon::start(&vehicle.urls[0], "in_flight = true");
    let status = daemon.wait_for_answer(1);
    assert_eq!(verdict(&status), "uploaded", "{status:#?}");
    assert_eq!(vehicle.judged()["collisions"], 0);
    assert_eq!(vehicle.dump()["current_seq"], 0);
}

#[test]
fn a_mission_that_the_vehicle_has_no_room_for_is_not_begun() {
    let mut vehicle = vehicle_with("ardupilot", "s1");
    let daemon = Daemon::start(&vehicle.urls[0], "max_items = 2");
    let status = daemon.wait_for_answer(1);
    assert_eq!(verdict(&status), "refused", "{status:#?}");
    assert_eq!(vehicle.dump()["uploads"].as_array().unwrap().len(), 0);
}
