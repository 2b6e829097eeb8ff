use tokio::time::Instant;

use super::*;
use crate::link::message::{MissionCount, MissionRequestInt, MissionRequestList, StatusText};

async fn download(vehicle: &Vehicle) -> Result<Vec<MissionItem>, TransferError> {
    Ok(vehicle.download(MISSION, &mut |_| {}).await?.items)
}

fn count(count: u16) -> MissionCount {
    MissionCount { count, target: QUAVD, mission_type: 0, opaque_id: 0 }
}

/// Answers a whole download as asked.
async fn serve(peer: &mut Peer, items: &[MissionItem]) {
    peer.hears::<MissionRequestList>().await;
    peer.say(&count(u16::try_from(items.len()).unwrap())).await;
    serve_items(peer, items).await;
}

async fn serve_items(peer: &mut Peer, items: &[MissionItem]) {
    let mut missing = items.len();
    while missing > 0 {
        let request: MissionRequestInt = peer.hears().await;
        peer.say(&item_message(items[usize::from(request.seq)])).await;
        missing -= 1;
    }
}

#[tokio::test(start_paused = true)]
async fn an_empty_plan_is_a_plan_and_is_acknowledged() {
    let (vehicle, mut peer, _task) = scene(PX4).await;
    let (items, ack) = tokio::join!(download(&vehicle), async {
        serve(&mut peer, &[]).await;
        peer.hears::<MissionAck>().await
    });
    assert_eq!(items.unwrap(), []);
    assert_eq!((ack.result, ack.target), (0, AUTOPILOT));
}

#[tokio::test(start_paused = true)]
async fn lost_messages_are_asked_for_again() {
    let (vehicle, mut peer, _task) = scene(PX4).await;
    let (held, ()) = tokio::join!(download(&vehicle), async {
        peer.hears::<MissionRequestList>().await;
        peer.hears::<MissionRequestList>().await;
        peer.say(&count(2)).await;
        for _ in 0..4 {
            assert_eq!(peer.hears::<MissionRequestInt>().await.seq, 0);
        }
        serve_items(&mut peer, &items(2)).await;
    });
    assert_eq!(held.unwrap(), items(2));
}

#[tokio::test(start_paused = true)]
async fn what_belongs_to_another_transfer_is_passed_over() {
    let (vehicle, mut peer, _task) = scene(PX4).await;
    let wrong = MissionItem { x: -1, ..item(0) };
    let (held, ()) = tokio::join!(download(&vehicle), async {
        peer.hears::<MissionRequestList>().await;
        peer.say(&MissionCount { mission_type: 1, ..count(9) }).await;
        peer.say(&MissionCount { target: GROUND_STATION, ..count(9) }).await;
        peer.say_as(GROUND_STATION, &count(9)).await;
        peer.say(&count(2)).await;
        peer.hears::<MissionRequestInt>().await;
        peer.say(&MissionItemInt { mission_type: 2, ..item_message(wrong) }).await;
        peer.say(&MissionItemInt { target: GROUND_STATION, ..item_message(wrong) }).await;
        peer.say_as(node(2, 1), &item_message(wrong)).await;
        peer.say(&item_message(MissionItem { seq: 1, ..wrong })).await;
        peer.noise(&[0xfd; 400]).await;
        peer.say(&item_message(item(0))).await;
        peer.hears::<MissionRequestInt>().await;
        peer.say(&item_message(item(1))).await;
    });
    assert_eq!(held.unwrap(), items(2));
}

#[tokio::test(start_paused = true)]
async fn px4_is_never_asked_out_of_turn_and_ardupilot_is_asked_ahead() {
    for (autopilot, widest) in [(PX4, 1), (ARDUPILOT, 16)] {
        let (vehicle, mut peer, _task) = scene(autopilot).await;
        let (held, most) = tokio::join!(download(&vehicle), async {
            peer.hears::<MissionRequestList>().await;
            peer.say(&count(100)).await;
            let (mut answered, mut most) = (0, 0);
            while answered < 100 {
                let mut asked = vec![peer.hears::<MissionRequestInt>().await.seq];
                while let Some(more) = peer.hears_within(Duration::from_millis(50)).await {
                    let MissionRequestInt { seq, .. } = more;
                    asked.push(seq);
                }
                most = most.max(asked.len());
                for seq in asked {
                    assert_eq!(seq, answered);
                    peer.say(&item_message(item(seq))).await;
                    answered += 1;
                }
            }
            most
        });
        assert_eq!(held.unwrap(), items(100));
        assert_eq!(most, widest);
    }
}

#[tokio::test(start_paused = true)]
async fn items_come_back_with_every_bit_whatever_they_mean() {
    let odd = MissionItem {
        command: Command(60_001),
        frame: Frame(99),
        params: [f32::NAN, f32::INFINITY, -0.0, f32::MIN_POSITIVE],
        x: i32::MIN,
        ..item(0)
    };
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let plan = [odd];
    let (held, ()) = tokio::join!(download(&vehicle), serve(&mut peer, &plan));
    let held = held.unwrap();
    assert_eq!(held[0].params.map(f32::to_bits), odd.params.map(f32::to_bits));
    assert_eq!((held[0].command, held[0].frame, held[0].x), (odd.command, odd.frame, odd.x));
}

#[tokio::test(start_paused = true)]
async fn a_vehicle_that_falls_silent_is_given_up_and_the_item_named() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let (held, ()) = tokio::join!(download(&vehicle), async {
        peer.hears::<MissionRequestList>().await;
        peer.say(&count(3)).await;
        serve_items(&mut peer, &items(1)).await;
        peer.fall_silent();
        while peer.hears_within::<MissionRequestInt>(Duration::from_secs(60)).await.is_some() {}
    });
    let error = held.unwrap_err();
    assert!(error.to_string().contains("waiting for item 1 of the mission"), "{error}");
    assert!(error.is_unreachable());
}

#[tokio::test(start_paused = true)]
async fn a_vehicle_that_loses_the_thread_is_asked_from_the_start() {
    let (vehicle, mut peer, _task) = scene(PX4).await;
    let (held, ()) = tokio::join!(download(&vehicle), async {
        peer.hears::<MissionRequestList>().await;
        peer.say(&count(2)).await;
        peer.hears::<MissionRequestInt>().await;
        peer.say(&ack(MissionResult::ERROR)).await;
        serve(&mut peer, &items(2)).await;
    });
    assert_eq!(held.unwrap(), items(2));
}

#[tokio::test(start_paused = true)]
async fn a_count_that_lies_ends_in_an_error_not_in_a_long_wait() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let (held, ()) = tokio::join!(download(&vehicle), async {
        for _ in 0..=vehicle.timing.restarts {
            peer.hears::<MissionRequestList>().await;
            peer.say(&count(5)).await;
            loop {
                let request: MissionRequestInt = peer.hears().await;
                if request.seq < 3 {
                    peer.say(&item_message(item(request.seq))).await;
                } else {
                    peer.say(&count(3)).await;
                    peer.say(&ack(MissionResult::INVALID_SEQUENCE)).await;
                    break;
                }
            }
        }
    });
    let error = held.unwrap_err();
    assert!(matches!(error, TransferError::Refused { .. }), "{error}");
    let (held, ()) = tokio::join!(download(&vehicle), async {
        peer.hears::<MissionRequestList>().await;
        peer.say(&count(u16::MAX)).await;
    });
    assert!(matches!(held, Err(TransferError::TooManyAnnounced { .. })), "{held:?}");
}

#[tokio::test(start_paused = true)]
async fn a_busy_vehicle_is_waited_for_and_then_given_up() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let (held, ()) = tokio::join!(download(&vehicle), async {
        for _ in 0..3 {
            peer.hears::<MissionRequestList>().await;
            peer.say(&ack(MissionResult::DENIED)).await;
        }
        serve(&mut peer, &items(1)).await;
    });
    assert_eq!(held.unwrap(), items(1));
    let deny = async {
        loop {
            peer.hears::<MissionRequestList>().await;
            peer.say(&ack(MissionResult::DENIED)).await;
        }
    };
    let error = tokio::select! {
        held = download(&vehicle) => held.unwrap_err(),
        () = deny => unreachable!("it never ends"),
    };
    assert!(matches!(error, TransferError::Busy { .. }), "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_refusal_carries_the_words_that_come_after_it() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let (held, ()) = tokio::join!(download(&vehicle), async {
        peer.hears::<MissionRequestList>().await;
        peer.say(&ack(MissionResult(3))).await;
        let mut text = [0; 50];
        text[..11].copy_from_slice(b"no such one");
        tokio::time::sleep(Duration::from_millis(200)).await;
        peer.say(&StatusText { severity: 4, text, id: 0, chunk: 0 }).await;
    });
    let error = held.unwrap_err().to_string();
    assert!(error.contains("unsupported command") && error.contains("no such one"), "{error}");
}

#[tokio::test(start_paused = true)]
async fn an_item_that_later_ones_overtook_is_asked_for_at_once() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let (held, begun) = tokio::join!(download(&vehicle), async {
        peer.hears::<MissionRequestList>().await;
        peer.say(&count(80)).await;
        let begun = Instant::now();
        // The request for item 20 is lost twice; enough others follow each time.
        let (mut lost, mut missing) = (0, 80);
        while missing > 0 {
            let request: MissionRequestInt = peer.hears().await;
            tokio::time::advance(Duration::from_millis(1)).await;
            if request.seq == 20 && lost < 2 {
                lost += 1;
                continue;
            }
            peer.say(&item_message(item(request.seq))).await;
            missing -= 1;
        }
        begun
    });
    assert_eq!(held.unwrap(), items(80));
    let waited = begun.elapsed();
    assert!(waited < vehicle.timing.item_min, "waited for a time-out: {waited:?}");
}
