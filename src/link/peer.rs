//! Whom a datagram link talks to.
//!
//! Until the vehicle is found, answers go to whoever sent the last frame. From then on the link
//! talks and listens to the vehicle's address only; what others send is dropped unread. A vehicle
//! may come back under another address (a new lease, another radio), so after ten seconds of its
//! silence frames from elsewhere are looked at again, and a heartbeat of its autopilot moves the
//! link there. With signing that heartbeat is signed; without, whoever can send datagrams to quavd
//! can pretend to be a vehicle that is silent, as to any unsigned MAVLink program. The address of a
//! `udpout` link is the user's and never moves.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::time::Instant;

use super::frame::Received;
use super::id::{ComponentId, SystemId};
use super::message::Heartbeat;

/// Ten heartbeats missed: the vehicle is not just out of range for a moment.
const SILENCE: Duration = Duration::from_secs(10);

/// The address a datagram link talks to, shared by its two directions.
#[derive(Clone)]
pub(super) struct Peer(Arc<Mutex<State>>);

enum State {
    /// The user's.
    Fixed(SocketAddr),
    /// Not known, or of whoever spoke last.
    Open(Option<SocketAddr>),
    /// The vehicle's.
    Pinned { address: SocketAddr, system: SystemId, heard_at: Instant },
}

impl Peer {
    pub(super) fn fixed(address: SocketAddr) -> Self {
        Self(Arc::new(Mutex::new(State::Fixed(address))))
    }

    pub(super) fn open() -> Self {
        Self(Arc::new(Mutex::new(State::Open(None))))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Where to send to.
    pub(super) fn address(&self) -> Option<SocketAddr> {
        match *self.state() {
            State::Fixed(address) | State::Pinned { address, .. } => Some(address),
            State::Open(address) => address,
        }
    }

    /// Whether to look at a datagram at all.
    pub(super) fn accepts(&self, from: SocketAddr) -> bool {
        match *self.state() {
            State::Fixed(address) => address == from,
            State::Open(_) => true,
            State::Pinned { address, heard_at, .. } => {
                address == from || heard_at.elapsed() >= SILENCE
            }
        }
    }

    /// A frame came from there that is valid and, where there is a key, signed. `false` where it
    /// is nobody's that this link listens to.
    pub(super) fn heard(&self, from: SocketAddr, frame: &Received) -> bool {
        let mut state = self.state();
        match &mut *state {
            State::Fixed(address) => *address == from,
            State::Open(address) => {
                *address = Some(from);
                true
            }
            State::Pinned { address, system, heard_at } => {
                let is_of_vehicle = frame.from.system == *system;
                if *address != from {
                    if heard_at.elapsed() < SILENCE || !is_of_vehicle || !is_autopilot(frame) {
                        return false;
                    }
                    tracing::warn!(%system, before = %address, now = %from, "the vehicle moved");
                    *address = from;
                }
                if is_of_vehicle {
                    *heard_at = frame.at;
                }
                true
            }
        }
    }

    /// From now on talk and listen to this address only, as that of `system`. A fixed address
    /// stays.
    pub(super) fn pin(&self, address: SocketAddr, system: SystemId) {
        let mut state = self.state();
        if !matches!(*state, State::Fixed(_)) {
            *state = State::Pinned { address, system, heard_at: Instant::now() };
        }
    }
}

fn is_autopilot(frame: &Received) -> bool {
    frame.from.component == ComponentId::AUTOPILOT
        && frame.decode().is_some_and(|beat: Heartbeat| beat.autopilot != Heartbeat::NO_AUTOPILOT)
}

#[cfg(test)]
mod tests {
    use mavlink::MAVLinkMessageRaw;

    use super::*;
    use crate::link::frame::Packet;
    use crate::link::id::Node;

    fn address(port: u16) -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], port))
    }

    fn heartbeat(system: u8, component: u8, autopilot: u8) -> Received {
        let node = Node { system: SystemId(system), component: ComponentId(component) };
        let beat = Heartbeat { custom_mode: 0, kind: 2, autopilot, base_mode: 0, system_status: 4 };
        let frame = Packet::new(&beat).to_frame(node, 0, None);
        Received::new(&MAVLinkMessageRaw::V2(frame), None).unwrap()
    }

    #[tokio::test(start_paused = true)]
    async fn the_vehicles_address_holds_until_it_is_silent_and_speaks_from_elsewhere() {
        let peer = Peer::open();
        assert!(peer.accepts(address(1)) && peer.heard(address(1), &heartbeat(7, 1, 3)));
        assert!(peer.heard(address(2), &heartbeat(1, 1, 3)));
        assert_eq!(peer.address(), Some(address(2)), "whoever spoke last");
        peer.pin(address(2), SystemId(1));
        assert!(!peer.accepts(address(1)));
        assert!(!peer.heard(address(1), &heartbeat(1, 1, 3)));
        assert_eq!(peer.address(), Some(address(2)));

        tokio::time::advance(SILENCE).await;
        assert!(peer.accepts(address(2)) && peer.accepts(address(3)));
        for stranger in [heartbeat(2, 1, 3), heartbeat(1, 100, 3), heartbeat(1, 1, 8)] {
            assert!(!peer.heard(address(3), &stranger), "{stranger:?}");
        }
        assert!(peer.heard(address(3), &heartbeat(1, 1, 3)));
        assert_eq!(peer.address(), Some(address(3)));
        assert!(!peer.accepts(address(2)));
    }

    #[tokio::test(start_paused = true)]
    async fn another_system_behind_the_same_address_is_not_the_vehicle() {
        let peer = Peer::open();
        peer.pin(address(2), SystemId(1));
        tokio::time::advance(SILENCE / 2).await;
        assert!(peer.heard(address(2), &heartbeat(9, 1, 3)), "let in, but proves nothing");
        tokio::time::advance(SILENCE / 2).await;
        assert!(peer.accepts(address(3)));
    }

    #[tokio::test(start_paused = true)]
    async fn a_users_address_never_moves() {
        let peer = Peer::fixed(address(1));
        peer.pin(address(2), SystemId(1));
        tokio::time::advance(2 * SILENCE).await;
        assert!(!peer.accepts(address(2)));
        assert!(!peer.heard(address(2), &heartbeat(1, 1, 3)));
        assert_eq!(peer.address(), Some(address(1)));
    }
}
