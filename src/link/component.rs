//! quavd as a MAVLink component: one task owns the line, reads it, writes it, and beats the heart
//! once a second. Everybody else holds a [`Link`] and sees every frame that came in.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use mavlink::{MAVLinkMessageRaw, MessageData};
use tokio::sync::{broadcast, mpsc, watch};
use tokio::task::JoinHandle;
use tokio::time::{MissedTickBehavior, timeout};
use tokio_util::sync::CancellationToken;

use super::frame::{Packet, Received};
use super::id::{ComponentId, Node, SystemId};
use super::message::Heartbeat;
use super::peer::Peer;
use super::signing::{Rejection, Signer};
use super::transport::{Sink, Source, Transport};

/// MAVLink asks for one heartbeat a second from every component, also when idle.
const HEARTBEAT_INTERVAL: Duration = Duration::from_secs(1);
/// Frames that a slow reader may fall behind before it loses the oldest.
const RECEIVED_CAPACITY: usize = 1024;
/// Messages that may wait to be written.
const OUTGOING_CAPACITY: usize = 64;
/// A line that takes nothing for this long is broken.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);

/// Who quavd is on the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// Its system id until the vehicle's is known; an onboard component shares the vehicle's.
    pub system: SystemId,
    /// Its component id, unique on the vehicle.
    pub component: ComponentId,
}

impl Default for Identity {
    /// `MAV_COMP_ID_PATHPLANNER` on system 1, the number most vehicles have.
    fn default() -> Self {
        Self { system: SystemId(1), component: ComponentId::PATH_PLANNER }
    }
}

/// Why nothing more goes through a link.
#[derive(Debug, Clone, thiserror::Error)]
pub enum LinkError {
    /// Reading or writing failed for good.
    #[error("the link was lost: {0}; see that the cable or network is up, then try again")]
    Lost(Arc<io::Error>),
    /// The line takes no more bytes.
    #[error("the link takes no data for 5 s; see that the other side is running and reading")]
    Stalled,
    /// The link was closed from this side.
    #[error("the link is closed")]
    Closed,
}

/// A handle on an open link. Clones are cheap and share it.
#[derive(Clone)]
pub struct Link {
    shared: Arc<Shared>,
    outgoing: mpsc::Sender<Packet>,
    ended: watch::Receiver<Option<LinkError>>,
}

struct Shared {
    system: AtomicU8,
    component: ComponentId,
    received: broadcast::WeakSender<Received>,
    peer: Option<Peer>,
    signer: Option<Mutex<Signer>>,
    refused: Mutex<Refused>,
}

/// The task behind a [`Link`]. Shut it down and await it with [`LinkTask::close`].
pub struct LinkTask {
    cancel: CancellationToken,
    handle: JoinHandle<()>,
}

impl LinkTask {
    /// Ends the task: what was handed over for sending is written, then the line is closed.
    pub async fn close(self) {
        self.cancel.cancel();
        if let Err(error) = self.handle.await {
            tracing::error!(%error, "the link task failed");
        }
    }
}

impl Link {
    /// Starts the task that owns `transport`. It ends when `cancel` is cancelled or the line fails.
    #[must_use]
    pub fn start(
        transport: Transport,
        identity: Identity,
        cancel: CancellationToken,
    ) -> (Self, LinkTask) {
        let (received, _) = broadcast::channel(RECEIVED_CAPACITY);
        let (outgoing, to_send) = mpsc::channel(OUTGOING_CAPACITY);
        let (end, ended) = watch::channel(None);
        let shared = Arc::new(Shared {
            system: AtomicU8::new(identity.system.0),
            component: identity.component,
            received: received.downgrade(),
            peer: transport.source.peer(),
            signer: transport.signer.map(Mutex::new),
            refused: Mutex::default(),
        });
        let link = Self { shared: Arc::clone(&shared), outgoing, ended };
        let (source, sink) = (transport.source, transport.sink);
        let stop = cancel.clone();
        let handle = tokio::spawn(async move {
            let error = tokio::select! {
                error = read(source, &shared, &received) => error,
                error = write(sink, &shared, to_send, &stop) => error,
            };
            if let Some(mut signer) = shared.signer() {
                signer.close();
            }
            match &error {
                LinkError::Closed => tracing::debug!("link closed"),
                error => tracing::warn!(%error, "link ended"),
            }
            // Told before `received` is dropped: who sees its end can ask why.
            end.send_replace(Some(error));
        });
        (link, LinkTask { cancel, handle })
    }

    /// Who we are on this link.
    #[must_use]
    pub fn node(&self) -> Node {
        self.shared.node()
    }

    /// Takes the vehicle's system id as our own, as an onboard component does.
    pub fn adopt_system(&self, system: SystemId) {
        self.shared.system.store(system.0, Ordering::Relaxed);
    }

    /// On a datagram link, talk and listen to this address only from now on, as that of `system`.
    /// When the vehicle has been silent for ten seconds and its heartbeat comes from elsewhere, the
    /// link follows it there.
    pub fn pin_peer(&self, address: SocketAddr, system: SystemId) {
        if let Some(peer) = &self.shared.peer {
            peer.pin(address, system);
        }
    }

    /// Why frames were dropped for their signature, and how many each.
    #[must_use]
    pub fn refused(&self) -> BTreeMap<Rejection, u64> {
        self.shared.refused().counts.clone()
    }

    /// All frames that come in from now on. A reader that falls more than a thousand frames behind
    /// loses the oldest, as it could on the line itself.
    ///
    /// # Errors
    /// The reason, where the link has ended.
    pub fn subscribe(&self) -> Result<Inbox, LinkError> {
        let sender = self.shared.received.upgrade().ok_or_else(|| self.end_reason())?;
        Ok(Inbox { frames: sender.subscribe(), link: self.clone() })
    }

    /// Hands a message over for sending. Waits while the line is busy.
    ///
    /// # Errors
    /// The reason, where the link has ended or takes nothing for five seconds.
    pub async fn send<D: MessageData>(&self, message: &D) -> Result<(), LinkError> {
        match timeout(WRITE_TIMEOUT, self.outgoing.send(Packet::new(message))).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) => Err(self.end_reason()),
            Err(_) => Err(LinkError::Stalled),
        }
    }

    fn end_reason(&self) -> LinkError {
        self.ended.borrow().clone().unwrap_or(LinkError::Closed)
    }
}

/// The frames of one subscription.
pub struct Inbox {
    frames: broadcast::Receiver<Received>,
    link: Link,
}

impl Inbox {
    /// The link whose frames these are.
    #[must_use]
    pub fn link(&self) -> &Link {
        &self.link
    }

    /// The next frame.
    ///
    /// # Errors
    /// The reason, where the link has ended.
    pub async fn next(&mut self) -> Result<Received, LinkError> {
        loop {
            match self.frames.recv().await {
                Ok(received) => return Ok(received),
                Err(broadcast::error::RecvError::Lagged(frames)) => {
                    tracing::debug!(frames, "fell behind the link");
                }
                Err(broadcast::error::RecvError::Closed) => return Err(self.link.end_reason()),
            }
        }
    }
}

impl Shared {
    fn signer(&self) -> Option<MutexGuard<'_, Signer>> {
        Some(self.signer.as_ref()?.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn refused(&self) -> MutexGuard<'_, Refused> {
        self.refused.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a frame is one to be read: signed as it should be, and from where we listen to.
    fn lets_in(&self, raw: &MAVLinkMessageRaw, frame: &Received) -> bool {
        match self.signer() {
            Some(mut signer) => {
                if let Err(rejection) = signer.admit(raw) {
                    self.refused().count(rejection, frame.from);
                    return false;
                }
            }
            None if frame.is_signed => self.refused().tell_of_signed(frame.from),
            None => {}
        }
        match (&self.peer, frame.peer) {
            (Some(peer), Some(from)) => peer.heard(from, frame),
            _ => true,
        }
    }

    fn node(&self) -> Node {
        let system = SystemId(self.system.load(Ordering::Relaxed));
        Node { system, component: self.component }
    }
}

/// Frames that were dropped for their signature. Told once for each sender and reason.
#[derive(Default)]
struct Refused {
    counts: BTreeMap<Rejection, u64>,
    told: BTreeSet<(Rejection, Node)>,
    told_of_signed: bool,
}

impl Refused {
    /// Senders whose frames are told of; the numbers in a forged frame are endless.
    const MOST_TOLD: usize = 16;

    fn count(&mut self, rejection: Rejection, from: Node) {
        *self.counts.entry(rejection).or_default() += 1;
        if self.told.len() < Self::MOST_TOLD && self.told.insert((rejection, from)) {
            tracing::warn!(node = %from, reason = %rejection, "frames are dropped");
        }
    }

    fn tell_of_signed(&mut self, from: Node) {
        if !std::mem::replace(&mut self.told_of_signed, true) {
            tracing::warn!(
                node = %from,
                "frames are signed and quavd has no key: it cannot tell who sent them, and the \
                 vehicle may not listen; give the key with --signing-key"
            );
        }
    }
}

async fn read(
    mut source: Source,
    shared: &Shared,
    received: &broadcast::Sender<Received>,
) -> LinkError {
    let mut told_of_own_id = false;
    loop {
        let (raw, peer) = match source.next().await {
            Ok(next) => next,
            Err(error) => return LinkError::Lost(Arc::new(error)),
        };
        let Some(frame) = Received::new(&raw, peer) else { continue };
        if !shared.lets_in(&raw, &frame) {
            continue;
        }
        if frame.from == shared.node() {
            // An echo of our own, or a second component with our id.
            if !std::mem::replace(&mut told_of_own_id, true) {
                tracing::warn!(node = %frame.from, "frames with our own id come in; ignored");
            }
            continue;
        }
        // Fails only while nobody listens.
        let _ = received.send(frame);
    }
}

async fn write(
    mut sink: Sink,
    shared: &Shared,
    mut to_send: mpsc::Receiver<Packet>,
    stop: &CancellationToken,
) -> LinkError {
    let mut sequence = 0_u8;
    let mut beat = tokio::time::interval(HEARTBEAT_INTERVAL);
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let heartbeat = Packet::new(&Heartbeat {
        custom_mode: 0,
        kind: Heartbeat::ONBOARD_CONTROLLER,
        autopilot: Heartbeat::NO_AUTOPILOT,
        base_mode: 0,
        system_status: Heartbeat::ACTIVE,
    });
    loop {
        let packet = tokio::select! {
            biased;
            _ = beat.tick() => heartbeat.clone(),
            packet = to_send.recv() => match packet {
                Some(packet) => packet,
                // No handle is left, so nobody can send or listen any more.
                None => return LinkError::Closed,
            },
            () = stop.cancelled() => return LinkError::Closed,
        };
        let frame = packet.to_frame(shared.node(), sequence, shared.signer().as_deref_mut());
        sequence = sequence.wrapping_add(1);
        match timeout(WRITE_TIMEOUT, sink.send(frame.raw_bytes())).await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return LinkError::Lost(Arc::new(error)),
            Err(_) => return LinkError::Stalled,
        }
    }
}
