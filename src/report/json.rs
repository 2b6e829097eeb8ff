//! The documents of `--json`. Keys are only ever added, never renamed.
//!
//! Lengths and clearances are ground metres, places `[latitude, longitude]` in degrees, items are
//! counted as ground stations do (home is 0). A number that is not finite is written as `null`: a
//! clearance where there are no regions, or an optimum that is out of reach.

use std::fmt;
use std::time::Duration;

use serde::Serialize;

use super::run::Run;
use super::stretch::{Stretch, stretches};
use crate::geodesy::LatLon;
use crate::mission::legs::number as item_number;
use crate::planner::candidates::{Candidate, Source};
use crate::planner::rounds::{Challenger, Round};
use crate::planner::{CandidateSource, Rounds};
use crate::qaoa::EngineChoice;
use crate::replan::{LegVerdict, Options, Replanned, Verdict};
use crate::units::Metres;

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

/// A leg of the original mission.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LegDocument {
    /// The item that it starts from; `null` for the start.
    pub from: Option<usize>,
    /// The item that it ends at (a return: the returning item).
    pub to: Option<usize>,
    /// What messages call it.
    pub name: String,
    /// Whether it is now flown over inserted waypoints.
    pub replanned: bool,
    /// The length of what is flown now.
    pub length_m: f64,
    /// The straight line.
    pub straight_m: f64,
    /// The least clearance of what is flown now.
    pub min_clearance_m: f64,
    /// The QAOA rounds.
    pub rounds: Vec<RoundDocument>,
    /// What the rounds started from, the first incumbent first.
    pub candidates: Vec<CandidateDocument>,
}

/// A QAOA round. Energies are metres of path; a collision counts `penalty` in them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RoundDocument {
    /// What challenged the incumbent.
    pub challenger: Challenger,
    /// The engine that ran.
    pub engine: String,
    /// Qubits of the chain.
    pub qubits: usize,
    /// Layers of the circuit.
    pub layers: usize,
    /// ⟨H⟩ at the start of the training and after each step.
    pub loss: Vec<f64>,
    /// Energy of the cheapest sample.
    pub best_sample: f64,
    /// The exact optimum.
    pub exact_optimum: f64,
    /// The difference of the two.
    pub gap: f64,
    /// The probability of the exact optimum in one shot.
    pub p_optimum: f64,
    /// The collision penalty.
    pub penalty: f64,
    /// Distinct bitstrings among the shots.
    pub distinct: usize,
    /// The length of the incumbent after the round.
    pub length_m: f64,
    /// Whether the round replaced the incumbent.
    pub improved: bool,
}

/// A candidate path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CandidateDocument {
    /// What found it.
    pub source: Source,
    /// Its length.
    pub length_m: f64,
    /// Its cumulative turning angle.
    pub turning_rad: f64,
    /// Whether every edge keeps the margin.
    pub clear: bool,
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

/// The settings, by the names of their options.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SettingsDocument {
    /// quavd's version.
    pub version: &'static str,
    /// What paths keep from everything, metres.
    pub buffer: Metres,
    /// Qubits of a leg, where its candidates do not need more.
    pub qubits: usize,
    /// QAOA layers.
    pub layers: usize,
    /// Adam steps of a full training.
    pub steps: usize,
    /// Adam's learning rate.
    pub learning_rate: f64,
    /// Shots of each run.
    pub shots: u32,
    /// `auto` or the most rounds of a leg.
    pub rounds: String,
    /// The seed.
    pub seed: u64,
    /// The resolution of the candidate grid, metres.
    pub grid: Metres,
    /// Where candidates are looked for.
    pub source: CandidateSource,
    /// Candidates wanted.
    pub candidates: usize,
    /// `λ` of the edge cost, metres.
    pub lambda: Metres,
    /// `auto` or the engine asked for.
    pub engine: String,
    /// Whether every round is trained in full.
    pub full_training: bool,
    /// `auto` or the zone of all legs.
    pub zone: String,
    /// What several inclusions mean together.
    pub inclusion: String,
}

/// What `quavd check --json` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckDocument {
    /// Whether no leg meets an obstacle or leaves an inclusion.
    pub collision_free: bool,
    /// Whether every leg keeps the buffer.
    pub clear: bool,
    /// The least clearance.
    pub min_clearance_m: f64,
    /// The length.
    pub length_m: f64,
    /// What was asked to be kept.
    pub buffer_m: f64,
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
    /// Whether it keeps the buffer.
    pub clear: bool,
    /// The region that it comes too near to.
    pub blocker: Option<String>,
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
            fallback: run.fallback.map(str::to_owned),
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
            fallback: run.fallback.map(str::to_owned),
            warnings: run.warnings.iter().chain(odd).cloned().collect(),
            time_ms: TimeDocument::new(run, None),
            settings: run.options.into(),
        }
    }
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
            legs: verdict.legs.iter().map(CheckedLegDocument::from).collect(),
            warnings: run.warnings.iter().chain(&verdict.warnings).cloned().collect(),
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

impl From<&Stretch<'_>> for LegDocument {
    fn from(stretch: &Stretch<'_>) -> Self {
        let LegVerdict { leg, length, .. } = stretch.before;
        let record = stretch.record;
        Self {
            from: leg.from.item.map(item_number),
            to: leg.to.item.map(item_number),
            name: leg.name().to_string(),
            replanned: stretch.replanned,
            length_m: stretch.length.0,
            straight_m: length.0,
            min_clearance_m: stretch.clearance.0,
            rounds: record.iter().flat_map(|r| &r.rounds).map(RoundDocument::from).collect(),
            candidates: record
                .iter()
                .flat_map(|r| &r.candidates)
                .map(CandidateDocument::from)
                .collect(),
        }
    }
}

impl From<&Round> for RoundDocument {
    fn from(round: &Round) -> Self {
        Self {
            challenger: round.challenger,
            engine: round.engine.to_string(),
            qubits: round.qubits,
            layers: round.layers,
            loss: round.loss.clone(),
            best_sample: round.best_sample,
            exact_optimum: round.exact_optimum,
            gap: round.gap,
            p_optimum: round.p_optimum,
            penalty: round.penalty,
            distinct: round.distinct,
            length_m: round.length,
            improved: round.improved,
        }
    }
}

impl From<&Candidate> for CandidateDocument {
    fn from(candidate: &Candidate) -> Self {
        let &Candidate { source, length, turning, clear, .. } = candidate;
        Self { source, length_m: length, turning_rad: turning, clear }
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

impl From<&Options> for SettingsDocument {
    fn from(options: &Options) -> Self {
        let settings = &options.settings;
        Self {
            version: env!("CARGO_PKG_VERSION"),
            buffer: settings.buffer,
            qubits: settings.qubits,
            layers: settings.layers,
            steps: settings.steps,
            learning_rate: settings.learning_rate,
            shots: settings.shots,
            rounds: match settings.rounds {
                Rounds::Auto => "auto".to_owned(),
                Rounds::AtMost(rounds) => rounds.to_string(),
            },
            seed: settings.seed,
            grid: settings.grid,
            source: settings.source,
            candidates: settings.candidates,
            lambda: settings.lambda,
            engine: match settings.engine {
                EngineChoice::Auto => "auto".to_owned(),
                EngineChoice::Only(kind) => kind.to_string(),
            },
            full_training: settings.full_training,
            zone: options.zone.map_or_else(|| "auto".to_owned(), |zone| zone.to_string()),
            inclusion: options.inclusion.to_string(),
        }
    }
}

impl From<&LegVerdict> for CheckedLegDocument {
    fn from(verdict: &LegVerdict) -> Self {
        let LegVerdict { leg, length, clearance, blocker } = verdict;
        Self {
            from: leg.from.item.map(item_number),
            to: leg.to.item.map(item_number),
            name: leg.name().to_string(),
            length_m: length.0,
            min_clearance_m: clearance.0,
            clear: blocker.is_none(),
            blocker: blocker.as_ref().map(|(region, _)| region.clone()),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::report::samples::{self, BARN, POND, YARD};

    fn keys(value: &Value) -> Vec<&str> {
        value.as_object().unwrap().keys().map(String::as_str).collect()
    }

    fn plan(text: &str) -> (Replanned, Value) {
        let options = Options::default();
        let result = samples::planned(text, &options);
        let run = samples::run(&options, &[]);
        let document = PlanDocument::planned(&result, &run);
        (result, serde_json::to_value(document).unwrap())
    }

    #[test]
    fn a_plan_has_the_keys_that_scripts_rely_on() {
        let (_, document) = plan(BARN);
        let has = |value: &Value, wanted: &[&str]| {
            let keys = keys(value);
            for key in wanted {
                assert!(keys.contains(key), "{key} is not in {keys:?}");
            }
        };
        has(&document, &["feasible", "reason", "collision_free", "length_m", "straight_m"]);
        has(&document, &["min_clearance_m", "waypoints", "legs", "fallback", "time_ms"]);
        has(&document, &["before", "warnings", "settings", "items_inserted"]);
        has(&document["time_ms"], &["load", "candidates", "qaoa", "finish", "total"]);
        let leg = &document["legs"][0];
        has(leg, &["from", "to", "name", "replanned", "length_m", "min_clearance_m", "rounds"]);
        has(&leg["candidates"][0], &["source", "length_m", "turning_rad", "clear"]);
        has(&leg["rounds"][0], &["engine", "qubits", "layers", "loss", "best_sample"]);
        has(&leg["rounds"][0], &["exact_optimum", "gap", "p_optimum", "challenger", "distinct"]);
        assert_eq!(document["settings"]["seed"], 0);
        assert_eq!(document["settings"]["rounds"], "auto");
        assert_eq!(document["time_ms"]["load"], 1.234);
    }

    #[test]
    fn each_leg_of_the_original_has_the_figures_of_what_is_flown_now() {
        let (result, document) = plan(POND);
        let legs = document["legs"].as_array().unwrap();
        assert_eq!(legs.len(), result.before.legs.len());
        let number = |leg: &Value, key: &str| leg[key].as_f64().unwrap();
        for (leg, before) in legs.iter().zip(&result.before.legs) {
            let replanned = leg["replanned"].as_bool().unwrap();
            assert_eq!(replanned, before.blocker.is_some(), "{leg}");
            assert_eq!(replanned, !leg["rounds"].as_array().unwrap().is_empty());
            assert!(number(leg, "min_clearance_m") >= 5.0, "{leg}");
            assert_eq!(number(leg, "length_m") > number(leg, "straight_m"), replanned, "{leg}");
        }
        // All of these legs follow each other, so that they add up to the mission.
        let sum: f64 = legs.iter().map(|leg| number(leg, "length_m")).sum();
        assert!((sum - document["length_m"].as_f64().unwrap()).abs() < 1e-6, "{sum}");
        let least = legs.iter().map(|leg| number(leg, "min_clearance_m")).reduce(f64::min);
        assert_eq!(least, document["min_clearance_m"].as_f64());
        assert_eq!(document["before"]["collision_free"], false);
        assert_eq!(document["collision_free"], true);
    }

    #[test]
    fn inserted_items_and_waypoints_are_those_of_the_mission() {
        let (result, document) = plan(BARN);
        let items = document["items_inserted"].as_array().unwrap();
        let waypoints = document["waypoints"].as_array().unwrap();
        assert!(!items.is_empty());
        for item in items {
            let item = &result.mission.items[item.as_u64().unwrap() as usize - 1];
            let place = item.position().unwrap();
            assert!(waypoints.iter().any(|w| w[0] == place.lat() && w[1] == place.lon()));
        }
        assert_eq!(document["legs"][0]["from"], 1);
        assert_eq!(document["legs"][0]["to"], 2);
    }

    #[test]
    fn a_clearance_without_regions_is_null_and_nothing_is_infinite() {
        let options = Options::default();
        let result = samples::planned_without_fences(BARN, &options);
        let document = PlanDocument::planned(&result, &samples::run(&options, &[]));
        let text = serde_json::to_string(&document).unwrap();
        let document: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(document["min_clearance_m"], Value::Null);
        assert_eq!(document["legs"][0]["min_clearance_m"], Value::Null);
        assert_eq!(document["feasible"], true);
        assert!(document["length_m"].as_f64().unwrap() > 0.0);
    }

    #[test]
    fn a_failure_has_all_keys_of_a_plan_and_says_why() {
        let options = Options::default();
        let (verdict, _) = samples::judged(YARD, &options);
        let warnings = ["the file is odd".to_owned()];
        let run = samples::run(&options, &warnings);
        let failed = PlanDocument::failed(&"shut in by the yard", Some(&verdict), &run);
        let failed = serde_json::to_value(failed).unwrap();
        assert_eq!(keys(&failed), keys(&plan(BARN).1));
        assert_eq!(failed["feasible"], false);
        assert_eq!(failed["collision_free"], false);
        assert_eq!(failed["reason"], "shut in by the yard");
        assert_eq!(failed["length_m"], Value::Null);
        assert_eq!(failed["warnings"][0], "the file is odd");
        assert_eq!(failed["legs"][0]["replanned"], false);
        assert_eq!(failed["legs"][0]["min_clearance_m"], 0.0);
    }

    #[test]
    fn a_judgement_names_the_region_in_the_way_of_each_leg() {
        let options = Options::default();
        let (verdict, _) = samples::judged(BARN, &options);
        let check = CheckDocument::new(&verdict, &samples::run(&options, &[]));
        let check = serde_json::to_value(check).unwrap();
        assert_eq!(check["collision_free"], false);
        assert_eq!(check["clear"], false);
        assert_eq!(check["buffer_m"], 5.0);
        assert_eq!(check["legs"][0]["clear"], false);
        assert!(check["legs"][0]["blocker"].as_str().unwrap().contains("polygon 1"));
        assert_eq!(check["legs"][1]["clear"], true);
        assert_eq!(check["legs"][1]["blocker"], Value::Null);
    }
}
