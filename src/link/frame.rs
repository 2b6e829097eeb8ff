//! What travels over a link: [`Received`] is one frame that came in whole, [`Packet`] one message
//! on its way out. Framing and checksums are the `mavlink` crate's; payloads stay bytes until
//! somebody asks for a message of a certain type.

use std::net::SocketAddr;

use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::error::{EncoderError, ParserError};
use mavlink::{
    Dialect, MAVLinkMessageRaw, MAVLinkV2MessageRaw, MavHeader, MavlinkVersion, Message,
    MessageData,
};
use tokio::time::Instant;

use super::id::{ComponentId, Node, SystemId};
use super::signing::{SIGNED, Signer};

/// The largest payload of a MAVLink frame, bytes.
const MAX_PAYLOAD: usize = 255;

/// One frame with a valid checksum.
#[derive(Debug, Clone)]
pub struct Received {
    /// Who sent it.
    pub from: Node,
    /// `true` for a MAVLink 1 frame, which carries no mission type and no signature.
    pub is_version_1: bool,
    /// Whether it bears a signature; the link has checked it where it has a key.
    pub is_signed: bool,
    /// When it was read.
    pub at: Instant,
    /// From which address, on a datagram link.
    pub peer: Option<SocketAddr>,
    message_id: u32,
    length: u8,
    payload: [u8; MAX_PAYLOAD],
}

impl Received {
    /// Takes a raw frame apart. `None` where the system id does not fit MAVLink's classic 8 bits,
    /// which no vehicle that speaks the mission protocol has.
    pub(crate) fn new(raw: &MAVLinkMessageRaw, peer: Option<SocketAddr>) -> Option<Self> {
        let mut payload = [0; MAX_PAYLOAD];
        let bytes = raw.payload();
        payload[..bytes.len()].copy_from_slice(bytes);
        Some(Self {
            from: Node {
                system: SystemId(u8::try_from(raw.system_id()).ok()?),
                component: ComponentId(raw.component_id()),
            },
            is_version_1: raw.version() == MavlinkVersion::V1,
            is_signed: matches!(raw, MAVLinkMessageRaw::V2(raw) if raw.incompatibility_flags() & SIGNED != 0),
            at: Instant::now(),
            peer,
            message_id: raw.message_id(),
            length: u8::try_from(bytes.len()).ok()?,
            payload,
        })
    }

    /// A frame as if it had come in, for tests of what reads frames.
    #[cfg(test)]
    pub(crate) fn from_packet(from: Node, packet: &Packet) -> Self {
        Self::new(&MAVLinkMessageRaw::V2(packet.to_frame(from, 0, None)), None).unwrap()
    }

    /// The message, where it is a `D` that can be decoded.
    #[must_use]
    pub fn decode<D: MessageData>(&self) -> Option<D> {
        if self.message_id != D::ID {
            return None;
        }
        D::deser(MavlinkVersion::V2, &self.payload[..usize::from(self.length)]).ok()
    }

    /// Which message it is.
    #[must_use]
    pub fn message_id(&self) -> u32 {
        self.message_id
    }
}

/// One message to send. The link adds header, sequence number and checksum when it goes out.
#[derive(Debug, Clone)]
pub struct Packet {
    message_id: u32,
    length: usize,
    payload: [u8; MAX_PAYLOAD],
}

impl Packet {
    /// Serialises a message of the crate's dialect or of [`super::message`].
    #[must_use]
    pub fn new<D: MessageData>(message: &D) -> Self {
        let mut payload = [0; MAX_PAYLOAD];
        let length = message.ser(MavlinkVersion::V2, &mut payload);
        Self { message_id: D::ID, length, payload }
    }

    /// The frame, ready for the line; signed where there is a signer.
    pub(crate) fn to_frame(
        &self,
        from: Node,
        sequence: u8,
        signer: Option<&mut Signer>,
    ) -> MAVLinkV2MessageRaw {
        let header =
            MavHeader { system_id: from.system.0.into(), component_id: from.component.0, sequence };
        let mut frame = MAVLinkV2MessageRaw::new();
        // Fails for a message without checksum seed only, and `Packet::new` takes none such.
        let encoded = match &signer {
            None => frame.serialize_message_with_dialect(header, &Wire, self),
            Some(_) => frame.serialize_message_with_dialect_for_signing(header, &Wire, self),
        };
        debug_assert!(encoded.is_ok());
        if let Some(signer) = signer {
            signer.sign(&mut frame);
        }
        frame
    }
}

/// ArduPilot's dialect (a superset of `common`) as far as framing needs it: the checksum seeds.
pub(crate) struct Wire;

impl Dialect for Wire {
    type Message = Packet;
    type EncodeError = EncoderError;

    fn message_id(&self, message: &Packet) -> u32 {
        message.message_id
    }

    fn extra_crc(&self, message_id: u32) -> Option<u8> {
        // The generated table answers 0 for what it does not know; no known message has 0.
        Some(MavMessage::extra_crc(message_id)).filter(|&seed| seed != 0)
    }

    fn decode(&self, _: MavlinkVersion, id: u32, bytes: &[u8]) -> Result<Packet, ParserError> {
        let mut payload = [0; MAX_PAYLOAD];
        let Some(to) = payload.get_mut(..bytes.len()) else {
            let actual = bytes.len();
            return Err(ParserError::InvalidPayloadSize { id, maximum: MAX_PAYLOAD, actual });
        };
        to.copy_from_slice(bytes);
        Ok(Packet { message_id: id, length: bytes.len(), payload })
    }

    fn encode(
        &self,
        _: MavlinkVersion,
        message: &Packet,
        payload: &mut [u8],
    ) -> Result<usize, EncoderError> {
        payload[..message.length].copy_from_slice(&message.payload[..message.length]);
        Ok(message.length)
    }
}
