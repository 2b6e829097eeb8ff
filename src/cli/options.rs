//! The options that planning commands have in common.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::memory;
use crate::fence::InclusionRule;
use crate::geodesy::Zone;
use crate::planner::{CandidateSource, Rounds, Settings};
use crate::qaoa::EngineChoice;
use crate::replan::{Options, Vertical};
use crate::units::Metres;

/// Distances to keep and fences to respect, for planning and checking.
#[derive(Debug, Clone, Args)]
pub struct SafetyArgs {
    /// Distance to keep from every obstacle and fence edge, metres.
    #[arg(long, default_value_t = 5.0, value_parser = buffer, value_name = "M")]
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
    #[arg(long, default_value_t = 10.0, value_parser = vertical, value_name = "M")]
    pub vertical_margin: f64,
    /// The ground at any obstacle is at most this many metres above or below home. Only with this
    /// are heights above ground compared with altitudes above home.
    #[arg(long, value_parser = vertical, value_name = "M")]
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

fn deadline(text: &str) -> Result<f64, String> {
    number(text, 0.001, 1e6)
}

fn learning_rate(text: &str) -> Result<f64, String> {
    number(text, 1e-6, 10.0)
}

/// How to plan.
#[derive(Debug, Clone, Args)]
pub struct PlanningArgs {
    /// Distances and fences.
    #[command(flatten)]
    pub safety: SafetyArgs,
    /// Edges of a leg's path, one qubit each; legs with more corners get more.
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
    /// QAOA engine: auto, chain or statevector.
    #[arg(long, default_value = "auto", value_name = "ENGINE")]
    pub engine: EngineChoice,
    /// How long planning may take, seconds; then the best clear path until then is used, and the
    /// result says so.
    #[arg(long, value_parser = deadline, value_name = "SECONDS")]
    pub deadline: Option<f64>,
    /// Exactly the settings of the paper's table: 20 qubits, 5 layers, 60 Adam steps at 0.1 in
    /// every round, 5 m buffer, grid candidates.
    #[arg(long, conflicts_with_all = ["buffer", "qubits", "layers", "steps", "learning_rate", "candidates", "grid"])]
    pub paper: bool,
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
    /// The options of the library.
    #[must_use]
    pub fn options(&self) -> Options {
        let chosen = Settings {
            buffer: Metres(self.safety.buffer),
            qubits: usize::from(self.qubits),
            layers: usize::from(self.layers),
            steps: self.steps as usize,
            learning_rate: self.learning_rate,
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
            ..base
        };
        let deadline = self.deadline.map(Duration::from_secs_f64);
        Options { settings, deadline, ..self.safety.options() }
    }
}
