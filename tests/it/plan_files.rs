//! Plans as files over MAVLink FTP, and fingerprints, which save reading a plan again.

use quav::mission::{Command, Frame, MissionItem, MissionType};
use quav::vehicle::download::Source;
use quav::vehicle::{Fingerprint, Vehicle};

use crate::sitl::{FakeVehicle, PERSONAS, Session, search, triangle, waypoint};

const PLANS: [MissionType; 3] = [MissionType::Mission, MissionType::Fence, MissionType::Rally];

fn rally_point() -> MissionItem {
    MissionItem {
        command: Command::NAV_RALLY_POINT,
        frame: Frame::GLOBAL_RELATIVE_ALT_INT,
        ..waypoint(0)
    }
}

fn loaded(persona: &str) -> FakeVehicle {
    let mut fake = FakeVehicle::start(&["--persona", persona]);
    fake.set(MissionType::Mission, &(0..60).map(waypoint).collect::<Vec<_>>());
    fake.set(MissionType::Fence, &triangle());
    fake.set(MissionType::Rally, &[rally_point()]);
    fake
}

/// Reads a plan in both ways and gives the way of `read_plan`, once both are seen to be the same.
async fn read_both_ways(vehicle: &Vehicle, plan: MissionType) -> Source {
    let read = vehicle.read_plan(plan, &mut |_| {}).await.unwrap();
    let item_by_item = vehicle.download(plan, &mut |_| {}).await.unwrap();
    assert_eq!(read.items, item_by_item.items, "{plan}");
    assert!(!read.items.is_empty());
    read.source
}

#[tokio::test]
async fn a_plan_file_holds_the_same_items_also_on_a_bad_link() {
    let mut fake = loaded("ardupilot");
    let session = Session::open(&fake.endpoint(), search()).await;
    for faults in
        [&[][..], &["drop:p=0.1", "duplicate:p=0.2", "reorder:p=0.2,ms=20", "corrupt:p=0.05"]]
    {
        for fault in faults {
            fake.fault(fault);
        }
        for plan in PLANS {
            let source = read_both_ways(&session.vehicle, plan).await;
            assert!(matches!(source, Source::File { .. }), "{plan} {faults:?}: {source:?}");
        }
    }
    session.close().await;
}

#[tokio::test]
async fn without_files_a_plan_is_read_item_by_item_and_that_is_told() {
    for fault in
        ["refuse-ftp:code=1", "drop:msg=FILE_TRANSFER_PROTOCOL", "bad-value:item=1,value=5,times=1"]
    {
        let mut fake = loaded("ardupilot");
        let session = Session::open(&fake.endpoint(), search()).await;
        fake.fault(fault);
        let source = read_both_ways(&session.vehicle, MissionType::Mission).await;
        assert!(
            matches!(&source, Source::MissionProtocol { ftp_failed: Some(_) }),
            "{fault}: {source:?}"
        );
        session.close().await;
    }
    let fake = loaded("px4");
    let session = Session::open(&fake.endpoint(), search()).await;
    let source = read_both_ways(&session.vehicle, MissionType::Mission).await;
    assert_eq!(source, Source::MissionProtocol { ftp_failed: None });
    session.close().await;
}

#[tokio::test]
async fn a_restart_of_the_vehicle_in_the_middle_of_a_file_is_survived() {
    let mut fake = loaded("ardupilot");
    let session = Session::open(&fake.endpoint(), search()).await;
    fake.fault("reboot:when=download,item=20,for=0.5,times=1");
    read_both_ways(&session.vehicle, MissionType::Mission).await;
    assert_eq!(fake.dump()["boots"], 2);
    session.close().await;
}

#[tokio::test]
async fn a_fingerprint_changes_with_its_plan_and_with_nothing_else() {
    for persona in PERSONAS {
        let mut fake = loaded(persona);
        let session = Session::open(&fake.endpoint(), search()).await;
        let vehicle = &session.vehicle;
        let known = vehicle.wait_for(search().patience, |state| state.mission_current.is_some());
        known.await.unwrap();
        let mut before = Vec::new();
        for plan in PLANS {
            let print = vehicle.fingerprint(plan).await.unwrap().unwrap();
            assert_eq!(vehicle.fingerprint(plan).await.unwrap(), Some(print), "{persona} {plan}");
            let read = vehicle.read_plan(plan, &mut |_| {}).await.unwrap();
            match (print, read.source) {
                (Fingerprint::Crc32(print), Source::File { crc32 }) => assert_eq!(print, crc32),
                (Fingerprint::OpaqueId(print), _) => assert_eq!(print, read.opaque_id),
                other => panic!("{persona} {plan}: {other:?}"),
            }
            before.push(print);
        }
        // One waypoint a metre further: the same number of items.
        let mut items: Vec<_> = (0..60).map(waypoint).collect();
        items[7].x += 90;
        fake.set(MissionType::Mission, &items);
        let after = vehicle
            .wait_for(search().patience, |state| {
                let id = state.mission_current.map_or(0, |current| current.plan_ids[0]);
                persona == "ardupilot" || before[0] != Fingerprint::OpaqueId(id)
            })
            .await;
        assert!(after.is_some(), "{persona}");
        assert_ne!(vehicle.fingerprint(PLANS[0]).await.unwrap(), Some(before[0]), "{persona}");
        for (plan, print) in PLANS.into_iter().zip(before).skip(1) {
            assert_eq!(vehicle.fingerprint(plan).await.unwrap(), Some(print), "{persona} {plan}");
        }
        session.close().await;
    }
}
