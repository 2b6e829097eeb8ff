//! The fake vehicle (`sitl/fake_vehicle.py`) as a child process, with its control channel.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use quav::geodesy::LatLonE7;
use quav::link::{Endpoint, Identity, Link, LinkTask, Transport};
use quav::mission::{self, Frame, MissionItem, MissionType};
use quav::vehicle::{DiscoveryError, Search, Vehicle, find};
use serde_json::{Value, json};
use tokio_util::sync::CancellationToken;

/// Both autopilots that the fake vehicle can be.
pub(crate) const PERSONAS: [&str; 2] = ["ardupilot", "px4"];

/// An event that a fake vehicle is asked to tell.
#[must_use]
pub(crate) struct Waiting(());

/// A running fake vehicle. Ends with this value.
pub(crate) struct FakeVehicle {
    process: Child,
    control: BufReader<TcpStream>,
    pub(crate) urls: Vec<String>,
}

/// The Python that has pymavlink: `QUAV_PYTHON`, or the project's own environment.
pub(crate) fn python() -> PathBuf {
    let venv = Path::new(env!("CARGO_MANIFEST_DIR")).join(".venv/bin/python");
    let python = std::env::var_os("QUAV_PYTHON").map_or(venv, PathBuf::from);
    assert!(
        python.exists(),
        "{} is missing: run `make test`, which makes it, or point QUAV_PYTHON to a Python with \
         pymavlink",
        python.display()
    );
    python
}

impl FakeVehicle {
    /// Starts one that listens on UDP. Its random faults are the same each time, unless
    /// `--seed` says otherwise.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        Self::start_on("udpin:127.0.0.1:0", &[&["--seed", "1"], arguments].concat())
    }

    /// Starts one with a link of a certain kind.
    pub(crate) fn start_on(link: &str, arguments: &[&str]) -> Self {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("sitl/fake_vehicle.py");
        let mut process = Command::new(python())
            .arg(script)
            .args(["--control", "0", "--exit-on-stdin-eof", "--link", link])
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the fake vehicle starts");
        let mut ready = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut ready).unwrap();
        let ready: Value = serde_json::from_str(&ready)
            .expect("a ready line; without one, the reason is on stderr above");
        let port = ready["control"]["port"].as_u64().unwrap();
        let control = TcpStream::connect(("127.0.0.1", u16::try_from(port).unwrap())).unwrap();
        let links = ready["links"].as_array().unwrap();
        let urls = links.iter().map(|link| link["connect"].as_str().unwrap().to_owned()).collect();
        Self { process, control: BufReader::new(control), urls }
    }

    /// Its process.
    #[allow(dead_code)] // for the benchmark of transfers
    pub(crate) fn pid(&self) -> u32 {
        self.process.id()
    }

    /// Where to connect to.
    pub(crate) fn endpoint(&self) -> Endpoint {
        self.urls[0].parse().unwrap()
    }

    /// Sends one control command and returns the answer.
    pub(crate) fn control(&mut self, command: &Value) -> Value {
        let mut line = String::new();
        writeln!(self.control.get_mut(), "{command}").unwrap();
        self.control.read_line(&mut line).unwrap();
        let answer: Value = serde_json::from_str(&line).unwrap();
        assert_eq!(answer["ok"], true, "{command}: {answer}");
        answer
    }

    /// Says what to wait for; the answer is for [`FakeVehicle::has_happened`], and no other command
    /// may come between.
    pub(crate) fn begin_to_wait(
        &mut self,
        event: &str,
        fields: &Value,
        nth: u64,
        seconds: f64,
    ) -> Waiting {
        let command =
            json!({"cmd": "wait", "on": event, "where": fields, "nth": nth, "for": seconds});
        writeln!(self.control.get_mut(), "{command}").unwrap();
        Waiting(())
    }

    /// Waits until it has happened; `false` where it did not in its time.
    pub(crate) fn has_happened(&mut self, _waiting: Waiting) -> bool {
        let mut line = String::new();
        self.control.read_line(&mut line).unwrap();
        let answer: Value = serde_json::from_str(&line).unwrap();
        answer["ok"] == true
    }

    /// Adds a fault, such as `drop:p=0.2`.
    pub(crate) fn fault(&mut self, spec: &str) {
        self.control(&json!({"cmd": "fault", "spec": spec}));
    }

    /// Puts a plan into the vehicle, as another ground station would.
    pub(crate) fn set(&mut self, mission_type: MissionType, items: &[MissionItem]) {
        let items: Vec<Value> = items.iter().map(item_json).collect();
        self.control(&json!({"cmd": "set", (mission_type.to_string()): items}));
    }

    /// Everything the vehicle holds.
    pub(crate) fn dump(&mut self) -> Value {
        self.control(&json!({"cmd": "dump"}))["dump"].take()
    }

    /// What it holds, by the measure of `judge.py`.
    pub(crate) fn judged(&mut self) -> Value {
        let mut dump = tempfile::NamedTempFile::new().unwrap();
        write!(dump, "{}", self.dump()).unwrap();
        let judge = Path::new(env!("CARGO_MANIFEST_DIR")).join("sitl/judge.py");
        let mut command = Command::new(python());
        let output = command.arg(judge).arg(dump.path()).stderr(Stdio::inherit()).output();
        serde_json::from_slice(&output.unwrap().stdout)
            .expect("a verdict; without one, the reason is on stderr above")
    }

    /// The items of one plan that the vehicle holds.
    pub(crate) fn held(&mut self, mission_type: MissionType) -> Vec<Value> {
        let dump = self.dump();
        dump[mission_type.to_string()]["items"].as_array().unwrap().clone()
    }
}

impl Drop for FakeVehicle {
    fn drop(&mut self) {
        // Either it has ended already or this ends it; both are fine.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// An open link with the vehicle found on it.
pub(crate) struct Session {
    pub(crate) vehicle: Vehicle,
    pub(crate) link: Link,
    task: LinkTask,
}

impl Session {
    pub(crate) async fn open(endpoint: &Endpoint, search: Search) -> Self {
        let transport = Transport::open(endpoint).await.unwrap();
        Self::over(transport, &search).await.unwrap()
    }

    pub(crate) async fn over(
        transport: Transport,
        search: &Search,
    ) -> Result<Self, DiscoveryError> {
        let (link, task) = Link::start(transport, Identity::default(), CancellationToken::new());
        match find(&link, search).await {
            Ok(vehicle) => Ok(Self { vehicle, link, task }),
            Err(error) => {
                task.close().await;
                Err(error)
            }
        }
    }

    pub(crate) async fn close(self) {
        self.vehicle.close().await;
        drop(self.link);
        self.task.close().await;
    }
}

/// Looks for system 1 only, which saves the wait for a second vehicle.
pub(crate) fn search() -> Search {
    Search {
        system: Some(quav::link::SystemId(1)),
        patience: Duration::from_secs(20),
        ..Search::default()
    }
}

/// A waypoint 10 m further north for each number, 30 m above home.
pub(crate) fn waypoint(number: u16) -> MissionItem {
    MissionItem {
        seq: number,
        frame: Frame::GLOBAL_RELATIVE_ALT_INT,
        command: mission::Command::NAV_WAYPOINT,
        current: 0,
        autocontinue: 1,
        params: [0.0; 4],
        x: 473_977_420 + 900 * i32::from(number),
        y: 85_455_940,
        z: 30.0,
    }
}

/// An exclusion triangle.
pub(crate) fn triangle() -> Vec<MissionItem> {
    let corners = [(0, 0), (0, 10_000), (10_000, 0)];
    let vertex = |(seq, (north, east)): (u16, (i32, i32))| MissionItem {
        command: mission::Command::NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
        frame: Frame::GLOBAL_INT,
        params: [3.0, 0.0, 0.0, 0.0],
        x: 473_977_420 + north,
        y: 85_455_940 + east,
        z: 0.0,
        ..waypoint(seq)
    };
    (0..).zip(corners).map(vertex).collect()
}

/// The position of a dumped item.
pub(crate) fn place(item: &Value) -> LatLonE7 {
    let read = |key: &str| i32::try_from(item[key].as_i64().unwrap()).unwrap();
    LatLonE7 { lat: read("x"), lon: read("y") }
}

pub(crate) fn item_json(item: &MissionItem) -> Value {
    let number = |value: f32| if value.is_nan() { Value::Null } else { json!(value) };
    json!({
        "seq": item.seq, "frame": item.frame.0, "command": item.command.0,
        "current": item.current, "autocontinue": item.autocontinue,
        "param1": number(item.params[0]), "param2": number(item.params[1]),
        "param3": number(item.params[2]), "param4": number(item.params[3]),
        "x": item.x, "y": item.y, "z": number(item.z),
    })
}
