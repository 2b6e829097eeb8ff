//! The daemon as a process against the fake vehicle, with a ground station on a second link. Here is
//! what the tests have in common: the daemon, and the ground station.

mod component;
mod links;
mod planning;
mod qpu;
mod service;
mod soak;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use quav::daemon::status::Status;
use quav::link::message::{CommandLong, StatusText};
use quav::link::{ComponentId, Identity, Inbox, Link, LinkTask, Node, SystemId, Transport};
use tempfile::TempDir;
use tokio::time::timeout;
use tokio_util::sync::CancellationToken;

use crate::sitl::FakeVehicle;

/// Long enough for a loaded machine; what takes longer hangs.
const PATIENCE: Duration = Duration::from_secs(120);
const DAEMON: Node = Node { system: SystemId(1), component: ComponentId::PATH_PLANNER };

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
        Self::configured(directory, &text, &[])
    }

    /// With this configuration, and more in its environment.
    fn configured(directory: TempDir, text: &str, environment: &[(&str, &Path)]) -> Self {
        std::fs::write(directory.path().join("quavd.toml"), text).unwrap();
        let process = Command::new(env!("CARGO_BIN_EXE_quavd"))
            .args(["run", "--config"])
            .arg(directory.path().join("quavd.toml"))
            .env("STATE_DIRECTORY", directory.path().join("state"))
            .env_remove("RUNTIME_DIRECTORY")
            .env_remove("NOTIFY_SOCKET")
            .envs(environment.iter().copied())
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

    /// What `quavd status` and `quavd trigger` say without `--json`.
    fn in_words(&self, question: &str) -> Result<String, String> {
        let output = Command::new(env!("CARGO_BIN_EXE_quavd"))
            .args([question, "--state-dir"])
            .arg(self.directory.path().join("state"))
            .output()
            .unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        if output.status.success() { Ok(text(&output.stdout)) } else { Err(text(&output.stderr)) }
    }

    /// Processor time that it has taken so far.
    fn processor_time(&self) -> Duration {
        /// `USER_HZ`, the same on all of Linux' architectures.
        const TICKS_A_SECOND: u64 = 100;
        let stat = format!("/proc/{}/stat", self.process.id());
        let stat = std::fs::read_to_string(stat).unwrap();
        // After the name in brackets: state, and from there utime and stime are the 12th and 13th.
        let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
        let ticks: u64 = fields[11..13].iter().map(|field| field.parse::<u64>().unwrap()).sum();
        Duration::from_millis(1000 * ticks / TICKS_A_SECOND)
    }

    /// The share of one core that it takes while nothing is asked of it.
    fn load_over(&self, time: Duration) -> f64 {
        let before = self.processor_time();
        std::thread::sleep(time);
        (self.processor_time() - before).as_secs_f64() / time.as_secs_f64()
    }

    /// Waits until the status is as wanted, and returns it.
    pub(crate) fn wait_for(&self, what: &str, mut wanted: impl FnMut(&Status) -> bool) -> Status {
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
        self.hear_within(PATIENCE, wanted).await
    }

    async fn hear_within<D: mavlink::MessageData>(
        &mut self,
        patience: Duration,
        wanted: impl Fn(&D) -> bool,
    ) -> D {
        let heard = timeout(patience, async {
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
        self.text_within(PATIENCE, part).await
    }

    /// The first chunk of a text that has this in it.
    async fn text_within(&mut self, patience: Duration, part: &str) -> String {
        let words = |text: &StatusText| {
            String::from_utf8_lossy(&text.text).trim_end_matches('\0').to_owned()
        };
        let wanted = |text: &StatusText| words(text).contains(part);
        words(&self.hear_within(patience, wanted).await)
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
