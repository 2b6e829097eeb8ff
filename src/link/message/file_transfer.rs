//! The one message of MAVLink FTP, with the layout of its payload (MAVLink guide, "File Transfer
//! Protocol", "Payload Format").

use super::*;

/// FILE_TRANSFER_PROTOCOL (110): a request, or the answer to one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileTransfer {
    /// To whom.
    pub target: Node,
    /// Of a request: its number; of an answer: one more than that.
    pub seq: u16,
    /// The open file it is about.
    pub session: u8,
    /// What is asked, or [`Self::ACK`] or [`Self::NAK`].
    pub opcode: u8,
    /// Bytes of `data` that count, or that are asked for.
    pub size: u8,
    /// What an answer answers.
    pub req_opcode: u8,
    /// Where in the file.
    pub offset: u32,
    /// A path, bytes of a file, or the number of an error.
    pub data: [u8; Self::MOST_DATA],
}

impl FileTransfer {
    /// Bytes that fit into one message.
    pub const MOST_DATA: usize = 239;
    /// Ends a session.
    pub const TERMINATE_SESSION: u8 = 1;
    /// Opens a file for reading.
    pub const OPEN_FILE_RO: u8 = 4;
    /// Reads from an open file.
    pub const READ_FILE: u8 = 5;
    /// Asks for the checksum of a file.
    pub const CALC_FILE_CRC32: u8 = 14;
    /// It was done.
    pub const ACK: u8 = 128;
    /// It was not.
    pub const NAK: u8 = 129;

    /// The bytes that count.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.data[..usize::from(self.size).min(Self::MOST_DATA)]
    }

    fn encode(&self) -> [u8; 254] {
        let head = [0, self.target.system.0, self.target.component.0];
        let request = [self.session, self.opcode, self.size, self.req_opcode, 0, 0];
        joined(&[&head, &self.seq.to_le_bytes(), &request, &self.offset.to_le_bytes(), &self.data])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self {
            target: fields.node(1),
            seq: fields.u16(3),
            session: fields.u8(5),
            opcode: fields.u8(6),
            size: fields.u8(7),
            req_opcode: fields.u8(8),
            offset: fields.u32(11),
            data: fields.bytes(15),
        }
    }
}
message!(FileTransfer, "FILE_TRANSFER_PROTOCOL", id 110, crc 84, length 254);
