//! One leg from end to end: candidates, rounds, finish, and the reasons where there is no plan.

use std::time::{Duration, Instant};

use super::candidates::{Candidate, candidates};
use super::finish::{FinishError, Finished, finished, with_few_corners};
use super::leg_space::LegSpace;
use super::polyline::distance;
use super::round::Round;
use super::rounds::{Contest, Contested, RoundError};
use super::settings::Settings;
use super::trellis::EdgeJudge;
use crate::airspace::RegionId;
use crate::geodesy::{LatLon, LocalFrame, ProjectionError, Xy};
use crate::qaoa::Qaoa;
use crate::qaoa::qpu::Qpu;
use crate::stop::{Stop, Stopped};

/// A leg to plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegRequest {
    /// Where it starts.
    pub from: LatLon,
    /// Where it ends.
    pub to: LatLon,
    /// How far the vehicle may be from `from` when it sets out (a circle that it flies), metres.
    pub from_reach: f64,
    /// How far it may be from `to` when it arrives, metres.
    pub to_reach: f64,
}

/// A planned leg, in the local frame where not said otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct LegPlan {
    /// The waypoints to insert, and the whole path.
    pub finished: Finished,
    /// What was compared: the first is where the rounds started from.
    pub candidates: Vec<Candidate>,
    /// The QAOA rounds.
    pub rounds: Vec<Round>,
    /// Whether the deadline passed before these had brought all that they could.
    pub cut_short: bool,
    /// What ran instead of the QPU that was asked for, and why.
    pub fallback: Option<String>,
    /// How long it took.
    pub times: LegTimes,
}

/// Where the time of a leg went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LegTimes {
    /// Looking for candidates.
    pub candidates: Duration,
    /// QAOA rounds, the judging of their edges included.
    pub qaoa: Duration,
    /// Finish.
    pub finish: Duration,
}

/// What became of a leg.
#[derive(Debug, Clone, PartialEq)]
pub enum LegOutcome {
    /// The straight line is clear: nothing to do.
    Clear,
    /// There is a new path.
    Replanned(Box<LegPlan>),
}

/// Why there is no path.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The start or the goal itself is too near to a region.
    #[error("an end of the leg is too near to a region")]
    EndNotClear {
        /// Whether it is the goal.
        goal: bool,
        /// The region.
        region: RegionId,
        /// The distance to its edge, local metres; 0 inside.
        clearance: f64,
        /// What would be needed, local metres.
        margin: f64,
    },
    /// Proven: start and goal are not connected.
    #[error("no way exists")]
    Infeasible {
        /// Whether the goal is shut in (else the start).
        goal: bool,
        /// What shuts it in.
        regions: Vec<RegionId>,
    },
    /// No clear path was found, and no proof that there is none.
    #[error("no clear path was found")]
    NotFound {
        /// What was in the way last.
        region: Option<RegionId>,
    },
    /// Called off, or the time was up before any clear path was found.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// QAOA failed.
    #[error(transparent)]
    Round(RoundError),
    /// A position cannot be projected.
    #[error(transparent)]
    Projection(#[from] ProjectionError),
}

impl From<RoundError> for PlanError {
    fn from(error: RoundError) -> Self {
        match error {
            RoundError::Stopped(reason) => Self::Stopped(reason),
            error => Self::Round(error),
        }
    }
}

/// Plans legs; keeps the QAOA engines from leg to leg.
#[derive(Debug)]
pub struct LegPlanner {
    settings: Settings,
    qaoa: Qaoa,
}

impl LegPlanner {
    /// A planner with its settings.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        let qaoa = Qaoa::new(settings.memory_limit);
        Self { settings, qaoa }
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Plans one leg. `watch` is called after each round. The rounds get one of `parts` equal
    /// parts of the time that `stop` leaves them: as many as there are legs still to be planned. They are
    /// run on `qpu`, if there is one.
    /// When that is over, the best clear path until then is the plan.
    ///
    /// # Errors
    /// [`PlanError`] with the reason where there is no path.
    pub fn plan(
        &mut self,
        request: &LegRequest,
        frame: &LocalFrame,
        space: &LegSpace<'_>,
        stop: &Stop,
        parts: usize,
        watch: impl FnMut(&Round),
    ) -> Result<LegOutcome, PlanError> {
        self.plan_with(request, frame, space, (stop, parts), None, watch)
    }

    /// [`LegPlanner::plan`] with the rounds on a QPU, if there is one.
    ///
    /// # Errors
    /// [`PlanError`] with the reason where there is no path.
    pub fn plan_with(
        &mut self,
        request: &LegRequest,
        frame: &LocalFrame,
        space: &LegSpace<'_>,
        (stop, parts): (&Stop, usize),
        qpu: Option<&mut dyn Qpu>,
        watch: impl FnMut(&Round),
    ) -> Result<LegOutcome, PlanError> {
        let (start, goal) = (frame.to_local(request.from)?, frame.to_local(request.to)?);
        end_is_clear(space, start, request.from_reach, false)?;
        end_is_clear(space, goal, request.to_reach, true)?;
        let reach = request.from_reach.max(request.to_reach);
        let straight = distance(start, goal);
        let needed = space.margin() + space.flown_deviation(straight) + reach;
        if space.airspace().is_clear(start, goal, needed) {
            return Ok(LegOutcome::Clear);
        }

        let space = &space.with_edges_up_to(straight);
        let began = Instant::now();
        let found = candidates(space, start, goal, &self.settings, stop)
            .map_err(|proof| PlanError::Infeasible { goal: proof.goal, regions: proof.regions })?;
        let mut times = LegTimes { candidates: began.elapsed(), ..LegTimes::default() };
        if !found.iter().any(|candidate| candidate.clear) {
            stop.check()?;
        }

        let began = Instant::now();
        let judge = EdgeJudge {
            space: *space,
            lambda: self.settings.lambda.0,
            safety_margin: self.settings.buffer.0.max(0.1),
        };
        let share = stop.share(parts);
        let contest = Contest::new(&found[0], judge, &self.settings, &mut self.qaoa, &share);
        let contested = match qpu {
            Some(qpu) => contest.run_on_qpu(qpu, &found[1..], watch)?,
            None => contest.run(&found[1..], watch)?,
        };
        let Contested { path, rounds, cut_short, fallback } = contested;
        times.qaoa = began.elapsed();

        let began = Instant::now();
        let path = with_few_corners(&path, space, self.settings.corner_allowance);
        let finished = finished(&path, (request.from, request.to), frame, space).map_err(
            |error| match error {
                FinishError::NotClear(_) if cut_short => Stopped::DeadlinePassed.into(),
                FinishError::NotClear(region) => PlanError::NotFound { region: Some(region) },
                FinishError::Projection(cause) => cause.into(),
            },
        )?;
        reaches_are_clear(request, space, &finished.points)?;
        times.finish = began.elapsed();
        let plan = LegPlan { finished, candidates: found, rounds, cut_short, fallback, times };
        Ok(LegOutcome::Replanned(Box::new(plan)))
    }
}

/// Whether an end, with the circle flown around it, keeps the margin.
fn end_is_clear(space: &LegSpace<'_>, end: Xy, reach: f64, goal: bool) -> Result<(), PlanError> {
    let margin = space.margin() + reach;
    match space.airspace().nearest(end, end, margin) {
        None => Ok(()),
        Some((clearance, region)) => {
            Err(PlanError::EndNotClear { goal, region, clearance, margin })
        }
    }
}

/// The first and the last edge are flown from and to anywhere on the circles at the ends.
fn reaches_are_clear(
    request: &LegRequest,
    space: &LegSpace<'_>,
    points: &[Xy],
) -> Result<(), PlanError> {
    let n = points.len();
    let ends = [
        (request.from_reach, points[0], points[1]),
        (request.to_reach, points[n - 2], points[n - 1]),
    ];
    for (reach, a, b) in ends.into_iter().filter(|(reach, ..)| *reach > 0.0) {
        if let Some(region) = space.airspace().blocker(a, b, space.margin() + reach) {
            return Err(PlanError::NotFound { region: Some(region) });
        }
    }
    Ok(())
}
