//! How much of a slow serial line a transfer uses, and how often one succeeds on a bad link.
//!
//! `make bench-link`. The fake vehicle paces a pty to 57,600 baud in both directions, 10 bits to
//! the byte. For each transfer the least time is worked out in which the line can carry it under
//! the rules of its protocol, from the very frames (12 bytes around a payload without its trailing
//! zeros):
//!
//! - upload: COUNT, then REQUEST and ITEM_INT in turn for each item, then ACK. The vehicle asks for
//!   an item when it has the one before, so the bytes of both directions add up;
//! - download one by one (PX4): REQUEST_LIST, COUNT, then REQUEST_INT and ITEM_INT in turn;
//! - download ahead (ArduPilot): the same, but requests go up while items come down, so only the
//!   first request and all items count;
//! - file: a read and its answer for the header, then all answers of 239 bytes of the file, then
//!   the checksum.
//!
//! Heartbeats and telemetry share the line and are not part of the bound: they count against the
//! ratio, as do all waits. On a machine that does other things as well, quavd and the vehicle also
//! wait for a processor. How long is said (Linux's `schedstat`, summed over all threads of both), but
//! it cannot be taken off: a part of it passes while the line is busy anyhow. Environment: `QUAV_BENCH_ITEMS` (200), `QUAV_BENCH_LOSSY_RUNS` (100).

#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::print_stdout)]
#![allow(dead_code)] // of the tests' fake vehicle, of which only a part is needed here

#[path = "../tests/it/sitl.rs"]
mod sitl;

use std::time::{Duration, Instant};

use mavlink::{MavlinkVersion, MessageData};
use quav::link::message::{
    FileTransfer, MissionAck, MissionCount, MissionItemInt, MissionRequestInt, MissionRequestList,
};
use quav::link::{ComponentId, Node, SystemId};
use quav::mission::{Mission, MissionItem, MissionType};
use quav::vehicle::TransferError;
use quav::vehicle::download::Source;
use quav::vehicle::numbering::to_vehicle;
use quav::vehicle::readback::differences;

use tokio::task::JoinSet;

use sitl::{FakeVehicle, PERSONAS, Session, search, waypoint};

const BAUD: u32 = 57_600;
/// Lossy runs at a time.
const AT_ONCE: usize = 12;
const MISSION: MissionType = MissionType::Mission;
const VEHICLE: Node = Node { system: SystemId(1), component: ComponentId(1) };

fn from_environment(name: &str, default: u16) -> u16 {
    std::env::var(name).map_or(default, |text| text.parse().expect(name))
}

/// Bytes of a message on the line.
fn on_line<D: MessageData>(message: &D) -> usize {
    let mut payload = [0; 255];
    12 + message.ser(MavlinkVersion::V2, &mut payload)
}

fn item(item: &MissionItem) -> usize {
    on_line(&MissionItemInt { item: *item, target: VEHICLE, mission_type: 0 })
}

fn request(seq: u16) -> usize {
    on_line(&MissionRequestInt { seq, target: VEHICLE, mission_type: 0 })
}

/// COUNT and ACK, or REQUEST_LIST and COUNT.
fn around(count: u16, is_upload: bool) -> usize {
    let count = on_line(&MissionCount { count, target: VEHICLE, mission_type: 0, opaque_id: 0 });
    let other = if is_upload {
        on_line(&MissionAck { target: VEHICLE, result: 0, mission_type: 0, opaque_id: 0 })
    } else {
        on_line(&MissionRequestList { target: VEHICLE, mission_type: 0 })
    };
    count + other
}

fn in_turn(items: &[MissionItem], is_upload: bool) -> usize {
    let each: usize = items.iter().map(|it| request(it.seq) + item(it)).sum();
    around(items.len() as u16, is_upload) + each
}

fn ahead(items: &[MissionItem]) -> usize {
    around(items.len() as u16, false) + request(0) + items.iter().map(item).sum::<usize>()
}

fn file(items: &[MissionItem]) -> usize {
    // Where zeros end a frame they are not sent: of the offset of the first reads three bytes, of the
    // header's count and of the file's length one and two.
    let frame = |size: usize, is_read: bool| {
        let mut data = [1; FileTransfer::MOST_DATA];
        data[size..].fill(0);
        let opcode = if is_read { FileTransfer::READ_FILE } else { FileTransfer::ACK };
        on_line(&FileTransfer {
            target: VEHICLE,
            seq: 1,
            session: 1,
            opcode,
            size: size as u8,
            req_opcode: 0,
            offset: if is_read { 1 } else { u32::MAX },
            data,
        })
    };
    let body = items.len() * 38;
    let (whole, rest) = (body / FileTransfer::MOST_DATA, body % FileTransfer::MOST_DATA);
    let header = frame(0, true) + frame(9, false) + frame(0, true);
    let path = "@MISSION/mission.dat".len();
    header
        + whole * frame(FileTransfer::MOST_DATA, false)
        + frame(rest, false)
        + 2 * frame(path, false)
        + frame(2, false)
        + frame(4, false)
}

/// How long the threads of a process have been ready to run without a processor.
fn waited_for_cpu(process: &str) -> Duration {
    let tasks = std::fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten();
    let waited = |task: std::fs::DirEntry| -> Option<u64> {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().nth(1)?.parse().ok()
    };
    Duration::from_nanos(tasks.flatten().filter_map(waited).sum())
}

/// The time since it was made, and how much of that was waiting for a processor.
struct Watch {
    began: Instant,
    vehicle: String,
    waited: Duration,
}

#[derive(Clone, Copy)]
struct Took {
    all: Duration,
    waiting: Duration,
}

impl Watch {
    fn start(fake: &FakeVehicle) -> Self {
        let vehicle = fake.pid().to_string();
        let waited = waited_for_cpu("self") + waited_for_cpu(&vehicle);
        Self { began: Instant::now(), vehicle, waited }
    }

    fn took(&self) -> Took {
        let all = self.began.elapsed();
        let waited = waited_for_cpu("self") + waited_for_cpu(&self.vehicle);
        Took { all, waiting: waited.saturating_sub(self.waited).min(all) }
    }
}

impl Took {
    fn since(self, earlier: Self) -> Self {
        Self {
            all: self.all.saturating_sub(earlier.all),
            waiting: self.waiting.saturating_sub(earlier.waiting),
        }
    }
}

fn report(what: &str, bytes: usize, took: Took) {
    let bound = bytes as f64 * 10.0 / f64::from(BAUD);
    let (all, waiting) = (took.all.as_secs_f64(), took.waiting.as_secs_f64());
    println!(
        "{what:<38} {bytes:>6} bytes, at least {bound:>6.3} s, took {all:>6.3} s: {:>5.1} %; \
         threads waited {waiting:.1} s for a processor",
        100.0 * bound / all
    );
}

async fn slow_line(persona: &str, count: u16) {
    let baud = BAUD.to_string();
    let fake = FakeVehicle::start_on("pty", &["--persona", persona, "--baud", &baud]);
    let session = Session::open(&fake.endpoint(), search()).await;
    let vehicle = &session.vehicle;
    let mission = Mission { home: None, items: (0..count).map(waypoint).collect() };
    let sent = to_vehicle(vehicle.autopilot(), &mission, None);

    let watch = Watch::start(&fake);
    vehicle.upload(MISSION, &sent, &mut |_| {}).await.unwrap();
    let uploaded = watch.took();
    let held = vehicle.download(MISSION, &mut |_| {}).await.unwrap().items;
    let verified = watch.took();
    assert_eq!(differences(vehicle.autopilot(), MISSION, &sent, &held), []);

    let up = in_turn(&sent, true);
    let down = if persona == "ardupilot" { ahead(&held) } else { in_turn(&held, false) };
    println!("\n{persona}, {} items at {BAUD} baud", sent.len());
    report("upload", up, uploaded);
    report(
        if persona == "ardupilot" { "download, asked ahead" } else { "download, one by one" },
        down,
        verified.since(uploaded),
    );
    report("upload and verification together", up + down, verified);
    if vehicle.serves_files() {
        let watch = Watch::start(&fake);
        let plan = vehicle.read_plan(MISSION, &mut |_| {}).await.unwrap();
        assert!(matches!(plan.source, Source::File { .. }), "{:?}", plan.source);
        report("download as a file", file(&plan.items), watch.took());
    }
    session.close().await;
}

/// One mission of 100 items up and verified over a link that loses 30 % each way: the time it took.
async fn lossy_run(persona: &'static str, seed: u16) -> Result<f64, String> {
    let start = move || FakeVehicle::start(&["--persona", persona, "--seed", &seed.to_string()]);
    let mut fake = tokio::task::spawn_blocking(start).await.unwrap();
    let session = Session::open(&fake.endpoint(), search()).await;
    let vehicle = &session.vehicle;
    fake.fault("drop:p=0.3");
    let mission = Mission { home: None, items: (0..100).map(waypoint).collect() };
    let autopilot = vehicle.autopilot();
    let sent = to_vehicle(autopilot, &mission, None);
    let failed = |error: TransferError| format!("seed {seed}: {error}");
    let began = Instant::now();
    vehicle.upload(MISSION, &sent, &mut |_| {}).await.map_err(failed)?;
    let held = vehicle.download(MISSION, &mut |_| {}).await.map_err(failed)?.items;
    let took = began.elapsed().as_secs_f64();
    session.close().await;
    let same = differences(autopilot, MISSION, &sent, &held).is_empty();
    if same { Ok(took) } else { Err(format!("seed {seed}: not what was sent")) }
}

/// Most of a run is waiting, so several go on at once.
async fn lossy(persona: &'static str, runs: u16) {
    let mut results = Vec::new();
    let mut under_way = JoinSet::new();
    for seed in 0..runs {
        if under_way.len() >= AT_ONCE {
            results.extend(under_way.join_next().await);
        }
        under_way.spawn(lossy_run(persona, seed));
    }
    results.extend(under_way.join_all().await.into_iter().map(Ok));
    let (times, failures): (Vec<_>, Vec<_>) =
        results.into_iter().map(Result::unwrap).partition(Result::is_ok);
    let mut times: Vec<f64> = times.into_iter().flatten().collect();
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times.get((times.len() as f64 * share) as usize).copied();
    println!(
        "\n{persona}, 30 % loss each way, 100 items up and verified: {} of {runs} runs; median \
         {:.1} s, nine in ten within {:.1} s",
        times.len(),
        at(0.5).unwrap_or(f64::NAN),
        at(0.9).unwrap_or(f64::NAN)
    );
    for failure in failures {
        println!("  {failure:?}");
    }
}

#[tokio::main]
async fn main() {
    let items = from_environment("QUAV_BENCH_ITEMS", 200);
    let runs = from_environment("QUAV_BENCH_LOSSY_RUNS", 100);
    for persona in PERSONAS {
        slow_line(persona, items).await;
    }
    for persona in PERSONAS {
        lossy(persona, runs).await;
    }
}
