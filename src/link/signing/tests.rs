use mavlink::MAVLinkV2MessageRaw;

use super::*;
use crate::link::frame::Packet;
use crate::link::id::{ComponentId, Node, SystemId};
use crate::link::message::MissionRequestList;

const MINUTE: u64 = 60 * Timestamp::PER_SECOND;
/// Far in the future of whoever runs the tests, so that the system's clock does not matter.
const NOW: Timestamp = Timestamp(1 << 47);

fn signer(key: u8, link_id: u8, unsigned: UnsignedPolicy) -> Signer {
    Signer::new(Key::new([key; 32]), unsigned, link_id, Clock::starting_at(NOW))
}

fn unsigned(sequence: u8) -> MAVLinkV2MessageRaw {
    let node = Node { system: SystemId(1), component: ComponentId(1) };
    Packet::new(&MissionRequestList { target: node, mission_type: 1 })
        .to_frame(node, sequence, None)
}

fn signed(by: &mut Signer, sequence: u8) -> MAVLinkV2MessageRaw {
    let node = Node { system: SystemId(1), component: ComponentId(1) };
    Packet::new(&MissionRequestList { target: node, mission_type: 1 }).to_frame(
        node,
        sequence,
        Some(by),
    )
}

fn admit(by: &mut Signer, frame: &MAVLinkV2MessageRaw) -> Result<(), Rejection> {
    by.admit(&MAVLinkMessageRaw::V2(*frame))
}

#[test]
fn a_frame_is_let_in_once_and_only_with_the_right_key() {
    let (mut ours, mut theirs) =
        (signer(1, 0, UnsignedPolicy::default()), signer(1, 3, UnsignedPolicy::default()));
    let frame = signed(&mut theirs, 0);
    assert_eq!(admit(&mut ours, &frame), Ok(()));
    assert_eq!(admit(&mut ours, &frame), Err(Rejection::Replayed));
    let later = signed(&mut theirs, 1);
    assert_eq!(admit(&mut ours, &later), Ok(()));
    assert_eq!(admit(&mut ours, &frame), Err(Rejection::Replayed));
    let mut stranger = signer(2, 0, UnsignedPolicy::default());
    let frame = signed(&mut stranger, 2);
    assert_eq!(admit(&mut ours, &frame), Err(Rejection::WrongSignature));
}

#[test]
fn each_bit_of_a_frame_is_signed() {
    let mut theirs = signer(1, 3, UnsignedPolicy::default());
    let frame = signed(&mut theirs, 0);
    // From the second flag byte on: the first says that there is a signature, the length before it
    // where it is.
    for at in 3..frame.raw_bytes().len() {
        let mut ours = signer(1, 0, UnsignedPolicy::Accept);
        let mut bent = frame;
        set_byte(&mut bent, at, frame.raw_bytes()[at] ^ 0x10);
        assert_eq!(admit(&mut ours, &bent), Err(Rejection::WrongSignature), "byte {at}");
    }
}

fn set_byte(frame: &mut MAVLinkV2MessageRaw, at: usize, byte: u8) {
    let mut bytes = [0; mavlink::consts::MAX_FRAME_SIZE];
    let raw = frame.raw_bytes();
    bytes[..raw.len()].copy_from_slice(raw);
    bytes[at] = byte;
    *frame = MAVLinkV2MessageRaw::from_bytes_unparsed(bytes);
}

#[test]
fn frames_without_a_signature_are_a_matter_of_the_policy() {
    let frame = unsigned(0);
    for (policy, verdict) in [
        (UnsignedPolicy::Reject, Err(Rejection::Unsigned)),
        (UnsignedPolicy::RadioStatus, Err(Rejection::Unsigned)),
        (UnsignedPolicy::Accept, Ok(())),
    ] {
        assert_eq!(admit(&mut signer(1, 0, policy), &frame), verdict);
        assert_eq!(policy.to_string().parse(), Ok(policy));
        assert_eq!(policy.lets_in(RADIO_STATUS), policy != UnsignedPolicy::Reject);
    }
    assert!("all".parse::<UnsignedPolicy>().is_err());
}

#[test]
fn a_new_stream_may_lag_a_minute_and_a_known_one_more() {
    let with_clock = |at: u64, link_id| {
        let clock = Clock::starting_at(Timestamp(at));
        Signer::new(Key::new([1; 32]), UnsignedPolicy::default(), link_id, clock)
    };
    let mut ours = with_clock(NOW.0, 0);
    let late = signed(&mut with_clock(NOW.0 - MINUTE - 100, 1), 0);
    assert_eq!(admit(&mut ours, &late), Err(Rejection::TooOld));
    let mut lagging = with_clock(NOW.0 - MINUTE + 100, 1);
    assert_eq!(admit(&mut ours, &signed(&mut lagging, 0)), Ok(()));
    // Another sender moves our time on; the known stream still counts.
    let mut ahead = with_clock(NOW.0 + 10 * MINUTE, 2);
    assert_eq!(admit(&mut ours, &signed(&mut ahead, 0)), Ok(()));
    assert_eq!(admit(&mut ours, &signed(&mut lagging, 1)), Ok(()));
    // And ours goes on from there, so that nobody takes it for a replay.
    let own = signed(&mut ours, 0);
    assert!(own.signature_timestamp() > NOW.0 + 10 * MINUTE);
}

#[test]
fn a_flood_of_senders_costs_no_memory() {
    let mut ours = signer(1, 0, UnsignedPolicy::default());
    let mut refused = 0;
    for link_id in 0..=255 {
        for system in [1, 2] {
            let node = Node { system: SystemId(system), component: ComponentId(1) };
            let message = MissionRequestList { target: node, mission_type: 1 };
            let mut theirs = signer(1, link_id, UnsignedPolicy::default());
            let frame = Packet::new(&message).to_frame(node, 0, Some(&mut theirs));
            refused += u32::from(admit(&mut ours, &frame) == Err(Rejection::TooManyStreams));
        }
    }
    assert_eq!((ours.streams.len(), refused), (MOST_STREAMS, 256));
}
