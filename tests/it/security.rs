//! Who is believed: signing with and against pymavlink's own implementation, frames of others,
//! floods.

use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use mavlink::dialects::ardupilotmega::{MISSION_COUNT_DATA, MavMessage};
use mavlink::{MAVLinkV2MessageRaw, MavHeader};
use quav::link::signing::Rejection;
use quav::link::{Endpoint, Signer, SigningSettings, Transport, UnsignedPolicy};
use quav::mission::MissionType;
use quav::vehicle::{DiscoveryError, Search};
use serde_json::json;
use tempfile::TempDir;

use crate::sitl::{FakeVehicle, PERSONAS, Session, search, waypoint};

const MISSION: MissionType = MissionType::Mission;

/// A directory with a key in it, and room for the timestamp.
struct Secret {
    directory: TempDir,
}

impl Secret {
    fn new(byte: u8) -> Self {
        use std::os::unix::fs::PermissionsExt;
        let secret = Self { directory: tempfile::tempdir().unwrap() };
        let path = secret.path();
        std::fs::write(&path, format!("{byte:02x}").repeat(32)).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).unwrap();
        secret
    }

    fn path(&self) -> String {
        self.directory.path().join("key").to_str().unwrap().to_owned()
    }

    fn signer(&self, unsigned: UnsignedPolicy) -> Signer {
        let settings = SigningSettings { key: self.path().parse().unwrap(), unsigned, link_id: 7 };
        Signer::open(&settings, self.directory.path()).unwrap()
    }
}

async fn signed_session(endpoint: &Endpoint, secret: &Secret, policy: UnsignedPolicy) -> Session {
    let transport = Transport::open(endpoint).await.unwrap().signed(secret.signer(policy));
    Session::over(transport, &search()).await.unwrap()
}

/// A MISSION_COUNT of 9 items to quavd, as anybody on the line could send it.
fn forged_count(system: u8, component: u8, sequence: u8) -> Vec<u8> {
    let header = MavHeader { system_id: system.into(), component_id: component, sequence };
    let count = MavMessage::MISSION_COUNT(MISSION_COUNT_DATA {
        count: 9,
        target_system: 1,
        target_component: 195,
        ..MISSION_COUNT_DATA::default()
    });
    let mut frame = MAVLinkV2MessageRaw::new();
    frame.serialize_message(header, &count);
    frame.raw_bytes().to_vec()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[tokio::test]
async fn both_sides_sign_and_what_is_replayed_or_unsigned_is_dropped() {
    let secret = Secret::new(0x5a);
    for persona in PERSONAS {
        for link in ["udpin:127.0.0.1:0", "tcpin:127.0.0.1:0"] {
            let mut fake = FakeVehicle::start_on(
                link,
                &["--persona", persona, "--signing-key", &secret.path(), "--seed", "3"],
            );
            fake.set(MISSION, &(0..12).map(waypoint).collect::<Vec<_>>());
            let session =
                signed_session(&fake.endpoint(), &secret, UnsignedPolicy::RadioStatus).await;
            // Each frame comes twice: the second is a replay.
            fake.fault("duplicate:dir=tx");
            let held = session.vehicle.download(MISSION, &mut |_| {}).await.unwrap().items;
            assert_eq!(held.len(), fake.held(MISSION).len());
            session.vehicle.upload(MISSION, &held, &mut |_| {}).await.unwrap();
            let replayed = session.link.refused().get(&Rejection::Replayed).copied();
            assert!(replayed.is_some_and(|count| count > 12), "{persona} {link}: {replayed:?}");

            // Counts that nobody asked for, and not signed.
            for sequence in 0..20 {
                let frame = hex(&forged_count(1, 1, sequence));
                fake.control(&json!({"cmd": "inject", "hex": frame}));
            }
            let again = session.vehicle.download(MISSION, &mut |_| {}).await.unwrap().items;
            assert_eq!(again.len(), held.len());
            assert_eq!(session.link.refused().get(&Rejection::Unsigned), Some(&20));
            session.close().await;
        }
    }
}

#[tokio::test]
async fn with_another_key_no_vehicle_is_found_and_the_reason_is_told() {
    let (ours, theirs) = (Secret::new(1), Secret::new(2));
    let fake = FakeVehicle::start(&["--signing-key", &theirs.path()]);
    let transport = Transport::open(&fake.endpoint()).await.unwrap();
    let transport = transport.signed(ours.signer(UnsignedPolicy::Accept));
    let search = Search { patience: Duration::from_secs(3), ..search() };
    let error = Session::over(transport, &search).await.err().unwrap();
    assert!(matches!(error, DiscoveryError::NotFound { .. }), "{error}");
    assert!(error.to_string().contains("signed with another key"), "{error}");
}

#[tokio::test]
async fn unsigned_vehicles_are_a_matter_of_the_policy() {
    let secret = Secret::new(3);
    let fake = FakeVehicle::start(&[]);
    let session = signed_session(&fake.endpoint(), &secret, UnsignedPolicy::Accept).await;
    session.vehicle.download(MISSION, &mut |_| {}).await.unwrap();
    session.close().await;
    let transport = Transport::open(&fake.endpoint()).await.unwrap();
    let transport = transport.signed(secret.signer(UnsignedPolicy::RadioStatus));
    let search = Search { patience: Duration::from_secs(3), ..search() };
    let error = Session::over(transport, &search).await.err().unwrap();
    assert!(error.to_string().contains("not signed"), "{error}");
}

#[tokio::test]
async fn another_run_goes_on_where_the_last_one_stopped() {
    // pymavlink on the other side refuses whatever is not newer than what it has seen.
    let secret = Secret::new(4);
    let fake = FakeVehicle::start(&["--signing-key", &secret.path()]);
    for _ in 0..3 {
        let session = signed_session(&fake.endpoint(), &secret, UnsignedPolicy::Reject).await;
        session.vehicle.download(MISSION, &mut |_| {}).await.unwrap();
        session.close().await;
    }
}

#[tokio::test]
async fn frames_of_other_systems_and_components_are_nobodys_answer() {
    for persona in PERSONAS {
        let mut fake = FakeVehicle::start_on("tcpin:127.0.0.1:0", &["--persona", persona]);
        fake.set(MISSION, &(0..30).map(waypoint).collect::<Vec<_>>());
        let expected = fake.held(MISSION).len();
        let session = Session::open(&fake.endpoint(), search()).await;
        fake.fault("delay:ms=20,dir=tx");
        let mut on_progress = |_| {};
        let download = session.vehicle.download(MISSION, &mut on_progress);
        let forge = async {
            for sequence in 0..60 {
                for (system, component) in [(2, 1), (1, 100), (255, 190)] {
                    let frame = hex(&forged_count(system, component, sequence));
                    fake.control(&json!({"cmd": "inject", "hex": frame}));
                }
                tokio::task::yield_now().await;
            }
        };
        let (held, ()) = tokio::join!(download, forge);
        assert_eq!(held.unwrap().items.len(), expected, "{persona}");
        session.close().await;
    }
}

#[tokio::test]
async fn after_the_first_heartbeat_other_addresses_are_not_heard() {
    // quavd listens and the vehicle calls.
    let port = free_port();
    let listen: Endpoint = format!("udpin:127.0.0.1:{port}").parse().unwrap();
    let transport = Transport::open(&listen).await.unwrap();
    let mut fake = FakeVehicle::start_on(&format!("udpout:127.0.0.1:{port}"), &[]);
    fake.set(MISSION, &(0..30).map(waypoint).collect::<Vec<_>>());
    let expected = fake.held(MISSION).len();
    let session = Session::over(transport, &search()).await.unwrap();
    let stranger = UdpSocket::bind("127.0.0.1:0").unwrap();
    let to = SocketAddr::from(([127, 0, 0, 1], port));
    fake.fault("delay:ms=20,dir=tx");
    let mut on_progress = |_| {};
    let download = session.vehicle.download(MISSION, &mut on_progress);
    let forge = async {
        // It says that it is the vehicle, but from elsewhere.
        for sequence in 0..200 {
            stranger.send_to(&forged_count(1, 1, sequence), to).unwrap();
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    };
    let (held, ()) = tokio::join!(download, forge);
    assert_eq!(held.unwrap().items.len(), expected);
    stranger.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
    assert!(stranger.recv(&mut [0; 300]).is_err(), "quavd talked to the stranger");
    session.close().await;
}

#[tokio::test]
async fn a_vehicle_that_comes_back_under_another_address_is_found_there() {
    let port = free_port();
    let listen: Endpoint = format!("udpin:127.0.0.1:{port}").parse().unwrap();
    let transport = Transport::open(&listen).await.unwrap();
    let to = format!("udpout:127.0.0.1:{port}");
    let fake = FakeVehicle::start_on(&to, &[]);
    let session = Session::over(transport, &search()).await.unwrap();
    drop(fake);
    let begun = tokio::time::Instant::now();
    // Its socket, and with it its port, is another one.
    let mut fake = FakeVehicle::start_on(&to, &[]);
    fake.set(MISSION, &(0..5).map(waypoint).collect::<Vec<_>>());
    let back = session.vehicle.wait_for(Duration::from_secs(30), |s| s.heartbeat_at > begun).await;
    assert!(back.is_some());
    let held = session.vehicle.download(MISSION, &mut |_| {}).await.unwrap().items;
    assert_eq!(held.len(), fake.held(MISSION).len());
    session.close().await;
}

fn free_port() -> u16 {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// Runs `quavd once --dry-run` and gives its peak memory in kB.
fn peak_of_a_dry_run(fake: &FakeVehicle, state: &Path) -> u64 {
    let url = fake.endpoint().to_string();
    let mut child = Command::new(env!("CARGO_BIN_EXE_quavd"))
        .args(["once", "--dry-run", "--connect", &url, "--system", "1", "--state-dir"])
        .arg(state)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    loop {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        peak = line.map_or(peak, |line| line.trim().trim_end_matches(" kB").parse().unwrap());
        if let Some(code) = child.try_wait().unwrap() {
            assert!(code.success(), "{code}");
            return peak;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn megabytes_of_garbage_stop_no_download_and_cost_no_memory() {
    let state = tempfile::tempdir().unwrap();
    let plan = Path::new(env!("CARGO_MANIFEST_DIR")).join("fence_examples/s1.plan");
    for (link, bytes) in
        [("udpin:127.0.0.1:0", 60_000), ("tcpin:127.0.0.1:0", 100_000), ("pty", 50_000)]
    {
        let arguments = ["--mission", plan.to_str().unwrap()];
        let mut fake = FakeVehicle::start_on(link, &arguments);
        let quiet = peak_of_a_dry_run(&fake, state.path());
        fake.fault(&format!("noise:bytes={bytes},dir=tx"));
        let flooded = peak_of_a_dry_run(&fake, state.path());
        let dump = fake.dump();
        let applied = dump["faults"][0]["applied"].as_u64().unwrap();
        println!("{link}: {} kB of garbage, peak {quiet} -> {flooded} kB", applied * bytes / 1000);
        assert!(applied * bytes > 3_000_000, "{link}: {applied} times");
        assert!(flooded < quiet + 6_000, "{link}: {quiet} kB quiet, {flooded} kB flooded");
    }
}

#[test]
fn the_program_takes_a_key_from_a_private_file_or_a_credential_and_from_nowhere_else() {
    use std::os::unix::fs::PermissionsExt;
    let (secret, other) = (Secret::new(0x31), Secret::new(0x32));
    let mut fake = FakeVehicle::start(&["--signing-key", &secret.path()]);
    fake.set(MISSION, &(0..3).map(waypoint).collect::<Vec<_>>());
    let url = fake.endpoint().to_string();
    let state = tempfile::tempdir().unwrap();
    let once = |key: &[&str], wait: &str| {
        Command::new(env!("CARGO_BIN_EXE_quavd"))
            .args(["once", "--dry-run", "--connect", &url, "--system", "1", "--wait", wait])
            .args(["--state-dir", state.path().to_str().unwrap()])
            .args(key)
            .env("CREDENTIALS_DIRECTORY", secret.directory.path())
            .output()
            .unwrap()
    };
    for key in [secret.path().as_str(), "credential:key"] {
        let output = once(&["--signing-key", key], "15");
        let says = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{key}: {says}");
        assert!(!says.contains(&"31".repeat(8)), "the key is shown: {says}");
    }
    let open = secret.directory.path().join("open");
    std::fs::write(&open, [7; 32]).unwrap();
    std::fs::set_permissions(&open, std::fs::Permissions::from_mode(0o644)).unwrap();
    for (key, code, reason) in [
        (other.path().as_str(), 4, "signed with another key"),
        (open.to_str().unwrap(), 2, "chmod 600"),
        ("credential:none", 2, "cannot read the signing key"),
        ("/dev/null", 2, "is no regular file"),
    ] {
        let output = once(&["--signing-key", key], "3");
        let says = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{key}: {says}");
        assert!(says.contains(reason), "{key}: {says}");
    }
}
