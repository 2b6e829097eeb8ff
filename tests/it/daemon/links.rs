//! What a link and the vehicle on it do in the course of months.

use std::io::Write;
use std::time::Duration;

use quav::daemon::status::Status;
use serde_json::json;
use tokio_serial::{SerialPort, SerialStream};

use super::{Daemon, example, vehicle_with, verdict};
use crate::sitl::FakeVehicle;

/// A share of one core that no idle daemon takes, and every busy loop does.
const BUSY: f64 = 0.3;

fn is_connected(status: &Status) -> bool {
    status.vehicle.is_some() && status.state == "watching"
}

fn endpoint(status: &Status) -> &str {
    status.endpoint.as_deref().unwrap_or_default()
}

/// On one link, which is where the argument says.
fn alone_on(link: &str, more: &[&str]) -> FakeVehicle {
    FakeVehicle::start_on(link, &[&["--mission", &example("s5")][..], more].concat())
}

#[test]
fn an_unplugged_port_is_taken_up_again_and_an_alternative_meanwhile() {
    let directory = tempfile::tempdir().unwrap();
    let port = directory.path().join("fc").display().to_string();
    let serial = alone_on(&format!("pty:{port}"), &[]);
    let router = alone_on("udpin:127.0.0.1:0", &[]);
    let connect = format!("serial:{port}:57600\", \"{}", router.urls[0]);
    let daemon = Daemon::start(&connect, "retry = 1");
    let status =
        daemon.wait_for("the port", |status| is_connected(status) && status.last.is_some());
    assert!(endpoint(&status).starts_with("serial:"), "{status:#?}");
    let descriptors = status.resources.descriptors;

    drop(serial);
    let status = daemon.wait_for("the router", |status| {
        is_connected(status) && endpoint(status).starts_with("udpout:")
    });
    assert_eq!((status.counts.connections, status.trouble), (2, None));

    let serial = alone_on(&format!("pty:{port}"), &[]);
    drop(router);
    let status = daemon.wait_for("the port again", |status| {
        is_connected(status) && endpoint(status).starts_with("serial:")
    });
    assert_eq!(status.counts.connections, 3);
    assert_eq!(status.resources.descriptors, descriptors, "{status:#?}");
    drop(serial);
    let status = daemon.wait_for("the loss of both", |status| {
        status.vehicle.is_none() && status.trouble.is_some()
    });
    assert!(!status.trouble.unwrap().is_empty());
    assert!(daemon.load_over(Duration::from_secs(3)) < BUSY);
    assert!(daemon.end().0.success());
}

#[test]
fn a_port_that_is_pulled_while_a_mission_is_written_is_planned_for_again() {
    let directory = tempfile::tempdir().unwrap();
    let port = directory.path().join("fc").display().to_string();
    // A PX4 takes a mission whole or not at all: after this it holds the pilot's as before.
    let plugged = || alone_on(&format!("pty:{port}"), &["--persona", "px4"]);
    let mut vehicle = plugged();
    vehicle.fault("delay:ms=300,dir=tx,msg=MISSION_REQUEST_INT");
    let daemon = Daemon::start(&format!("serial:{port}:57600"), "retry = 1\npoll = 3600");
    daemon.wait_for("an upload", |status| status.state == "writing");
    drop(vehicle);
    let vehicle = plugged();
    let status = daemon.wait_for("the upload", |status| status.counts.uploads == 1);
    assert_eq!(status.counts.connections, 2);
    drop(vehicle);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn noise_as_of_a_wrong_baud_rate_is_told_as_that_and_costs_little() {
    let (mut line, port) = SerialStream::pair().unwrap();
    let path = port.name().unwrap();
    drop(port);
    let daemon = Daemon::start(&format!("serial:{path}:57600"), "retry = 1");
    let status = daemon.wait_for("trouble", |status| {
        // Every byte there is, starts of frames among them.
        let noise: Vec<u8> = (0..400_u32).map(|k| (k * k % 257) as u8).collect();
        // Full is fine, and so is nobody at the other end just now.
        let _ = line.write(&noise);
        status.trouble.is_some()
    });
    let trouble = status.trouble.unwrap();
    assert!(trouble.contains("no autopilot was heard") && trouble.contains("baud"), "{trouble}");
    assert!(daemon.load_over(Duration::from_secs(3)) < BUSY);
    assert!(daemon.end().0.success());
}

#[test]
fn a_flight_controller_that_restarts_is_the_same_connection_and_is_looked_at_anew() {
    let mut vehicle = vehicle_with("ardupilot", "s5");
    let daemon = Daemon::start(&vehicle.urls[0], "poll = 3600");
    daemon.wait_for_answer(1);
    let looks =
        daemon.wait_for("its own upload seen", |status| status.counts.looks >= 2).counts.looks;
    // Every sign of its own upload has come by now.
    std::thread::sleep(Duration::from_secs(2));
    // Another mission of as many items while it is down: the restart is all there is to see.
    let mut moved = vehicle.dump()["mission"]["items"].as_array().unwrap()[1..].to_vec();
    vehicle.control(&json!({"cmd": "reboot", "for": 2.0}));
    for item in &mut moved {
        item["z"] = json!(item["z"].as_f64().unwrap() + 7.0);
    }
    vehicle.control(&json!({"cmd": "set", "mission": moved}));
    let status = daemon.wait_for("an answer", |status| status.counts.answers >= 2);
    assert_eq!(status.last.unwrap().trigger, "the vehicle has restarted");
    assert!(status.counts.looks > looks);
    assert_eq!(status.counts.connections, 1);
}

#[test]
fn after_radio_silence_it_is_found_again_and_what_changed_meanwhile_is_answered() {
    let mut vehicle = vehicle_with("px4", "s5");
    let daemon = Daemon::start(&vehicle.urls[0], "retry = 1\npoll = 3600");
    daemon.wait_for_answer(1);
    vehicle.fault("silence:for=25");
    vehicle.control(&json!({"cmd": "set", "mission": example("s5")}));
    let status = daemon.wait_for("the loss", |status| status.vehicle.is_none());
    assert!(status.trouble.unwrap().contains("has not been heard"));
    assert!(daemon.load_over(Duration::from_secs(2)) < BUSY);
    // A look that the silence came upon may have been answered meanwhile.
    let status = daemon.wait_for("the new upload", |status| status.counts.uploads == 2);
    assert_eq!((status.counts.connections, verdict(&status)), (2, "uploaded"));
    assert_eq!(vehicle.judged()["clear"], true);
}

#[test]
fn another_vehicle_in_the_same_place_is_another_vehicle() {
    let first = alone_on("udpin:127.0.0.1:0", &["--uid", "11"]);
    let url = first.urls[0].clone();
    let directory = tempfile::tempdir().unwrap();
    let text = format!("connect = \"{url}\"\nretry = 1\nwait = 3\n");
    let daemon = Daemon::configured(directory, &text, &[]);
    let status = daemon.wait_for("the first vehicle's upload", |status| status.counts.uploads == 1);
    assert_eq!(status.vehicle.unwrap().system, 1);
    drop(first);
    let listen = url.replace("udpout:", "udpin:");
    let mut second = alone_on(&listen, &["--uid", "12", "--sysid", "7"]);
    let status =
        daemon.wait_for("the second vehicle's upload", |status| status.counts.uploads == 2);
    assert_eq!((status.vehicle.unwrap().system, status.counts.connections), (7, 2));
    assert_eq!(second.judged()["clear"], true);
}
