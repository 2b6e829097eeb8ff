//! Missions as MAVLink's mission protocol knows them: items, commands, frames.
//!
//! [`item`] is the raw item, exactly what travels on the wire; [`commands`] says what its command
//! means for the path. [`legs()`] makes stretches between places of the items, [`splice()`] puts
//! waypoints into the items so that nothing else changes. Nothing here does I/O.

pub mod altitude;
pub mod autopilot;
pub mod commands;
mod curve;
mod insertion;
pub mod item;
mod itinerary;
mod jumps;
pub mod legs;
mod places;
pub mod remaining;
pub mod splice;
#[cfg(test)]
mod testing;

pub use autopilot::Autopilot;
pub use commands::LoiterHabit;
pub use item::{Command, Frame, MissionItem, MissionType};
pub use legs::{FlightContext, Leg, LegError, MissionLegs, legs};
pub use remaining::{RemainingError, rejoined, remaining};
pub use splice::{Detour, SpliceError, Spliced, splice};

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
