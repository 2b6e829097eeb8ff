//! What downloads and uploads have in common: sorting the vehicle's answers from everything else
//! on the line, and the ways in which a transfer fails.

use std::fmt;
use std::time::Duration;

use mavlink::MessageData;
use tokio::time::{Instant, timeout_at};

use super::Vehicle;
use super::text::TextLog;
use super::timing::{Patience, RoundTrip, Timing};
use crate::link::message::{
    MissionAck, MissionCount, MissionItemInt, MissionRequest, MissionRequestInt, StatusText,
};
use crate::link::{Inbox, LinkError, Node, Received};
use crate::mission::{MissionItem, MissionType};

/// More items than any autopilot holds; a larger count is a lie and not followed.
pub const MOST_ITEMS: u16 = 8192;

/// How far a transfer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// To or from the vehicle.
    pub direction: Direction,
    /// Which plan.
    pub mission_type: MissionType,
    /// Items that are through.
    pub done: usize,
    /// Items in all.
    pub total: usize,
}

/// Which way items go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// From the vehicle.
    Download,
    /// To the vehicle.
    Upload,
}

/// Is told how far a transfer is, item by item.
pub type OnProgress<'a> = &'a mut (dyn FnMut(Progress) + Send);

/// A `MAV_MISSION_RESULT`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissionResult(pub u8);

#[allow(missing_docs)] // the names are MAV_MISSION_RESULT's own
impl MissionResult {
    pub const ACCEPTED: Self = Self(0);
    pub const ERROR: Self = Self(1);
    pub const NO_SPACE: Self = Self(4);
    pub const INVALID_SEQUENCE: Self = Self(13);
    pub const DENIED: Self = Self(14);
    pub const OPERATION_CANCELLED: Self = Self(15);
}

impl fmt::Display for MissionResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const NAMES: [&str; 16] = [
            "accepted",
            "error",
            "unsupported frame",
            "unsupported command",
            "no space",
            "invalid",
            "invalid param1",
            "invalid param2",
            "invalid param3",
            "invalid param4",
            "invalid x",
            "invalid y",
            "invalid z",
            "invalid sequence",
            "denied",
            "cancelled",
        ];
        match NAMES.get(usize::from(self.0)) {
            Some(name) => f.write_str(name),
            None => write!(f, "result {}", self.0),
        }
    }
}

/// Why a transfer did not come to its end.
#[derive(Debug, Clone, thiserror::Error)]
pub enum TransferError {
    /// The link is gone.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The vehicle does not answer any more.
    #[error(
        "no answer from the vehicle for {:.0} s while waiting for {awaited} of the {mission_type}; \
         see that it is on and in range, then try again",
        waited.as_secs_f64()
    )]
    NoAnswer {
        /// Which plan.
        mission_type: MissionType,
        /// What was waited for.
        awaited: Awaited,
        /// How long.
        waited: Duration,
    },
    /// Somebody else's transfer did not end.
    #[error(
        "another ground station has been transferring the {mission_type} for {:.0} s; wait until it \
         is done, then try again",
        waited.as_secs_f64()
    )]
    Busy {
        /// Which plan.
        mission_type: MissionType,
        /// How long it was waited for.
        waited: Duration,
    },
    /// The vehicle said no.
    #[error(
        "the vehicle refused the {mission_type}{}: {result}{}",
        item.map(|seq| format!(" at item {seq}")).unwrap_or_default(),
        if texts.is_empty() { String::new() } else { format!(" (it says: {})", texts.join("; ")) }
    )]
    Refused {
        /// Which plan.
        mission_type: MissionType,
        /// Its answer.
        result: MissionResult,
        /// The last item that it was sent, in an upload.
        item: Option<u16>,
        /// What it said in words around that moment.
        texts: Vec<String>,
    },
    /// The vehicle broke the transfer off and would not have it again.
    #[error("the vehicle broke off the transfer of the {mission_type} {times} times; try again")]
    BrokenOff {
        /// Which plan.
        mission_type: MissionType,
        /// How often.
        times: u32,
    },
    /// The vehicle has not room enough.
    #[error(
        "the {mission_type} has {count} items, and the vehicle has room for {}{}; plan with fewer \
         waypoints (--max-waypoints N)",
        most.map_or_else(|| "fewer".to_owned(), |most| most.to_string()),
        if texts.is_empty() { String::new() } else { format!(" (it says: {})", texts.join("; ")) }
    )]
    NoSpace {
        /// Which plan.
        mission_type: MissionType,
        /// What was to be uploaded.
        count: usize,
        /// What the vehicle holds at most, where it says so.
        most: Option<usize>,
        /// What it said in words around that moment.
        texts: Vec<String>,
    },
    /// quavd broke an upload off.
    #[error(
        "the upload of the {mission_type} was called off: the vehicle was armed meanwhile, or went \
         on to another item of its mission"
    )]
    CalledOff {
        /// Which plan.
        mission_type: MissionType,
    },
    /// The plan cannot be that long.
    #[error("the vehicle announces {count} items of the {mission_type}, more than {MOST_ITEMS}")]
    TooManyAnnounced {
        /// Which plan.
        mission_type: MissionType,
        /// What was announced.
        count: u16,
    },
    /// The list does not fit the protocol.
    #[error("{count} items are more than a {mission_type} can have ({MOST_ITEMS})")]
    TooManyToSend {
        /// Which plan.
        mission_type: MissionType,
        /// How many.
        count: usize,
    },
}

/// What a transfer waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Awaited {
    /// The number of items.
    Count,
    /// An item.
    Item(u16),
    /// The request for an item.
    Request(u16),
    /// The acknowledgement at the end.
    Acknowledgement,
}

impl fmt::Display for Awaited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count => f.write_str("the count"),
            Self::Item(seq) => write!(f, "item {seq}"),
            Self::Request(seq) => write!(f, "the request for item {seq}"),
            Self::Acknowledgement => f.write_str("the acknowledgement"),
        }
    }
}

impl TransferError {
    /// Whether the vehicle could not be reached, rather than having said no.
    #[must_use]
    pub fn is_unreachable(&self) -> bool {
        matches!(self, Self::Link(_) | Self::NoAnswer { .. } | Self::BrokenOff { .. })
    }
}

/// A message of the mission protocol that is meant for the running transfer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Heard {
    Count {
        count: u16,
        opaque_id: u32,
    },
    Item(MissionItem),
    /// MISSION_REQUEST or MISSION_REQUEST_INT: both are answered with a MISSION_ITEM_INT.
    Request(u16),
    Ack {
        result: MissionResult,
        opaque_id: u32,
    },
}

/// One transfer: what it sends, and what it hears of the autopilot's answers.
pub(super) struct Exchange<'a> {
    pub(super) vehicle: &'a Vehicle,
    pub(super) mission_type: MissionType,
    pub(super) round_trip: RoundTrip,
    inbox: Inbox,
    texts: TextLog,
}

impl<'a> Exchange<'a> {
    pub(super) fn new(
        vehicle: &'a Vehicle,
        mission_type: MissionType,
    ) -> Result<Self, TransferError> {
        Ok(Self {
            vehicle,
            mission_type,
            round_trip: RoundTrip::new(),
            inbox: vehicle.link.subscribe()?,
            texts: TextLog::default(),
        })
    }

    pub(super) fn timing(&self) -> &'a Timing {
        &self.vehicle.timing
    }

    pub(super) fn target(&self) -> Node {
        self.vehicle.node
    }

    pub(super) fn wire_type(&self) -> u8 {
        self.mission_type as u8
    }

    pub(super) async fn send<D: MessageData>(&self, message: &D) -> Result<(), TransferError> {
        Ok(self.vehicle.link.send(message).await?)
    }

    /// The next message of this transfer; `None` at the deadline.
    pub(super) async fn next_before(
        &mut self,
        deadline: Instant,
    ) -> Result<Option<Heard>, TransferError> {
        while let Ok(received) = timeout_at(deadline, self.inbox.next()).await {
            let received = received?;
            if received.from != self.vehicle.node {
                continue;
            }
            if let Some(text) = received.decode::<StatusText>() {
                self.texts.push(&text, received.at);
            } else if let Some(heard) = self.sort(&received) {
                return Ok(Some(heard));
            }
        }
        Ok(None)
    }

    /// The message, where it is meant for us and for this plan. A ground station's transfer on the
    /// same line is neither.
    fn sort(&self, received: &Received) -> Option<Heard> {
        let (target, mission_type, heard) = if let Some(it) = received.decode::<MissionItemInt>() {
            (it.target, it.mission_type, Heard::Item(it.item))
        } else if let Some(it) = received.decode::<MissionRequestInt>() {
            (it.target, it.mission_type, Heard::Request(it.seq))
        } else if let Some(MissionRequest(it)) = received.decode() {
            (it.target, it.mission_type, Heard::Request(it.seq))
        } else if let Some(it) = received.decode::<MissionAck>() {
            let result = MissionResult(it.result);
            (it.target, it.mission_type, Heard::Ack { result, opaque_id: it.opaque_id })
        } else if let Some(it) = received.decode::<MissionCount>() {
            let heard = Heard::Count { count: it.count, opaque_id: it.opaque_id };
            (it.target, it.mission_type, heard)
        } else {
            return None;
        };
        let is_ours = target == self.vehicle.link.node() && mission_type == self.wire_type();
        is_ours.then_some(heard)
    }

    /// Looks closer at an acknowledgement that says no: waits for the words that belong to it,
    /// which come before or after it, and for signs that it was not meant for this transfer.
    pub(super) async fn refusal(
        &mut self,
        result: MissionResult,
        item: Option<u16>,
    ) -> Result<Refusal, TransferError> {
        let deadline = Instant::now() + self.timing().explanation;
        while let Some(heard) = self.next_before(deadline).await? {
            match heard {
                Heard::Ack { result: MissionResult::ACCEPTED, .. } => return Ok(Refusal::Accepted),
                Heard::Request(seq) => return Ok(Refusal::Asked(seq)),
                Heard::Ack { .. } | Heard::Count { .. } | Heard::Item(_) => {}
            }
        }
        let age = self.timing().explanation + self.timing().explanation_age;
        let texts = self.texts.recent(age);
        let mission_type = self.mission_type;
        Ok(Refusal::Meant(TransferError::Refused { mission_type, result, item, texts }))
    }

    /// Counts one more wait that was in vain. `true` when it is time to give up.
    pub(super) fn is_hopeless(&self, patience: &mut Patience) -> bool {
        patience.is_exhausted(self.timing(), self.vehicle.silent_for())
    }

    pub(super) fn no_answer(&self, awaited: Awaited, waited: Duration) -> TransferError {
        TransferError::NoAnswer { mission_type: self.mission_type, awaited, waited }
    }
}

/// What an acknowledgement that says no turns out to be, on a line that repeats and reorders.
pub(super) enum Refusal {
    /// A refusal.
    Meant(TransferError),
    /// The answer to a repeated last item: the first one was accepted.
    Accepted,
    /// Left from earlier: the vehicle goes on asking for items.
    Asked(u16),
}

/// What ends one attempt at a transfer.
pub(super) enum Setback {
    /// Begin again: the vehicle lost the thread, or we did.
    Again(TransferError),
    /// Beginning again would change nothing.
    Final(TransferError),
}

impl From<TransferError> for Setback {
    fn from(error: TransferError) -> Self {
        Self::Final(error)
    }
}

/// Waits out a busy vehicle: remembers since when, and when to stop.
#[derive(Default)]
pub(super) struct BusyWait {
    since: Option<Instant>,
}

impl BusyWait {
    /// Pauses before the next try, or gives up.
    pub(super) async fn pause(&mut self, exchange: &Exchange<'_>) -> Result<(), TransferError> {
        let since = *self.since.get_or_insert_with(Instant::now);
        let timing = exchange.timing();
        if since.elapsed() >= timing.busy {
            let mission_type = exchange.mission_type;
            return Err(TransferError::Busy { mission_type, waited: since.elapsed() });
        }
        tracing::info!(plan = %exchange.mission_type, "the vehicle is busy with another transfer; waiting");
        tokio::time::sleep(timing.busy_pause()).await;
        Ok(())
    }
}
