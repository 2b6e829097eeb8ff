//! What is written to a vehicle whose motors may turn, and what is not.

use std::time::Duration;

use quav::mission::{MissionItem, MissionType};
use quav::store::{Outcome, Store};
use quav::vehicle::TransferError;
use quav::vehicle::replace::{
    Aftermath, Obstacle, ReplaceError, Replacement, Settled, WhileArmed, replace,
};
use serde_json::json;

use crate::sitl::{FakeVehicle, Session, search, waypoint};

const MISSION: MissionType = MissionType::Mission;

/// A vehicle in flight on its way to an item of a mission of twelve.
struct Flight {
    fake: FakeVehicle,
    session: Session,
    directory: tempfile::TempDir,
    before: Vec<MissionItem>,
}

impl Flight {
    async fn new(persona: &str, mode: &str, current: u16) -> Self {
        Self::scripted(persona, mode, current, "").await
    }

    async fn scripted(persona: &str, mode: &str, current: u16, script: &str) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("script");
        std::fs::write(&path, script).unwrap();
        let arguments = ["--persona", persona, "--script", path.to_str().unwrap()];
        let mut fake = FakeVehicle::start(&arguments);
        fake.set(MISSION, &(0..12).map(waypoint).collect::<Vec<_>>());
        fake.control(&json!({"cmd": "set", "armed": true, "mode": mode, "current": current}));
        let session = Session::open(&fake.endpoint(), search()).await;
        let flies = |state: &quav::vehicle::VehicleState| {
            state.is_armed() && state.mission_current.is_some_and(|now| now.seq == current)
        };
        assert!(session.vehicle.wait_for(Duration::from_secs(20), flies).await.is_some());
        let before = session.vehicle.download(MISSION, &mut |_| {}).await.unwrap().items;
        Self { fake, session, directory, before }
    }

    /// Inserts a waypoint before an item.
    async fn insert_before(&self, seq: usize) -> Result<quav::store::Record, ReplaceError> {
        let store = Store::open(&self.directory.path().join("records")).unwrap();
        let mut intended = self.before.clone();
        let aside = MissionItem { y: intended[seq].y + 700, ..intended[seq] };
        intended.insert(seq, aside);
        for (item, seq) in intended.iter_mut().zip(0..) {
            item.seq = seq;
        }
        let replacement = Replacement {
            mission_type: MISSION,
            original: self.before.clone(),
            before: self.before.clone(),
            intended,
        };
        replace(&self.session.vehicle, &store, replacement, WhileArmed::Allow, &mut |_| {}).await
    }
}

#[tokio::test]
async fn px4_gets_other_items_behind_the_current_one_and_flies_on() {
    let mut flight = Flight::new("px4", "MISSION", 4).await;
    let record = flight.insert_before(5).await.unwrap();
    assert_eq!(record.outcome, Outcome::Verified);
    let dump = flight.fake.dump();
    assert_eq!(dump["mission"]["count"], 13);
    assert_eq!(dump["current_seq"], 4, "it does not begin again");
    flight.session.close().await;
}

#[tokio::test]
async fn the_current_item_and_those_before_it_are_not_changed() {
    for (persona, mode) in [("px4", "MISSION"), ("ardupilot", "LOITER")] {
        let mut flight = Flight::new(persona, mode, 4).await;
        let held = flight.fake.held(MISSION);
        for seq in [2, 4] {
            let error = flight.insert_before(seq).await.unwrap_err();
            assert!(matches!(error.obstacle, Obstacle::InFlight { .. }), "{error}");
            assert!(matches!(error.aftermath, Aftermath::NotBegun), "{error}");
        }
        assert_eq!(flight.fake.held(MISSION), held);
        assert_eq!(flight.fake.dump()["uploads"].as_array().unwrap().len(), 0);
        flight.session.close().await;
    }
}

#[tokio::test]
async fn ardupilot_is_written_to_in_the_air_but_not_while_it_flies_its_mission() {
    let mut flight = Flight::new("ardupilot", "AUTO", 4).await;
    let held = flight.fake.held(MISSION);
    let error = flight.insert_before(8).await.unwrap_err();
    assert!(matches!(error.obstacle, Obstacle::FlyingMission), "{error}");
    assert_eq!(flight.fake.held(MISSION), held);
    flight.session.close().await;

    let mut flight = Flight::new("ardupilot", "LOITER", 4).await;
    flight.insert_before(8).await.unwrap();
    let dump = flight.fake.dump();
    assert_eq!((&dump["mission"]["count"], &dump["current_seq"]), (&json!(14), &json!(4)));
    flight.session.close().await;
}

#[tokio::test]
async fn an_upload_to_px4_is_called_off_when_the_vehicle_goes_on_to_the_next_item() {
    let script = r#"{"on": "upload_item", "where": {"item": 3}, "cmd": "set", "current": 5}
{"on": "upload_item", "where": {"item": 3}, "cmd": "fault", "spec": "drop:dir=tx,msg=MISSION_REQUEST_INT,times=2"}
"#;
    let mut flight = Flight::scripted("px4", "MISSION", 4, script).await;
    let held = flight.fake.held(MISSION);
    let error = flight.insert_before(6).await.unwrap_err();
    let called_off = matches!(error.obstacle, Obstacle::Transfer(TransferError::CalledOff { .. }));
    assert!(called_off, "{error}");
    assert!(matches!(error.aftermath, Aftermath::Settled(Settled::Untouched)), "{error}");
    let now = flight.fake.held(MISSION);
    let places = |items: &[serde_json::Value]| {
        items.iter().map(|item| (item["x"].clone(), item["y"].clone())).collect::<Vec<_>>()
    };
    assert_eq!(places(&now), places(&held));
    assert_eq!(flight.fake.dump()["current_seq"], 5);
    flight.session.close().await;
}
