//! What the vehicle says about itself all the time: a task that keeps the latest of it, and asks
//! for what an autopilot does not send unasked.

use std::time::Duration;

use mavlink::MessageData;
use mavlink::dialects::ardupilotmega::{
    COMMAND_LONG_DATA, GLOBAL_POSITION_INT_DATA, HOME_POSITION_DATA, MavCmd,
};
use tokio::sync::watch;
use tokio::time::{Instant, MissedTickBehavior};

use crate::geodesy::{LatLon, LatLonE7};
use crate::link::message::{Heartbeat, MissionCurrent};
use crate::link::{Inbox, Link, LinkError, Node, Received};
use crate::mission::Home;

/// How often to see whether the streams we asked for are coming, and ask again: an autopilot
/// forgets them when it restarts.
const ASK_AGAIN: Duration = Duration::from_secs(3);
/// The streams that are wanted. Once a second is enough for planning on the ground; MISSION_CURRENT
/// tells that there is another plan, which somebody waits to see answered.
const STREAMS: [(u32, Duration); 3] = [
    (HOME_POSITION_DATA::ID, Duration::from_secs(1)),
    (GLOBAL_POSITION_INT_DATA::ID, Duration::from_secs(1)),
    (MissionCurrent::ID, Duration::from_millis(500)),
];

/// The latest known state of a vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct VehicleState {
    /// Its last heartbeat.
    pub heartbeat: Heartbeat,
    /// When that came.
    pub heartbeat_at: Instant,
    /// When anything came from its autopilot. Does not wake who watches the state.
    pub heard_at: Instant,
    /// Home, once the vehicle has one.
    pub home: Option<Home>,
    /// Where it is, once it knows.
    pub position: Option<Position>,
    /// Which mission item is flown, in the vehicle's numbering.
    pub mission_current: Option<MissionCurrent>,
}

/// Where a vehicle is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Latitude and longitude.
    pub position: LatLon,
    /// Metres above mean sea level.
    pub altitude_amsl: f32,
    /// Metres above home.
    pub altitude_relative: f32,
}

impl VehicleState {
    pub(super) fn new(heartbeat: Heartbeat, at: Instant) -> Self {
        Self {
            heartbeat,
            heartbeat_at: at,
            heard_at: at,
            home: None,
            position: None,
            mission_current: None,
        }
    }

    /// Whether the motors may turn.
    #[must_use]
    pub fn is_armed(&self) -> bool {
        self.heartbeat.is_armed()
    }

    /// Takes in a frame of this vehicle's autopilot. `false` where it says nothing of interest.
    fn take(&mut self, received: &Received) -> bool {
        self.heard_at = received.at;
        if let Some(heartbeat) = received.decode::<Heartbeat>() {
            self.heartbeat = heartbeat;
            self.heartbeat_at = received.at;
        } else if let Some(home) = received.decode::<HOME_POSITION_DATA>() {
            let Some(position) = place(home.latitude, home.longitude) else { return false };
            self.home = Some(Home { position, altitude_amsl: metres(home.altitude) });
        } else if let Some(at) = received.decode::<GLOBAL_POSITION_INT_DATA>() {
            let Some(position) = place(at.lat, at.lon) else { return false };
            self.position = Some(Position {
                position,
                altitude_amsl: metres(at.alt),
                altitude_relative: metres(at.relative_alt),
            });
        } else if let Some(current) = received.decode::<MissionCurrent>() {
            self.mission_current = Some(current);
        } else {
            return false;
        }
        true
    }
}

/// A position, unless it is out of range or the 0, 0 of an autopilot that has none yet.
fn place(lat: i32, lon: i32) -> Option<LatLon> {
    if lat == 0 && lon == 0 {
        return None;
    }
    LatLonE7 { lat, lon }.to_degrees().ok()
}

fn metres(millimetres: i32) -> f32 {
    (f64::from(millimetres) / 1000.0) as f32
}

/// Follows `vehicle` until the link ends or nobody watches any more.
pub(super) async fn follow(
    link: Link,
    mut inbox: Inbox,
    vehicle: Node,
    state: watch::Sender<VehicleState>,
) -> LinkError {
    let mut streams = Streams::default();
    let mut ask = tokio::time::interval(ASK_AGAIN);
    ask.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            () = state.closed() => return LinkError::Closed,
            received = inbox.next() => match received {
                Ok(received) if received.from == vehicle => {
                    streams.heard(received.message_id());
                    state.send_if_modified(|state| state.take(&received));
                },
                Ok(_) => {},
                Err(error) => return error,
            },
            _ = ask.tick() => {
                for (message_id, interval) in streams.missing() {
                    let request = command(
                        vehicle,
                        MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL,
                        [message_id as f32, interval.as_micros() as f32],
                    );
                    if let Err(error) = link.send(&request).await {
                        return error;
                    }
                }
            },
        }
    }
}

/// Which of the wanted streams came since they were last looked at.
#[derive(Default)]
struct Streams {
    heard: [bool; STREAMS.len()],
}

impl Streams {
    fn heard(&mut self, message_id: u32) {
        if let Some(k) = STREAMS.iter().position(|(wanted, _)| *wanted == message_id) {
            self.heard[k] = true;
        }
    }

    /// Those that did not come, counted anew from now on.
    fn missing(&mut self) -> Vec<(u32, Duration)> {
        let heard = std::mem::take(&mut self.heard);
        STREAMS
            .into_iter()
            .zip(heard)
            .filter(|(_, heard)| !heard)
            .map(|(stream, _)| stream)
            .collect()
    }
}

/// A COMMAND_LONG with its first two parameters; the others are 0.
pub(super) fn command(target: Node, command: MavCmd, params: [f32; 2]) -> COMMAND_LONG_DATA {
    COMMAND_LONG_DATA {
        param1: params[0],
        param2: params[1],
        command,
        target_system: target.system.0,
        target_component: target.component.0,
        ..COMMAND_LONG_DATA::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_zero_is_no_position_yet() {
        assert_eq!(place(0, 0), None);
        assert_eq!(place(i32::MAX, 0), None);
        assert!(place(0, 10_000_000).is_some());
    }

    #[test]
    fn a_stream_that_stopped_is_asked_for_again() {
        let mut streams = Streams::default();
        assert_eq!(streams.missing(), STREAMS);
        for (id, _) in STREAMS {
            streams.heard(id);
        }
        assert!(streams.missing().is_empty());
        streams.heard(MissionCurrent::ID);
        assert_eq!(streams.missing(), STREAMS[..2]);
    }
}
