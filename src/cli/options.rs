//! The options that planning commands have in common.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::ibm::account::AccountArgs;
use super::{CliError, memory};
use crate::fence::InclusionRule;
use crate::geodesy::Zone;
use crate::ibm::client::backends::BackendChoice;
use crate::ibm::qpu::IbmQpu;
use crate::link::{ComponentId, Identity, SystemId};
use crate::mission::Mission;
use crate::planner::{CandidateSource, QpuSettings, QpuTraining, Rounds, Settings};
use crate::qaoa::qpu::Qpu;
use crate::qaoa::{EngineChoice, EngineKind};
use crate::replan::{Options, Vertical};
use crate::units::Metres;
use crate::vehicle::replace::WhileArmed;
use crate::vehicle::{Search, Timing};

/// Distances to keep and fences to respect, for planning and checking.
#[derive(Debug, Clone, Args)]
pub struct SafetyArgs {
    /// Distance to keep from every obstacle and fence edge, metres.
    #[arg(long, default_value_t = 5.0, value_parser = buffer, allow_negative_numbers = true, value_name = "M")]
    pub buffer: f64,
    /// Zone of the projection: auto (of each leg), or EPSG:n (UTM or UPS).
    #[arg(long, default_value = "auto", value_parser = zone, value_name = "ZONE")]
    pub zone: ZoneChoice,
    /// What several inclusion fences mean: inside all of them, or any. auto: as the vehicle has
    /// it (ArduPilot's FENCE_OPTIONS), all of them for files.
    #[arg(long, default_value = "auto", value_parser = inclusion, value_name = "auto|all|any")]
    pub inclusion: InclusionChoice,
    /// Leave out areas of the vehicle's own fence that it has switched off (FENCE_ENABLE,
    /// FENCE_TYPE, GF_ACTION); otherwise they count like all others.
    #[arg(long)]
    pub ignore_disabled_fence: bool,
    /// Vertical distance to keep from an obstacle with a height, to be flown over or under it,
    /// metres.
    #[arg(long, default_value_t = 10.0, value_parser = vertical, allow_negative_numbers = true, value_name = "M")]
    pub vertical_margin: f64,
    /// The ground at any obstacle is at most this many metres above or below home. Only with this
    /// are heights above ground compared with altitudes above home.
    #[arg(long, value_parser = vertical, allow_negative_numbers = true, value_name = "M")]
    pub ground_relief: Option<f64>,
    /// More fences from a file (.plan, waypoints, GeoJSON, KML, fence text); may be repeated.
    #[arg(long, value_name = "FILE")]
    pub fence: Vec<PathBuf>,
    /// More obstacles from a file, as --fence.
    #[arg(long, value_name = "FILE")]
    pub obstacles: Vec<PathBuf>,
}

/// `auto` or a zone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ZoneChoice(pub Option<Zone>);

/// `auto` or a rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InclusionChoice(pub Option<InclusionRule>);

fn inclusion(text: &str) -> Result<InclusionChoice, String> {
    match text {
        "auto" => Ok(InclusionChoice(None)),
        text => text.parse().map(|rule| InclusionChoice(Some(rule))),
    }
}

fn vertical(text: &str) -> Result<f64, String> {
    number(text, 0.0, 10_000.0)
}

fn zone(text: &str) -> Result<ZoneChoice, String> {
    match text {
        "auto" => Ok(ZoneChoice(None)),
        text => text
            .parse()
            .map(|zone| ZoneChoice(Some(zone)))
            .map_err(|e: crate::geodesy::ZoneError| e.to_string()),
    }
}

fn number(text: &str, least: f64, most: f64) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        _ => Err(format!("'{text}' is not a number from {least} to {most}")),
    }
}

fn buffer(text: &str) -> Result<f64, String> {
    number(text, 0.0, 10_000.0)
}

fn grid(text: &str) -> Result<f64, String> {
    number(text, 0.1, 1000.0)
}

fn lambda(text: &str) -> Result<f64, String> {
    number(text, 0.0, 1000.0)
}

/// The share of measurements that CVaR looks at.
///
/// # Errors
/// What a user should give instead.
pub(super) fn cvar(text: &str) -> Result<f64, String> {
    number(text, 0.001, 1.0)
}

fn speedup(text: &str) -> Result<f64, String> {
    number(text, 0.1, 100.0)
}

fn deadline(text: &str) -> Result<f64, String> {
    number(text, 0.001, 1e6)
}

fn learning_rate(text: &str) -> Result<f64, String> {
    number(text, 1e-6, 10.0)
}

/// Which vehicle, who quavd is on it, and where its plans are kept safe.
#[derive(Debug, Clone, Args)]
pub struct VehicleArgs {
    /// The vehicle's system id, where several are on the link.
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..), value_name = "ID")]
    pub system: Option<u8>,
    /// quavd's own component id on the vehicle.
    #[arg(long, default_value_t = 195, value_parser = clap::value_parser!(u8).range(2..), value_name = "ID")]
    pub component: u8,
    /// How long to wait for the vehicle's first heartbeat, seconds.
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u16).range(1..), value_name = "S")]
    pub wait: u16,
    /// The vehicle is a simulation that runs this many times faster: so do all waiting times.
    #[arg(long, default_value_t = 1.0, value_parser = speedup, value_name = "X")]
    pub speedup: f64,
    /// Where originals and upload records are kept.
    #[arg(long, env = "STATE_DIRECTORY", value_name = "DIR")]
    pub state_dir: Option<PathBuf>,
}

impl VehicleArgs {
    /// Who quavd is.
    #[must_use]
    pub fn identity(&self) -> Identity {
        Identity {
            system: SystemId(self.system.unwrap_or(1)),
            component: ComponentId(self.component),
        }
    }

    /// Whom to look for, and for how long.
    #[must_use]
    pub fn search(&self) -> Search {
        Search {
            system: self.system.map(SystemId),
            patience: Duration::from_secs(u64::from(self.wait)),
            timing: Timing::default().faster(self.speedup),
        }
    }

    /// Where records are kept.
    ///
    /// # Errors
    /// [`CliError::Usage`] where no place is given and the user has no home.
    pub fn state_directory(&self) -> Result<PathBuf, CliError> {
        state_directory(self.state_dir.as_ref())
    }
}

/// The option (or systemd's `STATE_DIRECTORY`), else the user's state directory.
pub(super) fn state_directory(chosen: Option<&PathBuf>) -> Result<PathBuf, CliError> {
    if let Some(path) = chosen {
        return Ok(path.clone());
    }
    let base = std::env::var_os("XDG_STATE_HOME")
        .map(PathBuf::from)
        .filter(|path| path.is_absolute())
        .or_else(|| std::env::home_dir().map(|home| home.join(".local/state")));
    base.map(|base| base.join("quavd"))
        .ok_or_else(|| CliError::Usage("no place for records: give --state-dir DIR".to_owned()))
}

/// On what terms the vehicle is written to.
#[derive(Debug, Clone, Args)]
pub struct WritingArgs {
    /// Also write to an armed vehicle: only items after the one it flies to, to an ArduPilot only
    /// while it does not fly its mission, and only if the way to that item is clear.
    #[arg(long)]
    pub in_flight: bool,
    /// Most mission items the vehicle has room for; more are refused before anything is written.
    #[arg(long, value_name = "N")]
    pub max_items: Option<u16>,
}

impl WritingArgs {
    /// What an armed vehicle means.
    #[must_use]
    pub fn while_armed(&self) -> WhileArmed {
        if self.in_flight { WhileArmed::Allow } else { WhileArmed::Refuse }
    }

    /// Whether the vehicle has room for a mission, as far as that was told.
    ///
    /// # Errors
    /// [`CliError::Refused`].
    pub fn room_for(&self, mission: &Mission) -> Result<(), CliError> {
        let items = mission.items.len();
        match self.max_items {
            Some(most) if items > usize::from(most) => Err(CliError::Refused(format!(
                "the new mission has {items} items, more than the {most} of --max-items; nothing \
                 was written. Plan with fewer waypoints (--max-waypoints N)"
            ))),
            _ => Ok(()),
        }
    }
}

/// How to plan.
#[derive(Debug, Clone, Args)]
pub struct PlanningArgs {
    /// Distances and fences.
    #[command(flatten)]
    pub safety: SafetyArgs,
    /// Edges of a leg's path, one qubit each. Legs with more corners get more, and take them in
    /// windows of this many qubits (but for refinements with the chain engine).
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u16).range(2..=2000))]
    pub qubits: u16,
    /// QAOA layers.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u8).range(1..=8))]
    pub layers: u8,
    /// Adam steps of a full training.
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(0..=100_000))]
    pub steps: u32,
    /// Adam's learning rate.
    #[arg(long, default_value_t = 0.1, value_parser = learning_rate)]
    pub learning_rate: f64,
    /// Train on the mean of this share of the best measurements (CVaR) instead of ⟨H⟩: exact with the
    /// statevector engine, estimated from --shots samples at every step with the chain engine.
    #[arg(long, value_parser = cvar, value_name = "ALPHA")]
    pub cvar: Option<f64>,
    /// Shots of each QAOA run.
    #[arg(long, default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub shots: u32,
    /// QAOA rounds of a leg: auto (until they bring nothing), or a number.
    #[arg(long, default_value = "auto", value_name = "auto|N")]
    pub rounds: Rounds,
    /// Seed of everything random; the same seed gives the same plan.
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Resolution of the candidate grid, metres.
    #[arg(long, default_value_t = 5.0, value_parser = grid, value_name = "M")]
    pub grid: f64,
    /// Where candidate paths come from: obstacle corners (and the grid where these give none),
    /// the paper's grid, or both.
    #[arg(long, default_value = "corners", value_name = "corners|grid|both")]
    pub candidates: CandidateSource,
    /// What being near an obstacle costs, metres: λ of λ·exp(−d/buffer). Higher keeps further off.
    #[arg(long, default_value_t = 0.05, value_parser = lambda, value_name = "M")]
    pub lambda: f64,
    /// Most waypoints to insert in all; corners are merged until that is kept, the path getting
    /// longer.
    #[arg(long, value_name = "N")]
    pub max_waypoints: Option<u16>,
    /// QAOA engine: auto, chain, statevector, or ibm (a QPU; see the options below).
    #[arg(long, default_value = "auto", value_name = "ENGINE")]
    pub engine: EngineChoice,
    /// How long planning may take, seconds; then the best clear path until then is used, and the
    /// result says so.
    #[arg(long, value_parser = deadline, value_name = "SECONDS")]
    pub deadline: Option<f64>,
    /// Exactly the settings of the paper's table: 20 qubits, 5 layers, 60 Adam steps at 0.1 in
    /// every round, 5 m buffer, grid candidates.
    #[arg(long, conflicts_with_all = ["buffer", "qubits", "layers", "steps", "learning_rate", "cvar", "candidates", "grid"])]
    pub paper: bool,
    /// On a QPU.
    #[command(flatten)]
    pub qpu: QpuArgs,
}

/// How to plan with `--engine ibm`.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Options of --engine ibm")]
pub struct QpuArgs {
    /// The backend: a name, or least_busy. With --paper it is ibm_kyiv, if nothing is said.
    #[arg(long, value_name = "NAME")]
    pub backend: Option<BackendChoice>,
    /// Where angles are trained: local (the exact engine) or qpu (20 Adam steps, a job each).
    #[arg(long, default_value = "local", value_name = "local|qpu")]
    pub train: QpuTraining,
    /// Jobs of a leg at most, those of a training not counted.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=100))]
    pub qpu_jobs: u16,
    /// Circuits in a job, a QAOA round each.
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u16).range(1..=100))]
    pub qpu_circuits: u16,
    /// End with exit code 6 where the QPU gives nothing, instead of planning locally.
    #[arg(long)]
    pub no_fallback: bool,
    /// Who pays.
    #[command(flatten)]
    pub account: AccountArgs,
}

impl QpuArgs {
    fn settings(&self) -> QpuSettings {
        QpuSettings {
            training: self.train,
            jobs: usize::from(self.qpu_jobs),
            circuits: usize::from(self.qpu_circuits),
            fallback: !self.no_fallback,
            ..QpuSettings::default()
        }
    }
}

/// The QPU as the planner takes it.
pub(crate) fn as_qpu(qpu: &mut Option<IbmQpu>) -> Option<&mut dyn Qpu> {
    qpu.as_mut().map(|qpu| qpu as &mut dyn Qpu)
}

impl SafetyArgs {
    /// Options with these distances and otherwise default settings.
    #[must_use]
    pub fn options(&self) -> Options {
        let settings = Settings { buffer: Metres(self.buffer), ..Settings::default() };
        Options {
            settings,
            zone: self.zone.0,
            inclusion: self.inclusion.0.unwrap_or_default(),
            vertical: Vertical {
                margin: Metres(self.vertical_margin),
                ground_relief: self.ground_relief.map(Metres),
            },
            ..Options::default()
        }
    }
}

impl PlanningArgs {
    /// The QPU, where one was asked for. Its record of jobs is in the state directory.
    ///
    /// # Errors
    /// [`CliError`] without usable credentials or a usable state directory.
    pub fn qpu(&self, state: Option<&PathBuf>) -> Result<Option<IbmQpu>, CliError> {
        if self.engine != EngineChoice::Only(EngineKind::Ibm) {
            return Ok(None);
        }
        let choice = self.qpu.backend.clone().unwrap_or(match self.paper {
            true => BackendChoice::Named("ibm_kyiv".to_owned()),
            false => BackendChoice::LeastBusy,
        });
        self.qpu.account.qpu(&choice, &state_directory(state)?).map(Some)
    }

    /// The options of the library.
    #[must_use]
    pub fn options(&self) -> Options {
        let chosen = Settings {
            buffer: Metres(self.safety.buffer),
            qubits: usize::from(self.qubits),
            layers: usize::from(self.layers),
            steps: self.steps as usize,
            learning_rate: self.learning_rate,
            cvar: self.cvar,
            grid: Metres(self.grid),
            source: self.candidates,
            ..Settings::default()
        };
        let base = if self.paper { Settings::paper() } else { chosen };
        let settings = Settings {
            shots: self.shots,
            rounds: self.rounds,
            seed: self.seed,
            lambda: Metres(self.lambda),
            engine: self.engine,
            memory_limit: memory::available(),
            qpu: self.qpu.settings(),
            ..base
        };
        let deadline = self.deadline.map(Duration::from_secs_f64);
        let most_waypoints = self.max_waypoints.map(usize::from);
        Options { settings, deadline, most_waypoints, ..self.safety.options() }
    }
}
