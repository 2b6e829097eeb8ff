//! The daemon as a MAVLink component: commands, parameters, texts and numbers.

use mavlink::dialects::ardupilotmega::NAMED_VALUE_FLOAT_DATA;
use quav::link::message::{CommandAck, ParamName, ParamRequestRead, ParamSet, ParamValue};

use super::{DAEMON, Daemon, Station, vehicle_with};

const USER_1: u16 = 31_010;

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

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn how_far_an_upload_is_can_be_seen_on_the_ground() {
    let mut vehicle = vehicle_with("ardupilot", "s1");
    vehicle.fault("delay:ms=80,dir=tx,msg=MISSION_REQUEST");
    let mut station = Station::open(&vehicle).await;
    let _daemon = Daemon::start(&vehicle.urls[0], "");
    let named = |wanted: &'static str| {
        move |value: &NAMED_VALUE_FLOAT_DATA| {
            let name = value.name.iter().copied().take_while(|&byte| byte != 0);
            name.eq(wanted.bytes())
        }
    };
    let first = station.hear(named("quav_prog")).await.value;
    assert!(first > 0.0 && first < 100.0, "{first}");
    let second = station.hear(named("quav_prog")).await.value;
    assert!(second >= first && second < 100.0, "{first} {second}");
    let length = station.hear(named("quav_len")).await.value;
    let clearance = station.hear(named("quav_clr")).await.value;
    assert!(length > 100.0 && clearance >= 4.99, "{length} {clearance}");
    station.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_parameter_that_is_set_while_a_mission_is_written_counts_for_the_next() {
    let mut vehicle = vehicle_with("ardupilot", "s1");
    vehicle.fault("delay:ms=80,dir=tx,msg=MISSION_REQUEST");
    let station = Station::open(&vehicle).await;
    let daemon = Daemon::start(&vehicle.urls[0], "poll = 3600");
    daemon.wait_for("an upload", |status| status.progress.is_some_and(|percent| percent > 75));
    let name = ParamName::new("QUAV_BUFFER").unwrap();
    let set = ParamSet { bits: 7.0_f32.to_bits(), target: DAEMON, name, kind: 9 };
    station.link.send(&set).await.unwrap();
    let first = daemon.wait_for_answer(1).counts;
    assert_eq!((first.uploads, first.cancelled), (1, 0), "it was being written");
    let last = daemon.wait_for("another", |status| status.counts.uploads == 2).last.unwrap();
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(last.report.unwrap()).unwrap()).unwrap();
    let clearance = report["plan"]["min_clearance_m"].as_f64().unwrap();
    assert!(clearance >= 6.99, "{clearance}");
    station.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_disabled_on_the_ground_neither_plans_nor_obeys_until_it_is_enabled() {
    let mut vehicle = vehicle_with("ardupilot", "s5");
    let mut station = Station::open(&vehicle).await;
    let daemon = Daemon::start(&vehicle.urls[0], "enable = false");
    daemon.wait_for("a look", |status| status.counts.looks >= 1);
    station.command(USER_1, 0.0).await;
    let told = station.hear(|ack: &CommandAck| ack.command == USER_1).await;
    assert_eq!(told.result, CommandAck::DENIED);
    assert!(vehicle.dump()["uploads"].as_array().unwrap().is_empty());
    let name = ParamName::new("QUAV_ENABLE").unwrap();
    let set = ParamSet { bits: 1.0_f32.to_bits(), target: DAEMON, name, kind: 9 };
    station.link.send(&set).await.unwrap();
    let status = daemon.wait_for("the upload", |status| status.counts.uploads == 1);
    assert!(status.enabled);
    assert_eq!(status.last.unwrap().trigger, "a parameter of quavd was set");
    station.close().await;
}
