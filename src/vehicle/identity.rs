//! Which vehicle this is: what is saved of one must never be written to another.

use std::fmt;
use std::str::FromStr;

use super::discovery::Autopilot;
use crate::link::SystemId;

/// A flight controller's own number, of AUTOPILOT_VERSION: `uid2`, or `uid` where there is no
/// `uid2`. Zero is none.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Uid([u8; 18]);

impl Uid {
    /// From the two fields of AUTOPILOT_VERSION (148); the longer one is the one to use where it
    /// is not zero.
    #[must_use]
    pub fn from_version(uid: u64, uid2: [u8; 18]) -> Option<Self> {
        let mut short = [0; 18];
        short[..8].copy_from_slice(&uid.to_le_bytes());
        [uid2, short].into_iter().find(|bytes| bytes.iter().any(|&byte| byte != 0)).map(Self)
    }
}

impl fmt::Display for Uid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Uid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Uid({self})")
    }
}

/// A text that is no [`Uid`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("not the 36 hexadecimal digits of a flight controller's number")]
pub struct UidError;

impl FromStr for Uid {
    type Err = UidError;

    fn from_str(text: &str) -> Result<Self, UidError> {
        let digits = text.as_bytes();
        if digits.len() != 36 || !digits.iter().all(u8::is_ascii_hexdigit) {
            return Err(UidError);
        }
        let mut bytes = [0; 18];
        for (byte, pair) in bytes.iter_mut().zip(digits.chunks(2)) {
            let pair = std::str::from_utf8(pair).map_err(|_| UidError)?;
            *byte = u8::from_str_radix(pair, 16).map_err(|_| UidError)?;
        }
        Ok(Self(bytes))
    }
}

/// By what a vehicle is told from others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VehicleId {
    /// Its system id. Most vehicles have the same: 1.
    pub system: SystemId,
    /// Its flight software.
    pub autopilot: Autopilot,
    /// Its flight controller's own number, where it has told.
    pub uid: Option<Uid>,
}

impl VehicleId {
    /// Whether the two can be the same vehicle, as far as is known.
    #[must_use]
    pub fn may_be(&self, other: &Self) -> bool {
        let apart = matches!((self.uid, other.uid), (Some(a), Some(b)) if a != b);
        self.system == other.system && self.autopilot == other.autopilot && !apart
    }

    /// Whether the two are known to be the same vehicle.
    #[must_use]
    pub fn is(&self, other: &Self) -> bool {
        self.may_be(other) && self.uid.is_some() && self.uid == other.uid
    }
}

impl fmt::Display for VehicleId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "system {} ({})", self.system, self.autopilot)?;
        self.uid.map_or(Ok(()), |uid| write!(f, ", flight controller {uid}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vehicle(uid: u64) -> VehicleId {
        VehicleId {
            system: SystemId(1),
            autopilot: Autopilot::ArduPilot,
            uid: Uid::from_version(uid, [0; 18]),
        }
    }

    #[test]
    fn two_flight_controllers_with_one_system_id_are_told_apart() {
        assert!(vehicle(5).is(&vehicle(5)));
        assert!(!vehicle(5).may_be(&vehicle(6)));
        assert!(vehicle(5).may_be(&vehicle(0)) && !vehicle(5).is(&vehicle(0)));
        assert!(vehicle(0).may_be(&vehicle(0)) && !vehicle(0).is(&vehicle(0)));
        let px4 = VehicleId { autopilot: Autopilot::Px4, ..vehicle(5) };
        assert!(!px4.may_be(&vehicle(5)));
    }

    #[test]
    fn a_number_is_written_and_read_back_and_the_long_one_counts() {
        let mut long = [0; 18];
        long[17] = 0xab;
        let uid = Uid::from_version(7, long).unwrap();
        assert_eq!(uid.to_string().parse(), Ok(uid));
        assert!(uid.to_string().ends_with("ab"));
        assert_eq!("é".repeat(18).parse::<Uid>(), Err(UidError));
        assert_eq!("12".parse::<Uid>(), Err(UidError));
    }
}
