//! `quavd plan`: the planning of `once` from files, without a vehicle.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::Args;

use super::CliError;
use super::files::{self, out_format};
use super::options::PlanningArgs;
use super::progress::Shown;
use crate::fence::FenceSet;
use crate::formats::{Firmware, Scenario};
use crate::geodesy::LatLon;
use crate::mission::Autopilot;
use crate::replan::{Input, Options, Progress, Replanned, replan};
use crate::report;

pub use crate::report::Delivered;

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
        autopilot: autopilot_of(&scenario),
    };
    let load = began.elapsed();
    let mut leg = String::new();
    let watch = |progress: Progress<'_>| shown.planning(&progress, &mut leg);
    let planned = replan(&input, &options, &AtomicBool::new(false), watch);
    let planned = planned.map_err(CliError::from);
    shown.clear();
    let outcome = Outcome { planned, options: &options, load, total: began.elapsed() };
    if let Ok(planned) = &outcome.planned {
        files::write_all(&args.out, &planned_scenario(&scenario, planned), || {
            outcome.picture(planned, &scenario.fences)
        })?;
    }
    outcome.told(args.json, &scenario.fences, None)
}

/// Where a file's vehicle stands: home, where the file has one.
pub(super) fn position_of_start(scenario: &Scenario) -> Option<LatLon> {
    scenario.mission.home.map(|home| home.position)
}

/// The autopilot that a file says it is for.
pub(super) fn autopilot_of(scenario: &Scenario) -> Autopilot {
    match scenario.vehicle.firmware {
        Firmware::ArduPilot => Autopilot::ArduPilot,
        Firmware::Px4 => Autopilot::Px4,
        Firmware::Unknown => Autopilot::Unknown,
    }
}

/// The scenario with the planned mission in place of its own.
pub(super) fn planned_scenario(scenario: &Scenario, planned: &Replanned) -> Scenario {
    Scenario { mission: planned.mission.clone(), ..scenario.clone() }
}

/// What planning came to, to be told to a person or a program.
pub(super) struct Outcome<'a> {
    pub(super) planned: Result<Replanned, CliError>,
    pub(super) options: &'a Options,
    pub(super) load: Duration,
    pub(super) total: Duration,
}

impl Outcome<'_> {
    /// The text for stdout, or the error with its document.
    pub(super) fn told(
        self,
        json: bool,
        fences: &FenceSet,
        delivered: Option<Delivered>,
    ) -> Result<String, CliError> {
        let timings = report::Timings { load: self.load, total: self.total };
        match self.planned {
            Ok(planned) if json => {
                Ok(report::plan_json(&planned, self.options, timings, delivered.as_ref()))
            }
            Ok(planned) => Ok(report::summary(&planned, fences, self.options, timings, delivered.as_ref())),
            Err(CliError::NoPath { reason, .. }) => {
                let document = json.then(|| report::no_path_json(&reason, self.options, timings));
                Err(CliError::NoPath { reason, document })
            }
            Err(other) => Err(other),
        }
    }

    /// The picture of a plan.
    pub(super) fn picture(&self, planned: &Replanned, fences: &FenceSet) -> String {
        report::svg(planned, fences, self.options)
    }
}
