//! The document of a judgement.

use serde::Serialize;

use super::settings::VehicleFenceDocument;
use crate::mission::legs::number as item_number;
use crate::replan::{LegVerdict, Verdict};
use crate::report::run::Run;

/// What `quavd check --json` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckDocument {
    /// Whether no leg meets an obstacle or leaves an inclusion.
    pub collision_free: bool,
    /// Whether every leg keeps the buffer and the altitude limits.
    pub clear: bool,
    /// The least clearance.
    pub min_clearance_m: f64,
    /// The length.
    pub length_m: f64,
    /// What was asked to be kept.
    pub buffer_m: f64,
    /// What the vehicle's parameters say about its fence.
    pub vehicle_fence: VehicleFenceDocument,
    /// The legs.
    pub legs: Vec<CheckedLegDocument>,
    /// What was assumed or odd, a sentence each.
    pub warnings: Vec<String>,
}

/// A judged leg.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckedLegDocument {
    /// The item that it starts from; `null` for the start.
    pub from: Option<usize>,
    /// The item that it ends at (a return: the returning item).
    pub to: Option<usize>,
    /// What messages call it.
    pub name: String,
    /// Its length.
    pub length_m: f64,
    /// Its clearance.
    pub min_clearance_m: f64,
    /// Whether it keeps the buffer and the altitude limits.
    pub clear: bool,
    /// The region that it comes too near to.
    pub blocker: Option<String>,
    /// The obstacles that it is flown over or under, near enough to be in the way otherwise.
    pub flown_over_or_under: Vec<String>,
    /// What is wrong with its altitudes.
    pub altitude: Option<String>,
}

impl CheckDocument {
    /// The document of a judged mission.
    #[must_use]
    pub fn new(verdict: &Verdict, run: &Run<'_>) -> Self {
        Self {
            collision_free: !verdict.collides(),
            clear: verdict.is_clear(),
            min_clearance_m: verdict.clearance().0,
            length_m: verdict.length().0,
            buffer_m: run.options.settings.buffer.0,
            vehicle_fence: (&run.options.rules).into(),
            legs: verdict.legs.iter().map(CheckedLegDocument::from).collect(),
            warnings: run.warnings.iter().chain(&verdict.warnings).cloned().collect(),
        }
    }
}

impl From<&LegVerdict> for CheckedLegDocument {
    fn from(verdict: &LegVerdict) -> Self {
        let LegVerdict { leg, length, clearance, blocker, passed, limit } = verdict;
        Self {
            from: leg.from.item.map(item_number),
            to: leg.to.item.map(item_number),
            name: leg.name().to_string(),
            length_m: length.0,
            min_clearance_m: clearance.0,
            clear: verdict.is_clear(),
            blocker: blocker.as_ref().map(|(region, _)| region.clone()),
            flown_over_or_under: passed.clone(),
            altitude: limit.map(|finding| finding.to_string()),
        }
    }
}
