use mavlink::dialects::ardupilotmega::{COMMAND_LONG_DATA, MavCmd};

use super::*;

async fn found(link: &Link, system: Option<u8>) -> Result<Vehicle, DiscoveryError> {
    let search = Search { system: system.map(SystemId), ..Search::default() };
    find(link, &search).await
}

#[tokio::test(start_paused = true)]
async fn a_vehicle_is_found_among_ground_stations_and_gimbals_and_its_id_is_taken() {
    let (peer, link, _task) = Peer::new();
    let say = async {
        peer.noise(b"\xfd\xff\x00boot loader 1.2\r\n\xfe\xfe").await;
        peer.say_as(GROUND_STATION, &heartbeat(Heartbeat::NO_AUTOPILOT)).await;
        peer.say_as(node(9, 154), &heartbeat(Heartbeat::NO_AUTOPILOT)).await;
        // A component that relays an autopilot's heartbeat is not the autopilot.
        peer.say_as(node(8, 191), &heartbeat(PX4)).await;
        peer.say_as(node(9, 1), &heartbeat(PX4)).await;
    };
    let (vehicle, ()) = tokio::join!(found(&link, None), say);
    let vehicle = vehicle.unwrap();
    assert_eq!((vehicle.node(), vehicle.autopilot()), (node(9, 1), Autopilot::Px4));
    assert_eq!(link.node(), node(9, 195));
}

#[tokio::test(start_paused = true)]
async fn two_vehicles_are_an_error_unless_one_is_chosen() {
    let (peer, link, _task) = Peer::new();
    let say = async {
        peer.say_as(node(4, 1), &heartbeat(ARDUPILOT)).await;
        peer.say_as(node(5, 1), &heartbeat(PX4)).await;
    };
    let (found_none, ()) = tokio::join!(found(&link, None), say);
    let error = found_none.err().unwrap();
    assert!(error.to_string().contains("4, 5"), "{error}");
    let say = async {
        peer.say_as(node(4, 1), &heartbeat(ARDUPILOT)).await;
        peer.say_as(node(5, 1), &heartbeat(PX4)).await;
    };
    let (chosen, ()) = tokio::join!(found(&link, Some(5)), say);
    assert_eq!(chosen.unwrap().node(), node(5, 1));
}

#[tokio::test(start_paused = true)]
async fn without_a_vehicle_the_error_says_who_else_was_heard() {
    let (peer, link, _task) = Peer::new();
    let ground = heartbeat(Heartbeat::NO_AUTOPILOT);
    let say = peer.say_as(GROUND_STATION, &ground);
    let (found_none, ()) = tokio::join!(found(&link, None), say);
    let error = found_none.err().unwrap();
    assert!(error.to_string().contains("heard were only: system 255 component 190"), "{error}");
    let error = found(&link, Some(3)).await.err().unwrap();
    assert!(error.to_string().contains("with system id 3"), "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_heartbeat_goes_out_each_second_as_an_onboard_controller() {
    let (mut peer, _link, _task) = Peer::new();
    let begin = tokio::time::Instant::now();
    for beat in 0..5 {
        let heartbeat: Heartbeat = peer.hears().await;
        assert_eq!((heartbeat.kind, heartbeat.autopilot), (18, 8));
        assert_eq!(begin.elapsed().as_millis() / 100, beat * 10);
    }
}

#[tokio::test(start_paused = true)]
async fn streams_are_asked_for_until_they_come() {
    let (_vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let mut asked = 0;
    while asked < 6 {
        let command: COMMAND_LONG_DATA = peer.hears().await;
        if command.command == MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL {
            // MISSION_CURRENT tells of a change.
            let interval = if command.param1 == 42.0 { 5e5 } else { 1e6 };
            assert_eq!(command.param2, interval, "microseconds for message {}", command.param1);
            asked += 1;
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_closed_line_is_a_lost_link() {
    let (vehicle, peer, _task) = scene(ARDUPILOT).await;
    drop(peer);
    let error = vehicle.download(MISSION, &mut |_| {}).await.unwrap_err();
    assert!(matches!(error, TransferError::Link(LinkError::Lost(_))), "{error}");
    assert!(error.is_unreachable());
}
