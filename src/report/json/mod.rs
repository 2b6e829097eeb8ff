//! The documents of `--json`: here that of a plan, [`leg`] its legs and rounds, [`settings`] what it
//! was planned with; [`check`] that of a judgement. Keys are only ever added, never renamed.
//!
//! Lengths and clearances are ground metres, places `[latitude, longitude]` in degrees, items are
//! counted as ground stations do (home is 0). A number that is not finite is written as `null`: a
//! clearance where there are no regions, or an optimum that is out of reach.

pub mod check;
pub mod leg;
pub mod settings;
#[cfg(test)]
mod tests;

use std::fmt;
use std::time::Duration;

use serde::Serialize;

pub use check::CheckDocument;
pub use leg::LegDocument;
pub use settings::SettingsDocument;

use super::run::Run;
use super::stretch::{Stretch, stretches};
use crate::geodesy::LatLon;
use crate::mission::legs::number as item_number;
use crate::qaoa::qpu::QpuUse;
use crate::replan::{Replanned, Verdict};

/// What `quavd plan --json` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanDocument {
    /// Whether there is a safe mission.
    pub feasible: bool,
    /// Why there is none.
    pub reason: Option<String>,
    /// Whether the new mission meets no obstacle and leaves no inclusion.
    pub collision_free: bool,
    /// The length of the new mission.
    pub length_m: Option<f64>,
    /// The length of the original, straight from place to place.
    pub straight_m: Option<f64>,
    /// The least clearance of the new mission.
    pub min_clearance_m: Option<f64>,
    /// The places along the new mission.
    pub waypoints: Vec<LatLon>,
    /// The numbers in the new mission of the inserted items.
    pub items_inserted: Vec<usize>,
    /// The original mission.
    pub before: Option<BeforeDocument>,
    /// Every leg of the original mission, with what is now flown for it.
    pub legs: Vec<LegDocument>,
    /// What was used instead of what was asked for, and why.
    pub fallback: Option<String>,
    /// What was used of a QPU; only with the ibm engine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub qpu: Option<QpuUse>,
    /// What was assumed, odd, or is different now, a sentence each.
    pub warnings: Vec<String>,
    /// Where the time went.
    pub time_ms: TimeDocument,
    /// What it was planned with: the same input and settings give the same waypoints.
    pub settings: SettingsDocument,
}

/// The original mission.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BeforeDocument {
    /// Its length.
    pub length_m: f64,
    /// Its least clearance.
    pub min_clearance_m: f64,
    /// Whether it meets no obstacle and leaves no inclusion.
    pub collision_free: bool,
}

/// Where the time went, milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TimeDocument {
    /// Reading the input.
    pub load: f64,
    /// Looking for candidates, all legs.
    pub candidates: f64,
    /// QAOA rounds, all legs.
    pub qaoa: f64,
    /// Finishing, all legs.
    pub finish: f64,
    /// The whole run.
    pub total: f64,
}

impl PlanDocument {
    /// The document of a mission that was planned.
    #[must_use]
    pub fn planned(result: &Replanned, run: &Run<'_>) -> Self {
        let (before, after) = (&result.before, &result.after);
        let notes = result.notes.iter().map(ToString::to_string);
        Self {
            feasible: true,
            reason: None,
            collision_free: !after.collides(),
            length_m: Some(after.length().0),
            straight_m: Some(before.length().0),
            min_clearance_m: Some(after.clearance().0),
            waypoints: after.places(),
            items_inserted: result.inserted.iter().map(|&index| item_number(index)).collect(),
            before: Some(before.into()),
            legs: stretches(result).iter().map(LegDocument::from).collect(),
            fallback: result.fallback(),
            qpu: result.qpu.clone(),
            warnings: run.warnings.iter().chain(&before.warnings).cloned().chain(notes).collect(),
            time_ms: TimeDocument::new(run, Some(result)),
            settings: run.options.into(),
        }
    }

    /// The document of a mission that has no safe path or could not be planned; `before` is the
    /// verdict on the original, where there is one.
    #[must_use]
    pub fn failed(reason: &impl fmt::Display, before: Option<&Verdict>, run: &Run<'_>) -> Self {
        let unchanged = |verdict| LegDocument::from(&Stretch::unchanged(verdict));
        let odd = before.into_iter().flat_map(|before| &before.warnings);
        Self {
            feasible: false,
            reason: Some(reason.to_string()),
            collision_free: false,
            length_m: None,
            straight_m: before.map(|before| before.length().0),
            min_clearance_m: None,
            waypoints: Vec::new(),
            items_inserted: Vec::new(),
            before: before.map(BeforeDocument::from),
            legs: before.into_iter().flat_map(|before| &before.legs).map(unchanged).collect(),
            fallback: None,
            qpu: None,
            warnings: run.warnings.iter().chain(odd).cloned().collect(),
            time_ms: TimeDocument::new(run, None),
            settings: run.options.into(),
        }
    }
}

impl From<&Verdict> for BeforeDocument {
    fn from(verdict: &Verdict) -> Self {
        Self {
            length_m: verdict.length().0,
            min_clearance_m: verdict.clearance().0,
            collision_free: !verdict.collides(),
        }
    }
}

impl TimeDocument {
    fn new(run: &Run<'_>, result: Option<&Replanned>) -> Self {
        let ms = |time: Duration| (time.as_secs_f64() * 1e6).round() / 1e3;
        let legs = || result.into_iter().flat_map(|result| &result.legs);
        Self {
            load: ms(run.load),
            candidates: ms(legs().map(|leg| leg.times.candidates).sum()),
            qaoa: ms(legs().map(|leg| leg.times.qaoa).sum()),
            finish: ms(legs().map(|leg| leg.times.finish).sum()),
            total: ms(run.total),
        }
    }
}
