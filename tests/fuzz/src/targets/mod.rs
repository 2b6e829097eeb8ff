//! What is fuzzed: everything that takes bytes from outside. Each function must return for any
//! bytes at all; what it checks besides is that what was let in is sound. The integration tests run
//! the same functions over the corpora in this directory.

use std::cell::RefCell;
use std::time::Duration;

use quav::fence::{FenceSet, decode_fence, encode_fence};
use quav::formats::{
    Scenario, read_fences, read_mission, read_scenario, write_fence_text, write_geojson, write_kml,
    write_kmz, write_plan, write_waypoints, write_waypoints_fence, write_waypoints_rally,
};
use quav::ibm::{Device, PhysicalQubit};
use quav::link::message::{
    CommandAck, Heartbeat, MissionAck, MissionCount, MissionCurrent, MissionItemInt,
    MissionRequest, MissionRequestInt, StatusText,
};
use quav::link::{Identity, Link, Transport};
use quav::mission::{
    Autopilot, Command, FlightContext, Frame, LoiterHabit, Mission, MissionItem, MissionType, legs,
};
use quav::vehicle::{Search, find};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio_util::sync::CancellationToken;

/// A target by the name of its corpus.
pub(crate) type Target = (&'static str, fn(&[u8]));

/// All of them.
pub(crate) const ALL: [Target; 6] = [
    ("files", files),
    ("mission_items", mission_items),
    ("fence_items", fence_items),
    ("frames", frames),
    ("download", download),
    ("device", device),
];

/// Every file format, told apart by content as everywhere.
fn files(data: &[u8]) {
    let _ = read_fences("file", data);
    let _ = read_mission("file", data);
    let Ok(scenario) = read_scenario("file", data) else { return };
    assert_numbered(&scenario.mission);
    // What can be written reads back.
    let again = |bytes: &[u8]| read_scenario("file", bytes).expect("quavd reads what it wrote");
    for write in [write_plan, write_geojson, write_kml] {
        if let Ok(text) = write(&scenario) {
            assert_same(&again(text.as_bytes()), &scenario);
        }
    }
    if let Ok(archive) = write_kmz(&scenario) {
        assert_same(&again(&archive), &scenario);
    }
    if let Ok(text) = write_waypoints(&scenario.mission) {
        assert_eq!(debug(&again(text.as_bytes()).mission.items), debug(&scenario.mission.items));
    }
    if let Ok(text) = write_waypoints_fence(&scenario.fences) {
        let fences = again(text.as_bytes()).fences;
        assert_eq!(fences.regions.len(), scenario.fences.regions.len());
    }
    if let Ok(text) = write_fence_text(&scenario.fences) {
        assert_eq!(again(text.as_bytes()).fences.regions.len(), 1);
    }
    again(write_waypoints_rally(&scenario.rally).as_bytes());
}

fn assert_same(one: &Scenario, other: &Scenario) {
    assert_eq!(debug(&one.mission), debug(&other.mission));
    assert_eq!(one.fences.regions.len(), other.fences.regions.len());
    assert_eq!(one.fences.return_point, other.fences.return_point);
    assert_eq!(debug(&one.rally), debug(&other.rally));
}

fn assert_numbered(mission: &Mission) {
    for (index, item) in mission.items.iter().enumerate() {
        assert_eq!(usize::from(item.seq), index);
        assert!(item.params.iter().all(|param| !param.is_infinite()));
    }
}

/// Equality in which NaN is NaN.
fn debug(value: &impl std::fmt::Debug) -> String {
    format!("{value:?}")
}

/// A mission as a vehicle may hold it: 37 bytes for each item, as MISSION_ITEM_INT carries it.
fn mission_items(data: &[u8]) {
    let Some((&which, rest)) = data.split_first() else { return };
    let items = items(rest);
    for (autopilot, habit) in [
        (quav::vehicle::Autopilot::ArduPilot, Autopilot::ArduPilot),
        (quav::vehicle::Autopilot::Px4, Autopilot::Px4),
    ] {
        judged(&quav::vehicle::numbering::to_mission(autopilot, &items, None), habit, which);
    }
}

/// The legs of a mission, and every file that it can be written to.
fn judged(mission: &Mission, autopilot: Autopilot, which: u8) {
    let start = mission.items.iter().find_map(|item| item.position().ok());
    let start = start.filter(|_| which & 1 == 1);
    let rally: Vec<_> = start.into_iter().collect();
    let loiter = LoiterHabit::default();
    let context = FlightContext { start, rally: &rally, autopilot, loiter };
    if let Ok(flown) = legs(mission, &context) {
        for leg in &flown.legs {
            let _ = (leg.name().to_string(), leg.sweep());
        }
    }
    let scenario = Scenario { mission: mission.clone(), ..Scenario::default() };
    let _ = write_plan(&scenario);
    let _ = write_waypoints(mission);
    let _ = write_geojson(&scenario);
}

/// A fence as a vehicle may hold it.
fn fence_items(data: &[u8]) {
    let Ok(decoded) = decode_fence(&items(data), None) else { return };
    let encoded = encode_fence(&decoded.fences).expect("what was decoded can be encoded");
    let again = decode_fence(&encoded, None).expect("what was encoded can be decoded").fences;
    let plain = |set: &FenceSet| -> Vec<_> {
        set.regions.iter().map(|region| (region.role, region.shape.clone())).collect()
    };
    assert_eq!(plain(&again), plain(&decoded.fences));
    assert_eq!(debug(&again.return_point), debug(&decoded.fences.return_point));
}

fn items(data: &[u8]) -> Vec<MissionItem> {
    let item = |(seq, bytes): (usize, &[u8; 37])| {
        let four = |at: usize| [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
        let float = |at: usize| f32::from_le_bytes(four(at));
        MissionItem {
            seq: seq as u16,
            params: [float(0), float(4), float(8), float(12)],
            x: i32::from_le_bytes(four(16)),
            y: i32::from_le_bytes(four(20)),
            z: float(24),
            command: Command(u16::from_le_bytes([bytes[30], bytes[31]])),
            frame: Frame(bytes[34]),
            current: bytes[35],
            autocontinue: bytes[36],
        }
    };
    data.as_chunks::<37>().0.iter().enumerate().map(item).collect()
}

thread_local! {
    /// Time is paused: what waits for an answer that does not come does not wait.
    static RUNTIME: RefCell<tokio::runtime::Runtime> = RefCell::new(
        tokio::runtime::Builder::new_current_thread()
            .enable_time()
            .start_paused(true)
            .build()
            .expect("a runtime without I/O"),
    );
}

/// A serial line with anything on it: raw bytes, and frames with valid checksums between them.
fn frames(data: &[u8]) {
    RUNTIME.with_borrow(|runtime| {
        runtime.block_on(async {
            let line = parts(data).concat();
            let (mut far, near) = tokio::io::duplex(line.len().max(1));
            let cancel = CancellationToken::new();
            let (link, task) =
                Link::start(Transport::from_stream(near), Identity::default(), cancel);
            let Ok(mut inbox) = link.subscribe() else { return };
            far.write_all(&line).await.expect("the line has room");
            drop(far);
            while let Ok(frame) = inbox.next().await {
                let _ = frame.decode::<Heartbeat>();
                let _ = frame.decode::<MissionCount>();
                let _ = frame.decode::<MissionRequest>();
                let _ = frame.decode::<MissionRequestInt>();
                let _ = frame.decode::<MissionItemInt>();
                let _ = frame.decode::<MissionAck>();
                let _ = frame.decode::<MissionCurrent>();
                let _ = frame.decode::<CommandAck>();
                if let Some(text) = frame.decode::<StatusText>() {
                    let _ = format!("{text:?}");
                }
            }
            task.close().await;
        });
    });
}

/// A vehicle that answers a download with anything.
fn download(data: &[u8]) {
    RUNTIME.with_borrow(|runtime| {
        runtime.block_on(async {
            let answers = parts(data);
            let (mut far, near) = tokio::io::duplex(65_536);
            let cancel = CancellationToken::new();
            let (link, task) =
                Link::start(Transport::from_stream(near), Identity::default(), cancel);
            far.write_all(&framed(0, &HEARTBEAT)).await.expect("the line has room");
            let search = Search { patience: Duration::from_secs(3), ..Search::default() };
            if let Ok(vehicle) = find(&link, &search).await {
                tokio::spawn(answering(far, answers));
                for (kind, what) in [(MissionType::Mission, 0), (MissionType::Fence, 1)] {
                    let mut ignored = |_| {};
                    let work = vehicle.download(kind, &mut ignored);
                    let got = tokio::time::timeout(Duration::from_secs(60), work).await;
                    match got {
                        Ok(Ok(got)) if what == 1 => drop(decode_fence(&got.items, None)),
                        Ok(Ok(got)) => {
                            let autopilot = vehicle.autopilot();
                            let mission =
                                quav::vehicle::numbering::to_mission(autopilot, &got.items, None);
                            judged(&mission, autopilot.into(), 1);
                        }
                        _ => {}
                    }
                }
                vehicle.close().await;
            }
            task.close().await;
        });
    });
}

/// The far side of the line: one answer to whatever comes, then silence.
async fn answering(mut far: DuplexStream, answers: Vec<Vec<u8>>) {
    let mut asked = [0; 4096];
    let mut answers = answers.into_iter();
    while far.read(&mut asked).await.is_ok_and(|length| length > 0) {
        if let Some(answer) = answers.next()
            && far.write_all(&answer).await.is_err()
        {
            return;
        }
    }
}

/// What IBM's service says about a backend: its two documents with a zero byte between them.
fn device(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let (configuration, properties) = text.split_once('\0').unwrap_or((text, text));
    let Ok(device) = Device::parse(configuration, properties) else { return };
    for index in 0..device.qubits().len() {
        let qubit = device.qubit(PhysicalQubit(index as u32)).expect("it is in the list");
        let _ = qubit.usable();
    }
}

/// An ArduPilot copter, disarmed.
const HEARTBEAT: [u8; 9] = [0, 0, 0, 0, 2, 3, 81, 3, 3];

/// Messages that quavd reads, with the seed of their checksum.
const MESSAGES: [(u8, u8); 13] = [
    (0, 50),   // HEARTBEAT
    (22, 220), // PARAM_VALUE
    (33, 104), // GLOBAL_POSITION_INT
    (40, 230), // MISSION_REQUEST
    (42, 28),  // MISSION_CURRENT
    (43, 132), // MISSION_REQUEST_LIST
    (44, 221), // MISSION_COUNT
    (45, 232), // MISSION_CLEAR_ALL
    (47, 153), // MISSION_ACK
    (51, 196), // MISSION_REQUEST_INT
    (73, 38),  // MISSION_ITEM_INT
    (77, 143), // COMMAND_ACK
    (253, 83), // STATUSTEXT
];

/// Bytes for a line out of bytes of a fuzzer, which cannot find checksums: a byte that chooses
/// (a message, or raw bytes), one for the length, and so many more.
fn parts(mut data: &[u8]) -> Vec<Vec<u8>> {
    let mut parts = Vec::new();
    while let [which, length, rest @ ..] = data {
        let (part, left) = rest.split_at(usize::from(*length).min(rest.len()));
        match MESSAGES.get(usize::from(*which)) {
            Some((id, _)) => parts.push(framed(*id, part)),
            None => parts.push(part.to_vec()),
        }
        data = left;
    }
    parts
}

/// A MAVLink 2 frame from the vehicle.
fn framed(id: u8, payload: &[u8]) -> Vec<u8> {
    let seed = MESSAGES.iter().find(|(known, _)| *known == id).map_or(0, |(_, seed)| *seed);
    let mut frame = vec![0xfd, payload.len() as u8, 0, 0, 0, 1, 1, id, 0, 0];
    frame.extend(payload);
    // CRC-16/MCRF4XX over all but the magic byte, then the seed.
    let mut crc = 0xffff_u16;
    for byte in frame[1..].iter().copied().chain([seed]) {
        crc ^= u16::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0x8408 } else { crc >> 1 };
        }
    }
    frame.extend(crc.to_le_bytes());
    frame
}
