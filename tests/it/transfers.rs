//! Plans go to the vehicle and come back as they are, over every kind of link and for both
//! autopilots.

use quav::mission::{Command, Frame, Mission, MissionItem, MissionType};
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

/// One plan of each kind, in the vehicle's numbering.
fn plan_of(mission_type: MissionType) -> Vec<MissionItem> {
    match mission_type {
        MissionType::Mission => (0..8).map(waypoint).collect(),
        MissionType::Fence => triangle(),
        MissionType::Rally => vec![MissionItem {
            command: Command::NAV_RALLY_POINT,
            frame: Frame::GLOBAL_RELATIVE_ALT_INT,
            ..waypoint(0)
        }],
    }
}

#[tokio::test]
async fn each_kind_of_plan_goes_up_down_and_away_and_leaves_the_others_alone() {
    const PLANS: [MissionType; 3] = [MissionType::Mission, MissionType::Fence, MissionType::Rally];
    for persona in PERSONAS {
        let mut fake = FakeVehicle::start(&["--persona", persona]);
        let session = Session::open(&fake.endpoint(), search()).await;
        let vehicle = &session.vehicle;
        for plan in PLANS {
            let sent = plan_of(plan);
            let uploaded = vehicle.upload(plan, &sent, &mut |_| {}).await.unwrap();
            assert_eq!(uploaded, Uploaded::Acknowledged, "{persona} {plan}");
            let held = vehicle.download(plan, &mut |_| {}).await.unwrap().items;
            assert_eq!(differences(vehicle.autopilot(), plan, &sent, &held), []);
        }
        for (k, plan) in PLANS.into_iter().enumerate() {
            vehicle.clear(plan).await.unwrap();
            assert!(vehicle.download(plan, &mut |_| {}).await.unwrap().items.is_empty());
            for (other, there) in PLANS.into_iter().zip(0..) {
                assert_eq!(fake.held(other).is_empty(), there <= k, "{persona} {plan} {other}");
            }
        }
        session.close().await;
    }
}
