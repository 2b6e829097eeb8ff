//! `quavd compare`: the paper's table. A*, RRT and QUAV on the same legs with the same buffer,
//! each path judged alike, and how their times grow.
//!
//! - [`legs`]: the legs to plan, each with its airspace;
//! - [`measure`]: every method on a scenario: length, time, clearance, collisions;
//! - [`growth`]: time over the number of edges, with a fitted exponent;
//! - [`table`]: the result for people;
//! - [`page`]: the same as HTML;
//! - [`picture`]: loss curves as SVG.

pub mod growth;
pub mod legs;
pub mod measure;
pub mod page;
pub mod picture;
pub mod table;

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::CliError;
use super::files::{self, FileError, OutFormat, out_format};
use super::options::PlanningArgs;
use super::plan::{file_options, quoted, to_json};
use super::progress::Shown;
use crate::baseline::paper::{PaperLengths, paper_lengths};
use crate::planner::Settings;
use crate::replan::Options;
use crate::report::json::SettingsDocument;
use crate::report::page::reproduce;
use crate::units::Metres;
use growth::Growth;
use legs::LegTask;
use measure::{Measured, Measurement, Method};

/// The arguments of `quavd compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// Missions with fences: .plan, waypoints or GeoJSON. Beside s1 to s6 stand the paper's figures.
    #[arg(required = true)]
    pub scenarios: Vec<PathBuf>,
    /// Print one JSON document on stdout; it holds the loss curves too.
    #[arg(long)]
    pub json: bool,
    /// Write a report (.html), or the loss curves of the first QAOA training of each scenario
    /// (.svg). May be repeated.
    #[arg(long, value_name = "FILE")]
    pub out: Vec<PathBuf>,
    /// Seeds that RRT is run with; lengths and times are means over them.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=1000), value_name = "N")]
    pub seeds: u32,
    /// Measure how QAOA's training time grows from 10 edges to this many (A* and RRT likewise over
    /// theirs); 0: do not.
    #[arg(long, default_value_t = 640, value_parser = clap::value_parser!(u16).range(0..=10_000), value_name = "N")]
    pub edges: u16,
    /// How to plan.
    #[command(flatten)]
    pub planning: PlanningArgs,
}

/// What a comparison came to; also the document of `--json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The scenarios in the order they were given.
    pub scenarios: Vec<ScenarioResult>,
    /// How times grow, on the first leg of the first scenario.
    pub growth: Vec<Growth>,
    /// What the row `quav` was planned with.
    pub settings: SettingsDocument,
}

/// One scenario's methods.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScenarioResult {
    /// The file's name without its suffix.
    pub name: String,
    /// The legs that were planned.
    pub legs: usize,
    /// Their straight lines, metres.
    pub straight_m: f64,
    /// The obstacles that they are flown over or under, near enough to be in the way otherwise.
    pub flown_over_or_under: Vec<String>,
    /// A row for each method.
    pub methods: Vec<Measured>,
    /// What the paper reports for the scenario of this name; its maps are not published.
    pub paper: Option<PaperFigures>,
}

/// The paper's lengths, metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PaperFigures {
    /// A*.
    pub a_star_m: f64,
    /// RRT.
    pub rrt_m: f64,
    /// QUAV.
    pub quav_m: f64,
}

impl From<&PaperLengths> for PaperFigures {
    fn from(row: &PaperLengths) -> Self {
        Self { a_star_m: row.a_star, rrt_m: row.rrt, quav_m: row.quav }
    }
}

/// Runs the command; returns what goes to stdout.
///
/// # Errors
/// [`CliError`]: a scenario cannot be read, or has no leg that needs planning. A method that finds
/// no path is a result.
pub fn run(args: &CompareArgs, shown: &Shown) -> Result<String, CliError> {
    for path in &args.out {
        if !matches!(out_format(path)?, OutFormat::Svg | OutFormat::Html) {
            let path = path.display();
            return Err(CliError::Usage(format!(
                "{path}: a comparison is written as .html, its loss curves as .svg"
            )));
        }
    }
    let options = args.planning.options();
    let buffer = options.settings.buffer;
    let measurement = Measurement {
        buffer,
        seeds: args.seeds,
        quav: options.settings.clone(),
        paper: Settings { buffer, seed: options.settings.seed, ..Settings::paper() },
    };
    let mut scenarios = Vec::new();
    let mut first: Option<LegTask> = None;
    for path in &args.scenarios {
        let name = name(path);
        let scenario = files::scenario(path, &args.planning.safety)?;
        if scenario.mission.items.is_empty() {
            return Err(FileError::NoMission(path.clone()).into());
        }
        shown.warn(&scenario.warnings);
        let (tasks, warnings) = legs::legs_to_plan(&scenario, &options)?;
        shown.warn(&warnings);
        if tasks.is_empty() {
            let path = path.display();
            return Err(CliError::Usage(format!(
                "{path}: every leg is clear, so there is nothing to compare; give a mission with \
                 a leg through an obstacle"
            )));
        }
        let mut methods = Vec::new();
        for method in Method::ALL {
            shown.doing(format!("{name}: {}", method.label()));
            methods.push(measurement.measure(method, &tasks));
        }
        scenarios.push(ScenarioResult {
            legs: tasks.len(),
            straight_m: tasks.iter().map(LegTask::straight).sum::<Metres>().0,
            flown_over_or_under: flown_over_or_under(&tasks),
            methods,
            paper: paper_lengths(&name).map(PaperFigures::from),
            name,
        });
        first = first.or_else(|| tasks.into_iter().next());
    }
    let mut growth = Vec::new();
    if let Some(task) = first.filter(|_| args.edges > 0) {
        shown.doing("how times grow");
        growth = growth::measure(&task, &options.settings, usize::from(args.edges))?;
    }
    shown.clear();
    let comparison = Comparison { scenarios, growth, settings: SettingsDocument::from(&options) };
    for path in &args.out {
        let text = match out_format(path)? {
            OutFormat::Html => page::comparison_page(&comparison, &command(args, &options)),
            _ => picture::loss_curves(&comparison.scenarios),
        };
        files::write(path, text.as_bytes())?;
    }
    if args.json { to_json(&comparison) } else { Ok(table::text(&comparison)) }
}

/// The command that compares the same again.
fn command(args: &CompareArgs, options: &Options) -> String {
    let scenarios = args.scenarios.iter().map(|path| quoted(path));
    let files: Vec<String> = scenarios.collect();
    format!(
        "quavd compare {}{} --seeds {} --edges {}{}",
        files.join(" "),
        file_options(&args.planning.safety),
        args.seeds,
        args.edges,
        reproduce::arguments(options)
    )
}

/// Each obstacle once.
fn flown_over_or_under(tasks: &[LegTask]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for name in tasks.iter().flat_map(|task| &task.passed) {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    names
}

fn name(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}
