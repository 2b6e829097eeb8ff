//! MAVLink 2 message signing (MAVLink guide, "Message Signing"): which frames are let in, and the
//! signature on those that go out.
//!
//! [`key`] is the secret and where it comes from, [`clock`] the timestamps and how they outlive a
//! restart. The `mavlink` crate computes the signature; what it accepts is decided here, because
//! the crate keeps no timestamp over a restart and knows no exception for radios.

pub mod clock;
pub mod key;

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

use mavlink::{MAVLinkMessageRaw, MAVLinkV2MessageRaw};

pub use clock::TimestampError;
use clock::{Clock, Timestamp};
pub use key::{Key, KeyError, KeySource};

/// `MAVLINK_IFLAG_SIGNED`.
pub(super) const SIGNED: u8 = 0x01;
/// RADIO_STATUS comes from a radio between the two ends, which has no key.
const RADIO_STATUS: u32 = 109;
/// Streams that are remembered. Only who holds the key can make one.
const MOST_STREAMS: usize = 256;
/// A stream that was not heard before may lag behind by this much: one minute.
const NEW_STREAM_LAG: u64 = 60 * Timestamp::PER_SECOND;

/// What becomes of frames without a signature, where there is a key. A frame with a wrong one is
/// never let in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UnsignedPolicy {
    /// None is let in.
    Reject,
    /// Only RADIO_STATUS, which telemetry radios put in.
    #[default]
    RadioStatus,
    /// All are let in: signing then protects the vehicle only.
    Accept,
}

impl fmt::Display for UnsignedPolicy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Reject => "reject",
            Self::RadioStatus => "radio-status",
            Self::Accept => "accept",
        })
    }
}

impl FromStr for UnsignedPolicy {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "reject" => Ok(Self::Reject),
            "radio-status" => Ok(Self::RadioStatus),
            "accept" => Ok(Self::Accept),
            _ => Err(format!("'{text}' is not reject, radio-status or accept")),
        }
    }
}

impl UnsignedPolicy {
    fn lets_in(self, message_id: u32) -> bool {
        match self {
            Self::Reject => false,
            Self::RadioStatus => message_id == RADIO_STATUS,
            Self::Accept => true,
        }
    }
}

/// How a link is signed, as a command line or a configuration file says it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SigningSettings {
    /// Where the key is.
    pub key: KeySource,
    /// What becomes of frames without a signature.
    pub unsigned: UnsignedPolicy,
    /// Tells apart links of one component with the same key.
    pub link_id: u8,
}

/// Why a link cannot be signed.
#[derive(Debug, thiserror::Error)]
pub enum SigningError {
    /// The key.
    #[error(transparent)]
    Key(#[from] KeyError),
    /// The timestamp of the last run.
    #[error(transparent)]
    Timestamp(#[from] TimestampError),
}

/// The state of signing on one link.
#[derive(Debug)]
pub struct Signer {
    key: Key,
    unsigned: UnsignedPolicy,
    link_id: u8,
    clock: Clock,
    /// The newest timestamp of each stream: link id, system, component.
    streams: BTreeMap<(u8, u8, u8), Timestamp>,
}

/// Why a frame was not let in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Rejection {
    /// It has no signature.
    Unsigned,
    /// Its signature was made with another key, or it was changed on the way.
    WrongSignature,
    /// It was there before.
    Replayed,
    /// Its sender's clock is more than a minute behind.
    TooOld,
    /// There are more senders than can be remembered.
    TooManyStreams,
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unsigned => "not signed",
            Self::WrongSignature => "signed with another key",
            Self::Replayed => "replayed",
            Self::TooOld => "timestamp more than a minute old",
            Self::TooManyStreams => "from too many senders",
        })
    }
}

impl Signer {
    /// Reads the key, and the timestamp of the last run from `state_directory`, to which it will
    /// also be written.
    ///
    /// # Errors
    /// [`SigningError`].
    pub fn open(settings: &SigningSettings, state_directory: &Path) -> Result<Self, SigningError> {
        let key = settings.key.read()?;
        let clock = Clock::open(state_directory, settings.link_id)?;
        Ok(Self::new(key, settings.unsigned, settings.link_id, clock))
    }

    pub(crate) fn new(key: Key, unsigned: UnsignedPolicy, link_id: u8, clock: Clock) -> Self {
        Self { key, unsigned, link_id, clock, streams: BTreeMap::new() }
    }

    /// Whether a frame is let in.
    pub(crate) fn admit(&mut self, frame: &MAVLinkMessageRaw) -> Result<(), Rejection> {
        let signed = match frame {
            MAVLinkMessageRaw::V2(frame) if frame.incompatibility_flags() & SIGNED != 0 => frame,
            // MAVLink 1 has no signatures.
            other if self.unsigned.lets_in(other.message_id()) => return Ok(()),
            _ => return Err(Rejection::Unsigned),
        };
        // First of all: nothing that an unsigned frame says is believed, nor remembered.
        let mut expected = [0; 6];
        signed.calculate_signature(self.key.bytes(), &mut expected);
        if !equal_in_constant_time(&expected, signed.signature_value()) {
            return Err(Rejection::WrongSignature);
        }
        let timestamp = Timestamp(signed.signature_timestamp());
        let system = u8::try_from(signed.system_id()).map_err(|_| Rejection::TooManyStreams)?;
        let stream = (signed.signature_link_id(), system, signed.component_id());
        match self.streams.get(&stream) {
            Some(&newest) if timestamp <= newest => return Err(Rejection::Replayed),
            Some(_) => {}
            None if timestamp.0.saturating_add(NEW_STREAM_LAG) < self.clock.now().0 => {
                return Err(Rejection::TooOld);
            }
            None if self.streams.len() >= MOST_STREAMS => return Err(Rejection::TooManyStreams),
            None => {}
        }
        self.streams.insert(stream, timestamp);
        self.clock.raise(timestamp);
        Ok(())
    }

    /// Signs a frame that was made for it (`serialize_message_with_dialect_for_signing`).
    pub(crate) fn sign(&mut self, frame: &mut MAVLinkV2MessageRaw) {
        let timestamp = self.clock.next().0.to_le_bytes();
        *frame.signature_link_id_mut() = self.link_id;
        frame.signature_timestamp_bytes_mut().copy_from_slice(&timestamp[..6]);
        let mut signature = [0; 6];
        frame.calculate_signature(self.key.bytes(), &mut signature);
        frame.signature_value_mut().copy_from_slice(&signature);
    }

    /// Writes the last timestamp down, at the end of a link.
    pub(crate) fn close(&mut self) {
        self.clock.close();
    }
}

/// Does not tell by its duration how many bytes were right.
fn equal_in_constant_time(a: &[u8], b: &[u8]) -> bool {
    let difference = a.iter().zip(b).fold(0, |seen, (x, y)| std::hint::black_box(seen | (x ^ y)));
    a.len() == b.len() && difference == 0
}

#[cfg(test)]
mod tests;
