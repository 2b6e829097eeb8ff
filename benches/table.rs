//! One table of times and memory: engines, trainings, samples and whole plans, each row in a process of
//! its own so that its peak memory is its own. `make bench-table`; rows whose name contains the first
//! argument only: `cargo bench --bench table -- chain`.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout)]

mod problems;

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use clap::Parser;
use problems::{LAYERS, MEMORY, chain, hundred_legs, lakes, long_leg, three_regular, town};
use quav::qaoa::Angles;
use quav::qaoa::chain::ChainEngine;
use quav::qaoa::engine::Engine;
use quav::qaoa::statevector::{Precision, StatevectorEngine};
use quav::qaoa::train::{TrainSettings, train};
use quav::stop::Stop;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Set in a row's own process.
const ROW: &str = "QUAVD_BENCH_ROW";

/// A row: what, how large, and on how many threads.
#[derive(Debug, Clone)]
struct Row {
    what: &'static str,
    size: usize,
    threads: usize,
}

impl Row {
    fn name(&self) -> String {
        format!("{}/{}/{}", self.what, self.size, self.threads)
    }
}

fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for what in
        ["chain gradient", "chain 60 steps", "chain 1024 shots", "chain 60 steps + 1024 shots"]
    {
        rows.extend([20, 100, 1000].map(|size| Row { what, size, threads: 1 }));
    }
    for what in ["statevector f64 gradient", "statevector f32 gradient"] {
        for size in [16, 20, 22, 24] {
            rows.extend([1, 2].map(|threads| Row { what, size, threads }));
        }
    }
    rows.push(Row { what: "statevector f64 60 steps", size: 16, threads: 1 });
    rows.push(Row { what: "statevector f64 60 steps", size: 20, threads: 1 });
    for (what, sizes) in PLANS {
        rows.extend(sizes.iter().map(|&size| Row { what, size, threads: 2 }));
    }
    rows
}

/// Whole plans, and how many obstacles they have.
const PLANS: [(&str, &[usize]); 4] = [
    ("plan of obstacles", &[10, 100, 1000, 10_000]),
    ("plan of 20 km", &[1000, 10_000]),
    ("plan of 1,000-vertex outlines", &[10, 20]),
    ("plan of 100 legs", &[1000, 10_000]),
];

/// Where a row's plan is for its own process.
fn plan_file(row: &Row) -> PathBuf {
    let name = row.name().replace(|c: char| !c.is_ascii_alphanumeric(), "-");
    std::env::temp_dir().join(format!("quavd-bench-{name}.plan"))
}

fn mission_of(row: &Row) -> serde_json::Value {
    match row.what {
        "plan of 20 km" => long_leg(row.size),
        "plan of 1,000-vertex outlines" => lakes(row.size),
        "plan of 100 legs" => hundred_legs(row.size),
        _ => town(row.size),
    }
}

/// The best time of at least three runs, and of as many as fit into a second.
fn best(mut run: impl FnMut()) -> Duration {
    let began = Instant::now();
    let mut best = Duration::MAX;
    let mut runs = 0;
    while runs < 3 || (runs < 100 && began.elapsed() < Duration::from_secs(1)) {
        let began = Instant::now();
        run();
        best = best.min(began.elapsed());
        runs += 1;
    }
    best
}

fn trained(engine: &mut dyn Engine) -> Angles {
    let settings = TrainSettings::default();
    train(engine, Angles::ramp(LAYERS), &settings, &Stop::new()).unwrap().angles
}

fn measure(row: &Row) -> Duration {
    let angles = Angles::ramp(LAYERS);
    let size = row.size;
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    match row.what {
        "chain gradient" => {
            let mut engine = ChainEngine::new(chain(size), MEMORY);
            best(|| drop(black_box(engine.expectation_and_gradient(&angles).unwrap())))
        }
        "chain 60 steps" => {
            let mut engine = ChainEngine::new(chain(size), MEMORY);
            best(|| drop(trained(&mut engine)))
        }
        "chain 1024 shots" => {
            let mut engine = ChainEngine::new(chain(size), MEMORY);
            let angles = trained(&mut engine);
            best(|| drop(engine.sample(&angles, 1024, &mut rng).unwrap()))
        }
        "chain 60 steps + 1024 shots" => {
            let mut engine = ChainEngine::new(chain(size), MEMORY);
            best(|| {
                let angles = trained(&mut engine);
                drop(engine.sample(&angles, 1024, &mut rng).unwrap());
            })
        }
        "statevector f64 60 steps" => {
            let problem = three_regular(size);
            let mut engine = StatevectorEngine::new(&problem, Precision::Double, MEMORY).unwrap();
            let began = Instant::now();
            drop(trained(&mut engine));
            began.elapsed()
        }
        what => {
            let single = what.contains("f32");
            let precision = if single { Precision::Single } else { Precision::Double };
            let problem = three_regular(size);
            let mut engine = StatevectorEngine::new(&problem, precision, MEMORY).unwrap();
            best(|| drop(black_box(engine.expectation_and_gradient(&angles).unwrap())))
        }
    }
}

/// The peak of this process's memory so far, MiB; not known but on Linux.
fn peak() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// The whole of `quavd plan`, in this process as in quavd's own.
fn plan(path: &Path) -> ExitCode {
    let out = path.with_extension("out.plan");
    let arguments =
        ["quavd", "--quiet", "plan", path.to_str().unwrap(), "--out", out.to_str().unwrap()];
    quav::cli::run(quav::cli::Cli::parse_from(arguments))
}

/// What a row's own process does: prints seconds and MiB on its last line.
fn own_process(name: &str) -> ExitCode {
    let row = rows().into_iter().find(|row| row.name() == name).unwrap();
    let began = Instant::now();
    let time = if row.what.starts_with("plan") {
        if plan(&plan_file(&row)) != ExitCode::SUCCESS {
            return ExitCode::FAILURE;
        }
        began.elapsed()
    } else {
        measure(&row)
    };
    println!("\n{} {}", time.as_secs_f64(), peak().unwrap_or(f64::NAN));
    ExitCode::SUCCESS
}

fn main() -> ExitCode {
    if let Ok(name) = std::env::var(ROW) {
        return own_process(&name);
    }
    // Cargo passes --bench.
    let only = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    let me = std::env::current_exe().unwrap();
    println!("{:<30} {:>7} {:>8} {:>12} {:>10}", "what", "size", "threads", "time", "peak MiB");
    for row in rows() {
        if only.as_ref().is_some_and(|only| !row.what.contains(only.as_str())) {
            continue;
        }
        if row.what.starts_with("plan") {
            std::fs::write(plan_file(&row), mission_of(&row).to_string()).unwrap();
        }
        let output = Command::new(&me)
            .env(ROW, row.name())
            .env("RAYON_NUM_THREADS", row.threads.to_string())
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        let figures: Vec<f64> = text
            .lines()
            .last()
            .map(|line| line.split_whitespace().flat_map(str::parse).collect())
            .unwrap_or_default();
        let Row { what, size, threads } = row;
        match figures[..] {
            [seconds, peak] if output.status.success() => {
                let time = Duration::from_secs_f64(seconds);
                let time = format!("{time:.3?}");
                println!("{what:<30} {size:>7} {threads:>8} {time:>12} {peak:>10.0}");
            }
            _ => {
                let why = String::from_utf8_lossy(&output.stderr);
                println!("{what:<30} {size:>7} {threads:>8} failed: {}", why.trim());
            }
        }
    }
    ExitCode::SUCCESS
}
