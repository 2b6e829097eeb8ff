//! Re-planning: the legs that are not clear get waypoints, the result is judged again.

use std::collections::BTreeSet;
use std::fmt;

use super::field::{Field, Fields};
use super::judge::{Verdict, can_be_replanned, judge, verdict};
use super::reason::ReplanError;
use super::{Input, Options};
use crate::geodesy::{LatLonE7, Xy, Zone};
use crate::mission::splice::SpliceNote;
use crate::mission::{Detour, Leg, Mission, legs, splice};
use crate::planner::candidates::Candidate;
use crate::planner::leg::{LegRequest, LegTimes};
use crate::planner::rounds::Round;
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
    let flown = legs(input.mission, &input.context())?;
    let fields = Fields::new(&flown.legs, input.fences, options)?;
    let before = verdict(&flown, &fields, input, options)?;
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
        let (zone, zoned) = fields
            .of(leg.from.position, leg.to.position)
            .ok_or_else(|| ReplanError::unjudged(leg, "its zone was not prepared"))?;
        let request = LegRequest {
            from: leg.from.position,
            to: leg.to.position,
            from_reach: leg.from.circle.0 * zoned.spread,
            to_reach: leg.to.circle.0 * zoned.spread,
        };
        let space = zoned.leg_space(options.settings.buffer.0, request.from, request.to);
        let mut number = 0;
        let outcome = planner
            .plan_with(
                &request,
                &zoned.frame,
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
            .map_err(|error| ReplanError::from_plan(error, leg, input.fences))?;
        tell(Stage::Planned);
        if let LegOutcome::Replanned(plan) = outcome {
            let LegPlan { finished, candidates, rounds, cut_short, fallback, times } = *plan;
            detours.push(Detour { leg: index, waypoints: finished.waypoints.clone() });
            records.push(LegRecord {
                leg: *leg,
                zone,
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
    if let Some(bad) = after.legs.iter().find(|leg| leg.blocker.is_some()) {
        let region = bad.blocker.as_ref().map_or_else(String::new, |(region, _)| region.clone());
        return Err(ReplanError::NotVerified { leg: bad.leg.name().to_string(), region });
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

/// The legs that are not clear, in order; one of those that share their waypoints.
fn legs_to_replan(before: &Verdict) -> Result<Vec<usize>, ReplanError> {
    let mut taken = BTreeSet::new();
    let mut blocked = Vec::new();
    for (index, verdict) in before.legs.iter().enumerate() {
        let Some((region, _)) = &verdict.blocker else { continue };
        if !can_be_replanned(&verdict.leg) {
            let why = "no waypoint can be put into it; move its ends or the fence".to_owned();
            let (leg, region) = (verdict.leg.name().to_string(), region.clone());
            return Err(ReplanError::Fixed { leg, region, why });
        }
        // The others that share the waypoints are decided by the judgement of the result.
        if taken.insert(verdict.leg.insert_before) {
            blocked.push(index);
        }
    }
    Ok(blocked)
}
