//! Who is who on a MAVLink network. Two newtypes, so that a system id cannot be passed where a
//! component id belongs.

use std::fmt;

/// A MAVLink system id: one vehicle, or one ground station. 0 addresses everybody.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SystemId(pub u8);

/// A MAVLink component id: one part of a system (`MAV_COMPONENT`). 0 addresses all parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ComponentId(pub u8);

impl ComponentId {
    /// `MAV_COMP_ID_AUTOPILOT1`.
    pub const AUTOPILOT: Self = Self(1);
    /// `MAV_COMP_ID_PATHPLANNER`, quavd's own by default.
    pub const PATH_PLANNER: Self = Self(195);
}

/// One component of one system: the source or the target of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Node {
    /// Its system.
    pub system: SystemId,
    /// Which part of that system.
    pub component: ComponentId,
}

impl fmt::Display for SystemId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl fmt::Display for ComponentId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl fmt::Display for Node {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "system {} component {}", self.system, self.component)
    }
}
