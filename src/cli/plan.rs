//! `quavd plan`: the planning of `once` from files, without a vehicle.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use serde::Serialize;

use super::CliError;
use super::files::{self, OutFormat, out_format};
use super::options::{PlanningArgs, SafetyArgs, as_qpu};
use super::progress::Shown;
use super::terminal;
use crate::formats::{Scenario, plan_flattened};
use crate::geodesy::LatLon;
use crate::replan::{Input, Options, Progress, Replanned, Verdict, fields, judge, replan_with};
use crate::report::json::PlanDocument;
use crate::report::summary::plan_summary;
use crate::report::{Report, Run};
use crate::stop::Stop;

/// The arguments of `quavd plan`.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// Mission and fences: .plan, waypoints or GeoJSON; more fences with --fence.
    pub scenario: PathBuf,
    /// Print one JSON document on stdout.
    #[arg(long)]
    pub json: bool,
    /// Write the result to a file; the suffix gives the format (.plan, .waypoints, .fence, .rally,
    /// .fen, .geojson, .kml, .kmz; .svg, .png or .html to look at). May be repeated.
    #[arg(long, value_name = "FILE")]
    pub out: Vec<PathBuf>,
    /// Where jobs for a QPU are recorded.
    #[arg(long, env = "STATE_DIRECTORY", value_name = "DIR")]
    pub state_dir: Option<PathBuf>,
    /// How to plan.
    #[command(flatten)]
    pub planning: PlanningArgs,
}

/// Runs the command; returns what goes to stdout.
///
/// # Errors
/// [`CliError`]: exit code 3 where there is no safe path.
pub fn run(args: &PlanArgs, shown: &Shown) -> Result<String, CliError> {
    for path in &args.out {
        out_format(path)?;
    }
    let began = Instant::now();
    let scenario = files::scenario(&args.scenario, &args.planning.safety)?;
    if scenario.mission.items.is_empty() {
        return Err(files::FileError::NoMission(args.scenario.clone()).into());
    }
    shown.warn(&scenario.warnings);
    let rally = super::reading::rally_places(&scenario.rally)?;
    let options = args.planning.options();
    let input = Input {
        mission: &scenario.mission,
        fences: &scenario.fences,
        rally: &rally,
        start: position_of_start(&scenario),
        autopilot: scenario.vehicle.autopilot,
    };
    let load = began.elapsed();
    let watch = |progress: Progress<'_>| shown.planning(&progress);
    let mut qpu = args.planning.qpu(args.state_dir.as_ref())?;
    let planned = replan_with(&input, &options, as_qpu(&mut qpu), &Stop::new(), watch);
    drop(qpu);
    let planned = planned.map_err(CliError::from);
    shown.clear();
    let before = match &planned {
        Err(CliError::NoPath { .. }) => judge(&input, &options).ok(),
        _ => None,
    };
    let judged = planned.as_ref().ok().map(|planned| &planned.before).or(before.as_ref());
    let doubt = judged.and_then(|verdict| files::doubt(&scenario.fences, verdict));
    shown.warn(&doubt);
    let warnings = &[scenario.warnings.as_slice(), doubt.as_slice()].concat();
    let total = began.elapsed();
    let outcome = Outcome { planned, before, options: &options, warnings, load, total };
    let title = name_of(&args.scenario);
    let mut map = String::new();
    let command = command("plan", &args.scenario, &args.planning.safety);
    match (&outcome.planned, &outcome.before) {
        (Ok(planned), _) => {
            let new = planned_scenario(&scenario, planned);
            let report = Report::planned(planned, outcome.run(), &title, &scenario.fences);
            let report = Report { command: Some(&command), ..report };
            files::write_all(&args.out, &new, &report)?;
            if !args.json && !shown.is_quiet() && terminal::shows_dots() {
                let colours = terminal::has_colours(&std::io::stdout());
                // A map that cannot be drawn is no reason to withhold the summary.
                map = report.terminal(colours).map(|map| map + "\n").unwrap_or_default();
            }
            if args.out.iter().any(|path| matches!(out_format(path), Ok(OutFormat::Plan))) {
                shown.warn(&plan_flattened(&new));
            }
        }
        // Without a plan there is nothing to fly, but a picture shows what is in the way.
        (Err(error), Some(before)) => {
            let fields = fields(&input, &options)?;
            let report = Report::judged(before, &fields, outcome.run(), &title, &scenario.fences);
            let reason = error.to_string();
            let report = Report { command: Some(&command), reason: Some(&reason), ..report };
            files::write_shown(&args.out, &report)?;
        }
        (Err(_), None) => {}
    }
    Ok(map + &outcome.told(args.json, None)?)
}

/// What a picture of a file is called.
pub(super) fn name_of(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The command with its files, as a shell takes it; how to plan follows in reports.
pub(super) fn command(name: &str, scenario: &Path, safety: &SafetyArgs) -> String {
    format!("{name} {}{}", quoted(scenario), file_options(safety))
}

/// The options that name further files, each with a space before it.
pub(super) fn file_options(safety: &SafetyArgs) -> String {
    let mut options = String::new();
    for (option, files) in [("--fence", &safety.fence), ("--obstacles", &safety.obstacles)] {
        for file in files {
            options += &format!(" {option} {}", quoted(file));
        }
    }
    options
}

/// A path for a shell.
pub(super) fn quoted(path: &Path) -> String {
    let text = path.to_string_lossy();
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+:=,".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return text.into_owned();
    }
    format!("'{}'", text.replace('\'', "'\\''"))
}

/// Where a file's vehicle stands: home, where the file has one.
pub(super) fn position_of_start(scenario: &Scenario) -> Option<LatLon> {
    scenario.mission.home.map(|home| home.position)
}

/// The scenario with the planned mission in place of its own.
pub(super) fn planned_scenario(scenario: &Scenario, planned: &Replanned) -> Scenario {
    Scenario { mission: planned.mission.clone(), ..scenario.clone() }
}

/// What planning came to, to be told to a person or a program.
pub(super) struct Outcome<'a> {
    pub(super) planned: Result<Replanned, CliError>,
    /// The verdict on the original, where there is no plan.
    pub(super) before: Option<Verdict>,
    pub(super) options: &'a Options,
    /// What was odd about the input.
    pub(super) warnings: &'a [String],
    pub(super) load: Duration,
    pub(super) total: Duration,
}

/// What became of the plan on a vehicle.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Delivered {
    /// The vehicle's system id.
    pub(super) system: u8,
    /// Its flight software.
    pub(super) autopilot: String,
    /// Whether anything was written to it.
    pub(super) uploaded: bool,
    /// Whether it was read back and is what was planned.
    pub(super) verified: bool,
    /// The same in words.
    #[serde(skip)]
    pub(super) note: &'static str,
}

/// The document of `--json`.
#[derive(Serialize)]
struct Document {
    #[serde(flatten)]
    plan: PlanDocument,
    /// Only of `quavd once`.
    #[serde(skip_serializing_if = "Option::is_none")]
    vehicle: Option<Delivered>,
}

impl Outcome<'_> {
    /// The circumstances, for reports.
    pub(super) fn run(&self) -> Run<'_> {
        Run { options: self.options, warnings: self.warnings, load: self.load, total: self.total }
    }

    /// The text for stdout, or the error with its document.
    pub(super) fn told(self, json: bool, delivered: Option<Delivered>) -> Result<String, CliError> {
        let run = self.run();
        match &self.planned {
            Ok(planned) if json => document(PlanDocument::planned(planned, &run), delivered),
            Ok(planned) => {
                let mut text = plan_summary(planned, &run);
                if let Some(delivered) = delivered {
                    text.push_str(&format!("Vehicle {}: {}.\n", delivered.system, delivered.note));
                }
                Ok(text)
            }
            Err(CliError::NoPath { reason, .. }) => {
                let document = json
                    .then(|| {
                        document(
                            PlanDocument::failed(reason, self.before.as_ref(), &run),
                            delivered,
                        )
                    })
                    .transpose()?;
                Err(CliError::NoPath { reason: reason.clone(), document })
            }
            Err(_) => self.planned.map(|_| String::new()),
        }
    }
}

fn document(plan: PlanDocument, vehicle: Option<Delivered>) -> Result<String, CliError> {
    to_json(&Document { plan, vehicle })
}

/// A document as one line of JSON.
pub(super) fn to_json(document: &impl Serialize) -> Result<String, CliError> {
    let mut text = serde_json::to_string(document).map_err(|error| {
        CliError::Usage(format!("the result cannot be written as JSON: {error}"))
    })?;
    text.push('\n');
    Ok(text)
}
