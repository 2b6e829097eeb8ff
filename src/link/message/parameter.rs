//! The messages of the parameter protocol.

use std::fmt;

use super::*;

/// The name of a parameter: at most 16 bytes of ASCII, zero-filled (`param_id`).
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ParamName([u8; 16]);

impl ParamName {
    /// A name, where the text can be one: 1 to 16 characters of printable ASCII.
    #[must_use]
    pub fn new(name: &str) -> Option<Self> {
        let is_name = (1..=16).contains(&name.len()) && name.bytes().all(|b| b.is_ascii_graphic());
        is_name.then(|| Self(joined(&[name.as_bytes()])))
    }

    pub(super) fn decode(fields: &Fields<'_>, at: usize) -> Self {
        let mut bytes: [u8; 16] = fields.bytes(at);
        // What stands behind the end of the name is no part of it.
        let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
        bytes[end..].fill(0);
        Self(bytes)
    }
}

impl fmt::Display for ParamName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = |byte: u8| if byte.is_ascii_graphic() { byte as char } else { '?' };
        self.0.iter().take_while(|&&byte| byte != 0).try_for_each(|&b| write!(f, "{}", shown(b)))
    }
}

impl fmt::Debug for ParamName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ParamName({self})")
    }
}

/// PARAM_REQUEST_READ (20): asks for one parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParamRequestRead {
    /// To whom.
    pub target: Node,
    /// By its number; -1 to ask by name.
    pub index: i16,
    /// By its name.
    pub name: ParamName,
}

impl ParamRequestRead {
    fn encode(&self) -> [u8; 20] {
        let target = [self.target.system.0, self.target.component.0];
        joined(&[&self.index.to_le_bytes(), &target, &self.name.0])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self { index: fields.i16(0), target: fields.node(2), name: ParamName::decode(fields, 4) }
    }
}
message!(ParamRequestRead, "PARAM_REQUEST_READ", id 20, crc 214, length 20);

/// PARAM_VALUE (22): one parameter, told to everybody.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParamValue {
    /// The four bytes of `param_value`, little endian: a float, or an integer's own bits.
    pub bits: u32,
    /// How many parameters there are.
    pub count: u16,
    /// The number of this one; 65535 where it was asked by name.
    pub index: u16,
    /// Which one.
    pub name: ParamName,
    /// `MAV_PARAM_TYPE`.
    pub kind: u8,
}

impl ParamValue {
    fn encode(&self) -> [u8; 25] {
        joined(&[
            &self.bits.to_le_bytes(),
            &self.count.to_le_bytes(),
            &self.index.to_le_bytes(),
            &self.name.0,
            &[self.kind],
        ])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self {
            bits: fields.u32(0),
            count: fields.u16(4),
            index: fields.u16(6),
            name: ParamName::decode(fields, 8),
            kind: fields.u8(24),
        }
    }
}
message!(ParamValue, "PARAM_VALUE", id 22, crc 220, length 25);

/// PARAM_SET (23): sets one parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParamSet {
    /// The four bytes of `param_value`, as in [`ParamValue`].
    pub bits: u32,
    /// Of whom.
    pub target: Node,
    /// Which one.
    pub name: ParamName,
    /// `MAV_PARAM_TYPE`.
    pub kind: u8,
}

impl ParamSet {
    fn encode(&self) -> [u8; 23] {
        let target = [self.target.system.0, self.target.component.0];
        joined(&[&self.bits.to_le_bytes(), &target, &self.name.0, &[self.kind]])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self {
            bits: fields.u32(0),
            target: fields.node(4),
            name: ParamName::decode(fields, 6),
            kind: fields.u8(22),
        }
    }
}
message!(ParamSet, "PARAM_SET", id 23, crc 168, length 23);

/// PARAM_ERROR (345): a parameter cannot be had. New in 2025; older firmware keeps silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParamError {
    /// To whom.
    pub target: Node,
    /// The number that was asked for; -1 where it was the name.
    pub index: i16,
    /// The name that was asked for.
    pub name: ParamName,
    /// `MAV_PARAM_ERROR`.
    pub error: u8,
}

impl ParamError {
    /// `MAV_PARAM_ERROR_DOES_NOT_EXIST`.
    pub const DOES_NOT_EXIST: u8 = 1;

    fn encode(&self) -> [u8; 21] {
        let target = [self.target.system.0, self.target.component.0];
        joined(&[&self.index.to_le_bytes(), &target, &self.name.0, &[self.error]])
    }

    fn decode(fields: &Fields<'_>) -> Self {
        Self {
            index: fields.i16(0),
            target: fields.node(2),
            name: ParamName::decode(fields, 4),
            error: fields.u8(20),
        }
    }
}
message!(ParamError, "PARAM_ERROR", id 345, crc 209, length 21);
