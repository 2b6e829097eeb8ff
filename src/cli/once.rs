//! `quavd once`: read from the vehicle, plan, upload, verify, exit.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use tokio_util::sync::CancellationToken;

use super::CliError;
use super::files::{self, out_format};
use super::flight::{Flight, way_is_clear};
use super::options::{PlanningArgs, VehicleArgs, WritingArgs, as_qpu};
use super::plan::{Delivered, Outcome, planned_scenario};
use super::progress::Shown;
use super::signing::SigningArgs;
use crate::fence::items::decode_fence;
use crate::fence::{FenceSet, VehicleRules};
use crate::formats::Scenario;
use crate::geodesy::LatLon;
use crate::ibm::qpu::IbmQpu;
use crate::link::{Endpoint, Link, Signer, Transport};
use crate::mission::{self, LoiterHabit, Mission, MissionItem, MissionType};
use crate::replan::{self, Input, Options, Replanned, replan_with};
use crate::report::Report;
use crate::stop::Stop;
use crate::store::Store;
use crate::vehicle::download::Downloaded;
use crate::vehicle::numbering::{to_mission, to_vehicle};
use crate::vehicle::readback::differences;
use crate::vehicle::replace::{Replacement, WhileArmed, pilots_own, replace, restore, settle};
use crate::vehicle::{Autopilot, TransferError, Vehicle, find};

/// How long to wait for the vehicle's home and position.
const PLACE_PATIENCE: Duration = Duration::from_secs(5);

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

/// What was read from a vehicle.
pub(crate) struct Read {
    /// The pilot's mission, the fences with those of the command line, the rally points.
    pub(crate) scenario: Scenario,
    /// The mission list that the vehicle holds, in its numbering.
    pub(crate) held: Vec<MissionItem>,
    /// The pilot's own mission list: what is held, or what quavd's last upload was made from.
    pub(crate) original: Vec<MissionItem>,
    pub(crate) start: Option<LatLon>,
    pub(crate) rally: Vec<LatLon>,
    pub(crate) autopilot: mission::Autopilot,
    /// What the vehicle's parameters say about its fence.
    rules: VehicleRules,
    loiter: LoiterHabit,
}

impl Read {
    /// The options for planning for this vehicle.
    pub(crate) fn options(&self, planning: &PlanningArgs) -> Options {
        let inclusion = planning.safety.inclusion.0;
        planning.options().with_rules(self.rules.clone(), inclusion, self.loiter)
    }
}

/// The three plans of a vehicle, as downloaded.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Held {
    pub(crate) mission: Vec<MissionItem>,
    pub(crate) fence: Vec<MissionItem>,
    pub(crate) rally: Vec<MissionItem>,
    /// Which of them came in another way than was tried first, and why.
    pub(crate) fell_back: Vec<String>,
}

impl Held {
    /// Downloads all three.
    pub(crate) async fn download(vehicle: &Vehicle, shown: &Shown) -> Result<Self, TransferError> {
        let mut on_progress = |progress| shown.transfer(progress);
        let mission = vehicle.read_plan(MissionType::Mission, &mut on_progress).await?;
        let fence = vehicle.read_plan(MissionType::Fence, &mut on_progress).await?;
        let rally = vehicle.read_plan(MissionType::Rally, &mut on_progress).await?;
        let fell_back = [&mission, &fence, &rally].into_iter().filter_map(Downloaded::fell_back);
        Ok(Self {
            fell_back: fell_back.collect(),
            mission: mission.items,
            fence: fence.items,
            rally: rally.items,
        })
    }
}

/// What the plans of a vehicle mean, with what else planning starts from.
pub(crate) async fn read(
    vehicle: &Vehicle,
    store: &Store,
    planning: &PlanningArgs,
    held: Held,
    shown: &Shown,
) -> Result<Read, CliError> {
    shown.doing("waiting for the vehicle's home and position");
    let known =
        |state: &crate::vehicle::VehicleState| state.home.is_some() && state.position.is_some();
    let _ = vehicle.wait_for(PLACE_PATIENCE, known).await;
    let state = vehicle.state();

    let Held { mission: held, fence, rally, fell_back } = held;
    let original = pilots_own(vehicle, store, MissionType::Mission, &held).await?;
    let mission = to_mission(vehicle.autopilot(), &original, state.home);
    let decoded = decode_fence(&fence, None)?;
    let (mut fences, mut warnings) = (decoded.fences, fell_back);
    warnings.extend(decoded.warnings);
    shown.doing("reading the vehicle's parameters");
    let (rules, loiter) = vehicle.rules().await?;
    if planning.safety.ignore_disabled_fence {
        warnings.extend(rules.leave_out_disabled(&mut fences));
    }
    warnings.extend(rules.odd_inclusions(&fences, mission.home.map(|home| home.position)));
    files::add_fences(&mut fences, &mut warnings, &planning.safety)?;
    let places = rally_places(&rally)?;
    // The vehicle stands at home before it takes off; in flight its own place counts.
    let start = state.position.map(|at| at.position).or(mission.home.map(|home| home.position));
    let scenario = Scenario { mission, fences, rally, warnings, ..Scenario::default() };
    let autopilot = vehicle.autopilot().into();
    Ok(Read { scenario, held, original, start, rally: places, autopilot, rules, loiter })
}

/// The places of rally points.
///
/// # Errors
/// [`CliError::Usage`] naming the point that is no place.
pub(super) fn rally_places(rally: &[MissionItem]) -> Result<Vec<LatLon>, CliError> {
    rally
        .iter()
        .filter(|item| item.command == mission::Command::NAV_RALLY_POINT)
        .map(|item| {
            item.position()
                .map_err(|error| CliError::Usage(format!("rally point {}: {error}", item.seq + 1)))
        })
        .collect()
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
