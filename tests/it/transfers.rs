//! Plans go to the vehicle and come back as they are, over every kind of link and for both
//! autopilots.

use quav::mission::{Mission, MissionItem, MissionType};
use quav::vehicle::numbering::{to_mission, to_vehicle};
use quav::vehicle::readback::differences;
use quav::vehicle::upload::Uploaded;

use crate::sitl::{FakeVehicle, PERSONAS, Session, place, search, triangle, waypoint};

/// Uploads a mission of 20 items, downloads it, and looks into the vehicle itself.
async fn mission_there_and_back(link: &str, persona: &str) {
    let mut fake = FakeVehicle::start_on(link, &["--persona", persona]);
    let session = Session::open(&fake.endpoint(), search()).await;
    let vehicle = &session.vehicle;
    let mission = Mission { home: None, items: (0..20).map(waypoint).collect() };
    let sent = to_vehicle(vehicle.autopilot(), &mission, None);

    let mut steps = Vec::new();
    let uploaded = vehicle
        .upload(MissionType::Mission, &sent, &mut |progress| steps.push(progress.done))
        .await;
    assert_eq!(uploaded.unwrap(), Uploaded::Acknowledged, "{persona} over {link}");
    assert!(steps.is_sorted() && steps.last() == Some(&sent.len()), "{steps:?}");

    let held = vehicle.download(MissionType::Mission, &mut |_| {}).await.unwrap().items;
    assert_eq!(differences(vehicle.autopilot(), MissionType::Mission, &sent, &held), []);

    let places: Vec<_> = mission.items.iter().map(MissionItem::e7).collect();
    let back = to_mission(vehicle.autopilot(), &held, None);
    assert_eq!(back.items.iter().map(MissionItem::e7).collect::<Vec<_>>(), places);
    let slots = sent.len() - mission.items.len();
    let dumped = fake.held(MissionType::Mission);
    assert_eq!(dumped[slots..].iter().map(place).collect::<Vec<_>>(), places);
    session.close().await;
}

#[tokio::test]
async fn a_mission_goes_there_and_back_over_udp() {
    for persona in PERSONAS {
        mission_there_and_back("udpin:127.0.0.1:0", persona).await;
    }
}

#[tokio::test]
async fn a_mission_goes_there_and_back_over_tcp() {
    for persona in PERSONAS {
        mission_there_and_back("tcpin:127.0.0.1:0", persona).await;
    }
}

#[tokio::test]
async fn a_mission_goes_there_and_back_over_a_serial_line() {
    for persona in PERSONAS {
        mission_there_and_back("pty", persona).await;
    }
}

#[tokio::test]
async fn a_fence_goes_there_and_back_and_an_empty_list_clears_it() {
    for persona in PERSONAS {
        let mut fake = FakeVehicle::start(&["--persona", persona]);
        let session = Session::open(&fake.endpoint(), search()).await;
        let vehicle = &session.vehicle;
        let sent = triangle();
        vehicle.upload(MissionType::Fence, &sent, &mut |_| {}).await.unwrap();
        let held = vehicle.download(MissionType::Fence, &mut |_| {}).await.unwrap().items;
        assert_eq!(differences(vehicle.autopilot(), MissionType::Fence, &sent, &held), []);
        vehicle.upload(MissionType::Fence, &[], &mut |_| {}).await.unwrap();
        assert!(vehicle.download(MissionType::Fence, &mut |_| {}).await.unwrap().items.is_empty());
        assert!(fake.held(MissionType::Fence).is_empty());
        session.close().await;
    }
}
