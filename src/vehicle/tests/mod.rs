//! The mission protocol against a scripted autopilot in memory, with paused time: each test is the
//! conversation it checks.

mod clear;
mod discovery;
mod download;
mod parameter;
mod upload;

use std::sync::Arc;
use std::time::Duration;

use mavlink::{AsyncMavlinkReader, MessageData};
use tokio::io::{AsyncWriteExt, DuplexStream, ReadHalf, WriteHalf};
use tokio::sync::Mutex;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use super::*;
use crate::link::frame::{Packet, Wire};
use crate::link::message::{Heartbeat, MissionAck, MissionItemInt};
use crate::link::{ComponentId, Identity, LinkTask, Received, SystemId, Transport};
use crate::mission::{Command, Frame, MissionItem, MissionType};

const MISSION: MissionType = MissionType::Mission;
const QUAVD: Node = node(1, 195);
const AUTOPILOT: Node = node(1, 1);
const GROUND_STATION: Node = node(255, 190);
const ARDUPILOT: u8 = 3;
const PX4: u8 = 12;

const fn node(system: u8, component: u8) -> Node {
    Node { system: SystemId(system), component: ComponentId(component) }
}

/// The other end of the line.
struct Peer {
    reader: AsyncMavlinkReader<ReadHalf<DuplexStream>>,
    line: Arc<Mutex<WriteHalf<DuplexStream>>>,
    beat: Option<JoinHandle<()>>,
}

impl Peer {
    fn new() -> (Self, Link, LinkTask) {
        let (ours, theirs) = tokio::io::duplex(64 * 1024);
        let transport = Transport::from_stream(ours);
        let (link, task) = Link::start(transport, Identity::default(), CancellationToken::new());
        let (read, write) = tokio::io::split(theirs);
        let reader = AsyncMavlinkReader::new(read);
        (Self { reader, line: Arc::new(Mutex::new(write)), beat: None }, link, task)
    }

    /// Beats the heart of an autopilot until the peer is dropped or falls silent.
    fn beat(&mut self, autopilot: u8) {
        let line = Arc::clone(&self.line);
        self.beat = Some(tokio::spawn(async move {
            loop {
                write(&line, AUTOPILOT, &heartbeat(autopilot)).await;
                tokio::time::sleep(Duration::from_secs(1)).await;
            }
        }));
    }

    fn fall_silent(&mut self) {
        if let Some(beat) = self.beat.take() {
            beat.abort();
        }
    }

    async fn say<D: MessageData>(&self, message: &D) {
        self.say_as(AUTOPILOT, message).await;
    }

    async fn say_as<D: MessageData>(&self, from: Node, message: &D) {
        write(&self.line, from, message).await;
    }

    async fn noise(&self, bytes: &[u8]) {
        self.line.lock().await.write_all(bytes).await.unwrap();
    }

    /// The next `D` that quavd sends; anything else is passed over.
    async fn hears<D: MessageData>(&mut self) -> D {
        loop {
            let raw = self.reader.read_any_raw_message_with_dialect(&Wire).await.unwrap();
            if let Some(message) = Received::new(&raw, None).and_then(|frame| frame.decode()) {
                return message;
            }
        }
    }

    /// Whether quavd sends a `D` within `patience`.
    async fn hears_within<D: MessageData>(&mut self, patience: Duration) -> Option<D> {
        tokio::time::timeout(patience, self.hears()).await.ok()
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        self.fall_silent();
    }
}

async fn write<D: MessageData>(line: &Mutex<WriteHalf<DuplexStream>>, from: Node, message: &D) {
    let frame = Packet::new(message).to_frame(from, 0, None);
    // Fails where quavd has closed the line, which ends the test anyhow.
    let _ = line.lock().await.write_all(frame.raw_bytes()).await;
}

fn heartbeat(autopilot: u8) -> Heartbeat {
    let kind = if autopilot == Heartbeat::NO_AUTOPILOT { Heartbeat::GROUND_STATION } else { 2 };
    Heartbeat { custom_mode: 0, kind, autopilot, base_mode: 0, system_status: 4 }
}

/// A vehicle that has been found, and the autopilot that plays it.
async fn scene(autopilot: u8) -> (Vehicle, Peer, LinkTask) {
    let (mut peer, link, task) = Peer::new();
    peer.beat(autopilot);
    let search = Search { system: Some(SystemId(1)), ..Search::default() };
    let vehicle = find(&link, &search).await.unwrap();
    (vehicle, peer, task)
}

fn item(seq: u16) -> MissionItem {
    MissionItem {
        seq,
        frame: Frame::GLOBAL_RELATIVE_ALT_INT,
        command: Command::NAV_WAYPOINT,
        current: 0,
        autocontinue: 1,
        params: [0.0; 4],
        x: 1000 + i32::from(seq),
        y: 2000,
        z: 30.0,
    }
}

fn items(count: u16) -> Vec<MissionItem> {
    (0..count).map(item).collect()
}

fn item_message(item: MissionItem) -> MissionItemInt {
    MissionItemInt { item, target: QUAVD, mission_type: 0 }
}

fn ack(result: MissionResult) -> MissionAck {
    MissionAck { target: QUAVD, result: result.0, mission_type: 0, opaque_id: 0 }
}
