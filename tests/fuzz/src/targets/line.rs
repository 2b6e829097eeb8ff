//! What comes over a line: frames, and a vehicle that answers with anything.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::time::Duration;

use mavlink::{MavlinkVersion, MessageData};
use quav::fence::decode_fence;
use quav::link::message::{
    CommandAck, FileTransfer, Heartbeat, MissionAck, MissionCount, MissionCurrent, MissionItemInt,
    MissionRequest, MissionRequestInt, StatusText,
};
use quav::link::{ComponentId, Identity, Link, Node, SystemId, Transport};
use quav::mission::MissionType;
use quav::vehicle::download::Source;
use quav::vehicle::{Search, Vehicle, find, numbering};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio_util::sync::CancellationToken;

use super::items::{items, judged};

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
pub(super) fn frames(data: &[u8]) {
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
pub(super) fn download(data: &[u8]) {
    let answers = parts(data);
    with_vehicle(
        &[framed(0, &HEARTBEAT)],
        |far| answering(far, answers),
        async |vehicle| {
            let mut ignored = |_| {};
            if let Ok(got) = vehicle.download(MissionType::Mission, &mut ignored).await {
                let autopilot = vehicle.autopilot();
                let mission = numbering::to_mission(autopilot, &got.items, None);
                judged(&mission, autopilot.into(), 1);
            }
            if let Ok(got) = vehicle.download(MissionType::Fence, &mut ignored).await {
                let _ = decode_fence(&got.items, None);
            }
        },
    );
}

/// A vehicle that answers an upload with anything. The first byte says how long the plan is, and
/// which autopilot takes it.
pub(super) fn upload(data: &[u8]) {
    let Some((&which, rest)) = data.split_first() else { return };
    let answers = parts(rest);
    let plan = items(&[[7; 37]; 8].concat()[..37 * usize::from(which % 8)]);
    let mut heartbeat = HEARTBEAT;
    heartbeat[5] = if which & 128 == 0 { ARDUPILOT } else { PX4 };
    with_vehicle(
        &[framed(0, &heartbeat)],
        |far| answering(far, answers),
        async |vehicle| {
            let _ = vehicle.upload(MissionType::Mission, &plan, &mut |_| {}).await;
        },
    );
}

/// A vehicle that serves a plan as a file, and now and then serves it badly: two bytes for the
/// length of the file, the file, then two bytes for each answer: what is wrong with it, and how.
pub(super) fn plan_files(data: &[u8]) {
    let [low, high, rest @ ..] = data else { return };
    let length = usize::from(u16::from_le_bytes([*low, *high])).min(rest.len());
    let (file, faults) = rest.split_at(length);
    let mut files = FileServer {
        file: file.to_vec(),
        faults: faults.as_chunks::<2>().0.iter().copied().collect(),
    };
    let version = framed(148, &[32]); // the capability FTP, and zeros
    let serve = |mut far: DuplexStream| async move {
        let mut asked = [0; 4096];
        let mut line = Vec::new();
        while let Ok(length @ 1..) = far.read(&mut asked).await {
            line.extend_from_slice(&asked[..length]);
            while let Some(payload) = next_payload(&mut line) {
                for answer in
                    payload.and_then(|payload| files.answers(&payload)).into_iter().flatten()
                {
                    if far.write_all(&framed(110, &answer)).await.is_err() {
                        return;
                    }
                }
            }
        }
    };
    with_vehicle(&[framed(0, &HEARTBEAT), version], serve, async |vehicle| {
        for kind in [MissionType::Mission, MissionType::Fence] {
            let Ok(plan) = vehicle.download_file(kind, &mut |_| {}).await else { continue };
            // What was let in is the file, item by item.
            assert!(matches!(plan.source, Source::File { .. }));
            assert_eq!(plan.items.len(), usize::from(u16::from_le_bytes([file[8], file[9]])));
            for (seq, item) in plan.items.iter().enumerate() {
                assert_eq!(usize::from(item.seq), seq);
                assert_eq!(item.x.to_le_bytes(), file[10 + 38 * seq + 16..][..4]);
            }
        }
    });
}

/// Finds the vehicle that says `first` on a line whose far side is `far_side`, and does some work
/// with it, which has to come to an end.
fn with_vehicle<F>(
    first: &[Vec<u8>],
    far_side: impl FnOnce(DuplexStream) -> F,
    work: impl AsyncFnOnce(&Vehicle),
) where
    F: Future<Output = ()> + 'static,
{
    RUNTIME.with_borrow(|runtime| {
        runtime.block_on(async {
            let (mut far, near) = tokio::io::duplex(65_536);
            let cancel = CancellationToken::new();
            let (link, task) =
                Link::start(Transport::from_stream(near), Identity::default(), cancel);
            let patience = Duration::from_secs(3);
            let search = Search { system: Some(SystemId(1)), patience, ..Search::default() };
            let find = find(&link, &search);
            let heard = async {
                tokio::task::yield_now().await;
                far.write_all(&first.concat()).await.expect("the line has room");
                far
            };
            let (found, far) = tokio::join!(find, heard);
            if let Ok(vehicle) = found {
                let far_side = far_side(far);
                let work = tokio::time::timeout(A_TRANSFER, work(&vehicle));
                // The far side may hang up, which the near side has to survive.
                tokio::select! {
                    ended = work => ended.expect("a transfer comes to an end"),
                    () = async { far_side.await; std::future::pending().await } => {}
                }
                vehicle.close().await;
            }
            task.close().await;
        });
    });
}

/// Longer than two transfers can take, however often they are begun again.
const A_TRANSFER: Duration = Duration::from_secs(3600);

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

/// A MAVLink FTP server with one file under every name.
struct FileServer {
    file: Vec<u8>,
    faults: VecDeque<[u8; 2]>,
}

impl FileServer {
    /// The payloads of the answers to a request.
    fn answers(&mut self, payload: &[u8]) -> Option<Vec<Vec<u8>>> {
        let asked = FileTransfer::deser(MavlinkVersion::V2, payload).ok()?;
        let offset = asked.offset as usize;
        let (code, bytes) = match asked.opcode {
            FileTransfer::OPEN_FILE_RO => {
                (FileTransfer::ACK, (self.file.len() as u32).to_le_bytes().to_vec())
            }
            FileTransfer::CALC_FILE_CRC32 => {
                (FileTransfer::ACK, crc32(&self.file).to_le_bytes().to_vec())
            }
            FileTransfer::READ_FILE => {
                match self.file.get(offset..).filter(|left| !left.is_empty()) {
                    Some(left) => {
                        let length =
                            left.len().min(usize::from(asked.size)).min(FileTransfer::MOST_DATA);
                        (FileTransfer::ACK, left[..length].to_vec())
                    }
                    None => (FileTransfer::NAK, vec![6]),
                }
            }
            _ => (FileTransfer::ACK, Vec::new()),
        };
        let mut data = [0; FileTransfer::MOST_DATA];
        data[..bytes.len()].copy_from_slice(&bytes);
        let mut answer = FileTransfer {
            target: US,
            seq: asked.seq.wrapping_add(1),
            session: 1,
            opcode: code,
            size: bytes.len() as u8,
            req_opcode: asked.opcode,
            offset: asked.offset,
            data,
        };
        let [what, how] = self.faults.pop_front().unwrap_or_default();
        let mut copies = 1;
        match what {
            1 => copies = 0,
            2 => copies = 2,
            3 => answer.size = how,
            4 => answer.opcode = how,
            5 => answer.session = how,
            6 => answer.offset = answer.offset.wrapping_add_signed(i32::from(how as i8)),
            7 => answer.seq = answer.seq.wrapping_add(u16::from(how)),
            8 => answer.req_opcode = how,
            9 => answer.data[usize::from(how) % FileTransfer::MOST_DATA] ^= 1,
            10 => answer.offset = u32::MAX - u32::from(how),
            11 => answer.size = answer.size.min(how),
            _ => {}
        }
        let mut payload = [0; 255];
        let length = answer.ser(MavlinkVersion::V2, &mut payload);
        Some(vec![payload[..length].to_vec(); copies])
    }
}

/// Who quavd is: `Identity::default`.
const US: Node = Node { system: SystemId(1), component: ComponentId::PATH_PLANNER };

/// The checksum of MAVLink FTP, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let mut register = 0_u32;
    for byte in bytes {
        register ^= u32::from(*byte);
        for _ in 0..8 {
            register = (register >> 1) ^ ((register & 1) * 0xedb8_8320);
        }
    }
    register
}

/// Takes the first frame off the bytes that quavd wrote: `None` where it is not all there, and
/// nothing in it where it is no FTP message.
fn next_payload(line: &mut Vec<u8>) -> Option<Option<Vec<u8>>> {
    let length = usize::from(*line.get(1)?);
    let frame: Vec<u8> =
        (line.len() >= length + 12).then(|| line.drain(..length + 12).collect())?;
    let is_ftp = frame[7..10] == [110, 0, 0];
    Some(is_ftp.then(|| frame[10..10 + length].to_vec()))
}

const ARDUPILOT: u8 = 3;
const PX4: u8 = 12;

/// An ArduPilot copter, disarmed.
const HEARTBEAT: [u8; 9] = [0, 0, 0, 0, 2, ARDUPILOT, 81, 3, 3];

/// Messages that quavd reads, with the seed of their checksum.
const MESSAGES: [(u8, u8); 15] = [
    (0, 50),    // HEARTBEAT
    (22, 220),  // PARAM_VALUE
    (33, 104),  // GLOBAL_POSITION_INT
    (40, 230),  // MISSION_REQUEST
    (42, 28),   // MISSION_CURRENT
    (43, 132),  // MISSION_REQUEST_LIST
    (44, 221),  // MISSION_COUNT
    (45, 232),  // MISSION_CLEAR_ALL
    (47, 153),  // MISSION_ACK
    (51, 196),  // MISSION_REQUEST_INT
    (73, 38),   // MISSION_ITEM_INT
    (77, 143),  // COMMAND_ACK
    (253, 83),  // STATUSTEXT
    (110, 84),  // FILE_TRANSFER_PROTOCOL
    (148, 178), // AUTOPILOT_VERSION
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
