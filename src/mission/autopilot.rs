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
