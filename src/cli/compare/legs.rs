//! The legs of a scenario that need planning, each with an airspace of its own to plan in.

use std::collections::BTreeSet;

use crate::airspace::Airspace;
use crate::cli::CliError;
use crate::cli::plan::position_of_start;
use crate::cli::reading::rally_places;
use crate::formats::Scenario;
use crate::geodesy::{LatLon, LocalFrame, ProjectionError, Xy, Zone, geodesic_distance};
use crate::mission::legs::{LegKind, LegShape};
use crate::planner::leg_space::LegSpace;
use crate::replan::{FieldError, Input, LegVerdict, Options, ReplanError, cleared, judge};
use crate::units::Metres;

/// A leg to plan, from place to place: circles that are flown at its ends are no part of the
/// comparison.
#[derive(Debug)]
pub struct LegTask {
    /// Where it starts.
    pub from: LatLon,
    /// Where it ends.
    pub to: LatLon,
    /// The same in the frame.
    pub ends: (Xy, Xy),
    /// The frame that all methods plan in.
    pub frame: LocalFrame,
    /// The obstacles near its straight line that it is flown over or under.
    pub passed: Vec<String>,
    /// Without all that it is flown over or under.
    airspace: Airspace,
    /// Local metres per ground metre at the most.
    spread: f64,
}

impl LegTask {
    fn new(
        verdict: &LegVerdict,
        input: &Input<'_>,
        options: &Options,
    ) -> Result<Self, ReplanError> {
        let (from, to) = (verdict.leg.from.position, verdict.leg.to.position);
        let zone = options.zone.unwrap_or_else(|| Zone::of_leg(from, to));
        let frame = LocalFrame::new(zone, from)?;
        let airspace = Airspace::new(input.fences, &frame, options.inclusion)
            .map_err(FieldError::from)?
            .without(&cleared(&verdict.leg, input, options)?);
        let spread = frame.scale_spread([&from, &to])?;
        let ends = (frame.to_local(from)?, frame.to_local(to)?);
        Ok(Self { from, to, ends, frame, passed: verdict.passed.clone(), airspace, spread })
    }

    /// The airspace with a buffer in ground metres.
    #[must_use]
    pub fn space(&self, buffer: Metres) -> LegSpace<'_> {
        let latitude = self.from.lat().abs().max(self.to.lat().abs());
        LegSpace::new(&self.airspace, buffer.0 * self.spread, latitude)
    }

    /// The geodesic from end to end.
    #[must_use]
    pub fn straight(&self) -> Metres {
        geodesic_distance(self.from, self.to)
    }

    /// The length of a path on the ground.
    ///
    /// # Errors
    /// [`ProjectionError`] where a point is no place on the Earth.
    pub fn length(&self, path: &[Xy]) -> Result<Metres, ProjectionError> {
        let places: Vec<LatLon> =
            path.iter().map(|&point| self.frame.to_position(point)).collect::<Result<_, _>>()?;
        Ok(places.windows(2).map(|edge| geodesic_distance(edge[0], edge[1])).sum())
    }

    /// The clearance of an edge on the ground, never more than the truth.
    #[must_use]
    pub fn clearance(&self, a: Xy, b: Xy) -> Metres {
        Metres(self.airspace.clearance(a, b) / self.spread)
    }
}

/// The legs of a scenario's mission that come too near to something and can be given waypoints,
/// and what was assumed or odd, a sentence each.
///
/// # Errors
/// [`CliError::Usage`] where the mission or a region cannot be used.
pub fn legs_to_plan(
    scenario: &Scenario,
    options: &Options,
) -> Result<(Vec<LegTask>, Vec<String>), CliError> {
    let rally = rally_places(&scenario.rally)?;
    let input = Input {
        mission: &scenario.mission,
        fences: &scenario.fences,
        rally: &rally,
        start: position_of_start(scenario),
        autopilot: scenario.vehicle.autopilot,
    };
    let verdict = judge(&input, options)?;
    let mut seen = BTreeSet::new();
    let tasks: Result<Vec<LegTask>, ReplanError> = verdict
        .legs
        .iter()
        .filter(|verdict| verdict.blocker.is_some())
        .filter(|verdict| verdict.leg.shape == LegShape::Straight)
        .filter(|verdict| matches!(verdict.leg.kind, LegKind::Flown | LegKind::Return(_)))
        .filter(|verdict| verdict.leg.insert_before.is_some_and(|place| seen.insert(place)))
        .map(|verdict| LegTask::new(verdict, &input, options))
        .collect();
    Ok((tasks?, verdict.warnings))
}
