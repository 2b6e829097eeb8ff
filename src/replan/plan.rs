//! Re-planning: the legs that are not clear get waypoints, the result is judged again.

use std::collections::BTreeSet;
use std::fmt;

use super::field::{Field, Fields};
use super::judge::{LegVerdict, Verdict, can_be_replanned, judge, verdict};
use super::reason::ReplanError;
use super::{Input, Options};
use crate::geodesy::{LatLonE7, Xy, Zone};
use crate::mission::legs::{LegKind, LegShape};
use crate::mission::splice::SpliceNote;
use crate::mission::{Detour, Leg, Mission, legs, splice};
use crate::planner::candidates::Candidate;
use crate::planner::leg::{LegRequest, LegTimes};
use crate::planner::round::Round;
use crate::planner::{LegOutcome, LegPlan, LegPlanner};
use crate::qaoa::qpu::{Qpu, QpuUse};
use crate::stop::Stop;

/// What happens while a mission is planned.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Which of the legs to re-plan, from 1.
    pub leg: usize,
    /// How many there are.
    pub legs: usize,
    /// The leg's name.
    pub name: &'a str,
    /// How far it is.
    pub stage: Stage<'a>,
}

/// How far a leg is.
#[derive(Debug, Clone, Copy)]
pub enum Stage<'a> {
    /// Candidates are being looked for.
    Candidates,
    /// A QAOA round has ended.
    Round {
        /// Its number, from 1.
        number: usize,
        /// Its record.
        round: &'a Round,
    },
    /// The leg has its path.
    Planned,
}

impl fmt::Display for Progress<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { leg, legs, name, stage } = self;
        write!(f, "leg {leg}/{legs} ({name}): ")?;
        match stage {
            Stage::Candidates => f.write_str("looking for candidates"),
            Stage::Round { number, round } => {
                let loss = round.loss.last().copied().unwrap_or(f64::NAN);
                write!(f, "round {number}, loss {loss:.1}, length {:.1} m", round.length)
            }
            Stage::Planned => f.write_str("planned"),
        }
    }
}

/// A leg that was re-planned. Points are in the local metres of its zone.
#[derive(Debug, Clone, PartialEq)]
pub struct LegRecord {
    /// The leg of the original mission.
    pub leg: Leg,
    /// The zone it was planned in.
    pub zone: Zone,
    /// The inserted waypoints.
    pub waypoints: Vec<LatLonE7>,
    /// The path with its ends.
    pub points: Vec<Xy>,
    /// The candidates, the first incumbent first.
    pub candidates: Vec<Candidate>,
    /// The QAOA rounds.
    pub rounds: Vec<Round>,
    /// Whether the deadline passed before these had brought all that they could.
    pub cut_short: bool,
    /// What ran instead of the QPU that was asked for, and why.
    pub fallback: Option<String>,
    /// Where the time went.
    pub times: LegTimes,
}

/// The outcome of planning a mission.
#[derive(Debug, Clone, PartialEq)]
pub struct Replanned {
    /// The mission to fly; the original where nothing had to be changed.
    pub mission: Mission,
    /// Indices of the inserted items in it.
    pub inserted: Vec<usize>,
    /// What now happens differently besides the path.
    pub notes: Vec<SpliceNote>,
    /// The verdict on the original.
    pub before: Verdict,
    /// The verdict on [`Replanned::mission`], from the integers that are flown: always clear.
    pub after: Verdict,
    /// The legs that were re-planned.
    pub legs: Vec<LegRecord>,
    /// The zones, for pictures.
    pub fields: Vec<Field>,
    /// What was used of a QPU, where one was asked for.
    pub qpu: Option<QpuUse>,
}

impl Replanned {
    /// Whether anything was changed.
    #[must_use]
    pub fn is_changed(&self) -> bool {
        !self.inserted.is_empty()
    }

    /// What was used instead of what was asked for, and why; `None` where nothing was.
    #[must_use]
    pub fn fallback(&self) -> Option<String> {
        let cut: Vec<String> = self
            .legs
            .iter()
            .filter(|record| record.cut_short)
            .map(|record| {
                let (name, rounds) = (record.leg.name(), record.rounds.len());
                let plural = if rounds == 1 { "" } else { "s" };
                format!("the {name} has the best clear path after {rounds} QAOA round{plural}")
            })
            .collect();
        let cut = (!cut.is_empty()).then(|| format!("the deadline passed: {}", cut.join("; ")));
        let mut fallbacks: Vec<String> = self
            .legs
            .iter()
            .filter_map(|record| {
                let fallback = record.fallback.as_ref()?;
                Some(format!("the {} was planned by {fallback}", record.leg.name()))
            })
            .collect();
        fallbacks.extend(cut);
        (!fallbacks.is_empty()).then(|| fallbacks.join("; "))
    }
}

/// Plans a mission as its settings say, with as many waypoints as that takes.
///
/// # Errors
/// [`ReplanError`] with the reason where there is no safe mission.
pub(super) fn replan_as_set(
    input: &Input<'_>,
    options: &Options,
    mut qpu: Option<&mut dyn Qpu>,
    stop: &Stop,
    watch: &mut impl FnMut(Progress<'_>),
) -> Result<Replanned, ReplanError> {
    let flown = legs(input.mission, &input.context(options.loiter))?;
    let fields = Fields::new(&flown.legs, input, options)?;
    let before = verdict(&flown, &fields, options)?;
    let blocked = legs_to_replan(&before)?;

    let mut planner = LegPlanner::new(options.settings.clone());
    let mut records = Vec::new();
    let mut detours = Vec::new();
    for (k, &index) in blocked.iter().enumerate() {
        let leg = &flown.legs[index];
        let name = leg.name().to_string();
        let legs = blocked.len();
        let mut tell = |stage: Stage<'_>| watch(Progress { leg: k + 1, legs, name: &name, stage });
        tell(Stage::Candidates);
        let view = fields
            .of(leg)
            .ok_or_else(|| ReplanError::unjudged(leg, "its zone was not prepared"))?;
        let request = LegRequest {
            from: leg.from.position,
            to: leg.to.position,
            from_reach: leg.from.circle.0 * view.spread,
            to_reach: leg.to.circle.0 * view.spread,
        };
        let space = view.leg_space(options.settings.buffer.0, request.from, request.to);
        let mut number = 0;
        let outcome = planner
            .plan_with(
                &request,
                view.frame,
                &space,
                (stop, legs - k),
                // A reborrow that ends with the leg.
                match &mut qpu {
                    Some(qpu) => Some(&mut **qpu),
                    None => None,
                },
                |round| {
                    number += 1;
                    tell(Stage::Round { number, round });
                },
            )
            .map_err(|error| {
                ReplanError::from_plan(error, leg, &|region| fields.name(region).to_owned())
            })?;
        tell(Stage::Planned);
        if let LegOutcome::Replanned(plan) = outcome {
            let LegPlan { finished, candidates, rounds, cut_short, fallback, times } = *plan;
            detours.push(Detour { leg: index, waypoints: finished.waypoints.clone() });
            records.push(LegRecord {
                leg: *leg,
                zone: view.zone,
                waypoints: finished.waypoints,
                points: finished.points,
                candidates,
                rounds,
                cut_short,
                fallback,
                times,
            });
        }
    }

    let spliced = splice(input.mission, &flown.legs, &detours)?;
    let after = judge(&input.with_mission(&spliced.mission), options)?;
    if let Some(bad) = after.legs.iter().find(|leg| !leg.is_clear()) {
        return Err(not_verified(bad));
    }
    Ok(Replanned {
        mission: spliced.mission,
        inserted: spliced.inserted,
        notes: spliced.notes,
        before,
        after,
        legs: records,
        fields: fields.pictured(options.settings.buffer.0),
        qpu: qpu.map(|qpu| qpu.used()),
    })
}

/// Why a leg cannot be re-planned, and what to do.
fn why_fixed(leg: &Leg) -> &'static str {
    match (leg.kind, leg.shape) {
        (_, LegShape::Curved { .. }) => {
            "waypoints would bend the curve; make its end a plain waypoint (NAV_WAYPOINT), which can \
             be re-planned, or move it"
        }
        (LegKind::Stay, _) => "it is no stretch that could go round it; move it, or the fence",
        (LegKind::Takeoff, _) => "nothing can be flown before a takeoff; move it, or the fence",
        _ if leg.jump.is_some() => {
            "waypoints for a jump would be flown without it, too; let the jump go to waypoints that \
             lead round it, or move its ends or the fence"
        }
        _ => "no waypoint can be put into it; move its ends or the fence",
    }
}

/// Why the new mission does not pass.
fn not_verified(bad: &LegVerdict) -> ReplanError {
    let leg = bad.leg.name().to_string();
    let region = bad.blocker.as_ref().map_or_else(String::new, |(region, _)| region.clone());
    match (&bad.limit, bad.leg.shape) {
        (Some(finding), _) => ReplanError::Altitude { leg, why: finding.to_string() },
        // Its curve depends on the legs before and after it.
        (None, LegShape::Curved { .. }) => {
            let why = "waypoints in the leg before or after it bend it that way; make it straight \
                       (NAV_WAYPOINT), or move it";
            ReplanError::Fixed { leg, region, why: why.to_owned() }
        }
        // Several jumps to one place, or jumps behind each other.
        _ if bad.leg.jump.is_some() => {
            let why = why_fixed(&bad.leg).to_owned();
            ReplanError::Fixed { leg, region, why }
        }
        _ => ReplanError::NotVerified { leg, region },
    }
}

/// The legs that are not clear, in order; one of those that share their waypoints.
fn legs_to_replan(before: &Verdict) -> Result<Vec<usize>, ReplanError> {
    let mut taken = BTreeSet::new();
    let mut blocked = Vec::new();
    for (index, verdict) in before.legs.iter().enumerate() {
        if let Some(finding) = &verdict.limit {
            let leg = verdict.leg.name().to_string();
            return Err(ReplanError::Altitude { leg, why: finding.to_string() });
        }
        let Some((region, _)) = &verdict.blocker else { continue };
        if !can_be_replanned(&verdict.leg) {
            let why = why_fixed(&verdict.leg).to_owned();
            let (leg, region) = (verdict.leg.name().to_string(), region.clone());
            return Err(ReplanError::Fixed { leg, region, why });
        }
        // The others that share the waypoints are decided by the judgement of the result.
        let leg = &verdict.leg;
        if taken.insert((leg.insert_before, leg.by_jump.map(|by| by.target))) {
            blocked.push(index);
        }
    }
    Ok(blocked)
}
