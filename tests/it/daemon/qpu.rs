//! A QPU whose queue is longer than a vehicle waits.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use super::{Daemon, Station, vehicle_with, verdict};
use crate::ibm_circuits::python;

/// The stand-in for IBM's service (`sitl/fake_ibm.py`), with a queue that does not move.
struct Service {
    process: Child,
    ready: Value,
}

impl Service {
    fn start() -> Self {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("sitl/fake_ibm.py");
        let mut process = Command::new(python())
            .arg(script)
            .args(["--exit-on-stdin-eof", "--noise", "none", "--fault", "queue:seconds=100000"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut ready = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut ready).unwrap();
        Self { process, ready: serde_json::from_str(&ready).unwrap() }
    }

    /// The lines of a configuration that use it.
    fn options(&self, directory: &Path) -> String {
        let key = directory.join("key");
        std::fs::write(&key, "FAKE-API-KEY-0000").unwrap();
        let mut mode = std::fs::metadata(&key).unwrap().permissions();
        std::os::unix::fs::PermissionsExt::set_mode(&mut mode, 0o600);
        std::fs::set_permissions(&key, mode).unwrap();
        let crn = directory.join("crn");
        std::fs::write(&crn, self.ready["crn"].as_str().unwrap()).unwrap();
        format!(
            "engine = \"ibm\"\nbackend = \"ibm_kyiv\"\nqubits = 4\nlayers = 1\nsteps = 5\nshots = 64\n\
             qpu_jobs = 1\nqpu_circuits = 2\napi_key_file = {key:?}\ncrn_file = {crn:?}\n\
             iam_url = {}\napi_url = {}\n",
            self.ready["iam"], self.ready["api"]
        )
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// No deadline is configured, so that the daemon's own bound of a minute is what ends the wait.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_queue_that_does_not_move_is_left_and_that_is_seen() {
    let service = Service::start();
    let mut vehicle = vehicle_with("ardupilot", "s5");
    let mut station = Station::open(&vehicle).await;
    let directory = tempfile::tempdir().unwrap();
    let options = service.options(directory.path());
    let daemon = Daemon::start_in(directory, &vehicle.urls[0], &options);
    daemon.wait_for("the wait for the QPU", |status| status.state == "planning");
    let words = station.text_within(Duration::from_secs(120), "fallback: ").await;
    assert!(words.starts_with("QUAV: fallback: the leg from item 1 "), "{words}");
    let status = daemon.wait_for_answer(1);
    assert_eq!(verdict(&status), "uploaded");
    let last = status.last.unwrap();
    let fallback = last.fallback.unwrap();
    assert!(fallback.contains("the local engine instead of ibm_kyiv"), "{fallback}");
    assert!(daemon.in_words("status").unwrap().contains("fallback   the leg"));
    assert!(last.took_ms >= 30_000 && last.took_ms < 90_000, "{}", last.took_ms);
    assert_eq!(vehicle.judged()["clear"], true);
    station.close().await;
}
