//! Which autopilot flies the mission, as far as that changes the path it flies.

/// The autopilot's kind, from `HEARTBEAT.autopilot` or a plan's `firmwareType`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Autopilot {
    /// `MAV_AUTOPILOT_ARDUPILOTMEGA` (3). Takes off where it stands, whatever place a takeoff has.
    ArduPilot,
    /// `MAV_AUTOPILOT_PX4` (12). Climbs, then flies to the takeoff's place.
    Px4,
    /// Not known: what either of them would fly must be clear.
    #[default]
    Unknown,
}

impl Autopilot {
    /// The number of repeats of a `DO_JUMP` that makes it always jump. ArduPilot has -1 for that
    /// (`AP_MISSION_JUMP_REPEAT_FOREVER`); PX4 keeps 16 bits without a sign, and jumping 65,535
    /// times takes longer than any battery lasts.
    #[must_use]
    pub fn always(self) -> Option<f32> {
        match self {
            Self::ArduPilot => Some(-1.0),
            Self::Px4 => Some(65_535.0),
            Self::Unknown => None,
        }
    }
}
