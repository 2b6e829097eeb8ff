//! A whole mission: which legs are not clear, a plan for each of them, the spliced mission, and
//! the judgement of what would really be flown.
//!
//! - [`field`]: frames and airspaces, one for each zone that the mission's legs are in;
//! - [`mod@judge`]: the verdict on any mission, leg by leg;
//! - [`fewer`]: re-planning with a limit on the waypoints;
//! - [`plan`]: re-planning with the judgement of its own result;
//! - [`reason`]: why there is no plan, in words that name regions and legs.
//!
//! Pure: missions and fences in, a mission and its record out. Reading them from a vehicle or a
//! file and writing them back is done elsewhere.

pub mod fewer;
pub mod field;
pub mod judge;
pub mod plan;
pub mod reason;

use std::time::Duration;

use crate::airspace::InclusionRule;
use crate::fence::FenceSet;
use crate::geodesy::{LatLon, Zone};
use crate::mission::{Autopilot, FlightContext, LoiterHabit, Mission};
use crate::planner::Settings;

pub use fewer::{replan, replan_with};
pub use field::{Field, FieldError};
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
    fn context(&self) -> FlightContext<'a> {
        FlightContext {
            start: self.start,
            rally: self.rally,
            autopilot: self.autopilot,
            loiter: LoiterHabit::default(),
        }
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
}
