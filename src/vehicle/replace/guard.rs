//! When a vehicle is written to: on the ground, and in flight only where that is safe.
//!
//! PX4 keeps two mission stores and switches at the end of an upload, so that a mission can be
//! changed while it is flown. ArduPilot has one, cut to the new length at once and overwritten item
//! by item: an upload that breaks off leaves a path that nobody has judged, under a vehicle that
//! flies it. It is therefore never written to while it flies its mission; it may be in any other
//! mode, where the mission is what will be flown next.
//!
//! In flight, the items up to and including the current one stay as they are, to the last bit, so
//! that the vehicle goes on with what it does. Whether the way from where it is to that item is
//! clear is for the caller to judge, who has the fences.

use std::time::Duration;

use super::outcome::Obstacle;
use crate::link::message::Heartbeat;
use crate::mission::{MissionItem, MissionType};
use crate::vehicle::readback::changes;
use crate::vehicle::{Autopilot, Vehicle, VehicleState};

/// Whether a vehicle whose motors may turn is written to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WhileArmed {
    /// Never.
    #[default]
    Refuse,
    /// Where it is safe: a mission, after the current item, and with ArduPilot not while the
    /// mission is flown.
    Allow,
}

/// Whether the vehicle is there and, unless allowed, its motors are off, by a heartbeat that is
/// not old.
pub(super) async fn may_write(
    vehicle: &Vehicle,
    while_armed: WhileArmed,
) -> Result<VehicleState, Obstacle> {
    let state = fresh(vehicle).await?;
    if state.is_armed() && while_armed == WhileArmed::Refuse {
        return Err(Obstacle::Armed);
    }
    if is_flying_mission(vehicle.autopilot(), &state) && vehicle.autopilot() != Autopilot::Px4 {
        return Err(Obstacle::FlyingMission);
    }
    Ok(state)
}

/// Whether what quavd itself has just left behind may be overwritten: a vehicle that was armed
/// meanwhile is better off with its old mission than with parts of two, unless it flies them.
pub(super) async fn may_clean_up(
    vehicle: &Vehicle,
    while_armed: WhileArmed,
) -> Result<VehicleState, Obstacle> {
    let state = fresh(vehicle).await?;
    if is_flying_mission(vehicle.autopilot(), &state) {
        return may_write(vehicle, while_armed).await;
    }
    Ok(state)
}

async fn fresh(vehicle: &Vehicle) -> Result<VehicleState, Obstacle> {
    let silence = vehicle.timing.silence;
    let fresh = |state: &VehicleState| state.heartbeat_at.elapsed() <= silence / 2;
    let state = vehicle.wait_for(silence, fresh).await;
    state.ok_or_else(|| Obstacle::Silent { seconds: vehicle.silent_for().as_secs_f64() })
}

/// Whether a mission is being flown. Where it cannot be told, an armed vehicle does.
pub(super) fn is_flying_mission(autopilot: Autopilot, state: &VehicleState) -> bool {
    /// `MISSION_STATE_ACTIVE`.
    const ACTIVE: u8 = 3;
    /// `mission_mode` of MISSION_CURRENT: in the mode that flies the mission.
    const IN_MISSION_MODE: u8 = 1;
    if !state.is_armed() {
        return false;
    }
    let says_so = state
        .mission_current
        .is_some_and(|current| current.state == ACTIVE || current.mode == IN_MISSION_MODE);
    says_so || is_mission_mode(autopilot, &state.heartbeat).unwrap_or(true)
}

/// Whether the flight mode is the one that flies the mission. `None` for a kind of vehicle whose
/// modes are not known.
fn is_mission_mode(autopilot: Autopilot, heartbeat: &Heartbeat) -> Option<bool> {
    /// PX4: main mode AUTO (4) in byte 2, sub mode MISSION (4) in byte 3.
    const PX4_MISSION: u32 = 0x0404_0000;
    match (autopilot, heartbeat.kind) {
        (Autopilot::Px4, _) => Some(heartbeat.custom_mode == PX4_MISSION),
        // Multirotors, helicopters, submarines: AUTO is 3.
        (Autopilot::ArduPilot, 2..=4 | 12..=15 | 29) => Some(heartbeat.custom_mode == 3),
        // Planes, VTOL planes, rovers, boats: AUTO is 10.
        (Autopilot::ArduPilot, 1 | 10 | 11 | 19..=25) => Some(heartbeat.custom_mode == 10),
        _ => None,
    }
}

/// On what terms an upload goes on, item by item.
#[derive(Debug, Clone, Copy)]
pub(super) enum Permit {
    /// The vehicle is disarmed.
    OnTheGround,
    /// It is armed, and as it was when the upload began.
    InFlight(InFlight),
    /// The old plan is put back: whatever happens, that is better than parts of two.
    CleaningUp,
}

impl Permit {
    /// Whether the next item may be sent. An upload to ArduPilot is never called off: its mission
    /// is in parts until the last item is there.
    pub(super) fn goes_on(&self, vehicle: &Vehicle, state: &VehicleState) -> bool {
        let is_atomic = vehicle.autopilot() != Autopilot::ArduPilot;
        match self {
            _ if !is_atomic => true,
            Self::OnTheGround => !state.is_armed(),
            Self::InFlight(flight) => flight.is_as_before(state),
            Self::CleaningUp => true,
        }
    }
}

/// An upload to a vehicle whose motors may turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct InFlight {
    /// The item that is flown to, in the vehicle's numbering.
    current: u16,
}

impl InFlight {
    /// Judges whether `intended` may replace `held` in flight, and marks in it the item that the
    /// vehicle is to go on with, as PX4 wants it. `None` for a vehicle that is disarmed.
    pub(super) fn of(
        vehicle: &Vehicle,
        state: &VehicleState,
        mission_type: MissionType,
        held: &[MissionItem],
        intended: &mut [MissionItem],
    ) -> Result<Option<Self>, Obstacle> {
        if !state.is_armed() {
            return Ok(None);
        }
        if mission_type != MissionType::Mission {
            let why = format!("the {mission_type} would take effect at once");
            return Err(Obstacle::InFlight { why });
        }
        let Some(current) = state.mission_current.map(|current| current.seq) else {
            let why = "it does not say which item it flies to (MISSION_CURRENT)".to_owned();
            return Err(Obstacle::InFlight { why });
        };
        let through = usize::from(current) + 1;
        let kept = |plan: &[MissionItem]| plan.get(..through).map(<[_]>::to_vec);
        let unchanged = match (kept(held), kept(intended)) {
            (Some(old), Some(new)) => {
                changes(vehicle.autopilot(), mission_type, &old, &new).is_empty()
            }
            _ => false,
        };
        if !unchanged {
            let why = format!("items up to the current one ({current}) would change");
            return Err(Obstacle::InFlight { why });
        }
        if vehicle.autopilot() != Autopilot::ArduPilot {
            for (item, seq) in intended.iter_mut().zip(0..) {
                item.current = u8::from(seq == current);
            }
        }
        Ok(Some(Self { current }))
    }

    fn is_as_before(&self, state: &VehicleState) -> bool {
        state.mission_current.is_none_or(|now| now.seq == self.current)
    }

    /// Whether the vehicle goes on with the item that it was flying to, or with a later one.
    pub(super) async fn has_gone_on(&self, vehicle: &Vehicle) -> Result<(), Obstacle> {
        /// MISSION_CURRENT comes once a second.
        const NEXT_REPORT: Duration = Duration::from_millis(1500);
        let moved_back =
            |state: &VehicleState| state.mission_current.is_some_and(|now| now.seq < self.current);
        match vehicle.wait_for(NEXT_REPORT, moved_back).await {
            None => Ok(()),
            Some(state) => {
                let now = state.mission_current.map_or(0, |now| now.seq);
                let why = format!("it went back from item {} to item {now}", self.current);
                Err(Obstacle::InFlight { why })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::message::MissionCurrent;

    fn state(autopilot: u8, kind: u8, custom_mode: u32, armed: bool) -> VehicleState {
        let base_mode = if armed { 128 } else { 0 };
        let heartbeat = Heartbeat { custom_mode, kind, autopilot, base_mode, system_status: 4 };
        VehicleState::new(heartbeat, tokio::time::Instant::now())
    }

    #[test]
    fn who_flies_a_mission_is_told_by_mode_and_by_mission_state() {
        let flies = |armed, kind, mode| {
            is_flying_mission(Autopilot::ArduPilot, &state(3, kind, mode, armed))
        };
        assert!(flies(true, 2, 3) && !flies(true, 2, 5) && !flies(false, 2, 3), "Copter");
        assert!(flies(true, 1, 10) && !flies(true, 1, 3), "Plane");
        assert!(flies(true, 7, 0), "an airship: not known, so it does");
        let px4 = |mode| is_flying_mission(Autopilot::Px4, &state(12, 2, mode, true));
        assert!(px4(0x0404_0000) && !px4(0x0304_0000) && !px4(3));
        let mut loitering = state(3, 2, 5, true);
        loitering.mission_current =
            Some(MissionCurrent { seq: 2, total: 5, state: 3, mode: 0, plan_ids: [0; 3] });
        assert!(is_flying_mission(Autopilot::ArduPilot, &loitering), "it says so itself");
    }
}
