//! `quavd once`: read from the vehicle, plan, upload, verify, exit.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use tokio_util::sync::CancellationToken;

use super::CliError;
use super::files::{self, out_format};
use super::flight::{Flight, way_is_clear};
use super::options::{PlanningArgs, VehicleArgs, WritingArgs, as_qpu};
use super::plan::{Delivered, Outcome, planned_scenario};
use super::progress::Shown;
use super::reading::{Held, Read, read};
use super::signing::SigningArgs;
use crate::fence::FenceSet;
use crate::ibm::qpu::IbmQpu;
use crate::link::{Endpoint, Link, Signer, Transport};
use crate::mission::{Mission, MissionItem, MissionType};
use crate::replan::{self, Input, Options, Replanned, replan_with};
use crate::report::Report;
use crate::stop::Stop;
use crate::store::Store;
use crate::vehicle::numbering::{to_mission, to_vehicle};
use crate::vehicle::readback::differences;
use crate::vehicle::replace::{Replacement, WhileArmed, replace, restore, settle};
use crate::vehicle::{Autopilot, Vehicle, find};

/// The arguments of `quavd once`.
#[derive(Debug, Args)]
pub struct OnceArgs {
    /// The vehicle: serial:/dev/ttyAMA0:921600, udpin:0.0.0.0:14550, udpout:HOST:PORT,
    /// tcpout:HOST:PORT or tcpin:HOST:PORT.
    #[arg(long, value_name = "URL")]
    pub connect: Endpoint,
    /// Plan and show, but write nothing to the vehicle.
    #[arg(long)]
    pub dry_run: bool,
    /// Put back the mission (and fence) that the vehicle held before quavd wrote to it, and exit.
    #[arg(long, conflicts_with_all = ["dry_run", "out"])]
    pub restore: bool,
    /// On what terms it writes.
    #[command(flatten)]
    pub writing: WritingArgs,
    /// Which vehicle.
    #[command(flatten)]
    pub vehicle: VehicleArgs,
    /// Print one JSON document on stdout.
    #[arg(long)]
    pub json: bool,
    /// Write the result to a file; the suffix gives the format (.plan, .waypoints, .fence, .rally,
    /// .fen, .geojson, .kml, .kmz; .svg, .png or .html to look at). May be repeated.
    #[arg(long, value_name = "FILE")]
    pub out: Vec<PathBuf>,
    /// Who is believed.
    #[command(flatten)]
    pub signing: SigningArgs,
    /// How to plan.
    #[command(flatten)]
    pub planning: PlanningArgs,
}

/// Runs the command; returns what goes to stdout.
///
/// # Errors
/// [`CliError`] with the exit code.
pub fn run(args: OnceArgs, shown: &Shown) -> Result<String, CliError> {
    for path in &args.out {
        out_format(path)?;
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| CliError::Usage(format!("cannot start: {error}")))?;
    runtime.block_on(async {
        let cancel = CancellationToken::new();
        shown.doing(format!("connecting to {}", args.connect));
        let mut transport = Transport::open(&args.connect).await?;
        if let Some(settings) = args.signing.settings() {
            transport =
                transport.signed(Signer::open(&settings, &args.vehicle.state_directory()?)?);
        }
        let (link, task) = Link::start(transport, args.vehicle.identity(), cancel);
        let outcome = with_link(&args, &link, shown).await;
        shown.clear();
        task.close().await;
        outcome
    })
}

async fn with_link(args: &OnceArgs, link: &Link, shown: &Shown) -> Result<String, CliError> {
    let store = Store::open(&args.vehicle.state_directory()?)?;
    shown.doing("waiting for the vehicle");
    let vehicle = find(link, &args.vehicle.search()).await?;
    let outcome = with_vehicle(args, &vehicle, &store, shown).await;
    vehicle.close().await;
    outcome
}

async fn with_vehicle(
    args: &OnceArgs,
    vehicle: &Vehicle,
    store: &Store,
    shown: &Shown,
) -> Result<String, CliError> {
    let mut on_step = |step| shown.step(step);
    let while_armed = args.writing.while_armed();
    if args.restore {
        return put_back(vehicle, store, while_armed, shown).await;
    }
    if !args.dry_run {
        for plan in [MissionType::Fence, MissionType::Mission] {
            let settled = settle(vehicle, store, plan, while_armed, &mut on_step).await?;
            if let Some(settled) = settled {
                shown
                    .warn(&[format!("an earlier upload of the {plan} was not settled: {settled}")]);
            }
        }
    }

    let began = Instant::now();
    let held = Held::download(vehicle, shown).await?;
    let mut read = read(vehicle, store, &args.planning, held, shown).await?;
    let flight = in_flight(vehicle, &mut read, &args.writing)?;
    shown.warn(&read.scenario.warnings);
    let options = read.options(&args.planning);
    if read.scenario.mission.items.is_empty() {
        return Err(CliError::Usage(
            "the vehicle holds no mission; upload one with a ground station first".to_owned(),
        ));
    }
    let load = began.elapsed();
    let qpu = args.planning.qpu(args.vehicle.state_dir.as_ref())?;
    let planned = plan_off_thread(&read, &options, qpu, shown).await;
    let warnings = &read.scenario.warnings;
    let total = began.elapsed();
    let outcome = Outcome { planned, before: None, options: &options, warnings, load, total };

    let mut done = Delivery { written: false, verified: false };
    if let Ok(planned) = &outcome.planned {
        let intended = intended(vehicle, &read, planned, flight.as_ref(), &args.writing)?;
        let same = differences(vehicle.autopilot(), MissionType::Mission, &intended, &read.held)
            .is_empty();
        done.verified = same;
        if !same && !args.dry_run {
            let replacement = Replacement {
                mission_type: MissionType::Mission,
                original: read.original.clone(),
                before: read.held.clone(),
                intended,
            };
            if flight.is_some() {
                way_is_clear(vehicle, &read, &replacement.intended, &options)?;
            }
            let record = replace(vehicle, store, replacement, while_armed, &mut on_step).await?;
            done = Delivery { written: true, verified: true };
            if flight.is_some()
                && let Err(error) = way_is_clear(vehicle, &read, &record.intended, &options)
            {
                shown.warn(&[format!("the new mission is on the vehicle, but {error}")]);
            }
        }
        shown.clear();
        let title = format!("mission of {}", args.connect);
        let report = Report::planned(planned, outcome.run(), &title, &read.scenario.fences);
        files::write_all(&args.out, &planned_scenario(&read.scenario, planned), &report)?;
    }
    outcome.told(args.json, Some(done.told(vehicle, args.dry_run)))
}

/// Where the vehicle is armed, and may be written to: only the rest of what it flies is to be
/// planned, from where it is.
///
/// # Errors
/// [`CliError::Refused`] where that rest does not stand for itself.
pub(crate) fn in_flight(
    vehicle: &Vehicle,
    read: &mut Read,
    writing: &WritingArgs,
) -> Result<Option<Flight>, CliError> {
    let state = vehicle.state();
    if !writing.in_flight || !state.is_armed() {
        return Ok(None);
    }
    // What the vehicle flies is what it holds, whatever that was made from.
    let flown = to_mission(vehicle.autopilot(), &read.held, state.home);
    let flight = Flight::of(&state, vehicle.autopilot(), flown)?;
    read.scenario.mission = flight.rest.clone();
    read.start = Some(flight.position);
    Ok(Some(flight))
}

/// The mission list that the vehicle is to hold, in its numbering.
///
/// # Errors
/// [`CliError`] where it has no room for that, or would have to turn in flight.
pub(crate) fn intended(
    vehicle: &Vehicle,
    read: &Read,
    planned: &Replanned,
    flight: Option<&Flight>,
    writing: &WritingArgs,
) -> Result<Vec<MissionItem>, CliError> {
    let autopilot = vehicle.autopilot();
    let home_slot = (autopilot == Autopilot::ArduPilot).then(|| read.held.first()).flatten();
    let mission = match flight {
        Some(flight) => flight.with(planned)?,
        None => planned.mission.clone(),
    };
    writing.room_for(&mission)?;
    Ok(match (planned.is_changed(), flight) {
        (true, _) => to_vehicle(autopilot, &mission, home_slot),
        (false, Some(_)) => read.held.clone(),
        (false, None) => read.original.clone(),
    })
}

/// What `--restore` does: both plans that quavd may have written.
async fn put_back(
    vehicle: &Vehicle,
    store: &Store,
    while_armed: WhileArmed,
    shown: &Shown,
) -> Result<String, CliError> {
    let mut on_step = |step| shown.step(step);
    settle(vehicle, store, MissionType::Fence, while_armed, &mut on_step).await?;
    let record = restore(vehicle, store, MissionType::Mission, while_armed, &mut on_step).await?;
    shown.clear();
    Ok(format!(
        "the original mission ({} items, saved in {}) is on the vehicle: read back and compared\n",
        record.original.len(),
        store.path_of(&record).display()
    ))
}

/// Plans on a thread of its own (PROJ and the planner block), with progress and Ctrl-C.
async fn plan_off_thread(
    read: &Read,
    options: &Options,
    mut qpu: Option<IbmQpu>,
    shown: &Shown,
) -> Result<Replanned, CliError> {
    let stop = Stop::new();
    let task = {
        let (mission, fences): (Mission, FenceSet) =
            (read.scenario.mission.clone(), read.scenario.fences.clone());
        let (rally, start, autopilot) = (read.rally.clone(), read.start, read.autopilot);
        let (options, shown, stop) = (options.clone(), shown.clone(), stop.clone());
        tokio::task::spawn_blocking(move || {
            let input =
                Input { mission: &mission, fences: &fences, rally: &rally, start, autopilot };
            let watch = |progress: replan::Progress<'_>| shown.planning(&progress);
            replan_with(&input, &options, as_qpu(&mut qpu), &stop, watch)
        })
    };
    tokio::pin!(task);
    let finished = tokio::select! {
        finished = &mut task => finished,
        _ = tokio::signal::ctrl_c() => {
            stop.cancel();
            task.await
        }
    };
    match finished {
        Ok(planned) => planned.map_err(CliError::from),
        Err(panic) => Err(CliError::NoPath {
            reason: format!(
                "the planner failed ({panic}); nothing was written; please report this"
            ),
            document: None,
        }),
    }
}

/// What became of the plan on the vehicle.
#[derive(Debug, Clone, Copy)]
struct Delivery {
    written: bool,
    verified: bool,
}

impl Delivery {
    fn told(self, vehicle: &Vehicle, dry_run: bool) -> Delivered {
        let note = match (self.written, self.verified, dry_run) {
            (true, ..) => "uploaded, read back and compared: the vehicle holds it",
            (false, true, _) => "the vehicle already holds it: nothing was written",
            (false, false, true) => "dry run: nothing was written",
            (false, false, false) => "nothing was written to the vehicle",
        };
        Delivered {
            system: vehicle.node().system.0,
            autopilot: vehicle.autopilot().to_string(),
            uploaded: self.written,
            verified: self.verified,
            note,
        }
    }
}
