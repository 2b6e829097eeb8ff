//! What `quavd status` shows: kept up to date by the daemon, read by its socket.

use std::fmt::Write as _;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Instant, SystemTime};

use serde::{Deserialize, Serialize};

use super::resources::Resources;

/// The state of the daemon.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// quavd's version.
    pub version: String,
    /// For how long it has run, seconds.
    pub uptime_s: u64,
    /// What it is doing: connecting, watching, looking, planning or writing.
    pub state: String,
    /// How far that is, percent, while it plans or writes.
    pub progress: Option<u8>,
    /// Where the vehicle is looked for, or was found.
    pub endpoint: Option<String>,
    /// The vehicle, while there is one.
    pub vehicle: Option<VehicleStatus>,
    /// Why there is none, or what is wrong with the configuration.
    pub trouble: Option<String>,
    /// Whether planning is enabled.
    pub enabled: bool,
    /// When it plans.
    pub policy: String,
    /// The last change that was answered.
    pub last: Option<LastAnswer>,
    /// What has been counted since the start.
    pub counts: Counts,
    /// What it takes of the machine.
    pub resources: Resources,
}

/// The vehicle as last heard.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct VehicleStatus {
    /// Its system id.
    pub system: u8,
    /// Its flight software.
    pub autopilot: String,
    /// Whether its motors may turn.
    pub armed: bool,
    /// Seconds since it was heard.
    pub silent_s: f64,
}

/// An answer.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct LastAnswer {
    /// Seconds since 1970.
    pub time: u64,
    /// What came of it: uploaded, already_there, no_mission, no_path, armed, ...
    pub verdict: String,
    /// Why it was worked on.
    pub trigger: String,
    /// In words.
    pub text: Vec<String>,
    /// The reason in full, where there is one.
    pub reason: Option<String>,
    /// What was used instead of what was asked for, and why.
    pub fallback: Option<String>,
    /// The report.
    pub report: Option<String>,
    /// From the sign of the change to the answer, milliseconds, pause included.
    pub took_ms: u64,
}

/// Counters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Vehicles found.
    pub connections: u64,
    /// Times the vehicle's plans were downloaded to see whether they are new.
    pub looks: u64,
    /// Answers of all kinds.
    pub answers: u64,
    /// Answers that are a new mission on the vehicle.
    pub uploads: u64,
    /// Plans called off because there was newer input.
    pub cancelled: u64,
}

/// The status, shared between the daemon and its socket.
#[derive(Debug, Clone)]
pub(super) struct Board {
    status: Arc<Mutex<Status>>,
    began: Instant,
}

impl Board {
    pub(super) fn new() -> Self {
        let status = Status {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            state: "connecting".to_owned(),
            ..Status::default()
        };
        Self { status: Arc::new(Mutex::new(status)), began: Instant::now() }
    }

    /// Since when the daemon runs.
    pub(super) fn began(&self) -> Instant {
        self.began
    }

    pub(super) fn change(&self, change: impl FnOnce(&mut Status)) {
        change(&mut self.status.lock().unwrap_or_else(PoisonError::into_inner));
    }

    pub(super) fn read(&self) -> Status {
        let mut status = self.status.lock().unwrap_or_else(PoisonError::into_inner).clone();
        status.uptime_s = self.began.elapsed().as_secs();
        status.resources = Resources::now();
        status
    }
}

impl Status {
    /// The same for people.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut out = format!("quavd {}, running for {}\n", self.version, span(self.uptime_s));
        let mut line = |head: &str, text: &str| {
            // Writing to a string cannot fail.
            let _ = writeln!(out, "{head:<11}{text}");
        };
        let state = match self.progress {
            Some(percent) => format!("{} ({percent} %)", self.state),
            None => self.state.clone(),
        };
        line("state", &state);
        let plans = if self.enabled { self.policy.as_str() } else { "disabled" };
        line("planning", plans);
        if let Some(endpoint) = &self.endpoint {
            line("link", endpoint);
        }
        match &self.vehicle {
            Some(vehicle) => {
                let armed = if vehicle.armed { "armed" } else { "disarmed" };
                let VehicleStatus { system, autopilot, silent_s, .. } = vehicle;
                let heard = format!("heard {silent_s:.1} s ago");
                line("vehicle", &format!("system {system}, {autopilot}, {armed}, {heard}"));
            }
            None => line("vehicle", "none"),
        }
        if let Some(trouble) = &self.trouble {
            line("trouble", trouble);
        }
        if let Some(last) = &self.last {
            let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
            let ago = now.map_or(0, |now| now.as_secs()).saturating_sub(last.time);
            line("last", &format!("{} {} ago ({})", last.verdict, span(ago), last.trigger));
            for text in &last.text {
                line("", text);
            }
            if let Some(reason) = &last.reason {
                line("", reason);
            }
            if let Some(fallback) = &last.fallback {
                line("fallback", fallback);
            }
            if let Some(report) = &last.report {
                line("report", report);
            }
        }
        let Counts { connections, looks, answers, uploads, cancelled } = self.counts;
        line(
            "counts",
            &format!(
                "{connections} connections, {looks} looks, {answers} answers, {uploads} uploads, \
                 {cancelled} plans overtaken"
            ),
        );
        let Resources { rss_kib, threads, descriptors, tasks } = self.resources;
        line(
            "resources",
            &format!(
                "{} MiB, {threads} threads, {tasks} tasks, {descriptors} descriptors",
                rss_kib / 1024
            ),
        );
        out
    }
}

fn span(seconds: u64) -> String {
    match seconds {
        0..=119 => format!("{seconds} s"),
        120..=7199 => format!("{} min", seconds / 60),
        7200..=172_799 => format!("{} h", seconds / 3600),
        _ => format!("{} d", seconds / 86_400),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_names_vehicle_and_last_answer() {
        let status = Status {
            version: "1.2.3".to_owned(),
            state: "planning".to_owned(),
            progress: Some(40),
            enabled: true,
            policy: "on_change".to_owned(),
            vehicle: Some(VehicleStatus {
                system: 7,
                autopilot: "PX4".to_owned(),
                armed: true,
                silent_s: 0.5,
            }),
            last: Some(LastAnswer { verdict: "no_path".to_owned(), ..LastAnswer::default() }),
            ..Status::default()
        };
        let text = status.to_text();
        for part in ["planning (40 %)", "system 7, PX4, armed", "no_path", "on_change"] {
            assert!(text.contains(part), "{text}");
        }
        let json = serde_json::to_string(&status).unwrap();
        assert_eq!(serde_json::from_str::<Status>(&json).unwrap(), status);
    }
}
