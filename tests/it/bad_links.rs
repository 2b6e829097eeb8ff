//! Missions survive bad lines, other ground stations, other vehicles, restarts and quavd's own
//! sudden end.

use std::net::UdpSocket;
use std::time::Duration;

use quav::link::SystemId;
use quav::mission::{MissionItem, MissionType};
use quav::store::{Outcome, Store};
use quav::vehicle::numbering::to_vehicle;
use quav::vehicle::readback::differences;
use quav::vehicle::replace::{
    Aftermath, Obstacle, Replacement, Settled, WhileArmed, replace, settle,
};
use quav::vehicle::upload::Uploaded;
use quav::vehicle::{Search, Vehicle};
use serde_json::json;

use crate::sitl::{FakeVehicle, PERSONAS, Session, search, triangle, waypoint};

const MISSION: MissionType = MissionType::Mission;

/// `count` items in places of their own, with what the vehicle keeps before them.
fn mission(vehicle: &Vehicle, count: u16) -> Vec<MissionItem> {
    let items = (50..50 + count).map(waypoint).collect();
    to_vehicle(vehicle.autopilot(), &quav::mission::Mission { home: None, items }, None)
}

async fn held(vehicle: &Vehicle, mission_type: MissionType) -> Vec<MissionItem> {
    vehicle.download(mission_type, &mut |_| {}).await.unwrap().items
}

/// Uploads some items and proves them, under the given faults.
async fn survives(count: u16, faults: &[&str]) {
    for persona in PERSONAS {
        let mut fake = FakeVehicle::start(&["--persona", persona]);
        let session = Session::open(&fake.endpoint(), search()).await;
        for fault in faults {
            fake.fault(fault);
        }
        let vehicle = &session.vehicle;
        let sent = mission(vehicle, count);
        vehicle.upload(MISSION, &sent, &mut |_| {}).await.unwrap();
        let held = held(vehicle, MISSION).await;
        assert_eq!(differences(vehicle.autopilot(), MISSION, &sent, &held), [], "{persona}");
        session.close().await;
    }
}

#[tokio::test]
async fn a_mission_gets_through_a_line_that_loses_every_fifth_frame() {
    survives(30, &["drop:p=0.2"]).await;
}

#[tokio::test]
async fn a_mission_gets_through_a_line_that_repeats_reorders_and_corrupts() {
    survives(30, &["duplicate:p=0.2", "reorder:p=0.1", "corrupt:p=0.1"]).await;
}

#[tokio::test]
async fn a_mission_gets_through_a_slow_line_with_bursts_of_silence() {
    survives(8, &["delay:ms=150,jitter=100", "silence:from=1,for=2,every=6"]).await;
}

#[tokio::test]
async fn another_vehicle_on_the_same_socket_is_neither_heard_nor_written_to() {
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let link = format!("udpout:127.0.0.1:{port}");
    let arguments = |sysid| ["--persona", "px4", "--sysid", sysid, "--stream-rate", "20"];
    let mut other = FakeVehicle::start_on(&link, &arguments("2"));
    let mut ours = FakeVehicle::start_on(&link, &arguments("7"));
    let theirs: Vec<_> = (0..3).map(waypoint).collect();
    other.set(MISSION, &theirs);
    let endpoint = format!("udpin:127.0.0.1:{port}").parse().unwrap();
    let search = Search { system: Some(SystemId(7)), ..search() };
    let session = Session::open(&endpoint, search).await;
    let sent = mission(&session.vehicle, 20);
    let uploaded = session.vehicle.upload(MISSION, &sent, &mut |_| {}).await;
    assert_eq!(uploaded.unwrap(), Uploaded::Acknowledged);
    assert_eq!(held(&session.vehicle, MISSION).await.len(), 20);
    assert_eq!(ours.held(MISSION).len(), 20);
    assert_eq!(other.held(MISSION).len(), 3);
    assert_eq!(session.vehicle.node().system, SystemId(7));
    session.close().await;
}

#[tokio::test]
async fn another_ground_stations_upload_is_waited_out() {
    for persona in PERSONAS {
        let mut fake = FakeVehicle::start(&["--persona", persona]);
        let session = Session::open(&fake.endpoint(), search()).await;
        fake.fault("second-gcs:at=0,type=mission,count=15,pace=100");
        tokio::time::sleep(Duration::from_millis(300)).await;
        let sent = mission(&session.vehicle, 10);
        session.vehicle.upload(MISSION, &sent, &mut |_| {}).await.unwrap();
        let held = held(&session.vehicle, MISSION).await;
        assert_eq!(differences(session.vehicle.autopilot(), MISSION, &sent, &held), []);
        session.close().await;
    }
}

#[tokio::test]
async fn a_restart_in_mid_upload_ends_with_the_new_plan_or_the_old_one() {
    for persona in PERSONAS {
        let mut fake = FakeVehicle::start(&["--persona", persona]);
        fake.set(MISSION, &(0..12).map(waypoint).collect::<Vec<_>>());
        let session = Session::open(&fake.endpoint(), search()).await;
        let directory = tempfile::tempdir().unwrap();
        let store = Store::open(directory.path()).unwrap();
        let before = held(&session.vehicle, MISSION).await;
        let intended = mission(&session.vehicle, 20);
        fake.fault("reboot:type=mission,item=9,when=upload,for=2,times=1");
        let replacement = Replacement {
            mission_type: MISSION,
            original: before.clone(),
            before: before.clone(),
            intended: intended.clone(),
        };
        let replaced =
            replace(&session.vehicle, &store, replacement, WhileArmed::Refuse, &mut |_| {}).await;
        let expected = match replaced {
            Ok(record) => {
                assert_eq!(record.outcome, Outcome::Verified);
                intended
            }
            Err(error) => {
                assert!(matches!(error.aftermath, Aftermath::Settled(_)), "{persona}: {error}");
                before
            }
        };
        let held = held(&session.vehicle, MISSION).await;
        assert_eq!(differences(session.vehicle.autopilot(), MISSION, &expected, &held), []);
        session.close().await;
    }
}

#[tokio::test]
async fn when_quavd_dies_in_mid_upload_the_next_start_puts_the_old_plan_back() {
    let mut fake = FakeVehicle::start(&["--persona", "ardupilot"]);
    fake.set(MISSION, &(0..12).map(waypoint).collect::<Vec<_>>());
    let dumped = fake.held(MISSION);
    let directory = tempfile::tempdir().unwrap();
    {
        let session = Session::open(&fake.endpoint(), search()).await;
        let store = Store::open(directory.path()).unwrap();
        let before = held(&session.vehicle, MISSION).await;
        let replacement = Replacement {
            mission_type: MISSION,
            original: before.clone(),
            before,
            intended: mission(&session.vehicle, 20),
        };
        let (seventh, mut reached) = tokio::sync::mpsc::unbounded_channel();
        let mut on_step = |step| {
            if let quav::vehicle::replace::Step::Uploading(progress) = step
                && progress.done >= 7
            {
                let _ = seventh.send(());
            }
        };
        // The replacement is dropped where it stands, as a killed process is.
        tokio::select! {
            replaced = replace(&session.vehicle, &store, replacement, WhileArmed::Refuse, &mut on_step) => {
                panic!("it was to be stopped, not to end: {replaced:?}")
            },
            _ = reached.recv() => {},
        }
    }
    assert_ne!(fake.held(MISSION), dumped, "the vehicle holds half of it");
    let session = Session::open(&fake.endpoint(), search()).await;
    let store = Store::open(directory.path()).unwrap();
    let settled = settle(&session.vehicle, &store, MISSION, WhileArmed::Refuse, &mut |_| {}).await;
    assert_eq!(settled.unwrap(), Some(Settled::PutBack));
    assert_eq!(fake.held(MISSION), dumped);
    session.close().await;
}

#[tokio::test]
async fn a_fence_that_vanishes_after_it_was_accepted_is_noticed() {
    let mut fake = FakeVehicle::start(&["--persona", "ardupilot"]);
    let session = Session::open(&fake.endpoint(), search()).await;
    let store = tempfile::tempdir().unwrap();
    let store = Store::open(store.path()).unwrap();
    fake.fault("vanish-fence:after=0.6,times=1");
    let replacement = Replacement {
        mission_type: MissionType::Fence,
        original: vec![],
        before: vec![],
        intended: triangle(),
    };
    let replaced =
        replace(&session.vehicle, &store, replacement, WhileArmed::Refuse, &mut |_| {}).await;
    let error = replaced.unwrap_err();
    assert!(matches!(error.obstacle, Obstacle::Mismatch { .. }), "{error}");
    assert!(matches!(error.aftermath, Aftermath::Settled(Settled::Untouched)), "{error}");
    session.close().await;
}

#[tokio::test]
async fn a_flood_of_telemetry_and_garbage_does_not_stop_a_transfer() {
    let mut fake = FakeVehicle::start(&["--persona", "ardupilot", "--stream-rate", "200"]);
    let session = Session::open(&fake.endpoint(), search()).await;
    let flood = UdpSocket::bind("127.0.0.1:0").unwrap();
    let target = fake.endpoint().to_string().replace("udpout:", "");
    let garbage = [0xfd; 1200];
    let sent = mission(&session.vehicle, 40);
    let uploads = async {
        session.vehicle.upload(MISSION, &sent, &mut |_| {}).await.unwrap();
        held(&session.vehicle, MISSION).await
    };
    let noise = async {
        loop {
            flood.send_to(&garbage, &target).unwrap();
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
    };
    let held = tokio::select! {
        held = uploads => held,
        () = noise => unreachable!("it never ends"),
    };
    assert_eq!(differences(session.vehicle.autopilot(), MISSION, &sent, &held), []);
    fake.control(&json!({"cmd": "clear-faults"}));
    session.close().await;
}
