//! `quavd check`: judge any mission against any fences.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use super::CliError;
use super::files::{self, out_format};
use super::options::SafetyArgs;
use super::plan::{name_of, position_of_start, to_json};
use super::progress::Shown;
use crate::replan::{Input, fields, judge};
use crate::report::json::CheckDocument;
use crate::report::summary::check_summary;
use crate::report::{Report, Run};

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
    /// Write a picture or a report (.svg, .png, .html). May be repeated.
    #[arg(long, value_name = "FILE")]
    pub out: Vec<PathBuf>,
    /// Distances and further fences.
    #[command(flatten)]
    pub safety: SafetyArgs,
}

/// Runs the command; returns what goes to stdout.
///
/// # Errors
/// [`CliError`]: exit code 3 where the mission is not clear.
pub fn run(args: &CheckArgs, shown: &Shown) -> Result<String, CliError> {
    for path in &args.out {
        if !out_format(path)?.is_shown() {
            let path = path.display();
            return Err(CliError::Usage(format!(
                "{path}: check changes no mission, so it writes .svg, .png and .html only"
            )));
        }
    }
    let began = Instant::now();
    let mut scenario = files::scenario(&args.scenario, &args.safety)?;
    if let Some(path) = &args.mission {
        scenario.mission = files::mission(path)?;
    }
    if scenario.mission.items.is_empty() {
        return Err(files::FileError::NoMission(args.scenario.clone()).into());
    }
    let load = began.elapsed();
    let rally = super::reading::rally_places(&scenario.rally)?;
    let input = Input {
        mission: &scenario.mission,
        fences: &scenario.fences,
        rally: &rally,
        start: position_of_start(&scenario),
        autopilot: scenario.vehicle.autopilot,
    };
    let options = args.safety.options();
    let verdict = judge(&input, &options)?;
    scenario.warnings.extend(files::doubt(&scenario.fences, &verdict));
    shown.warn(&scenario.warnings);
    let run = Run { options: &options, warnings: &scenario.warnings, load, total: began.elapsed() };
    if !args.out.is_empty() {
        let fields = fields(&input, &options)?;
        let title = name_of(args.mission.as_ref().unwrap_or(&args.scenario));
        let report = Report::judged(&verdict, &fields, run, &title, &scenario.fences);
        files::write_shown(&args.out, &report)?;
    }
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
