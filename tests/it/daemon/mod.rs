//! The daemon as a process against the fake vehicle, with a ground station on a second link.

use std::io::Write;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use quav::daemon::status::Status;
use quav::link::message::{
    CommandAck, CommandLong, ParamName, ParamRequestRead, ParamSet, ParamValue, StatusText,
};
use quav::link::{ComponentId, Identity, Inbox, Link, LinkTask, Node, SystemId, Transport};
use quav::mission::MissionType;
use serde_json::{Value, json};
use tempfile::TempDir;
use tokio::time::timeout;
use tokio_util::sync::CancellationToken;

use crate::sitl::{FakeVehicle, PERSONAS};

/// Long enough for a loaded machine; what takes longer hangs.
const PATIENCE: Duration = Duration::from_secs(60);
const DAEMON: Node = Node { system: SystemId(1), component: ComponentId::PATH_PLANNER };
const USER_1: u16 = 31_010;

fn example(name: &str) -> String {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    root.join(format!("fence_examples/{name}.plan")).to_string_lossy().into_owned()
}

/// A running daemon.
pub(crate) struct Daemon {
    process: Child,
    directory: TempDir,
}

impl Daemon {
    pub(crate) fn start(connect: &str, more: &str) -> Self {
        let directory = tempfile::tempdir().unwrap();
        Self::start_in(directory, connect, more)
    }

    fn start_in(directory: TempDir, connect: &str, more: &str) -> Self {
        let text =
            format!("connect = [\"{connect}\"]\nsystem = 1\ndebounce = 0.3\nwait = 5\n{more}\n");
        std::fs::write(directory.path().join("quavd.toml"), text).unwrap();
        let process = Command::new(env!("CARGO_BIN_EXE_quavd"))
            .args(["run", "--config"])
            .arg(directory.path().join("quavd.toml"))
            .env("STATE_DIRECTORY", directory.path().join("state"))
            .env_remove("RUNTIME_DIRECTORY")
            .env_remove("NOTIFY_SOCKET")
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        Self { process, directory }
    }

    fn ask(&self, question: &str) -> Option<Status> {
        let output = Command::new(env!("CARGO_BIN_EXE_quavd"))
            .args([question, "--json", "--state-dir"])
            .arg(self.directory.path().join("state"))
            .output()
            .unwrap();
        output.status.success().then(|| serde_json::from_slice(&output.stdout).unwrap())
    }

    /// Waits until the status is as wanted, and returns it.
    pub(crate) fn wait_for(&self, what: &str, wanted: impl Fn(&Status) -> bool) -> Status {
        let began = Instant::now();
        let mut last = None;
        while began.elapsed() < PATIENCE {
            if let Some(status) = self.ask("status") {
                if wanted(&status) {
                    return status;
                }
                last = Some(status);
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("{what}: {last:#?}");
    }

    fn wait_for_answer(&self, number: u64) -> Status {
        self.wait_for(&format!("answer {number}"), |status| status.counts.answers >= number)
    }

    fn signal(&self, name: &str) {
        let pid = self.process.id().to_string();
        assert!(Command::new("kill").args([name, &pid]).status().unwrap().success());
    }

    /// Ends it as systemd does, and returns how it went.
    pub(crate) fn end(mut self) -> (ExitStatus, TempDir) {
        self.signal("-TERM");
        let status = self.process.wait().unwrap();
        let directory = std::mem::replace(&mut self.directory, tempfile::tempdir().unwrap());
        (status, directory)
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        // Either it has ended already or this ends it; both are fine.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn verdict(status: &Status) -> &str {
    status.last.as_ref().map_or("", |last| &last.verdict)
}

fn vehicle_with(persona: &str, scenario: &str) -> FakeVehicle {
    let plan = example(scenario);
    let second = ["--link", "udpin:127.0.0.1:0"];
    let arguments = [&["--persona", persona, "--mission", &plan][..], &second].concat();
    FakeVehicle::start_on("udpin:127.0.0.1:0", &arguments)
}

/// A ground station on the vehicle's second link.
struct Station {
    link: Link,
    inbox: Inbox,
    task: LinkTask,
}

impl Station {
    async fn open(vehicle: &FakeVehicle) -> Self {
        let endpoint = vehicle.urls[1].parse().unwrap();
        let transport = Transport::open(&endpoint).await.unwrap();
        let us = Identity { system: SystemId(255), component: ComponentId(190) };
        let (link, task) = Link::start(transport, us, CancellationToken::new());
        let inbox = link.subscribe().unwrap();
        Self { link, inbox, task }
    }

    /// The first message of the daemon that is wanted.
    async fn hear<D: mavlink::MessageData>(&mut self, wanted: impl Fn(&D) -> bool) -> D {
        let heard = timeout(PATIENCE, async {
            loop {
                let frame = self.inbox.next().await.unwrap();
                if frame.from == DAEMON
                    && let Some(message) = frame.decode::<D>()
                    && wanted(&message)
                {
                    return message;
                }
            }
        });
        heard.await.unwrap_or_else(|_| panic!("no {} as wanted", D::NAME))
    }

    async fn text(&mut self, part: &str) -> String {
        let words = |text: &StatusText| {
            String::from_utf8_lossy(&text.text).trim_end_matches('\0').to_owned()
        };
        words(&self.hear::<StatusText>(|text| words(text).contains(part)).await)
    }

    async fn command(&self, command: u16, param1: f32) {
        let message = CommandLong { param1, command, target: DAEMON, confirmation: 0 };
        self.link.send(&message).await.unwrap();
    }

    async fn close(self) {
        drop((self.link, self.inbox));
        self.task.close().await;
    }
}

#[test]
fn a_mission_is_planned_when_the_vehicle_is_found_and_when_it_changes() {
    for persona in PERSONAS {
        let mut vehicle = vehicle_with(persona, "s1");
        let daemon = Daemon::start(&vehicle.urls[0], "poll = 5");
        let status = daemon.wait_for_answer(1);
        assert_eq!(verdict(&status), "uploaded", "{status:#?}");
        let report = vehicle.judged();
        assert_eq!(report["collisions"], 0, "{report}");
        assert!(report["min_clearance_m"].as_f64().unwrap() >= 4.99, "{report}");
        let last = status.last.unwrap();
        assert!(last.text.iter().any(|text| text.contains("re-planned, +")), "{last:?}");
        let kept: Value =
            serde_json::from_slice(&std::fs::read(last.report.unwrap()).unwrap()).unwrap();
        assert_eq!(kept["plan"]["collision_free"], true);

        // The pilot uploads the mission as drawn once more, over the protocol.
        let drawn = example("s1");
        vehicle.control(
            &json!({"cmd": "gcs-upload", "type": "mission", "items": drawn, "pace": 0.02}),
        );
        let status = daemon.wait_for("a second upload", |status| status.counts.uploads >= 2);
        assert_eq!(verdict(&status), "uploaded");
        let report = vehicle.judged();
        assert_eq!(report["collisions"], 0, "{report}");
        assert!(daemon.end().0.success());
    }
}

#[test]
fn its_own_upload_is_not_taken_for_a_change_nor_is_a_restart() {
    let mut vehicle = vehicle_with("ardupilot", "s5");
    let daemon = Daemon::start(&vehicle.urls[0], "poll = 5");
    daemon.wait_for_answer(1);
    let looks = daemon.wait_for("a look after it", |status| status.counts.looks >= 2).counts;
    assert_eq!((looks.answers, looks.uploads), (1, 1));
    let (_, directory) = daemon.end();
    let daemon = Daemon::start_in(directory, &vehicle.urls[0], "");
    let status = daemon.wait_for_answer(1);
    assert_eq!(verdict(&status), "already_there");
    let uploads = vehicle.dump()["uploads"].as_array().unwrap().len();
    assert_eq!(uploads, 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_safe_path_is_told_to_the_pilot_and_touches_nothing() {
    let mut vehicle = vehicle_with("ardupilot", "infeasible");
    let before = vehicle.dump()["mission"].clone();
    let mut station = Station::open(&vehicle).await;
    let daemon = Daemon::start(&vehicle.urls[0], "");
    assert_eq!(station.text("no safe path").await, "QUAV: no safe path, mission untouched");
    let status = daemon.wait_for_answer(1);
    assert_eq!(verdict(&status), "no_path");
    assert!(status.last.unwrap().reason.unwrap().contains("no safe path"));
    assert_eq!(vehicle.dump()["mission"], before);
    station.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_command_plans_tells_its_progress_and_its_result() {
    let mut vehicle = vehicle_with("ardupilot", "s1");
    let mut station = Station::open(&vehicle).await;
    let daemon = Daemon::start(&vehicle.urls[0], "policy = \"on_command\"");
    daemon.wait_for("a first look", |status| status.counts.looks >= 1 && status.vehicle.is_some());
    assert!(vehicle.dump()["uploads"].as_array().unwrap().is_empty());
    station.command(USER_1, 0.0).await;
    let is_ours = |ack: &CommandAck| ack.command == USER_1;
    let first = station.hear::<CommandAck>(is_ours).await;
    assert_eq!(first.result, CommandAck::IN_PROGRESS);
    let last = station
        .hear(|ack: &CommandAck| is_ours(ack) && ack.result != CommandAck::IN_PROGRESS)
        .await;
    assert_eq!(last.result, CommandAck::ACCEPTED);
    assert_eq!(vehicle.dump()["uploads"].as_array().unwrap().len(), 1);

    // What it does not know it says so about; what it is, it tells.
    station.command(400, 1.0).await;
    let refused = station.hear(|ack: &CommandAck| ack.command == 400).await;
    assert_eq!(refused.result, CommandAck::UNSUPPORTED);
    station.command(512, 148.0).await;
    station.hear::<mavlink::dialects::ardupilotmega::AUTOPILOT_VERSION_DATA>(|_| true).await;
    let told = station.hear(|ack: &CommandAck| ack.command == 512).await;
    assert_eq!(told.result, CommandAck::ACCEPTED);
    station.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn its_parameters_are_listed_read_set_checked_and_kept() {
    use mavlink::dialects::ardupilotmega::PARAM_REQUEST_LIST_DATA;
    let vehicle = vehicle_with("ardupilot", "s5");
    let mut station = Station::open(&vehicle).await;
    let daemon = Daemon::start(&vehicle.urls[0], "policy = \"manual\"");
    daemon.wait_for("a vehicle", |status| status.vehicle.is_some());
    let list = PARAM_REQUEST_LIST_DATA { target_system: 1, target_component: 195 };
    station.link.send(&list).await.unwrap();
    let first = station.hear::<ParamValue>(|_| true).await;
    for index in 1..first.count {
        station.hear::<ParamValue>(|value| value.index == index).await;
    }
    let name = ParamName::new("QUAV_BUFFER").unwrap();
    for (value, held) in [(7.5_f32, 7.5_f32), (-3.0, 7.5)] {
        let set = ParamSet { bits: value.to_bits(), target: DAEMON, name, kind: 9 };
        station.link.send(&set).await.unwrap();
        let told = station.hear::<ParamValue>(|told| told.name == name).await;
        assert_eq!(f32::from_bits(told.bits), held);
    }
    let (_, directory) = daemon.end();
    let daemon = Daemon::start_in(directory, &vehicle.urls[0], "policy = \"manual\"");
    daemon.wait_for("a vehicle", |status| status.vehicle.is_some());
    let read = ParamRequestRead { target: DAEMON, index: -1, name };
    station.link.send(&read).await.unwrap();
    let told = station.hear::<ParamValue>(|told| told.name == name).await;
    assert_eq!(f32::from_bits(told.bits), 7.5);
    station.close().await;
}

#[test]
fn an_armed_vehicle_is_written_to_when_it_is_disarmed() {
    let mut vehicle = vehicle_with("ardupilot", "s5");
    vehicle.control(&json!({"cmd": "set", "armed": true}));
    let daemon = Daemon::start(&vehicle.urls[0], "");
    let status = daemon.wait_for_answer(1);
    assert_eq!(verdict(&status), "armed");
    assert!(vehicle.dump()["uploads"].as_array().unwrap().is_empty());
    vehicle.control(&json!({"cmd": "set", "armed": false}));
    daemon.wait_for("the upload", |status| status.counts.uploads == 1);
}

#[test]
fn a_lost_vehicle_is_found_again_on_whichever_link_it_is() {
    let vehicle = vehicle_with("ardupilot", "s5");
    // The first endpoint leads nowhere.
    let connect = format!("udpin:127.0.0.1:0\", \"{}", vehicle.urls[0]);
    let daemon = Daemon::start(&connect, "retry = 1");
    daemon.wait_for_answer(1);
    drop(vehicle);
    let status = daemon.wait_for("the loss", |status| status.vehicle.is_none());
    assert!(status.trouble.is_some());
    assert!(daemon.end().0.success());
}

#[test]
fn a_reload_takes_the_new_buffer_and_a_bad_file_changes_nothing() {
    let mut vehicle = vehicle_with("px4", "s5");
    let daemon = Daemon::start(&vehicle.urls[0], "buffer = 5");
    daemon.wait_for_answer(1);
    let path = daemon.directory.path().join("quavd.toml");
    let good = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, good.replace("buffer = 5", "bufer = 8")).unwrap();
    daemon.signal("-HUP");
    std::fs::write(&path, good.replace("buffer = 5", "buffer = 8")).unwrap();
    daemon.signal("-HUP");
    daemon.wait_for("the upload with a wider buffer", |status| status.counts.uploads == 2);
    let report = vehicle.judged();
    assert!(report["min_clearance_m"].as_f64().unwrap() >= 7.99, "{report}");
    assert!(daemon.end().0.success());
}

#[test]
fn it_ends_in_the_middle_of_an_upload_only_when_the_vehicle_is_whole() {
    let mut vehicle = vehicle_with("ardupilot", "s1");
    let before = vehicle.held(MissionType::Mission).len();
    // Slow enough to be caught in the middle.
    vehicle.fault("delay:ms=80,dir=tx,msg=MISSION_REQUEST");
    let daemon = Daemon::start(&vehicle.urls[0], "");
    daemon.wait_for("the upload", |status| status.state == "writing");
    let (status, _) = daemon.end();
    assert!(status.success());
    let held = vehicle.held(MissionType::Mission).len();
    assert!(held >= before, "{held} of {before}");
    let report = vehicle.judged();
    assert!(held == before || report["collisions"] == 0, "{report}");
}

#[test]
fn a_bad_configuration_ends_with_2_and_every_mistake_named() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("quavd.toml");
    let mut file = std::fs::File::create(&path).unwrap();
    write!(file, "connect = \"nowhere\"\nbufer = 5\n").unwrap();
    for more in [&["--check"][..], &[]] {
        let output = Command::new(env!("CARGO_BIN_EXE_quavd"))
            .args(["run", "--config"])
            .arg(&path)
            .args(more)
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(2));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.contains("quavd.toml:1: ") && said.contains("quavd.toml:2: "), "{said}");
        assert!(said.contains("did you mean buffer?"), "{said}");
    }
}

#[test]
fn in_flight_it_writes_where_the_configuration_allows_it_and_the_vehicle_flies_on() {
    let mut vehicle = vehicle_with("px4", "s5");
    let dump = vehicle.dump();
    let first = &dump["mission"]["items"][0];
    let degrees = |axis: &str| first[axis].as_f64().unwrap() / 1e7;
    let above = json!([degrees("x"), degrees("y"), dump["home"]["alt"].as_f64().unwrap() + 30.0]);
    vehicle.control(&json!({
        "cmd": "set", "armed": true, "mode": "MISSION", "current": 0, "position": above
    }));
    let daemon = Daemon::start(&vehicle.urls[0], "in_flight = true");
    let status = daemon.wait_for_answer(1);
    assert_eq!(verdict(&status), "uploaded", "{status:#?}");
    assert_eq!(vehicle.judged()["collisions"], 0);
    assert_eq!(vehicle.dump()["current_seq"], 0);
}

#[test]
fn a_mission_that_the_vehicle_has_no_room_for_is_not_begun() {
    let mut vehicle = vehicle_with("ardupilot", "s1");
    let daemon = Daemon::start(&vehicle.urls[0], "max_items = 2");
    let status = daemon.wait_for_answer(1);
    assert_eq!(verdict(&status), "refused", "{status:#?}");
    assert_eq!(vehicle.dump()["uploads"].as_array().unwrap().len(), 0);
}
