//! One replacement under faults, over several lives of quavd. A life is a runtime of its own: when
//! it is dropped, everything in it ends where it stands, as in a process that is killed.

use std::time::{Duration, Instant};

use quav::link::{Identity, Link, Transport};
use quav::mission::{Mission, MissionItem, MissionType};
use quav::store::{Outcome, Store};
use quav::vehicle::numbering::to_vehicle;
use quav::vehicle::readback::differences;
use quav::vehicle::replace::{Aftermath, Replacement, Settled, WhileArmed, replace, settle};
use quav::vehicle::{Autopilot, Vehicle, find};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use tokio_util::sync::CancellationToken;

use super::{Ended, Fakes, Held, SPEED, fast};
use crate::sitl::{FakeVehicle, triangle, waypoint};

/// What was said about how a life ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Said {
    New,
    Old,
    Theirs,
    /// Nothing: the matter is open.
    Open,
}

/// When quavd ends suddenly.
#[derive(Debug, Clone, Copy)]
enum Death {
    Never,
    /// This long after the start of the replacement.
    After(Duration),
    /// At this step of the work, counted in reports of progress.
    AtStep(u32),
}

struct Run {
    persona: usize,
    mission_type: MissionType,
    faults: Vec<(&'static str, String)>,
    deaths: [Death; 2],
    /// Whether the second life still has the faults.
    persistent: bool,
    old: Vec<MissionItem>,
    new: Vec<MissionItem>,
}

/// Items in places of their own, at altitudes with centimetres.
fn plan(mission_type: MissionType, first: u16, count: u16) -> Vec<MissionItem> {
    match mission_type {
        MissionType::Fence => (0..count / 3)
            .flat_map(|k| {
                triangle().into_iter().map(move |item| MissionItem {
                    x: item.x + 50_000 * i32::from(first + k),
                    ..item
                })
            })
            .collect(),
        _ => (first..first + count)
            .map(|n| MissionItem { z: 30.0 + 0.01 * f32::from(n), ..waypoint(n) })
            .collect(),
    }
}

impl Run {
    fn from_seed(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mission_type =
            if rng.random_bool(0.15) { MissionType::Fence } else { MissionType::Mission };
        let name = mission_type.to_string();
        let (old, new) = (rng.random_range(0..14), rng.random_range(1..20));
        let speed = f64::from(SPEED);
        let mut faults = Vec::new();
        if rng.random_bool(0.6) {
            faults.push(("loss", format!("drop:p={:.2}", rng.random_range(0.0..=0.4))));
        }
        if rng.random_bool(0.25) {
            // Up to two seconds in the field.
            let most = 1000.0 / speed;
            let (ms, jitter) = (rng.random_range(0.0..most), rng.random_range(0.0..most));
            faults.push(("delay, jitter", format!("delay:ms={ms:.0},jitter={jitter:.0}")));
        }
        if rng.random_bool(0.25) {
            let (p, ms) = (rng.random_range(0.0..0.3), rng.random_range(5.0..2000.0 / speed));
            faults.push(("reordering", format!("reorder:p={p:.2},ms={ms:.0}")));
        }
        if rng.random_bool(0.25) {
            faults.push(("duplication", format!("duplicate:p={:.2}", rng.random_range(0.0..0.5))));
        }
        if rng.random_bool(0.15) {
            faults.push(("corruption", format!("corrupt:p={:.2}", rng.random_range(0.0..0.2))));
        }
        if rng.random_bool(0.15) {
            let (from, length) = (rng.random_range(0.0..1.0), rng.random_range(0.2..2.5));
            faults.push(("silence", format!("silence:from={from:.2},for={length:.2}")));
        }
        if rng.random_bool(0.2) {
            let item = rng.random_range(0..new);
            let (when, down) = (
                if rng.random_bool(0.8) { "upload" } else { "download" },
                rng.random_range(0.05..1.5),
            );
            faults.push((
                "reboot",
                format!("reboot:type={name},item={item},when={when},for={down:.2},times=1"),
            ));
        }
        if rng.random_bool(0.12) {
            let (item, code) = (rng.random_range(0..new), rng.random_range(1..16));
            faults.push((
                "refusal",
                format!("refuse-item:type={name},item={item},code={code},times=1"),
            ));
        }
        if rng.random_bool(0.08) {
            let item = rng.random_range(1..=new);
            faults.push(("half-write", format!("half-write:type={name},item={item},times=1")));
        }
        if rng.random_bool(0.06) {
            let item = rng.random_range(1..=new);
            faults.push((
                "mis-store",
                format!("mis-store:type={name},item={item},field=x,value=123,times=1"),
            ));
        }
        if rng.random_bool(0.06) {
            let delta = [-1, 1, 5][rng.random_range(0..3)];
            faults.push(("lying count", format!("lying-count:type={name},delta={delta},times=1")));
        }
        if rng.random_bool(0.06) {
            let (item, value) =
                (rng.random_range(0..new), ["nan", "inf", "1e9"][rng.random_range(0..3)]);
            faults.push((
                "bad value",
                format!("bad-value:type={name},item={item},value={value},times=1"),
            ));
        }
        if mission_type == MissionType::Fence && rng.random_bool(0.3) {
            let after = rng.random_range(0.0..1.0 / speed);
            faults.push(("vanishing fence", format!("vanish-fence:after={after:.2},times=1")));
        }
        if rng.random_bool(0.08) {
            // What spoils an upload would spoil theirs, which is then their own loss.
            const SPOILERS: [&str; 5] =
                ["reboot", "refusal", "half-write", "mis-store", "vanishing fence"];
            faults.retain(|(kind, _)| !SPOILERS.contains(kind));
            let (at, count) = (rng.random_range(0.0..2.0), rng.random_range(1..6));
            // ArduPilot erases a fence of one or two circles.
            let count = if mission_type == MissionType::Fence { count + 2 } else { count };
            faults.push((
                "ground station",
                format!("second-gcs:at={at:.2},type={name},count={count},pace=20"),
            ));
        }
        let mut death = |p| match rng.random_bool(p) {
            false => Death::Never,
            true if rng.random_bool(0.4) => {
                Death::After(Duration::from_secs_f64(rng.random_range(0.0..1.5)))
            }
            true => Death::AtStep(rng.random_range(0..60)),
        };
        let mut deaths = [death(0.4), death(0.4)];
        if faults.iter().any(|(kind, _)| *kind == "mis-store") {
            // Another start cannot tell a falsified item from a pilot's edit and leaves it alone.
            faults.retain(|(kind, _)| ["mis-store", "duplication", "reordering"].contains(kind));
            deaths = [Death::Never; 2];
        }
        Self {
            persona: usize::from(rng.random_bool(0.5)),
            mission_type,
            faults,
            deaths,
            persistent: rng.random_bool(0.5),
            old: plan(mission_type, 0, old),
            new: plan(
                mission_type,
                100,
                if mission_type == MissionType::Fence { new + 2 } else { new },
            ),
        }
    }

    fn kinds(&self) -> Vec<&'static str> {
        let mut kinds: Vec<_> = self.faults.iter().map(|(kind, _)| *kind).collect();
        if !matches!(self.deaths[0], Death::Never) {
            kinds.push("sudden death");
        }
        if kinds.is_empty() {
            kinds.push("none");
        }
        kinds
    }
}

/// A life of quavd that does `work` with the vehicle, until that is done or death comes.
fn live<T>(
    fake: &FakeVehicle,
    directory: &std::path::Path,
    death: Death,
    work: impl AsyncFnOnce(&Vehicle, &Store, &mut (dyn FnMut() + Send)) -> T,
) -> Option<T> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let transport = Transport::open(&fake.endpoint()).await.unwrap();
        let (link, _task) = Link::start(transport, Identity::default(), CancellationToken::new());
        // Under faults the vehicle may not be found: then the matter stays open.
        let vehicle = find(&link, &fast()).await.ok()?;
        let store = Store::open(directory).unwrap();
        let (deadly, mut reached) = tokio::sync::mpsc::unbounded_channel();
        let mut steps = 0;
        let mut on_step = move || {
            steps += 1;
            if matches!(death, Death::AtStep(step) if steps > step) {
                let _ = deadly.send(());
            }
        };
        let late = async {
            match death {
                Death::After(time) => tokio::time::sleep(time).await,
                Death::Never | Death::AtStep(_) => std::future::pending().await,
            }
        };
        tokio::select! {
            biased;
            Some(()) = reached.recv() => None,
            () = late => None,
            done = work(&vehicle, &store, &mut on_step) => Some(done),
        }
    })
}

pub(super) fn carry_out(fakes: &mut Fakes, seed: u64) -> Ended {
    let run = Run::from_seed(seed);
    let began = Instant::now();
    println!(
        "seed {seed}: {} {} {} -> {}, deaths {:?}, persistent {}, {:?}",
        run.persona,
        run.mission_type,
        run.old.len(),
        run.new.len(),
        run.deaths,
        run.persistent,
        run.faults
    );
    let fake = fakes.fresh(run.persona, seed);
    let (held, at_once, settled_later) = outcome(&run, fake);
    let seconds = began.elapsed().as_secs_f64();
    Ended { kinds: run.kinds(), held, settled_later, at_once, seconds }
}

fn outcome(run: &Run, fake: &mut FakeVehicle) -> (Held, bool, bool) {
    let plan = run.mission_type;
    fake.set(plan, &run.old);
    let dumped = fake.held(plan);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path();

    let before = live(fake, path, Death::Never, async |vehicle, _, _| {
        vehicle.download(plan, &mut |_| {}).await.unwrap().items
    });
    let before = before.expect("nothing is wrong yet");
    let autopilot = if run.persona == 0 { Autopilot::ArduPilot } else { Autopilot::Px4 };
    let intended = match plan {
        MissionType::Mission => {
            to_vehicle(autopilot, &Mission { home: None, items: run.new.clone() }, None)
        }
        _ => run.new.clone(),
    };
    for (_, fault) in &run.faults {
        fake.fault(fault);
    }

    let replacement = Replacement {
        mission_type: plan,
        original: before.clone(),
        before,
        intended: intended.clone(),
    };
    let first = live(fake, path, run.deaths[0], async |vehicle, store, step| {
        let mut on_step = |_| step();
        let replaced = replace(vehicle, store, replacement, WhileArmed::Refuse, &mut on_step).await;
        match replaced {
            Ok(record) => {
                assert_eq!(record.outcome, Outcome::Verified);
                Said::New
            }
            Err(error) => {
                println!("  {error}");
                match error.aftermath {
                    Aftermath::NotBegun
                    | Aftermath::Settled(Settled::Untouched | Settled::PutBack) => Said::Old,
                    Aftermath::Settled(Settled::Finished) => Said::New,
                    Aftermath::Settled(Settled::LeftAlone) => Said::Theirs,
                    Aftermath::Unsettled { .. } => Said::Open,
                }
            }
        }
    });
    let said = first.unwrap_or(Said::Open);
    let mut settled_later = false;
    if run.persistent {
        // The next start has the same troubles, and may die as well.
        let settled = live(fake, path, run.deaths[1], async |vehicle, store, step| {
            settle(vehicle, store, plan, WhileArmed::Refuse, &mut |_| step()).await
        });
        settled_later |= matches!(settled, Some(Ok(Some(_))));
    }
    fake.control(&json!({"cmd": "clear-faults"}));
    // What is still under way arrives, and a transfer that was left open ends.
    std::thread::sleep(Duration::from_secs(10) / SPEED);
    let last = live(fake, path, Death::Never, async |vehicle, store, _| {
        let settled = settle(vehicle, store, plan, WhileArmed::Refuse, &mut |_| {}).await.unwrap();
        let held = vehicle.download(plan, &mut |_| {}).await.unwrap().items;
        (settled, store.last(&vehicle.id(), plan).unwrap(), held)
    });
    let (settled, record, held) = last.expect("nothing is wrong any more");
    settled_later |= settled.is_some();

    let recorded = match record.map(|record| record.outcome) {
        None | Some(Outcome::Restored) => Held::Old,
        Some(Outcome::Verified) => Held::New,
        Some(Outcome::Superseded) => Held::Theirs,
        Some(Outcome::Started) => panic!("the record is still open"),
    };
    let home_slot = usize::from(run.persona == 0 && plan == MissionType::Mission);
    let dump = fake.dump();
    let theirs = uploaded_by_the_ground_station(&dump, run);
    let is_theirs = theirs.as_ref().is_some_and(|theirs| *theirs == places(&fake.held(plan)));
    println!("  said {said:?}, recorded {recorded:?}, another ground station's: {is_theirs}");
    // Another ground station may come at any time, also when all was done.
    if is_theirs {
        return (Held::Theirs, said == Said::New, settled_later);
    }
    match recorded {
        Held::New => {
            let differences = differences(autopilot, plan, &intended, &held);
            assert!(differences.is_empty(), "recorded as new, but {differences:?}");
        }
        Held::Old => {
            // To ArduPilot home alone is no mission, like nothing at all.
            let commands =
                |items: Vec<Value>| if items.len() <= home_slot { vec![] } else { items };
            assert_eq!(commands(fake.held(plan)), commands(dumped), "recorded as old");
        }
        Held::Theirs => panic!("recorded as somebody else's, but it is not: {held:?}"),
    }
    let agrees = match said {
        Said::New => recorded == Held::New,
        Said::Old => recorded == Held::Old,
        Said::Theirs => recorded == Held::Theirs,
        Said::Open => true,
    };
    assert!(agrees, "said {said:?}, but {recorded:?} is recorded");
    (recorded, said == Said::New, settled_later)
}

/// The places of what the second ground station uploaded whole, as the vehicle stores them.
fn uploaded_by_the_ground_station(dump: &Value, run: &Run) -> Option<Vec<(i64, i64)>> {
    let uploads = dump["uploads"].as_array().unwrap();
    let theirs = uploads.iter().rfind(|upload| {
        upload["by"] == json!([255, 190])
            && upload["result"] == 0
            && upload["type"] == run.mission_type.to_string()
    })?;
    let mut places = places(theirs["items"].as_array()?);
    if run.persona == 0 && run.mission_type == MissionType::Mission && !places.is_empty() {
        // Home is in slot 0, whatever is uploaded there.
        places[0] = self::places(dump["mission"]["items"].as_array()?).first().copied()?;
    }
    Some(places)
}

fn places(items: &[Value]) -> Vec<(i64, i64)> {
    items.iter().map(|item| (item["x"].as_i64().unwrap(), item["y"].as_i64().unwrap())).collect()
}
