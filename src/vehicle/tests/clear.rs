use super::*;
use crate::link::message::MissionClearAll;

#[tokio::test(start_paused = true)]
async fn clearing_goes_on_while_the_vehicle_is_heard() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let (cleared, ()) = tokio::join!(vehicle.clear(MISSION), async {
        for _ in 0..20 {
            peer.hears::<MissionClearAll>().await;
        }
        peer.say(&ack(MissionResult::ACCEPTED)).await;
    });
    cleared.unwrap();
}

#[tokio::test(start_paused = true)]
async fn clearing_ends_when_nobody_is_there_any_more_or_nobody_answers() {
    for is_silent in [false, true] {
        let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
        if is_silent {
            peer.fall_silent();
        }
        let cleared = vehicle.clear(MISSION).await;
        assert!(matches!(cleared, Err(TransferError::NoAnswer { .. })), "{cleared:?}");
    }
}
