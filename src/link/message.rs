//! The messages that quavd reads byte by byte itself.
//!
//! The `mavlink` crate's generated types refuse a whole message over one unknown enum value, and a
//! mission item with a command of tomorrow must not be lost over that; nor must the heartbeat of a
//! new kind of vehicle. So the mission protocol, the heartbeat and the other few messages with
//! enums are laid out here, with plain integers (MAVLink `common.xml`; fields sorted by size, then
//! the extensions). All other messages use the generated types.

use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::error::ParserError;
use mavlink::utils::remove_trailing_zeroes;
use mavlink::{MavlinkVersion, MessageData};

use super::id::{ComponentId, Node, SystemId};
use crate::mission::{Command, Frame, MissionItem};

pub use command::{CommandAck, CommandInt, CommandLong};
pub use file_transfer::FileTransfer;
pub use parameter::{ParamError, ParamName, ParamRequestRead, ParamSet, ParamValue};

/// Reads little-endian fields from a payload; what the sender truncated reads as zero.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn bytes<const N: usize>(&self, at: usize) -> [u8; N] {
        std::array::from_fn(|k| self.0.get(at + k).copied().unwrap_or(0))
    }

    fn u8(&self, at: usize) -> u8 {
        self.bytes::<1>(at)[0]
    }

    fn u16(&self, at: usize) -> u16 {
        u16::from_le_bytes(self.bytes(at))
    }

    fn i16(&self, at: usize) -> i16 {
        i16::from_le_bytes(self.bytes(at))
    }

    fn u32(&self, at: usize) -> u32 {
        u32::from_le_bytes(self.bytes(at))
    }

    fn i32(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.bytes(at))
    }

    fn f32(&self, at: usize) -> f32 {
        f32::from_le_bytes(self.bytes(at))
    }

    fn node(&self, at: usize) -> Node {
        Node { system: SystemId(self.u8(at)), component: ComponentId(self.u8(at + 1)) }
    }
}

/// Gives a message its number, its `CRC_EXTRA`, and its place among the crate's messages.
macro_rules! message {
    ($type:ident, $name:literal, id $id:literal, crc $crc:literal, length $length:literal) => {
        impl MessageData for $type {
            type Message = MavMessage;
            const ID: u32 = $id;
            const NAME: &'static str = $name;
            const EXTRA_CRC: u8 = $crc;
            const ENCODED_LEN: usize = $length;

            fn ser(&self, version: MavlinkVersion, payload: &mut [u8]) -> usize {
                let encoded = self.encode();
                payload[..$length].copy_from_slice(&encoded);
                match version {
                    MavlinkVersion::V1 => $length,
                    MavlinkVersion::V2 => remove_trailing_zeroes(&encoded),
                }
            }

            fn deser(_: MavlinkVersion, payload: &[u8]) -> Result<Self, ParserError> {
                Ok(Self::decode(&Fields(payload)))
            }
        }
    };
}

mod command;
mod file_transfer;
mod parameter;

/// Joins byte arrays into one of a known length.
fn joined<const N: usize>(parts: &[&[u8]]) -> [u8; N] {
    let mut out = [0; N];
    for (to, from) in out.iter_mut().zip(parts.iter().copied().flatten()) {
        *to = *from;
    }
    out
}

/// HEARTBEAT (0).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Heartbeat {
    /// The autopilot's own flight mode.
    pub custom_mode: u32,
    /// `MAV_TYPE`.
    pub kind: u8,
    /// `MAV_AUTOPILOT`; 8 where the sender is none.
    pub autopilot: u8,
    /// `MAV_MODE_FLAG` bits; 128 is "armed".
    pub base_mode: u8,
    /// `MAV_STATE`.
    pub system_status: u8,
}

impl Heartbeat {
    /// `MAV_TYPE_ONBOARD_CONTROLLER`.
    pub const ONBOARD_CONTROLLER: u8 = 18;
    /// `MAV_TYPE_GCS`.
    pub const GROUND_STATION: u8 = 6;
    /// `MAV_AUTOPILOT_INVALID`: not a flight controller.
    pub const NO_AUTOPILOT: u8 = 8;
    /// `MAV_STATE_ACTIVE`.
    pub const ACTIVE: u8 = 4;
    const ARMED: u8 = 128;

    /// Whether the motors may turn.
    #[must_use]
    pub fn is_armed(&self) -> bool {
        self.base_mode & Self::ARMED != 0
    }

    fn encode(&self) -> [u8; 9] {
        let rest = [self.kind, self.autopilot, self.base_mode, self.system_status, 3];
        joined(&[&self.custom_mode.to_le_bytes(), &rest])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self {
            custom_mode: fields.u32(0),
            kind: fields.u8(4),
            autopilot: fields.u8(5),
            base_mode: fields.u8(6),
            system_status: fields.u8(7),
        }
    }
}
message!(Heartbeat, "HEARTBEAT", id 0, crc 50, length 9);

/// MISSION_REQUEST_LIST (43): asks for the count of a plan, then its items.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissionRequestList {
    /// To whom.
    pub target: Node,
    /// `MAV_MISSION_TYPE`.
    pub mission_type: u8,
}

impl MissionRequestList {
    fn encode(&self) -> [u8; 3] {
        [self.target.system.0, self.target.component.0, self.mission_type]
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self { target: fields.node(0), mission_type: fields.u8(2) }
    }
}
message!(MissionRequestList, "MISSION_REQUEST_LIST", id 43, crc 132, length 3);

/// MISSION_CLEAR_ALL (45).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissionClearAll {
    /// To whom.
    pub target: Node,
    /// `MAV_MISSION_TYPE`.
    pub mission_type: u8,
}

impl MissionClearAll {
    fn encode(&self) -> [u8; 3] {
        [self.target.system.0, self.target.component.0, self.mission_type]
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self { target: fields.node(0), mission_type: fields.u8(2) }
    }
}
message!(MissionClearAll, "MISSION_CLEAR_ALL", id 45, crc 232, length 3);

/// MISSION_COUNT (44): answers a request list, or offers an upload.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissionCount {
    /// Items in the plan.
    pub count: u16,
    /// To whom.
    pub target: Node,
    /// `MAV_MISSION_TYPE`.
    pub mission_type: u8,
    /// The vehicle's fingerprint of the plan; 0 where it has none.
    pub opaque_id: u32,
}

impl MissionCount {
    fn encode(&self) -> [u8; 9] {
        let rest = [self.target.system.0, self.target.component.0, self.mission_type];
        joined(&[&self.count.to_le_bytes(), &rest, &self.opaque_id.to_le_bytes()])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self {
            count: fields.u16(0),
            target: fields.node(2),
            mission_type: fields.u8(4),
            opaque_id: fields.u32(5),
        }
    }
}
message!(MissionCount, "MISSION_COUNT", id 44, crc 221, length 9);

/// MISSION_REQUEST_INT (51): asks for one item.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissionRequestInt {
    /// Which item.
    pub seq: u16,
    /// To whom.
    pub target: Node,
    /// `MAV_MISSION_TYPE`.
    pub mission_type: u8,
}

impl MissionRequestInt {
    fn encode(&self) -> [u8; 5] {
        let rest = [self.target.system.0, self.target.component.0, self.mission_type];
        joined(&[&self.seq.to_le_bytes(), &rest])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self { seq: fields.u16(0), target: fields.node(2), mission_type: fields.u8(4) }
    }
}
message!(MissionRequestInt, "MISSION_REQUEST_INT", id 51, crc 196, length 5);

/// MISSION_REQUEST (40): the same, deprecated, and what ArduPilot sends. Answered alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissionRequest(pub MissionRequestInt);

impl MissionRequest {
    fn encode(&self) -> [u8; 5] {
        self.0.encode()
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self(MissionRequestInt::decode(fields))
    }
}
message!(MissionRequest, "MISSION_REQUEST", id 40, crc 230, length 5);

/// MISSION_ITEM_INT (73).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MissionItemInt {
    /// The item.
    pub item: MissionItem,
    /// To whom.
    pub target: Node,
    /// `MAV_MISSION_TYPE`.
    pub mission_type: u8,
}

impl MissionItemInt {
    fn encode(&self) -> [u8; 38] {
        let item = &self.item;
        let [p1, p2, p3, p4] = item.params.map(f32::to_le_bytes);
        let rest = [
            self.target.system.0,
            self.target.component.0,
            item.frame.0,
            item.current,
            item.autocontinue,
            self.mission_type,
        ];
        joined(&[
            &p1,
            &p2,
            &p3,
            &p4,
            &item.x.to_le_bytes(),
            &item.y.to_le_bytes(),
            &item.z.to_le_bytes(),
            &item.seq.to_le_bytes(),
            &item.command.0.to_le_bytes(),
            &rest,
        ])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self {
            item: MissionItem {
                seq: fields.u16(28),
                frame: Frame(fields.u8(34)),
                command: Command(fields.u16(30)),
                current: fields.u8(35),
                autocontinue: fields.u8(36),
                params: [fields.f32(0), fields.f32(4), fields.f32(8), fields.f32(12)],
                x: fields.i32(16),
                y: fields.i32(20),
                z: fields.f32(24),
            },
            target: fields.node(32),
            mission_type: fields.u8(37),
        }
    }
}
message!(MissionItemInt, "MISSION_ITEM_INT", id 73, crc 38, length 38);

/// MISSION_ACK (47).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissionAck {
    /// To whom.
    pub target: Node,
    /// `MAV_MISSION_RESULT`.
    pub result: u8,
    /// `MAV_MISSION_TYPE`.
    pub mission_type: u8,
    /// The vehicle's fingerprint of what it now holds; 0 where it has none.
    pub opaque_id: u32,
}

impl MissionAck {
    fn encode(&self) -> [u8; 8] {
        let rest = [self.target.system.0, self.target.component.0, self.result, self.mission_type];
        joined(&[&rest, &self.opaque_id.to_le_bytes()])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self {
            target: fields.node(0),
            result: fields.u8(2),
            mission_type: fields.u8(3),
            opaque_id: fields.u32(4),
        }
    }
}
message!(MissionAck, "MISSION_ACK", id 47, crc 153, length 8);

/// MISSION_CURRENT (42): which item is flown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MissionCurrent {
    /// The current item, in the vehicle's own numbering.
    pub seq: u16,
    /// Items in the mission, without home; 0 or 65535 where not reported.
    pub total: u16,
    /// `MISSION_STATE`: 2 not started, 3 active, 4 paused, 5 complete; 0 unknown.
    pub state: u8,
    /// 1 in mission mode, 2 suspended; 0 unknown.
    pub mode: u8,
    /// The vehicle's fingerprints of its mission, fence and rally points; 0 where it has none.
    pub plan_ids: [u32; 3],
}

impl MissionCurrent {
    fn encode(&self) -> [u8; 18] {
        let [mission, fence, rally] = self.plan_ids.map(u32::to_le_bytes);
        let state = [self.state, self.mode];
        let (seq, total) = (self.seq.to_le_bytes(), self.total.to_le_bytes());
        joined(&[&seq, &total, &state, &mission, &fence, &rally])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self {
            seq: fields.u16(0),
            total: fields.u16(2),
            state: fields.u8(4),
            mode: fields.u8(5),
            plan_ids: [fields.u32(6), fields.u32(10), fields.u32(14)],
        }
    }
}
message!(MissionCurrent, "MISSION_CURRENT", id 42, crc 28, length 18);

/// STATUSTEXT (253): one chunk of a text for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StatusText {
    /// `MAV_SEVERITY`, 0 emergency to 7 debug.
    pub severity: u8,
    /// The bytes of this chunk, zero-filled.
    pub text: [u8; 50],
    /// Equal and not 0 for the chunks of one long text.
    pub id: u16,
    /// Which chunk of it.
    pub chunk: u8,
}

impl StatusText {
    fn encode(&self) -> [u8; 54] {
        joined(&[&[self.severity], &self.text, &self.id.to_le_bytes(), &[self.chunk]])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self {
            severity: fields.u8(0),
            text: fields.bytes(1),
            id: fields.u16(51),
            chunk: fields.u8(53),
        }
    }
}
message!(StatusText, "STATUSTEXT", id 253, crc 83, length 54);

#[cfg(test)]
mod tests;
