//! The options of the daemon, as clap knows them. Their long names, with `_` for `-`, are the keys
//! of the configuration file.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::{ArgAction, Args};

use crate::cli::options::{PlanningArgs, VehicleArgs, WritingArgs};
use crate::cli::signing::SigningArgs;
use crate::link::Endpoint;

/// `MAV_CMD_USER_1`; the others follow it.
const MAV_CMD_USER_1: u16 = 31_010;

/// Everything that `quavd run` can be told.
#[derive(Debug, Clone, Args)]
pub struct DaemonOptions {
    /// Where the vehicle is: serial:/dev/ttyAMA0:921600, udpin:0.0.0.0:14550, udpout:HOST:PORT,
    /// tcpout:HOST:PORT or tcpin:HOST:PORT. Several are alternatives: they are tried in turn until
    /// a vehicle answers on one.
    #[arg(long, value_name = "URL", required = true)]
    pub connect: Vec<Endpoint>,
    /// Which vehicle, and who quavd is on it.
    #[command(flatten, next_help_heading = "Vehicle")]
    pub vehicle: VehicleArgs,
    /// On what terms it writes.
    #[command(flatten)]
    pub writing: WritingArgs,
    /// Who is believed.
    #[command(flatten, next_help_heading = "Signing")]
    pub signing: SigningArgs,
    /// When it works.
    #[command(flatten, next_help_heading = "Daemon")]
    pub service: ServiceArgs,
    /// How to plan.
    #[command(flatten, next_help_heading = "Planning")]
    pub planning: PlanningArgs,
}

/// When the daemon plans, and what it keeps.
#[derive(Debug, Clone, Args)]
pub struct ServiceArgs {
    /// When to plan: on_change (the mission or a fence on the vehicle has changed), on_command (a
    /// MAVLink command asks for it), or manual (only `quavd trigger` on the board asks). A command and
    /// `quavd trigger` work with on_change as well.
    #[arg(long, default_value_t = Policy::OnChange, value_name = "POLICY")]
    pub policy: Policy,
    /// Whether to plan at all. False: watch and answer, and never write to the vehicle.
    #[arg(long, default_value_t = true, action = ArgAction::Set, value_name = "true|false")]
    pub enable: bool,
    /// Which of MAV_CMD_USER_1 to MAV_CMD_USER_5 asks for a plan, 1 to 5.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=5), value_name = "N")]
    pub user_command: u16,
    /// How long the vehicle's plans must have been quiet before planning begins, seconds, 0.1 to 60.
    #[arg(long, default_value_t = 0.5, value_parser = debounce, value_name = "S")]
    pub debounce: f64,
    /// How often the vehicle's plans are compared with those last seen where it gives no hint of a
    /// change itself, seconds, 5 to 3600.
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u16).range(5..=3600), value_name = "S")]
    pub poll: u16,
    /// The longest pause before a lost vehicle is looked for again, seconds, 1 to 600.
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u16).range(1..=600), value_name = "S")]
    pub retry: u16,
    /// Space for the reports of past plans below the state directory, MiB, 1 to 10000.
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=10_000), value_name = "MIB")]
    pub history: u32,
    /// The socket of `quavd status`. Left out: status.sock in the runtime directory that systemd
    /// gives, else in the state directory.
    #[arg(long, value_name = "FILE")]
    pub socket: Option<PathBuf>,
}

impl ServiceArgs {
    /// The `MAV_CMD` that asks for a plan.
    #[must_use]
    pub fn plan_command(&self) -> u16 {
        MAV_CMD_USER_1 + self.user_command - 1
    }

    /// [`ServiceArgs::debounce`] as a duration.
    #[must_use]
    pub fn quiet_time(&self) -> Duration {
        Duration::from_secs_f64(self.debounce)
    }
}

fn debounce(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.1..=60.0).contains(&value) => Ok(value),
        _ => Err(format!("'{text}' is not a number from 0.1 to 60")),
    }
}

/// When the daemon plans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Policy {
    /// Whenever the mission or a fence on the vehicle has changed, and on command.
    #[default]
    OnChange,
    /// When a MAVLink command asks for it.
    OnCommand,
    /// Only when somebody on the board asks.
    Manual,
}

impl Policy {
    /// All of them, in the order of their numbers as a MAVLink parameter.
    pub const ALL: [Self; 3] = [Self::OnChange, Self::OnCommand, Self::Manual];

    /// Its name in the configuration.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::OnChange => "on_change",
            Self::OnCommand => "on_command",
            Self::Manual => "manual",
        }
    }
}

impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Policy {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|policy| policy.name() == text)
            .ok_or_else(|| format!("'{text}' is none of on_change, on_command, manual"))
    }
}
