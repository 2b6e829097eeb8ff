//! A whole mission: which legs are not clear, a plan for each of them, the spliced mission, and
//! the judgement of what would really be flown.
//!
//! - [`altitudes`]: what the altitudes of the legs decide: what is flown over, which limits hold;
//! - [`field`]: frames and airspaces, one for each zone that the mission's legs are in;
//! - [`mod@judge`]: the verdict on any mission, leg by leg;
//! - [`fewer`]: re-planning with a limit on the waypoints;
//! - [`plan`]: re-planning with the judgement of its own result;
//! - [`reason`]: why there is no plan, in words that name regions and legs.
//!
//! Pure: missions and fences in, a mission and its record out. Reading them from a vehicle or a
//! file and writing them back is done elsewhere.

pub mod altitudes;
pub mod fewer;
pub mod field;
pub mod judge;
pub mod plan;
pub mod reason;

use std::time::Duration;

use crate::fence::{FenceSet, InclusionRule, VehicleRules};
use crate::geodesy::{LatLon, Zone};
use crate::mission::{Autopilot, FlightContext, LoiterHabit, Mission};
use crate::planner::Settings;

pub use altitudes::Vertical;
pub use fewer::{replan, replan_with};
pub use field::{Field, FieldError, cleared};
pub use judge::{LegVerdict, Verdict, fields, judge};
pub use plan::{LegRecord, Progress, Replanned, Stage};
pub use reason::ReplanError;

/// What a mission is judged or planned with.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// The mission.
    pub mission: &'a Mission,
    /// The fences that apply.
    pub fences: &'a FenceSet,
    /// The rally points, any of which a return may go to.
    pub rally: &'a [LatLon],
    /// Where the vehicle stands, where that is known.
    pub start: Option<LatLon>,
    /// The autopilot that flies it.
    pub autopilot: Autopilot,
}

impl<'a> Input<'a> {
    fn context(&self, loiter: LoiterHabit) -> FlightContext<'a> {
        FlightContext { start: self.start, rally: self.rally, autopilot: self.autopilot, loiter }
    }

    /// The same with another mission.
    fn with_mission<'b>(&self, mission: &'b Mission) -> Input<'b>
    where
        'a: 'b,
    {
        Input { mission, ..*self }
    }
}

/// How missions are judged and planned.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// The planner's settings; their buffer is what a mission is judged by.
    pub settings: Settings,
    /// The zone of all legs; `None`: each leg's own.
    pub zone: Option<Zone>,
    /// What several inclusions mean together.
    pub inclusion: InclusionRule,
    /// Most waypoints to insert, in all.
    pub most_waypoints: Option<usize>,
    /// How long planning may take; when that is over, the best clear path until then is used.
    pub deadline: Option<Duration>,
    /// How heights are compared with altitudes.
    pub vertical: Vertical,
    /// What the vehicle's parameters say; empty without a vehicle.
    pub rules: VehicleRules,
    /// How the vehicle loiters.
    pub loiter: LoiterHabit,
}

impl Options {
    /// The same for a vehicle with these rules. `inclusion` is what was asked for, where anything
    /// was: it counts more than the vehicle's. The buffer is at least the vehicle's own margin.
    #[must_use]
    pub fn with_rules(
        mut self,
        rules: VehicleRules,
        inclusion: Option<InclusionRule>,
        loiter: LoiterHabit,
    ) -> Self {
        self.inclusion = inclusion.or(rules.inclusion).unwrap_or_default();
        let buffer = self.settings.buffer;
        self.rules = rules;
        self.loiter = loiter;
        if let Some(margin) = self.rules.margin.filter(|margin| *margin > buffer) {
            self.settings.buffer = margin;
            self.rules.applied.push(format!(
                "the vehicle's FENCE_MARGIN of {} m is kept instead of the smaller buffer of {} m",
                margin.0, buffer.0
            ));
        }
        self
    }
}
