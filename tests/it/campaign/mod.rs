//! A campaign of seeded faults: whatever a line, a vehicle and quavd's own end do together, the
//! vehicle holds the new plan or the old one afterwards, never a mixture, and the record says which.
//!
//! `make faults` runs it at length and prints a table; `make test` runs a few seeds of each part:
//!
//! - [`lives`]: the transfer itself, in this process, ended where it stands and begun anew;
//! - [`killed`]: the program itself, killed by SIGKILL at any moment and started again;
//! - [`lossy`]: how often 100 items get through where three frames of ten are lost each way.
//!
//! Everything runs at five times the speed of the field, delays and time-outs alike. From the
//! environment: `QUAV_FAULT_RUNS` (of [`lives`]; the others in proportion), `QUAV_FAULT_SEED` (the
//! first), `QUAV_FAULT_WORKERS`.

mod killed;
mod lives;
mod lossy;
mod table;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use quav::vehicle::{Search, Timing};

use self::table::Table;
use crate::sitl::{FakeVehicle, PERSONAS, search};

/// How much faster than in the field everything runs.
const SPEED: u32 = 5;

/// What the vehicle holds at the end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Held {
    New,
    Old,
    /// What another ground station uploaded meanwhile.
    Theirs,
}

/// A run that came to a good end.
struct Ended {
    /// What was against it, for the table.
    kinds: Vec<&'static str>,
    held: Held,
    /// Whether it took another start to get there.
    settled_later: bool,
    /// Whether the new plan was on the vehicle when the first life ended.
    at_once: bool,
    seconds: f64,
}

fn from_environment(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().expect(name))
}

fn fast() -> Search {
    Search { timing: Timing::default().faster(f64::from(SPEED)), ..search() }
}

/// One fake vehicle of each persona, for one worker.
struct Fakes([FakeVehicle; 2]);

impl Fakes {
    fn start() -> Self {
        Self(PERSONAS.map(|persona| {
            let speed = SPEED.to_string();
            let arguments = ["--persona", persona, "--speedup", &speed, "--seed", "1"];
            FakeVehicle::start_on("udpin:127.0.0.1:0", &arguments)
        }))
    }

    /// The vehicle of a persona, as just started.
    fn fresh(&mut self, persona: usize, seed: u64) -> &mut FakeVehicle {
        let fake = &mut self.0[persona];
        fake.control(&serde_json::json!({"cmd": "reset", "seed": seed}));
        fake
    }
}

/// Carries out the runs of all seeds, on several threads, and prints the table. Panics with the
/// seeds of all runs that failed.
fn carry_out(
    title: &str,
    seeds: std::ops::Range<u64>,
    workers: u64,
    run: impl Fn(&mut Fakes, u64) -> Ended + Sync,
) -> Table {
    let next = AtomicU64::new(seeds.start);
    let table = Mutex::new(Table::default());
    let failed = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                let mut fakes = Fakes::start();
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= seeds.end {
                        break;
                    }
                    match catch_unwind(AssertUnwindSafe(|| run(&mut fakes, seed))) {
                        Ok(ended) => table.lock().unwrap().add(&ended),
                        Err(_) => {
                            println!("seed {seed} FAILED: see above");
                            failed.lock().unwrap().push(seed);
                            fakes = Fakes::start();
                        }
                    }
                }
            });
        }
    });
    let table = table.into_inner().unwrap();
    println!("{title}, seeds {} to {}:\n{table}", seeds.start, seeds.end - 1);
    let failed = failed.into_inner().unwrap();
    assert!(failed.is_empty(), "{title}: {} runs failed, seeds {failed:?}", failed.len());
    table
}

/// The first seed, the number of runs, and the number of threads.
fn extent(share: f64, short: u64) -> (std::ops::Range<u64>, u64) {
    let first = from_environment("QUAV_FAULT_SEED", 1);
    let runs = match from_environment("QUAV_FAULT_RUNS", 0) {
        0 => short,
        all => ((all as f64 * share) as u64).max(1),
    };
    (first..first + runs, from_environment("QUAV_FAULT_WORKERS", 4).min(runs))
}

#[test]
fn whatever_happens_the_vehicle_holds_the_new_plan_or_the_old_one() {
    let (seeds, workers) = extent(1.0, 24);
    carry_out("transfers under faults", seeds, workers, lives::carry_out);
}

#[test]
fn whenever_quavd_is_killed_the_next_start_finds_the_matter_and_ends_it() {
    let (seeds, workers) = extent(0.15, 8);
    let expected = killed::Expected::find();
    let run = |fakes: &mut Fakes, seed| killed::carry_out(fakes, seed, &expected);
    carry_out("quavd once killed", seeds, workers, run);
}

#[test]
fn a_hundred_items_get_through_where_three_of_ten_frames_are_lost_each_way() {
    let (seeds, workers) = extent(0.1, 4);
    let runs = seeds.end - seeds.start;
    let table = carry_out("100 items, 30 % loss", seeds, workers, lossy::carry_out);
    let (at_once, allowed) = (table.at_once(), runs / 100);
    println!("uploaded and verified at once: {at_once} of {runs}");
    assert!(runs - at_once <= allowed, "{at_once} of {runs}");
}
