//! What is read from a vehicle before planning: its plans, its parameters, its place. Not the
//! planning, and nothing that writes.

use std::time::Duration;

use super::CliError;
use super::files;
use super::options::PlanningArgs;
use super::progress::Shown;
use crate::fence::VehicleRules;
use crate::fence::items::decode_fence;
use crate::formats::Scenario;
use crate::geodesy::LatLon;
use crate::mission::{self, LoiterHabit, MissionItem, MissionType};
use crate::replan::Options;
use crate::store::Store;
use crate::vehicle::download::Downloaded;
use crate::vehicle::numbering::to_mission;
use crate::vehicle::replace::pilots_own;
use crate::vehicle::{TransferError, Vehicle};

/// How long to wait for the vehicle's home and position.
const PLACE_PATIENCE: Duration = Duration::from_secs(5);

/// What was read from a vehicle.
pub(crate) struct Read {
    /// The pilot's mission, the fences with those of the command line, the rally points.
    pub(crate) scenario: Scenario,
    /// The mission list that the vehicle holds, in its numbering.
    pub(crate) held: Vec<MissionItem>,
    /// The pilot's own mission list: what is held, or what quavd's last upload was made from.
    pub(crate) original: Vec<MissionItem>,
    pub(crate) start: Option<LatLon>,
    pub(crate) rally: Vec<LatLon>,
    pub(crate) autopilot: mission::Autopilot,
    /// What the vehicle's parameters say about its fence.
    rules: VehicleRules,
    loiter: LoiterHabit,
}

impl Read {
    /// The options for planning for this vehicle.
    pub(crate) fn options(&self, planning: &PlanningArgs) -> Options {
        let inclusion = planning.safety.inclusion.0;
        planning.options().with_rules(self.rules.clone(), inclusion, self.loiter)
    }
}

/// The three plans of a vehicle, as downloaded.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Held {
    pub(crate) mission: Vec<MissionItem>,
    pub(crate) fence: Vec<MissionItem>,
    pub(crate) rally: Vec<MissionItem>,
    /// Which of them came in another way than was tried first, and why.
    pub(crate) fell_back: Vec<String>,
}

impl Held {
    /// Downloads all three.
    pub(crate) async fn download(vehicle: &Vehicle, shown: &Shown) -> Result<Self, TransferError> {
        let mut on_progress = |progress| shown.transfer(progress);
        let mission = vehicle.read_plan(MissionType::Mission, &mut on_progress).await?;
        let fence = vehicle.read_plan(MissionType::Fence, &mut on_progress).await?;
        let rally = vehicle.read_plan(MissionType::Rally, &mut on_progress).await?;
        let fell_back = [&mission, &fence, &rally].into_iter().filter_map(Downloaded::fell_back);
        Ok(Self {
            fell_back: fell_back.collect(),
            mission: mission.items,
            fence: fence.items,
            rally: rally.items,
        })
    }
}

/// What the plans of a vehicle mean, with what else planning starts from.
pub(crate) async fn read(
    vehicle: &Vehicle,
    store: &Store,
    planning: &PlanningArgs,
    held: Held,
    shown: &Shown,
) -> Result<Read, CliError> {
    shown.doing("waiting for the vehicle's home and position");
    let known =
        |state: &crate::vehicle::VehicleState| state.home.is_some() && state.position.is_some();
    let _ = vehicle.wait_for(PLACE_PATIENCE, known).await;
    let state = vehicle.state();

    let Held { mission: held, fence, rally, fell_back } = held;
    let original = pilots_own(vehicle, store, MissionType::Mission, &held).await?;
    let mission = to_mission(vehicle.autopilot(), &original, state.home);
    let decoded = decode_fence(&fence, None)?;
    let (mut fences, mut warnings) = (decoded.fences, fell_back);
    warnings.extend(decoded.warnings);
    shown.doing("reading the vehicle's parameters");
    let (rules, loiter) = vehicle.rules().await?;
    if planning.safety.ignore_disabled_fence {
        warnings.extend(rules.leave_out_disabled(&mut fences));
    }
    warnings.extend(rules.odd_inclusions(&fences, mission.home.map(|home| home.position)));
    files::add_fences(&mut fences, &mut warnings, &planning.safety)?;
    let places = rally_places(&rally)?;
    // The vehicle stands at home before it takes off; in flight its own place counts.
    let start = state.position.map(|at| at.position).or(mission.home.map(|home| home.position));
    let scenario = Scenario { mission, fences, rally, warnings, ..Scenario::default() };
    let autopilot = vehicle.autopilot().into();
    Ok(Read { scenario, held, original, start, rally: places, autopilot, rules, loiter })
}

/// The places of rally points.
///
/// # Errors
/// [`CliError::Usage`] naming the point that is no place.
pub(super) fn rally_places(rally: &[MissionItem]) -> Result<Vec<LatLon>, CliError> {
    rally
        .iter()
        .filter(|item| item.command == mission::Command::NAV_RALLY_POINT)
        .map(|item| {
            let number = item.seq + 1;
            if !item.frame.is_global() {
                return Err(CliError::Usage(format!(
                    "rally point {number} is in frame {}, which has no latitude and longitude; set \
                     it anew with a ground station",
                    item.frame.0
                )));
            }
            item.position()
                .map_err(|error| CliError::Usage(format!("rally point {number}: {error}")))
        })
        .collect()
}
