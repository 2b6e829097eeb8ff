//! The daemon as a service: signals, systemd, configuration, status.

use std::io::Write;
use std::os::unix::net::UnixDatagram;
use std::process::Command;

use quav::mission::MissionType;

use super::{Daemon, PATIENCE, vehicle_with};

#[test]
fn a_reload_takes_the_new_buffer_and_a_bad_file_changes_nothing() {
    let mut vehicle = vehicle_with("px4", "s5");
    let daemon = Daemon::start(&vehicle.urls[0], "buffer = 5");
    daemon.wait_for_answer(1);
    let path = daemon.directory.path().join("quavd.toml");
    let good = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, good.replace("buffer = 5", "bufer = 8")).unwrap();
    daemon.signal("-HUP");
    let status = daemon.wait_for("the complaint", |status| status.trouble.is_some());
    assert!(status.trouble.unwrap().contains("did you mean buffer?"));
    assert_eq!((status.counts.uploads, status.counts.connections), (1, 1));
    std::fs::write(&path, good.replace("buffer = 5", "buffer = 8")).unwrap();
    daemon.signal("-HUP");
    let status =
        daemon.wait_for("the upload with a wider buffer", |status| status.counts.uploads == 2);
    assert_eq!(status.trouble, None);
    let report = vehicle.judged();
    assert!(report["min_clearance_m"].as_f64().unwrap() >= 7.99, "{report}");
    assert!(daemon.end().0.success());
}

/// What systemd is told, message by message.
struct Systemd {
    socket: UnixDatagram,
}

impl Systemd {
    fn next(&self) -> String {
        let mut bytes = [0; 256];
        let length = self.socket.recv(&mut bytes).expect("a word within the patience");
        String::from_utf8_lossy(&bytes[..length]).trim().to_owned()
    }

    /// Waits for a word, and returns how often the watchdog was fed before it came.
    fn fed_before(&self, word: &str) -> usize {
        let mut fed = 0;
        loop {
            let said = self.next();
            if said.lines().any(|line| line == word) {
                return fed;
            }
            assert_eq!(said, "WATCHDOG=1", "while {word} is waited for");
            fed += 1;
        }
    }
}

#[test]
fn systemd_hears_of_every_state_and_its_watchdog_is_fed_in_each_of_them() {
    let mut vehicle = vehicle_with("ardupilot", "s1");
    // Slow enough to be caught in the middle of the upload.
    vehicle.fault("delay:ms=80,dir=tx,msg=MISSION_REQUEST");
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("notify");
    let systemd = Systemd { socket: UnixDatagram::bind(&path).unwrap() };
    systemd.socket.set_read_timeout(Some(PATIENCE)).unwrap();
    let text = format!("connect = \"{}\"\nsystem = 1\ndebounce = 0.3\n", vehicle.urls[0]);
    let daemon = Daemon::configured(directory, &text, &[("NOTIFY_SOCKET", &path)]);
    assert_eq!(systemd.fed_before("READY=1"), 0);
    daemon.wait_for("the upload", |status| status.state == "writing");
    daemon.signal("-HUP");
    assert!(systemd.fed_before("RELOADING=1") >= 1);
    // The upload goes to its end before anything else is done.
    assert!(systemd.fed_before("READY=1") >= 1);
    let status = daemon.wait_for("the upload's end", |status| {
        status.counts.connections == 2 && status.state == "watching"
    });
    assert_eq!(status.counts.uploads, 1, "{status:#?}");
    daemon.signal("-TERM");
    assert!(systemd.fed_before("STOPPING=1") >= 1);
    assert!(daemon.end().0.success());
}

#[test]
fn the_status_is_for_people_too_and_a_trigger_plans_whatever_the_policy() {
    let mut vehicle = vehicle_with("ardupilot", "s5");
    let daemon = Daemon::start(&vehicle.urls[0], "policy = \"manual\"");
    daemon
        .wait_for("a first look", |status| status.state == "watching" && status.counts.looks >= 1);
    assert!(vehicle.dump()["uploads"].as_array().unwrap().is_empty());
    assert!(daemon.ask("trigger").is_some());
    let last = daemon.wait_for_answer(1).last.unwrap();
    assert_eq!(
        (last.verdict.as_str(), last.trigger.as_str()),
        ("uploaded", "asked for on the board")
    );
    daemon.wait_for("rest", |status| status.state == "watching");
    let said = daemon.in_words("status").unwrap();
    for part in [
        "state      watching",
        "planning   manual",
        "vehicle    system 1, ArduPilot, disarmed, heard ",
        "last       uploaded ",
        "(asked for on the board)",
        "mission uploaded and verified",
        "counts     1 connections, ",
        "resources  ",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let (status, directory) = daemon.end();
    assert!(status.success());
    let report = last.report.unwrap();
    assert!(report.starts_with(&directory.path().display().to_string()), "{report}");
    assert!(std::fs::exists(report.replace(".json", ".svg")).unwrap());
    // Nobody answers any more.
    let daemon = Daemon { process: Command::new("true").spawn().unwrap(), directory };
    let refused = daemon.in_words("status").unwrap_err();
    assert!(refused.contains("no daemon answers"), "{refused}");
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
