//! A campaign of seeded faults: whatever a line, a vehicle and quavd's own end do together, the
//! vehicle holds the new mission or the old one afterwards, never a mixture, and quavd knows which.
//!
//! `QUAV_FAULT_RUNS` runs (a few by default) from `QUAV_FAULT_SEED` on. Everything runs at five
//! times the speed of the field, delays and time-outs alike.

use std::time::Duration;

use quav::mission::{Mission, MissionItem, MissionType};
use quav::store::{Outcome, Store};
use quav::vehicle::numbering::to_vehicle;
use quav::vehicle::readback::differences;
use quav::vehicle::replace::{Aftermath, Replacement, Settled, Step, WhileArmed, replace, settle};
use quav::vehicle::{Search, Timing};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::sitl::{FakeVehicle, PERSONAS, Session, search, waypoint};

const MISSION: MissionType = MissionType::Mission;
const SPEED: u32 = 5;

fn from_environment(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().expect(name))
}

fn fast() -> Search {
    let Timing {
        request,
        item_min,
        item_max,
        parameter,
        ftp,
        patience,
        busy,
        busy_pause,
        explanation,
        explanation_age,
        fence_settles,
        stragglers,
        silence,
        round_trips,
        retries,
        restarts,
    } = Timing::default();
    let timing = Timing {
        request: request / SPEED,
        item_min: item_min / SPEED,
        item_max: item_max / SPEED,
        parameter: parameter / SPEED,
        ftp: ftp / SPEED,
        patience: patience / SPEED,
        busy: busy / SPEED,
        busy_pause: busy_pause / SPEED,
        explanation: explanation / SPEED,
        explanation_age: explanation_age / SPEED,
        fence_settles: fence_settles / SPEED,
        stragglers: stragglers / SPEED,
        // Heartbeats come at their usual rate, and some are lost.
        silence,
        round_trips,
        retries,
        restarts,
    };
    Search { timing, ..search() }
}

/// What can be left on the vehicle when quavd has said how its replacement ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ending {
    New,
    Old,
    Open,
}

struct Run {
    persona: &'static str,
    faults: Vec<String>,
    /// quavd ends suddenly when this many items are uploaded.
    dies_at: Option<usize>,
    old: u16,
    new: u16,
}

impl Run {
    fn from_seed(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (old, new) = (rng.random_range(0..10), rng.random_range(1..12));
        let mut faults = Vec::new();
        if rng.random_bool(0.7) {
            faults.push(format!("drop:p={:.2}", rng.random_range(0.0..0.4)));
        }
        if rng.random_bool(0.3) {
            let (ms, jitter) = (rng.random_range(0..200), rng.random_range(0..200));
            faults.push(format!("delay:ms={ms},jitter={jitter}"));
        }
        if rng.random_bool(0.3) {
            let (p, ms) = (rng.random_range(0.0..0.3), rng.random_range(5..400));
            faults.push(format!("reorder:p={p:.2},ms={ms}"));
        }
        if rng.random_bool(0.3) {
            faults.push(format!("duplicate:p={:.2}", rng.random_range(0.0..0.5)));
        }
        if rng.random_bool(0.2) {
            faults.push(format!("corrupt:p={:.2}", rng.random_range(0.0..0.2)));
        }
        if rng.random_bool(0.2) {
            let item = rng.random_range(0..new);
            faults.push(format!("reboot:type=mission,item={item},when=upload,for=0.6,times=1"));
        }
        if rng.random_bool(0.15) {
            let (item, code) = (rng.random_range(0..new), rng.random_range(1..14));
            faults.push(format!("refuse-item:type=mission,item={item},code={code},times=1"));
        }
        if rng.random_bool(0.1) {
            faults
                .push(format!("half-write:type=mission,item={},times=1", rng.random_range(0..new)));
        }
        Self {
            persona: PERSONAS[usize::from(rng.random_bool(0.5))],
            faults,
            dies_at: rng.random_bool(0.3).then(|| usize::from(rng.random_range(0..new))),
            old,
            new,
        }
    }

    async fn carry_out(&self, seed: u64) -> Ending {
        let arguments = [
            "--persona",
            self.persona,
            "--speedup",
            &SPEED.to_string(),
            "--seed",
            &seed.to_string(),
        ];
        let mut fake = FakeVehicle::start_on("udpin:127.0.0.1:0", &arguments);
        fake.set(MISSION, &(0..self.old).map(waypoint).collect::<Vec<_>>());
        let dumped = fake.held(MISSION);
        let directory = tempfile::tempdir().unwrap();

        let session = Session::open(&fake.endpoint(), fast()).await;
        let store = Store::open(directory.path()).unwrap();
        let autopilot = session.vehicle.autopilot();
        let before = session.vehicle.download(MISSION, &mut |_| {}).await.unwrap().items;
        let items = (50..50 + self.new).map(waypoint).collect();
        let intended = to_vehicle(autopilot, &Mission { home: None, items }, None);
        for fault in &self.faults {
            fake.fault(fault);
        }
        let said = self.replace(&session, &store, &before, &intended).await;
        drop((session, store));

        let is_new =
            |held: &[MissionItem]| differences(autopilot, MISSION, &intended, held).is_empty();
        fake.control(&serde_json::json!({"cmd": "clear-faults"}));
        // What is still under way arrives, and a transfer that was left open ends.
        tokio::time::sleep(Duration::from_secs(10) / SPEED).await;
        let session = Session::open(&fake.endpoint(), fast()).await;
        let store = Store::open(directory.path()).unwrap();
        let settled =
            settle(&session.vehicle, &store, MISSION, WhileArmed::Refuse, &mut |_| {}).await;
        let known = match (said, settled.unwrap()) {
            (Ending::Open, Some(Settled::Finished)) => Ending::New,
            (Ending::Open, Some(Settled::Untouched | Settled::PutBack)) => Ending::Old,
            // It died before the record was written or after it was closed.
            (Ending::Open, None) if fake.held(MISSION) == dumped => Ending::Old,
            (Ending::Open, None) => Ending::New,
            (said, None) => said,
            (said, Some(settled)) => panic!("said {said:?}, but there was to settle: {settled}"),
        };
        let held = session.vehicle.download(MISSION, &mut |_| {}).await.unwrap().items;
        match known {
            Ending::New => assert!(is_new(&held), "not the new mission: {held:#?}"),
            _ => assert_eq!(fake.held(MISSION), dumped, "not the old mission"),
        }
        session.close().await;
        known
    }

    /// Replaces the mission under the faults, and says what quavd knows at the end.
    async fn replace(
        &self,
        session: &Session,
        store: &Store,
        before: &[MissionItem],
        intended: &[MissionItem],
    ) -> Ending {
        let replacement = Replacement {
            mission_type: MISSION,
            original: before.to_vec(),
            before: before.to_vec(),
            intended: intended.to_vec(),
        };
        let (deadly, mut reached) = tokio::sync::mpsc::unbounded_channel();
        let mut on_step = |step| {
            if let Step::Uploading(progress) = step
                && self.dies_at.is_some_and(|item| progress.done >= item)
            {
                let _ = deadly.send(());
            }
        };
        let work = replace(&session.vehicle, store, replacement, WhileArmed::Refuse, &mut on_step);
        let replaced = tokio::select! {
            replaced = work => replaced,
            _ = reached.recv() => return Ending::Open,
        };
        match replaced {
            Ok(record) => {
                assert_eq!(record.outcome, Outcome::Verified);
                Ending::New
            }
            Err(error) => {
                println!("  {error}");
                match error.aftermath {
                    Aftermath::NotBegun
                    | Aftermath::Settled(Settled::Untouched | Settled::PutBack) => Ending::Old,
                    Aftermath::Settled(Settled::Finished) => Ending::New,
                    Aftermath::Settled(Settled::LeftAlone) => panic!("nobody else was there"),
                    Aftermath::Unsettled { .. } => Ending::Open,
                }
            }
        }
    }
}

#[tokio::test]
async fn whatever_happens_the_vehicle_holds_the_new_mission_or_the_old_one() {
    let first = from_environment("QUAV_FAULT_SEED", 1);
    for seed in first..first + from_environment("QUAV_FAULT_RUNS", 6) {
        let run = Run::from_seed(seed);
        let Run { persona, faults, dies_at, old, new } = &run;
        println!("seed {seed}: {persona}, {old} -> {new} items, dies at {dies_at:?}, {faults:?}");
        println!("  {:?}", run.carry_out(seed).await);
    }
}
