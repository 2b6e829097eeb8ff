//! One item of a mission, fence or rally plan, field for field as `MISSION_ITEM_INT` (73) carries
//! it. Unknown commands and frames are kept as they are: what quavd does not understand it must
//! be able to hand back unchanged.

use std::fmt;

use crate::geodesy::{LatLon, LatLonE7, PositionError};

/// Which of the vehicle's three plans (`MAV_MISSION_TYPE`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MissionType {
    /// The mission that is flown.
    Mission = 0,
    /// The geofence.
    Fence = 1,
    /// The rally (safe return) points.
    Rally = 2,
}

impl fmt::Display for MissionType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mission => "mission",
            Self::Fence => "fence",
            Self::Rally => "rally",
        })
    }
}

/// A `MAV_CMD` number. Any value is allowed; the constants are those that quavd understands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Command(pub u16);

#[allow(missing_docs)] // the names are MAV_CMD's own
impl Command {
    pub const NAV_WAYPOINT: Self = Self(16);
    pub const NAV_LOITER_UNLIM: Self = Self(17);
    pub const NAV_LOITER_TURNS: Self = Self(18);
    pub const NAV_LOITER_TIME: Self = Self(19);
    pub const NAV_RETURN_TO_LAUNCH: Self = Self(20);
    pub const NAV_LAND: Self = Self(21);
    pub const NAV_TAKEOFF: Self = Self(22);
    pub const NAV_LOITER_TO_ALT: Self = Self(31);
    pub const NAV_ROI: Self = Self(80);
    pub const NAV_SPLINE_WAYPOINT: Self = Self(82);
    pub const NAV_VTOL_TAKEOFF: Self = Self(84);
    pub const NAV_VTOL_LAND: Self = Self(85);
    pub const NAV_DELAY: Self = Self(93);
    /// The last of the navigation commands (`MAV_CMD_NAV_LAST`).
    pub const NAV_LAST: Self = Self(95);
    pub const CONDITION_DELAY: Self = Self(112);
    pub const CONDITION_CHANGE_ALT: Self = Self(113);
    pub const CONDITION_DISTANCE: Self = Self(114);
    pub const DO_JUMP: Self = Self(177);
    pub const DO_SET_HOME: Self = Self(179);
    pub const DO_CHANGE_ALTITUDE: Self = Self(186);
    pub const DO_RETURN_PATH_START: Self = Self(188);
    pub const DO_LAND_START: Self = Self(189);
    pub const DO_SET_ROI: Self = Self(201);
    pub const JUMP_TAG: Self = Self(600);
    pub const DO_JUMP_TAG: Self = Self(601);
    pub const NAV_FENCE_RETURN_POINT: Self = Self(5000);
    pub const NAV_FENCE_POLYGON_VERTEX_INCLUSION: Self = Self(5001);
    pub const NAV_FENCE_POLYGON_VERTEX_EXCLUSION: Self = Self(5002);
    pub const NAV_FENCE_CIRCLE_INCLUSION: Self = Self(5003);
    pub const NAV_FENCE_CIRCLE_EXCLUSION: Self = Self(5004);
    pub const NAV_RALLY_POINT: Self = Self(5100);
}

/// A `MAV_FRAME` number. Any value is allowed; the constants are those of mission items.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Frame(pub u8);

#[allow(missing_docs)] // the names are MAV_FRAME's own
impl Frame {
    pub const GLOBAL: Self = Self(0);
    pub const MISSION: Self = Self(2);
    pub const GLOBAL_RELATIVE_ALT: Self = Self(3);
    pub const GLOBAL_INT: Self = Self(5);
    pub const GLOBAL_RELATIVE_ALT_INT: Self = Self(6);
    pub const GLOBAL_TERRAIN_ALT: Self = Self(10);
    pub const GLOBAL_TERRAIN_ALT_INT: Self = Self(11);

    /// Whether x and y are latitude and longitude in this frame.
    #[must_use]
    pub fn is_global(self) -> bool {
        matches!(self.0, 0 | 3 | 5 | 6 | 10 | 11)
    }
}

/// One item as on the wire. `x` and `y` are degrees times 1e7 in the global frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MissionItem {
    /// Index in its plan.
    pub seq: u16,
    /// Coordinate frame.
    pub frame: Frame,
    /// What to do.
    pub command: Command,
    /// 1 on the item to start with, in some plans; else 0.
    pub current: u8,
    /// 1 to go on to the next item by itself.
    pub autocontinue: u8,
    /// `param1` to `param4`; NaN means "unset" for several commands.
    pub params: [f32; 4],
    /// Latitude times 1e7 in a global frame.
    pub x: i32,
    /// Longitude times 1e7 in a global frame.
    pub y: i32,
    /// Altitude in metres, in the frame's reference.
    pub z: f32,
}

impl MissionItem {
    /// The item's latitude and longitude as integers, whatever its frame means by them.
    #[must_use]
    pub fn e7(&self) -> LatLonE7 {
        LatLonE7 { lat: self.x, lon: self.y }
    }

    /// The item's position, read as latitude and longitude.
    ///
    /// # Errors
    /// [`PositionError::OutOfRange`] where the integers are no position.
    pub fn position(&self) -> Result<LatLon, PositionError> {
        self.e7().to_degrees()
    }
}
