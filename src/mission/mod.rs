//! Missions as MAVLink's mission protocol knows them: items, commands, frames.
//!
//! [`item`] is the raw item, exactly what travels on the wire. Nothing here does I/O.

pub mod item;

pub use item::{Command, Frame, MissionItem, MissionType};

use crate::geodesy::LatLon;

/// A position with an altitude above mean sea level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Home {
    /// Where.
    pub position: LatLon,
    /// Altitude above mean sea level, metres.
    pub altitude_amsl: f32,
}

/// A mission without the autopilot's home slot: `items[0]` is the first command that is flown.
///
/// `items[k].seq == k`, and the target of a `DO_JUMP` (its `params[0]`) is such an index too.
/// What a vehicle or a file numbers differently (ArduPilot and `QGC WPL 110` count home as item
/// 0, QGroundControl's `.plan` uses `doJumpId`) is converted where it is read and written.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mission {
    /// Home, where it is known.
    pub home: Option<Home>,
    /// The items in the order of their sequence numbers.
    pub items: Vec<MissionItem>,
}
