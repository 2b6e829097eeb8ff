//! `quavd plan`: the planning of `once` from files, without a vehicle.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use serde::Serialize;

use super::CliError;
use super::files::{self, out_format};
use super::options::PlanningArgs;
use super::progress::Shown;
use crate::formats::Scenario;
use crate::geodesy::LatLon;
use crate::replan::{Input, Options, Progress, Replanned, Verdict, fields, judge, replan};
use crate::report::Run;
use crate::report::json::PlanDocument;
use crate::report::picture::{Subject, picture};
use crate::report::summary::plan_summary;
use crate::stop::Stop;

/// The arguments of `quavd plan`.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// Mission and fences: .plan, waypoints or GeoJSON; more fences with --fence.
    pub scenario: PathBuf,
    /// Print one JSON document on stdout.
    #[arg(long)]
    pub json: bool,
    /// Write the result to a file; the suffix gives the format (.plan, .waypoints, .geojson, .kml,
    /// .svg). May be repeated.
    #[arg(long, value_name = "FILE")]
    pub out: Vec<PathBuf>,
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
    let rally = super::once::rally_places(&scenario.rally)?;
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
    let planned = replan(&input, &options, &Stop::new(), watch);
    let planned = planned.map_err(CliError::from);
    shown.clear();
    let before = match &planned {
        Err(CliError::NoPath { .. }) => judge(&input, &options).ok(),
        _ => None,
    };
    let warnings = &scenario.warnings;
    let total = began.elapsed();
    let outcome = Outcome { planned, before, options: &options, warnings, load, total };
    let title = name_of(&args.scenario);
    match (&outcome.planned, &outcome.before) {
        (Ok(planned), _) => {
            files::write_all(&args.out, &planned_scenario(&scenario, planned), || {
                picture(planned, &outcome.run(), &title)
            })?;
        }
        // Without a plan there is nothing to fly, but a picture shows what is in the way.
        (Err(_), Some(before)) => {
            let fields = fields(&input, &options)?;
            files::write_pictures(&args.out, || {
                picture(Subject::judged(before, &fields), &outcome.run(), &title)
            })?;
        }
        (Err(_), None) => {}
    }
    outcome.told(args.json, None)
}

/// What a picture of a file is called.
fn name_of(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
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
