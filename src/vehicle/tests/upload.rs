use super::*;
use crate::link::message::{MissionCount, MissionRequest, MissionRequestInt, StatusText};
use crate::vehicle::upload::Uploaded;

async fn upload(vehicle: &Vehicle, count: u16) -> Result<Uploaded, TransferError> {
    vehicle.upload(MISSION, &items(count), &mut |_| {}).await
}

fn request(seq: u16) -> MissionRequestInt {
    MissionRequestInt { seq, target: QUAVD, mission_type: 0 }
}

/// Asks for one item in the old way or the new, and takes it.
async fn take(peer: &mut Peer, seq: u16) -> MissionItem {
    if seq.is_multiple_of(2) {
        peer.say(&request(seq)).await;
    } else {
        peer.say(&MissionRequest(request(seq))).await;
    }
    peer.hears::<MissionItemInt>().await.item
}

#[tokio::test(start_paused = true)]
async fn both_kinds_of_request_are_answered_and_repeats_are_sent_again() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let (uploaded, ()) = tokio::join!(upload(&vehicle, 3), async {
        assert_eq!(peer.hears::<MissionCount>().await.count, 3);
        for seq in [0, 0, 1, 1, 0, 1, 2] {
            assert_eq!(take(&mut peer, seq).await, item(seq));
        }
        peer.say(&ack(MissionResult::ACCEPTED)).await;
    });
    assert_eq!(uploaded.unwrap(), Uploaded::Acknowledged);
}

#[tokio::test(start_paused = true)]
async fn acks_that_mean_nothing_for_this_upload_do_not_end_it() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let (uploaded, ()) = tokio::join!(upload(&vehicle, 2), async {
        peer.hears::<MissionCount>().await;
        take(&mut peer, 0).await;
        let accepted = ack(MissionResult::ACCEPTED);
        let refused = ack(MissionResult::ERROR);
        peer.say(&accepted).await; // of an earlier transfer: item 1 has not been sent
        peer.say(&MissionAck { mission_type: 1, ..refused }).await;
        peer.say(&MissionAck { target: GROUND_STATION, ..refused }).await;
        peer.say_as(GROUND_STATION, &refused).await;
        peer.say_as(node(2, 1), &refused).await;
        for _ in 0..6 {
            peer.say(&ack(MissionResult::INVALID_SEQUENCE)).await;
        }
        peer.say(&request(7)).await; // there is none
        take(&mut peer, 1).await;
        peer.say(&accepted).await;
    });
    assert_eq!(uploaded.unwrap(), Uploaded::Acknowledged);
}

#[tokio::test(start_paused = true)]
async fn only_what_was_asked_for_is_sent_also_when_the_line_is_quiet() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let (uploaded, ()) = tokio::join!(upload(&vehicle, 2), async {
        peer.hears::<MissionCount>().await;
        peer.hears::<MissionCount>().await; // the first may have been lost
        take(&mut peer, 0).await;
        for _ in 0..3 {
            assert_eq!(peer.hears::<MissionItemInt>().await.item.seq, 0);
        }
        take(&mut peer, 1).await;
        peer.say(&ack(MissionResult::ACCEPTED)).await;
    });
    assert_eq!(uploaded.unwrap(), Uploaded::Acknowledged);
}

#[tokio::test(start_paused = true)]
async fn a_lost_request_is_made_up_for_when_ardupilot_says_it_has_the_item() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let (uploaded, ()) = tokio::join!(upload(&vehicle, 3), async {
        peer.hears::<MissionCount>().await;
        take(&mut peer, 0).await;
        assert_eq!(peer.hears::<MissionItemInt>().await.item.seq, 0, "nobody asked for item 1");
        peer.say(&ack(MissionResult::INVALID_SEQUENCE)).await;
        assert_eq!(peer.hears::<MissionItemInt>().await.item.seq, 1);
        peer.say(&ack(MissionResult::INVALID_SEQUENCE)).await; // noise now
        take(&mut peer, 2).await;
        peer.say(&ack(MissionResult::ACCEPTED)).await;
    });
    assert_eq!(uploaded.unwrap(), Uploaded::Acknowledged);
}

#[tokio::test(start_paused = true)]
async fn a_vehicle_that_forgot_the_upload_is_offered_it_again() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let (uploaded, ()) = tokio::join!(upload(&vehicle, 2), async {
        peer.hears::<MissionCount>().await;
        take(&mut peer, 0).await;
        peer.hears::<MissionItemInt>().await;
        peer.say(&ack(MissionResult::ERROR)).await;
        peer.hears::<MissionCount>().await;
        take(&mut peer, 0).await;
        take(&mut peer, 1).await;
        peer.say(&ack(MissionResult::ACCEPTED)).await;
    });
    assert_eq!(uploaded.unwrap(), Uploaded::Acknowledged);
}

#[tokio::test(start_paused = true)]
async fn a_lost_last_ack_leaves_it_to_the_read_back() {
    // Silence, and ArduPilot's answer to a repeated last item.
    for answer in [None, Some(MissionResult::ERROR)] {
        let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
        let (uploaded, ()) = tokio::join!(upload(&vehicle, 1), async {
            peer.hears::<MissionCount>().await;
            take(&mut peer, 0).await;
            peer.hears::<MissionItemInt>().await;
            if let Some(answer) = answer {
                peer.say(&ack(answer)).await;
            }
            while peer.hears_within::<MissionItemInt>(Duration::from_secs(30)).await.is_some() {}
        });
        assert_eq!(uploaded.unwrap(), Uploaded::Unconfirmed);
    }
}

#[tokio::test(start_paused = true)]
async fn a_refusal_names_the_item_and_the_words() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let (uploaded, ()) = tokio::join!(upload(&vehicle, 9), async {
        peer.hears::<MissionCount>().await;
        take(&mut peer, 0).await;
        take(&mut peer, 1).await;
        let mut text = [0; 50];
        text[..11].copy_from_slice(b"Bad command");
        peer.say(&StatusText { severity: 4, text, id: 0, chunk: 0 }).await;
        peer.say(&ack(MissionResult(3))).await;
    });
    let error = uploaded.unwrap_err();
    assert!(!error.is_unreachable());
    assert_eq!(
        error.to_string(),
        "the vehicle refused the mission at item 1: unsupported command (it says: Bad command)"
    );
}

#[tokio::test(start_paused = true)]
async fn a_busy_vehicle_is_offered_the_upload_again() {
    for (autopilot, says) in [(ARDUPILOT, MissionResult::DENIED), (PX4, MissionResult::ERROR)] {
        let (vehicle, mut peer, _task) = scene(autopilot).await;
        let (uploaded, ()) = tokio::join!(upload(&vehicle, 1), async {
            for _ in 0..3 {
                peer.hears::<MissionCount>().await;
                peer.say(&ack(says)).await;
            }
            peer.hears::<MissionCount>().await;
            take(&mut peer, 0).await;
            peer.say(&ack(MissionResult::ACCEPTED)).await;
        });
        assert_eq!(uploaded.unwrap(), Uploaded::Acknowledged);
    }
}

#[tokio::test(start_paused = true)]
async fn an_upload_that_the_vehicle_gave_up_is_begun_again_a_few_times() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let cancelled = ack(MissionResult::OPERATION_CANCELLED);
    let (uploaded, offers) = tokio::join!(upload(&vehicle, 2), async {
        let mut offers = 0;
        while peer.hears_within::<MissionCount>(Duration::from_secs(5)).await.is_some() {
            offers += 1;
            take(&mut peer, 0).await;
            peer.say(&cancelled).await;
        }
        offers
    });
    assert!(matches!(uploaded, Err(TransferError::Refused { .. })), "{uploaded:?}");
    assert_eq!(offers, 1 + vehicle.timing.restarts);
}

#[tokio::test(start_paused = true)]
async fn an_empty_list_is_uploaded_without_a_request() {
    let (vehicle, mut peer, _task) = scene(PX4).await;
    let (uploaded, ()) = tokio::join!(upload(&vehicle, 0), async {
        assert_eq!(peer.hears::<MissionCount>().await.count, 0);
        peer.say(&ack(MissionResult::ACCEPTED)).await;
    });
    assert_eq!(uploaded.unwrap(), Uploaded::Acknowledged);
}

#[tokio::test(start_paused = true)]
async fn a_list_longer_than_the_protocol_is_not_begun() {
    let (vehicle, _peer, _task) = scene(PX4).await;
    let uploaded = upload(&vehicle, transfer::MOST_ITEMS + 1).await;
    assert!(matches!(uploaded, Err(TransferError::TooManyToSend { .. })), "{uploaded:?}");
}
