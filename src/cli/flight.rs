//! Planning for a vehicle in flight: only the rest of its mission is planned, from where it is.

use super::CliError;
use super::reading::Read;
use crate::geodesy::LatLon;
use crate::mission::{Command, Frame, Mission, MissionItem, rejoined, remaining};
use crate::replan::judge::{LegVerdict, judge};
use crate::replan::{Input, Options, Replanned};
use crate::vehicle::numbering::to_mission;
use crate::vehicle::{Autopilot, Vehicle, VehicleState};

/// A mission that is being flown.
pub(crate) struct Flight {
    /// All of it, in quavd's numbering.
    whole: Mission,
    /// Index of the item that the vehicle flies to.
    current: usize,
    /// Where the vehicle is.
    pub(super) position: LatLon,
    /// A waypoint where the vehicle is, and the items from the current one on, as a mission.
    pub(super) rest: Mission,
}

/// Index in [`Flight::rest`] of the item that the vehicle flies to.
const NEXT: usize = 1;

impl Flight {
    /// # Errors
    /// [`CliError::Refused`] where the vehicle does not say where it is and what it flies to, or
    /// the rest of the mission does not stand for itself.
    pub(super) fn of(
        state: &VehicleState,
        autopilot: Autopilot,
        whole: Mission,
    ) -> Result<Self, CliError> {
        let unknown = |what: &str| {
            CliError::Refused(format!(
                "the vehicle is in flight and does not tell {what}; nothing was written"
            ))
        };
        let here = state.position.ok_or_else(|| unknown("where it is"))?;
        let position = here.position;
        let current = state.mission_current.ok_or_else(|| unknown("which item it flies to"))?;
        let home_slots = usize::from(autopilot == Autopilot::ArduPilot);
        let current = usize::from(current.seq).saturating_sub(home_slots);
        let rest = remaining(&whole, current).map_err(|error| {
            CliError::Refused(format!("the mission cannot be planned in flight: {error}"))
        })?;
        let place = position.to_e7();
        let here = MissionItem {
            seq: 0,
            frame: Frame::GLOBAL_RELATIVE_ALT,
            command: Command::NAV_WAYPOINT,
            current: 0,
            autocontinue: 1,
            params: [0.0; 4],
            x: place.lat,
            y: place.lon,
            z: here.altitude_relative,
        };
        let rest = rejoined(&Mission { home: whole.home, items: vec![here] }, NEXT, &rest);
        Ok(Self { whole, current, position, rest })
    }

    /// The whole mission with a planned rest.
    ///
    /// # Errors
    /// [`CliError::NoPath`] where the vehicle would have to go another way to the item it flies
    /// to: that item is not changed under way.
    pub(crate) fn with(&self, planned: &Replanned) -> Result<Mission, CliError> {
        if planned.inserted.first() == Some(&NEXT) {
            return Err(self.not_clear());
        }
        let rest = remaining(&planned.mission, NEXT).map_err(|error| {
            CliError::Refused(format!("the planned mission is not complete: {error}"))
        })?;
        Ok(rejoined(&self.whole, self.current, &rest))
    }

    fn not_clear(&self) -> CliError {
        let reason = format!(
            "the way from where the vehicle is to item {} is not clear, and the current item is not \
             changed in flight; stop the vehicle and plan on the ground",
            self.current + 1
        );
        CliError::NoPath { reason, document: None }
    }
}

/// Whether the way from where the vehicle is by now to the item that it flies to is clear, where
/// it holds `list`: planning and uploading take time, in which it moves.
///
/// # Errors
/// [`CliError::NoPath`] where it is not, [`CliError::Refused`] where that cannot be told.
pub(crate) fn way_is_clear(
    vehicle: &Vehicle,
    read: &Read,
    list: &[MissionItem],
    options: &Options,
) -> Result<(), CliError> {
    let state = vehicle.state();
    let autopilot = vehicle.autopilot();
    let flight = Flight::of(&state, autopilot, to_mission(autopilot, list, state.home))?;
    let input = Input {
        mission: &flight.rest,
        fences: &read.scenario.fences,
        rally: &read.rally,
        start: Some(flight.position),
        autopilot: read.autopilot,
    };
    // PROJ blocks, for some milliseconds.
    let verdict = tokio::task::block_in_place(|| judge(&input, options))?;
    let mut way = verdict.legs.iter().filter(|it| it.leg.to.item == Some(NEXT));
    if way.all(LegVerdict::is_clear) { Ok(()) } else { Err(flight.not_clear()) }
}
