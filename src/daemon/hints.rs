//! Signs on the link that somebody changes the vehicle's plans: what an autopilot streams about
//! them, what it says in words, and a transfer that is seen to go on.
//!
//! A sign is no proof: it only makes the daemon look, and looking compares with what was last
//! planned. So one too many costs a download, and one that was missed is found by the next look.

use std::collections::BTreeMap;

use mavlink::MessageData;
use mavlink::dialects::ardupilotmega::{GLOBAL_POSITION_INT_DATA, SYSTEM_TIME_DATA};

use crate::link::message::{
    MissionAck, MissionClearAll, MissionCount, MissionCurrent, MissionItemInt, MissionRequest,
    MissionRequestInt, ParamName, ParamValue, StatusText,
};
use crate::link::{Node, Received};

/// How the words begin in which an autopilot says that it has a new plan.
const WORDS: [&[u8]; 5] = [
    b"Flight plan received",
    b"Fence Indexed OK",
    b"Rally Indexed OK",
    b"Auto mission changed",
    b"Mission: plan received",
];
/// Parameters whose change is a change of the fence, or of what it means.
const PREFIXES: [&str; 6] = ["FENCE_", "GF_", "MIS_TOTAL", "RALLY_", "WPNAV_RADIUS", "NAV_ACC_RAD"];
/// Parameters remembered; an autopilot has a dozen of these.
const MOST_PARAMETERS: usize = 64;

/// What a frame means for the plans on the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Hint {
    /// They may have changed.
    Changed(&'static str),
    /// Somebody is transferring one.
    Transfer,
}

/// Watches the frames of one vehicle.
#[derive(Debug)]
pub(super) struct Hints {
    vehicle: Node,
    us: Node,
    current: Option<(u16, [u32; 3])>,
    parameters: BTreeMap<ParamName, u32>,
    uptime: Option<u32>,
}

impl Hints {
    pub(super) fn new(vehicle: Node, us: Node) -> Self {
        Self { vehicle, us, current: None, parameters: BTreeMap::new(), uptime: None }
    }

    /// Takes in one frame of anybody's.
    pub(super) fn take(&mut self, frame: &Received) -> Option<Hint> {
        if frame.from != self.vehicle {
            return self.transfer_to_vehicle(frame);
        }
        match frame.message_id() {
            MissionCurrent::ID => {
                let now = frame.decode::<MissionCurrent>()?;
                let now = (now.total, now.plan_ids);
                let before = self.current.replace(now)?;
                (before != now).then_some(Hint::Changed("the vehicle counts another plan"))
            }
            StatusText::ID => {
                let text = frame.decode::<StatusText>()?.text;
                let is_news = WORDS.iter().any(|words| text.starts_with(words));
                is_news.then_some(Hint::Changed("the vehicle says that it has a new plan"))
            }
            ParamValue::ID => {
                let value = frame.decode::<ParamValue>()?;
                let name = value.name.to_string();
                if !PREFIXES.iter().any(|prefix| name.starts_with(prefix)) {
                    return None;
                }
                if self.parameters.len() >= MOST_PARAMETERS
                    && !self.parameters.contains_key(&value.name)
                {
                    return None;
                }
                let before = self.parameters.insert(value.name, value.bits)?;
                (before != value.bits).then_some(Hint::Changed("a fence parameter has changed"))
            }
            GLOBAL_POSITION_INT_DATA::ID => {
                self.runs_for(frame.decode::<GLOBAL_POSITION_INT_DATA>()?.time_boot_ms)
            }
            SYSTEM_TIME_DATA::ID => self.runs_for(frame.decode::<SYSTEM_TIME_DATA>()?.time_boot_ms),
            _ => self.transfer_by_vehicle(frame),
        }
    }

    /// Time since boot only falls when there was a boot.
    fn runs_for(&mut self, uptime: u32) -> Option<Hint> {
        /// Frames may arrive out of order.
        const DISORDER: u32 = 2_000;
        let before = self.uptime.replace(uptime)?;
        let restarted = uptime.saturating_add(DISORDER) < before;
        restarted.then_some(Hint::Changed("the vehicle has restarted"))
    }

    /// The vehicle's side of somebody else's transfer.
    fn transfer_by_vehicle(&self, frame: &Received) -> Option<Hint> {
        if let Some(ack) = frame.decode::<MissionAck>() {
            let is_theirs = ack.target != self.us && ack.result == 0;
            return is_theirs.then_some(Hint::Changed("a ground station has transferred a plan"));
        }
        let target = if let Some(request) = frame.decode::<MissionRequestInt>() {
            request.target
        } else if let Some(MissionRequest(request)) = frame.decode() {
            request.target
        } else {
            return None;
        };
        (target != self.us).then_some(Hint::Transfer)
    }

    /// A ground station's side of it. A download changes nothing, but is better not disturbed.
    fn transfer_to_vehicle(&self, frame: &Received) -> Option<Hint> {
        if let Some(clear) = frame.decode::<MissionClearAll>() {
            let is_here = clear.target.system == self.vehicle.system;
            return is_here.then_some(Hint::Changed("a ground station has cleared a plan"));
        }
        let target = if let Some(count) = frame.decode::<MissionCount>() {
            count.target
        } else if let Some(item) = frame.decode::<MissionItemInt>() {
            item.target
        } else if let Some(request) = frame.decode::<MissionRequestInt>() {
            request.target
        } else {
            return None;
        };
        (target == self.vehicle).then_some(Hint::Transfer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::frame::Packet;
    use crate::link::{ComponentId, SystemId};

    const VEHICLE: Node = Node { system: SystemId(1), component: ComponentId::AUTOPILOT };
    const US: Node = Node { system: SystemId(1), component: ComponentId::PATH_PLANNER };
    const GCS: Node = Node { system: SystemId(255), component: ComponentId(190) };

    fn frame<D: MessageData>(from: Node, message: &D) -> Received {
        Received::from_packet(from, &Packet::new(message))
    }

    fn current(total: u16, seq: u16) -> MissionCurrent {
        MissionCurrent { seq, total, state: 0, mode: 0, plan_ids: [0; 3] }
    }

    fn text(words: &str) -> StatusText {
        let mut text = [0; 50];
        text[..words.len()].copy_from_slice(words.as_bytes());
        StatusText { severity: 6, text, id: 0, chunk: 0 }
    }

    #[test]
    fn only_a_new_count_or_id_is_a_change_not_progress_along_the_mission() {
        let mut hints = Hints::new(VEHICLE, US);
        assert_eq!(
            hints.take(&frame(VEHICLE, &current(5, 0))),
            None,
            "the first is news to nobody"
        );
        assert_eq!(hints.take(&frame(VEHICLE, &current(5, 3))), None);
        assert!(matches!(hints.take(&frame(VEHICLE, &current(6, 3))), Some(Hint::Changed(_))));
        let id = MissionCurrent { plan_ids: [0, 9, 0], ..current(6, 3) };
        assert!(matches!(hints.take(&frame(VEHICLE, &id)), Some(Hint::Changed(_))));
    }

    #[test]
    fn what_the_vehicle_says_about_plans_is_heard_and_its_other_words_are_not() {
        let mut hints = Hints::new(VEHICLE, US);
        assert_eq!(hints.take(&frame(VEHICLE, &text("PreArm: GPS"))), None);
        assert!(hints.take(&frame(VEHICLE, &text("Flight plan received"))).is_some());
        assert_eq!(hints.take(&frame(GCS, &text("Flight plan received"))), None);
    }

    #[test]
    fn a_parameter_is_a_change_only_when_it_has_another_value() {
        let value = |name: &str, bits| ParamValue {
            bits,
            count: 900,
            index: 3,
            name: ParamName::new(name).unwrap(),
            kind: 9,
        };
        let mut hints = Hints::new(VEHICLE, US);
        assert_eq!(hints.take(&frame(VEHICLE, &value("FENCE_TOTAL", 5))), None);
        assert_eq!(hints.take(&frame(VEHICLE, &value("FENCE_TOTAL", 5))), None);
        assert!(hints.take(&frame(VEHICLE, &value("FENCE_TOTAL", 6))).is_some());
        hints.take(&frame(VEHICLE, &value("ATC_RAT_P", 1)));
        assert_eq!(hints.take(&frame(VEHICLE, &value("ATC_RAT_P", 2))), None);
    }

    #[test]
    fn others_transfers_are_seen_and_our_own_are_not_signs_of_anything() {
        let mut hints = Hints::new(VEHICLE, US);
        let ack = |target| MissionAck { target, result: 0, mission_type: 0, opaque_id: 0 };
        let request = |target| MissionRequestInt { seq: 1, target, mission_type: 0 };
        assert_eq!(hints.take(&frame(VEHICLE, &ack(US))), None);
        assert!(matches!(hints.take(&frame(VEHICLE, &ack(GCS))), Some(Hint::Changed(_))));
        assert_eq!(hints.take(&frame(VEHICLE, &request(US))), None);
        assert_eq!(
            hints.take(&frame(VEHICLE, &MissionRequest(request(GCS)))),
            Some(Hint::Transfer)
        );
        let count = MissionCount { count: 4, target: VEHICLE, mission_type: 0, opaque_id: 0 };
        assert_eq!(hints.take(&frame(GCS, &count)), Some(Hint::Transfer));
    }

    #[test]
    fn a_clock_that_falls_is_a_restart_and_a_late_frame_is_none() {
        let mut hints = Hints::new(VEHICLE, US);
        let mut at = |ms| {
            let time = SYSTEM_TIME_DATA { time_boot_ms: ms, ..SYSTEM_TIME_DATA::default() };
            hints.take(&frame(VEHICLE, &time))
        };
        assert_eq!(at(60_000), None);
        assert_eq!(at(59_500), None);
        assert!(at(800).is_some());
    }
}
