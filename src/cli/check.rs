//! `quavd check`: judge any mission against any fences.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use super::CliError;
use super::files;
use super::options::SafetyArgs;
use super::plan::{position_of_start, to_json};
use super::progress::Shown;
use crate::replan::{Input, judge};
use crate::report::Run;
use crate::report::json::CheckDocument;
use crate::report::summary::check_summary;

/// The arguments of `quavd check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// The fences and obstacles: .plan, waypoints, GeoJSON, KML or fence text.
    pub scenario: PathBuf,
    /// The mission to judge; without it, the scenario's own.
    pub mission: Option<PathBuf>,
    /// Print one JSON document on stdout.
    #[arg(long)]
    pub json: bool,
    /// Distances and further fences.
    #[command(flatten)]
    pub safety: SafetyArgs,
}

/// Runs the command; returns what goes to stdout.
///
/// # Errors
/// [`CliError`]: exit code 3 where the mission is not clear.
pub fn run(args: &CheckArgs, shown: &Shown) -> Result<String, CliError> {
    let began = Instant::now();
    let mut scenario = files::scenario(&args.scenario, &args.safety)?;
    if let Some(path) = &args.mission {
        scenario.mission = files::mission(path)?;
    }
    if scenario.mission.items.is_empty() {
        return Err(files::FileError::NoMission(args.scenario.clone()).into());
    }
    let load = began.elapsed();
    let rally = super::once::rally_places(&scenario.rally)?;
    let input = Input {
        mission: &scenario.mission,
        fences: &scenario.fences,
        rally: &rally,
        start: position_of_start(&scenario),
        autopilot: scenario.vehicle.autopilot,
    };
    let options = args.safety.options();
    let verdict = judge(&input, &options)?;
    shown.warn(&scenario.warnings);
    let run = Run { options: &options, warnings: &scenario.warnings, load, total: began.elapsed() };
    let text = if args.json {
        to_json(&CheckDocument::new(&verdict, &run))?
    } else {
        check_summary(&verdict, &run)
    };
    if verdict.is_clear() {
        Ok(text)
    } else {
        let reason = "the mission is not clear".to_owned();
        Err(CliError::NoPath { reason, document: Some(text) })
    }
}
