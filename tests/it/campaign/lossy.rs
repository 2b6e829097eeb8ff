//! How often a mission of 100 items is uploaded and verified over a line that loses three frames
//! of ten each way.

use std::time::Instant;

use quav::mission::{Mission, MissionType};
use quav::store::Store;
use quav::vehicle::numbering::to_vehicle;
use quav::vehicle::readback::differences;
use quav::vehicle::replace::{Replacement, WhileArmed, replace};

use super::{Ended, Fakes, Held, fast};
use crate::sitl::{PERSONAS, Session, waypoint};

const MISSION: MissionType = MissionType::Mission;

pub(super) fn carry_out(fakes: &mut Fakes, seed: u64) -> Ended {
    let persona = usize::from(seed % 2 == 1);
    let fake = fakes.fresh(persona, seed);
    let endpoint = fake.endpoint();
    let directory = tempfile::tempdir().unwrap();
    let began = Instant::now();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let (replaced, is_new) = runtime.block_on(async {
        let session = Session::open(&endpoint, fast()).await;
        let vehicle = &session.vehicle;
        fake.fault("drop:p=0.3");
        let store = Store::open(directory.path()).unwrap();
        let items = (0..100).map(waypoint).collect();
        let intended = to_vehicle(vehicle.autopilot(), &Mission { home: None, items }, None);
        let replacement = Replacement {
            mission_type: MISSION,
            original: vec![],
            before: vec![],
            intended: intended.clone(),
        };
        let replaced = replace(vehicle, &store, replacement, WhileArmed::Refuse, &mut |_| {}).await;
        fake.control(&serde_json::json!({"cmd": "clear-faults"}));
        let held = vehicle.download(MISSION, &mut |_| {}).await.unwrap().items;
        let is_new = differences(vehicle.autopilot(), MISSION, &intended, &held).is_empty();
        session.close().await;
        (replaced, is_new)
    });
    if let Err(error) = &replaced {
        println!("seed {seed}: {error}");
    } else {
        assert!(is_new, "seed {seed}: verified, but not there");
    }
    Ended {
        kinds: vec![PERSONAS[persona]],
        held: if is_new { Held::New } else { Held::Old },
        settled_later: false,
        at_once: replaced.is_ok(),
        seconds: began.elapsed().as_secs_f64(),
    }
}
