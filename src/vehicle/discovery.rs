//! Finding the autopilot on a link, by its heartbeat, and what it says it can do.

use std::collections::BTreeMap;
use std::fmt;
use std::time::Duration;

use mavlink::MessageData;
use mavlink::dialects::ardupilotmega::{AUTOPILOT_VERSION_DATA, MavCmd};
use tokio::sync::{Mutex, watch};
use tokio::time::{Instant, timeout_at};

use super::Vehicle;
use super::identity::Uid;
use super::state::{VehicleState, command, follow};
use super::timing::Timing;
use crate::link::message::Heartbeat;
use crate::link::signing::Rejection;
use crate::link::{ComponentId, Inbox, Link, LinkError, Node, Received, SystemId};
use crate::mission;

/// Which flight software a vehicle runs (`MAV_AUTOPILOT`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Autopilot {
    /// ArduPilot (3).
    ArduPilot,
    /// PX4 (12).
    Px4,
    /// Any other, which is talked to as the specification says.
    Other(u8),
}

impl From<Autopilot> for mission::Autopilot {
    fn from(autopilot: Autopilot) -> Self {
        match autopilot {
            Autopilot::ArduPilot => Self::ArduPilot,
            Autopilot::Px4 => Self::Px4,
            Autopilot::Other(_) => Self::Unknown,
        }
    }
}

impl From<u8> for Autopilot {
    fn from(number: u8) -> Self {
        match number {
            3 => Self::ArduPilot,
            12 => Self::Px4,
            other => Self::Other(other),
        }
    }
}

impl Autopilot {
    /// Its `MAV_AUTOPILOT` number.
    #[must_use]
    pub fn number(self) -> u8 {
        match self {
            Self::ArduPilot => 3,
            Self::Px4 => 12,
            Self::Other(number) => number,
        }
    }
}

impl fmt::Display for Autopilot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ArduPilot => f.write_str("ArduPilot"),
            Self::Px4 => f.write_str("PX4"),
            Self::Other(number) => write!(f, "autopilot {number}"),
        }
    }
}

/// `MAV_PROTOCOL_CAPABILITY` bits of AUTOPILOT_VERSION.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capabilities(pub u64);

impl Capabilities {
    const PARAM_ENCODE_BYTEWISE: u64 = 16;
    const FTP: u64 = 32;
    const FENCE: u64 = 16_384;
    const RALLY: u64 = 32_768;

    /// Whether it serves files over MAVLink FTP.
    #[must_use]
    pub fn has_ftp(self) -> bool {
        self.0 & Self::FTP != 0
    }

    /// Whether integer parameters travel with their own bytes, not converted to a float.
    #[must_use]
    pub fn copies_parameter_bytes(self) -> bool {
        self.0 & Self::PARAM_ENCODE_BYTEWISE != 0
    }

    /// Whether it holds its fence as mission items.
    #[must_use]
    pub fn has_fence(self) -> bool {
        self.0 & Self::FENCE != 0
    }

    /// Whether it holds its rally points as mission items.
    #[must_use]
    pub fn has_rally(self) -> bool {
        self.0 & Self::RALLY != 0
    }
}

/// What to look for, and for how long.
#[derive(Debug, Clone)]
pub struct Search {
    /// Only this system; else the one vehicle there is.
    pub system: Option<SystemId>,
    /// How long to wait for a first heartbeat.
    pub patience: Duration,
    /// The waiting times of everything that follows.
    pub timing: Timing,
}

impl Default for Search {
    fn default() -> Self {
        Self { system: None, patience: Duration::from_secs(15), timing: Timing::default() }
    }
}

/// Why no vehicle was found.
#[derive(Debug, thiserror::Error)]
pub enum DiscoveryError {
    /// Nothing that is an autopilot was heard.
    #[error(
        "no autopilot was heard within {} s{}; {}",
        waited.as_secs(),
        wanted.map(|id| format!(" with system id {id}")).unwrap_or_default(),
        heard_hint(heard, refused)
    )]
    NotFound {
        /// The system that was looked for, if a certain one was.
        wanted: Option<SystemId>,
        /// How long.
        waited: Duration,
        /// Who else was heard.
        heard: Vec<Node>,
        /// Frames that were dropped for their signature.
        refused: BTreeMap<Rejection, u64>,
    },
    /// More than one vehicle, and none was chosen.
    #[error(
        "several vehicles are on this link (systems {}); choose one with --system",
        list(systems)
    )]
    Several {
        /// Their system ids.
        systems: Vec<SystemId>,
    },
    /// The link failed meanwhile.
    #[error(transparent)]
    Link(#[from] LinkError),
}

fn list<T: fmt::Display>(items: &[T]) -> String {
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

fn heard_hint(heard: &[Node], refused: &BTreeMap<Rejection, u64>) -> String {
    if !refused.is_empty() {
        let counts: Vec<_> =
            refused.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
        return format!(
            "frames were dropped ({}): see that the signing key is the vehicle's",
            counts.join(", ")
        );
    }
    if heard.is_empty() {
        return "nothing at all was heard: see that the vehicle is on, and that port and baud rate \
                are right"
            .to_owned();
    }
    format!("heard were only: {}", list(heard))
}

/// One period of a heartbeat and some more: how long a second vehicle may take to be heard.
const SECOND_VEHICLE: Duration = Duration::from_millis(1200);
/// Nodes remembered for the error message.
const MOST_HEARD: usize = 16;

/// Finds the vehicle on a link and begins to follow its state.
///
/// An autopilot is a component 1 whose heartbeat names an autopilot; ground stations, gimbals,
/// ADS-B receivers and the like are none. With `search.system` unset, a second vehicle that is heard
/// within a heartbeat's time is an error rather than a guess.
///
/// # Errors
/// [`DiscoveryError`].
pub async fn find(link: &Link, search: &Search) -> Result<Vehicle, DiscoveryError> {
    let mut inbox = link.subscribe()?;
    let (received, heartbeat) = first_autopilot(&mut inbox, search).await?;
    let node = received.from;
    if let Some(address) = received.peer {
        link.pin_peer(address, node.system);
    }
    link.adopt_system(node.system);
    let autopilot = Autopilot::from(heartbeat.autopilot);
    tracing::info!(vehicle = %node, %autopilot, armed = heartbeat.is_armed(), "vehicle found");

    let (send, state) = watch::channel(VehicleState::new(heartbeat, received.at));
    let monitor = tokio::spawn(follow(link.clone(), link.subscribe()?, node, send));
    let version = ask_version(link, &mut inbox, node, autopilot, &search.timing).await?;
    let (capabilities, uid) = version.map_or((None, None), |(it, uid)| (Some(it), uid));
    Ok(Vehicle {
        link: link.clone(),
        node,
        autopilot,
        capabilities,
        uid,
        state,
        monitor,
        timing: search.timing.clone(),
        lacked: std::sync::Mutex::default(),
        transfer: Mutex::new(()),
    })
}

async fn first_autopilot(
    inbox: &mut Inbox,
    search: &Search,
) -> Result<(Received, Heartbeat), DiscoveryError> {
    let mut deadline = Instant::now() + search.patience;
    let mut found: BTreeMap<SystemId, (Received, Heartbeat)> = BTreeMap::new();
    let mut others: Vec<Node> = Vec::new();
    while let Ok(received) = timeout_at(deadline, inbox.next()).await {
        let received = received?;
        match autopilot_heartbeat(&received) {
            Some(heartbeat) if search.system == Some(received.from.system) => {
                return Ok((received, heartbeat));
            }
            Some(heartbeat) if search.system.is_none() => {
                if found.is_empty() {
                    deadline = Instant::now() + SECOND_VEHICLE;
                }
                found.insert(received.from.system, (received, heartbeat));
            }
            _ => {
                if others.len() < MOST_HEARD && !others.contains(&received.from) {
                    others.push(received.from);
                }
            }
        }
    }
    if found.len() > 1 {
        return Err(DiscoveryError::Several { systems: found.into_keys().collect() });
    }
    found.into_values().next().ok_or(DiscoveryError::NotFound {
        wanted: search.system,
        waited: search.patience,
        heard: others,
        refused: inbox.link().refused(),
    })
}

/// The heartbeat, where it is a flight controller's.
fn autopilot_heartbeat(received: &Received) -> Option<Heartbeat> {
    let heartbeat: Heartbeat = received.decode()?;
    let is_autopilot = received.from.component == ComponentId::AUTOPILOT
        && heartbeat.autopilot != Heartbeat::NO_AUTOPILOT
        && heartbeat.kind != Heartbeat::GROUND_STATION;
    is_autopilot.then_some(heartbeat)
}

/// Asks for AUTOPILOT_VERSION. `None` where the vehicle does not say: not an error, since some
/// never do and the protocol itself will show. ArduPilot and PX4 do, and by their number alone an
/// emptied vehicle is told from another one, so that they are asked longer on a bad line.
async fn ask_version(
    link: &Link,
    inbox: &mut Inbox,
    vehicle: Node,
    autopilot: Autopilot,
    timing: &Timing,
) -> Result<Option<(Capabilities, Option<Uid>)>, LinkError> {
    let tries = match autopilot {
        Autopilot::ArduPilot | Autopilot::Px4 => 6,
        Autopilot::Other(_) => 2,
    };
    let params = [AUTOPILOT_VERSION_DATA::ID as f32, 0.0];
    for _ in 0..tries {
        link.send(&command(vehicle, MavCmd::MAV_CMD_REQUEST_MESSAGE, params)).await?;
        let deadline = Instant::now() + timing.request;
        while let Ok(received) = timeout_at(deadline, inbox.next()).await {
            let received = received?;
            if received.from != vehicle {
                continue;
            }
            if let Some(version) = received.decode::<AUTOPILOT_VERSION_DATA>() {
                let uid = Uid::from_version(version.uid, version.uid2);
                return Ok(Some((Capabilities(version.capabilities.bits()), uid)));
            }
        }
    }
    tracing::debug!("the vehicle does not tell its capabilities");
    Ok(None)
}
