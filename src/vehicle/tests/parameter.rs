use std::time::Duration;

use tokio::time::Instant;

use super::*;
use crate::link::message::{ParamError, ParamName, ParamRequestRead, ParamValue};

/// An autopilot that has these parameters, and loses what `loses` says (counted from 0).
async fn answer(
    peer: &mut Peer,
    table: &[(&str, f32)],
    mut loses: impl FnMut(u32) -> bool,
    says_unknown: bool,
) {
    let mut count = 0;
    loop {
        let request: ParamRequestRead = peer.hears().await;
        count += 1;
        if loses(count - 1) {
            continue;
        }
        let place = |name: &str| ParamName::new(name) == Some(request.name);
        let at = match request.index {
            -1 => table.iter().position(|(name, _)| place(name)),
            index => usize::try_from(index).ok().filter(|&index| index < table.len()),
        };
        if let Some(at) = at {
            let (name, value) = table[at];
            peer.say(&ParamValue {
                bits: value.to_bits(),
                count: 2,
                index: if request.index == -1 { u16::MAX } else { 0 },
                name: ParamName::new(name).unwrap(),
                kind: 9,
            })
            .await;
        } else if says_unknown {
            let error = ParamError::DOES_NOT_EXIST;
            peer.say(&ParamError { target: QUAVD, index: -1, name: request.name, error }).await;
        }
    }
}

const TABLE: [(&str, f32); 2] = [("FENCE_ALT_MAX", 100.0), ("FENCE_MARGIN", 2.0)];
const NAMES: [&str; 4] = ["FENCE_MARGIN", "GF_ACTION", "FENCE_ALT_MAX", "FENCE_MARGIN"];

#[tokio::test(start_paused = true)]
async fn parameters_come_in_the_order_of_their_names_and_unknown_ones_are_none() {
    for says_unknown in [true, false] {
        let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
        let begin = Instant::now();
        let read = tokio::select! {
            read = vehicle.parameters(&NAMES) => read.unwrap(),
            () = answer(&mut peer, &TABLE, |_| false, says_unknown) => unreachable!(),
        };
        let values: Vec<_> = read.iter().map(|value| value.map(ParameterValue::as_f64)).collect();
        assert_eq!(values, [Some(2.0), None, Some(100.0), Some(2.0)]);
        let most = if says_unknown { Duration::from_millis(100) } else { Duration::from_secs(4) };
        assert!(begin.elapsed() <= most, "{:?}", begin.elapsed());
    }
}

#[tokio::test(start_paused = true)]
async fn what_a_vehicle_does_not_have_is_waited_for_once_and_noticed_when_it_comes() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let grown = [("FENCE_ALT_MAX", 100.0), ("FENCE_MARGIN", 2.0), ("GF_ACTION", 1.0)];
    let mut took = Vec::new();
    for (table, has) in [(&TABLE[..], false), (&TABLE, false), (&grown, true), (&grown, true)] {
        let begin = Instant::now();
        let read = tokio::select! {
            read = vehicle.parameters(&NAMES) => read.unwrap(),
            () = answer(&mut peer, table, |_| false, false) => unreachable!(),
        };
        assert_eq!((read[0].is_some(), read[1].is_some()), (true, has));
        took.push(begin.elapsed());
    }
    assert!(took[0] >= Duration::from_secs(1), "{took:?}");
    assert!(took[1..].iter().all(|took| *took < Duration::from_millis(100)), "{took:?}");
    // Where nothing else is asked for, there is nothing to go by.
    let alone = tokio::select! {
        read = vehicle.parameter("NO_SUCH") => read.unwrap(),
        () = answer(&mut peer, &TABLE, |_| false, false) => unreachable!(),
    };
    assert_eq!(alone, None);
}

#[tokio::test(start_paused = true)]
async fn a_parameter_is_asked_for_again_until_it_comes() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    let read = tokio::select! {
        read = vehicle.parameter("FENCE_MARGIN") => read.unwrap(),
        // The name is lost eight times, the other question every second time.
        () = answer(&mut peer, &TABLE, |k| k < 16 && k % 4 != 1, false) => unreachable!(),
    };
    assert_eq!(read, Some(ParameterValue::Real(2.0)));
}

#[tokio::test(start_paused = true)]
async fn silence_of_a_dead_line_is_not_taken_for_an_unknown_name() {
    let (vehicle, mut peer, _task) = scene(ARDUPILOT).await;
    peer.fall_silent();
    let error = vehicle.parameter("FENCE_MARGIN").await.unwrap_err();
    assert!(matches!(error, ParameterError::NoAnswer { .. }), "{error}");
    let error = vehicle.parameter("A NAME").await.unwrap_err();
    assert!(matches!(error, ParameterError::Name { .. }), "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_value_of_somebody_else_is_not_the_vehicles() {
    let (vehicle, peer, _task) = scene(ARDUPILOT).await;
    let name = ParamName::new("FENCE_MARGIN").unwrap();
    let value = |bits: f32| ParamValue { bits: bits.to_bits(), count: 1, index: 0, name, kind: 9 };
    let script = async {
        let mut peer = peer;
        let _: ParamRequestRead = peer.hears().await;
        for from in [GROUND_STATION, node(1, 100), node(2, 1)] {
            peer.say_as(from, &value(9.0)).await;
        }
        peer.say(&value(3.0)).await;
        peer
    };
    let (read, _peer) = tokio::join!(vehicle.parameter("FENCE_MARGIN"), script);
    assert_eq!(read.unwrap(), Some(ParameterValue::Real(3.0)));
}
