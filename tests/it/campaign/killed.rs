//! The program itself, `quavd once`, killed by SIGKILL at any moment, and started again.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use quav::mission::MissionType;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::{Ended, Fakes, Held, SPEED};
use crate::sitl::FakeVehicle;

const MISSION: MissionType = MissionType::Mission;

/// What the two personas hold before and after an undisturbed run, field by field.
pub(super) struct Expected([Plans; 2]);

struct Plans {
    old: Vec<Value>,
    new: Vec<Value>,
}

impl Expected {
    pub(super) fn find() -> Self {
        let mut fakes = Fakes::start();
        Self([0, 1].map(|persona| {
            let fake = fakes.fresh(persona, 1);
            give_plan(fake);
            let old = fake.held(MISSION);
            let state = tempfile::tempdir().unwrap();
            let ended = start(fake, state.path(), &[]).wait_with_output().unwrap();
            assert_eq!(ended.status.code(), Some(0), "{}", String::from_utf8_lossy(&ended.stderr));
            let new = fake.held(MISSION);
            assert_ne!(old, new);
            Plans { old, new }
        }))
    }
}

/// A mission that has to be re-planned.
fn give_plan(fake: &mut FakeVehicle) {
    let plan = Path::new(env!("CARGO_MANIFEST_DIR")).join("fence_examples/s5.plan");
    let document: Value = serde_json::from_slice(&std::fs::read(&plan).unwrap()).unwrap();
    let home = &document["mission"]["plannedHomePosition"];
    fake.control(&json!({"cmd": "set", "home": home, "position": home}));
    fake.control(&json!({"cmd": "set", "mission": plan, "fence": plan}));
}

fn start(fake: &FakeVehicle, state: &Path, more: &[&str]) -> Child {
    // The least planning there can be: this is about what comes after it.
    let speed = SPEED.to_string();
    Command::new(env!("CARGO_BIN_EXE_quavd"))
        .args(["once", "--connect", &fake.endpoint().to_string(), "--system", "1"])
        .args(["--speedup", &speed, "--state-dir"])
        .arg(state)
        .args(["--qubits", "6", "--steps", "2", "--rounds", "1", "--shots", "64"])
        .args(more)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// When the program is killed.
#[derive(Debug)]
enum Moment {
    After(Duration),
    /// Some time after an event on the vehicle: its name, which of its kind, and how much later.
    Event(&'static str, Value, u64, Duration),
}

impl Moment {
    fn random(rng: &mut ChaCha8Rng) -> Self {
        let later = Duration::from_micros(rng.random_range(0..20_000));
        let nothing = json!({});
        match rng.random_range(0..8) {
            0 | 1 => Self::After(Duration::from_millis(rng.random_range(0..2500))),
            2 => Self::Event("download_start", nothing, rng.random_range(1..=3), later),
            3 => Self::Event("upload_start", nothing, 1, later),
            4 | 5 => Self::Event("upload_item", json!({"item": rng.random_range(0..5)}), 1, later),
            6 => Self::Event("upload_ended", nothing, 1, later),
            // The read-back comes after mission, fence and rally, and the mission once more.
            _ => Self::Event("download_start", json!({"type": "mission"}), 3, later),
        }
    }
}

/// Starts the program and kills it at the moment; `false` where it had ended before.
fn start_and_kill(fake: &mut FakeVehicle, state: &Path, moment: &Moment) -> bool {
    let mut process = match moment {
        Moment::After(time) => {
            let process = start(fake, state, &[]);
            std::thread::sleep(*time);
            process
        }
        Moment::Event(event, fields, nth, later) => {
            let waiting = fake.begin_to_wait(event, fields, *nth, 5.0);
            let process = start(fake, state, &[]);
            fake.has_happened(waiting);
            std::thread::sleep(*later);
            process
        }
    };
    let was_alive = process.try_wait().unwrap().is_none();
    // SIGKILL; of one that has ended there is nothing left to kill.
    let _ = process.kill();
    process.wait().unwrap();
    was_alive
}

pub(super) fn carry_out(fakes: &mut Fakes, seed: u64, expected: &Expected) -> Ended {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let persona = usize::from(rng.random_bool(0.5));
    let moments: Vec<_> = (0..rng.random_range(1..=3)).map(|_| Moment::random(&mut rng)).collect();
    let mut faults = Vec::new();
    if rng.random_bool(0.4) {
        faults.push(format!("drop:p={:.2}", rng.random_range(0.0..0.3)));
    }
    if rng.random_bool(0.4) {
        faults.push(format!("delay:ms={},jitter=20", rng.random_range(0..80)));
    }
    if rng.random_bool(0.2) {
        let item = rng.random_range(0..5);
        faults.push(format!("reboot:type=mission,item={item},when=upload,for=0.5,times=1"));
    }
    let restores = rng.random_bool(0.4);
    println!("seed {seed}: {persona}, killed {moments:?}, {faults:?}, restores {restores}");

    let began = Instant::now();
    let fake = fakes.fresh(persona, seed);
    give_plan(fake);
    let Plans { old, new } = &expected.0[persona];
    assert_eq!(fake.held(MISSION), *old);
    let state = tempfile::tempdir().unwrap();
    for fault in &faults {
        fake.fault(fault);
    }
    let mut kills = 0;
    for moment in &moments {
        kills += u32::from(start_and_kill(fake, state.path(), moment));
    }
    fake.control(&json!({"cmd": "clear-faults"}));
    let left = fake.held(MISSION);
    let at_once = left == *new;

    let last = start(fake, state.path(), if restores { &["--restore"] } else { &[] });
    let last = last.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&last.stderr).into_owned();
    let held = fake.held(MISSION);
    let nothing_saved = last.status.code() == Some(2) && said.contains("no earlier mission");
    match last.status.code() {
        Some(0) => {}
        _ if restores && nothing_saved => {}
        code => panic!("the last start ended with {code:?}: {said}"),
    }
    let wanted = if restores { old } else { new };
    assert_eq!(held, *wanted, "after {kills} kills it held {left:?}; the last start said {said}");
    assert_no_open_record(state.path());
    Ended {
        kinds: vec![
            match kills {
                0 => "ended before",
                1 => "killed once",
                2 => "killed twice",
                _ => "killed thrice",
            },
            if restores { "then --restore" } else { "then again" },
            if left == *old {
                "left old"
            } else if at_once {
                "left new"
            } else {
                "left a mixture"
            },
        ],
        held: if restores { Held::Old } else { Held::New },
        settled_later: said.contains("was not settled"),
        at_once,
        seconds: began.elapsed().as_secs_f64(),
    }
}

/// Every record says how it ended. Read as plain JSON, not by the code that wrote it.
fn assert_no_open_record(state: &Path) {
    for entry in std::fs::read_dir(state).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|suffix| suffix == "json") {
            let record: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
            assert_ne!(record["upload"]["outcome"], "started", "{}", path.display());
        }
    }
}
