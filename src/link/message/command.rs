//! Commands, as they are asked of a component.

use super::*;

/// COMMAND_LONG (76), also what is read of a COMMAND_INT (75).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandLong {
    /// The first of its seven parameters; the others mean nothing to quavd.
    pub param1: f32,
    /// `MAV_CMD`, which need not be one that is known.
    pub command: u16,
    /// To whom.
    pub target: Node,
    /// How often it was sent before.
    pub confirmation: u8,
}

impl CommandLong {
    fn encode(&self) -> [u8; 33] {
        let target = [self.target.system.0, self.target.component.0, self.confirmation];
        let none = [0; 24];
        joined(&[&self.param1.to_le_bytes(), &none, &self.command.to_le_bytes(), &target])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self {
            param1: fields.f32(0),
            command: fields.u16(28),
            target: fields.node(30),
            confirmation: fields.u8(32),
        }
    }
}
message!(CommandLong, "COMMAND_LONG", id 76, crc 152, length 33);

/// COMMAND_INT (75): a command with a place, which quavd takes as one without.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandInt(pub CommandLong);

impl CommandInt {
    fn encode(&self) -> [u8; 35] {
        let Self(CommandLong { param1, command, target, .. }) = self;
        let target = [target.system.0, target.component.0, 0, 0, 0];
        joined(&[&param1.to_le_bytes(), &[0; 24], &command.to_le_bytes(), &target])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self(CommandLong {
            param1: fields.f32(0),
            command: fields.u16(28),
            target: fields.node(30),
            confirmation: 0,
        })
    }
}
message!(CommandInt, "COMMAND_INT", id 75, crc 158, length 35);

/// COMMAND_ACK (77).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CommandAck {
    /// `MAV_CMD` that is answered.
    pub command: u16,
    /// `MAV_RESULT`; 0 is "accepted".
    pub result: u8,
    /// How far a command in progress is, percent; 255 where that is not known.
    pub progress: u8,
    /// To whom; 0 in both where the firmware is old.
    pub target: Node,
}

#[allow(missing_docs)] // the names are MAV_RESULT's own
impl CommandAck {
    pub const ACCEPTED: u8 = 0;
    pub const TEMPORARILY_REJECTED: u8 = 1;
    pub const DENIED: u8 = 2;
    pub const UNSUPPORTED: u8 = 3;
    pub const FAILED: u8 = 4;
    pub const IN_PROGRESS: u8 = 5;
    pub const CANCELLED: u8 = 6;

    fn encode(&self) -> [u8; 10] {
        let target = [self.target.system.0, self.target.component.0];
        let no_param2 = [0; 4];
        let result = [self.result, self.progress];
        joined(&[&self.command.to_le_bytes(), &result, &no_param2, &target])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self {
            command: fields.u16(0),
            result: fields.u8(2),
            progress: fields.u8(3),
            target: fields.node(8),
        }
    }
}
message!(CommandAck, "COMMAND_ACK", id 77, crc 143, length 10);
